#include "mesh/check/box_pairs.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <glm/common.hpp>
#include <thread>
#include <utility>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

// The division is an octree's. That a pair is compared only in the cell of its least shared point,
// by classes of boxes that begin in a cell or before it, is from Tsitsigkos, Lampropoulos, Bouros,
// Mamoulis, Terrovitis: A two-layer partitioning for non-point spatial data, 2021; that boxes which
// cover a cell stay there, as in segment trees, from Zomorodian, Edelsbrunner: Fast software for
// box intersections, 2000.

namespace strata {
namespace {

constexpr std::size_t kFewBoxes = 100;     // in a cell that is not divided
constexpr std::size_t kCopyCost = 24;      // to pass a box on costs as much as so many comparisons
constexpr std::size_t kBatch = 512;        // pairs a visit
constexpr std::size_t kTaskBoxes = 20000;  // a cell with more is divided by all threads

struct alignas(16) Entry {  // as two vectors of four
  glm::ivec3 low;
  std::uint32_t box;
  glm::ivec3 high;
  std::uint32_t group;
};

struct Cell {
  std::array<std::int64_t, 3> low;
  int bits;  // 2^bits points a side
};

// The boxes of a cell are in 16 classes. Bits 0 to 2: the box begins in the cell along x, y, z, not
// before it. Bit 3: it covers the cell. Two boxes have their least shared point in the cell only if
// one of them begins there along each axis.
constexpr unsigned kClasses = 16, kCovers = 8, kBegins = 7;

// Where the boxes of each class begin in a list; the last is the end.
using ClassBegins = std::array<std::uint32_t, kClasses + 1>;

struct Task {
  std::vector<Entry> entries;
  ClassBegins begins{};
  Cell cell{};
};

// The search of one thread. Lists of boxes lie one behind the other: those of a cell, then those of
// its eight parts, and so on.
class Search {
 public:
  Search(bool grouped, const BoxPairVisit& visit, int worker, const Execution& execution)
      : grouped_(grouped), visit_(visit), worker_(worker), execution_(execution) {
    found_.reserve(kBatch);
  }

  void run(Task task) {
    entries_ = std::move(task.entries);
    search(task.begins, task.cell);
    flush();
  }

  // Divides a cell once. The parts are left to the caller, if there are any.
  std::vector<Task> divide(Task task) {
    entries_ = std::move(task.entries);
    std::vector<Task> tasks;
    const int bits = prepare(task.begins, task.cell);
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      ClassBegins begins = parts_[part];
      const std::uint32_t first = begins.front(), end = begins.back();
      if (end - first < 2) continue;
      for (std::uint32_t& begin : begins) begin -= first;
      tasks.push_back({{entries_.begin() + first, entries_.begin() + end},
                       begins,
                       part_of(task.cell, part, bits)});
    }
    flush();
    entries_ = {};
    parts_ = {};
    return tasks;
  }

 private:
  // Parts are numbered by `bits` bits for each axis.
  static Cell part_of(const Cell& cell, std::size_t part, int bits) {
    Cell result{cell.low, cell.bits - bits};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t along =
          part >> k * static_cast<std::size_t>(bits) & ((std::size_t{1} << bits) - 1);
      result.low[k] += static_cast<std::int64_t>(along) << result.bits;
    }
    return result;
  }

  void search(const ClassBegins& begins, const Cell& cell) {
    const std::size_t first = parts_.size();
    const int bits = prepare(begins, cell);
    // The last part lies at the end of the lists: it is searched there, then removed.
    for (std::size_t part = parts_.size(); part-- > first;) {
      const ClassBegins own = parts_[part];
      if (own.back() - own.front() < 2) continue;
      entries_.resize(own.back());
      search(own, part_of(cell, part - first, bits));
    }
    parts_.resize(first);
  }

