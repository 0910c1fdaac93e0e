#include "apps/view/scene/voxel_renderer.h"

#include <chrono>
#include <utility>

#include "voxelize/picture/slice_place.h"

namespace strata::view {
namespace {

using Clock = std::chrono::steady_clock;
double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

VoxelPictureOptions options_of(const FrameRequest& request) {
  VoxelPictureOptions options;
  options.style = request.what->voxel_looks.style;
  options.samples = request.look.samples;
  const csg::ColourScheme& scheme =
      request.look.scheme != nullptr ? *request.look.scheme : csg::default_scheme();
  options.background = csg::Rgba(scheme.background, 255);
  if (const auto& section = request.what->section) {
    options.sections.push_back({section->normal, section->offset});
  }
  return options;
}

}  // namespace

Result<void> VoxelRenderer::prepare(const FrameRequest& request, const Execution& execution) {
  const std::optional<float> threshold = request.what->voxel_looks.threshold;
  if (picture_ && scene_ == request.what->voxels && threshold_ == threshold) return {};
  picture_.reset();
  scene_ = request.what->voxels;
  threshold_ = threshold;
  Execution whole = execution;
  whole.stop = {};  // half of it would be of no use
  whole.progress = {};
  const VoxelVolume& volume = scene_->volume();
  VoxelLook look;
  look.colours.assign(volume.colours.begin(), volume.colours.end());
  look.distances = volume.kind == VoxelKind::kDistances;
  if (!volume.values.empty()) {
    look.value = [values = &volume.values](const glm::ivec3& at) {
      return values->value(at.x, at.y, at.z);
    };
  }
  auto made = VoxelPicture::create(scene_->solid(threshold, whole), std::move(look), whole);
  if (!made) return tl::unexpected(made.error());
  picture_.emplace(*std::move(made));
  box_ = solid_box(picture_->set());
  return {};
}

Result<Frame> VoxelRenderer::draw(const FrameRequest& request, const Execution& execution) {
  Frame frame;
  frame.number = request.number;
  frame.camera = request.camera;
  frame.wanted = request.size;
  frame.samples = request.look.samples;
  frame.drawn_by = "CPU, voxels";
  const auto begin = Clock::now();
  if (auto done = prepare(request, execution); !done) return tl::unexpected(done.error());
  frame.prepare_ms = ms_since(begin);
  frame.box = box_;
  const auto prepared = Clock::now();
  const auto& slice = request.what->voxel_looks.slice;
  auto picture = slice
                     ? picture_->draw_slice(*slice, request.size, options_of(request), execution)
                     : picture_->draw(request.camera, request.size, options_of(request), execution);
  if (!picture) return tl::unexpected(picture.error());
  frame.picture = *std::move(picture);
  const csg::Rgba ground = options_of(request).background;
  for (const csg::Rgba& pixel : frame.picture.pixels) {
    frame.report.covered += pixel != ground ? 1 : 0;
  }
  frame.draw_ms = ms_since(prepared);
  return frame;
}

Result<Picked> VoxelRenderer::pick(const FrameRequest& request, const glm::ivec2& pixel,
                                   const Execution& execution) {
  Picked picked;
  picked.pixel = pixel;
  if (request.probe) {
    return fail(ErrorCode::kUsage, "faces are measured in meshes and scenes; pick voxels instead");
  }
  if (auto done = prepare(request, execution); !done) return tl::unexpected(done.error());
  const VoxelGrid& grid = scene_->volume().grid();
  const glm::dvec2 middle = glm::dvec2(pixel) + 0.5;
  if (const auto& slice = request.what->voxel_looks.slice) {
    const SlicePlace place(grid, *slice, request.size);
    const glm::dvec2 at = place.voxels(middle);
    if (!place.holds(at)) return picked;
    const glm::ivec3 voxel = place.voxel(static_cast<int>(at.x), static_cast<int>(at.y));
    picked.hit = true;
    picked.where = grid.origin + (glm::dvec3(voxel) + 0.5) * grid.voxel_size;
    const std::uint32_t label = picture_->set().label(voxel.x, voxel.y, voxel.z).value_or(0);
    picked.what = scene_->describe(voxel, label) + (label != 0 ? ", solid" : ", empty");
    return picked;
  }
  const auto view = picture_->view(request.camera, request.size);
  if (!view) return tl::unexpected(view.error());
  const auto hit = picture_->pick(*view, middle, options_of(request));
  if (!hit) return picked;
  picked.hit = true;
  picked.where = hit->point;
  picked.distance = hit->distance;
  picked.cut = hit->axis < 0;
  picked.what = scene_->describe(hit->voxel, hit->label);
  return picked;
}

}  // namespace strata::view
