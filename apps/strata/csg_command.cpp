#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "apps/session/file_conflicts.h"
#include "apps/session/session.h"
#include "apps/strata/allocation_failures.h"
#include "apps/strata/commands.h"
#include "apps/strata/csg_report.h"
#include "apps/strata/csg_scene.h"
#include "apps/strata/file_uses.h"
#include "apps/strata/gpu.h"
#include "csg/measure/result_bounds.h"
#include "strata/csg/picture/picture.h"
#include "strata/csg/picture/write_depth.h"

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
void draw_outlines(csg::Picture& picture, const csg::Rgba& background) {
  const csg::Picture drawn = picture;
  const auto at = [&](int u, int v) -> const csg::Rgba& {
    return drawn.pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(drawn.width) +
                        static_cast<std::size_t>(u)];
  };
  for (int v = 0; v < drawn.height; ++v) {
    for (int u = 0; u < drawn.width; ++u) {
      const bool inside = at(u, v) != background;
      const bool border = (u > 0 && (at(u - 1, v) != background) != inside) ||
                          (v > 0 && (at(u, v - 1) != background) != inside);
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

/// Where the camera stands before it is fitted: as the command says, else as the scene does.
csg::Camera placed_camera(CsgCommand& command, const csg::Scene& scene, Session& session) {
  csg::Camera camera = command.camera;
  if (!command.default_camera || !scene.view) return camera;
  const csg::SceneView& view = *scene.view;
  camera.target = view.target.value_or(camera.target);
  camera.rotation = view.rotation.value_or(camera.rotation);
  camera.distance = view.distance.value_or(camera.distance);
  camera.field_of_view = view.field_of_view.value_or(camera.field_of_view);
  if (command.asked_view) {
    session.warn("ignored", fmt::format("{}: the file sets $vpr, $vpt, $vpd or $vpf, so --view-all "
                                        "and --auto-center have no effect",
                                        command.input.files.front()));
  }
  command.default_camera = command.view_all = command.auto_centre = false;
  return camera;
}

csg::MeasureOptions measure_options(const CsgCommand& command, const csg::Scene& scene) {
  return {command.measure_resolution, scene.relative_precision};
}

/// The report of a run that makes no picture.
Result<void> run_report(const CsgCommand& command, csg::Scene& scene, CsgOutcome& outcome,
                        Session& session) {
  cut_scene(scene, command.cuts, outcome.camera);
  auto measures = csg::measure(scene.tree, scene.tree.root(), measure_options(command, scene),
                               session.execution("measuring", 1.0));
  if (!measures) return tl::unexpected(with_limit(std::move(measures.error()), session));
  outcome.measures = *measures;
  session.end_progress();
  return print_report(csg_text(command, outcome), "-", false);
}

/// `a.png` becomes `a00012.png`, as openscad numbers them.
std::string numbered(const std::string& path, int frame) {
  if (path.empty()) return path;
  const std::filesystem::path name(path);
  return (name.parent_path() /
          fmt::format("{}{:05}{}", name.stem().string(), frame, name.extension().string()))
      .string();
}

Result<void> run_one(CsgCommand command, Session& session);

}  // namespace

Result<void> run_csg(const CsgCommand& command, Session& session) {
  if (command.frames == 0) return run_one(command, session);
  for (int frame = 0; frame < command.frames; ++frame) {
    CsgCommand one = command;
    for (std::string* path : {&one.output, &one.ids, &one.depth}) *path = numbered(*path, frame);
    one.input.scene.openscad_options.insert(
        one.input.scene.openscad_options.end(),
        {"-D", fmt::format("$t={}", static_cast<double>(frame) / command.frames)});
    const std::vector<FileUse> written = outputs_of(one);
    if (auto kept = check_files(inputs_of(one.input), written); !kept) return kept;
    session.set_outputs(written, true);
    if (auto done = run_one(std::move(one), session); !done) return done;
  }
  return {};
}

namespace {

Result<void> run_one(CsgCommand command, Session& session) {
  CsgOutcome outcome;
  auto scene = load_scene(command, session);
  if (!scene) return tl::unexpected(scene.error());
  if (auto strict = session.check_strict(); !strict) return strict;
  outcome.read_ms = session.milliseconds();
  outcome.flat = scene->flat;
  outcome.solids = scene->tree.solids().size();
  outcome.nodes = scene->tree.nodes().size();
  outcome.triangles = triangles_of(scene->tree);

  csg::Camera& camera = outcome.camera;
  camera = placed_camera(command, *scene, session);
  if (auto strict = session.check_strict(); !strict) return strict;
  csg::PictureOptions look = command.picture;
  csg::ColourScheme flat_scheme;
  const bool from_above = command.render && scene->flat;
  if (command.render) forget_looks(*scene);
  if (from_above) {
    flat_scheme = look.scheme != nullptr ? *look.scheme : csg::colour_schemes().front();
    flat_scheme.face = kFlatFace;
    look.scheme = &flat_scheme;
    if (command.default_camera) {
      camera.rotation = glm::dvec3(0.0);
      camera.projection = csg::Projection::kOrthographic;
    }
  }
  Bounds box;
  if (command.auto_centre || command.view_all) {
    auto visible = visible_box(*scene, session.execution("measuring"));
    if (!visible) return tl::unexpected(visible.error());
    box = *visible;
    if (from_above && !box.empty()) box.low.z = box.high.z = 0.0;  // an outline has no thickness
  }
  if (command.auto_centre) csg::centre_camera(camera, box);
  if (command.view_all) {
    csg::fit_camera(camera, box, static_cast<double>(command.size.x) / command.size.y);
    if (!(camera.distance > 0)) camera.distance = csg::Camera{}.distance;  // nothing to fit
  }
  if (!std::isfinite(camera.distance)) {
    return fail(ErrorCode::kGeometry,
                "the scene reaches from ({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g}); "
                "these coordinates are too large for a picture",
                box.low.x, box.low.y, box.low.z, box.high.x, box.high.y, box.high.z);
  }
  const bool pictures = !command.output.empty() || !command.ids.empty() || !command.depth.empty();
  if (!pictures && !command.json) return run_report(command, *scene, outcome, session);
  cut_scene(*scene, command.cuts, camera);
  const auto gpu = Gpu::open(command.backend, session);
  if (!gpu) return tl::unexpected(gpu.error());
  const bool measures = command.json || command.summary;
  const bool more = measures || !command.ids.empty() || !command.depth.empty();
  const Execution execution = session.execution("drawing", more ? 0.6 : 1.0);
  std::vector<csg::Ghost> ghosts = ghosts_of(*scene);
  const csg::Tree::NodeId result = scene->tree.root();
  if (!scene->shown.empty()) {
    scene->tree.set_root(scene->tree.add(csg::Operation::kUnion, scene->shown));
  }
  csg::Preview preview(std::move(scene->tree), std::move(ghosts), scene->relative_precision,
                       execution);
  if (*gpu) {
    const auto surfaces = (*gpu)->surfaces();
    if (!surfaces) return tl::unexpected(surfaces.error());
    preview.set_source(*surfaces);
  }
  outcome.prepare_ms = session.milliseconds() - outcome.read_ms;

  double begin = session.milliseconds();
  const bool may_fall_back = *gpu && command.backend == Backend::kAuto;
  auto picture = drawn(preview, may_fall_back, session,
                       [&] { return preview.picture(camera, command.size, look, execution); });
  if (!picture) return tl::unexpected(picture.error());
  if (from_above) {
    const glm::u8vec3 ground = look.scheme->background;
    draw_outlines(*picture, {ground, look.transparent_background ? 0 : 255});
  }
  outcome.drawn = preview.report();
  outcome.draw_ms = session.milliseconds() - begin;
  if (outcome.drawn.covered == 0) {
    if (box.empty()) {
      const csg::Tree& tree = preview.tree();
      auto bounds = csg::result_bounds(tree, tree.root(), 0, session.execution("measuring"));
      if (bounds) box = *bounds;
    }
    session.warn("empty", why_empty(command, preview, box, session));
    if (auto strict = session.check_strict(); !strict) return strict;
  }
  session.note(fmt::format("{}, {}, {} of {} covered", counted(outcome.solids, "solid"),
                           counted(outcome.drawn.fragments, "crossing"), outcome.drawn.covered,
                           counted(picture->pixels.size(), "pixel")));

  // The pictures of numbers have one sample a pixel.
  const csg::SurfaceImage* surfaces = nullptr;
  std::optional<csg::View> view;
  begin = session.milliseconds();
  if (!command.ids.empty() || !command.depth.empty()) {
    const auto made = preview.view(camera, command.size, execution);
    if (!made) return tl::unexpected(made.error());
    view = *made;
    const auto image = drawn(preview, may_fall_back, session,
                             [&] { return preview.draw(*view, session.execution("drawing")); });
    if (!image) return tl::unexpected(image.error());
    surfaces = *image;
  }
  const double numbers_ms = session.milliseconds() - begin;
  if (measures) {
    begin = session.milliseconds();
    const csg::Tree& tree = preview.tree();
    auto measured = csg::measure(tree, result, measure_options(command, *scene),
                                 session.execution("measuring"));
    if (!measured) return tl::unexpected(measured.error());
    outcome.measures = *measured;
    outcome.measure_ms = session.milliseconds() - begin;
  }
  // Nothing is written before all is known.
  begin = session.milliseconds();
  if (!command.output.empty()) {
    if (auto done = csg::write_png(*picture, command.output); !done) return done;
  }
  if (!command.depth.empty()) {
    if (auto done = csg::write_depth_exr(*surfaces, *view, command.depth); !done) return done;
  }
  if (!command.ids.empty()) {
    const csg::Picture ids = picture_of_ids(*surfaces, preview.tree(), outcome);
    if (auto done = csg::write_png(ids, command.ids); !done) return done;
  }
  outcome.write_ms = numbers_ms + session.milliseconds() - begin;
  session.end_progress();
  // The texts are made before the outputs get their names: a run that lacks memory leaves none.
  const std::string summary = command.summary ? csg_text(command, outcome) : "";
  const std::string json = command.json ? csg_json(command, outcome, session) : "";
  const bool to_file = command.json && *command.json != "-";
  if (to_file) {
    if (auto done = print_report(json, *command.json, false); !done) return done;
  }
  if (auto done = commit_outputs(session); !done) return done;
  if (command.summary) {
    const bool taken = command.output == "-" || command.json == "-";
    if (auto done = print_report(summary, "-", taken); !done) return done;
  }
  if (!command.json || to_file) return {};
  return print_report(json, *command.json, command.output == "-");
}

}  // namespace
}  // namespace strata::apps