  // Compares the boxes of a cell, or appends its parts and the boxes of each.
  // @return the bits of the parts' numbers along each axis; 0: there are none
  int prepare(const ClassBegins& begins, const Cell& cell) {
    if (begins.back() - begins.front() < 2 || one_group(begins)) return 0;
    if (execution_.stop.stop_requested()) return 0;
    compare_covering(begins);
    entries_.resize(begins[kCovers]);
    const std::size_t boxes = begins[kCovers] - begins.front();
    const std::uint64_t comparisons = comparisons_of(begins);
    if (comparisons == 0) return 0;
    if (boxes > kFewBoxes && comparisons > kCopyCost * boxes) {
      // Many parts at once if that makes few copies.
      const int many = boxes > 4000 ? 3 : boxes > 300 ? 2 : 1;
      for (int bits = std::min(many, cell.bits); bits > 0; bits = std::min(bits - 1, 1)) {
        if (distribute(begins, cell, bits, comparisons)) return bits;
      }
    }
    if (comparisons < 64 * boxes) {
      compare_classes(begins);
    } else {
      sweep(begins, cell);
    }
    return 0;
  }

  [[nodiscard]] bool one_group(const ClassBegins& begins) const {
    if (!grouped_) return false;
    for (std::size_t i = begins.front() + 1; i < begins.back(); ++i) {
      if (entries_[i].group != entries_[begins.front()].group) return false;
    }
    return true;
  }

  // Between boxes that do not cover the cell.
  static std::uint64_t comparisons_of(const ClassBegins& begins) {
    const auto size = [&](unsigned c) { return std::uint64_t{begins[c + 1]} - begins[c]; };
    const std::uint64_t all = size(kBegins);
    std::uint64_t count = all * (all - (all > 0)) / 2;
    for (unsigned a = 0; a < kBegins; ++a) {
      if (size(a) == 0) continue;
      for (unsigned b = a + 1; b <= kBegins; ++b) {
        if ((a | b) == kBegins) count += size(a) * size(b);
      }
    }
    return count;
  }

  void compare_covering(const ClassBegins& begins) {
    for (unsigned a = kCovers; a < kClasses; ++a) {
      for (std::size_t i = begins[a]; i < begins[a + 1]; ++i) {
        if (i % 64 == 0 && execution_.stop.stop_requested()) return;
        const Entry box = entries_[i];
        for (unsigned b = 0; b < a; ++b) {
          if (((a | b) & kBegins) != kBegins) continue;
          for (std::size_t j = begins[b]; j < begins[b + 1]; ++j) compare(box, entries_[j]);
        }
        if (a != kClasses - 1) continue;
        for (std::size_t j = begins[a]; j < i; ++j) compare(box, entries_[j]);
      }
    }
  }

  // The parts that a box touches along an axis, from first to last.
  struct Along {
    std::uint32_t first, last;
    bool begins, covers_first, covers_last;

