#include <png.h>

#include <algorithm>
#include <new>

#include "core/atomic_file.h"
#include "csg/picture.h"

namespace strata::csg {

Result<void> write_png(const Picture& picture, const std::string& path) {
  try {
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = static_cast<png_uint_32>(picture.width);
    png.height = static_cast<png_uint_32>(picture.height);
    png.flags = PNG_IMAGE_FLAG_FAST;
    const bool opaque = std::all_of(picture.pixels.begin(), picture.pixels.end(),
                                    [](const Rgba& pixel) { return pixel.a == 255; });
    std::vector<std::uint8_t> rgb;
    const void* pixels = picture.pixels.data();
    png.format = PNG_FORMAT_RGBA;
    if (opaque) {
      png.format = PNG_FORMAT_RGB;
      rgb.resize(picture.pixels.size() * 3);
      for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
        std::copy_n(&picture.pixels[i].r, 3, rgb.begin() + static_cast<std::ptrdiff_t>(3 * i));
      }
      pixels = rgb.data();
    }
    std::vector<std::uint8_t> bytes(PNG_IMAGE_PNG_SIZE_MAX(png));
    png_alloc_size_t size = bytes.size();
    if (png_image_write_to_memory(&png, bytes.data(), &size, 0, pixels, 0, nullptr) == 0) {
      return fail(ErrorCode::kOutput, "{}: libpng: {}", path, png.message);
    }
    auto file = AtomicFile::create(path);
    if (!file) return tl::unexpected(file.error());
    if (auto done = file->write(bytes.data(), size); !done) return done;
    return file->commit();
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory for a picture of {} x {} pixels", path,
                picture.width, picture.height);
  }
}

}  // namespace strata::csg
