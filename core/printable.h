#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace strata {

/// Length in bytes of the UTF-8 sequence that `text`, which is not empty, begins with; 0 when it is
/// none (overlong forms, surrogates and what lies beyond U+10FFFF included).
[[nodiscard]] std::size_t utf8_length(std::string_view text) noexcept;

/// Whether a terminal might obey a character, or show the rest in another order: control
/// characters, line and paragraph separators, marks of the direction of writing.
/// @param sequence one UTF-8 sequence
[[nodiscard]] bool is_control(std::string_view sequence) noexcept;

/// Text from a file as a message may show it: control characters and what is no UTF-8 become
/// escapes such as \x1b, and of more than `most` bytes the middle becomes "[...]". In one pass,
/// which looks at no more of the text than is shown.
[[nodiscard]] std::string printable(std::string_view text, std::size_t most = std::string::npos);

/// The same of a message of several lines: a line break stays where the next line is indented by
/// two blanks, as messages are that show a place in an expression.
[[nodiscard]] std::string printable_lines(std::string_view text);

/// "1 face", "2 faces".
[[nodiscard]] std::string counted(std::uint64_t count, std::string_view noun);

}  // namespace strata
