#include "voxelize/picture/slice_picture.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>

#include "voxelize/picture/isolines.h"
#include "voxelize/picture/slice_place.h"
#include "voxelize/picture/voxel_shader.h"

namespace strata {
namespace {

/// The part of the grid without solid voxels.
constexpr glm::vec3 kEmpty{0.955f, 0.955f, 0.96f};
/// What goes around the grid.
constexpr Rgba kFrame{150, 152, 156, 255};

class SliceDrawing {
 public:
  SliceDrawing(const VoxelIntervals& set, const VoxelLook& look, const VoxelSlice& slice,
               const glm::ivec2& size, const VoxelPictureOptions& options)
      : set_(set),
        look_(look),
        place_(set.grid(), slice, size),
        options_(options),
        labels_(set.has_labels()),
        picture_{size.x, size.y, {}} {
    picture_.pixels.assign(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y),
                           options.background);
  }

  Picture draw(const Execution& execution) {
    if (look_.value) {
      values(execution);
    } else {
      for_rows(execution, [&](int u, int v) { return solids(u, v); });
    }
    frame();
    return std::move(picture_);
  }

 private:
  template <class Colour>
  void for_rows(const Execution& execution, Colour&& colour) {
    parallel_for(execution, static_cast<std::size_t>(picture_.height), [&](std::size_t row, int) {
      Rgba* pixels = picture_.pixels.data() + row * static_cast<std::size_t>(picture_.width);
      for (int u = 0; u < picture_.width; ++u) pixels[u] = colour(u, static_cast<int>(row));
    });
  }

  /// A line around the grid: empty voxels may be as light as what is no voxel.
  void frame() {
    const glm::ivec2 begin = glm::ivec2(glm::floor(place_.begin())) - 1;
    const glm::ivec2 end = glm::ivec2(glm::ceil(place_.end()));
    const auto put = [&](int u, int v) {
      if (u < 0 || v < 0 || u >= picture_.width || v >= picture_.height) return;
      picture_.pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(picture_.width) +
                      static_cast<std::size_t>(u)] = kFrame;
    };
    for (int u = begin.x; u <= end.x; ++u) put(u, begin.y), put(u, end.y);
    for (int v = begin.y; v <= end.y; ++v) put(begin.x, v), put(end.x, v);
  }

  /// The mean of a pixel's samples: colours of labels.
  [[nodiscard]] Rgba solids(int u, int v) const {
    const auto [across, down] = sample_grid(options_.samples);
    glm::vec3 sum(0.0f);
    int found = 0;
    for (int y = 0; y < down; ++y) {
      for (int x = 0; x < across; ++x) {
        const glm::dvec2 at = place_.voxels({u + (x + 0.5) / across, v + (y + 0.5) / down});
        if (!place_.holds(at)) continue;
        sum += colour_at(at);
        ++found;
      }
    }
    if (found == 0) return options_.background;
    const auto count = static_cast<float>(options_.samples), some = static_cast<float>(found);
    if (options_.background.a == 0) {
      return {glm::u8vec3(sum / some + 0.5f), static_cast<std::uint8_t>(255 * some / count + 0.5f)};
    }
    sum += (count - some) * glm::vec3(options_.background);
    return {glm::u8vec3(sum / count + 0.5f), 255};
  }
  /// Of a place in the grid, 0 to 255.
  [[nodiscard]] glm::vec3 colour_at(const glm::dvec2& at) const {
    const glm::ivec3 voxel = place_.voxel(static_cast<int>(at.x), static_cast<int>(at.y));
    const auto label = set_.label(voxel.x, voxel.y, voxel.z);
    if (!label) return kEmpty * 255.0f;
    return glm::vec3(label_colour(look_, labels_, *label));
  }

  /// Values between the centres of voxels, or of the nearest voxel where voxels are large.
  void values(const Execution& execution) {
    ValueImage image{picture_.width, picture_.height, {}};
    image.values.assign(picture_.pixels.size(), std::numeric_limits<float>::quiet_NaN());
    parallel_for(execution, static_cast<std::size_t>(image.height), [&](std::size_t row, int) {
      float* to = image.values.data() + row * static_cast<std::size_t>(image.width);
      for (int u = 0; u < image.width; ++u) {
        const glm::dvec2 at = place_.voxels({u + 0.5, static_cast<double>(row) + 0.5});
        if (place_.holds(at)) to[u] = look_.distances ? between(at) : nearest(at);
      }
    });
    if (execution.stop.stop_requested()) return;
    if (look_.distances) {
      draw_isolines(image, isoline_step(image), picture_, execution);
    } else {
      greys(image, execution);
    }
  }
  [[nodiscard]] float nearest(const glm::dvec2& at) const {
    return look_.value(place_.voxel(static_cast<int>(at.x), static_cast<int>(at.y)));
  }
  [[nodiscard]] float between(const glm::dvec2& at) const {
    const glm::dvec2 from = glm::floor(at - 0.5);
    const auto part = glm::vec2(at - 0.5 - from);
    const int a = static_cast<int>(from.x), b = static_cast<int>(from.y);
    const auto value = [&](int i, int j) { return look_.value(place_.voxel(a + i, b + j)); };
    return glm::mix(glm::mix(value(0, 0), value(1, 0), part.x),
                    glm::mix(value(0, 1), value(1, 1), part.x), part.y);
  }
  /// From the least value, black, to the largest, white.
  void greys(const ValueImage& image, const Execution& execution) {
    float low = std::numeric_limits<float>::infinity(), high = -low;
    for (const float value : image.values) {
      if (!std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
    for_rows(execution, [&](int u, int v) {
      const float value =
          image.values[static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) +
                       static_cast<std::size_t>(u)];
      if (!std::isfinite(value)) return options_.background;
      const float part = high > low ? (value - low) / (high - low) : 0.5f;
      return Rgba(glm::u8vec3(static_cast<std::uint8_t>(part * 255.0f + 0.5f)), 255);
    });
  }

  const VoxelIntervals& set_;
  const VoxelLook& look_;
  SlicePlace place_;
  const VoxelPictureOptions& options_;
  bool labels_;
  Picture picture_;
};

}  // namespace

Result<Picture> slice_picture(const VoxelIntervals& set, const VoxelLook& look,
                              const VoxelSlice& slice, const glm::ivec2& size,
                              const VoxelPictureOptions& options, const Execution& execution) {
  if (size.x < 1 || size.y < 1 || size.x > kMaxPictureSide || size.y > kMaxPictureSide) {
    return fail(ErrorCode::kUsage, "a picture of {} x {} pixels: each side must be 1 to {}", size.x,
                size.y, kMaxPictureSide);
  }
  const int axis = static_cast<int>(slice.axis), count = set.grid().dims[axis];
  if (slice.index < 0 || slice.index >= count) {
    return fail(ErrorCode::kUsage, "a slice must be 0 to {} along {}, got {}", count - 1,
                "xyz"[axis], slice.index);
  }
  Picture picture = SliceDrawing(set, look, slice, size, options).draw(execution);
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return picture;
}

}  // namespace strata
