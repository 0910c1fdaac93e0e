#pragma once

#include <string>
#include <string_view>
#include <unordered_map>

#include <fmt/format.h>

// Private: not installed.
namespace strata::detail {

/// Gives out names, each once.
class PartNames {
 public:
  /// The name, or the name with " (2)", " (3)", ... where it was given out.
  std::string unique(std::string_view name) {
    const auto [found, is_new] = times_.try_emplace(std::string(name), 1);
    if (is_new) return found->first;
    std::uint32_t& times = found->second;  // references stay valid
    for (;;) {
      std::string other = fmt::format("{} ({})", name, ++times);
      if (times_.try_emplace(other, 1).second) return other;
    }
  }

 private:
  std::unordered_map<std::string, std::uint32_t> times_;
};

}  // namespace strata::detail
