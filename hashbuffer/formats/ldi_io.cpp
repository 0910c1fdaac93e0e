#include "strata/hashbuffer/formats/ldi_io.h"

#include <cstddef>

#include "strata/core/grid.h"

namespace strata {

Result<void> check_layered_depth_image(const LayeredDepthImage& image) {
  if (image.width < 1 || image.height < 1 || image.width > kMaxGridSide ||
      image.height > kMaxGridSide) {
    return fail(ErrorCode::kUsage, "depth lists of {} x {} pixels: each side must be 1 to {}",
                image.width, image.height, kMaxGridSide);
  }
  if (image.depth_limit < 1 || image.depth_limit > 1u << 24) {
    return fail(ErrorCode::kUsage, "the depth limit of depth lists must be 1 to 16777216, got {}",
                image.depth_limit);
  }
  const auto width = static_cast<std::size_t>(image.width);
  const std::size_t pixels = width * static_cast<std::size_t>(image.height);
  if (image.offsets.size() != pixels + 1 || image.offsets.front() != 0 ||
      image.offsets.back() != image.items.size()) {
    return fail(ErrorCode::kUsage,
                "depth lists of {} pixels and {} crossings have {} offsets, from {} to {}", pixels,
                image.items.size(), image.offsets.size(),
                image.offsets.empty() ? 0 : image.offsets.front(),
                image.offsets.empty() ? 0 : image.offsets.back());
  }
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    const std::uint64_t begin = image.offsets[pixel], end = image.offsets[pixel + 1];
    if (begin > end || end > image.items.size()) {
      return fail(ErrorCode::kUsage, "pixel ({}, {}): its list runs from {} to {}", pixel % width,
                  pixel / width, begin, end);
    }
    for (std::uint64_t i = begin; i < end; ++i) {
      if (image.items[i].depth() >= image.depth_limit) {
        return fail(ErrorCode::kUsage, "pixel ({}, {}): depth {} is not below the limit {}",
                    pixel % width, pixel / width, image.items[i].depth(), image.depth_limit);
      }
      if (i > begin && image.items[i] < image.items[i - 1]) {
        return fail(ErrorCode::kUsage, "pixel ({}, {}): crossing {} is out of order", pixel % width,
                    pixel / width, i - begin);
      }
    }
  }
  return {};
}

#ifndef STRATA_HAVE_OPENEXR
Result<void> write_ldi_exr(const std::string& path, const LayeredDepthImage&, const LdiExrOptions&,
                           const Execution&) {
  return fail(ErrorCode::kUsage, "{}: this build has no OpenEXR", path);
}
Result<LayeredDepthImage> read_ldi_exr(const std::string& path, const Execution&) {
  return fail(ErrorCode::kUsage, "{}: this build has no OpenEXR", path);
}
#endif

#ifndef STRATA_HAVE_LIBZIP
Result<void> write_ldi_npz(const std::string& path, const LayeredDepthImage&, const LdiNpzOptions&,
                           const Execution&) {
  return fail(ErrorCode::kUsage, "{}: this build has no libzip", path);
}
Result<LayeredDepthImage> read_ldi_npz(const std::string& path, const Execution&) {
  return fail(ErrorCode::kUsage, "{}: this build has no libzip", path);
}
#endif

}  // namespace strata
