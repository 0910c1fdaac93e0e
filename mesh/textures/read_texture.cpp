#include "mesh/textures/read_texture.h"

#include <png.h>

#include <new>
#include <stdexcept>

#include "mesh/textures/jpeg_texture.h"

namespace strata {
namespace detail {

Result<void> check_texture_size(const std::string& name, std::uint64_t width, std::uint64_t height,
                                std::uint64_t bytes, const Execution& execution) {
  constexpr std::uint64_t kMostSide = 32768;
  if (width == 0 || height == 0) {
    return fail(ErrorCode::kInput, "{}: the picture has {} x {} texels", name, width, height);
  }
  if (width > kMostSide || height > kMostSide) {
    return fail(ErrorCode::kLimit, "{}: the picture has {} x {} texels; a side has at most {}",
                name, width, height, kMostSide);
  }
  if (execution.memory_limit != 0 && bytes > execution.memory_limit) {
    return fail(ErrorCode::kLimit,
                "{}: a picture of {} x {} texels needs {} bytes, but the memory limit is {}", name,
                width, height, bytes, execution.memory_limit);
  }
  return {};
}

}  // namespace detail

namespace {

constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1a\n";

/// libpng's simplified interface: its errors never leave it.
struct PngJob {
  png_image image = {};
  PngJob() { image.version = PNG_IMAGE_VERSION; }
  ~PngJob() { png_image_free(&image); }
  PngJob(const PngJob&) = delete;
  PngJob& operator=(const PngJob&) = delete;
};

Result<Texture> read_png(const std::string& name, std::string_view bytes,
                         const Execution& execution) {
  PngJob job;
  const auto failure = [&] {
    return fail(ErrorCode::kInput, "{}: the PNG cannot be decoded: {}", name,
                static_cast<const char*>(job.image.message));
  };
  if (!png_image_begin_read_from_memory(&job.image, bytes.data(), bytes.size())) return failure();
  const std::uint64_t width = job.image.width, height = job.image.height;
  if (auto good = detail::check_texture_size(name, width, height, 4 * width * height, execution);
      !good) {
    return tl::unexpected(good.error());
  }
  job.image.format = PNG_FORMAT_RGBA;
  // samples of 16 bits without a gamma are sRGB, as those of 8 bits are
  job.image.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;
  Texture texture;
  texture.name = name;
  texture.width = static_cast<int>(width);
  texture.height = static_cast<int>(height);
  texture.texels.resize(width * height);
  if (!png_image_finish_read(&job.image, nullptr, texture.texels.data(), 0, nullptr)) {
    return failure();
  }
  return texture;
}

}  // namespace

Result<Texture> read_texture(const std::string& name, std::string_view bytes,
                             const Execution& execution) try {
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "{}: stopped", name);
  if (bytes.starts_with(kPngSignature)) return read_png(name, bytes, execution);
  if (bytes.starts_with("\xff\xd8")) return detail::read_jpeg(name, bytes, execution);
  return fail(ErrorCode::kInput, "{}: the picture is neither PNG nor JPEG{}", name,
              bytes.empty() ? ": it is empty" : "");
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "{}: not enough memory for the picture", name);
} catch (const std::length_error&) {
  return fail(ErrorCode::kLimit, "{}: not enough memory for the picture", name);
}

}  // namespace strata