    [[nodiscard]] bool covers(std::uint32_t at) const {
      return (at != first || covers_first) && (at != last || covers_last);
    }
  };
  static Along along(std::int64_t low, std::int64_t high, std::int64_t from, int bits, int shift) {
    const std::int64_t size = std::int64_t{1} << shift, most = (std::int64_t{1} << bits) - 1;
    const std::int64_t first = std::max<std::int64_t>((low - from) >> shift, 0);
    const std::int64_t last = std::min((high - from) >> shift, most);
    return {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last), low >= from,
            low <= from + first * size, high >= from + (last + 1) * size - 1};
  }

  // Calls visit(part, class) for the parts that a box touches.
  template <class Visit>
  static void for_parts(const Entry& entry, const Cell& cell, int bits, const Visit& visit) {
    const int shift = cell.bits - bits;
    const Along x = along(entry.low.x, entry.high.x, cell.low[0], bits, shift),
                y = along(entry.low.y, entry.high.y, cell.low[1], bits, shift),
                z = along(entry.low.z, entry.high.z, cell.low[2], bits, shift);
    for (std::uint32_t k = z.first; k <= z.last; ++k) {
      const unsigned in_z = static_cast<unsigned>(z.begins && k == z.first) << 2;
      for (std::uint32_t j = y.first; j <= y.last; ++j) {
        const unsigned in_yz = in_z | static_cast<unsigned>(y.begins && j == y.first) << 1;
        const bool covers = z.covers(k) && y.covers(j);
        for (std::uint32_t i = x.first; i <= x.last; ++i) {
          const unsigned begins = in_yz | static_cast<unsigned>(x.begins && i == x.first);
          visit((k << bits | j) << bits | i, begins | (covers && x.covers(i) ? kCovers : 0));
        }
      }
    }
  }

  // Appends the parts and the boxes of each, unless comparing all is cheaper. Boxes that are
  // crowded in one of eight parts are always passed on: they may be apart there.
  bool distribute(const ClassBegins& begins, const Cell& cell, int bits,
                  std::uint64_t comparisons) {
    const std::size_t first = begins.front(), end = begins[kCovers], boxes = end - first;
    const std::size_t before = parts_.size(), count = std::size_t{1} << 3 * bits;
    parts_.resize(before + count);  // filled with zeros
    ClassBegins* const parts = parts_.data() + before;
    std::size_t copies = 0;
    const std::size_t most_copies = bits > 1 ? 2 * boxes : ~std::size_t{0};
    for (std::size_t i = first; i < end && copies <= most_copies; ++i) {
      for_parts(entries_[i], cell, bits, [&](std::uint32_t part, unsigned box_class) {
        ++parts[part][box_class];
        ++copies;
      });
    }
    if (copies > most_copies || end + copies > 0xffffffffu) {
      parts_.resize(before);
      return false;
    }
    std::size_t most = 0;
    std::uint64_t later = 0;
    auto at = static_cast<std::uint32_t>(end);
    for (std::size_t part = 0; part < count; ++part) {
      const std::uint32_t from = at;
      for (std::uint32_t& begin : parts[part]) at += std::exchange(begin, at);
      most = std::max<std::size_t>(most, at - from);
      if (at - from > 1) later += comparisons_of(parts[part]);
    }
    const bool crowded = bits == 1 && most >= boxes / 8 * 7 && copies <= 2 * boxes;
    if (later + kCopyCost * copies >= comparisons && !crowded) {
      parts_.resize(before);
      return false;
    }
    entries_.resize(at);
    for (std::size_t i = first; i < end; ++i) {
      for_parts(entries_[i], cell, bits, [&](std::uint32_t part, unsigned box_class) {
        entries_[parts[part][box_class]++] = entries_[i];
      });
    }
    // Each begin is now where the next class begins.
    for (std::size_t part = count; part-- > 0;) {
      for (std::size_t c = kClasses; c-- > 0;) parts[part][c + 1] = parts[part][c];
      parts[part][0] = part > 0 ? parts[part - 1][kClasses - 1] : static_cast<std::uint32_t>(end);
    }
    return true;
  }

  static bool apart(const Entry& a, const Entry& b) {
#ifdef __SSE2__
    const auto load = [](const glm::ivec3& v) {
      return _mm_load_si128(reinterpret_cast<const __m128i*>(&v));
    };
    const __m128i above = _mm_or_si128(_mm_cmpgt_epi32(load(a.low), load(b.high)),
                                       _mm_cmpgt_epi32(load(b.low), load(a.high)));
    return (_mm_movemask_ps(_mm_castsi128_ps(above)) & 7) != 0;
#else
    // One jump instead of six, which are hard to predict.
    return (a.low.x > b.high.x) | (b.low.x > a.high.x) | (a.low.y > b.high.y) |
           (b.low.y > a.high.y) | (a.low.z > b.high.z) | (b.low.z > a.high.z);
#endif
  }

  void compare(const Entry& a, const Entry& b) {
    if (!apart(a, b)) keep(a, b);
  }

  void keep(const Entry& a, const Entry& b) {
    if (grouped_ && a.group == b.group) return;
    found_.push_back({std::min(a.box, b.box), std::max(a.box, b.box)});
    if (found_.size() == kBatch) flush();
  }

  void flush() {
    if (!found_.empty()) visit_(found_, worker_);
    found_.clear();
  }

  void compare_classes(const ClassBegins& begins) {
    for (unsigned a = 0; a <= kBegins; ++a) {
      for (std::size_t i = begins[a]; i < begins[a + 1]; ++i) {
        const Entry box = entries_[i];
        for (unsigned b = a + 1; b <= kBegins; ++b) {
          if ((a | b) != kBegins) continue;
          for (std::size_t j = begins[b]; j < begins[b + 1]; ++j) compare(box, entries_[j]);
        }
        if (a != kBegins) continue;
        for (std::size_t j = begins[a]; j < i; ++j) compare(box, entries_[j]);
      }
    }
  }

  // For many boxes: sorts along the axis in which they are shortest.
  void sweep(const ClassBegins& begins, const Cell& cell) {
    const std::span<Entry> boxes =
        std::span(entries_).subspan(begins.front(), begins[kCovers] - begins.front());
    std::array<std::int64_t, 3> extents{};
    for (const Entry& box : boxes) {
      for (std::size_t k = 0; k < 3; ++k) {
        const int axis = static_cast<int>(k);
        const std::int64_t last = cell.low[k] + (std::int64_t{1} << cell.bits) - 1;
        extents[k] += std::min<std::int64_t>(box.high[axis], last) -
                      std::max<std::int64_t>(box.low[axis], cell.low[k]);
      }
    }
    const auto axis = static_cast<int>(std::ranges::min_element(extents) - extents.begin());
    std::ranges::sort(boxes, {}, [axis](const Entry& box) { return box.low[axis]; });
    const auto here = [&](const Entry& a, const Entry& b) {
      for (int k = 0; k < 3; ++k) {
        if (std::max(a.low[k], b.low[k]) < cell.low[static_cast<std::size_t>(k)]) return false;
      }
      return true;
    };
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      for (std::size_t j = i + 1; j < boxes.size() && boxes[j].low[axis] <= boxes[i].high[axis];
           ++j) {
        if (here(boxes[i], boxes[j])) compare(boxes[i], boxes[j]);
      }
      if (i % 64 == 0 && execution_.stop.stop_requested()) return;
    }
  }

  bool grouped_;
  const BoxPairVisit& visit_;
  int worker_;
  const Execution& execution_;
  std::vector<Entry> entries_;
  std::vector<ClassBegins> parts_;  // of the cells that are being searched
  std::vector<BoxPair> found_;
};

