#pragma once

#include <cstring>

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

}  // namespace strata::detail
