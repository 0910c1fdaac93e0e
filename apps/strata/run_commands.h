#pragma once

#include <string_view>

#include "apps/commands/commands.h"
#include "apps/session/session.h"
#include "strata/core/result.h"

namespace strata::apps {

Result<void> run_voxelize(const VoxelizeCommand& command, Session& session);
Result<void> run_merge(const MergeCommand& command, Session& session);
Result<void> run_mesh(const MeshCommand& command, Session& session);
Result<void> run_info(const InfoCommand& command, Session& session);
Result<void> run_ldi(const LdiCommand& command, Session& session);
Result<void> run_csg(const CsgCommand& command, Session& session);
/// @pre command.voxels
Result<void> run_picture(const PictureCommand& command, Session& session);
Result<void> run_oit(const OitCommand& command, Session& session);

/// `strata view`: becomes the program strata-view that lies beside this one, with these arguments.
/// Returns an exit code when that cannot be, after a sentence on standard error. So this program
/// needs none of the libraries of a window.
int run_view_program(char** arguments);
/// Whether there is that program, and a display for its window. @return kUsage; the sentence begins
/// with `asked_by`
Result<void> check_view_program(std::string_view asked_by);

}  // namespace strata::apps
