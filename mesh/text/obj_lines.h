#pragma once

#include <cstddef>
#include <cstring>
#include <string_view>
#include <vector>

#include "mesh/text/text_scanner.h"

// Lines and statements of OBJ and MTL text, which ends in a readable zero byte.

namespace strata::detail {

/// Skips blanks and continued line ends.
inline const char* skip_blanks_obj(const char* p) {
  for (;;) {
    if (is_blank(*p)) {
      ++p;
    } else if (*p == '\\' && p[1] == '\n') {
      p += 2;
    } else if (*p == '\\' && p[1] == '\r') {
      p += p[2] == '\n' ? 3 : 2;
    } else {
      return p;
    }
  }
}

/// The line end at or after p, or `end`.
inline const char* find_line_end(const char* p, const char* end) {
  const auto* stop =
      static_cast<const char*>(std::memchr(p, '\n', static_cast<std::size_t>(end - p)));
  return stop == nullptr ? end : stop;
}

/// The start of the line after p's.
inline const char* next_line(const char* p, const char* end) {
  const char* stop = find_line_end(p, end);
  return stop == end ? end : stop + 1;
}

/// Returns the end of a statement that was read up to p: its line end, unless a backslash continues
/// the line.
inline const char* skip_statement(const char* p, const char* end) {
  for (;;) {
    if (*p == '\n') return p + 1;
    const char* stop = find_line_end(p, end);
    if (stop == end) return end;
    const char* last = stop;
    while (last > p && last[-1] == '\r') --last;
    if (last == p || last[-1] != '\\') return stop + 1;
    p = stop + 1;
  }
}

/// The rest of a line, without blanks around it.
inline std::string_view rest_of_line(const char* p, const char* end) {
  p = skip_blanks(p);
  const char* stop = find_line_end(p, end);
  while (stop > p && is_blank(stop[-1])) --stop;
  return {p, static_cast<std::size_t>(stop - p)};
}

/// Whether the statement at p begins with a word; p goes behind it.
inline bool take_statement(const char*& p, std::string_view word) {
  if (std::strncmp(p, word.data(), word.size()) != 0 || !ends_token(p[word.size()])) return false;
  p += word.size();
  return true;
}

/// Cuts a text at the ends of statements into pieces of about `bytes`: piece i is [cuts[i], cuts[i
/// + 1]).
inline std::vector<const char*> cut_statements(std::string_view text, std::size_t bytes) {
  const char* const begin = text.data();
  const char* const end = begin + text.size();
  std::vector<const char*> cuts{begin};
  const char* p = begin;
  while (static_cast<std::size_t>(end - p) > bytes) {
    p += bytes;
    for (;;) {
      const char* stop = find_line_end(p, end);
      p = stop == end ? end : stop + 1;
      if (stop == end) break;
      while (stop > begin && stop[-1] == '\r') --stop;
      if (stop == begin || stop[-1] != '\\') break;
    }
    if (p < end) cuts.push_back(p);
  }
  cuts.push_back(end);
  return cuts;
}

}  // namespace strata::detail
