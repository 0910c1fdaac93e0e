#pragma once

// Depth lists and files for the tests of ldi_io.

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "strata/core/depth_list.h"
#include "tests/support/temporary_folder.h"

namespace strata::ldi_testing {

using testkit::TemporaryFolder;

inline void write_bytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

inline LayeredDepthImage image_of(int width, int height,
                                  const std::vector<std::vector<DepthItem>>& lists) {
  LayeredDepthImage image;
  image.width = width;
  image.height = height;
  image.depth_limit = 1 << 24;
  image.offsets = {0};
  for (const auto& list : lists) {
    image.items.insert(image.items.end(), list.begin(), list.end());
    image.offsets.push_back(image.items.size());
  }
  return image;
}

/// What a ray through closed solids gives: pairs that do not overlap, no depth twice.
inline std::vector<DepthItem> clean_list(std::mt19937_64& random, std::size_t intervals) {
  std::vector<DepthItem> list;
  std::uint32_t depth = 0;
  for (std::size_t i = 0; i < 2 * intervals; ++i) {
    depth += 1 + static_cast<std::uint32_t>(random() % 5000);
    list.emplace_back(depth, i % 2 == 1, static_cast<std::uint32_t>(random() & 0x7fffffff));
  }
  return list;
}

/// Anything sorted: equal depths and equal crossings, entries and exits as they come.
inline std::vector<DepthItem> wild_list(std::mt19937_64& random, std::size_t count) {
  std::vector<DepthItem> list;
  const std::uint64_t spread = random() % 3 == 0 ? 4 : 1 << 24;
  for (std::size_t i = 0; i < count; ++i) {
    if (!list.empty() && random() % 4 == 0) {
      list.push_back(list.back());
      continue;
    }
    list.emplace_back(static_cast<std::uint32_t>(random() % spread), random() % 2 == 0,
                      static_cast<std::uint32_t>(random() & 0x7fffffff));
  }
  std::sort(list.begin(), list.end());
  return list;
}

inline LayeredDepthImage random_image(unsigned seed, int width, int height) {
  std::mt19937_64 random(seed);
  std::vector<std::vector<DepthItem>> lists;
  for (int i = 0; i < width * height; ++i) {
    const std::size_t layers = random() % 50 == 0 ? 300 : random() % 6;
    lists.push_back(random() % 2 == 0 ? clean_list(random, layers) : wild_list(random, layers));
  }
  LayeredDepthImage image = image_of(width, height, lists);
  std::uniform_real_distribution<double> entry(-3, 3);
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 3; ++j) image.world_from_image[i][j] = entry(random);
  }
  return image;
}

}  // namespace strata::ldi_testing