Task whole_task(std::span<const LatticeBox> boxes, std::span<const std::uint32_t> groups) {
  Task task;
  task.entries.reserve(boxes.size());
  glm::ivec3 low = boxes.front().low, high = boxes.front().high;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const LatticeBox& box = boxes[i];
    task.entries.push_back(
        {box.low, static_cast<std::uint32_t>(i), box.high, groups.empty() ? 0 : groups[i]});
    low = glm::min(low, box.low);
    high = glm::max(high, box.high);
  }
  std::uint64_t most = 0;
  for (int k = 0; k < 3; ++k) {
    task.cell.low[static_cast<std::size_t>(k)] = low[k];
    most = std::max(most, static_cast<std::uint64_t>(std::int64_t{high[k]} - low[k]));
  }
  task.cell.bits = static_cast<int>(std::bit_width(most));
  for (unsigned c = kBegins + 1; c <= kClasses; ++c) {
    task.begins[c] = static_cast<std::uint32_t>(task.entries.size());
  }
  return task;
}

std::size_t bytes_of(const std::vector<Task>& tasks) {
  std::size_t bytes = 0;
  for (const Task& task : tasks) bytes += task.entries.size() * sizeof(Entry);
  return bytes;
}

}  // namespace

Result<void> for_box_pairs(std::span<const LatticeBox> boxes, std::span<const std::uint32_t> groups,
                           const BoxPairVisit& visit, const Execution& execution) {
  if (boxes.size() < 2) return {};
  const auto too_much = [&](std::size_t bytes) {
    return execution.memory_limit != 0 && bytes > execution.memory_limit;
  };
  const auto over_limit = [&](std::size_t bytes) {
    return fail(ErrorCode::kLimit,
                "the search for boxes that touch needs {} bytes, the memory limit is {} bytes",
                bytes, execution.memory_limit);
  };
  if (const std::size_t bytes = 2 * boxes.size() * sizeof(Entry); too_much(bytes)) {
    return over_limit(bytes);
  }
  const bool grouped = !groups.empty();
  std::vector<Task> small, large;
  large.push_back(whole_task(boxes, groups));
  const std::size_t few = std::min(kTaskBoxes, boxes.size() / 16 + kFewBoxes);
  while (!large.empty()) {
    std::vector<std::vector<Task>> parts(large.size());
    parallel_for(execution, large.size(), [&](std::size_t i, int worker) {
      Search search(grouped, visit, worker, execution);
      parts[i] = search.divide(std::exchange(large[i], {}));
    });
    large.clear();
    for (std::vector<Task>& some : parts) {
      for (Task& task : some) {
        (task.entries.size() > few ? large : small).push_back(std::move(task));
      }
    }
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    if (const std::size_t bytes = bytes_of(small) + 2 * bytes_of(large); too_much(bytes)) {
      return over_limit(bytes);
    }
  }
  const std::thread::id caller = std::this_thread::get_id();
  std::atomic<std::size_t> finished = 0;
  parallel_for(execution, small.size(), [&](std::size_t i, int worker) {
    Search search(grouped, visit, worker, execution);
    search.run(std::exchange(small[i], {}));
    const std::size_t done = ++finished;
    if (execution.progress && std::this_thread::get_id() == caller) {
      execution.progress(static_cast<double>(done) / static_cast<double>(small.size()));
    }
  });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return {};
}

