#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "hashbuffer/gl/prefix_sum.h"
#include "strata/gl/buffer.h"
#include "strata/gl/context.h"
#include "strata/gl/shader_program.h"
#include "strata/hashbuffer/gl/store.h"

// After: Maule, Comba, Torchelsen, Bastos, "Memory-Optimized Order-Independent Transparency with
// Dynamic Fragment Buffer", 2012/2014.
// We differ: one array serves as counter, base address and cursor, and ends as the ends of the
// lists; lists are sorted by (depth, payload), so no bit depends on the schedule.

namespace strata::gl {

struct ScanStoreOptions {
  bool payload = true;  ///< false: depth only, half the memory
  /// Bytes at one binding at most, if smaller than what the driver says; 0: that.
  std::uint64_t binding_bytes = 0;
};

/// The count/scan store on the GPU: a pass that counts, a prefix sum, a pass that stores, a sort of
/// each list. Exact size, lists of any length. A screen whose fragments are larger than one binding
/// is cut into bands of rows.
class ScanStore final : public Store {
 public:
  [[nodiscard]] static Result<std::unique_ptr<ScanStore>> create(
      const Info& info, const ScanStoreOptions& options = {});

  [[nodiscard]] Result<void> begin(std::uint32_t width, std::uint32_t height) override;
  [[nodiscard]] int passes() const override { return static_cast<int>(2 * bands_.size()); }
  [[nodiscard]] StoreGlsl glsl(int pass) const override;
  [[nodiscard]] PixelRows rows_of(int pass) const override;
  [[nodiscard]] Result<bool> begin_pass(int pass) override;
  [[nodiscard]] Result<bool> end() override;

  [[nodiscard]] std::uint64_t memory_bytes() const override;
  [[nodiscard]] std::uint32_t payload_mask() const override { return options_.payload ? ~0u : 0u; }
  [[nodiscard]] int bands() const override { return static_cast<int>(bands_.size()); }
  [[nodiscard]] PixelRows band_rows(int band) const override;
  [[nodiscard]] StoreGlsl glsl_read() const override;
  void bind_for_reading(int band) const override;

  [[nodiscard]] std::uint64_t fragments() const override;

 private:
  struct Band {
    PixelRows rows;
    std::uint32_t pixels = 0;
    std::uint32_t items = 0;  ///< fragments of the frame
    Buffer ends;              ///< a word a pixel: count, begin, end of its list
    Buffer items_buffer;      ///< as large as the largest frame so far needed
    Buffer params;
  };

  ScanStore(const Info& info, const ScanStoreOptions& options);
  [[nodiscard]] std::uint64_t item_bytes() const { return options_.payload ? 8 : 4; }
  [[nodiscard]] Result<void> lay_out(std::uint64_t bands);
  [[nodiscard]] Result<void> make_room(Band& band);
  [[nodiscard]] GlslSettings settings() const;
  [[nodiscard]] Result<void> sort(const Band& band);
  void sort_long(std::uint32_t lists, std::uint32_t longest) const;

  ScanStoreOptions options_;
  std::vector<Band> bands_;
  bool too_large_ = false;  ///< a band's fragments are larger than a binding
  PrefixSum prefix_sum_;
  Program sort_, sort_long_;
  Buffer long_lists_;
  std::uint32_t longest_here_;  ///< items of a list that one invocation sorts
};

}  // namespace strata::gl
