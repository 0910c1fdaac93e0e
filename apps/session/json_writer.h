#pragma once

#include <concepts>
#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace strata::apps {

/// Builds a JSON text, member by member. Doubles are written with the fewest digits that read back
/// as the same number, NaN and infinities as null. Arrays of plain values stand on one line.
class JsonWriter {
 public:
  enum class Layout { kLines, kOneLine };
  /// @param layout  a member a line, or all on one line
  explicit JsonWriter(Layout layout = Layout::kLines) : one_line_(layout == Layout::kOneLine) {}

  void begin_object() { open('{'); }
  void end_object() { close('}'); }
  void begin_array() { open('['); }
  void end_array() { close(']'); }
  /// The name of the next member. @pre inside an object
  JsonWriter& key(std::string_view name);

  void null();
  void value(bool flag);
  void value(double number);
  void value(std::string_view text);  ///< bytes that are no UTF-8 become U+FFFD
  void value(const char* text) { value(std::string_view(text)); }
  template <std::integral T>
  requires(!std::same_as<T, bool>) void value(T number) { scalar(std::to_string(number)); }
  void value(double number, int decimals);
  void value(const glm::dvec3& v);
  void value(const glm::ivec3& v);

  template <class T>
  void member(std::string_view name, const T& v) {
    key(name).value(v);
  }

  void member(std::string_view name, double number, int decimals) {
    key(name).value(number, decimals);
  }

  /// The finished text with a line end. @pre all objects and arrays are closed
  [[nodiscard]] std::string take();

 private:
  struct Level {
    bool object = false;
    bool empty = true;
    bool nested = false;  // holds objects or arrays: an element a line
  };
  void open(char bracket);
  void close(char bracket);
  void separate(bool nested);
  void scalar(std::string_view text);
  void quote(std::string_view text);
  void line_break();

  bool one_line_;
  std::string text_;
  std::vector<Level> levels_;
  bool after_key_ = false;
};

}  // namespace strata::apps
