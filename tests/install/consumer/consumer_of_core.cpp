// Uses one folder of an installed Strata.
#include <atomic>
#include <cstdio>

#include "strata/core/execution.h"
#include "strata/core/result.h"

int main() {
  std::atomic<int> sum{0};
  strata::parallel_for({}, 10, [&](std::size_t index, int) { sum += static_cast<int>(index); });
  const strata::Result<int> failed = strata::fail(strata::ErrorCode::kInput, "{}", "expected");
  if (sum != 45 || failed) return 1;
  std::puts("strata works");
  return 0;
}
