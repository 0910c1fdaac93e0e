#pragma once

#include <cstdint>

namespace strata {

/// The output function of splitmix64 behind a state (Steele, Lea, Flood, 2014): mixes 64 bits, one
/// to one.
[[nodiscard]] constexpr std::uint64_t split_mix(std::uint64_t value) {
  value += 0x9e3779b97f4a7c15u;
  value = (value ^ value >> 30) * 0xbf58476d1ce4e5b9u;
  value = (value ^ value >> 27) * 0x94d049bb133111ebu;
  return value ^ value >> 31;
}

}  // namespace strata
