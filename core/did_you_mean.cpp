// This work is based on: Damerau, A technique for computer detection and correction of spelling
// errors, CACM 7 (1964), and Wagner, Fischer, The string-to-string correction problem, JACM 21
// (1974): the restricted distance, where no letter is changed twice.

#include "core/did_you_mean.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/letters.h"

namespace strata {
namespace {

constexpr std::size_t kLongest = 64;    // words beyond are not compared
constexpr std::size_t kLeastBegin = 3;  // letters that may stand for a whole word

bool begins_with(std::string_view word, std::string_view begin) {
  return same_word(word.substr(0, begin.size()), begin);
}

std::size_t distance(std::string_view a, std::string_view b) {
  using Row = std::array<std::size_t, kLongest + 1>;
  Row before{}, last{}, row{};  // of the letters i - 2, i - 1, i of a
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before = last;
    last = row;
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower_case(a[i - 1]) == lower_case(b[j - 1]);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same ? 0 : 1)});
      if (i > 1 && j > 1 && lower_case(a[i - 1]) == lower_case(b[j - 2]) &&
          lower_case(a[i - 2]) == lower_case(b[j - 1])) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
  }
  return row[b.size()];
}

}  // namespace

std::string_view nearest_word(std::string_view word, std::span<const std::string_view> known) {
  if (word.empty() || word.size() > kLongest) return {};
  std::string_view best;
  std::size_t least = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (const std::string_view candidate : known) {
    if (candidate.size() > kLongest) continue;
    const std::size_t changes = distance(word, candidate);
    // Not where all letters would be replaced, as of "a" and "b".
    if (changes >= least || changes >= std::max(word.size(), candidate.size())) continue;
    least = changes;
    best = candidate;
  }
  if (!best.empty() || word.size() < kLeastBegin) return best;
  const auto begun = [word](std::string_view candidate) { return begins_with(candidate, word); };
  if (std::count_if(known.begin(), known.end(), begun) != 1) return {};
  return *std::find_if(known.begin(), known.end(), begun);
}

std::string did_you_mean(std::string_view word, std::span<const std::string_view> known) {
  const std::string_view nearest = nearest_word(word, known);
  return nearest.empty() ? std::string() : "; did you mean " + std::string(nearest) + "?";
}

}  // namespace strata
