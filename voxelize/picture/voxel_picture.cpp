#include "strata/voxelize/picture/voxel_picture.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <new>
#include <utility>

#include "voxelize/picture/occupied_blocks.h"
#include "voxelize/picture/patch_depths.h"
#include "voxelize/picture/seen_openness.h"
#include "voxelize/picture/slice_picture.h"
#include "voxelize/picture/view_rays.h"
#include "voxelize/picture/voxel_ray.h"
#include "voxelize/picture/voxel_shader.h"

namespace strata {
namespace {

/// Voxels of this many pixels are blocks that one can see; smaller ones are noise.
constexpr double kBlockPixels = 3.0;
/// A square of pixels that a thread draws at once.
constexpr int kPatch = 32;
/// Depths of neighbours on one surface differ by less, in widths of a pixel.
constexpr double kSameSurface = 16.0;
/// How far things darken each other, of the diagonal of the set's box.
constexpr double kReach = 0.12;
/// Neighbours whose colours differ by more get all samples: faces of blocks have sharp edges,
/// smooth shading has none but outlines.
constexpr float kBlockContrast = 24.0f / 255.0f, kSmoothContrast = 48.0f / 255.0f;
constexpr float kMissing = -1.0f;  ///< red of a pixel that shows the background

/// X-rays: the share of light that is left where `part` of the set's diagonal is solid.
float xray_light(double part) { return static_cast<float>(std::exp(-6.0 * part)); }
constexpr glm::vec3 kXrayDark{0.05f, 0.16f, 0.32f};

Result<void> check_sections(std::span<const VoxelSection> sections) {
  for (const VoxelSection& section : sections) {
    const double length = glm::length(section.normal);
    if (length > 0 && std::isfinite(length) && std::isfinite(section.offset)) continue;
    return fail(ErrorCode::kUsage,
                "a section with normal ({}, {}, {}) and offset {}: they must be finite, and the "
                "normal not 0",
                section.normal.x, section.normal.y, section.normal.z, section.offset);
  }
  return {};
}

/// What a picture holds while it is drawn must fit the limit.
Result<void> check_memory(const glm::ivec2& size, const Execution& execution) {
  const auto bytes = static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y) *
                     (sizeof(SeenVoxel) + sizeof(glm::vec3) + 2 * sizeof(Rgba));
  if (execution.memory_limit == 0 || bytes <= execution.memory_limit) return {};
  return fail(ErrorCode::kLimit,
              "a picture of {} x {} pixels needs about {} bytes; the memory limit is {}", size.x,
              size.y, bytes, execution.memory_limit);
}

Rgba to_pixel(const glm::vec3& colour) {
  return Rgba(glm::vec<4, int>(glm::clamp(glm::vec4(colour, 1.0f), 0.0f, 1.0f) * 255.0f + 0.5f));
}

}  // namespace

struct VoxelPicture::Impl {
  std::shared_ptr<const VoxelIntervals> set;
  VoxelLook look;
  OccupiedBlocks blocks;
  Bounds box;
};

namespace {

/// A picture as it is drawn.
class Frame {
 public:
  Frame(const VoxelIntervals& set, const VoxelLook& look, const OccupiedBlocks& blocks,
        const Bounds& box, const View& view, const VoxelPictureOptions& options, VoxelStyle style,
        const Execution& execution)
      : set_(set),
        blocks_(blocks),
        options_(options),
        style_(style),
        rays_(view, set.grid(), options.sections),
        depths_(set, blocks, view, execution),
        shader_(set, look, view, rays_, options, style),
        view_(view),
        size_(view.size),
        whole_length_(box.empty() ? 1.0 : glm::length(box.high - box.low)) {
    picture_.width = size_.x;
    picture_.height = size_.y;
  }

