#include "mesh/check/box_pairs.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <glm/common.hpp>
#include <utility>

// The division is an octree's whose leaves are compared by brute force; leaving boxes that cover a
// cell at the cell is what segment trees do (Zomorodian, Edelsbrunner: Fast software for box
// intersections, 2000).

namespace strata {
namespace {

constexpr std::size_t kFewBoxes = 32;      // compared by brute force; faster than 16 and 64
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

struct Task {
  std::vector<Entry> entries;
  Cell cell;
};

// The search of one thread. Lists of boxes lie one behind the other: those of a cell, then those of
// its eight parts, and so on.
class Search {
 public:
  Search(bool grouped, const BoxPairVisit& visit, int worker, const Execution& execution)
      : grouped_(grouped), visit_(visit), worker_(worker), execution_(execution) {
    found_.reserve(kBatch + kFewBoxes);
  }

  void run(std::vector<Entry> entries, const Cell& cell) {
    entries_ = std::move(entries);
    search(0, cell);
    flush();
  }

  // Divides a cell once. The parts are left to the caller, if there are any.
  std::vector<Task> divide(std::vector<Entry> entries, const Cell& cell) {
    entries_ = std::move(entries);
    std::vector<Task> tasks;
    std::array<std::size_t, 9> begin{};
    if (prepare(0, cell, begin)) {
      for (unsigned part = 0; part < 8; ++part) {
        if (begin[part] == begin[part + 1]) continue;
        tasks.push_back({{entries_.begin() + static_cast<std::ptrdiff_t>(begin[part]),
                          entries_.begin() + static_cast<std::ptrdiff_t>(begin[part + 1])},
                         part_of(cell, part)});
      }
    }
    flush();
    entries_ = {};
    return tasks;
  }

  // Bytes of the lists in use when they were longest.
  [[nodiscard]] std::size_t bytes() const { return most_ * sizeof(Entry); }

 private:
  static Cell part_of(const Cell& cell, unsigned part) {
    Cell result{cell.low, cell.bits - 1};
    for (unsigned k = 0; k < 3; ++k) {
      if ((part >> k & 1) != 0) result.low[k] += std::int64_t{1} << result.bits;
    }
    return result;
  }

  void search(std::size_t first, const Cell& cell) {
    std::array<std::size_t, 9> begin{};
    if (!prepare(first, cell, begin)) return;
    const std::size_t end = entries_.size();
    // The last part lies at the end of the lists: it is searched in place, then removed.
    for (unsigned part = 8; part-- > 0;) {
      entries_.resize(begin[part + 1]);
      search(begin[part], part_of(cell, part));
    }
    most_ = std::max(most_, end);
    entries_.resize(begin[0]);
  }

  // Compares the boxes from `first` on, or appends them by parts of the cell.
  // @return whether parts are left to be searched
  bool prepare(std::size_t first, const Cell& cell, std::array<std::size_t, 9>& begin) {
    if (entries_.size() - first < 2 || one_group(first)) return false;
    if (execution_.stop.stop_requested()) return false;
    if (entries_.size() - first <= kFewBoxes) {
      compare_all(first, cell);
      return false;
    }
    take_covering(first, cell);
    if (entries_.size() - first < 2) return false;
    if (!distribute(first, cell, begin)) {
      sweep(first, cell);
      return false;
    }
    return true;
  }

  [[nodiscard]] bool one_group(std::size_t first) const {
    if (!grouped_) return false;
    for (std::size_t i = first + 1; i < entries_.size(); ++i) {
      if (entries_[i].group != entries_[first].group) return false;
    }
    return true;
  }

  // Boxes that cover the cell share a point of it with all others there.
  void take_covering(std::size_t first, const Cell& cell) {
    const std::int64_t last = (std::int64_t{1} << cell.bits) - 1;
    const auto covers = [&](const Entry& entry) {
      for (int k = 0; k < 3; ++k) {
        const std::int64_t low = cell.low[static_cast<std::size_t>(k)];
        if (entry.low[k] > low || entry.high[k] < low + last) return false;
      }
      return true;
    };
    for (std::size_t i = first; i < entries_.size();) {
      if (!covers(entries_[i])) {
        ++i;
        continue;
      }
      const Entry large = entries_[i];
      entries_[i] = entries_.back();
      entries_.pop_back();
      for (std::size_t j = first; j < entries_.size(); ++j) compare(large, entries_[j], cell);
      if (execution_.stop.stop_requested()) return;
    }
  }

