#pragma once

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "strata/core/execution.h"
#include "strata/csg/input/scene_input.h"

// What the files of this folder share.

namespace strata::csg::detail {

inline void warn(const InputMessages& messages, std::string code, std::string text) {
  if (messages.warn) messages.warn(std::move(code), std::move(text));
}
inline void note(const InputMessages& messages, const std::string& text) {
  if (messages.note) messages.note(text);
}

/// The execution of one of `count` equal parts of a job.
inline Execution part_of(const Execution& execution, std::size_t part, std::size_t count) {
  Execution result = execution;
  if (execution.progress) {
    result.progress = [whole = execution.progress, part, count](double done) {
      whole((static_cast<double>(part) + std::clamp(done, 0.0, 1.0)) / static_cast<double>(count));
    };
  }
  return result;
}

/// Milliseconds since it was made.
class Stopwatch {
 public:
  [[nodiscard]] double milliseconds() const {
    return std::chrono::duration<double, std::milli>(Clock::now() - start_).count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

}  // namespace strata::csg::detail
