#pragma once

#include <span>

#include "strata/core/result.h"
#include "strata/gl/shader_program.h"

// Faults that tests provoke, since the driver that they have never shows them by itself. Private
// to gl/; context.h has pretends_hardware().

namespace strata::gl {

/// What STRATA_GL_FAULTS in the environment asks for, as `name` or `name=value`, separated by
/// commas:
/// - lose-context=N: the N-th download of a context, counted from 1, and all after it bring
///   rubbish, and all checks say that the context is lost;
/// - refuse-shader=TEXT: shaders with a piece whose name holds TEXT do not compile;
/// - hardware: contexts say that they are a GPU's, so that --backend auto takes them.
/// Called when a context is made: the calling thread's faults begin from the start.
/// @return kUsage for words that are none of these
[[nodiscard]] Result<void> begin_faults();

/// Counts a download. True: the context is lost.
[[nodiscard]] bool loses_context_at_download();
[[nodiscard]] bool has_lost_context();
[[nodiscard]] bool refuses_shader(std::span<const GlslPiece> pieces);

}  // namespace strata::gl
