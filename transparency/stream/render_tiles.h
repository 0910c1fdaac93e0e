#pragma once

#include <functional>

#include "strata/transparency/stream/frame.h"
#include "transparency/stream/tile_stream.h"

namespace strata::transparency {

/// @return kUsage when samples, size or colours are out of range
Result<void> check_frame(const Scene& scene, const View& view, const FrameOptions& options);

/// The facts of a frame for techniques.
[[nodiscard]] FrameInfo frame_info(const FragmentSource& source, const FrameOptions& options);

/// Renders all tiles of a frame and puts their picture before the opaque objects and the
/// background. @param make  makes the renderer of one thread; called by one thread at a time
/// @param keep_hidden  the streams hold also what lies behind opaque fragments
/// @return errors of the renderers; kLimit, kCancelled
Result<Rendering> render_tiles(const FragmentSource& source, const FrameOptions& options,
                               const std::function<Result<TileRenderer>()>& make, bool keep_hidden,
                               const Execution& execution);

}  // namespace strata::transparency
