#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include "strata/core/depth_list.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/hashbuffer/concurrency.h"
#include "strata/hashbuffer/depth_list_store.h"
#include "strata/hashbuffer/list_image.h"
#include "strata/hashbuffer/offsets.h"
#include "strata/hashbuffer/overflow.h"
#include "strata/hashbuffer/record.h"
#include "strata/hashbuffer/resize_policy.h"

// After: Lefebvre, Hornus, Lasram, "HA-Buffer: Coherent Hashing for single-pass A-buffer", INRIA
// RR-8282, 2013.
// We differ: equal records are kept, since a second crossing at the same depth is a crossing; the
// age is bounded and what does not fit is counted; traversal visits the largest age too; wrapping
// is done on reduced numbers, so tables of any size work; culling counts a record once at most.
//
// THE TABLE LAW (every form of the table, tile-private and SIMD ones included, obeys it)
//
//  1. Cells. A screen of `pixels` = width * height pixels is keyed by pixel = y * width + x,
//  64-bit.
//     The table has `cells` >= pixels cells, all 0 at first. With distinct offsets o[1..n], each in
//     [0, cells), the cell of a pixel at age a is
//         cell(pixel, a) = (pixel + o[a]) mod cells        (one conditional subtraction),
//     and the pixel of a record found in cell c at age a is
//         pixel(c, a) = (c + cells - o[a]) mod cells       (one conditional subtraction).
//     As cells >= pixels, no two pixels share a cell at the same age: no key is stored.
//  2. Order. A record is the word [age | nearness | payload'], nearness = kDepthMax - depth and
//     payload' the complement of the payload (record.h). Words compare as unsigned numbers: the
//     larger one is older, then nearer, then of smaller payload.
//  3. Ages start at 1 and count probes. A record proposes to its cell at its age; the cell keeps
//     the larger word; the loser goes on at its own age + 1 (an evicted record from the age it had
//     in the cell). An equal word loses too: duplicates are kept, at different ages.
//  4. The limit n = min(kAgeMax, cells, the option age_limit). A record that loses at age n leaves
//     the table and is counted as a failure.
//
// What follows (tests/hashbuffer hold the code to it). Cells only grow. The final table is unique:
// this is deferred acceptance (proposals in order of age, a fixed strict order in every cell), so
// its bits depend neither on the order of insertion nor on threads, nor does the set of failures.
// Ages along a pixel's list are those of rising (depth, payload). When fragments fail, the table
// keeps the nearest ones of every pixel: cells only grow, so what a record has lost against, those
// behind it lose against as well. (With culling only the visible part is unique.)
//
// NOTHING IS LOST. What fails is kept beside the table (overflow.h), and lists go on there. That is
// slow: build() of strata/hashbuffer/hash_buffer_build.h gives every frame the room it needs
// instead.

namespace strata {

/// Settings of a hash buffer.
struct HashBufferOptions {
  /// Cells of the first table; raised to the number of pixels if smaller. 1.25 for each fragment
  /// expected is right. 0: as many as pixels, and build() runs the generator of the first frame
  /// once more, before all else, to count its fragments.
  std::uint64_t cells = 0;
  OffsetKind offsets = OffsetKind::kPlaneFirst;
  /// Of the offsets. Frame f draws from (seed, f); kFarthestPoint is made once a table size.
  std::uint64_t seed = 1;
  /// Largest age, if smaller than the record's kAgeMax; 0 means kAgeMax.
  unsigned age_limit = 0;
  /// Keeps the first `keep_nearest` fragments of each list; 0 keeps all. Lists are then cut to that
  /// length. (A fragment is dropped as soon as that many were met in front of it.)
  unsigned keep_nearest = 0;
  /// Opacity in [0, 1] of a payload; with it, a list ends with the fragment that brings the
  /// transmittance of the list below 1 - opacity_threshold. Null: off. Not for volumes, Booleans or
  /// voxels, which need every crossing.
  double (*opacity)(std::uint32_t payload) = nullptr;
  double opacity_threshold = 0.99;
};

/// A hash table of fragments whose probe sequences are the sorted depth lists. See the table law
/// above. `Record` is a policy of record.h, `Concurrency` is Concurrent or Exclusive. For whole
/// frames use build(buffer, generator) of strata/hashbuffer/hash_buffer_build.h, which makes room;
/// insert() and the rest serve other drivers.
template <RecordPolicy RecordType, class Concurrency>
class HashBuffer {
 public:
  using Record = RecordType;
  using Word = typename Record::Word;
  /// Entry of the max-age table.
  using Age = std::conditional_t<(Record::kAgeBits > 8), std::uint16_t, std::uint8_t>;
  static constexpr bool kAnyThread = Concurrency::kAnyThread;
  static constexpr int kBlockSide = 8;  ///< pixels along one side of a block of the max-age table

