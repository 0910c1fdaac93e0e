#include "voxelize/output/slab_writer.h"

#include <exception>
#include <new>
#include <utility>

#include "voxelize/output/transposed.h"

namespace strata {

Result<void> VoxelWriter::add_distances(const ScalarField&, int, const Execution&) {
  return fail(ErrorCode::kUsage, "the format holds no distances");
}

SlabWriter::SlabWriter(std::string path, const VoxelGrid& grid, Axis axis, bool whole, bool part)
    : path_(std::move(path)),
      grid_(grid),
      axis_(axis),
      whole_(whole),
      part_(part),
      given_axis_(axis) {}

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
    if (next_row_ == 0 && !part_) given_axis_ = slab.axis();
    if (slab.axis() != given_axis_) {
      return fail(ErrorCode::kInternal, "{}: slab of axis {}, the slabs before it are of axis {}",
                  path_, "xyz"[static_cast<int>(slab.axis())],
                  "xyz"[static_cast<int>(given_axis_)]);
    }
    if (slab.grid() != grid_) return fail(ErrorCode::kInternal, "{}: slab of another grid", path_);
    if (part_ ? slab.v_begin() < next_row_ : slab.v_begin() != next_row_) {
      return fail(ErrorCode::kInternal, "{}: slab begins at row {}, expected {}", path_,
                  slab.v_begin(), next_row_);
    }
    next_row_ = slab.v_end();
    Result<void> result =
        given_axis_ == axis_ && !whole_ ? add_slab(slab, execution) : add_turned(slab, execution);
    // Skipped work leaves holes, whatever the format believes.
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "cancelled");
    return result;
  });
}

Result<void> SlabWriter::add_turned(const VoxelIntervals& slab, const Execution& execution) {
  if (slab.v_begin() == 0 && slab.v_end() == rows()) {
    return given_axis_ == axis_ ? add_slab(slab, execution)
                                : add_slab(transposed(slab, axis_, execution), execution);
  }
  if (slab.v_begin() == 0) kept_ = VoxelIntervals(grid_, given_axis_);
  for (int tv = 0; tv < slab.tiles_v(); ++tv) {
    for (int tu = 0; tu < slab.tiles_u(); ++tu) {
      const VoxelIntervals::TileView tile = slab.tile(tu, tv);
      if (tile.items.empty()) continue;
      kept_.set_tile(tu, slab.v_begin() / VoxelIntervals::kTileSide + tv, tile.offsets, tile.items,
                     tile.labels);
    }
  }
  if (slab.v_end() < rows()) return {};
  const VoxelIntervals turned =
      given_axis_ == axis_ ? std::move(kept_) : transposed(kept_, axis_, execution);
  kept_ = {};
  return add_slab(turned, execution);
}

Result<void> SlabWriter::finish(const Execution& execution) {
  return guarded([&]() -> Result<void> {
    if (next_row_ != rows() && !part_) {
      return fail(ErrorCode::kInternal, "{}: {} of {} rows were written", path_, next_row_, rows());
    }
    // Not asked after the commit: a file that stands is a success.
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "cancelled");
    Result<void> result = finish_output(execution);
    next_row_ = -1;  // nothing may follow
    return result;
  });
}

}  // namespace strata
