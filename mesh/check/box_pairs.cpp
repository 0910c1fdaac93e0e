#include "mesh/check/box_pairs.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <glm/common.hpp>
#include <thread>
#include <utility>

// The division is an octree's. That a pair is compared only in the cell of its least shared point,
// by classes of boxes that begin in a cell or before it, is from Tsitsigkos, Lampropoulos, Bouros,
// Mamoulis, Terrovitis: A two-layer partitioning for non-point spatial data, 2021; that boxes which
// cover a cell stay there, as in segment trees, from Zomorodian, Edelsbrunner: Fast software for
// box intersections, 2000.

namespace strata {
namespace {

constexpr std::size_t kFewBoxes = 40;      // in a cell that is not divided
constexpr std::size_t kCopyCost = 12;      // to pass a box on costs as much as so many comparisons
constexpr std::size_t kBatch = 512;        // pairs a visit
constexpr std::size_t kTaskBoxes = 20000;  // a cell with more is divided by all threads

struct Entry {
  glm::ivec3 low, high;
  std::uint32_t box, group;
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
using ClassBegins = std::array<std::size_t, kClasses + 1>;

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
    std::array<ClassBegins, 8> parts;
    if (prepare(task.begins, task.cell, parts)) {
      for (unsigned part = 0; part < 8; ++part) {
        const std::size_t first = parts[part].front(), end = parts[part].back();
        if (end - first < 2) continue;
        for (std::size_t& begin : parts[part]) begin -= first;
        const auto at = [&](std::size_t i) {
          return entries_.begin() + static_cast<std::ptrdiff_t>(i);
        };
        tasks.push_back({{at(first), at(end)}, parts[part], part_of(task.cell, part)});
      }
    }
    flush();
    entries_ = {};
    return tasks;
  }

 private:
  static Cell part_of(const Cell& cell, unsigned part) {
    Cell result{cell.low, cell.bits - 1};
    for (unsigned k = 0; k < 3; ++k) {
      if ((part >> k & 1) != 0) result.low[k] += std::int64_t{1} << result.bits;
    }
    return result;
  }

  void search(const ClassBegins& begins, const Cell& cell) {
    std::array<ClassBegins, 8> parts;
    if (!prepare(begins, cell, parts)) return;
    // The last part lies at the end of the lists: it is searched there, then removed.
    for (unsigned part = 8; part-- > 0;) {
      entries_.resize(parts[part].back());
      search(parts[part], part_of(cell, part));
    }
  }

  // Compares the boxes of a cell, or appends them by the parts of the cell.
  // @return whether parts are left to be searched
  bool prepare(const ClassBegins& begins, const Cell& cell, std::array<ClassBegins, 8>& parts) {
    if (begins.back() - begins.front() < 2 || one_group(begins)) return false;
    if (execution_.stop.stop_requested()) return false;
    compare_covering(begins);
    entries_.resize(begins[kCovers]);
    const std::size_t boxes = begins[kCovers] - begins.front();
    const std::uint64_t comparisons = comparisons_of(begins);
    if (comparisons == 0) return false;
    if (boxes > kFewBoxes && cell.bits > 0 && comparisons > kCopyCost * boxes &&
        distribute(begins, cell, comparisons, parts)) {
      return true;
    }
    if (comparisons < 64 * boxes) {
      compare_classes(begins);
    } else {
      sweep(begins, cell);
    }
    return false;
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
    std::uint64_t count = 0;
    for (unsigned a = 0; a < kBegins; ++a) {
      for (unsigned b = a + 1; b <= kBegins; ++b) {
        if ((a | b) == kBegins) count += (begins[a + 1] - begins[a]) * (begins[b + 1] - begins[b]);
      }
    }
    const std::uint64_t all = begins[kBegins + 1] - begins[kBegins];
    return count + all * (all - (all > 0)) / 2;
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

  // The parts that a box touches, each with the class that the box has there.
  template <class Visit>
  static void for_parts(const Entry& entry, const Cell& cell, const Visit& visit) {
    constexpr unsigned kLower[3] = {0x55, 0x33, 0x0f};  // the parts in the lower half of an axis
    const std::int64_t half = std::int64_t{1} << (cell.bits - 1);
    unsigned parts = 0xff, begins_below = 0, begins_above = 0;
    bool may_cover = true;
    for (unsigned k = 0; k < 3; ++k) {
      const std::int64_t low = entry.low[static_cast<int>(k)],
                         high = entry.high[static_cast<int>(k)];
      const std::int64_t from = cell.low[k], middle = from + half;
      parts &= (low < middle ? kLower[k] : 0) | (high >= middle ? ~kLower[k] : 0);
      begins_below |= static_cast<unsigned>(low >= from) << k;
      begins_above |= static_cast<unsigned>(low >= middle) << k;
      may_cover = may_cover && high - low >= half - 1;
    }
    for (; parts != 0; parts &= parts - 1) {
      const auto part = static_cast<unsigned>(std::countr_zero(parts));
      const unsigned begins = (begins_below & ~part) | (begins_above & part);
      const bool covers = may_cover && covers_cell(entry, part_of(cell, part));
      visit(part, begins | (covers ? kCovers : 0));
    }
  }

  static bool covers_cell(const Entry& entry, const Cell& cell) {
    const std::int64_t last = (std::int64_t{1} << cell.bits) - 1;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<int>(k);
      if (entry.low[axis] > cell.low[k] || entry.high[axis] < cell.low[k] + last) return false;
    }
    return true;
  }

