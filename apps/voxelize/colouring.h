#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "apps/commands/commands.h"
#include "apps/session/session.h"
#include "apps/voxelize/voxelize_report.h"
#include "strata/core/result.h"
#include "strata/mesh/colours/surface_colours.h"
#include "strata/voxelize/colours/voxel_colours.h"

namespace strata::apps {

/// The colours of voxels: --colours.
class Colouring {
 public:
  /// Keeps references to `outcome`. Labels the lists of a tree whose solids' colours are those of
  /// their voxels. Warns of inputs without colours. @return kGeometry, kLimit, kCancelled
  static Result<Colouring> create(const VoxelizeCommand& command, VoxelizeOutcome& outcome,
                                  const Execution& execution, Session& session);

  /// The voxels of a slab, with packed colours as labels.
  Result<VoxelIntervals> colour(const VoxelIntervals& slab, const Execution& execution);
  /// Whether slabs may have fewer voxels than before, since transparent ones are left out.
  [[nodiscard]] bool leaves_out() const { return voxels_ && !solid_; }

 private:
  bool solid_ = true;
  std::unique_ptr<SurfaceColours> surface_;
  std::optional<VoxelColouring> voxels_;
  std::vector<std::uint32_t> colour_of_label_;  // of a tree's solids; by label - 1
};

}  // namespace strata::apps
