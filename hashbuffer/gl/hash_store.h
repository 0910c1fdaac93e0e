#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "strata/gl/buffer.h"
#include "strata/gl/context.h"
#include "strata/gl/shader_program.h"
#include "strata/hashbuffer/gl/store.h"
#include "strata/hashbuffer/offsets.h"

// After: Lefebvre, Hornus, Lasram, "HA-Buffer: Coherent Hashing for single-pass A-buffer", INRIA
// RR-8282, 2013. The table law is that of strata/hashbuffer/table_law.h, bit for bit.
// We differ: 64-bit words without 64-bit atomics, in two passes over the geometry.

namespace strata::gl {

/// How 64-bit words are kept.
enum class WordPath {
  kAuto,     ///< kAtomic where a 64-bit atomic maximum compiles, else kTwoPass
  kAtomic,   ///< one pass, 64-bit atomic maximum
  kTwoPass,  ///< keys by 32-bit maxima; then payloads by 32-bit maxima in the cells of their keys
};

struct HashStoreOptions {
  /// 32: [age:8 | nearness:24], depth only. 64: [age:8 | nearness:24 | payload:32].
  int record_bits = 64;
  WordPath path = WordPath::kAuto;
  /// As in HashBufferOptions, and with the same meaning for the bits of the table.
  std::uint64_t cells = 0;
  OffsetKind offsets = OffsetKind::kPlaneFirst;
  std::uint64_t seed = 1;
  unsigned age_limit = 0;
  /// The table grows and shrinks with the load of the last frame
  /// (strata/hashbuffer/resize_policy.h). Off: it keeps its size and its offsets until something
  /// does not fit; no load is counted.
  bool resize = true;
  /// A plain load before each atomic maximum, which is then done only if it can win. The same bits.
  bool read_first = true;
  /// For tests on drivers without 64-bit atomics: kAtomic with a plain maximum in place of the
  /// atomic one. Right only if a single invocation inserts everything.
  bool serial = false;
  /// Above 0: fragments behind this much opacity may be dropped. The caller binds the premultiplied
  /// colours and opacities of the faces, vec4 by [triangle << 1 | exit], to binding 12 before it
  /// builds. 64-bit words on the atomic path only.
  double cull_opacity = 0.0;
  /// Bytes of a table at one binding at most, if smaller than what the driver says; 0: that.
  std::uint64_t binding_bytes = 0;
};

/// The HA-buffer on the GPU: a hash table whose probe sequences are the sorted depth lists. Lists
/// of 255 fragments at most, where the driver has few rounds of loops (workaround loop-rounds) of
/// some less under large triangles; longer ones end in ErrorCode::kLimit that names the pixel
/// (ScanStore takes them). A band of rows is a table of its own, the same as a HashBuffer of that
/// many rows.
class HashStore final : public Store {
 public:
  /// ErrorCode::kUsage for a combination that this driver cannot do.
  [[nodiscard]] static Result<std::unique_ptr<HashStore>> create(
      const Info& info, const HashStoreOptions& options = {});

  /// The table of the next frame has room for twice that.
  void expect(std::uint64_t fragments) override { expected_ = fragments; }
  [[nodiscard]] bool gains_by_hint() const override { return true; }
  [[nodiscard]] Result<void> begin(std::uint32_t width, std::uint32_t height) override;
  [[nodiscard]] int passes() const override;
  [[nodiscard]] StoreGlsl glsl(int pass) const override;
  [[nodiscard]] PixelRows rows_of(int pass) const override;
  [[nodiscard]] Result<bool> begin_pass(int pass) override;
  [[nodiscard]] Result<bool> end() override;

  [[nodiscard]] std::uint64_t memory_bytes() const override;
  [[nodiscard]] std::uint32_t payload_mask() const override;
  [[nodiscard]] int bands() const override { return static_cast<int>(bands_.size()); }
  [[nodiscard]] PixelRows band_rows(int band) const override;
  [[nodiscard]] StoreGlsl glsl_read() const override;
  void bind_for_reading(int band) const override;

  /// The path taken: kAtomic or kTwoPass; kAtomic for 32-bit words.
  [[nodiscard]] WordPath path() const { return path_; }
  /// Cells of all bands.
  [[nodiscard]] std::uint64_t cells() const;
  /// The raw words of a band's table, as HashBuffer::cells() has them.
  [[nodiscard]] std::vector<std::uint64_t> table(int band) const;
  /// HashBuffer::checksum() of a band's table.
  [[nodiscard]] std::uint64_t checksum(int band) const;

 private:
  enum class Mode {
    kInsert,
    kCountLayers,  ///< something did not fit: is it room or ages?
  };
  /// What a pass inserts.
  enum class Kind { kWords, kPayloads, kLayers };

  struct Band {
    PixelRows rows;
    std::uint64_t pixels = 0;
    std::uint64_t cells = 0;
    std::uint64_t frame = 0;
    unsigned age_limit = 0;
    OffsetKind offset_kind = OffsetKind::kPlaneFirst;
    Buffer table, payloads, offsets, params;
    // Of a frame that did not fit.
    std::uint64_t stored = 0, missing = 0;
    bool layers_counted = false;
    std::uint32_t deepest = 0;  ///< fragments of a pixel, once layers are counted
  };
  struct Counts {
    std::uint32_t failures, strangers, held, unused;
  };

  HashStore(const Info& info, const HashStoreOptions& options, WordPath path);

  [[nodiscard]] bool two_tables() const {
    return options_.record_bits == 64 && path_ == WordPath::kTwoPass;
  }
  [[nodiscard]] std::uint64_t word_bytes() const {  ///< of one table
    return options_.record_bits == 64 && !two_tables() ? 8 : 4;
  }
  [[nodiscard]] std::uint64_t most_cells() const { return binding_bytes_ / word_bytes(); }
  /// Cells that the memory limit leaves each band.
  [[nodiscard]] std::uint64_t allowed_cells() const;
  [[nodiscard]] std::uint64_t bytes_of(std::uint64_t cells) const;
  [[nodiscard]] Kind kind_of(int pass) const;
  [[nodiscard]] std::size_t band_of(int pass) const;
  [[nodiscard]] std::string name_of_words() const;

  [[nodiscard]] Result<void> lay_out(std::uint64_t bands, std::uint64_t cells);
  [[nodiscard]] Result<bool> split(std::uint64_t cells);
  [[nodiscard]] Result<void> resize_band(Band& band, std::uint64_t cells, OffsetKind kind);
  [[nodiscard]] Result<void> draw_offsets(Band& band, OffsetKind kind);
  [[nodiscard]] Result<void> begin_bands();
  [[nodiscard]] Result<std::vector<Counts>> clear_and_count();
  [[nodiscard]] Result<bool> look_at_failures(const std::vector<Counts>& counts);
  [[nodiscard]] Result<void> read_layers(Band& band);
  [[nodiscard]] Result<bool> look_at_layers();

  std::uint64_t expected_ = 0;  ///< fragments of the next frame; 0: not known
  std::uint32_t most_steps_;    ///< that an invocation may take
  HashStoreOptions options_;
  WordPath path_;
  std::vector<Band> bands_;
  std::vector<std::size_t> active_;  ///< bands to be drawn in this attempt
  Mode mode_ = Mode::kInsert;
  Buffer counts_, held_;
  Program clear_;
};

}  // namespace strata::gl
