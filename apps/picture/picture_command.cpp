// `strata picture`

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vector_relational.hpp>
#include <memory>
#include <utility>

#include "apps/commands/film_options.h"
#include "apps/session/session.h"
#include "apps/strata/run_commands.h"
#include "apps/strata/scene_camera.h"
#include "strata/csg/input/scene_input.h"
#include "strata/csg/picture/picture.h"
#include "strata/picture/animation.h"
#include "strata/picture/backdrop.h"
#include "strata/picture/pixels.h"
#include "strata/raster/camera_file.h"
#include "strata/voxelize/picture/voxel_picture.h"
#include "strata/voxelize/readers/read_voxels.h"
#include "strata/voxelize/volume/voxel_volume.h"

namespace strata::apps {
namespace {

/// The plane of voxels that --slice means. Indices are those of the file.
Result<VoxelSlice> slice_of(const PictureCommand::Slice& asked, const VoxelGrid& grid,
                            const glm::ivec3& first_index, const std::string& file) {
  const int axis = static_cast<int>(asked.axis);
  if (asked.by_index) {
    const double first = first_index[axis], last = first + grid.dims[axis] - 1;
    if (asked.at >= first && asked.at <= last) {
      return VoxelSlice{asked.axis, static_cast<int>(asked.at - first)};
    }
    return fail(ErrorCode::kUsage, "--slice {0}={1}: {2} has voxels {0}={3} to {0}={4}",
                "ijk"[axis], asked.at, file, first, last);
  }
  const double low = grid.origin[axis], side = grid.voxel_size[axis];
  const double index = std::floor((asked.at - low) / side);
  if (index >= 0 && index < grid.dims[axis]) {
    return VoxelSlice{asked.axis, static_cast<int>(index)};
  }
  return fail(ErrorCode::kUsage,
              "--slice {0}={1}: the voxels of {2} lie from {0}={3:.6g} to {4:.6g}", "xyz"[axis],
              asked.at, file, low, low + grid.dims[axis] * side);
}

/// A picture of a file of voxels.
class VoxelRun {
 public:
  VoxelRun(const PictureCommand& command, Session& session)
      : command_(command), session_(session) {}

  Result<void> run() {
    auto volume = read_voxels(file(), command_.reading, session_.execution("reading"));
    if (!volume) return tl::unexpected(volume.error());
    for (const std::string& note : volume->notes) session_.note(note);
    first_index_ = volume->first_index;
    if (auto done = prepare(*std::move(volume)); !done) return done;
    if (writes_film(command_)) return film();
    auto picture = command_.slice ? slice() : view(placed_camera());
    if (!picture) return tl::unexpected(picture.error());
    session_.end_progress();
    return write_png(*picture, command_.output, {.threads = session_.threads()});
  }

 private:
  [[nodiscard]] const std::string& file() const { return command_.input.files.front(); }

  Result<void> prepare(VoxelVolume volume) {
    VoxelLook look;
    look.source = command_.colours;
    look.colours.assign(volume.colours.begin(), volume.colours.end());
    look.distances = volume.kind == VoxelKind::kDistances;
    if (!volume.values.empty()) {
      const auto values = std::make_shared<const ScalarField>(std::move(volume.values));
      look.value = [values](const glm::ivec3& at) { return values->value(at.x, at.y, at.z); };
    }
    auto made = VoxelPicture::create(std::make_shared<const VoxelIntervals>(std::move(volume.set)),
                                     std::move(look), session_.execution("preparing", 0.2));
    if (!made) return tl::unexpected(made.error());
    drawing_.emplace(*std::move(made));
    return {};
  }

  /// What the options of a scene say for voxels.
  [[nodiscard]] VoxelPictureOptions options() const {
    VoxelPictureOptions options;
    options.style = command_.style;
    options.samples = command_.picture.samples;
    options.background = Rgba(0);  // the backdrop is laid under the picture
    return options;
  }
  [[nodiscard]] Result<Picture> on_backdrop(Result<Picture> picture) const {
    if (!picture) return picture;
    const csg::ColourScheme* scheme = command_.picture.scheme;
    const Backdrop usual =
        plain_backdrop((scheme != nullptr ? *scheme : csg::default_scheme()).background);
    lay_over(*picture, command_.picture.backdrop.value_or(usual));
    return picture;
  }

