#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mesh/text/text_scanner.h"

/// Sources of the values in PLY files; used by the PLY reader.
namespace strata::detail::ply {

enum class Type { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };
inline constexpr std::size_t kTypeBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
constexpr std::size_t bytes_of(Type type) { return kTypeBytes[static_cast<int>(type)]; }

inline std::optional<Type> type_named(std::string_view name) {
  constexpr std::pair<std::string_view, Type> kNames[] = {
      {"char", Type::kInt8},     {"int8", Type::kInt8},     {"uchar", Type::kUint8},
      {"uint8", Type::kUint8},   {"short", Type::kInt16},   {"int16", Type::kInt16},
      {"ushort", Type::kUint16}, {"uint16", Type::kUint16}, {"int", Type::kInt32},
      {"int32", Type::kInt32},   {"uint", Type::kUint32},   {"uint32", Type::kUint32},
      {"float", Type::kFloat},   {"float32", Type::kFloat}, {"double", Type::kDouble},
      {"float64", Type::kDouble}};
  for (const auto& [known, type] : kNames) {
    if (name == known) return type;
  }
  return std::nullopt;
}

struct Property {
  std::string name;
  Type type = Type::kFloat;       ///< type of the value, or of the items of a list
  std::optional<Type> list_type;  ///< type of the list's count; empty: a scalar
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { kAscii, kLittle, kBig };

/// The values of an ASCII body, one after another.
class AsciiSource {
 public:
  static constexpr bool kBinary = false;
  AsciiSource(const char* p, const char* end, bool by_lines = true)
      : p_(p), end_(end), by_lines_(by_lines) {}
  void begin_element() {
    while (is_space(*p_)) ++p_;
  }
  /// Skips the rest of the line.
  void end_element() {
    while (by_lines_ && p_ < end_ && *p_ != '\n' && *p_ != '\r') ++p_;
  }
  /// Reads the value as double, which holds every PLY type.
  bool read(Type, double& value) {
    skip_gap();
    const char* stop = parse_double(p_, value);
    if (stop == nullptr || !ends_token(*stop)) return false;
    p_ = stop;
    return true;
  }
  bool skip(Type, std::uint64_t count) {
    for (; count != 0; --count) {
      skip_gap();
      if (p_ >= end_ || *p_ == '\n' || *p_ == '\r') return false;
      p_ = std::max(p_ + 1, skip_token(p_));
    }
    return true;
  }
  static std::uint64_t least_bytes(const Property&) { return 2; }  // a digit and a blank
  [[nodiscard]] const char* position() const { return p_; }
  [[nodiscard]] std::uint64_t left() const { return static_cast<std::uint64_t>(end_ - p_); }
  [[nodiscard]] bool by_lines() const { return by_lines_; }

 private:
  void skip_gap() {
    while (is_space(*p_) && !(by_lines_ && (*p_ == '\n' || *p_ == '\r'))) ++p_;
  }

  const char* p_;
  const char* end_;
  bool by_lines_;
};

/// The values of a binary body.
template <std::endian kOrder>
class BinarySource {
 public:
  static constexpr bool kBinary = true;
  BinarySource(const char* p, const char* end) : p_(p), end_(end) {}
  void begin_element() {}
  void end_element() {}
  bool read(Type type, double& value) {
    if (left() < bytes_of(type)) return false;
    value = at(type, p_);
    p_ += bytes_of(type);
    return true;
  }
  bool skip(Type type, std::uint64_t count) {
    if (count > left() / bytes_of(type)) return false;
    p_ += count * bytes_of(type);
    return true;
  }
  static std::uint64_t least_bytes(const Property& property) {
    return bytes_of(property.list_type.value_or(property.type));
  }
  static double at(Type type, const char* p) {
    switch (type) {
      case Type::kInt8:
        return load<std::int8_t>(p);
      case Type::kUint8:
        return load<std::uint8_t>(p);
      case Type::kInt16:
        return load<std::int16_t>(p);
      case Type::kUint16:
        return load<std::uint16_t>(p);
      case Type::kInt32:
        return load<std::int32_t>(p);
      case Type::kUint32:
        return load<std::uint32_t>(p);
      case Type::kFloat:
        return std::bit_cast<float>(load<std::uint32_t>(p));
      case Type::kDouble:
        return std::bit_cast<double>(load<std::uint64_t>(p));
    }
    return 0.0;
  }
  template <class T>
  static T load(const char* p) {
    char bytes[sizeof(T)];
    std::memcpy(bytes, p, sizeof(T));
    if constexpr (kOrder != std::endian::native) std::reverse(bytes, bytes + sizeof(T));
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    return value;
  }
  [[nodiscard]] const char* position() const { return p_; }
  [[nodiscard]] std::uint64_t left() const { return static_cast<std::uint64_t>(end_ - p_); }
  void advance(std::size_t bytes) { p_ += bytes; }

 private:
  const char* p_;
  const char* end_;
};

}  // namespace strata::detail::ply
