#pragma once

#include <string>

#include "apps/session/json_writer.h"
#include "strata/core/result.h"

namespace strata::apps {

/// What OpenGL there is on this machine and what Strata makes of it: appended to `text`, and the
/// member "gl" of `json`.
/// @return kUsage with a sentence where there is no context, or this build is without OpenGL
Result<void> tell_gl(JsonWriter& json, std::string& text);

}  // namespace strata::apps
