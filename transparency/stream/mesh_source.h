#pragma once

#include <memory>

#include "strata/core/execution.h"
#include "strata/raster/view.h"
#include "strata/transparency/stream/frame.h"
#include "transparency/stream/fragment_source.h"

namespace strata::transparency {

/// Rasterizes the triangles of a scene, which it borrows. @return kGeometry, kLimit, kCancelled
Result<std::shared_ptr<const FragmentSource>> make_mesh_source(const Scene& scene, const View& view,
                                                               const FrameOptions& options,
                                                               const Execution& execution);

}  // namespace strata::transparency
