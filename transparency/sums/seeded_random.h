#pragma once

#include <cstdint>
#include <initializer_list>

#include "core/split_mix.h"

namespace strata::transparency {

/// Random numbers that depend on nothing but the numbers they are seeded with: a pixel and its
/// fragment, never a thread or a tile. The generator is SplitMix64 (G. Steele, D. Lea, C. Flood,
/// "Fast splittable pseudorandom number generators", 2014).
class SeededRandom {
 public:
  SeededRandom(std::initializer_list<std::uint64_t> seeds) {
    for (const std::uint64_t seed : seeds) state_ = split_mix(state_ ^ seed);
  }

  std::uint64_t next() { return split_mix(state_ += kStep); }
  /// In [0, 1).
  double unit() { return static_cast<double>(next() >> 32) * 0x1p-32; }
  /// In [0, end). @pre 0 < end < 2^16, so that the bias is below 2^-16
  unsigned below(unsigned end) { return static_cast<unsigned>((next() >> 32) * end >> 32); }

 private:
  static constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15u;

  std::uint64_t state_ = 0;
};

}  // namespace strata::transparency
