// Explores random schedules of concurrent insertions, one atomic operation on the table a step,
// over thousands of small instances. Virtual threads on one real thread: every run is reproducible.

#include <gtest/gtest.h>

#include <memory>
#include <optional>

#include "strata/hashbuffer/hash_buffer.h"
#include "tests/hashbuffer/store_support.h"

namespace strata {
namespace {

using test::Fragment;
using test::random_fragments;
using test::sort_everything;

// Sanitizers make it ten times slower and find nothing more in the last nine tenths.
constexpr int kTenth = testkit::kSanitized ? 1 : 10;

constexpr OffsetKind kKinds[] = {OffsetKind::kRandom, OffsetKind::kFarthestPoint,
                                 OffsetKind::kPlaneFirst};

/// Runs `insert(fragment)` objects, which have step(), on `threads` virtual threads in an order
/// drawn from `random`; calls after() after each step.
template <class MakeInsertion, class After>
void run_schedule(Random& random, const std::vector<Fragment>& fragments, std::size_t threads,
                  MakeInsertion&& make_insertion, After&& after) {
  using Insertion = std::invoke_result_t<MakeInsertion, const Fragment&>;
  std::vector<std::optional<Insertion>> running(threads);
  std::size_t next = 0, active = 0;
  while (active > 0 || next < fragments.size()) {
    auto& slot = running[random.below(threads)];
    if (!slot) {
      if (next == fragments.size()) continue;
      slot.emplace(make_insertion(fragments[next++]));
      ++active;
    }
    if (!slot->step()) {
      slot.reset();
      --active;
    }
    after();
  }
}

template <class Buffer, bool guarded>
struct LibraryInsertion {
  typename Buffer::Insertion insertion;
  LibraryInsertion(Buffer& buffer, const Fragment& f)
      : insertion(buffer, f.x, f.y, f.depth, f.payload) {}
  bool step() { return insertion.template step<guarded>(); }
};

/// The records of a pixel by age, wherever they are in the table.
template <class Record>
std::vector<DepthItem> records_of(std::span<const typename Record::Word> table,
                                  std::span<const std::uint64_t> offsets, std::uint64_t pixel) {
  std::vector<DepthItem> items;
  for (unsigned age = 1; age < offsets.size(); ++age) {
    const auto word = table[(pixel + offsets[age]) % table.size()];
    if (Record::age(word) == age) items.push_back(Record::item(word));
  }
  return items;
}

struct Instance {
  int width, height;
  std::uint64_t pixels;
  HashBufferOptions options;
  std::vector<Fragment> fragments;
};

Instance random_instance(Random& random, int number) {
  Instance instance{};
  instance.width = 1 + static_cast<int>(random.below(4));
  instance.height = 1 + static_cast<int>(random.below(3));
  instance.pixels = static_cast<std::uint64_t>(instance.width * instance.height);
  instance.options.cells = instance.pixels + random.below(2 * instance.pixels + 2);
  instance.options.offsets = kKinds[number % 3];
  instance.options.seed = static_cast<std::uint64_t>(number);
  instance.options.age_limit =
      random.below(3) == 0 ? 1 + static_cast<unsigned>(random.below(5)) : 0;
  instance.fragments = random_fragments(random, instance.width, instance.height,
                                        random.below(instance.options.cells * 3 / 2 + 2), 4, 2);
  return instance;
}

template <class Record>
class ScheduleModel : public testing::Test {};
using Records = testing::Types<Record32, Record64, Record64Deep>;
TYPED_TEST_SUITE(ScheduleModel, Records);

TYPED_TEST(ScheduleModel, EveryScheduleMakesTheSameTableAndTheSortedLists) {
  using Record = TypeParam;
  using Buffer = HashBuffer<Record, Concurrent>;
  Random random(51);
  int over_full = 0, exact = 0;
  for (int number = 0; number < 600 * kTenth; ++number) {
    Instance instance = random_instance(random, number);
    auto first = Buffer::create(instance.width, instance.height, instance.options).value();
    for (int schedule = 0; schedule < 4; ++schedule) {
      auto buffer = Buffer::create(instance.width, instance.height, instance.options).value();
      std::vector<typename Record::Word> before(buffer.cells().begin(), buffer.cells().end());
      test::shuffle(random, instance.fragments);
      run_schedule(
          random, instance.fragments, 1 + random.below(5),
          [&](const Fragment& f) { return LibraryInsertion<Buffer, false>(buffer, f); },
          [&] {
            for (std::size_t cell = 0; cell < before.size(); ++cell) {
              ASSERT_GE(buffer.cells()[cell], before[cell]) << "a cell was lowered";
              before[cell] = buffer.cells()[cell];
            }
            // Sorted at any time, not only in the end.
            const std::uint64_t pixel = random.below(instance.pixels);
            const auto items = records_of<Record>(buffer.cells(), buffer.offsets(), pixel);
            ASSERT_TRUE(std::is_sorted(items.begin(), items.end()));
          });
      ASSERT_FALSE(testing::Test::HasFatalFailure()) << "instance " << number;
      ASSERT_EQ(buffer.stored() + buffer.failures(), instance.fragments.size());
      if (buffer.failures() > 0) buffer.tighten_max_ages();

      const auto lists = buffer.depth_image(Execution{.threads = 1}).value();
      const auto expected =
          sort_everything<Record>(instance.width, instance.height, instance.fragments);
      ASSERT_EQ(lists, expected) << "instance " << number;
      if (buffer.failures() == 0) {
        ++exact;
      } else {
        ++over_full;
        for (std::uint64_t pixel = 0; pixel < instance.pixels; ++pixel) {
          const int x = static_cast<int>(pixel) % instance.width;
          const int y = static_cast<int>(pixel) / instance.width;
          const auto all = expected.list(x, y);
          const auto kept = records_of<Record>(buffer.cells(), buffer.offsets(), pixel);
          ASSERT_LE(kept.size(), all.size());
          ASSERT_TRUE(std::equal(kept.begin(), kept.end(), all.begin()))
              << "not the nearest fragments in the table, instance " << number;
        }
      }

      if (schedule == 0) {
        first = std::move(buffer);
      } else {
        ASSERT_TRUE(std::equal(first.cells().begin(), first.cells().end(), buffer.cells().begin()))
            << "the table depends on the schedule, instance " << number;
        ASSERT_TRUE(
            std::equal(first.max_ages().begin(), first.max_ages().end(), buffer.max_ages().begin()))
            << "the max-age table depends on the schedule, instance " << number;
        ASSERT_EQ(first.failures(), buffer.failures());
      }
    }
  }
  EXPECT_GT(over_full, 100 * kTenth);
  EXPECT_GT(exact, 100 * kTenth);
}

// ---- Culling ----------------------------------------------------------------------------------

double opacity_of(std::uint32_t payload) { return (payload & 0xff) / 255.0; }

/// The culling as the paper prints it (erratum E3), for comparison only: every record of the same
/// age that beats the one in flight adds to its opacity, met before or not.
class PrintedInsertion {
 public:
  using R = Record64;
  PrintedInsertion(std::vector<R::Word>& table, std::span<const std::uint64_t> offsets,
                   const Instance& instance, const Fragment& f)
      : table_(&table),
        offsets_(offsets),
        threshold_(instance.options.opacity_threshold),
        pixel_(static_cast<std::uint64_t>(f.y * instance.width + f.x)),
        record_(R::pack(1, f.depth, f.payload)) {}

