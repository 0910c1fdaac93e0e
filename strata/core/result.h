#pragma once

#include <fmt/core.h>

#include <string>
#include <tl/expected.hpp>

namespace strata {

/// Error category, by who can fix it: user, file, system or Strata itself. The value is the exit
/// code of the command-line tool.
enum class ErrorCode : int {
  kInternal = 1,  ///< a fault in Strata itself
  kUsage = 2,     ///< options that contradict each other or are out of range
  kInput = 3,     ///< a file that cannot be read or is malformed
  kOutput = 4,    ///< a file that cannot be written
  kGeometry = 5,  ///< geometry that is refused (open mesh under --strict, coordinates too large)
  kLimit = 6,     ///< a memory or size limit
  kVerification = 7,  ///< two results that should agree do not
  kCancelled = 130,   ///< stopped on request
};

/// One sentence that names the culprit and the number: `bunny.obj:1204: face refers to vertex
/// 98213, the file has 34817`.
struct Error {
  ErrorCode code = ErrorCode::kInternal;  ///< its category
  std::string message;                    ///< the sentence, without a full stop
};

/// A value, or the error that prevented it. Functions of the library neither throw nor print.
template <class T>
using Result = tl::expected<T, Error>;

/// Builds the failed side of a Result from a text and arguments packed by fmt; use fail().
[[nodiscard]] tl::unexpected<Error> fail_with(ErrorCode code, fmt::string_view text,
                                              fmt::format_args args);

/// Builds the failed side of a Result: `return fail(ErrorCode::kInput, "{}: empty file", name);`
/// The arguments are numbers and text; include <fmt/format.h> too for fmt::join and the like.
template <class... Args>
[[nodiscard]] tl::unexpected<Error> fail(ErrorCode code, fmt::format_string<Args...> text,
                                         Args&&... args) {
  return fail_with(code, text, fmt::make_format_args(args...));
}

}  // namespace strata