  Result<Picture> draw(const Execution& execution) {
    const std::size_t count = static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y);
    grow(seen_, count, execution);
    grow(plain_, count, execution);
    grow(picture_.pixels, count, execution);
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    const int across = (size_.x + kPatch - 1) / kPatch, down = (size_.y + kPatch - 1) / kPatch;
    const auto patches = static_cast<std::size_t>(across) * static_cast<std::size_t>(down);
    const auto for_patches = [&](auto&& body) {
      parallel_for(execution, patches, [&](std::size_t patch, int) {
        VoxelRays rays(set_, blocks_, rays_.box());
        const int u0 = static_cast<int>(patch) % across * kPatch;
        const int v0 = static_cast<int>(patch) / across * kPatch;
        for (int v = v0; v < std::min(v0 + kPatch, size_.y); ++v) {
          for (int u = u0; u < std::min(u0 + kPatch, size_.x); ++u) body(rays, u, v);
        }
      });
    };
    for_patches([&](VoxelRays& rays, int u, int v) {
      seen_[index(u, v)] = sample(rays, {u + 0.5, v + 0.5});
    });
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    if (options_.occlusion && style_ != VoxelStyle::kXray) {
      openness_ = SeenOpenness(view_, seen_, kReach * whole_length_, execution);
    }
    for_patches([&](VoxelRays&, int u, int v) {
      const std::size_t at = index(u, v);
      const SeenVoxel& seen = seen_[at];
      const glm::dvec2 place(u + 0.5, v + 0.5);
      plain_[at] = seen.found() ? lit(place, seen, false) : glm::vec3(kMissing);
      picture_.pixels[at] = seen.found() ? pixel_of(lit(place, seen, true)) : options_.background;
    });
    if (options_.samples > 1) {
      for_patches([&](VoxelRays& rays, int u, int v) {
        if (differs(u, v)) picture_.pixels[index(u, v)] = average(rays, u, v);
      });
    }
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    return std::move(picture_);
  }

