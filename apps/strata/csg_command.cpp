#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "apps/commands/file_uses.h"
#include "apps/commands/film_options.h"
#include "apps/session/file_conflicts.h"
#include "apps/session/session.h"
#include "apps/strata/allocation_failures.h"
#include "apps/strata/csg_report.h"
#include "apps/strata/library_session.h"
#include "apps/strata/run_commands.h"
#include "apps/strata/scene_camera.h"
#include "csg/measure/result_bounds.h"
#include "strata/csg/input/scene_input.h"
#include "strata/csg/picture/picture.h"
#include "strata/picture/animation.h"
#include "strata/raster/camera_file.h"

namespace strata::apps {
namespace {

std::vector<csg::Ghost> ghosts_of(const csg::Scene& scene) {
  std::vector<csg::Ghost> ghosts;
  for (const csg::Tree::NodeId node : scene.backgrounds) {
    ghosts.push_back({node, csg::kBackgroundGhost});
  }
  for (const csg::Tree::NodeId node : scene.highlights) {
    ghosts.push_back({node, csg::kHighlightGhost});
  }
  return ghosts;
}

/// OpenSCAD draws rendered outlines in this colour without light; ours has the light taken out.
constexpr glm::u8vec3 kFlatFace{0, 247, 199};

/// Red lines where the picture's outlines are, one pixel to each side, as OpenSCAD draws them.
void draw_outlines(csg::Picture& picture, const Backdrop& backdrop) {
  const csg::Picture drawn = picture;
  const auto covered = [&](int u, int v) {
    return drawn.pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(drawn.width) +
                        static_cast<std::size_t>(u)] != backdrop.at(v, drawn.height);
  };
  for (int v = 0; v < drawn.height; ++v) {
    for (int u = 0; u < drawn.width; ++u) {
      const bool inside = covered(u, v);
      const bool border =
          (u > 0 && covered(u - 1, v) != inside) || (v > 0 && covered(u, v - 1) != inside);
      // The line runs on the last pixel before the change and lies on both sides in turn.
      if (border) {
        picture.pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(drawn.width) +
                       static_cast<std::size_t>(u)] = {255, 0, 0, 255};
      }
    }
  }
}

/// What a rendered result does not have: ghosts and colours.
void forget_looks(csg::Scene& scene) {
  scene.backgrounds.clear();
  scene.highlights.clear();
  scene.shown.clear();
  for (csg::Solid& solid : scene.tree.solids()) solid.colour.reset();
}

std::uint64_t triangles_of(const csg::Tree& tree) {
  std::uint64_t count = 0;
  for (const csg::Solid& solid : tree.solids()) {
    if (solid.mesh) count += solid.mesh->triangles.size();
  }
  return count;
}

/// Why nothing is seen.
std::string why_empty(const CsgCommand& command, const csg::Preview& preview, const Bounds& box,
                      const Session& session) {
  const std::string& name = command.input.files.front();
  const std::string more = command.input.files.size() > 1
                               ? fmt::format(" and {} more", command.input.files.size() - 1)
                               : std::string();
  const auto because = [&](std::string_view why) {
    return fmt::format("{}{}: the picture is empty: {}", name, more, why);
  };
  if (triangles_of(preview.tree()) == 0) {
    return because(session.warnings().empty()
                       ? "there is no solid in the scene"
                       : "everything in the scene was left out, see the warnings");
  }
  if (box.empty()) {
    return because(fmt::format("the scene has {}, but its operations leave nothing",
                               counted(preview.tree().solids().size(), "solid")));
  }
  return because(fmt::format(
      "nothing is in the camera's view; the scene lies between ({:.6g}, {:.6g}, {:.6g}) and "
      "({:.6g}, {:.6g}, {:.6g}){}",
      box.low.x, box.low.y, box.low.z, box.high.x, box.high.y, box.high.z,
      command.cuts.empty() ? "" : ", before --cut"));
}