  bool step() {
    const std::uint64_t size = table_->size();
    const std::uint64_t cell = (pixel_ + offsets_[age_]) % size;
    const R::Word found = Exclusive::fetch_max((*table_)[cell], record_);
    if (found < record_) {
      if (found == 0) return false;
      const bool same_pixel = R::age(found) == age_;
      record_ = found;
      if (same_pixel) return true;  // the same age again, where it meets its better
      age_ = R::age(found);
      pixel_ = (cell + size - offsets_[age_]) % size;
      opacity_ = 0.0;
    } else if (R::age(found) == age_) {
      opacity_ += (1.0 - opacity_) * opacity_of(R::payload(found));
      if (opacity_ > threshold_) return false;
    }
    if (age_ + 1 >= offsets_.size()) return false;
    ++age_;
    record_ = R::with_next_age(record_);
    return true;
  }

 private:
  std::vector<R::Word>* table_;
  std::span<const std::uint64_t> offsets_;
  double threshold_;
  std::uint64_t pixel_;
  R::Word record_;
  unsigned age_ = 1;
  double opacity_ = 0.0;
};

/// What a picture needs of a list: all up to the fragment that makes it opaque enough.
std::vector<DepthItem> visible_part(std::span<const DepthItem> list, double threshold) {
  std::vector<DepthItem> visible;
  double transmittance = 1.0;
  for (const DepthItem item : list) {
    if (transmittance < 1.0 - threshold) break;
    visible.push_back(item);
    transmittance *= 1.0 - opacity_of(item.payload());
  }
  return visible;
}

/// A few pixels with deep lists of fragments that differ, in a roomy table.
Instance culling_instance(Random& random, int number) {
  Instance instance{};
  instance.width = 1 + static_cast<int>(random.below(3));
  instance.height = 1;
  instance.pixels = static_cast<std::uint64_t>(instance.width);
  instance.fragments =
      random_fragments(random, instance.width, 1, 4 + random.below(7), 1 << 20, 1 << 20);
  for (Fragment& f : instance.fragments) {
    f.payload = (f.payload & ~0xffu) | static_cast<std::uint32_t>(64 + random.below(150));
  }
  instance.options.cells = instance.pixels * 3 + instance.fragments.size() + random.below(4);
  instance.options.offsets = kKinds[number % 3];
  instance.options.seed = static_cast<std::uint64_t>(number);
  instance.options.opacity_threshold = 0.75 + 0.01 * static_cast<double>(random.below(20));
  return instance;
}

TEST(ScheduleModelCulling, E3NoScheduleDropsAVisibleFragmentButThePrintedRuleDoes) {
  using Buffer = HashBuffer<Record64, Concurrent, double (*)(std::uint32_t)>;
  Random random(52);
  int printed_errors = 0, printed_sequential_errors = 0, culled = 0;
  for (int number = 0; number < 2000 * kTenth; ++number) {
    Instance instance = culling_instance(random, number);
    const auto exact = sort_everything<Record64>(instance.width, 1, instance.fragments);
    const double threshold = instance.options.opacity_threshold;
    bool printed_failed = false;
    for (int schedule = 0; schedule < 4; ++schedule) {
      test::shuffle(random, instance.fragments);
      auto buffer = Buffer::create(instance.width, 1, instance.options, opacity_of).value();
      const std::size_t threads = schedule == 0 ? 1 : 2 + random.below(4);
      run_schedule(
          random, instance.fragments, threads,
          [&](const Fragment& f) { return LibraryInsertion<Buffer, true>(buffer, f); }, [] {});
      ASSERT_EQ(buffer.failures(), 0u);
      ASSERT_EQ(buffer.stored() + buffer.dropped(), instance.fragments.size());
      culled += buffer.dropped() > 0;
      const auto lists = buffer.depth_image(Execution{.threads = 1}).value();

      std::vector<Record64::Word> table(buffer.cells().size());
      run_schedule(
          random, instance.fragments, threads,
          [&](const Fragment& f) { return PrintedInsertion(table, buffer.offsets(), instance, f); },
          [] {});
      for (int x = 0; x < instance.width; ++x) {
        const auto visible = visible_part(exact.list(x, 0), threshold);
        const auto kept = lists.list(x, 0);
        ASSERT_TRUE(std::equal(kept.begin(), kept.end(), visible.begin(), visible.end()))
            << "instance " << number;
        const auto printed =
            records_of<Record64>(table, buffer.offsets(), static_cast<unsigned>(x));
        if (!std::includes(printed.begin(), printed.end(), visible.begin(), visible.end())) {
          if (schedule == 0) ++printed_sequential_errors;
          printed_failed = true;
        }
      }
    }
    printed_errors += printed_failed;
  }
  EXPECT_GT(culled, 100 * kTenth);  // or nothing was tested
  EXPECT_EQ(printed_sequential_errors, 0);
  EXPECT_GT(printed_errors, 0);
  RecordProperty("printed_rule_instances_with_a_lost_fragment", printed_errors);
}

TEST(ScheduleModelCulling, NoScheduleDropsOneOfTheKNearest) {
  using Buffer = HashBuffer<Record64, Concurrent>;
  Random random(53);
  int dropped = 0;
  for (int number = 0; number < 1000 * kTenth; ++number) {
    Instance instance = random_instance(random, number);
    instance.options.age_limit = 0;
    instance.options.cells = instance.pixels * 2 + instance.fragments.size();
    instance.options.keep_nearest = 1 + static_cast<unsigned>(random.below(3));
    const auto expected = test::cut_lists(
        sort_everything<Record64>(instance.width, instance.height, instance.fragments),
        instance.options.keep_nearest);
    for (int schedule = 0; schedule < 4; ++schedule) {
      test::shuffle(random, instance.fragments);
      auto buffer = Buffer::create(instance.width, instance.height, instance.options).value();
      run_schedule(
          random, instance.fragments, 1 + random.below(5),
          [&](const Fragment& f) { return LibraryInsertion<Buffer, true>(buffer, f); }, [] {});
      ASSERT_EQ(buffer.failures(), 0u);
      dropped += buffer.dropped() > 0;
      ASSERT_EQ(buffer.depth_image(Execution{.threads = 1}).value(), expected)
          << "instance " << number;
    }
  }
  EXPECT_GT(dropped, 100 * kTenth);
}

}  // namespace
}  // namespace strata
