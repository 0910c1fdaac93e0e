#include "voxelize/slab_writer.h"

#include <exception>
#include <new>
#include <utility>

namespace strata {

SlabWriter::SlabWriter(std::string path, const VoxelGrid& grid, Axis axis)
    : path_(std::move(path)), grid_(grid), axis_(axis), rows_(grid.dims[AxisFrame(axis).v]) {}

template <class Step>
Result<void> SlabWriter::guarded(Step&& step) {
  if (done_) return fail(ErrorCode::kInternal, "{}: written to after its end or an error", path_);
  done_ = true;  // until the step has succeeded
  try {
    Result<void> result = step();
    if (result) done_ = false;
    return result;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory while writing", path_);
  } catch (const std::exception& error) {
    return fail(ErrorCode::kInternal, "{}: {}", path_, error.what());
  }
}

Result<void> SlabWriter::add(const VoxelIntervals& slab, const Execution& execution) {
  return guarded([&]() -> Result<void> {
    if (slab.axis() != axis_) {
      return fail(ErrorCode::kInternal, "{}: slab of axis {}, the format is written from axis {}",
                  path_, "xyz"[static_cast<int>(slab.axis())], "xyz"[static_cast<int>(axis_)]);
    }
    if (slab.grid() != grid_) return fail(ErrorCode::kInternal, "{}: slab of another grid", path_);
    if (slab.v_begin() != next_row_) {
      return fail(ErrorCode::kInternal, "{}: slab begins at row {}, expected {}", path_,
                  slab.v_begin(), next_row_);
    }
    next_row_ = slab.v_end();
    Result<void> result = add_slab(slab, execution);
    // Skipped work leaves holes, whatever the format believes.
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "cancelled");
    return result;
  });
}

Result<void> SlabWriter::finish(const Execution& execution) {
  return guarded([&]() -> Result<void> {
    if (next_row_ != rows_) {
      return fail(ErrorCode::kInternal, "{}: {} of {} rows were written", path_, next_row_, rows_);
    }
    // Not asked after the commit: a file that stands is a success.
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "cancelled");
    Result<void> result = finish_output(execution);
    next_row_ = -1;  // nothing may follow
    return result;
  });
}

}  // namespace strata