/// What ran out of memory does not know what the user can do about it.
Error with_limit(Error error, const Session& session) {
  if (error.code == ErrorCode::kLimit && error.message.find("out of memory") != std::string::npos) {
    error.message +=
        fmt::format("; the limit is {} (--memory-limit)", readable_bytes(session.memory_limit()));
  }
  return error;
}

/// Draws, and again by the CPU where the GPU fails half way and need not be the one.
template <class Draw>
auto drawn(csg::Preview& preview, bool may_fall_back, Session& session, Draw&& draw)
    -> decltype(draw()) {
  auto result = draw();
  if (!result && may_fall_back && result.error().code != ErrorCode::kCancelled) {
    preview.set_source(nullptr);
    const std::string failure = result.error().message;
    result = draw();
    if (result) {
      session.warn("backend", fmt::format("the GPU failed and the CPU did the work: {}", failure));
    }
  }
  if (!result) return tl::unexpected(with_limit(std::move(result.error()), session));
  return result;
}

/// Solids as colours; notes which are seen.
csg::Picture picture_of_ids(const csg::SurfaceImage& surfaces, const csg::Tree& tree,
                            CsgOutcome& outcome) {
  csg::Picture ids{surfaces.width, surfaces.height, {}};
  ids.pixels.resize(surfaces.depth.size(), csg::Rgba(0, 0, 0, 255));
  std::vector<bool> seen(tree.solids().size(), false);
  for (std::size_t i = 0; i < ids.pixels.size(); ++i) {
    if (surfaces.depth[i] == csg::SurfaceImage::kNone) continue;
    ids.pixels[i] = colour_of_solid(surfaces.solid[i]);
    seen[surfaces.solid[i]] = true;
  }
  for (std::uint32_t solid = 0; solid < seen.size(); ++solid) {
    if (!seen[solid]) continue;
    outcome.seen.push_back(solid);
    outcome.names.push_back(tree.solids()[solid].name);
  }
  return ids;
}

/// The work of one picture, or of one report.
class CsgRun {
 public:
  /// @param film  gets the pictures, instead of a file; borrowed; null: there is none
  CsgRun(CsgCommand command, Session& session, AnimationWriter* film = nullptr)
      : command_(std::move(command)), session_(session), film_(film), look_(command_.picture) {}

  Result<void> run() {
    if (auto done = load(); !done) return done;
    if (auto done = place_camera(); !done) return done;
    const bool pictures =
        !command_.output.empty() || !command_.ids.empty() || !command_.depth.empty();
    if (!pictures && !command_.json) return print_measures();
    if (auto done = open_preview(); !done) return done;
    if (const int shots = command_.turntable + command_.path_frames; shots > 0) {
      return draw_shots(shots);
    }
    if (auto done = draw(); !done) return done;
    if (auto done = draw_numbers(); !done) return done;
    if (auto done = measure(); !done) return done;
    // Nothing is written before all is known.
    if (auto done = write(); !done) return done;
    return report();
  }

 private:
  Result<void> load();
  void render_alone();
  Result<void> place_camera();
  Result<void> print_measures();
  Result<void> open_preview();
  Result<void> draw();
  Result<void> draw_shots(int count);
  Result<void> check_covered();
  Result<void> draw_numbers();
  Result<void> measure_tree(const csg::Tree& tree, csg::Tree::NodeId root);
  Result<void> measure();
  Result<void> write();
  Result<void> report();

  [[nodiscard]] bool draws_numbers() const {
    return !command_.ids.empty() || !command_.depth.empty();
  }
  [[nodiscard]] bool measures() const { return command_.json || command_.summary; }
  [[nodiscard]] bool may_fall_back() const { return gpu_ && command_.backend == Backend::kAuto; }
  [[nodiscard]] csg::MeasureOptions measure_options() const {
    return {command_.measure_resolution, scene_.relative_precision};
  }
  Camera& camera() { return outcome_.camera; }

