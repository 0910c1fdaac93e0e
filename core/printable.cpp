#include "core/printable.h"

#include <fmt/core.h>

#include <algorithm>

namespace strata {
namespace {

void append(std::string& out, std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    if (length > 0 && !is_control(text.substr(0, length))) {
      out += text.substr(0, length);
    } else {
      for (const char c : text.substr(0, std::max<std::size_t>(length, 1))) {
        out += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
      }
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
}

bool continues(char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; }

}  // namespace

std::size_t utf8_length(std::string_view text) noexcept {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned lead = byte(0);
  if (lead < 0x80) return 1;
  const std::size_t length = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  if (lead < 0xc2 || lead > 0xf4 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return 0;
  }
  if ((lead == 0xe0 && byte(1) < 0xa0) || (lead == 0xed && byte(1) > 0x9f) ||
      (lead == 0xf0 && byte(1) < 0x90) || (lead == 0xf4 && byte(1) > 0x8f)) {
    return 0;
  }
  return length;
}

bool is_control(std::string_view sequence) noexcept {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(sequence[i]); };
  if (sequence.size() == 1) return byte(0) < 0x20 || byte(0) == 0x7f;
  if (sequence.size() == 2) {
    return (byte(0) == 0xc2 && byte(1) < 0xa0) ||  // U+0080 to U+009F
           (byte(0) == 0xd8 && byte(1) == 0x9c);   // U+061C
  }
  if (sequence.size() != 3 || byte(0) != 0xe2) return false;
  const unsigned last = byte(2);
  return (byte(1) == 0x80 && ((last >= 0x8e && last <= 0x8f) ||    // U+200E, U+200F
                              (last >= 0xa8 && last <= 0xae))) ||  // U+2028 to U+202E
         (byte(1) == 0x81 && last >= 0xa6 && last <= 0xa9);        // U+2066 to U+2069
}

std::string printable(std::string_view text, std::size_t most) {
  std::string out;
  if (text.size() <= most) {
    append(out, text);
    return out;
  }
  // Two thirds from the front; the end often has the reason, or a file's kind.
  std::size_t front = most / 3 * 2, back = text.size() - most / 3;
  while (front > 0 && continues(text[front])) --front;
  while (back < text.size() && continues(text[back])) ++back;
  append(out, text.substr(0, front));
  out += "[...]";
  append(out, text.substr(back));
  return out;
}

std::string printable_lines(std::string_view text) {
  constexpr std::string_view kBreak = "\n  ";
  std::string out;
  for (;;) {
    const std::size_t end = text.find(kBreak);
    append(out, text.substr(0, end));
    if (end == std::string_view::npos) return out;
    out += '\n';
    text.remove_prefix(end + 1);
  }
}

std::string counted(std::uint64_t count, std::string_view noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

}  // namespace strata
