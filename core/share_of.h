#pragma once

#include "strata/core/execution.h"

namespace strata::detail {

/// For a part of a job: its progress from 0 to 1 is reported as the whole's from `from` to `to`.
/// @pre `execution` outlives the result
inline Execution share_of(const Execution& execution, double from, double to) {
  Execution share = execution;
  if (execution.progress) {
    share.progress = [&progress = execution.progress, from, to](double done) {
      progress(from + (to - from) * done);
    };
  }
  return share;
}

}  // namespace strata::detail
