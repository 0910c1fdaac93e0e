#pragma once

#include "apps/commands/commands.h"
#include "apps/session/session.h"
#include "apps/voxelize/job_part.h"
#include "apps/voxelize/voxelize_report.h"
#include "strata/core/result.h"
#include "strata/voxelize/formats/voxel_writer.h"

namespace strata::apps {

/// Whether no voxel is asked for its inside: without --solid, or of an open mesh under --open
/// surface.
[[nodiscard]] bool is_surface_alone(const VoxelizeCommand& command, const csg::SolidInput& input);

/// Samples along a voxel's side of a fog volume; 0: none is asked for. A surface alone has no
/// filled fraction.
[[nodiscard]] int fog_samples(const VoxelizeCommand& command, const csg::SolidInput& input);

/// What the file's voxels are; labels the solids accordingly.
[[nodiscard]] VoxelWriterOptions writer_options(const VoxelizeCommand& command,
                                                VoxelizeOutcome& outcome, int samples,
                                                Session& session);

/// Warns of what the numbers of all voxels tell: columns, walls, that nothing is solid.
void tell_voxels(const VoxelizeCommand& command, const VoxelizeOutcome& outcome, Session& session);
/// Makes the filled volume of all filled steps, with --coverage, and warns where it is 0.
void tell_filled(const VoxelizeCommand& command, VoxelizeOutcome& outcome, Session& session);

/// Makes the voxels of outcome.input on outcome.grid, looks at them, and writes the file, which is
/// not committed yet. @param part  of this process; null: it does all
Result<void> make_voxel_file(const VoxelizeCommand& command, VoxelizeOutcome& outcome,
                             JobPart* part, Session& session);

/// Commits the outputs, and prints what the command asks for. @param name  of the command
Result<void> print_reports(const VoxelizeCommand& command, const VoxelizeOutcome& outcome,
                           Session& session, std::string_view name = "voxelize");

/// `strata voxelize` as one of several processes.
Result<void> run_voxelize_part(const VoxelizeCommand& command, JobPart& part, Session& session);

}  // namespace strata::apps