Result<std::vector<BoxPair>> box_pairs(std::span<const LatticeBox> boxes,
                                       std::span<const std::uint32_t> groups,
                                       const Execution& execution) {
  std::vector<std::vector<BoxPair>> found(static_cast<std::size_t>(execution.thread_count()));
  std::atomic<std::uint64_t> count = 0;
  std::stop_source enough;
  const std::stop_callback pass_on(execution.stop, [&] { enough.request_stop(); });
  const auto over_limit = [&](std::uint64_t pairs) {  // they are held twice when they are joined
    return execution.memory_limit != 0 && 2 * pairs * sizeof(BoxPair) > execution.memory_limit;
  };
  Execution inner = execution;
  inner.stop = enough.get_token();
  const auto done = for_box_pairs(
      boxes, groups,
      [&](std::span<const BoxPair> pairs, int worker) {
        auto& list = found[static_cast<std::size_t>(worker)];
        list.insert(list.end(), pairs.begin(), pairs.end());
        if (over_limit(count += pairs.size())) enough.request_stop();
      },
      inner);
  if (over_limit(count) && !execution.stop.stop_requested()) {
    return fail(ErrorCode::kLimit,
                "at least {} pairs of boxes touch, more than the memory limit of {} bytes holds",
                count.load(), execution.memory_limit);
  }
  if (!done) return tl::unexpected(done.error());
  std::vector<BoxPair> all;
  all.reserve(count);
  for (std::vector<BoxPair>& list : found) {
    all.insert(all.end(), list.begin(), list.end());
    list = {};
  }
  std::ranges::sort(all);
  return all;
}

}  // namespace strata
