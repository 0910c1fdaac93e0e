#pragma once

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <mutex>
#include <new>
#include <optional>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include "strata/core/depth_list.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/hashbuffer/depth_list_store.h"
#include "strata/hashbuffer/offsets.h"
#include "strata/hashbuffer/record.h"
#include "strata/hashbuffer/resize_policy.h"
#include "strata/hashbuffer/table_law.h"

// After: Lefebvre, Hornus, Lasram, "HA-Buffer: Coherent Hashing for single-pass A-buffer", INRIA
// RR-8282, 2013; table_law.h has the law of the table and how we differ. We also differ in two
// details: traversal visits the largest age too, and culling counts a record at most once.
//
// GLOSSARY
//   fragment       a depth and a payload at a pixel: a point where its ray meets a surface
//   depth list     the fragments of a pixel, sorted by (depth, payload); equal ones are kept
//   depth complexity, layers    the length of a list
//   store          a container that takes fragments and gives back depth lists (depth_list_store.h)
//   generator      the caller's code that inserts the fragments of a frame into a sink
//   frame          the lists of a whole screen; a store holds one
//   record, word   a fragment as the table keeps it, [age | nearness | payload] (record.h)
//   cell           a place of the table, for one record; 0 when empty
//   load           records over cells; near 1 insertion is slow
//   probe          one look at a cell; a record's first probe has age 1, its next age 2, ...
//   age            the number of the probe at which a record lies, from 1 on
//   offset         leads the probes of an age to their cells: cell = pixel + offset (offsets.h)
//   propose, evict a record asks for a cell; the larger word stays, the other goes on
//   failure        a record whose ages ran out; it is kept beside the table (Overflow)
//   cull           to drop a fragment that is behind enough opacity, or behind the k nearest
//
// NOTHING IS LOST. A record that fails is kept outside of the table, and lists continue there. That
// is slow, so build() gives every frame the room it needs. If memory does not suffice even outside
// of the table, finish() and build() say how many fragments are missing.

namespace strata {

/// Settings of a hash buffer.
struct HashBufferOptions {
  /// Cells of the first table; raised to the number of pixels if smaller. Set it to 1.25 times the
  /// fragments you expect. 0: as many as pixels, and build() runs the generator of the first frame
  /// once more, before all else, to count its fragments.
  std::uint64_t cells = 0;
  OffsetKind offsets = OffsetKind::kPlaneFirst;  ///< order in which a pixel probes cells
  /// Seed of the offset table. Frame f uses the generator (seed, f); kFarthestPoint is made once a
  /// table size.
  std::uint64_t seed = 1;
  /// Largest age, if smaller than the record's kAgeMax; 0 means kAgeMax.
  unsigned age_limit = 0;
  /// Keeps the first `keep_nearest` fragments of each list; 0 keeps all. Lists are then cut to that
  /// length. (A fragment is dropped once that many were found in front of it.)
  unsigned keep_nearest = 0;
  /// With an Opacity: a list ends with the fragment that brings the transmittance of the list below
  /// 1 - opacity_threshold.
  double opacity_threshold = 0.99;
};

/// The Opacity of a HashBuffer whose lists are not cut by opacity.
struct NoOpacity {};

namespace detail {

/// The records for which a hash table had no room, by pixel. All records of a pixel in the table
/// lie in front of those here.
template <RecordPolicy Record>
class Overflow {
 public:
  using Word = typename Record::Word;

  Overflow() = default;
  /// No other thread may use either object during the move.
  Overflow(Overflow&& other) noexcept
      : sorted_(other.sorted_.load()), entries_(std::move(other.entries_)), lost_(other.lost_) {}
  Overflow& operator=(Overflow&& other) noexcept {
    sorted_ = other.sorted_.load();
    entries_ = std::move(other.entries_);
    lost_ = other.lost_;
    return *this;
  }

  /// Any thread may add.
  void add(std::uint64_t pixel, Word record) noexcept {
    const std::lock_guard lock(mutex_);
    sorted_ = false;
    try {
      entries_.push_back({pixel, Record::rank(record)});
    } catch (const std::bad_alloc&) {
      ++lost_;
    }
  }

  void clear() noexcept {
    std::vector<Entry>().swap(entries_);
    lost_ = 0;
  }

