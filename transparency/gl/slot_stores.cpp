#include "transparency/gl/slot_stores.h"

#include <algorithm>
#include <limits>
#include <string>

#include "hashbuffer/gl/store_glsl.h"
#include "strata/gl/buffer.h"
#include "strata/gl/shader_program.h"

namespace strata::glsl {
extern const gl::GlslPiece transparency_gl_fixed_arrays;
extern const gl::GlslPiece transparency_gl_linked_lists;
extern const gl::GlslPiece transparency_gl_select_next;
}  // namespace strata::glsl

namespace strata::gl {
namespace {

/// A store of one band, in one pass that is drawn once more where it did not fit.
class SlotStore : public Store {
 public:
  using Store::Store;

  Result<void> begin(std::uint32_t width, std::uint32_t height) override {
    const std::uint64_t pixels = std::uint64_t{width} * height;
    if (pixels < 1 || pixels > std::numeric_limits<std::uint32_t>::max()) {
      return fail(ErrorCode::kUsage, "a screen must have 1 to 2^32 - 1 pixels, got {} x {}", width,
                  height);
    }
    width_ = width, height_ = height;
    pixels_ = static_cast<std::uint32_t>(pixels);
    if (auto room = params_.reserve(sizeof(StoreBlock)); !room) return room;
    return empty();
  }
  [[nodiscard]] int passes() const override { return 1; }
  [[nodiscard]] PixelRows rows_of(int) const override { return {0, height_}; }
  [[nodiscard]] int bands() const override { return 1; }
  [[nodiscard]] PixelRows band_rows(int) const override { return {0, height_}; }
  [[nodiscard]] std::uint32_t payload_mask() const override { return ~0u; }
  Result<bool> begin_pass(int) override {
    storage_barrier();
    bind_for_reading(0);
    return true;
  }

 protected:
  /// Makes room and empties it.
  virtual Result<void> empty() = 0;
  /// @return kLimit if a binding cannot hold so many bytes
  [[nodiscard]] Result<void> reserve(Buffer& buffer, std::uint64_t bytes) const {
    if (bytes > binding_bytes_) {
      return fail(ErrorCode::kLimit, "a list store needs {} bytes, but one binding holds {}", bytes,
                  binding_bytes_);
    }
    return buffer.reserve(bytes);
  }
  void set_params(std::uint32_t room, std::uint32_t slots) {
    const StoreBlock block{0, pixels_, room, slots, 0};
    params_.upload(std::span(&block, 1));
  }
  [[nodiscard]] static StoreGlsl reading(const GlslPiece& piece, GlslSettings settings) {
    settings.defines.emplace_back("STORE_READ", "1");
    StoreGlsl glsl = store_glsl(piece, std::move(settings));
    glsl.text += std::string(glsl::transparency_gl_select_next.text);
    return glsl;
  }

  std::uint32_t pixels_ = 0;
  Buffer params_;
};

class FixedStore final : public SlotStore {
 public:
  FixedStore(const Limits& limits, std::uint32_t slots) : SlotStore(limits), slots_(slots) {}

  [[nodiscard]] StoreGlsl glsl(int) const override {
    return store_glsl(glsl::transparency_gl_fixed_arrays);
  }
  [[nodiscard]] StoreGlsl glsl_read() const override {
    return reading(glsl::transparency_gl_fixed_arrays, {});
  }
  void bind_for_reading(int) const override {
    counts_.bind(8), slots_buffer_.bind(9), most_.bind(10), params_.bind_uniform(8);
  }
  Result<bool> end() override {
    std::uint32_t most = 0;
    most_.download(std::span(&most, 1));
    if (auto good = check_errors("fixed arrays"); !good) return tl::unexpected(good.error());
    if (most <= slots_) return true;
    slots_ = most;
    if (auto done = empty(); !done) return tl::unexpected(done.error());
    return false;
  }
  [[nodiscard]] std::uint64_t memory_bytes() const override {
    return std::uint64_t{pixels_} * (4 + 8 * std::uint64_t{slots_});
  }

