#pragma once

#include <cstdint>
#include <vector>

#include "strata/core/result.h"
#include "strata/gl/buffer.h"
#include "strata/gl/shader_program.h"

namespace strata::gl {

/// Exclusive prefix sums of 32-bit values in compute shaders, 1024 values a work group, the sums of
/// the groups in the same way one level up. Keeps its programs and small buffers for the next time.
class PrefixSum {
 public:
  /// Replaces values[i] by values[0] + ... + values[i - 1], for the first `count` words of
  /// `values`. Uses the storage bindings 0 and 1.
  /// @return the sum of all; 2^32 - 1 if it is that or more: then the values are of no use.
  [[nodiscard]] Result<std::uint32_t> run(const Buffer& values, std::uint64_t count);
  [[nodiscard]] std::uint64_t memory_bytes() const;

 private:
  [[nodiscard]] Result<void> sum(const Buffer& values, std::uint64_t count, std::size_t level);

  Program sum_, add_;
  std::vector<Buffer> levels_;  ///< the sums of the groups, finest first
};

}  // namespace strata::gl
