#include "transparency/objects/plane_split.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "transparency/objects/draw_order.h"
#include "transparency/objects/screen_polygon.h"

namespace strata::transparency {

/// Polygons are in doubles: they only say where samples may lie, with a margin for rounding. Where
/// they leave it open, samples decide, by integers.
class SplitBuilder {
 public:
  SplitBuilder(const FrameInfo& frame, unsigned most, const Execution& execution)
      : part_(frame.triangles->part),
        opaque_(frame.triangles->opaque),
        size_(frame.size),
        most_each_(most),
        execution_(execution),
        out_(std::make_shared<SplitOrder>()) {
    const auto triangles = static_cast<std::uint32_t>(part_.mesh.triangles.size());
    out_->planes_.resize(triangles);
    out_->nodes_.resize(triangles);
    out_->first_of_.assign(frame.colours.size() / 2 + 1, 0);
    for (std::uint32_t t = 0; t < triangles; ++t) {
      out_->sources_.push_back(part_.source(t));
      ++out_->first_of_[part_.source(t) + 1];
    }
    std::partial_sum(out_->first_of_.begin(), out_->first_of_.end(), out_->first_of_.begin());
  }

  Result<std::shared_ptr<const SplitOrder>> run() {
    std::vector<Task> tasks(1);
    for (std::uint32_t t = 0; t < out_->planes_.size(); ++t) add_triangle(t, tasks[0].pieces);
    first_pieces_ = out_->pieces_ = tasks[0].pieces.size();
    const std::uint64_t most = std::max<std::uint64_t>(out_->pieces_, 1) * most_each_;
    while (!tasks.empty()) {
      if (execution_.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
      if (out_->pieces_ > most) {
        return fail(
            ErrorCode::kLimit,
            "primitive-sort: {} triangles need more than {} pieces, {} a triangle; a larger "
            "number of pieces a triangle allows it",
            first_pieces_, most, most_each_);
      }
      Task task = std::move(tasks.back());
      tasks.pop_back();
      if (task.pieces.size() == 1) {
        out_->nodes_[task.pieces[0].node].rank = next_rank_++;
      } else if (task.circular) {
        split(std::move(task.pieces), tasks);
      } else if (!task.pieces.empty()) {
        group(std::move(task.pieces), tasks);
      }
    }
    return std::shared_ptr<const SplitOrder>(std::move(out_));
  }

 private:
  struct Piece {
    std::uint32_t triangle = 0, node = 0;
    ScreenPolygon polygon;
    glm::dvec2 low{0.0}, high{0.0};
  };
  struct Task {
    std::vector<Piece> pieces;
    bool circular = false;  ///< they have no order
  };
  /// Bits: the one lies behind the other in a sample, before it in a sample.
  static constexpr unsigned kBehind = 1, kBefore = 2;
  /// Lattice steps by which polygons are larger, against rounding.
  static constexpr double kMargin = 1e-3;
  /// Samples that are looked at before both are taken for true.
  static constexpr int kMostSamples = 1 << 18;

  void add_triangle(std::uint32_t t, std::vector<Piece>& pieces) {
    const glm::uvec3& corners = part_.mesh.triangles[t];
    TriangleSetup& plane = out_->planes_[t];
    plane = {};
    if (!opaque_.empty() && opaque_[out_->sources_[t]] != 0) return;
    if (!setup_triangle(part_.mesh.vertices[corners.x], part_.mesh.vertices[corners.y],
                        part_.mesh.vertices[corners.z], AxisFrame(Axis::kZ), plane) ||
        pixel_bounds(plane, {0, 0, size_.x, size_.y}).empty()) {
      return;
    }
    ScreenPolygon polygon;
    for (int i = 0; i < 3; ++i) {
      polygon.emplace_back(static_cast<double>(plane.u[i]), static_cast<double>(plane.v[i]));
    }
    const double width = size_.x * double{kLatticeSteps}, height = size_.y * double{kLatticeSteps};
    const ScreenPolygon picture{{0, 0}, {width, 0}, {width, height}, {0, height}};
    ScreenPolygon seen;
    if (overlap_of(polygon, picture, kMargin, seen)) add_piece(t, t, std::move(seen), pieces);
  }
  static void add_piece(std::uint32_t triangle, std::uint32_t node, ScreenPolygon&& polygon,
                        std::vector<Piece>& pieces) {
    Piece piece{triangle, node, std::move(polygon), {}, {}};
    piece.low = piece.high = piece.polygon.front();
    for (const glm::dvec2& p : piece.polygon) {
      piece.low = glm::min(piece.low, p);
      piece.high = glm::max(piece.high, p);
    }
    pieces.push_back(std::move(piece));
  }

  /// By how much the plane of `a` lies behind that of `b`, and how certain that is.
  struct Gap {
    const TriangleSetup &a, &b;
    double a_u, a_v, b_u, b_v;

    Gap(const TriangleSetup& one, const TriangleSetup& other)
        : a(one),
          b(other),
          a_u(static_cast<double>(a.slope_u) / static_cast<double>(a.area)),
          a_v(static_cast<double>(a.slope_v) / static_cast<double>(a.area)),
          b_u(static_cast<double>(b.slope_u) / static_cast<double>(b.area)),
          b_v(static_cast<double>(b.slope_v) / static_cast<double>(b.area)) {}
    [[nodiscard]] double at(const glm::dvec2& p) const {
      return static_cast<double>(a.w0 - b.w0) + a_u * (p.x - static_cast<double>(a.u[0])) +
             a_v * (p.y - static_cast<double>(a.v[0])) - b_u * (p.x - static_cast<double>(b.u[0])) -
             b_v * (p.y - static_cast<double>(b.v[0]));
    }
    /// Floors of depths differ by this; a point of a polygon may be off by kMargin; terms are
    /// rounded.
    [[nodiscard]] double uncertain(const glm::dvec2& p) const {
      const double slopes = std::abs(a_u) + std::abs(a_v) + std::abs(b_u) + std::abs(b_v);
      const double terms = std::abs(a_u * (p.x - static_cast<double>(a.u[0]))) +
                           std::abs(a_v * (p.y - static_cast<double>(a.v[0]))) +
                           std::abs(b_u * (p.x - static_cast<double>(b.u[0]))) +
                           std::abs(b_v * (p.y - static_cast<double>(b.v[0])));
      return 2.0 + 4 * kMargin * slopes + 1e-14 * terms;
    }
    /// kBehind, kBefore, or 0 if the planes do not tell.
    [[nodiscard]] unsigned side_of(const ScreenPolygon& polygon, double& uncertainty) const {
      double least = std::numeric_limits<double>::max(), most = -least;
      uncertainty = 0;
      bool clamped = false;
      for (const glm::dvec2& p : polygon) {
        const double gap = at(p);
        least = std::min(least, gap);
        most = std::max(most, gap);
        uncertainty = std::max(uncertainty, uncertain(p));
        const double depth = static_cast<double>(a.w0) + a_u * (p.x - static_cast<double>(a.u[0])) +
                             a_v * (p.y - static_cast<double>(a.v[0]));
        clamped |= std::max(depth, depth - gap) < uncertainty ||
                   std::min(depth, depth - gap) > kPictureDepthLimit - uncertainty;
      }
      if (clamped) {  // both to one depth: the gap says nothing
        uncertainty = std::numeric_limits<double>::max();
        return 0;
      }
      return least > uncertainty ? kBehind : most < -uncertainty ? kBefore : 0;
    }
  };

  /// Which of `wanted` is true of the triangle `a` and the plane of `b` in the samples of a polygon
  /// that `a` covers, and `b`, too, if `both`.
  [[nodiscard]] unsigned look(const ScreenPolygon& polygon, std::uint32_t a, std::uint32_t b,
                              bool both, unsigned wanted) const {
    unsigned found = 0;
    int left = kMostSamples;
    for_each_sample(polygon, [&](int u, int v) {
      if (--left == 0) {
        found = wanted;
        return false;
      }
      const bool inside = u >= 0 && v >= 0 && u < size_.x && v < size_.y;
      if (!inside || !out_->covers(a, u, v) || (both && !out_->covers(b, u, v))) return true;
      found |= out_->on_plane(a, u, v) < out_->on_plane(b, u, v) ? kBefore : kBehind;
      return (found & wanted) != wanted;
    });
    return found & wanted;
  }
  [[nodiscard]] unsigned relation(const Piece& a, const Piece& b) {
    if (a.triangle == b.triangle || a.low.x > b.high.x || b.low.x > a.high.x ||
        a.low.y > b.high.y || b.low.y > a.high.y) {
      return 0;
    }
    if (!overlap_of(a.polygon, b.polygon, kMargin, overlap_)) return 0;
    ++out_->comparisons_;
    double uncertainty = 0;
    const Gap gap(out_->planes_[a.triangle], out_->planes_[b.triangle]);
    const unsigned side = gap.side_of(overlap_, uncertainty);
    if (side != 0) return side;
    return look(overlap_, a.triangle, b.triangle, true, kBehind | kBefore);
  }

  /// Calls body(i, j) for all pairs whose boxes meet, once each.
  template <class Body>
  static void for_each_pair(const std::vector<Piece>& pieces, Body&& body) {
    const auto count = static_cast<std::uint32_t>(pieces.size());
    glm::dvec2 low = pieces[0].low, high = pieces[0].high;
    for (const Piece& piece : pieces) {
      low = glm::min(low, piece.low);
      high = glm::max(high, piece.high);
    }
    const int side = std::clamp(static_cast<int>(std::sqrt(static_cast<double>(count))), 1, 512);
    const glm::dvec2 scale = double(side) / glm::max(high - low, glm::dvec2(1.0));
    const auto cell = [&](const glm::dvec2& p) {
      return glm::clamp(glm::ivec2((p - low) * scale), glm::ivec2(0), glm::ivec2(side - 1));
    };
    std::vector<std::vector<std::uint32_t>> cells(static_cast<std::size_t>(side * side));
    for (std::uint32_t i = 0; i < count; ++i) {
      const glm::ivec2 first = cell(pieces[i].low), last = cell(pieces[i].high);
      for (int y = first.y; y <= last.y; ++y) {
        for (int x = first.x; x <= last.x; ++x) {
          auto& here = cells[static_cast<std::size_t>(y * side + x)];
          for (const std::uint32_t j : here) {
            // In the first cell that both are in.
            if (cell(glm::max(pieces[i].low, pieces[j].low)) == glm::ivec2(x, y)) body(j, i);
          }
          here.push_back(i);
        }
      }
    }
  }

  /// Pieces in groups that have an order.
  void group(std::vector<Piece>&& pieces, std::vector<Task>& tasks) {
    std::vector<DrawEdge> edges;
    for_each_pair(pieces, [&](std::uint32_t i, std::uint32_t j) {
      if (execution_.stop.stop_requested()) return;
      const unsigned of = relation(pieces[i], pieces[j]);
      if ((of & kBehind) != 0) edges.push_back({i, j});
      if ((of & kBefore) != 0) edges.push_back({j, i});
    });
    const DrawGroups groups = ordered_groups(static_cast<std::uint32_t>(pieces.size()), edges);
    for (std::size_t g = groups.size(); g-- > 0;) {
      Task& task = tasks.emplace_back();
      task.circular = true;
      for (const std::uint32_t i : groups.group(g)) task.pieces.push_back(std::move(pieces[i]));
    }
  }
  /// The piece whose plane leaves the most others whole, of some.
  [[nodiscard]] std::size_t choose(const std::vector<Piece>& pieces) const {
    constexpr std::size_t kTried = 8;
    std::size_t best = 0, fewest = pieces.size() + 1;
    for (std::size_t i = 0; i < std::min(kTried, pieces.size()); ++i) {
      const std::size_t at = i * pieces.size() / std::min(kTried, pieces.size());
      std::size_t cut = 0;
      double uncertainty = 0;
      for (const Piece& piece : pieces) {
        const Gap gap(out_->planes_[piece.triangle], out_->planes_[pieces[at].triangle]);
        cut += gap.side_of(piece.polygon, uncertainty) == 0 ? 1 : 0;
      }
      if (cut < fewest) best = at, fewest = cut;
    }
    return best;
  }
  void split(std::vector<Piece>&& pieces, std::vector<Task>& tasks) {
    const std::size_t chosen = choose(pieces);
    Task behind, middle, before;
    const std::uint32_t plane = pieces[chosen].triangle;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (i == chosen) continue;
      split_piece(std::move(pieces[i]), plane, behind.pieces, before.pieces);
    }
    middle.pieces.push_back(std::move(pieces[chosen]));
    tasks.push_back(std::move(before));
    tasks.push_back(std::move(middle));
    tasks.push_back(std::move(behind));
  }
  void split_piece(Piece&& piece, std::uint32_t plane, std::vector<Piece>& behind,
                   std::vector<Piece>& before) {
    const Gap gap(out_->planes_[piece.triangle], out_->planes_[plane]);
    double uncertainty = 0;
    const unsigned side = gap.side_of(piece.polygon, uncertainty);
    if (side != 0) {
      (side == kBehind ? behind : before).push_back(std::move(piece));
      return;
    }
    ScreenPolygon far, near;
    clip_polygon(
        piece.polygon, [&](const glm::dvec2& p) { return gap.at(p) + uncertainty; }, far);
    clip_polygon(
        piece.polygon, [&](const glm::dvec2& p) { return uncertainty - gap.at(p); }, near);
    const unsigned is = look(far, piece.triangle, plane, false, kBehind) |
                        look(near, piece.triangle, plane, false, kBefore);
    if (is != (kBehind | kBefore)) {
      if (is != 0) (is == kBehind ? behind : before).push_back(std::move(piece));
      return;
    }
    const auto children = static_cast<std::uint32_t>(out_->nodes_.size());
    out_->nodes_.resize(children + 2);
    out_->nodes_[piece.node] = {plane, 0, children, children + 1};
    add_piece(piece.triangle, children, std::move(far), behind);
    add_piece(piece.triangle, children + 1, std::move(near), before);
    ++out_->pieces_;
  }

  const ViewPart& part_;
  std::span<const std::uint8_t> opaque_;
  glm::ivec2 size_;
  unsigned most_each_;
  const Execution& execution_;
  std::shared_ptr<SplitOrder> out_;
  std::uint32_t next_rank_ = 0;
  std::uint64_t first_pieces_ = 0;
  ScreenPolygon overlap_;
};

Result<std::shared_ptr<const SplitOrder>> split_order(const FrameInfo& frame, unsigned most,
                                                      const Execution& execution) {
  return SplitBuilder(frame, most, execution).run();
}

}  // namespace strata::transparency
