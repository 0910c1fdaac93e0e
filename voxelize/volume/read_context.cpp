#include "voxelize/volume/read_context.h"

#include <cmath>

namespace strata {

Result<void> check_dims(const ReadContext& context, std::int64_t x, std::int64_t y,
                        std::int64_t z) {
  const auto fits = [](std::int64_t side) { return side >= 1 && side <= kMaxGridSide; };
  if (fits(x) && fits(y) && fits(z)) return {};
  return fail(ErrorCode::kInput, "{}: {} x {} x {} voxels; each side must be 1 to {}", context.path,
              x, y, z, kMaxGridSide);
}

Result<void> check_place(const ReadContext& context, const VoxelGrid& grid) {
  for (int axis = 0; axis < 3; ++axis) {
    const double size = grid.voxel_size[axis], origin = grid.origin[axis];
    if (!(size > 0.0) || !std::isfinite(size)) {
      return fail(ErrorCode::kInput, "{}: voxels of {} along {}; their size must be above 0",
                  context.path, size, "xyz"[axis]);
    }
    if (!std::isfinite(origin)) {
      return fail(ErrorCode::kInput, "{}: the origin is {} along {}", context.path, origin,
                  "xyz"[axis]);
    }
  }
  return {};
}

std::string_view name_of(VoxelKind kind) {
  constexpr std::string_view kKinds[] = {"mask",      "ids",    "colours", "fog",
                                         "distances", "values", "lists"};
  return kKinds[static_cast<std::size_t>(kind)];
}

}  // namespace strata
