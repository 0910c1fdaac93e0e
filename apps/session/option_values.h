#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "strata/core/result.h"

namespace strata::apps {

/// The values of options, read without regard to the locale. Each failure is kUsage and names the
/// option and what was given.

/// A whole number.
Result<std::int64_t> parse_integer(std::string_view option, std::string_view text);

/// Numbers separated by commas; as many as `least` to `most`. Finite.
Result<std::vector<double>> parse_numbers(std::string_view option, std::string_view text,
                                          std::size_t least, std::size_t most);

/// A time in seconds, above 0.
Result<double> parse_seconds(std::string_view option, std::string_view text);

/// A size in bytes: a number and K, M, G or T (powers of 1024), or none.
Result<std::uint64_t> parse_bytes(std::string_view option, std::string_view text);

/// Checks that the format of standard input is known, which has no name that tells it.
/// @param given  --input-format is given @param formats  the formats that it may name
Result<void> check_stream_format(std::span<const std::string> files, bool given,
                                 std::string_view formats);

/// The mistake of an option with an empty value, `--camera=` or `--expr ""`, which a parser would
/// take for one that is not given, or whose value is the next word. Empty: there is none.
[[nodiscard]] std::string empty_value(std::span<const std::string> arguments);

/// The error for a word that is none of `names`.
[[nodiscard]] tl::unexpected<Error> no_such_choice(std::string_view option, std::string_view text,
                                                   std::span<const std::string_view> names);

/// One of the given words.
template <class T, std::size_t n>
Result<T> parse_choice(std::string_view option, std::string_view text,
                       const std::pair<std::string_view, T> (&choices)[n]) {
  std::string_view names[n];
  for (std::size_t i = 0; i < n; ++i) {
    if (choices[i].first == text) return choices[i].second;
    names[i] = choices[i].first;
  }
  return no_such_choice(option, text, names);
}

}  // namespace strata::apps
