#include "apps/json_writer.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <utility>

namespace strata::apps {
namespace {

/// Length of the UTF-8 sequence that `text` begins with; 0 when it is none (overlong forms,
/// surrogates and what lies beyond U+10FFFF included).
std::size_t utf8_length(std::string_view text) {
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

}  // namespace

void JsonWriter::line_break() {
  text_ += '\n';
  text_.append(2 * levels_.size(), ' ');
}

void JsonWriter::separate(bool nested) {
  if (std::exchange(after_key_, false) || levels_.empty()) return;
  Level& level = levels_.back();
  if (!level.empty) text_ += ',';
  level.nested = level.nested || nested;
  if (level.object || level.nested) {
    line_break();
  } else if (!level.empty) {
    text_ += ' ';
  }
  level.empty = false;
}

void JsonWriter::open(char bracket) {
  separate(true);
  text_ += bracket;
  levels_.push_back({.object = bracket == '{', .empty = true, .nested = false});
}

void JsonWriter::close(char bracket) {
  const Level level = levels_.back();
  levels_.pop_back();
  if (!level.empty && (level.object || level.nested)) line_break();
  text_ += bracket;
}

JsonWriter& JsonWriter::key(std::string_view name) {
  separate(false);
  quote(name);
  text_ += ": ";
  after_key_ = true;
  return *this;
}

void JsonWriter::scalar(std::string_view text) {
  separate(false);
  text_ += text;
}

void JsonWriter::null() { scalar("null"); }
void JsonWriter::value(bool flag) { scalar(flag ? "true" : "false"); }

void JsonWriter::value(double number) {
  if (!std::isfinite(number)) return null();
  scalar(fmt::format("{}", number));
}

void JsonWriter::value(std::string_view text) {
  separate(false);
  quote(text);
}

void JsonWriter::value(const glm::dvec3& v) {
  begin_array();
  for (int axis = 0; axis < 3; ++axis) value(v[axis]);
  end_array();
}

void JsonWriter::value(const glm::ivec3& v) {
  begin_array();
  for (int axis = 0; axis < 3; ++axis) value(v[axis]);
  end_array();
}

void JsonWriter::quote(std::string_view text) {
  text_ += '"';
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const char c = text.front();
    if (length == 0) {
      text_ += "\\ufffd";
    } else if (c == '"' || c == '\\') {
      text_ += '\\';
      text_ += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      text_ += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    } else {
      text_ += text.substr(0, length);
    }
    text.remove_prefix(length == 0 ? 1 : length);
  }
  text_ += '"';
}

std::string JsonWriter::take() {
  text_ += '\n';
  return std::exchange(text_, {});
}

}  // namespace strata::apps
