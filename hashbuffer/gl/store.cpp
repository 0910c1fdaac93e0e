#include "strata/hashbuffer/gl/store.h"

#include <algorithm>
#include <limits>
#include <new>
#include <string>
#include <utility>

#include "hashbuffer/gl/hash_store.h"
#include "hashbuffer/gl/prefix_sum.h"
#include "hashbuffer/gl/scan_store.h"
#include "hashbuffer/gl/store_glsl.h"
#include "strata/gl/buffer.h"
#include "strata/gl/shader_program.h"

namespace strata::glsl {
extern const gl::GlslPiece hashbuffer_gl_list_lengths_comp;
extern const gl::GlslPiece hashbuffer_gl_list_items_comp;
extern const gl::GlslPiece hashbuffer_gl_store_common;
}  // namespace strata::glsl

namespace strata::gl {
namespace {

constexpr std::uint32_t kPixelsOfGroup = 64;
/// A frame that does not fit grows by a step at least each time, so this is never reached.
constexpr int kMostAttempts = 200;

Result<void> draw_passes(Store& store, Producer& producer, const Execution& execution, int& drawn) {
  for (int pass = 0; pass < store.passes(); ++pass) {
    if (execution.stop.stop_requested()) {
      return fail(ErrorCode::kCancelled, "OpenGL store: stopped on request");
    }
    const auto needed = store.begin_pass(pass);
    if (!needed) return tl::unexpected(needed.error());
    if (!*needed) continue;
    if (auto done = producer.draw(store.glsl(pass), store.rows_of(pass)); !done) return done;
    ++drawn;
  }
  return {};
}

}  // namespace

Result<BuildReport> build(Store& store, Producer& producer, const Execution& execution) {
  store.limit_memory(execution.memory_limit);
  if (auto begun = store.begin(producer.width(), producer.height()); !begun) {
    return tl::unexpected(begun.error());
  }
  BuildReport report;
  for (int attempt = 0; attempt < kMostAttempts; ++attempt) {
    if (auto drawn = draw_passes(store, producer, execution, report.generator_calls); !drawn) {
      return tl::unexpected(drawn.error());
    }
    const auto complete = store.end();
    if (!complete) return tl::unexpected(complete.error());
    if (*complete) {
      report.memory_bytes = store.memory_bytes();
      report.fragments = store.fragments();
      return report;
    }
  }
  return fail(ErrorCode::kInternal, "OpenGL store: {} attempts did not build a frame",
              kMostAttempts);
}

StoreGlsl store_glsl(const GlslPiece& piece, GlslSettings settings) {
  return {std::string(piece.name), std::move(settings),
          std::string(glsl::hashbuffer_gl_store_common.text) + std::string(piece.text)};
}

Result<std::unique_ptr<Store>> make_hash_store(const Info& info, int record_bits) {
  return HashStore::create(info, {.record_bits = record_bits});
}
Result<std::unique_ptr<Store>> make_scan_store(const Info& info, bool payload) {
  return ScanStore::create(info, {.payload = payload});
}

struct Store::Reader {
  Program lengths, items;
  PrefixSum prefix_sum;
  Buffer lengths_buffer, items_buffer;
};

Store::Store(const Limits& limits) : binding_bytes_(limits.storage_block_bytes) {}
Store::~Store() = default;

Result<LayeredDepthImage> Store::download() {
  if (!reader_) {
    auto reader = std::make_unique<Reader>();
    const StoreGlsl read = glsl_read();
    const GlslPiece counting[] = {read.piece(), glsl::hashbuffer_gl_list_lengths_comp};
    const GlslPiece copying[] = {read.piece(), glsl::hashbuffer_gl_list_items_comp};
    auto lengths = Program::compute(counting, read.settings);
    if (!lengths) return tl::unexpected(lengths.error());
    auto items = Program::compute(copying, read.settings);
    if (!items) return tl::unexpected(items.error());
    reader->lengths = std::move(*lengths);
    reader->items = std::move(*items);
    reader_ = std::move(reader);
  }
  LayeredDepthImage image;
  image.width = static_cast<int>(width_);
  image.height = static_cast<int>(height_);
  image.depth_limit = 1u << 24;
  try {
    image.offsets.assign(std::size_t{width_} * height_ + 1, 0);
    for (int band = 0; band < bands(); ++band) {
      if (auto done = download_band(band, image); !done) return tl::unexpected(done.error());
    }
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "OpenGL store: no memory for the lists of {} x {} pixels",
                width_, height_);
  }
  return image;
}

Result<void> Store::download_band(int band, LayeredDepthImage& image) {
  Reader& reader = *reader_;
  const PixelRows rows = band_rows(band);
  const std::uint32_t first = rows.begin * width_;
  const std::uint32_t pixels = (rows.end - rows.begin) * width_;
  if (auto room = reader.lengths_buffer.reserve(std::uint64_t{pixels} * 4); !room) return room;
  const Groups groups = groups_for(pixels, kPixelsOfGroup);
  storage_barrier();
  bind_for_reading(band);
  reader.lengths_buffer.bind(0);
  reader.lengths.set("first_pixel", first);
  reader.lengths.set("pixels", pixels);
  reader.lengths.dispatch(groups.x, groups.y);
  storage_barrier();
  const auto total = reader.prefix_sum.run(reader.lengths_buffer, pixels);
  if (!total) return tl::unexpected(total.error());
  if (*total == std::numeric_limits<std::uint32_t>::max()) {
    return fail(ErrorCode::kLimit, "OpenGL store: 2^32 fragments or more in one band");
  }
  std::vector<std::uint32_t> begins(std::size_t{pixels} + 1, *total);
  reader.lengths_buffer.download(std::span(begins).first(pixels));
  if (auto checked = check_errors("OpenGL store: reading"); !checked) return checked;
  const std::uint64_t before = image.items.size();
  for (std::uint32_t i = 0; i < pixels; ++i) {
    image.offsets[std::size_t{first} + i + 1] = before + begins[i + 1];
  }
  image.items.resize(before + *total);

  // As many pixels at once as their items fit one binding.
  const std::uint64_t most = std::max<std::uint64_t>(binding_bytes_ / sizeof(DepthItem), 1);
  for (std::uint32_t begin = 0; begin<pixels&& * total> 0;) {
    const auto above = std::upper_bound(begins.begin() + begin, begins.end(), begins[begin] + most);
    const auto end = static_cast<std::uint32_t>(above - begins.begin()) - 1;
    if (end == begin) {
      return fail(
          ErrorCode::kLimit,
          "OpenGL store: pixel ({}, {}) has {} fragments, but at most {} can be read at once",
          (first + begin) % width_, (first + begin) / width_, begins[begin + 1] - begins[begin],
          most);
    }
    const std::uint64_t count = begins[end] - begins[begin];
    if (count > 0) {
      if (auto room = reader.items_buffer.reserve(count * sizeof(DepthItem)); !room) return room;
      bind_for_reading(band);
      reader.lengths_buffer.bind(0);
      reader.items_buffer.bind(1);
      reader.items.set("first_pixel", first + begin);
      reader.items.set("pixels", end - begin);
      reader.items.set("first_begin", begin);
      reader.items.set("first_item", begins[begin]);
      const Groups copies = groups_for(end - begin, kPixelsOfGroup);
      reader.items.dispatch(copies.x, copies.y);
      reader.items_buffer.download(std::span(image.items).subspan(before + begins[begin], count));
    }
    begin = end;
  }
  return check_errors("OpenGL store: reading");
}

}  // namespace strata::gl