  Result<Picture> slice() {
    const auto plane = slice_of(*command_.slice, drawing_->set().grid(), first_index_, file());
    if (!plane) return tl::unexpected(plane.error());
    return on_backdrop(
        drawing_->draw_slice(*plane, command_.size, options(), session_.execution("drawing", 1)));
  }

  /// What sections between voxels leave of the box of the solid voxels.
  [[nodiscard]] Bounds kept_box(const Camera& camera) const {
    Bounds box = drawing_->box();
    for (const csg::SectionPlane& cut : command_.cuts) {
      const csg::SectionPlane plane = csg::facing(cut, camera);
      for (int axis = 0; axis < 3 && !box.empty(); ++axis) {
        if (std::abs(plane.normal[axis]) != 1.0) continue;
        double& side = plane.normal[axis] > 0 ? box.high[axis] : box.low[axis];
        const double at = plane.offset * plane.normal[axis];
        if (at > box.low[axis] && at < box.high[axis]) side = at;
      }
    }
    return box;
  }

  [[nodiscard]] Camera placed_camera() const {
    Camera camera = command_.camera;
    const Bounds box = drawing_->box();
    const double aspect = static_cast<double>(command_.size.x) / command_.size.y;
    if (command_.default_camera && !command_.asked_view) {
      // The box of all turns of a turntable is that of a ball.
      if (command_.turntable > 0) {
        centre_camera(camera, box);
        fit_camera(camera, box, aspect);
      } else {
        frame_camera(camera, kept_box(camera), aspect);
      }
      return camera;
    }
    if (command_.auto_centre) centre_camera(camera, box);
    if (command_.view_all) fit_camera(camera, box, aspect);
    if (!(camera.distance > 0)) camera.distance = Camera{}.distance;
    return camera;
  }

  /// --turntable and --frames
  Result<void> film() {
    const int count = command_.turntable + command_.path_frames;
    const auto& backdrop = command_.picture.backdrop;
    auto film = create_animation(
        command_.output,
        {count, command_.fps, backdrop && backdrop->transparent(), session_.threads()});
    if (!film) return tl::unexpected(film.error());
    const Camera first = placed_camera();
    for (int shot = 0; shot < count; ++shot) {
      Camera camera = first;
      if (command_.turntable > 0) {
        camera = turned_camera(first, shot, count);
      } else {
        const double begin = command_.path.front().time, end = command_.path.back().time;
        camera = camera_at(command_.path, begin + (end - begin) * shot / std::max(1, count - 1));
      }
      auto picture = view(camera);
      if (!picture) return tl::unexpected(picture.error());
      if (auto done = (*film)->add(*picture); !done) return done;
    }
    session_.end_progress();
    return (*film)->finish();
  }

  /// Whether one section alone keeps nothing of the box.
  [[nodiscard]] bool all_cut(const std::vector<VoxelSection>& sections) const {
    const Bounds box = drawing_->box();
    return std::any_of(sections.begin(), sections.end(), [&](const VoxelSection& section) {
      const glm::dvec3 least =
          glm::mix(box.low, box.high, glm::lessThan(section.normal, glm::dvec3(0.0)));
      return glm::dot(section.normal, least) >= section.offset;
    });
  }

  Result<Picture> view(const Camera& camera) {
    if (drawing_->box().empty()) {
      session_.warn("empty", fmt::format("{}: the picture is empty: no voxel is solid", file()));
      if (auto strict = session_.check_strict(); !strict) return tl::unexpected(strict.error());
    }
    VoxelPictureOptions drawn = options();
    for (const csg::SectionPlane& cut : command_.cuts) {
      const csg::SectionPlane plane = csg::facing(cut, camera);
      drawn.sections.push_back({plane.normal, plane.offset});
    }
    if (!drawing_->box().empty() && all_cut(drawn.sections)) {
      session_.warn("empty", fmt::format("{}: the picture is empty: --cut takes all away", file()));
      if (auto strict = session_.check_strict(); !strict) return tl::unexpected(strict.error());
    }
    return on_backdrop(
        drawing_->draw(camera, command_.size, drawn, session_.execution("drawing", 0.5)));
  }

  const PictureCommand& command_;
  Session& session_;
  glm::ivec3 first_index_{0};
  std::optional<VoxelPicture> drawing_;
};

}  // namespace

Result<void> run_picture(const PictureCommand& command, Session& session) {
  return VoxelRun(command, session).run();
}

}  // namespace strata::apps