  // Appends the boxes of each of the eight parts, unless comparing all is cheaper. Boxes that are
  // crowded in one part are always passed on: they may be apart there.
  bool distribute(const ClassBegins& begins, const Cell& cell, std::uint64_t comparisons,
                  std::array<ClassBegins, 8>& parts) {
    const std::size_t first = begins.front(), end = begins[kCovers], boxes = end - first;
    std::array<std::array<std::uint32_t, kClasses>, 8> counts{};
    for (std::size_t i = first; i < end; ++i) {
      for_parts(entries_[i], cell,
                [&](unsigned part, unsigned box_class) { ++counts[part][box_class]; });
    }
    std::size_t at = end, most = 0;
    std::uint64_t later = 0;
    for (unsigned part = 0; part < 8; ++part) {
      parts[part].front() = at;
      for (unsigned c = 0; c < kClasses; ++c) parts[part][c + 1] = at += counts[part][c];
      most = std::max(most, at - parts[part].front());
      later += comparisons_of(parts[part]);
    }
    const std::size_t copies = at - end;
    if (later + kCopyCost * copies >= comparisons && (most < boxes / 8 * 7 || copies > 2 * boxes)) {
      return false;
    }
    entries_.resize(at);
    std::array<std::array<std::size_t, kClasses>, 8> next{};
    for (unsigned part = 0; part < 8; ++part) {
      std::copy_n(parts[part].begin(), kClasses, next[part].begin());
    }
    for (std::size_t i = first; i < end; ++i) {
      for_parts(entries_[i], cell, [&](unsigned part, unsigned box_class) {
        entries_[next[part][box_class]++] = entries_[i];
      });
    }
    return true;
  }

  void compare(const Entry& a, const Entry& b) {
    // One jump instead of six, which are hard to predict.
    const bool apart = (a.low.x > b.high.x) | (b.low.x > a.high.x) | (a.low.y > b.high.y) |
                       (b.low.y > a.high.y) | (a.low.z > b.high.z) | (b.low.z > a.high.z);
    if (!apart) keep(a, b);
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
  std::vector<BoxPair> found_;
};

Task whole_task(std::span<const LatticeBox> boxes, std::span<const std::uint32_t> groups) {
  Task task;
  task.entries.reserve(boxes.size());
  glm::ivec3 low = boxes.front().low, high = boxes.front().high;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const LatticeBox& box = boxes[i];
    task.entries.push_back(
        {box.low, box.high, static_cast<std::uint32_t>(i), groups.empty() ? 0 : groups[i]});
    low = glm::min(low, box.low);
    high = glm::max(high, box.high);
  }
  std::uint64_t most = 0;
  for (int k = 0; k < 3; ++k) {
    task.cell.low[static_cast<std::size_t>(k)] = low[k];
    most = std::max(most, static_cast<std::uint64_t>(std::int64_t{high[k]} - low[k]));
  }
  task.cell.bits = static_cast<int>(std::bit_width(most));
  for (unsigned c = kBegins + 1; c <= kClasses; ++c) task.begins[c] = task.entries.size();
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
