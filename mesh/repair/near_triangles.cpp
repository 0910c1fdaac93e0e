#include "mesh/repair/near_triangles.h"

#include <algorithm>
#include <glm/common.hpp>
#include <utility>

#include "mesh/check/triangles_meet.h"

namespace strata {
namespace {

using exact::FilePoint;

constexpr int kMostSide = 64;     // cells
constexpr int kMostCells = 4096;  // that a triangle is entered in

}  // namespace

bool NearTriangles::Box::touches(const Box& other) const {
  for (int k = 0; k < 3; ++k) {
    if (low[k] > other.high[k] || other.low[k] > high[k]) return false;
  }
  return true;
}

NearTriangles::Box NearTriangles::box(Index triangle) const {
  const glm::uvec3& t = mesh_.triangles[triangle];
  const FilePoint &a = mesh_.positions[t.x], &b = mesh_.positions[t.y], &c = mesh_.positions[t.z];
  constexpr std::int64_t kRest = (std::int64_t{1} << exact::kFileBits) - 1;
  return {glm::ivec3(glm::min(a, glm::min(b, c)) >> FilePoint(exact::kFileBits)),
          glm::ivec3((glm::max(a, glm::max(b, c)) + kRest) >> FilePoint(exact::kFileBits))};
}

template <class Work>
void NearTriangles::for_cells(const Box& box, const Work& work) const {
  const glm::ivec3 first = (glm::clamp(box.low, all_.low, all_.high) - all_.low) >> shift_,
                   last = (glm::clamp(box.high, all_.low, all_.high) - all_.low) >> shift_;
  for (int z = first.z; z <= last.z; ++z) {
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x) {
        work(static_cast<std::size_t>(z * size_.y + y) * static_cast<std::size_t>(size_.x) +
             static_cast<std::size_t>(x));
      }
    }
  }
}

bool NearTriangles::is_large(const Box& box) const {
  const glm::ivec3 cells = ((box.high - all_.low) >> shift_) - ((box.low - all_.low) >> shift_) + 1;
  return std::int64_t{cells.x} * cells.y * cells.z > kMostCells;
}

NearTriangles::NearTriangles(const RoundedMesh& mesh) : mesh_(mesh) {
  const std::size_t count = mesh.triangles.size();
  visited_.assign(count, 0);
  if (count == 0) return;
  boxes_.reserve(count);
  for (Index t = 0; t < count; ++t) boxes_.push_back(box(t));
  all_ = boxes_.front();
  for (const Box& b : boxes_) all_ = {glm::min(all_.low, b.low), glm::max(all_.high, b.high)};
  const glm::ivec3 extent = all_.high - all_.low;
  // A surface touches about as many cells as it has triangles.
  int side = 1;
  while (side < kMostSide && std::size_t(side) * std::size_t(side) < count) side *= 2;
  while (std::max({extent.x, extent.y, extent.z}) >> shift_ >= side) ++shift_;
  size_ = (extent >> shift_) + 1;
  first_.assign(std::size_t(size_.x) * std::size_t(size_.y) * std::size_t(size_.z) + 1, 0);
  for (Index t = 0; t < count; ++t) {
    if (is_large(boxes_[t])) {
      large_.push_back(t);
    } else {
      for_cells(boxes_[t], [this](std::size_t cell) { ++first_[cell]; });
    }
  }
  Index sum = 0;
  for (Index& first : first_) first = sum += first;
  in_cells_.resize(sum);
  for (Index t = 0; t < count; ++t) {
    if (is_large(boxes_[t])) continue;
    for_cells(boxes_[t], [this, t](std::size_t cell) { in_cells_[--first_[cell]] = t; });
  }
}

void NearTriangles::enter(const std::vector<Index>& triangles) {
  boxes_.resize(mesh_.triangles.size());
  for (const Index t : triangles) {
    const Box around = boxes_[t] = box(t);
    if (is_large(around)) {
      large_.push_back(t);
    } else {
      for_cells(around, [&](std::size_t cell) { entered_[cell].push_back(t); });
    }
  }
}

bool NearTriangles::conflict(Index a, Index b) const {
  const auto corners = [this](Index t) {
    const glm::uvec3& c = mesh_.triangles[t];
    return TriangleCorners{mesh_.positions[c.x], mesh_.positions[c.y], mesh_.positions[c.z]};
  };
  return !is_clean(triangles_meet(corners(a), corners(b)));
}

std::size_t NearTriangles::count_conflicts(std::vector<Index> triangles, std::size_t most) {
  const auto alive = [this](Index t) { return mesh_.triangles[t].x != mesh_.triangles[t].y; };
  visited_.resize(mesh_.triangles.size(), 0);
  counted_.resize(mesh_.triangles.size(), 0);
  ++count_;
  std::erase_if(triangles,
                [&](Index t) { return !alive(t) || std::exchange(counted_[t], count_) == count_; });
  std::vector<Box> boxes;  // their own may have changed
  for (const Index t : triangles) boxes.push_back(box(t));
  std::size_t count = 0;
  for (std::size_t i = 0; i < triangles.size() && count < most; ++i) {
    const Index t = triangles[i];
    const Box& around = boxes[i];
    const glm::uvec3& c = mesh_.triangles[t];
    count += has_area(mesh_.positions[c.x], mesh_.positions[c.y], mesh_.positions[c.z]) ? 0 : 1;
    for (std::size_t k = 0; k < i; ++k) {
      if (around.touches(boxes[k]) && conflict(t, triangles[k])) ++count;
    }
    ++visit_;
    const auto look = [&](Index other) {
      if (count >= most || visited_[other] == visit_) return;
      visited_[other] = visit_;
      if (counted_[other] == count_ || !around.touches(boxes_[other]) || !alive(other)) return;
      count += conflict(t, other) ? 1 : 0;
    };
    for_cells(around, [&](std::size_t cell) {
      for (Index n = first_[cell]; n < first_[cell + 1]; ++n) look(in_cells_[n]);
      const auto found = entered_.find(cell);
      if (found == entered_.end()) return;
      for (const Index other : found->second) look(other);
    });
    for (const Index other : large_) look(other);
  }
  return count;
}

}  // namespace strata
