// What the stores say they hold is what they allocate, and what the papers' formulas say.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>

#include "strata/hashbuffer/count_scan_store.h"
#include "strata/hashbuffer/hash_buffer.h"
#include "tests/hashbuffer/store_support.h"

namespace {
std::atomic<std::int64_t> g_held{0};  // bytes asked for and not given back
std::atomic<std::int64_t> g_peak{0};  // the most that were held
}  // namespace

// The size is kept in front of each block.
void* operator new(std::size_t size) {
  auto* block = static_cast<std::size_t*>(std::malloc(size + 16));
  if (block == nullptr) throw std::bad_alloc();
  *block = size;
  g_held += static_cast<std::int64_t>(size);
  g_peak = std::max<std::int64_t>(g_peak, g_held);
  return block + 16 / sizeof(std::size_t);
}
void operator delete(void* pointer) noexcept {
  if (pointer == nullptr) return;
  auto* block = static_cast<std::size_t*>(pointer) - 16 / sizeof(std::size_t);
  g_held -= static_cast<std::int64_t>(*block);
  std::free(block);
}
void operator delete(void* pointer, std::size_t) noexcept { operator delete(pointer); }

namespace strata {
namespace {

using test::random_fragments;
using test::Submission;

template <class Record>
class MemoryFormula : public testing::Test {};
using Records = testing::Types<Record32, Record64, Record64Deep>;
TYPED_TEST_SUITE(MemoryFormula, Records);

TYPED_TEST(MemoryFormula, OfTheHashBufferEqualsItsAllocatedBytes) {
  using Buffer = HashBuffer<TypeParam, Exclusive>;
  Random random(61);
  for (const OffsetKind kind :
       {OffsetKind::kRandom, OffsetKind::kFarthestPoint, OffsetKind::kPlaneFirst}) {
    for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {64, 64}, {100, 33}}) {
      const auto pixels = static_cast<std::size_t>(width * height);
      const auto fragments = random_fragments(random, width, height, 3 * pixels);
      const std::int64_t before = g_held;
      auto buffer = Buffer::create(width, height, {.offsets = kind}).value();
      EXPECT_EQ(static_cast<std::uint64_t>(g_held - before), buffer.memory_bytes());
      ASSERT_TRUE(build(buffer, Submission(fragments)));
      EXPECT_EQ(static_cast<std::uint64_t>(g_held - before), buffer.memory_bytes());

      // H3, H4, H7: one word a cell, F / load cells, one age for each 8 x 8 pixels; and ours, the
      // offsets.
      const std::uint64_t cells = buffer.cells().size();
      const auto blocks = static_cast<std::uint64_t>((width + 7) / 8 * ((height + 7) / 8));
      const std::uint64_t age_bytes = TypeParam::kAgeBits > 8 ? 2 : 1;
      EXPECT_EQ(buffer.memory_bytes(),
                cells * sizeof(typename TypeParam::Word) + blocks * age_bytes +
                    8 * (std::min<std::uint64_t>(TypeParam::kAgeMax, cells) + 1));
      EXPECT_NEAR(static_cast<double>(cells), static_cast<double>(fragments.size()) / buffer.load(),
                  1e-6 * static_cast<double>(cells));
    }
  }
}

TYPED_TEST(MemoryFormula, HoldsWhenTheTableGrowsAndShrinksWithoutTwoTablesAtOnce) {
  const std::int64_t before = g_held;
  auto buffer = HashBuffer<TypeParam, Exclusive>::create(64, 64).value();
  for (const std::uint64_t cells : {50000u, 100000u, 100001u, 60000u, 4096u}) {
    g_peak = before;
    ASSERT_TRUE(buffer.resize(cells));
    EXPECT_EQ(static_cast<std::uint64_t>(g_held - before), buffer.bytes_of(cells));
    // The new offsets are drawn while the old ones last; drawing takes a few of their size.
    EXPECT_LT(static_cast<std::uint64_t>(g_peak - before),
              buffer.bytes_of(cells) + 64 * TypeParam::kAgeMax);
  }
}

TYPED_TEST(MemoryFormula, LargestCellsIsTheInverseOfBytesOf) {
  const auto buffer = HashBuffer<TypeParam, Exclusive>::create(3, 3).value();
  for (std::uint64_t cells = 1; cells < 3000; ++cells) {
    const std::uint64_t bytes = buffer.bytes_of(cells);
    EXPECT_EQ(buffer.largest_cells(bytes), cells);
    EXPECT_EQ(buffer.largest_cells(bytes - 1), cells - 1);
  }
}

TYPED_TEST(MemoryFormula, OfCountScanEqualsItsAllocatedBytesAndIsExact) {
  Random random(62);
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {64, 64}, {100, 33}}) {
    const auto pixels = static_cast<std::size_t>(width * height);
    const auto fragments = random_fragments(random, width, height, 3 * pixels);
    const std::int64_t before = g_held;
    auto store = CountScanStore<TypeParam, Exclusive>::create(width, height).value();
    // On one thread, or the thread library's own first allocations would be counted.
    const Execution alone{.threads = 1};
    ASSERT_TRUE(build(store, Submission(fragments), alone));
    EXPECT_EQ(static_cast<std::uint64_t>(g_held - before), store.memory_bytes());
    // D5: F r + 8 P with r = 8, and 8 for the end of the last list.
    EXPECT_EQ(store.memory_bytes(), 8 * fragments.size() + 8 * pixels + 8);

    // A smaller frame uses the room again, unless the limit forbids it.
    const std::vector<test::Fragment> none;
    ASSERT_TRUE(build(store, Submission(none), alone));
    EXPECT_EQ(static_cast<std::uint64_t>(g_held - before), store.memory_bytes());
    EXPECT_EQ(store.memory_bytes(), 8 * fragments.size() + 8 * pixels + 8);
    ASSERT_TRUE(build(store, Submission(none), {.threads = 1, .memory_limit = 8 * pixels + 8}));
    EXPECT_EQ(static_cast<std::uint64_t>(g_held - before), store.memory_bytes());
    EXPECT_EQ(store.memory_bytes(), 8 * pixels + 8);
  }
}

}  // namespace
}  // namespace strata
