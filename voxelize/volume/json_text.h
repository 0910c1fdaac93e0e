#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/result.h"

namespace strata {

/// A JSON value (RFC 8259) of a small file. (Internal to voxelize/, which the build makes
/// without nlohmann-json.)
struct JsonValue {
  enum Kind { kNull, kBool, kNumber, kText, kList, kObject } kind = kNull;
  bool truth = false;
  double number = 0.0;
  std::string text;
  std::vector<JsonValue> items;
  std::map<std::string, JsonValue, std::less<>> members;

  /// Null if there is no such member.
  [[nodiscard]] const JsonValue* find(std::string_view name) const {
    const auto found = members.find(name);
    return found == members.end() ? nullptr : &found->second;
  }
  /// The numbers of a member that is a list of `count`; nothing if it is none.
  [[nodiscard]] std::optional<std::vector<double>> numbers(std::string_view name,
                                                           std::size_t count) const;
};

/// @return kInput naming file and line
Result<JsonValue> parse_json(std::string_view text, const std::string& path);

}  // namespace strata
