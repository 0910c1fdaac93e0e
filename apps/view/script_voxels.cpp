#include <fmt/format.h>

#include <utility>

#include "apps/view/script_runner.h"

// Commands that show voxels.

namespace strata::view {

Result<void> ScriptRunner::voxels(const ScriptCommand& command, Viewer& viewer) {
  if (!viewer.shows_voxels()) {
    return fail(ErrorCode::kUsage, "{} needs a file of voxels, but what is shown is none",
                command.name);
  }
  const VoxelScene& scene = *viewer.model()->voxels;
  Looks looks = viewer.looks();
  if (command.action == Action::kVoxels) {
    looks.voxels.style = find_voxel_style(command.word).value_or(VoxelStyle::kAuto);
    looks.voxels.slice.reset();
  } else if (command.action == Action::kThreshold) {
    if (scene.volume().values.empty()) {
      return fail(ErrorCode::kUsage, "these voxels have no values, but are {}",
                  name_of(scene.volume().kind));
    }
    looks.voxels.threshold.reset();
    if (!command.numbers.empty()) {
      looks.voxels.threshold = static_cast<float>(command.numbers[0]);
    }
  } else if (command.word == "off") {
    looks.voxels.slice.reset();
  } else {
    const Result<VoxelSlice> slice = scene.slice_of(command.word);
    if (!slice) return tl::unexpected(slice.error());
    looks.voxels.slice = *slice;
  }
  viewer.rest();
  viewer.set_looks(std::move(looks));
  return {};
}

}  // namespace strata::view
