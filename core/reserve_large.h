#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <vector>

// Private: not installed.
namespace strata::detail {

/// Reserves room and asks for large pages, since the first touch of small ones costs more than
/// filling them.
template <class T>
void reserve_large(std::vector<T>& values, std::size_t count) {
  values.reserve(count);
  constexpr std::uintptr_t kPage = 4096;
  const auto begin = (reinterpret_cast<std::uintptr_t>(values.data()) + kPage - 1) / kPage * kPage;
  const auto end =
      reinterpret_cast<std::uintptr_t>(values.data() + values.capacity()) / kPage * kPage;
  if (end > begin && end - begin >= (std::uintptr_t{4} << 20)) {
    ::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
  }
}

}  // namespace strata::detail