 private:
  Result<void> empty() override {
    if (auto room = reserve(counts_, std::uint64_t{pixels_} * 4); !room) return room;
    if (auto room = reserve(slots_buffer_, std::uint64_t{pixels_} * slots_ * 8); !room) return room;
    if (auto room = most_.reserve(4); !room) return room;
    counts_.clear();
    most_.clear();
    set_params(0, slots_);
    return {};
  }

  std::uint32_t slots_;
  Buffer counts_, slots_buffer_, most_;
};

class LinkedStore final : public SlotStore {
 public:
  LinkedStore(const Limits& limits, std::uint32_t page) : SlotStore(limits), page_(page) {}

  void expect(std::uint64_t fragments) override { expected_ = fragments; }
  [[nodiscard]] StoreGlsl glsl(int) const override {
    return store_glsl(glsl::transparency_gl_linked_lists, settings());
  }
  [[nodiscard]] StoreGlsl glsl_read() const override {
    return reading(glsl::transparency_gl_linked_lists, settings());
  }
  void bind_for_reading(int) const override {
    heads_.bind(8), nodes_buffer_.bind(9), counter_.bind(10), params_.bind_uniform(8);
    if (page_ > 1) filled_.bind(11);
  }
  Result<bool> end() override {
    std::uint32_t counters[2] = {};  // nodes that were asked for, fragments that were missed
    counter_.download(std::span<std::uint32_t>(counters));
    if (auto good = check_errors("linked lists"); !good) return tl::unexpected(good.error());
    if (counters[0] <= nodes_ && counters[1] == 0) return true;
    // The counter of single nodes is the exact need; that of pages is too, since it counts on.
    nodes_ = std::max(nodes_, counters[0]);
    if (auto done = empty(); !done) return tl::unexpected(done.error());
    return false;
  }
  [[nodiscard]] std::uint64_t memory_bytes() const override {
    const std::uint64_t a_pixel = page_ > 1 ? 8 : 4;
    return a_pixel * pixels_ + node_bytes() * nodes_;
  }

 private:
  [[nodiscard]] std::uint64_t node_bytes() const { return 4 + 8 * std::uint64_t{page_}; }
  [[nodiscard]] GlslSettings settings() const {
    GlslSettings settings;
    settings.defines = {{"STORE_PAGE", std::to_string(page_)}};
    return settings;
  }
  Result<void> empty() override {
    if (nodes_ == 0) {
      nodes_ = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(
          expected_ / page_, std::uint64_t{pixels_} / page_ + 1, binding_bytes_ / node_bytes()));
    }
    if (auto room = reserve(heads_, std::uint64_t{pixels_} * 4); !room) return room;
    if (auto room = reserve(nodes_buffer_, nodes_ * node_bytes()); !room) return room;
    if (auto room = counter_.reserve(8); !room) return room;
    if (page_ > 1) {
      if (auto room = reserve(filled_, std::uint64_t{pixels_} * 4); !room) return room;
      filled_.clear();
    }
    heads_.clear();
    counter_.clear();
    set_params(nodes_, 0);
    return {};
  }

  std::uint32_t page_;
  std::uint32_t nodes_ = 0;  ///< that there is room for
  std::uint64_t expected_ = 0;
  Buffer heads_, nodes_buffer_, counter_, filled_;
};

}  // namespace

std::unique_ptr<Store> make_fixed_store(const Info& info, std::uint32_t slots) {
  return std::make_unique<FixedStore>(info.limits, std::max(1u, slots));
}
std::unique_ptr<Store> make_linked_store(const Info& info, std::uint32_t page) {
  return std::make_unique<LinkedStore>(info.limits, std::clamp(page, 1u, 16u));
}

}  // namespace strata::gl