  CsgCommand command_;
  Session& session_;
  AnimationWriter* film_;
  CsgOutcome outcome_;
  csg::Scene scene_;
  csg::PictureOptions look_;
  csg::ColourScheme flat_scheme_;  ///< look_'s, where a flat scene is seen from above
  bool from_above_ = false;
  Bounds box_;  ///< of what can be seen; empty: not asked for yet
  std::unique_ptr<csg::Gpu> gpu_;
  Execution drawing_;
  csg::Tree::NodeId result_ = csg::Tree::kNone;
  std::optional<csg::Preview> preview_;
  csg::Picture picture_;
  const csg::SurfaceImage* surfaces_ = nullptr;  ///< the preview's
  std::optional<View> view_;
};

Result<void> CsgRun::load() {
  auto scene =
      csg::load_scene(command_.input, messages_of(session_), session_.execution("reading"));
  if (!scene) return tl::unexpected(scene.error());
  if (auto strict = session_.check_strict(); !strict) return strict;
  scene_ = *std::move(scene);
  outcome_.read_ms = session_.milliseconds();
  outcome_.flat = scene_.flat;
  outcome_.solids = scene_.tree.solids().size();
  outcome_.nodes = scene_.tree.nodes().size();
  outcome_.triangles = triangles_of(scene_.tree);
  return {};
}

/// --render
void CsgRun::render_alone() {
  forget_looks(scene_);
  from_above_ = scene_.flat;
  if (!from_above_) return;
  flat_scheme_ = look_.scheme != nullptr ? *look_.scheme : csg::colour_schemes().front();
  flat_scheme_.face = kFlatFace;
  look_.scheme = &flat_scheme_;
  // Its outlines are drawn pixel by pixel.
  if (!command_.asked_samples) look_.samples = command_.picture.samples = 1;
  if (!command_.default_camera) return;
  command_.camera.rotation = glm::dvec3(0.0);
  command_.camera.projection = Projection::kOrthographic;
}

Result<void> CsgRun::place_camera() {
  take_scene_view(scene_, session_, command_);
  if (auto strict = session_.check_strict(); !strict) return strict;
  if (command_.render) render_alone();
  auto placed = fitted_camera(command_, scene_, from_above_, session_);
  if (!placed) return tl::unexpected(placed.error());
  camera() = placed->camera;
  box_ = placed->box;
  return {};
}

/// The report of a run that makes no picture.
Result<void> CsgRun::print_measures() {
  csg::cut_scene(scene_, command_.cuts, camera());
  if (auto done = measure_tree(scene_.tree, scene_.tree.root()); !done) return done;
  session_.end_progress();
  std::string text = csg_text(command_, outcome_);
  if (command_.alone && isatty(STDOUT_FILENO) != 0) {
    text += next_steps(command_.input.files.front());
  }
  return print_report(text, "-", false);
}

Result<void> CsgRun::open_preview() {
  csg::cut_scene(scene_, command_.cuts, camera());
  auto gpu = open_gpu(command_.backend, session_);
  if (!gpu) return tl::unexpected(gpu.error());
  gpu_ = *std::move(gpu);
  drawing_ = session_.execution("drawing", measures() || draws_numbers() ? 0.6 : 1.0);
  std::vector<csg::Ghost> ghosts = ghosts_of(scene_);
  result_ = scene_.tree.root();
  if (!scene_.shown.empty()) {
    scene_.tree.set_root(scene_.tree.add(csg::Operation::kUnion, scene_.shown));
  }
  preview_.emplace(std::move(scene_.tree), std::move(ghosts), scene_.relative_precision, drawing_);
  if (gpu_) {
    const auto surfaces = gpu_->surfaces();
    if (!surfaces) return tl::unexpected(surfaces.error());
    preview_->set_source(*surfaces);
  }
  outcome_.prepare_ms = session_.milliseconds() - outcome_.read_ms;
  return {};
}

