#pragma once

#include <memory>
#include <string>

#include "apps/commands/commands.h"
#include "apps/session/session.h"
#include "strata/core/result.h"
#include "strata/csg/gl/gpu.h"
#include "strata/csg/input/scene_input.h"
#include "strata/voxelize/grid_fit.h"

// What the library tells while it works, told to a session.

namespace strata::apps {

/// Of inputs that are read. The session must outlive it.
[[nodiscard]] csg::InputMessages messages_of(Session& session);

/// The grid that is asked for, over the box of an input. Only what depends on the input names it.
/// @param file  the first of the input @return as check_grid_request(), fit_grid()
[[nodiscard]] Result<VoxelGrid> fit_input_grid(const Bounds& box, const GridRequest& request,
                                               const std::string& file);

/// The GPU of --backend. Null where the CPU is to do the work: --backend cpu, or auto without a
/// hardware GPU. The session must outlive it. @return kUsage under --backend gl, with a sentence,
/// where no context can be had, or this build is without OpenGL
Result<std::unique_ptr<csg::Gpu>> open_gpu(Backend backend, Session& session);

}  // namespace strata::apps
