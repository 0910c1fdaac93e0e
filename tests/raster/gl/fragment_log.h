#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "strata/core/depth_list.h"
#include "strata/gl/buffer.h"
#include "strata/raster/gl/producer.h"
#include "tests/support/reference_lists.h"

namespace strata::test {

/// What a producer made, in order of arrival: the simplest sink.
class FragmentLog {
 public:
  /// All fragments of the producer's screen, pixel by pixel, sorted.
  Result<testkit::Lists<DepthItem>> lists(gl::Producer& producer) {
    return lists(producer, {0, producer.height()});
  }
  Result<testkit::Lists<DepthItem>> lists(gl::Producer& producer, gl::PixelRows rows) {
    std::uint32_t capacity = 1u << 12;
    for (;;) {
      if (auto room = log_.reserve(16 + std::uint64_t{capacity} * 16); !room) {
        return tl::unexpected(room.error());
      }
      log_.clear(0, 0, 16);
      const std::array<std::uint32_t, 4> header{0, capacity, 0, 0};
      log_.upload(std::span<const std::uint32_t>(header));
      log_.bind(8);
      if (auto drawn = producer.draw(glsl(), rows); !drawn) return tl::unexpected(drawn.error());
      std::array<std::uint32_t, 1> count{};
      log_.download(std::span<std::uint32_t>(count));
      if (count[0] > capacity) {
        capacity = count[0];
        continue;
      }
      std::vector<Fragment> fragments(count[0]);
      log_.download(std::span<Fragment>(fragments), 16);
      std::sort(fragments.begin(), fragments.end(), [](const Fragment& a, const Fragment& b) {
        if (a.pixel != b.pixel) return a.pixel < b.pixel;
        return a.depth != b.depth ? a.depth < b.depth : a.payload < b.payload;
      });
      testkit::Lists<DepthItem> result;
      std::size_t next = 0;
      const std::size_t pixels = std::size_t{producer.width()} * producer.height();
      for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
        for (; next < fragments.size() && fragments[next].pixel == pixel; ++next) {
          result.keys.emplace_back(std::uint64_t{fragments[next].depth} << 32 |
                                   fragments[next].payload);
        }
        result.offsets.push_back(result.keys.size());
      }
      return result;
    }
  }

 private:
  struct Fragment {
    std::uint32_t pixel, depth, payload, unused;
  };
  static gl::StoreGlsl glsl() {
    return {"tests/raster/gl/fragment_log.h",
            {},
            R"(
layout(std430, binding = 8) buffer StoreLog {
  uint store_count;
  uint store_capacity;
  uint store_unused[2];
  uvec4 store_fragments[];
};
void strata_insert(uint pixel, uint depth, uint payload) {
  uint at = atomicAdd(store_count, 1u);
  if (at < store_capacity) store_fragments[at] = uvec4(pixel, depth, payload, 0u);
}
)"};
  }
  gl::Buffer log_;
};

}  // namespace strata::test
