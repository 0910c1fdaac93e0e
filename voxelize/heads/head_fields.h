#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace strata {

/// The fields of a head that is text. (Internal to voxelize/.)
class HeadFields {
 public:
  void set(std::string name, std::string value) { fields_[std::move(name)] = std::move(value); }
  [[nodiscard]] bool contains(std::string_view name) const {
    return fields_.find(name) != fields_.end();
  }
  /// Empty if there is no such field. @param other  its other spelling
  [[nodiscard]] std::string_view get(std::string_view name, std::string_view other = {}) const {
    auto found = fields_.find(name);
    if (found == fields_.end() && !other.empty()) found = fields_.find(other);
    return found == fields_.end() ? std::string_view() : std::string_view(found->second);
  }

 private:
  std::map<std::string, std::string, std::less<>> fields_;
};

/// Without blanks at both ends.
[[nodiscard]] std::string trimmed(std::string_view text);
/// The numbers of a text; what is between them does not matter. Three NaN for `none`.
[[nodiscard]] std::vector<double> numbers_of(std::string_view text);

}  // namespace strata
