#pragma once

#include <string>

#include "strata/voxelize/output/voxel_output.h"

namespace strata {

/// What all voxel writers share (internal to voxelize/): holds the caller to the order of
/// VoxelWriter, turns slabs of another axis, stops exceptions, reports a cancelled job.
class SlabWriter : public VoxelWriter {
 public:
  /// @return kInternal when slabs of another grid, of two axes, or out of order, are given;
  /// kCancelled; kLimit when memory runs out; else what the format says
  Result<void> add(const VoxelIntervals& slab, const Execution& execution) final;
  Result<void> finish(const Execution& execution) final;

 protected:
  /// @param path is only named in messages
  /// @param axis of the slabs that add_slab() takes
  /// @param whole  add_slab() takes the whole set at once
  /// @param part  slabs are some rows of the grid, along `axis`
  SlabWriter(std::string path, const VoxelGrid& grid, Axis axis, bool whole = false,
             bool part = false);

  virtual Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) = 0;
  /// Completes and commits the output; kCancelled, without committing, if work was skipped.
  virtual Result<void> finish_output(const Execution& execution) = 0;

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const VoxelGrid& grid() const { return grid_; }
  [[nodiscard]] glm::ivec3 dims() const { return grid_.dims; }

 private:
  template <class Step>
  Result<void> guarded(Step&& step);
  Result<void> add_turned(const VoxelIntervals& slab, const Execution& execution);
  [[nodiscard]] int rows() const { return grid_.dims[AxisFrame(given_axis_).v]; }

  std::string path_;
  VoxelGrid grid_;
  Axis axis_;
  bool whole_, part_;
  Axis given_axis_;      // of the slabs that come
  VoxelIntervals kept_;  // those of another axis, until all are there
  int next_row_ = 0;     // v of the slab that must come next, or after others in a part
  bool done_ = false;    // failed or finished
};

}  // namespace strata