  /// Visits the records of a pixel front to back while `visit` returns true. No thread may add
  /// meanwhile; the first call sorts.
  template <class Visit>
  void for_each(std::uint64_t pixel, Visit&& visit) {
    sort();
    const auto first = std::lower_bound(
        entries_.begin(), entries_.end(), pixel,
        [](const Entry& entry, std::uint64_t wanted) { return entry.pixel < wanted; });
    for (auto entry = first; entry != entries_.end() && entry->pixel == pixel; ++entry) {
      if (!visit(entry->record)) return;
    }
  }

  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  /// Records for which memory did not suffice.
  [[nodiscard]] std::uint64_t lost() const { return lost_; }
  [[nodiscard]] std::uint64_t memory_bytes() const { return entries_.capacity() * sizeof(Entry); }

 private:
  struct Entry {
    std::uint64_t pixel = 0;
    Word record = 0;  // without its age
  };

  void sort() {
    if (sorted_.load(std::memory_order_acquire)) return;
    const std::lock_guard lock(mutex_);
    if (sorted_) return;
    std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
      return a.pixel != b.pixel ? a.pixel < b.pixel : a.record > b.record;
    });
    sorted_.store(true, std::memory_order_release);
  }

  std::mutex mutex_;
  std::atomic<bool> sorted_{true};
  std::vector<Entry> entries_;
  std::uint64_t lost_ = 0;
};

}  // namespace detail

