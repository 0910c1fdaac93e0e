#include "hashbuffer/gl/scan_store.h"

#include <algorithm>
#include <limits>

#include "hashbuffer/gl/store_glsl.h"

namespace strata::glsl {
extern const gl::GlslPiece hashbuffer_gl_count;
extern const gl::GlslPiece hashbuffer_gl_fill;
extern const gl::GlslPiece hashbuffer_gl_read_scan;
extern const gl::GlslPiece hashbuffer_gl_sort_lists_comp;
extern const gl::GlslPiece hashbuffer_gl_sort_long_comp;
}  // namespace strata::glsl

namespace strata::gl {
namespace {

constexpr unsigned kEnds = 8, kItems = 9, kParams = 8;
constexpr std::uint32_t kPixelsOfGroup = 64;
constexpr std::uint32_t kMostRows = 65535;  ///< work groups along one axis, on every driver

}  // namespace

Result<std::unique_ptr<ScanStore>> ScanStore::create(const Info& info,
                                                     const ScanStoreOptions& options) {
  return std::unique_ptr<ScanStore>(new ScanStore(info, options));
}

ScanStore::ScanStore(const Info& info, const ScanStoreOptions& options)
    : Store(info.limits),
      options_(options),
      longest_here_(info.works_around("loop-rounds") ? 1024 : 16384) {
  if (options.binding_bytes > 0) binding_bytes_ = std::min(binding_bytes_, options.binding_bytes);
}

GlslSettings ScanStore::settings() const {
  GlslSettings settings;
  if (options_.payload) settings.defines = {{"STORE_PAYLOADS", "1"}};
  return settings;
}

StoreGlsl ScanStore::glsl(int pass) const {
  if (pass % 2 == 0) return store_glsl(glsl::hashbuffer_gl_count, {});
  return store_glsl(glsl::hashbuffer_gl_fill, settings());
}

StoreGlsl ScanStore::glsl_read() const {
  return store_glsl(glsl::hashbuffer_gl_read_scan, settings());
}

PixelRows ScanStore::rows_of(int pass) const { return band_rows(pass / 2); }

PixelRows ScanStore::band_rows(int band) const {
  return bands_[static_cast<std::size_t>(band)].rows;
}

void ScanStore::bind_for_reading(int band) const {
  const Band& of = bands_[static_cast<std::size_t>(band)];
  of.ends.bind(kEnds);
  if (of.items_buffer) of.items_buffer.bind(kItems);
  of.params.bind_uniform(kParams);
}

std::uint64_t ScanStore::memory_bytes() const {
  std::uint64_t bytes = prefix_sum_.memory_bytes();
  for (const Band& band : bands_) {
    bytes += band.ends.bytes() + band.items_buffer.bytes() + band.params.bytes();
  }
  return bytes;
}

std::uint64_t ScanStore::fragments() const {
  std::uint64_t sum = 0;
  for (const Band& band : bands_) sum += band.items;
  return sum;
}

Result<void> ScanStore::lay_out(std::uint64_t bands) {
  const auto most_pixels = [&](std::uint64_t count) {
    return (height_ + count - 1) / count * width_;
  };
  while (bands < height_ && most_pixels(bands) * 4 > binding_bytes_) ++bands;
  if (most_pixels(bands) * 4 > binding_bytes_) {
    return fail(ErrorCode::kLimit,
                "count/scan store: a row has {} pixels, but one binding holds {}", width_,
                binding_bytes_ / 4);
  }
  bands_.clear();
  bands_.resize(bands);
  for (std::uint64_t i = 0; i < bands; ++i) {
    Band& band = bands_[i];
    band.rows = {static_cast<std::uint32_t>(height_ * i / bands),
                 static_cast<std::uint32_t>(height_ * (i + 1) / bands)};
    band.pixels = (band.rows.end - band.rows.begin) * width_;
    auto ends = Buffer::allocate(std::uint64_t{band.pixels} * 4);
    if (!ends) return tl::unexpected(ends.error());
    auto params = Buffer::allocate(sizeof(StoreBlock));
    if (!params) return tl::unexpected(params.error());
    band.ends = std::move(*ends);
    band.params = std::move(*params);
  }
  return {};
}

Result<void> ScanStore::begin(std::uint32_t width, std::uint32_t height) {
  if (width < 1 || height < 1 ||
      std::uint64_t{width} * height > std::numeric_limits<std::uint32_t>::max()) {
    return fail(ErrorCode::kUsage,
                "count/scan store: a screen must have 1 to 2^32 - 1 pixels, got {} x {}", width,
                height);
  }
  if (!sort_) {
    const GlslPiece here = glsl::hashbuffer_gl_sort_lists_comp;
    auto sort_here = Program::compute({&here, 1}, settings());
    if (!sort_here) return tl::unexpected(sort_here.error());
    const GlslPiece in_stages = glsl::hashbuffer_gl_sort_long_comp;
    auto sort_long = Program::compute({&in_stages, 1}, settings());
    if (!sort_long) return tl::unexpected(sort_long.error());
    sort_ = std::move(*sort_here);
    sort_long_ = std::move(*sort_long);
  }
  if (width != width_ || height != height_ || bands_.empty()) {
    width_ = width;
    height_ = height;
    if (auto done = lay_out(1); !done) return done;
  }
  too_large_ = false;
  for (Band& band : bands_) {
    band.ends.clear();
    band.items = 0;
    const StoreBlock params{band.rows.begin * width_, band.pixels, 0, 0,
                            static_cast<std::uint32_t>(&band - bands_.data())};
    band.params.upload(std::span(&params, 1));
  }
  return {};
}

/// After the counting pass: places, and room for the items.
Result<void> ScanStore::make_room(Band& band) {
  storage_barrier();
  const auto total = prefix_sum_.run(band.ends, band.pixels);
  if (!total) return tl::unexpected(total.error());
  band.items = *total;
  const std::uint64_t bytes = std::uint64_t{band.items} * item_bytes();
  if (bytes > binding_bytes_) {
    if (band.rows.end - band.rows.begin <= 1) {
      return fail(ErrorCode::kLimit,
                  "count/scan store: row {} has {} fragments, but one binding holds {}",
                  band.rows.begin, band.items, binding_bytes_ / item_bytes());
    }
    too_large_ = true;
    return {};
  }
  if (memory_limit_ > 0) {
    const std::uint64_t others = memory_bytes() - band.items_buffer.bytes();
    if (others + bytes > memory_limit_) {
      const std::uint64_t room =
          others > memory_limit_ ? 0 : (memory_limit_ - others) / item_bytes();
      band.items_buffer = Buffer();
      return fail(ErrorCode::kLimit,
                  "count/scan store: {} of {} fragments do not fit; they need {} bytes, the limit "
                  "is {}",
                  band.items - room, band.items, others + bytes, memory_limit_);
    }
    // Room of an earlier frame may be more than is allowed now.
    if (memory_bytes() > memory_limit_) band.items_buffer = Buffer();
  }
  if (auto room = band.items_buffer.reserve(std::max<std::uint64_t>(bytes, item_bytes())); !room) {
    return room;
  }
  const StoreBlock params{band.rows.begin * width_, band.pixels, band.items, 0,
                          static_cast<std::uint32_t>(&band - bands_.data())};
  band.params.upload(std::span(&params, 1));
  return {};
}

Result<bool> ScanStore::begin_pass(int pass) {
  if (too_large_) return false;  // end() will cut the screen
  Band& band = bands_[static_cast<std::size_t>(pass / 2)];
  if (pass % 2 == 1) {
    if (auto room = make_room(band); !room) return tl::unexpected(room.error());
    if (too_large_ || band.items == 0) return false;
  }
  storage_barrier();
  bind_for_reading(pass / 2);
  return true;
}

Result<void> ScanStore::sort(const Band& band) {
  // Two counters, and as many long lists as there can be.
  const std::uint64_t most_long = band.items / (longest_here_ + 1);
  if (auto room = long_lists_.reserve((2 + most_long) * 4); !room) return room;
  long_lists_.clear(0, 0, 8);
  long_lists_.bind(0);
  sort_.set("pixels", band.pixels);
  sort_.set("longest_here", longest_here_);
  const Groups groups = groups_for(band.pixels, kPixelsOfGroup);
  sort_.dispatch(groups.x, groups.y);
  storage_barrier();
  if (most_long == 0) return {};
  std::uint32_t counters[2] = {};
  long_lists_.download(std::span<std::uint32_t>(counters));
  if (auto checked = check_errors("count/scan store"); !checked) return checked;
  if (counters[0] > 0) sort_long(counters[0], counters[1]);
  return {};
}

void ScanStore::sort_long(std::uint32_t lists, std::uint32_t longest) const {
  const auto stage = [&](std::uint32_t mask) {
    sort_long_.set("mask", mask);
    for (std::uint32_t first = 0; first < lists; first += kMostRows) {
      sort_long_.set("first_list", first);
      sort_long_.dispatch((longest + kPixelsOfGroup - 1) / kPixelsOfGroup,
                          std::min(lists - first, kMostRows));
      storage_barrier();
    }
  };
  for (std::uint64_t sorted = 2; sorted / 2 < longest; sorted *= 2) {
    stage(static_cast<std::uint32_t>(sorted - 1));
    for (std::uint64_t reach = sorted / 4; reach > 0; reach /= 2) {
      stage(static_cast<std::uint32_t>(reach));
    }
  }
}

Result<bool> ScanStore::end() {
  if (too_large_) {
    if (auto done = lay_out(std::min<std::uint64_t>(2 * bands_.size(), height_)); !done) {
      return tl::unexpected(done.error());
    }
    if (auto begun = begin(width_, height_); !begun) return tl::unexpected(begun.error());
    return false;
  }
  storage_barrier();
  for (std::size_t i = 0; i < bands_.size(); ++i) {
    const Band& band = bands_[i];
    if (band.items == 0) continue;
    std::uint32_t last = 0;
    band.ends.download(std::span(&last, 1), (std::uint64_t{band.pixels} - 1) * 4);
    if (auto checked = check_errors("count/scan store"); !checked) {
      return tl::unexpected(checked.error());
    }
    if (last != band.items) {
      return fail(ErrorCode::kInternal,
                  "count/scan store: the stored fragments differ from the {} that were counted",
                  band.items);
    }
    bind_for_reading(static_cast<int>(i));
    if (auto sorted = sort(band); !sorted) return tl::unexpected(sorted.error());
  }
  storage_barrier();
  if (auto checked = check_errors("count/scan store"); !checked) {
    return tl::unexpected(checked.error());
  }
  return true;
}

}  // namespace strata::gl
