#pragma once

#include <concepts>
#include <cstdint>

#include "strata/core/depth_list.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"

namespace strata {

/// Anything that takes fragments. A generator of fragments is a callable that accepts any sink:
/// `[&](auto& sink) { sink.insert(x, y, depth, payload); }`. It may be called several times for one
/// frame and must then give the same fragments, in any order, from any number of its own threads
/// (one, if the store is Exclusive), and return when all are inserted.
template <class S>
concept FragmentSink = requires(S& sink, int x, int y, std::uint32_t depth, std::uint32_t payload) {
  { sink.insert(x, y, depth, payload) }
  noexcept;
};

/// How a frame was built.
struct BuildReport {
  std::uint64_t fragments = 0;     ///< in the lists
  int generator_calls = 0;         ///< geometry passes
  std::uint64_t memory_bytes = 0;  ///< held by the store
};

namespace detail {
/// A generator for use in concepts.
struct NoFragments {
  void operator()(FragmentSink auto& sink) const { static_cast<void>(sink); }
};
struct IgnoreItem {
  void operator()(DepthItem item) const { static_cast<void>(item); }
};
}  // namespace detail

/// A store of a frame's fragments that gives them back as sorted depth lists. The law: the list of
/// a pixel holds every fragment that was inserted there, sorted by (depth, payload), equal ones as
/// often as they came; no bit depends on the order of insertion, the threads, or the store. What
/// does not fit is never dropped silently: build() fails with ErrorCode::kLimit and the number.
template <class S>
concept DepthListStore = requires(S store, const S built, int x, int y,
                                  const Execution& execution) {
  typename S::Record;
  { built.width() } -> std::same_as<int>;
  { built.height() } -> std::same_as<int>;
  /// Replaces the frame that the store holds.
  { build(store, detail::NoFragments{}, execution) } -> std::same_as<Result<BuildReport>>;
  /// Visits the list of pixel (x, y) front to back.
  built.for_each(x, y, detail::IgnoreItem{});
  { built.depth_image(execution) } -> std::same_as<Result<LayeredDepthImage>>;
  { built.memory_bytes() } -> std::same_as<std::uint64_t>;
};

}  // namespace strata
