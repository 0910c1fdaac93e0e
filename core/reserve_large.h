#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <vector>

// Private: not installed.
namespace strata::detail {

/// Asks for large pages where memory is not touched yet, since the first touch of small ones costs
/// more than filling them. Less than 2 MiB holds none.
inline void ask_for_large_pages(void* data, std::size_t bytes) {
  constexpr std::uintptr_t kPage = 4096;
  const auto at = reinterpret_cast<std::uintptr_t>(data);
  const std::uintptr_t begin = (at + kPage - 1) / kPage * kPage, end = (at + bytes) / kPage * kPage;
  if (end > begin && end - begin >= (std::uintptr_t{2} << 20)) {
    ::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
  }
}

/// Reserves room, and asks for large pages.
template <class T>
void reserve_large(std::vector<T>& values, std::size_t count) {
  values.reserve(count);
  ask_for_large_pages(values.data(), values.capacity() * sizeof(T));
}

}  // namespace strata::detail
