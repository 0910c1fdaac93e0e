#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "transparency/stream/tile_stream.h"

namespace strata::transparency {

/// Whether the costs of work that is done once a frame are added to those of this tile.
[[nodiscard]] inline bool is_first_tile(const TileStream& stream) {
  return stream.rect().u0 == 0 && stream.rect().v0 == 0;
}

/// A geometry pass that draws in another order than that of submission. Keeps its arrays from tile
/// to tile.
class OrderedReplay {
 public:
  /// Calls body(pixel, item) for each fragment, by increasing rank(pixel, item), and in submission
  /// order where ranks are equal.
  template <class Rank, class Body>
  void pass(TileStream& stream, Rank&& rank, Body&& body) {
    const auto pixels = stream.pixels();
    const auto items = stream.items();
    runs_.clear();
    for (std::uint32_t i = 0; i < items.size(); ++i) {
      const std::uint32_t of = rank(pixels[i], items[i]);
      if (runs_.empty() || runs_.back().rank != of) {
        runs_.push_back({of, i, i});
      }
      runs_.back().end = i + 1;
    }
    std::sort(runs_.begin(), runs_.end(), [](const Run& a, const Run& b) {
      return a.rank != b.rank ? a.rank < b.rank : a.begin < b.begin;
    });
    stream.count_pass(items.size());
    for (const Run& run : runs_) {
      for (std::uint32_t i = run.begin; i < run.end; ++i) body(pixels[i], items[i]);
    }
  }

 private:
  /// Fragments of one rank that follow each other in the stream.
  struct Run {
    std::uint32_t rank, begin, end;
  };
  std::vector<Run> runs_;
};

}  // namespace strata::transparency
