#include "strata/hashbuffer/formats/ldi_io.h"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <new>
#include <vector>

#include "core/atomic_file.h"

namespace strata {
namespace {

/// The length of a ray inside the solid, in lattice steps. An entry without an exit does not count.
std::uint64_t inside_length(std::span<const DepthItem> list) {
  std::uint64_t length = 0;
  int winding = 0;
  std::uint32_t entered = 0;
  for (const DepthItem item : list) {
    const bool was = winding > 0;
    winding += item.exit() ? -1 : 1;
    if (!was && winding > 0) entered = item.depth();
    if (was && winding <= 0) length += item.depth() - entered;
  }
  return length;
}

}  // namespace

Result<void> write_xray_png(const std::string& path, const LayeredDepthImage& image) {
  if (image.width <= 0 || image.height <= 0) {
    return fail(ErrorCode::kUsage, "{}: an image of {} x {} pixels cannot be drawn", path,
                image.width, image.height);
  }
  try {
    const auto width = static_cast<std::size_t>(image.width);
    const auto height = static_cast<std::size_t>(image.height);
    std::vector<std::uint64_t> lengths(width * height);
    for (int v = 0; v < image.height; ++v) {
      for (int u = 0; u < image.width; ++u) {
        lengths[(height - 1 - static_cast<std::size_t>(v)) * width + static_cast<std::size_t>(u)] =
            inside_length(image.list(u, v));
      }
    }
    const auto longest = static_cast<double>(
        std::max<std::uint64_t>(1, *std::max_element(lengths.begin(), lengths.end())));
    std::vector<std::uint8_t> grey(lengths.size());
    std::transform(lengths.begin(), lengths.end(), grey.begin(), [&](std::uint64_t length) {
      const double film =
          std::expm1(-2.0 * static_cast<double>(length) / longest) / std::expm1(-2.0);
      return static_cast<std::uint8_t>(std::lround(255.0 * film));
    });

    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = static_cast<png_uint_32>(image.width);
    png.height = static_cast<png_uint_32>(image.height);
    png.format = PNG_FORMAT_GRAY;
    std::vector<std::uint8_t> bytes(PNG_IMAGE_PNG_SIZE_MAX(png));
    png_alloc_size_t size = bytes.size();
    if (png_image_write_to_memory(&png, bytes.data(), &size, 0, grey.data(), 0, nullptr) == 0) {
      return fail(ErrorCode::kOutput, "{}: libpng: {}", path, png.message);
    }
    return write_file(path, bytes.data(), size);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory for an image of {} x {} pixels", path,
                image.width, image.height);
  }
}

}  // namespace strata