  /// A screen of width x height pixels, each at least 1 (ErrorCode::kUsage), cleared and ready for
  /// insert(). ErrorCode::kLimit if the table cannot be allocated.
  [[nodiscard]] static Result<HashBuffer> create(int width, int height,
                                                 const HashBufferOptions& options = {}) {
    if (width < 1 || height < 1) {
      return fail(ErrorCode::kUsage, "hash buffer: a screen of {} x {} pixels", width, height);
    }
    HashBuffer buffer(width, height, options);
    if (auto resized = buffer.resize(options.cells); !resized) {
      return tl::unexpected(std::move(resized.error()));
    }
    return buffer;
  }

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
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
  /// True if keep_nearest or opacity is on.
  [[nodiscard]] bool is_culling() const { return guarded_; }

  /// Adds a fragment at pixel (x, y). Depths beyond 2^24 - 1 are clamped. Any thread, if the form
  /// is Concurrent. What the table has no room for is kept beside it and stays in the lists, but
  /// costs a probe of every age, a lock and a sort: see failures(), and HashBufferOptions::cells.
  /// @pre 0 <= x < width, 0 <= y < height, Record::payload_fits(payload)
  void insert(int x, int y, std::uint32_t depth, std::uint32_t payload) noexcept {
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

  /// One insertion in steps: a step is one atomic maximum on the table, so that a test can drive
  /// every interleaving of several insertions.
  class Insertion {
   public:
    Insertion(HashBuffer& buffer, int x, int y, std::uint32_t depth, std::uint32_t payload) noexcept
        : buffer_(&buffer),
          table_(buffer.table_.data()),
          offsets_(buffer.offsets_.data()),
          cells_(buffer.table_.size()),
          pixel_(buffer.pixel_of(x, y)),
          block_(buffer.block_of(x, y)),
          record_(Record::pack(1, depth, payload)),
          limit_(buffer.age_limit()) {
      assert(x >= 0 && x < buffer.width_ && y >= 0 && y < buffer.height_);
      assert(Record::payload_fits(payload));
    }

    /// Proposes the record in flight to its next cell; false when nothing is in flight any more.
    /// @tparam guarded whether keep_nearest and opacity are looked at
    template <bool guarded>
    bool step() noexcept {
      const std::uint64_t offset = offsets_[age_];
      std::uint64_t cell = pixel_ + offset;
      if (cell >= cells_) cell -= cells_;
      const Word proposed = record_;
      const Word found = Concurrency::fetch_max(table_[cell], proposed);
      // Equality falls through to the next age: two equal records are two fragments.
      if (found < proposed) {
        Concurrency::fetch_max(buffer_->max_ages_[block_], static_cast<Age>(age_));
        if (found == Record::kEmpty) return false;
        record_ = found;
        if (Record::age(found) != age_) {  // evicted from another pixel
          age_ = Record::age(found);
          // Both numbers are below cells_, so neither branch wraps around 2^64.
          const std::uint64_t back = offsets_[age_];
          pixel_ = cell >= back ? cell - back : cell + cells_ - back;
          block_ = buffer_->block_of(pixel_);
          if constexpr (guarded) guard_ = Guard{};
        } else if constexpr (guarded) {  // evicted from this pixel by what lies in front of it
          guard_.count(proposed, record_, buffer_->options_);
        }
      } else if constexpr (guarded) {
        if (Record::age(found) == age_) guard_.count(found, record_, buffer_->options_);
      }
      if constexpr (guarded) {
        if (guard_.closed(buffer_->options_)) {
          Concurrency::fetch_increment(buffer_->dropped_);
          return false;
        }
      }
      if (age_ >= limit_) {
        buffer_->spill(pixel_, record_);
        return false;
      }
      ++age_;
      record_ = Record::with_next_age(record_);
      return true;
    }

   private:
    /// What is known to lie in front of the record in flight. Another thread may push a counted
    /// record to the next age, where it is met again: so only what lies strictly behind the last
    /// counted one counts, and what lies strictly in front of the record in flight. What was
    /// counted was inserted, and the list has it or culled it for things still further in front.
    struct Guard {
      double transmittance = 1.0;  // a product, so that rounding cannot make a subset smaller
      unsigned in_front = 0;
      Word last_rank = std::numeric_limits<Word>::max();

      void count(Word met, Word in_flight, const HashBufferOptions& options) noexcept {
        const Word rank = Record::rank(met);
        if (rank >= last_rank || rank <= Record::rank(in_flight)) return;
        last_rank = rank;
        ++in_front;
        if (options.opacity) transmittance *= transmittance_of(met, options);
      }
      [[nodiscard]] bool closed(const HashBufferOptions& options) const noexcept {
        return (options.keep_nearest > 0 && in_front >= options.keep_nearest) ||
               (options.opacity && transmittance < 1.0 - options.opacity_threshold);
      }
    };

    HashBuffer* buffer_;
    Word* table_;
    const std::uint64_t* offsets_;
    std::uint64_t cells_;
    std::uint64_t pixel_;
    std::size_t block_;
    Word record_;
    unsigned age_ = 1;
    unsigned limit_;
    Guard guard_;
  };

  /// Visits the list of pixel (x, y) front to back; stops early if `visit` returns false (it may
  /// also return nothing). No thread may be inserting.
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

  /// All lists as an image (depth_limit 2^24, world_from_image left at identity); rows in parallel.
  /// ErrorCode::kLimit if it cannot be allocated, or if memory did not suffice for fragments that
  /// the table had no room for; kCancelled on request.
  [[nodiscard]] Result<LayeredDepthImage> depth_image(const Execution& execution = {}) const {
    if (const std::uint64_t lost = overflow_.lost(); lost > 0) {
      return fail(ErrorCode::kLimit, "hash buffer: no memory for {} of {} fragments", lost,
                  stored() + failures_);
    }
    return make_list_image(*this, execution);
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
  /// Fragments whose age ran out since the last clear: not in the table, but kept beside it. Not
  /// with inserting threads.
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
  /// size, unless what was inserted before did not fit. ErrorCode::kLimit if even a table of one
  /// cell a pixel exceeds the limit.
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

  /// Makes a table of that many cells, or of one cell a pixel if that is more, empties it, and
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

  /// Bytes held: the table, the max-age table, the offsets, and what lies beside the table.
  [[nodiscard]] std::uint64_t memory_bytes() const {
    return bytes_of(table_.size()) + overflow_.memory_bytes();
  }
  /// The same for a table of that many cells, with nothing beside it.
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
  [[nodiscard]] std::uint64_t checksum() const {
    std::uint64_t hash = 0x9e3779b97f4a7c15u ^ table_.size();
    for (const Word word : table_) {
      hash = (hash ^ word) * 0xff51afd7ed558ccdu;
      hash ^= hash >> 29;
    }
    return hash;
  }

  /// A pixel with the most fragments, how many those are, and how many all pixels keep.
  struct FragmentCount {
    int x = 0, y = 0;
    std::uint64_t deepest = 0, kept = 0;
  };
  /// Runs the generator once to count the fragments of each pixel in the table's own cells. Leaves
  /// the buffer empty.
  template <class Generator>
  [[nodiscard]] FragmentCount count_fragments(Generator& generator) {
    clear();
    LayerCounter counter{this};
    generator(counter);
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
    return result;
  }

  /// True when nothing is known of earlier frames: the first since create(), with a table whose
  /// size nobody chose.
  [[nodiscard]] bool has_unknown_load() const { return frame_ <= 1 && options_.cells == 0; }
  /// Whether what the table has no room for is kept. build() does without while it runs, since it
  /// runs the generator again.
  void keep_failures(bool keep) { keep_failures_ = keep; }

 private:
  struct LayerCounter {
    HashBuffer* buffer;
    void insert(int x, int y, std::uint32_t, std::uint32_t) noexcept {
      Concurrency::fetch_increment(buffer->table_[buffer->pixel_of(x, y)]);
    }
  };

  HashBuffer(int width, int height, const HashBufferOptions& options)
      : options_(options),
        width_(width),
        height_(height),
        pixels_(static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height)),
        blocks_per_row_((static_cast<std::size_t>(width) + kBlockSide - 1) / kBlockSide),
        guarded_(options.keep_nearest > 0 || options.opacity) {}

  /// How much of a list has been visited, where culling ends it.
  struct ListEnd {
    double transmittance = 1.0;
    unsigned kept = 0;
  };
  /// Visits a record; whether the list goes on behind it.
  template <class Visit>
  bool goes_on(Visit& visit, Word record, ListEnd& end) const {
    if constexpr (std::is_convertible_v<decltype(visit(Record::item(record))), bool>) {
      if (!visit(Record::item(record))) return false;
    } else {
      visit(Record::item(record));
    }
    if (!guarded_) return true;
    if (options_.keep_nearest > 0 && ++end.kept >= options_.keep_nearest) return false;
    if (!options_.opacity) return true;
    end.transmittance *= transmittance_of(record, options_);
    return end.transmittance >= 1.0 - options_.opacity_threshold;
  }

  [[nodiscard]] static double transmittance_of(Word record, const HashBufferOptions& options) {
    return 1.0 - std::clamp(options.opacity(Record::payload(record)), 0.0, 1.0);
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
  mutable Overflow<Record> overflow_;  // sorted when it is read
  bool keep_failures_ = true;
  // Counters that threads write live apart from what they read.
  alignas(64) std::uint64_t failures_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace strata