  // Appends the boxes of each of the eight parts. Nothing is appended when that does not help.
  bool distribute(std::size_t first, const Cell& cell, std::array<std::size_t, 9>& begin) {
    if (cell.bits == 0) return false;
    const std::size_t end = entries_.size();
    const std::int64_t half = std::int64_t{1} << (cell.bits - 1);
    glm::ivec3 middle;  // the first point of the upper half; it fits, since a box reaches it
    for (int k = 0; k < 3; ++k) {
      middle[k] = static_cast<std::int32_t>(cell.low[static_cast<std::size_t>(k)] + half);
    }
    const auto parts_of = [&](const Entry& entry) {
      constexpr unsigned kLower[3] = {0x55, 0x33, 0x0f};  // the parts in the lower half of an axis
      unsigned parts = 0xff;
      for (int k = 0; k < 3; ++k) {
        parts &= (entry.low[k] < middle[k] ? kLower[k] : 0) |
                 (entry.high[k] >= middle[k] ? ~kLower[k] : 0);
      }
      return parts & 0xff;
    };
    std::array<std::size_t, 8> counts{};
    for (std::size_t i = first; i < end; ++i) {
      for (unsigned parts = parts_of(entries_[i]); parts != 0; parts &= parts - 1) {
        ++counts[static_cast<std::size_t>(std::countr_zero(parts))];
      }
    }
    begin[0] = end;
    for (std::size_t part = 0; part < 8; ++part) begin[part + 1] = begin[part] + counts[part];
    if (begin[8] - end >= 4 * (end - first)) return false;
    entries_.resize(begin[8]);
    most_ = std::max(most_, entries_.size());
    std::array<std::size_t, 9> at = begin;
    for (std::size_t i = first; i < end; ++i) {
      for (unsigned parts = parts_of(entries_[i]); parts != 0; parts &= parts - 1) {
        entries_[at[static_cast<std::size_t>(std::countr_zero(parts))]++] = entries_[i];
      }
    }
    return true;
  }

  // Whether the least point that two boxes share lies in the cell. Both touch the cell, so it does
  // not lie beyond its upper sides.
  static bool meet(const Entry& a, const Entry& b, const Cell& cell) {
    for (int k = 0; k < 3; ++k) {
      const std::int32_t low = std::max(a.low[k], b.low[k]);
      if (low > std::min(a.high[k], b.high[k]) || low < cell.low[static_cast<std::size_t>(k)]) {
        return false;
      }
    }
    return true;
  }

  void compare(const Entry& a, const Entry& b, const Cell& cell) {
    if (meet(a, b, cell)) keep(a, b);
  }

  void keep(const Entry& a, const Entry& b) {
    if (grouped_ && a.group == b.group) return;
    found_.push_back({std::min(a.box, b.box), std::max(a.box, b.box)});
    if (found_.size() >= kBatch) flush();
  }

  void flush() {
    if (!found_.empty()) visit_(found_, worker_);
    found_.clear();
  }

  void compare_all(std::size_t first, const Cell& cell) {
    const std::span<const Entry> boxes = std::span(entries_).subspan(first);
    for (std::size_t j = 1; j < boxes.size(); ++j) {
      for (std::size_t i = 0; i < j; ++i) compare(boxes[i], boxes[j], cell);
    }
  }

  // Sorts along the axis in which the boxes are shortest.
  void sweep(std::size_t first, const Cell& cell) {
    const std::span<Entry> boxes = std::span(entries_).subspan(first);
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
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      for (std::size_t j = i + 1; j < boxes.size() && boxes[j].low[axis] <= boxes[i].high[axis];
           ++j) {
        compare(boxes[i], boxes[j], cell);
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
  std::size_t most_ = 0;
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
      const Cell cell = large[i].cell;
      parts[i] = search.divide(std::exchange(large[i].entries, {}), cell);
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
  parallel_for(execution, small.size(), [&](std::size_t i, int worker) {
    Search search(grouped, visit, worker, execution);
    const Cell cell = small[i].cell;
    search.run(std::exchange(small[i].entries, {}), cell);
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