Result<void> CsgRun::draw() {
  const double begin = session_.milliseconds();
  auto picture = drawn(*preview_, may_fall_back(), session_,
                       [&] { return preview_->picture(camera(), command_.size, look_, drawing_); });
  if (!picture) return tl::unexpected(picture.error());
  picture_ = *std::move(picture);
  if (from_above_) {
    draw_outlines(picture_, look_.backdrop.value_or(plain_backdrop(look_.scheme->background)));
  }
  outcome_.drawn = preview_->report();
  outcome_.draw_ms = session_.milliseconds() - begin;
  if (auto seen = check_covered(); !seen) return seen;
  session_.note(fmt::format("{}, {}, {} of {} covered", counted(outcome_.solids, "solid"),
                            counted(outcome_.drawn.fragments, "crossing"), outcome_.drawn.covered,
                            counted(picture_.pixels.size(), "pixel")));
  return {};
}

/// The pictures of a film of one scene.
Result<void> CsgRun::draw_shots(int count) {
  const Camera first = camera();
  for (int shot = 0; shot < count; ++shot) {
    if (command_.turntable > 0) {
      camera() = turned_camera(first, shot, count);
    } else {
      const double begin = command_.path.front().time, end = command_.path.back().time;
      camera() = camera_at(command_.path, begin + (end - begin) * shot / std::max(1, count - 1));
    }
    drawing_ = session_.execution("drawing", 1.0 / (count - shot));
    if (auto done = draw(); !done) return done;
    if (auto done = film_->add(picture_); !done) return done;
  }
  return {};
}

/// Says why nothing is seen.
Result<void> CsgRun::check_covered() {
  if (outcome_.drawn.covered > 0) return {};
  if (box_.empty()) {
    const csg::Tree& tree = preview_->tree();
    auto bounds = csg::result_bounds(tree, tree.root(), 0, session_.execution("measuring"));
    if (bounds) box_ = *bounds;
  }
  session_.warn("empty", why_empty(command_, *preview_, box_, session_));
  return session_.check_strict();
}

/// The pictures of numbers have one sample a pixel.
Result<void> CsgRun::draw_numbers() {
  if (!draws_numbers()) return {};
  const double begin = session_.milliseconds();
  const auto made = preview_->view(camera(), command_.size, drawing_);
  if (!made) return tl::unexpected(made.error());
  view_ = *made;
  const auto image = drawn(*preview_, may_fall_back(), session_,
                           [&] { return preview_->draw(*view_, session_.execution("drawing")); });
  if (!image) return tl::unexpected(image.error());
  surfaces_ = *image;
  outcome_.write_ms = session_.milliseconds() - begin;
  return {};
}

/// Measures exactly. By rays where --measure asks for them, and where exact measures cannot be had:
/// of solids that are not closed or too large.
Result<void> CsgRun::measure_tree(const csg::Tree& tree, csg::Tree::NodeId root) {
  if (command_.measure_resolution) {
    outcome_.why_not_exact = "--measure is given";
  } else {
    csg::BoundaryOptions options;
    options.open = csg::OpenSolids::kFail;
    auto exact = csg::exact_measures(tree, root, options, session_.execution("measuring"));
    if (exact && std::isfinite(exact->volume) && std::isfinite(exact->area)) {
      outcome_.exact = *std::move(exact);
      return {};
    }
    if (!exact && exact.error().code != ErrorCode::kGeometry &&
        exact.error().code != ErrorCode::kLimit) {
      return tl::unexpected(exact.error());
    }
    outcome_.why_not_exact = exact ? "the volume is too large for a double" : exact.error().message;
  }
  auto measured = csg::measure(tree, root, measure_options(), session_.execution("measuring", 1.0));
  if (!measured) return tl::unexpected(with_limit(std::move(measured.error()), session_));
  outcome_.measures = *measured;
  return {};
}

