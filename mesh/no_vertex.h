#pragma once

#include <cstdint>

// Private: not installed.
namespace strata::detail {

/// A vertex index that is never valid.
inline constexpr std::uint32_t kNoVertex = 0xffffffffu;
/// Most vertices a soup may have, so that kNoVertex stays free.
inline constexpr std::uint64_t kMaxVertices = 0xfffffffeu;

}  // namespace strata::detail
