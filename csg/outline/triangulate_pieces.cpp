// Triangulates an outline of many pieces piece by piece. The triangulation of the whole would
// compare each hole with every edge at its height.
#include "csg/outline/triangulate_pieces.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <optional>
#include <vector>

#include "mesh/polygons/plane_predicates.h"

namespace strata::csg {
namespace {

using Contour = std::vector<glm::dvec2>;
constexpr std::size_t kNoOuter = std::numeric_limits<std::size_t>::max();

struct Box {
  glm::dvec2 low{std::numeric_limits<double>::infinity()}, high{-low};
  explicit Box(const Contour& contour) {
    for (const glm::dvec2& p : contour) low = glm::min(low, p), high = glm::max(high, p);
  }
  [[nodiscard]] bool holds(const Box& box) const {
    return low.x <= box.low.x && low.y <= box.low.y && high.x >= box.high.x && high.y >= box.high.y;
  }
};

bool is_inside(const glm::dvec2& p, const Contour& contour) {
  bool inside = false;
  for (std::size_t i = 0; i < contour.size(); ++i) {
    const glm::dvec2 &a = contour[i], &b = contour[(i + 1) % contour.size()];
    if ((a.y > p.y) == (b.y > p.y)) continue;
    const int side = orient(a, b, p);
    if (side == 0) return true;
    if ((side > 0) == (b.y > a.y)) inside = !inside;
  }
  return inside;
}

/// Finds the smallest outer contour around a given contour.
class Surroundings {
 public:
  Surroundings(const Outline& outline, const std::vector<std::size_t>& outers)
      : outline_(outline), outers_(outers) {
    for (const std::size_t outer : outers) boxes_.emplace_back(outline.contours[outer]);
    glm::dvec2 high(-std::numeric_limits<double>::infinity());
    low_ = -high;
    for (const Box& box : boxes_) low_ = glm::min(low_, box.low), high = glm::max(high, box.high);
    // A cell has about the size of a mean box. The letters of a line of text then fill one row of
    // cells.
    const auto count = static_cast<double>(outers.size());
    glm::dvec2 mean(0);
    for (const Box& box : boxes_) mean += (box.high - box.low) / count;
    glm::dvec2 cells = glm::clamp((high - low_) / mean, glm::dvec2(1), glm::dvec2(count));
    if (!(cells.x * cells.y < 4 * count)) cells = glm::dvec2(std::sqrt(count));
    columns_ = static_cast<std::size_t>(cells.x), rows_ = static_cast<std::size_t>(cells.y);
    cell_ = (high - low_) / glm::dvec2(columns_, rows_);
    cells_.resize(columns_ * rows_);
    for (std::size_t i = 0; i < boxes_.size(); ++i) {
      const auto [left, bottom] = column(boxes_[i].low);
      const auto [right, top] = column(boxes_[i].high);
      entries_ += (right - left + 1) * (top - bottom + 1);
      if (entries_ > kMostEntries * outers.size()) return;
      for (std::size_t y = bottom; y <= top; ++y) {
        for (std::size_t x = left; x <= right; ++x) cells_[y * columns_ + x].push_back(i);
      }
    }
  }

  /// Whether the boxes overlap so much that this search would take longer than it saves.
  [[nodiscard]] bool crowded() const { return entries_ > kMostEntries * outers_.size(); }

  /// Returns an index of `outers`, or kNoOuter when no contour is around the hole.
  [[nodiscard]] std::size_t of(const Contour& hole) const {
    const Box box(hole);
    const auto [x, y] = column(box.low);
    std::vector<std::size_t> around;
    for (const std::size_t i : cells_[y * columns_ + x]) {
      if (boxes_[i].holds(box)) around.push_back(i);
    }
    if (around.size() == 1) return around[0];
    std::size_t best = kNoOuter;
    double least = std::numeric_limits<double>::infinity();
    for (const std::size_t i : around) {
      const Contour& outer = outline_.contours[outers_[i]];
      const double size = signed_area(outer);
      if (size < least && is_inside((hole[0] + hole[1]) / 2.0, outer)) least = size, best = i;
    }
    return best;
  }

 private:
  static constexpr std::size_t kMostEntries = 64;

  [[nodiscard]] std::pair<std::size_t, std::size_t> column(const glm::dvec2& p) const {
    const auto at = [&](double x, double low, double size, std::size_t count) {
      const double cell = size > 0 ? (x - low) / size : 0.0;
      return std::min(static_cast<std::size_t>(std::max(cell, 0.0)), count - 1);
    };
    return {at(p.x, low_.x, cell_.x, columns_), at(p.y, low_.y, cell_.y, rows_)};
  }

  const Outline& outline_;
  const std::vector<std::size_t>& outers_;
  std::vector<Box> boxes_;
  std::vector<std::vector<std::size_t>> cells_;
  glm::dvec2 low_{0}, cell_{0};
  std::size_t columns_ = 1, rows_ = 1, entries_ = 0;
};

/// The contours of each piece, the outer one first. Empty where the outline does not consist of
/// outer contours with holes.
std::optional<std::vector<std::vector<std::size_t>>> find_pieces(const Outline& outline) {
  std::vector<std::size_t> outers, holes;
  for (std::size_t i = 0; i < outline.contours.size(); ++i) {
    if (outline.contours[i].size() < 3) continue;
    const double area = signed_area(outline.contours[i]);
    if (!(area > 0) && !(area < 0)) return std::nullopt;
    (area > 0 ? outers : holes).push_back(i);
  }
  if (outers.empty()) return std::nullopt;
  const Surroundings surroundings(outline, outers);
  if (surroundings.crowded()) return std::nullopt;
  std::vector<std::vector<std::size_t>> pieces;
  for (const std::size_t outer : outers) pieces.push_back({outer});
  for (const std::size_t hole : holes) {
    const std::size_t around = surroundings.of(outline.contours[hole]);
    if (around == kNoOuter) return std::nullopt;
    pieces[around].push_back(hole);
  }
  return pieces;
}

}  // namespace

std::vector<glm::uvec3> triangulate_pieces(const Outline& outline, OutlineJob* job) {
  if (job && job->ended()) return {};
  constexpr std::size_t kMany = 64;
  if (outline.contours.size() < kMany) return triangulate(outline);
  const auto pieces = find_pieces(outline);
  if (!pieces) return triangulate(outline);
  std::vector<std::uint32_t> firsts;  // the number of the first point of each contour
  std::uint32_t count = 0;
  for (const Contour& contour : outline.contours) {
    firsts.push_back(count);
    count += static_cast<std::uint32_t>(contour.size());
  }
  std::vector<glm::uvec3> triangles;
  triangles.reserve(count);
  std::vector<std::uint32_t> numbers;
  for (const std::vector<std::size_t>& piece : *pieces) {
    if (job && job->ended()) return {};
    Outline alone;
    numbers.clear();
    for (const std::size_t i : piece) {
      alone.contours.push_back(outline.contours[i]);
      for (std::uint32_t k = 0; k < outline.contours[i].size(); ++k) {
        numbers.push_back(firsts[i] + k);
      }
    }
    for (const glm::uvec3& t : triangulate(alone)) {
      triangles.emplace_back(numbers[t.x], numbers[t.y], numbers[t.z]);
    }
  }
  return triangles;
}

}  // namespace strata::csg