/// A hash table of fragments whose probe sequences are the sorted depth lists.
///
/// Fill it by build(generator), which makes room; or by begin_frame(), insert() and finish().
///
/// @tparam RecordType a policy of record.h: what is kept of a fragment, and how many layers
/// @tparam Concurrency Concurrent (any thread inserts) or Exclusive (one)
/// @tparam Opacity a callable that gives the opacity in [0, 1] of a payload: lists are then cut
/// where the fragments in front hide the rest (HashBufferOptions::opacity_threshold). Not for
/// volumes, Booleans or voxels, which need every crossing.
template <RecordPolicy RecordType, class Concurrency, class Opacity = NoOpacity>
class HashBuffer
    : public detail::SinkForms<HashBuffer<RecordType, Concurrency, Opacity>, RecordType> {
 public:
  using Record = RecordType;           ///< how a fragment is packed
  using Word = typename Record::Word;  ///< a cell of the table
  /// Entry of the max-age table.
  using Age = std::conditional_t<(Record::kAgeBits > 8), std::uint16_t, std::uint8_t>;
  static constexpr bool kAnyThread = Concurrency::kAnyThread;  ///< any thread may insert
  /// Whether lists may be cut by opacity.
  static constexpr bool kHasOpacity = !std::is_same_v<Opacity, NoOpacity>;
  static constexpr int kBlockSide = 8;  ///< pixels along one side of a block of the max-age table

  /// A screen of width x height pixels, each at least 1 (ErrorCode::kUsage), cleared and ready for
  /// insert(). ErrorCode::kLimit if the table cannot be allocated.
  [[nodiscard]] static Result<HashBuffer> create(int width, int height,
                                                 const HashBufferOptions& options = {},
                                                 Opacity opacity = {}) {
    if (width < 1 || height < 1) {
      return fail(ErrorCode::kUsage,
                  "hash buffer: width and height must be at least 1, got {} x {}", width, height);
    }
    HashBuffer buffer(width, height, options, std::move(opacity));
    if (auto resized = buffer.resize(options.cells); !resized) {
      return tl::unexpected(std::move(resized.error()));
    }
    return buffer;
  }

  [[nodiscard]] int width() const { return width_; }    ///< pixels
  [[nodiscard]] int height() const { return height_; }  ///< pixels
  /// The settings given to create().
  [[nodiscard]] const HashBufferOptions& options() const { return options_; }
  /// The raw table, in the order of the cell formula.
  [[nodiscard]] std::span<const Word> cells() const { return table_; }
  /// The offsets by age; element 0 is unused.
  [[nodiscard]] std::span<const std::uint64_t> offsets() const { return offsets_; }
  /// For each block of 8 x 8 pixels, row-major with ceil(width / 8) blocks a row, an upper bound of
  /// its ages. It is the maximum itself, hence unique, unless a fragment failed or was culled:
  /// then call tighten_max_ages() first.
  [[nodiscard]] std::span<const Age> max_ages() const { return max_ages_; }
  /// Largest age that a record can have here.
  [[nodiscard]] unsigned age_limit() const { return static_cast<unsigned>(offsets_.size()) - 1; }

  /// Largest age that a record could have in a table with enough cells.
  [[nodiscard]] unsigned age_wanted() const {
    return options_.age_limit == 0 ? Record::kAgeMax
                                   : std::min(options_.age_limit, Record::kAgeMax);
  }
  /// True if lists are cut, by keep_nearest or by opacity.
  [[nodiscard]] bool is_culling() const { return guarded_; }

  /// One insertion in steps: a step is one atomic maximum on the table, so that a test can drive
  /// every interleaving of several insertions.
  class Insertion {
   public:
    /// Borrows the buffer. @pre 0 <= x < width, 0 <= y < height, Record::payload_fits(payload)
    Insertion(HashBuffer& buffer, int x, int y, std::uint32_t depth, std::uint32_t payload) noexcept
        : buffer_(&buffer),
          table_(buffer.table_.data()),
          offsets_(buffer.offsets_.data()),
          cells_(buffer.table_.size()),
          block_(buffer.block_of(x, y)),
          flight_{Record::pack(1, depth, payload), buffer.pixel_of(x, y), 1},
          limit_(buffer.age_limit()) {
      assert(x >= 0 && x < buffer.width_ && y >= 0 && y < buffer.height_);
      assert(Record::payload_fits(payload));
    }

    /// Proposes the record in flight to its next cell; false when nothing is in flight any more.
    /// @tparam guarded whether keep_nearest and opacity are looked at
    template <bool guarded>
    bool step() noexcept {
      const Word proposed = flight_.record;
      const auto age = static_cast<Age>(flight_.age);
      Word found;
      const detail::Outcome outcome = detail::propose<Record, Concurrency>(
          flight_, table_, cells_, [this](unsigned of) { return offsets_[of]; }, found);
      if (outcome == detail::Outcome::kLost) {
        if constexpr (guarded) {
          if (Record::age(found) == flight_.age) guard_.count(found, flight_.record, *buffer_);
        }
      } else {
        Concurrency::fetch_max(buffer_->max_ages_[block_], age);
        if (outcome == detail::Outcome::kPlaced) return false;
        if (outcome == detail::Outcome::kEvictedOther) {
          block_ = buffer_->block_of(flight_.pixel);
          if constexpr (guarded) guard_ = Guard{};
        } else if constexpr (guarded) {  // evicted from this pixel by what lies in front of it
          guard_.count(proposed, flight_.record, *buffer_);
        }
      }
      if constexpr (guarded) {
        if (guard_.closed(*buffer_)) {
          Concurrency::fetch_increment(buffer_->dropped_);
          return false;
        }
      }
      if (flight_.grow_older(limit_)) return true;
      buffer_->spill(flight_.pixel, flight_.record);
      return false;
    }

   private:
    /// The records known to lie in front of the record in flight. Another thread may push a counted
    /// record to the next age, where it is met again. So a record counts only if it lies strictly
    /// behind the last counted record and strictly in front of the record in flight. Each counted
    /// record was inserted: the list has it, or culled it for records still further in front.
    struct Guard {
      double transmittance = 1.0;  // a product, so that rounding cannot make a subset smaller
      unsigned in_front = 0;
      Word last_rank = std::numeric_limits<Word>::max();

      void count(Word met, Word in_flight, const HashBuffer& buffer) noexcept {
        const Word rank = Record::rank(met);
        if (rank >= last_rank || rank <= Record::rank(in_flight)) return;
        last_rank = rank;
        ++in_front;
        if constexpr (kHasOpacity) transmittance *= buffer.transmittance_of(met);
      }
      [[nodiscard]] bool closed(const HashBuffer& buffer) const noexcept {
        const HashBufferOptions& options = buffer.options_;
        return (options.keep_nearest > 0 && in_front >= options.keep_nearest) ||
               (kHasOpacity && transmittance < 1.0 - options.opacity_threshold);
      }
    };

    HashBuffer* buffer_;
    Word* table_;
    const std::uint64_t* offsets_;
    std::uint64_t cells_;
    std::size_t block_;
    detail::Flight<Record> flight_;
    unsigned limit_;
    Guard guard_;
  };

  /// Visits the list of pixel (x, y) front to back; stops early if `visit` returns false (it may
  /// also return nothing). No thread may be inserting. Fragments may be missing unless build() or
  /// finish() succeeded.
  template <class Visit>
  void for_each(int x, int y, Visit&& visit) const {
    const std::uint64_t pixel = pixel_of(x, y);
    const unsigned last = max_ages_[block_of(x, y)];
    ListEnd end;
    for (unsigned age = 1; age <= last; ++age) {
      std::uint64_t cell = pixel + offsets_[age];
      if (cell >= table_.size()) cell -= table_.size();
      const Word record = table_[cell];
      // A later record of this pixel, in the table or not, would have been compared here and left
      // something of this age.
      if (Record::age(record) < age) return;
      if (Record::age(record) == age && !goes_on(visit, record, end)) return;
    }
    if (failures_ == 0) return;
    overflow_.for_each(pixel, [&](Word record) { return goes_on(visit, record, end); });
  }

  /// Ends a frame that insert() filled, and checks that its lists are complete. Call it when all
  /// threads have inserted, before lists are read.
  /// @return the frame. ErrorCode::kLimit with the number of fragments that are missing, for which
  /// neither the table nor memory had room
  [[nodiscard]] Result<BuildReport> finish() const {
    if (const std::uint64_t lost = overflow_.lost(); lost > 0) {
      return fail(ErrorCode::kLimit, "hash buffer: no memory for {} of {} fragments", lost,
                  stored() + failures_);
    }
    return BuildReport{stored() + failures_, 1, memory_bytes()};
  }

  /// All lists as an image (depth_limit 2^24, world_from_image left at identity); rows in parallel.
  /// ErrorCode::kLimit as finish(), or if the image cannot be allocated; kCancelled on request.
  [[nodiscard]] Result<LayeredDepthImage> depth_image(const Execution& execution = {}) const {
    if (auto complete = finish(); !complete) return tl::unexpected(std::move(complete.error()));
    return copy_lists(execution);
  }

  /// Records in the table. Walks the whole table.
  [[nodiscard]] std::uint64_t stored() const {
    return table_.size() -
           static_cast<std::uint64_t>(std::count(table_.begin(), table_.end(), Record::kEmpty));
  }
  /// Stored records over cells, in [0, 1].
  [[nodiscard]] double load() const {
    return static_cast<double>(stored()) / static_cast<double>(table_.size());
  }
  /// Fragments whose age ran out since the last clear: kept outside of the table. No thread may be
  /// inserting.
  [[nodiscard]] std::uint64_t failures() const { return failures_; }
  /// Fragments dropped by keep_nearest or opacity since the last clear.
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

  /// Empties the buffer; returns how many records it held. Offsets stay.
  std::uint64_t clear() noexcept {
    std::uint64_t held = overflow_.size();
    for (Word& cell : table_) {
      held += cell != Record::kEmpty;
      cell = Record::kEmpty;
    }
    clear_counters();
    return held;
  }

  /// Empties the buffer, adapts the table to the load of the last frame as far as `memory_limit`
  /// (bytes, 0: none) allows, and draws the offsets of the new frame. The first frame keeps its
  /// size, unless the fragments inserted before did not fit. ErrorCode::kLimit if even a table of
  /// one cell a pixel exceeds the limit.
  [[nodiscard]] Result<void> begin_frame(std::uint64_t memory_limit = 0) {
    const bool had_failures = failures_ > 0;
    const std::uint64_t held = clear();
    std::uint64_t target = std::max(table_.size(), pixels_);
    if (frame_ > 0 || had_failures) target = next_frame_cells(target, pixels_, held);
    ++frame_;
    if (memory_limit > 0) target = std::min(target, largest_cells(memory_limit));
    if (target < pixels_) {
      return fail(ErrorCode::kLimit,
                  "hash buffer: a screen of {} x {} pixels needs {} bytes, the limit is {}", width_,
                  height_, bytes_of(pixels_), memory_limit);
    }
    return resize(target);
  }

  /// Makes a table of `cells` cells, or of one cell a pixel if that is more, empties it, and
  /// draws its offsets. Never holds the old and the new table at once. On ErrorCode::kLimit the
  /// buffer keeps its size, emptied.
  [[nodiscard]] Result<void> resize(std::uint64_t cells) { return resize(cells, options_.offsets); }
  /// The same with offsets of another kind, until the next begin_frame().
  [[nodiscard]] Result<void> resize(std::uint64_t cells, OffsetKind kind) {
    cells = std::max(cells, pixels_);
    const std::uint64_t old_cells = table_.size();
    try {
      if (cells != old_cells) {
        std::vector<Word>().swap(table_);
        table_.resize(cells);
        max_ages_.resize(block_count());
        clear_counters();
      } else {
        clear();
      }
      const bool is_made_once = kind == OffsetKind::kFarthestPoint && kind == drawn_kind_;
      if (cells != old_cells || !is_made_once) offsets_ = draw_offsets(kind);
      drawn_kind_ = kind;
      return {};
    } catch (const std::bad_alloc&) {
    } catch (const std::length_error&) {
    }
    restore(old_cells);
    return fail(ErrorCode::kLimit, "hash buffer: no memory for {} cells, {} bytes", cells,
                bytes_of(cells));
  }

  /// Makes max_ages() exact after failures or culling, by a walk over the table.
  void tighten_max_ages() noexcept {
    std::fill(max_ages_.begin(), max_ages_.end(), Age{0});
    for (std::uint64_t cell = 0; cell < table_.size(); ++cell) {
      const unsigned age = Record::age(table_[cell]);
      if (age == 0) continue;
      const std::uint64_t back = offsets_[age];
      Age& entry = max_ages_[block_of(cell >= back ? cell - back : cell + table_.size() - back)];
      entry = std::max(entry, static_cast<Age>(age));
    }
  }

  /// Bytes held: the table, the max-age table, the offsets, and the fragments outside of the table.
  [[nodiscard]] std::uint64_t memory_bytes() const {
    return bytes_of(table_.size()) + overflow_.memory_bytes();
  }
  /// The same for a table of that many cells, without fragments outside of it.
  [[nodiscard]] std::uint64_t bytes_of(std::uint64_t cells) const {
    return cells * sizeof(Word) + block_count() * sizeof(Age) +
           (std::min<std::uint64_t>(age_wanted(), cells) + 1) * sizeof(std::uint64_t);
  }
  /// Cells of the largest table whose bytes_of() is within `bytes`, 0 if there is none.
  [[nodiscard]] std::uint64_t largest_cells(std::uint64_t bytes) const {
    if (bytes < bytes_of(0)) return 0;
    if (bytes >= bytes_of(age_wanted())) {
      return age_wanted() + (bytes - bytes_of(age_wanted())) / sizeof(Word);
    }
    return (bytes - bytes_of(0)) / (sizeof(Word) + sizeof(std::uint64_t));
  }

  /// A hash of the raw table: the same bits, the same checksum.
  [[nodiscard]] std::uint64_t checksum() const { return detail::table_checksum(table_); }

  /// Builds a frame: empties the buffer, adapts its table to the last frame's load, runs the
  /// generator, and if a fragment did not fit, rebuilds the frame with more room until all fit. The
  /// generator runs once a frame; twice for the first one, whose fragments are counted before
  /// (HashBufferOptions::cells spares that), and for one that outgrew the frame before.
  ///
  /// `execution.memory_limit` bounds the buffer's own bytes. Its threads are not used; the
  /// generator brings its own. Exceptions of the generator pass through.
  ///
  /// @return how the frame was built. ErrorCode::kLimit, and an empty buffer, if a pixel has more
  /// fragments than the record can count (a larger table does not help; the message names the
  /// record policy to use), or if fragments were still missing in the largest table that memory
  /// allows (the message says how many). ErrorCode::kCancelled on request.
  template <class Generator>
  [[nodiscard]] Result<BuildReport> build(Generator&& generator, const Execution& execution = {}) {
    if (auto begun = begin_frame(execution.memory_limit); !begun) {
      return tl::unexpected(std::move(begun.error()));
    }
    const FailuresForgotten while_building(*this);
    Attempt attempt{execution.memory_limit, 0, 0, {}};
    // With culling by opacity the count would be far more than what is kept.
    const bool has_unknown_load = frame_ <= 1 && options_.cells == 0;
    if (has_unknown_load && !kHasOpacity) {
      if (auto sized = size_first_frame(generator, attempt); !sized) {
        return tl::unexpected(std::move(sized.error()));
      }
    }
    while (!execution.stop.stop_requested()) {
      generator(*this);
      ++attempt.generator_calls;
      if (execution.stop.stop_requested()) break;
      if (failures_ == 0) return BuildReport{stored(), attempt.generator_calls, memory_bytes()};
      if (auto grown = grow(generator, attempt); !grown) {
        return tl::unexpected(std::move(grown.error()));
      }
    }
    clear();
    return fail(ErrorCode::kCancelled, "hash buffer: stopped on request");
  }

 private:
  friend detail::SinkForms<HashBuffer, Record>;

  /// Counts fragments in the table's own cells.
  class LayerCounter : public detail::SinkForms<LayerCounter, Record> {
   public:
    explicit LayerCounter(HashBuffer& buffer) : buffer_(&buffer) {}

   private:
    friend detail::SinkForms<LayerCounter, Record>;
    void put(int x, int y, std::uint32_t, std::uint32_t) noexcept {
      Concurrency::fetch_increment(buffer_->table_[buffer_->pixel_of(x, y)]);
    }
    HashBuffer* buffer_;
  };

  HashBuffer(int width, int height, const HashBufferOptions& options, Opacity opacity)
      : options_(options),
        opacity_(std::move(opacity)),
        width_(width),
        height_(height),
        pixels_(static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height)),
        blocks_per_row_((static_cast<std::size_t>(width) + kBlockSide - 1) / kBlockSide),
        guarded_(options.keep_nearest > 0 || kHasOpacity) {}

  /// The work of insert(). A fragment for which the table has no room costs a probe of every age, a
  /// lock and a sort.
  void put(int x, int y, std::uint32_t depth, std::uint32_t payload) noexcept {
    if (table_.empty()) {  // after a resize that memory did not even allow to undo
      return spill(pixel_of(x, y), Record::pack(1, depth, payload));
    }
    Insertion insertion(*this, x, y, depth, payload);
    if (guarded_) {
      while (insertion.template step<true>()) {
      }
    } else {
      while (insertion.template step<false>()) {
      }
    }
  }

  /// How much of a list has been visited, to find the place where culling ends it.
  struct ListEnd {
    double transmittance = 1.0;
    unsigned kept = 0;
  };
  /// Visits a record. @return whether the list goes on behind it
  template <class Visit>
  bool goes_on(Visit& visit, Word record, ListEnd& end) const {
    if constexpr (std::is_convertible_v<decltype(visit(Record::item(record))), bool>) {
      if (!visit(Record::item(record))) return false;
    } else {
      visit(Record::item(record));
    }
    if (!guarded_) return true;
    if (options_.keep_nearest > 0 && ++end.kept >= options_.keep_nearest) return false;
    if constexpr (!kHasOpacity) return true;
    end.transmittance *= transmittance_of(record);
    return end.transmittance >= 1.0 - options_.opacity_threshold;
  }

  [[nodiscard]] double transmittance_of(Word record) const {
    if constexpr (kHasOpacity) {
      return 1.0 - std::clamp<double>(opacity_(Record::payload(record)), 0.0, 1.0);
    } else {
      return 1.0;
    }
  }

  Result<LayeredDepthImage> copy_lists(const Execution& execution) const {
    const auto rows = static_cast<std::size_t>(height_);
    const auto columns = static_cast<std::size_t>(width_);
    try {
      LayeredDepthImage image;
      image.width = width_;
      image.height = height_;
      image.depth_limit = kRecordDepthMax + 1;
      image.offsets.resize(rows * columns + 1);
      parallel_for(execution, rows, [&](std::size_t row, int) {
        for (std::size_t column = 0; column < columns; ++column) {
          std::uint64_t count = 0;
          for_each(static_cast<int>(column), static_cast<int>(row), [&](DepthItem) { ++count; });
          image.offsets[row * columns + column + 1] = count;
        }
      });
      for (std::size_t pixel = 0; pixel < rows * columns; ++pixel) {
        image.offsets[pixel + 1] += image.offsets[pixel];
      }
      if (!execution.stop.stop_requested()) {
        image.items.resize(image.offsets.back());
        parallel_for(execution, rows, [&](std::size_t row, int) {
          DepthItem* next = image.items.data() + image.offsets[row * columns];
          for (std::size_t column = 0; column < columns; ++column) {
            for_each(static_cast<int>(column), static_cast<int>(row),
                     [&](DepthItem item) { *next++ = item; });
          }
        });
      }
      if (execution.stop.stop_requested()) {
        return fail(ErrorCode::kCancelled, "depth lists: stopped on request");
      }
      return image;
    } catch (const std::bad_alloc&) {
      return fail(ErrorCode::kLimit, "depth lists: no memory for the lists of {} x {} pixels",
                  width_, height_);
    } catch (const std::length_error&) {
      return fail(ErrorCode::kLimit, "depth lists: {} x {} pixels are more than memory can address",
                  width_, height_);
    }
  }

  /// A pixel with the most fragments, how many those are, and how many all pixels keep.
  struct FragmentCount {
    int x = 0, y = 0;
    std::uint64_t deepest = 0, kept = 0;
  };
  /// State of a build().
  struct Attempt {
    std::uint64_t memory_limit = 0;  ///< bytes, 0: none
    int generator_calls = 0, failed_frames = 0;
    std::optional<FragmentCount> count;  ///< once the fragments were counted
  };
  /// Fragments for which the table has no room are not kept while build() runs: it runs the
  /// generator again.
  struct FailuresForgotten {
    explicit FailuresForgotten(HashBuffer& of) : buffer(of) { buffer.keep_failures_ = false; }
    ~FailuresForgotten() { buffer.keep_failures_ = true; }
    FailuresForgotten(const FailuresForgotten&) = delete;
    FailuresForgotten& operator=(const FailuresForgotten&) = delete;
    HashBuffer& buffer;
  };

  /// Runs the generator once to count the fragments of each pixel in the table's own cells. Leaves
  /// the buffer empty.
  template <class Generator>
  void count_fragments(Generator& generator, Attempt& attempt) {
    clear();
    LayerCounter counter(*this);
    generator(counter);
    ++attempt.generator_calls;
    const auto deepest =
        std::max_element(table_.begin(), table_.begin() + static_cast<std::ptrdiff_t>(pixels_));
    const auto pixel = static_cast<std::uint64_t>(deepest - table_.begin());
    const auto columns = static_cast<std::uint64_t>(width_);
    FragmentCount result{static_cast<int>(pixel % columns), static_cast<int>(pixel / columns),
                         *deepest, 0};
    const std::uint64_t most = options_.keep_nearest > 0 ? options_.keep_nearest : *deepest;
    for (std::uint64_t i = 0; i < pixels_; ++i) {
      result.kept += std::min<std::uint64_t>(table_[i], most);
    }
    clear();
    attempt.count = result;
  }

  /// @return kLimit naming the record policy to use if a pixel has more fragments than there are
  /// ages
  [[nodiscard]] Result<void> check_ages(const FragmentCount& count) const {
    if (count.deepest <= age_wanted()) return {};
    return fail(ErrorCode::kLimit,
                "hash buffer: pixel ({}, {}) has {} fragments, but {} counts at most {}; {}",
                count.x, count.y, count.deepest, Record::kName, age_wanted(),
                age_wanted() < Record::kAgeMax ? "raise the option age_limit" : Record::kDeeper);
  }
  [[nodiscard]] std::uint64_t allowed(std::uint64_t cells, const Attempt& attempt) const {
    return attempt.memory_limit > 0 ? std::min(cells, largest_cells(attempt.memory_limit)) : cells;
  }

  /// Counts the fragments of the first frame and makes room for them.
  template <class Generator>
  [[nodiscard]] Result<void> size_first_frame(Generator& generator, Attempt& attempt) {
    count_fragments(generator, attempt);
    if (!is_culling()) {
      if (auto held = check_ages(*attempt.count); !held) return held;
    }
    const std::uint64_t kept = attempt.count->kept;
    const std::uint64_t target = allowed(cells_for(kept, table_.size()), attempt);
    if (target <= table_.size()) return {};
    if (auto resized = resize(target); !resized) {
      return fail(ErrorCode::kLimit, "hash buffer: {} fragments; {}", kept,
                  resized.error().message);
    }
    return {};
  }

  /// After a frame whose fragments did not fit: empties the table and makes more room.
  template <class Generator>
  [[nodiscard]] Result<void> grow(Generator& generator, Attempt& attempt) {
    const std::uint64_t missing = failures_, fragments = stored() + missing;
    const std::uint64_t cells = table_.size();
    // Where room does not help, the ages may not suffice. With culling, a pixel may have more
    // fragments than it keeps; then only a table that fails though it is nearly empty proves that.
    const bool lacks_ages = is_too_empty(fragments, cells);
    if (lacks_ages || (++attempt.failed_frames > 1 && !is_culling())) {
      if (!attempt.count) count_fragments(generator, attempt);
      if (auto held = check_ages(*attempt.count); !held) {
        clear();
        return held;
      }
    }
    const std::uint64_t target = allowed(rebuilt_cells(fragments, cells), attempt);
    if (target <= cells) {
      clear();
      return fail(ErrorCode::kLimit,
                  "hash buffer: {} of {} fragments did not fit in {} cells, {} bytes; the limit is "
                  "{} bytes",
                  missing, fragments, cells, bytes_of(cells), attempt.memory_limit);
    }
    const OffsetKind kind = lacks_ages ? OffsetKind::kPlaneFirst : options_.offsets;
    if (auto resized = resize(target, kind); !resized) {
      return fail(ErrorCode::kLimit, "hash buffer: {} of {} fragments did not fit in {} cells; {}",
                  missing, fragments, cells, resized.error().message);
    }
    return {};
  }

  [[nodiscard]] std::uint64_t pixel_of(int x, int y) const noexcept {
    return static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(width_) +
           static_cast<std::uint64_t>(x);
  }
  [[nodiscard]] std::size_t block_of(int x, int y) const noexcept {
    return static_cast<std::size_t>(y / kBlockSide) * blocks_per_row_ +
           static_cast<std::size_t>(x / kBlockSide);
  }
  [[nodiscard]] std::size_t block_of(std::uint64_t pixel) const noexcept {
    const auto columns = static_cast<std::uint64_t>(width_);
    return block_of(static_cast<int>(pixel % columns), static_cast<int>(pixel / columns));
  }

  [[nodiscard]] std::size_t block_count() const {
    return blocks_per_row_ * ((static_cast<std::size_t>(height_) + kBlockSide - 1) / kBlockSide);
  }
  [[nodiscard]] std::vector<std::uint64_t> draw_offsets(OffsetKind kind) const {
    const std::uint64_t draw = kind == OffsetKind::kFarthestPoint ? 0 : frame_;
    return make_offsets(kind, {.pixels = pixels_,
                               .cells = table_.size(),
                               .width = static_cast<std::uint64_t>(width_),
                               .ages = age_wanted(),
                               .seed = options_.seed ^ draw * 0x9e3779b97f4a7c15u});
  }

  void spill(std::uint64_t pixel, Word record) noexcept {
    Concurrency::fetch_increment(failures_);
    if (keep_failures_) overflow_.add(pixel, record);
  }

  void clear_counters() noexcept {
    overflow_.clear();
    std::fill(max_ages_.begin(), max_ages_.end(), Age{0});
    failures_ = 0;
    dropped_ = 0;
  }
  /// Goes back to a table of that size after a failed allocation; the old offsets are still there.
  void restore(std::uint64_t cells) noexcept {
    try {
      if (table_.size() != cells) {
        std::vector<Word>().swap(table_);
        table_.resize(cells);
      }
    } catch (...) {
      std::vector<Word>().swap(table_);
    }
    clear();
  }

  HashBufferOptions options_;
  [[no_unique_address]] Opacity opacity_;
  int width_;
  int height_;
  std::uint64_t pixels_;
  std::size_t blocks_per_row_;
  bool guarded_;
  std::uint64_t frame_ = 0;
  std::vector<Word> table_;
  std::vector<std::uint64_t> offsets_;
  OffsetKind drawn_kind_ = OffsetKind::kRandom;
  std::vector<Age> max_ages_;
  mutable detail::Overflow<Record> overflow_;  // sorted when it is read
  bool keep_failures_ = true;
  // Counters that threads write live apart from what they read.
  alignas(64) std::uint64_t failures_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace strata
