#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "strata/core/depth_list.h"

// Sorting of short lists by networks, which have no branches. The networks are the smallest known
// (D. Knuth, The Art of Computer Programming 3, section 5.3.4).

namespace strata::transparency {
namespace detail {

/// Puts two elements in order.
template <int i, int j>
inline void order(std::uint64_t* a) {
  const std::uint64_t x = a[i], y = a[j];
  a[i] = x < y ? x : y;
  a[j] = x < y ? y : x;
}

template <int n>
struct SortingNetwork;

template <>
struct SortingNetwork<2> {
  static constexpr int kComparisons = 1;
  static void sort(std::uint64_t* a) { order<0, 1>(a); }
};
template <>
struct SortingNetwork<3> {
  static constexpr int kComparisons = 3;
  static void sort(std::uint64_t* a) { order<0, 2>(a), order<0, 1>(a), order<1, 2>(a); }
};
template <>
struct SortingNetwork<4> {
  static constexpr int kComparisons = 5;
  static void sort(std::uint64_t* a) {
    order<0, 2>(a), order<1, 3>(a);
    order<0, 1>(a), order<2, 3>(a);
    order<1, 2>(a);
  }
};
template <>
struct SortingNetwork<5> {
  static constexpr int kComparisons = 9;
  static void sort(std::uint64_t* a) {
    order<0, 3>(a), order<1, 4>(a);
    order<0, 2>(a), order<1, 3>(a);
    order<0, 1>(a), order<2, 4>(a);
    order<1, 2>(a), order<3, 4>(a);
    order<2, 3>(a);
  }
};
template <>
struct SortingNetwork<6> {
  static constexpr int kComparisons = 12;
  static void sort(std::uint64_t* a) {
    order<0, 5>(a), order<1, 3>(a), order<2, 4>(a);
    order<1, 2>(a), order<3, 4>(a);
    order<0, 3>(a), order<2, 5>(a);
    order<0, 1>(a), order<2, 3>(a), order<4, 5>(a);
    order<1, 2>(a), order<3, 4>(a);
  }
};
template <>
struct SortingNetwork<7> {
  static constexpr int kComparisons = 16;
  static void sort(std::uint64_t* a) {
    order<0, 6>(a), order<2, 3>(a), order<4, 5>(a);
    order<0, 2>(a), order<1, 4>(a), order<3, 6>(a);
    order<0, 1>(a), order<2, 5>(a), order<3, 4>(a);
    order<1, 2>(a), order<4, 6>(a);
    order<2, 3>(a), order<4, 5>(a);
    order<1, 2>(a), order<3, 4>(a), order<5, 6>(a);
  }
};
template <>
struct SortingNetwork<8> {
  static constexpr int kComparisons = 19;
  static void sort(std::uint64_t* a) {
    order<0, 2>(a), order<1, 3>(a), order<4, 6>(a), order<5, 7>(a);
    order<0, 4>(a), order<1, 5>(a), order<2, 6>(a), order<3, 7>(a);
    order<0, 1>(a), order<2, 3>(a), order<4, 5>(a), order<6, 7>(a);
    order<2, 4>(a), order<3, 5>(a);
    order<1, 4>(a), order<3, 6>(a);
    order<1, 2>(a), order<3, 4>(a), order<5, 6>(a);
  }
};

template <int n, class Visit>
inline std::uint64_t visit_by_network(const DepthItem* items, Visit&& visit) {
  std::uint64_t a[n];
  for (int i = 0; i < n; ++i) a[i] = items[i].bits;
  SortingNetwork<n>::sort(a);
  for (int i = 0; i < n; ++i) visit(DepthItem(a[i]));
  return SortingNetwork<n>::kComparisons;
}

}  // namespace detail

namespace detail {

/// Sorts eight fragments in place. @return comparisons
inline std::uint64_t sort_eight(DepthItem* items) {
  std::uint64_t a[8];
  for (int i = 0; i < 8; ++i) a[i] = items[i].bits;
  SortingNetwork<8>::sort(a);
  // Volatile, so that no two are joined to a vector: the processor would wait for both halves.
  for (int i = 0; i < 8; ++i) *const_cast<volatile std::uint64_t*>(&items[i].bits) = a[i];
  return SortingNetwork<8>::kComparisons;
}

}  // namespace detail

/// Sorts a list in place, front to back; by insertion if it is not too long. @return comparisons
inline std::uint64_t sort_items(DepthItem* begin, DepthItem* end) {
  constexpr std::ptrdiff_t kInsertionSortLimit = 32;
  std::uint64_t comparisons = 0;
  if (end - begin > kInsertionSortLimit) {
    std::sort(begin, end, [&comparisons](DepthItem a, DepthItem b) {
      ++comparisons;
      return a < b;
    });
    return comparisons;
  }
  DepthItem* next = begin;
  if (end - begin > 8) {
    comparisons = detail::sort_eight(begin);
    next += 8;
  }
  for (; next != end; ++next) {
    const DepthItem item = *next;
    DepthItem* place = next;
    for (; place != begin && item < place[-1]; --place) *place = place[-1];
    comparisons += static_cast<std::uint64_t>(next - place) + (place != begin ? 1 : 0);
    *place = item;
  }
  return comparisons;
}

/// Calls visit(item) for the fragments of a list, front to back. Lists of up to 8 stay as they are
/// in memory, others are sorted there. @return comparisons
template <class Visit>
inline std::uint64_t visit_sorted(DepthItem* items, std::size_t count, Visit&& visit) {
  switch (count) {
    case 0:
      return 0;
    case 1:
      visit(*items);
      return 0;
    case 2:
      return detail::visit_by_network<2>(items, visit);
    case 3:
      return detail::visit_by_network<3>(items, visit);
    case 4:
      return detail::visit_by_network<4>(items, visit);
    case 5:
      return detail::visit_by_network<5>(items, visit);
    case 6:
      return detail::visit_by_network<6>(items, visit);
    case 7:
      return detail::visit_by_network<7>(items, visit);
    case 8:
      return detail::visit_by_network<8>(items, visit);
    default:
      break;
  }
  const std::uint64_t comparisons = sort_items(items, items + count);
  for (std::size_t i = 0; i < count; ++i) visit(items[i]);
  return comparisons;
}

}  // namespace strata::transparency