Result<void> CsgRun::measure() {
  if (!measures()) return {};
  const double begin = session_.milliseconds();
  if (auto done = measure_tree(preview_->tree(), result_); !done) return done;
  outcome_.measure_ms = session_.milliseconds() - begin;
  return {};
}

Result<void> CsgRun::write() {
  const double begin = session_.milliseconds();
  if (!command_.output.empty()) {
    auto done = film_ != nullptr ? film_->add(picture_)
                                 : csg::write_png(picture_, command_.output, drawing_);
    if (!done) return done;
  }
  if (!command_.depth.empty()) {
    if (auto done = csg::write_depth_exr(*surfaces_, *view_, command_.depth); !done) return done;
  }
  if (!command_.ids.empty()) {
    const csg::Picture ids = picture_of_ids(*surfaces_, preview_->tree(), outcome_);
    if (auto done = csg::write_png(ids, command_.ids, drawing_); !done) return done;
  }
  outcome_.write_ms += session_.milliseconds() - begin;
  return {};
}

Result<void> CsgRun::report() {
  session_.end_progress();
  // The texts are made before the outputs get their names: a run that lacks memory leaves none.
  const std::string summary = command_.summary ? csg_text(command_, outcome_) : "";
  const std::string json = command_.json ? csg_json(command_, outcome_, session_) : "";
  const bool to_file = command_.json && *command_.json != "-";
  if (to_file) {
    if (auto done = print_report(json, *command_.json, false); !done) return done;
  }
  if (auto done = commit_outputs(session_); !done) return done;
  if (command_.summary) {
    const bool taken = command_.output == "-" || command_.json == "-";
    if (auto done = print_report(summary, "-", taken); !done) return done;
  }
  if (!command_.json || to_file) return {};
  return print_report(json, *command_.json, command_.output == "-");
}

/// `a.png` becomes `a00012.png`, as openscad numbers them.
std::string numbered(const std::string& path, int frame) {
  if (path.empty()) return path;
  const std::filesystem::path name(path);
  return (name.parent_path() /
          fmt::format("{}{:05}{}", name.stem().string(), frame, name.extension().string()))
      .string();
}

/// One of the pictures of --animate.
CsgCommand at_time(const CsgCommand& command, int frame) {
  CsgCommand one = command;
  one.input.scene.openscad_options.insert(
      one.input.scene.openscad_options.end(),
      {"-D", fmt::format("$t={}", static_cast<double>(frame) / command.frames)});
  return one;
}

/// --turntable, --frames, and --animate into one file or folder.
Result<void> run_film(const CsgCommand& command, Session& session) {
  const int count = command.frames + command.turntable + command.path_frames;
  const auto& backdrop = command.picture.backdrop;
  auto film = create_animation(
      command.output, {count, command.fps, backdrop && backdrop->transparent(), session.threads()});
  if (!film) return tl::unexpected(film.error());
  if (command.frames == 0) {
    if (auto done = CsgRun(command, session, film->get()).run(); !done) return done;
  }
  for (int frame = 0; frame < command.frames; ++frame) {
    if (auto done = CsgRun(at_time(command, frame), session, film->get()).run(); !done) return done;
  }
  if (auto done = (*film)->finish(); !done) return done;
  session.end_progress();
  return commit_outputs(session);
}

}  // namespace

Result<void> run_csg(const CsgCommand& command, Session& session) {
  if (writes_film(command)) return run_film(command, session);
  if (command.frames == 0) return CsgRun(command, session).run();
  for (int frame = 0; frame < command.frames; ++frame) {
    CsgCommand one = at_time(command, frame);
    for (std::string* path : {&one.output, &one.ids, &one.depth}) *path = numbered(*path, frame);
    const std::vector<FileUse> written = outputs_of(one);
    if (auto kept = check_files(inputs_of(one.input), written); !kept) return kept;
    session.set_outputs(written, true);
    if (auto done = CsgRun(std::move(one), session).run(); !done) return done;
  }
  return {};
}

}  // namespace strata::apps