 private:
  /// In pieces: the gigabytes of a large picture take seconds to come.
  template <class T>
  static void grow(std::vector<T>& all, std::size_t count, const Execution& execution) {
    constexpr std::size_t kPiece = std::size_t{1} << 20;
    all.reserve(count);
    while (all.size() < count && !execution.stop.stop_requested()) {
      all.resize(std::min(count, all.size() + kPiece));
    }
  }
  [[nodiscard]] std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(size_.x) +
           static_cast<std::size_t>(u);
  }

  [[nodiscard]] glm::vec3 lit(const glm::dvec2& at, const SeenVoxel& seen, bool lines) const {
    if (style_ == VoxelStyle::kXray) return seen.colour;
    return shader_.lit(seen, openness_.at(at, seen), lines);
  }

  /// The part of a ray that may meet something. False: none.
  [[nodiscard]] bool narrowed(const glm::dvec2& at, ViewRay& ray) const {
    const PatchDepths::Range& range = depths_.at(static_cast<int>(at.x), static_cast<int>(at.y));
    if (range.empty()) return false;
    ray = rays_.at(at);
    if (range.nearest > ray.start.t) ray.start = {range.nearest, -1};
    ray.end = std::min(ray.end, range.farthest);
    return true;
  }

  [[nodiscard]] SeenVoxel sample(VoxelRays& rays, const glm::dvec2& at) const {
    ViewRay ray;
    if (!narrowed(at, ray)) return {};
    if (style_ == VoxelStyle::kXray) return xray(rays, ray);
    const RayHit hit = rays.first(ray.origin, ray.direction, ray.start, ray.end);
    return hit.found() ? shader_.look(ray, hit) : SeenVoxel{};
  }

  /// The colour of one of several samples of a pixel; nothing: the background.
  [[nodiscard]] std::optional<glm::vec3> colour_at(VoxelRays& rays, int u, int v,
                                                   const glm::dvec2& place) const {
    if (style_ != VoxelStyle::kSmooth) {
      const SeenVoxel seen = sample(rays, place);
      return seen.found() ? std::optional(lit(place, seen, true)) : std::nullopt;
    }
    ViewRay ray;
    if (!narrowed(place, ray)) return std::nullopt;
    const RayHit hit = rays.first(ray.origin, ray.direction, ray.start, ray.end);
    if (!hit.found()) return std::nullopt;
    // Slopes take as long as rays, and change little within a pixel: a pixel beside this one that
    // shows the same surface knows the colour.
    const SeenVoxel bare = shader_.unlit(hit);
    const glm::vec3* near = nullptr;
    double least = kSameSurface * (rays_.perspective() ? hit.t : 1.0) / rays_.scale();
    for (int y = std::max(0, v - 1); y <= std::min(size_.y - 1, v + 1); ++y) {
      for (int x = std::max(0, u - 1); x <= std::min(size_.x - 1, u + 1); ++x) {
        const SeenVoxel& one = seen_[index(x, y)];
        const double away = std::abs(double{one.distance} - double{bare.distance});
        if (!(away < least) || one.cut != bare.cut || one.colour != bare.colour) continue;
        least = away;
        near = &plain_[index(x, y)];
      }
    }
    return near != nullptr ? *near : lit(place, shader_.look(ray, hit), true);
  }

  [[nodiscard]] SeenVoxel xray(VoxelRays& rays, const ViewRay& ray) const {
    SeenVoxel seen;
    const double length = rays.solid_length(ray.origin, ray.direction, ray.start, ray.end) *
                          glm::length(ray.direction * set_.grid().voxel_size);
    if (!(length > 0)) return seen;
    const glm::vec3 behind =
        options_.background.a == 0 ? glm::vec3(1.0f) : glm::vec3(options_.background) / 255.0f;
    seen.distance = 0.0f;
    seen.colour = glm::mix(kXrayDark, behind, xray_light(length / whole_length_));
    return seen;
  }

  /// A colour, or of an X-ray the light that is left.
  [[nodiscard]] Rgba pixel_of(const glm::vec3& colour) const {
    if (style_ != VoxelStyle::kXray) return to_pixel(colour);
    if (options_.background.a != 0) {
      return to_pixel(glm::mix(kXrayDark, glm::vec3(options_.background) / 255.0f, colour.x));
    }
    Rgba pixel = to_pixel(kXrayDark);
    pixel.a = static_cast<std::uint8_t>(std::lround(255 * (1 - colour.x)));
    return pixel;
  }

  /// Whether a pixel needs more samples than one: its neighbours show something else.
  [[nodiscard]] bool differs(int u, int v) const {
    if (depths_.at(u, v).empty()) return false;
    const float contrast = style_ == VoxelStyle::kBlocks ? kBlockContrast : kSmoothContrast;
    const glm::vec3& own = plain_[index(u, v)];
    for (int y = std::max(0, v - 1); y <= std::min(size_.y - 1, v + 1); ++y) {
      for (int x = std::max(0, u - 1); x <= std::min(size_.x - 1, u + 1); ++x) {
        const glm::vec3 change = glm::abs(plain_[index(x, y)] - own);
        if (std::max({change.x, change.y, change.z}) > contrast) return true;
      }
    }
    return false;
  }

  [[nodiscard]] Rgba average(VoxelRays& rays, int u, int v) const {
    const auto [across, down] = sample_grid(options_.samples);
    glm::vec3 sum(0.0f);
    int found = 0;
    for (int y = 0; y < down; ++y) {
      for (int x = 0; x < across; ++x) {
        const glm::dvec2 place(u + (x + 0.5) / across, v + (y + 0.5) / down);
        const auto colour = colour_at(rays, u, v, place);
        if (!colour) continue;
        sum += *colour;
        ++found;
      }
    }
    if (found == 0) return options_.background;
    if (style_ == VoxelStyle::kXray) {
      const auto missing = static_cast<float>(options_.samples - found);
      return pixel_of((sum + missing) / static_cast<float>(options_.samples));
    }
    const auto count = static_cast<float>(options_.samples), some = static_cast<float>(found);
    if (options_.background.a == 0) {
      Rgba pixel = to_pixel(sum / some);
      pixel.a = static_cast<std::uint8_t>(std::lround(255 * some / count));
      return pixel;
    }
    return to_pixel((sum + (count - some) * glm::vec3(options_.background) / 255.0f) / count);
  }

  const VoxelIntervals& set_;
  const OccupiedBlocks& blocks_;
  const VoxelPictureOptions& options_;
  VoxelStyle style_;
  ViewRays rays_;
  PatchDepths depths_;
  VoxelShader shader_;
  const View& view_;
  glm::ivec2 size_;
  double whole_length_;
  std::vector<SeenVoxel> seen_;
  SeenOpenness openness_;
  std::vector<glm::vec3> plain_;  ///< colours by which samples are chosen
  Picture picture_;
};

}  // namespace

VoxelPicture::VoxelPicture(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VoxelPicture::~VoxelPicture() = default;
VoxelPicture::VoxelPicture(VoxelPicture&&) noexcept = default;
VoxelPicture& VoxelPicture::operator=(VoxelPicture&&) noexcept = default;

const VoxelIntervals& VoxelPicture::set() const { return *impl_->set; }
Bounds VoxelPicture::box() const { return impl_->box; }

Result<VoxelPicture> VoxelPicture::create(std::shared_ptr<const VoxelIntervals> set, VoxelLook look,
                                          const Execution& execution) try {
  if (!set) return fail(ErrorCode::kUsage, "a picture needs a set of voxels");
  auto blocks = OccupiedBlocks::make(*set, execution);
  if (!blocks) return tl::unexpected(blocks.error());
  auto impl = std::make_unique<Impl>();
  impl->set = std::move(set);
  impl->look = std::move(look);
  impl->blocks = *std::move(blocks);
  const OccupiedBlocks::Box& solid = impl->blocks.box();
  const VoxelGrid& grid = impl->set->grid();
  if (solid.low.x < solid.high.x) {
    const AxisFrame frame(impl->set->axis());
    glm::ivec3 low(0), high(0);
    low[frame.u] = solid.low.x, high[frame.u] = solid.high.x;
    low[frame.v] = solid.low.y + impl->set->v_begin();
    high[frame.v] = solid.high.y + impl->set->v_begin();
    low[frame.w] = solid.low.z, high[frame.w] = solid.high.z;
    impl->box = {grid.origin + glm::dvec3(low) * grid.voxel_size,
                 grid.origin + glm::dvec3(high) * grid.voxel_size};
  }
  return VoxelPicture(std::move(impl));
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "out of memory for a picture of voxels");
}

