#pragma once

#include <memory>

#include "apps/voxelize/voxelize_report.h"
#include "strata/voxelize/formats/voxel_writer.h"
#include "strata/voxelize/voxelize.h"

namespace strata::apps {

/// Visits the numbers of a job's first pass that add up over its parts, always in the same order;
/// those of solids come last. @tparam Outcome  VoxelizeOutcome, const or not
template <class Outcome, class Visit>
void visit_sums(Outcome& outcome, Visit&& visit) {
  auto& report = outcome.report;
  for (auto* number :
       {&report.solid_voxels, &report.intervals, &report.crossings, &report.unbalanced_columns,
        &report.negative_columns, &report.rebuilt_tiles}) {
    visit(*number);
  }
  for (auto& columns : report.depth_histogram) visit(columns);
  for (auto& faces : outcome.part.faces) visit(faces);
  for (auto& voxels : outcome.id_voxels) visit(voxels);
}

/// The share of this process in a job that several do: which rows of the grid it makes, and where
/// its voxels go.
class JobPart {
 public:
  virtual ~JobPart() = default;

  /// Once the grid is known, before anything is written.
  virtual Result<void> check(const VoxelizeCommand& command, const VoxelizeOutcome& outcome) = 0;
  virtual Result<std::unique_ptr<VoxelWriter>> open_writer(const VoxelizeCommand& command,
                                                           const VoxelizeOutcome& outcome,
                                                           const VoxelWriterOptions& file) = 0;
  /// Says which rows are made, before a pass over the grid. @param options  of the pass
  virtual Result<void> begin_pass(const VoxelizeOutcome& outcome, VoxelizeOptions& options) = 0;
  /// After it: adds up the numbers of all processes in `outcome`, where this one tells them.
  /// @param done  whether the pass was done here
  virtual Result<void> end_pass(VoxelizeOutcome& outcome, const Result<void>& done) = 0;
  /// The writer has finished: completes the output. @param done  whether it was done here
  virtual Result<void> finish(const VoxelizeCommand& command, VoxelizeOutcome& outcome,
                              Session& session, const Result<void>& done) = 0;

  /// This process looks for walls between voxel centres.
  [[nodiscard]] virtual bool finds_walls() const = 0;
  /// The numbers of this process are those of all: it tells what users should know of them.
  [[nodiscard]] virtual bool tells_all() const = 0;
  /// This process prints reports.
  [[nodiscard]] virtual bool reports() const = 0;
};

}  // namespace strata::apps
