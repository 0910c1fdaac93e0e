#include "csg/picture/solid_normals.h"

namespace strata::csg {

void SolidNormals::make(std::span<const std::uint8_t> seen, double crease,
                        const Execution& execution) {
  if (crease != crease_) {
    for (auto& one : normals_) one.reset();
    crease_ = crease;
  }
  seen_.assign(seen.begin(), seen.end());
  if (!(crease > 0) || seen.empty()) return;
  constexpr std::size_t kLarge = std::size_t{1} << 16;  // triangles that all threads share
  const auto make_one = [&](std::size_t solid, const Execution& threads) {
    const Geometry::Part& part = geometry_->parts()[solid];
    normals_[solid] =
        std::make_unique<CornerNormals>(part.positions, part.triangles, crease, threads);
  };
  Execution own;
  own.threads = 1;
  own.stop = execution.stop;
  Execution quiet = execution;
  quiet.progress = {};
  std::vector<std::size_t> small;
  for (std::size_t solid = 0; solid < normals_.size(); ++solid) {
    if (seen[solid] == 0 || normals_[solid]) continue;
    if (geometry_->parts()[solid].triangles.size() < kLarge) {
      small.push_back(solid);
    } else {
      make_one(solid, quiet);
    }
  }
  parallel_for(quiet, small.size(), [&](std::size_t i, int) { make_one(small[i], own); });
  // What a stop left incomplete is not kept.
  if (execution.stop.stop_requested()) {
    for (auto& one : normals_) one.reset();
  }
}

void SolidNormals::forget(std::uint32_t solid, bool others) {
  if (others) {
    for (auto& one : normals_) one.reset();
  } else {
    normals_[solid].reset();
  }
}

}  // namespace strata::csg
