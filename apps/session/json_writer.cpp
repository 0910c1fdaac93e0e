#include "apps/session/json_writer.h"

#include <fmt/core.h>

#include <cmath>
#include <cstdint>
#include <utility>

#include "core/printable.h"

namespace strata::apps {
namespace {

/// Of a UTF-8 sequence of up to three bytes.
unsigned code_point(std::string_view sequence) {
  unsigned code = static_cast<unsigned char>(sequence[0]);
  if (sequence.size() > 1) code &= sequence.size() == 2 ? 0x1fu : 0x0fu;
  for (const char c : sequence.substr(1)) code = code << 6 | (static_cast<unsigned char>(c) & 0x3f);
  return code;
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
  if (!one_line_ && (level.object || level.nested)) {
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
  if (!one_line_ && !level.empty && (level.object || level.nested)) line_break();
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

void JsonWriter::value(double number, int decimals) {
  if (!std::isfinite(number)) return null();
  scalar(fmt::format("{:.{}f}", number, decimals));
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
    } else if (is_control(text.substr(0, length))) {
      text_ += fmt::format("\\u{:04x}", code_point(text.substr(0, length)));
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
