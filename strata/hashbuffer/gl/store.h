#pragma once

#include <cstdint>
#include <memory>

#include "strata/core/depth_list.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/gl/context.h"
#include "strata/hashbuffer/depth_list_store.h"
#include "strata/raster/gl/producer.h"

namespace strata::gl {

/// A store of a frame's fragments on the GPU, under the law of
/// strata/hashbuffer/depth_list_store.h: every list sorted by (depth, payload), equal fragments as
/// often as they came, nothing dropped silently. Use build(store, producer).
///
/// A screen whose table is larger than one binding is cut into bands of rows, each with a table of
/// its own; a band is drawn, and read, apart from the others.
class Store {
 public:
  virtual ~Store();

  /// A hint before begin(): the approximate number of fragments. Without effect where room is made
  /// as it is needed.
  virtual void expect(std::uint64_t fragments) { static_cast<void>(fragments); }
  /// Whether a counting pass for expect() pays: a table that is far too full takes long to fail.
  [[nodiscard]] virtual bool gains_by_hint() const { return false; }
  /// Empties the store for a frame of width x height pixels, each at least 1 (kUsage).
  [[nodiscard]] virtual Result<void> begin(std::uint32_t width, std::uint32_t height) = 0;
  /// Passes over the geometry. May change in begin(), begin_pass() and end().
  [[nodiscard]] virtual int passes() const = 0;
  /// The GLSL text of strata_insert for that pass. @pre pass < passes()
  [[nodiscard]] virtual StoreGlsl glsl(int pass) const = 0;
  /// The rows whose fragments the pass keeps.
  [[nodiscard]] virtual PixelRows rows_of(int pass) const = 0;
  /// Binds what the pass needs; then draw. False: nothing needs to be drawn in this pass.
  [[nodiscard]] virtual Result<bool> begin_pass(int pass) = 0;
  /// After the last pass: true, the lists are complete; false, what was missing is counted and the
  /// store has grown: all passes must be drawn again. ErrorCode::kLimit if that cannot help.
  [[nodiscard]] virtual Result<bool> end() = 0;

  /// Screen of the last begin().
  [[nodiscard]] std::uint32_t width() const { return width_; }
  /// Its height.
  [[nodiscard]] std::uint32_t height() const { return height_; }
  /// Bytes on the GPU that the lists may take, 0: no limit. From the next begin() on.
  void limit_memory(std::uint64_t bytes) { memory_limit_ = bytes; }
  /// Bytes on the GPU.
  [[nodiscard]] virtual std::uint64_t memory_bytes() const = 0;
  /// Fragments of the frame; 0 where the store does not need to count them.
  [[nodiscard]] virtual std::uint64_t fragments() const { return 0; }
  /// Bits of a payload that are kept; 0 for stores of depths alone.
  [[nodiscard]] virtual std::uint32_t payload_mask() const = 0;

  // --- reading, after end() said true -----------------------------------------------------------

  /// Bands of rows to be read apart: for each, bind_for_reading() and dispatch over its rows.
  [[nodiscard]] virtual int bands() const = 0;
  /// The rows of a band. @pre band < bands()
  [[nodiscard]] virtual PixelRows band_rows(int band) const = 0;
  /// GLSL text for reading, any stage with storage blocks. Bindings as for inserting. It defines
  ///
  ///     struct StrataCursor { ... };
  ///     StrataCursor strata_list(uint pixel);   // pixel of the whole screen, within the band
  ///     bool strata_next(inout StrataCursor cursor, out uint depth, out uint payload);
  ///
  /// strata_next gives the list front to back; false at its end.
  [[nodiscard]] virtual StoreGlsl glsl_read() const = 0;
  /// Binds what glsl_read() needs for a band.
  virtual void bind_for_reading(int band) const = 0;

  /// All lists (depth_limit 2^24, world_from_image left at identity). ErrorCode::kLimit without the
  /// memory.
  [[nodiscard]] Result<LayeredDepthImage> download();

 protected:
  /// A store within the limits of a driver.
  explicit Store(const Limits& limits);

  std::uint32_t width_ = 0;         ///< pixels; set by begin()
  std::uint32_t height_ = 0;        ///< pixels; set by begin()
  std::uint64_t memory_limit_ = 0;  ///< see limit_memory()
  std::uint64_t binding_bytes_;     ///< most bytes that a shader sees at one binding

 private:
  struct Reader;  ///< the programs and buffers of download()
  [[nodiscard]] Result<void> download_band(int band, LayeredDepthImage& image);

  std::unique_ptr<Reader> reader_;  ///< made when it is first called
};

/// The HA-buffer on the GPU: one pass, lists of 255 fragments at most. One context, one thread.
/// @param record_bits 32: depth only; 64: depth and a payload of 32 bits
/// @return kUsage for a driver that cannot
[[nodiscard]] Result<std::unique_ptr<Store>> make_hash_store(const Info& info,
                                                             int record_bits = 64);

/// The count/scan store on the GPU: two passes, lists of any length.
/// @param payload whether the 32 bits of the payload are kept
[[nodiscard]] Result<std::unique_ptr<Store>> make_scan_store(const Info& info, bool payload = true);

/// Builds a frame: draws the producer once a pass, and again where something did not fit.
/// `execution` is asked for its stop and its memory limit.
/// @return how it was built; `fragments` as Store::fragments(). ErrorCode::kLimit as Store::end(),
/// kCancelled on request, or the producer's error.
[[nodiscard]] Result<BuildReport> build(Store& store, Producer& producer,
                                        const Execution& execution = {});

}  // namespace strata::gl
