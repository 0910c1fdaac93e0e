#pragma once

#include "apps/commands/csg_options.h"

namespace strata::apps {

/// Reads the words of films: --turntable, --camera-file with --frames, --fps. The rest of
/// `command` is set. @return kUsage; kInput for the camera file
Result<void> read_film_options(const CsgWords& words, CsgCommand& command);

/// Whether the output is an animation or a folder of pictures.
[[nodiscard]] bool writes_film(const CsgCommand& command);

}  // namespace strata::apps
