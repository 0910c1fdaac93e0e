#pragma once

#include <memory>
#include <new>

namespace strata {

/// Leaves new elements of a vector as its memory is, for what is written in full: zeros cost
/// as much again, and what one thread fills with them, others have to fetch from it.
template <class T>
struct UnfilledAllocator : std::allocator<T> {
  UnfilledAllocator() = default;
  /// All are alike.
  template <class Other>
  UnfilledAllocator(const UnfilledAllocator<Other>& /*other*/) noexcept {}
  /// An element without a value.
  template <class Element>
  void construct(Element* at) noexcept {
    ::new (static_cast<void*>(at)) Element;
  }
};

}  // namespace strata
