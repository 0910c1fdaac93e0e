#pragma once

#include "apps/session/session.h"
#include "strata/core/result.h"

namespace strata::apps {

/// Whether `operator new` has failed in this process. Whatever caught that exception, here or in a
/// library, may have gone on without what it asked for: outputs must not appear any more.
[[nodiscard]] bool allocation_has_failed() noexcept;

/// The sentence for it.
inline constexpr const char* kNoMemory =
    "out of memory: --memory-limit or the system's limit is reached";

/// Gives the outputs of a run their names, unless an allocation has failed. @return kLimit then
Result<void> commit_outputs(Session& session);

}  // namespace strata::apps
