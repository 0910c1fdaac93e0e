#include "mesh/weld.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <tuple>

namespace strata {
namespace {

/// Welds `count` points of `kinds` different ones by a map, by weld_first() and by weld_numbers().
template <class Scalar>
void compare(std::size_t count, std::uint32_t kinds, bool near) {
  std::mt19937 random(41);
  std::vector<glm::vec<3, Scalar>> points;
  for (std::size_t i = 0; i < count; ++i) {
    // Near: what was there lately comes again, as in the file of a mesh.
    const auto kind =
        static_cast<std::uint32_t>(near ? i / 6 - random() % (i / 6 + 1) % 500 : random());
    const std::uint32_t k = kind % kinds;
    points.emplace_back(Scalar(k % 64), Scalar(k / 64 % 64), Scalar(k / 4096));
    if constexpr (std::is_floating_point_v<Scalar>) {
      if (random() % 2 == 0) points.back() *= Scalar(1) - Scalar(2) * Scalar(k % 64 == 0);  // -0
    }
  }
  std::map<std::tuple<Scalar, Scalar, Scalar>, std::uint32_t> firsts;
  std::vector<std::uint32_t> expected, expected_numbers;
  std::vector<glm::dvec3> expected_positions;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& p = points[i];
    expected.push_back(firsts
                           .try_emplace({p.x + Scalar(0), p.y + Scalar(0), p.z + Scalar(0)},
                                        static_cast<std::uint32_t>(i))
                           .first->second);
    const std::uint32_t first = expected.back();
    if (first == i) {
      expected_numbers.push_back(static_cast<std::uint32_t>(expected_positions.size()));
      expected_positions.emplace_back(p);
    } else {
      expected_numbers.push_back(expected_numbers[first]);
    }
  }
  for (const int threads : {1, 2, 3, 7}) {
    Execution execution;
    execution.threads = threads;
    std::vector<std::uint32_t> first(count);
    EXPECT_EQ(detail::weld_first<Scalar>(
                  execution, count, [&](std::size_t i) { return points[i]; }, first.data()),
              firsts.size());
    EXPECT_EQ(first, expected) << threads;
    std::vector<std::uint32_t> numbers(count);
    std::vector<glm::dvec3> positions;
    EXPECT_TRUE(detail::weld_numbers<Scalar>(
        execution, count, [&](std::size_t i) { return points[i]; }, numbers.data(),
        [](std::size_t) { return true; }, positions));
    EXPECT_EQ(numbers, expected_numbers) << threads;
    EXPECT_EQ(positions, expected_positions) << threads;
    EXPECT_TRUE(std::none_of(positions.begin(), positions.end(), [](const glm::dvec3& p) {
      return std::signbit(p.x) && p.x == 0;  // -0 is +0
    }));
  }
}

TEST(Weld, FirstsAndNumbersAreThoseOfAMapForAnyThreads) {
  for (const std::size_t count : std::vector<std::size_t>{1, 100, 49999, 50000, 200000}) {
    for (const std::uint32_t kinds : {1u, 40u, 30000u, 250000u}) {
      for (const bool near : {false, true}) {
        compare<float>(count, kinds, near);
        compare<double>(count, kinds, near);
        compare<std::int32_t>(count, kinds, near);
      }
    }
  }
}

TEST(Weld, EndsWhereItIsTold) {
  for (const int threads : {1, 2}) {
    Execution execution;
    execution.threads = threads;
    std::vector<std::uint32_t> first(300000);
    (void)detail::weld_first<std::int32_t>(
        execution, first.size(), [](std::size_t i) { return glm::ivec3(static_cast<int>(i)); },
        first.data(), [](std::size_t i) { return i < 70000; });
    EXPECT_EQ(first.back(), 0u);
    std::vector<glm::dvec3> positions;
    EXPECT_FALSE(detail::weld_numbers<std::int32_t>(
        execution, first.size(), [](std::size_t i) { return glm::ivec3(static_cast<int>(i)); },
        first.data(), [](std::size_t i) { return i < 70000; }, positions));
  }
}

}  // namespace
}  // namespace strata
