#pragma once

#include <bit>
#include <cstdint>

#include "core/split_mix.h"

// xoshiro256** and SplitMix64, after: Blackman, Vigna, "Scrambled Linear Pseudorandom Number
// Generators", 2021. Own code, because the distributions of the standard library differ from
// platform to platform, and offsets must not.

namespace strata {

/// A small seeded generator with the same numbers on every platform.
class Random {
 public:
  explicit constexpr Random(std::uint64_t seed) {
    for (std::uint64_t& word : state_) word = split_mix(seed);
  }

  /// Uniform over all 64-bit numbers.
  constexpr std::uint64_t next() {
    const std::uint64_t result = std::rotl(state_[1] * 5, 7) * 9;
    const std::uint64_t shifted = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= shifted;
    state_[3] = std::rotl(state_[3], 45);
    return result;
  }

  /// Uniform over [0, count), without bias. @pre count > 0
  constexpr std::uint64_t below(std::uint64_t count) {
    const int unused_bits = std::countl_zero((count - 1) | 1);
    std::uint64_t value = next() >> unused_bits;
    while (value >= count) value = next() >> unused_bits;
    return value;
  }

 private:
  static constexpr std::uint64_t split_mix(std::uint64_t& seed) {
    const std::uint64_t mixed = strata::split_mix(seed);
    seed += 0x9e3779b97f4a7c15u;
    return mixed;
  }

  std::uint64_t state_[4]{};
};

}  // namespace strata