Result<View> VoxelPicture::view(const Camera& camera, const glm::ivec2& size) const {
  return make_view(camera, size, impl_->box);
}

Result<Picture> VoxelPicture::draw(const Camera& camera, const glm::ivec2& size,
                                   const VoxelPictureOptions& options,
                                   const Execution& execution) const try {
  if (auto good = check_samples(options.samples); !good) return tl::unexpected(good.error());
  if (auto good = check_sections(options.sections); !good) return tl::unexpected(good.error());
  const auto made = view(camera, size);
  if (!made) return tl::unexpected(made.error());
  if (auto fits = check_memory(size, execution); !fits) return tl::unexpected(fits.error());
  VoxelStyle style = options.style;
  if (style == VoxelStyle::kAuto) {
    // As wide as a voxel is in the middle of the set.
    const glm::dvec3 side = impl_->set->grid().voxel_size;
    const ViewRays rays(*made, impl_->set->grid(), {});
    const glm::dvec3 middle =
        impl_->box.empty() ? camera.target : (impl_->box.low + impl_->box.high) * 0.5;
    const double away = -(made->eye_from_world * glm::dvec4(middle, 1.0)).z;
    const double pixels = std::min({side.x, side.y, side.z}) * rays.scale() /
                          (made->perspective ? std::max(away, 1e-300) : 1.0);
    style = pixels >= kBlockPixels ? VoxelStyle::kBlocks : VoxelStyle::kSmooth;
  }
  return Frame(*impl_->set, impl_->look, impl_->blocks, impl_->box, *made, options, style,
               execution)
      .draw(execution);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "out of memory for a picture of {} x {} pixels", size.x, size.y);
}

Result<Picture> VoxelPicture::draw_slice(const VoxelSlice& slice, const glm::ivec2& size,
                                         const VoxelPictureOptions& options,
                                         const Execution& execution) const try {
  if (auto good = check_samples(options.samples); !good) return tl::unexpected(good.error());
  return slice_picture(*impl_->set, impl_->look, slice, size, options, execution);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "out of memory for a picture of {} x {} pixels", size.x, size.y);
}

std::optional<VoxelPick> VoxelPicture::pick(const View& view, const glm::dvec2& at,
                                            const VoxelPictureOptions& options) const {
  const VoxelGrid& grid = impl_->set->grid();
  const ViewRays rays(view, grid, options.sections);
  const ViewRay ray = rays.at(at);
  const RayHit hit = VoxelRays(*impl_->set, impl_->blocks, rays.box())
                         .first(ray.origin, ray.direction, ray.start, ray.end);
  if (!hit.found()) return std::nullopt;
  VoxelPick pick{hit.voxel, hit.face / 2, hit.face % 2 != 0 ? 1 : -1, -1, hit.label, hit.t, {}};
  if (hit.face >= RayHit::kSection) {
    pick.axis = -1;
    pick.section = hit.face - RayHit::kSection;
  }
  pick.point = grid.origin + (ray.origin + ray.direction * hit.t) * grid.voxel_size;
  return pick;
}

double VoxelPicture::solid_length(const View& view, const glm::dvec2& at,
                                  const VoxelPictureOptions& options) const {
  const VoxelGrid& grid = impl_->set->grid();
  const ViewRays rays(view, grid, options.sections);
  const ViewRay ray = rays.at(at);
  return VoxelRays(*impl_->set, impl_->blocks, rays.box())
             .solid_length(ray.origin, ray.direction, ray.start, ray.end) *
         glm::length(ray.direction * grid.voxel_size);
}

Rgba VoxelPicture::colour(std::uint32_t label) const {
  return label_colour(impl_->look, impl_->set->has_labels(), label);
}

}  // namespace strata
