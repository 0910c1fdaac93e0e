#include "voxelize/distance/triangle_bins.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>

#include "voxelize/distance/tile_distance.h"

namespace strata {
namespace {

constexpr std::size_t kChunk = 4096;  // triangles that a thread takes at once
constexpr int kTileShift = kLatticeBits + 5;
static_assert(1 << kTileShift == DistanceTile::kSide * kLatticeSteps);

}  // namespace

TriangleBins::Box TriangleBins::box(std::uint32_t t) const {
  const glm::uvec3 index = mesh_->triangles[t];
  const glm::ivec3 a = mesh_->vertices[index.x], b = mesh_->vertices[index.y],
                   c = mesh_->vertices[index.z];
  const glm::ivec3 low = glm::min(glm::min(a, b), c) - reach_;
  const glm::ivec3 high = glm::max(glm::max(a, b), c) + reach_;
  // Beyond the grid on one side is below 0 or above the last tile on both ends.
  return {glm::clamp(low >> kTileShift, glm::ivec3(0), tiles_),
          glm::clamp(high >> kTileShift, glm::ivec3(-1), tiles_ - 1)};
}

TriangleBins::TriangleBins(const LatticeMesh& mesh, const VoxelGrid& grid, const glm::dvec3& reach,
                           const Execution& execution)
    : mesh_(&mesh),
      tiles_((grid.dims + DistanceTile::kSide - 1) / DistanceTile::kSide),
      reach_(glm::ceil(glm::min(reach, glm::dvec3(1 << 22)) * double{kLatticeSteps})) {
  const std::size_t rows = static_cast<std::size_t>(tiles_.y) * static_cast<std::size_t>(tiles_.z);
  first_.assign(rows + 1, 0);
  const std::size_t count = mesh.triangles.size();
  const auto for_each = [&](auto&& visit) {
    parallel_for(execution, (count + kChunk - 1) / kChunk, [&](std::size_t chunk, int) {
      const std::size_t end = std::min(count, (chunk + 1) * kChunk);
      for (std::size_t t = chunk * kChunk; t < end; ++t) {
        const Box reached = box(static_cast<std::uint32_t>(t));
        if (reached.low.x > reached.high.x) continue;
        for (int z = reached.low.z; z <= reached.high.z; ++z) {
          for (int y = reached.low.y; y <= reached.high.y; ++y) {
            visit(static_cast<std::size_t>(z) * static_cast<std::size_t>(tiles_.y) +
                      static_cast<std::size_t>(y),
                  static_cast<std::uint32_t>(t));
          }
        }
      }
    });
  };
  for_each([&](std::size_t row, std::uint32_t) {
    std::atomic_ref(first_[row]).fetch_add(1, std::memory_order_relaxed);
  });
  std::uint64_t sum = 0;
  for (std::uint64_t& first : first_) {  // to the end of each row
    sum += first;
    first = sum;
  }
  items_.resize(sum);
  for_each([&](std::size_t row, std::uint32_t t) {
    items_[std::atomic_ref(first_[row]).fetch_sub(1, std::memory_order_relaxed) - 1] = t;
  });
}

}  // namespace strata
