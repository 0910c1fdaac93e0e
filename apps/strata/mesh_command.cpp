#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "apps/commands/choice_words.h"
#include "apps/session/file_conflicts.h"
#include "apps/session/session.h"
#include "apps/strata/allocation_failures.h"
#include "apps/strata/library_session.h"
#include "apps/strata/mesh_parts.h"
#include "apps/strata/mesh_report.h"
#include "apps/strata/run_commands.h"
#include "core/atomic_file.h"
#include "core/printable.h"
#include "strata/csg/input/scene_input.h"
#include "strata/csg/input/solid_input.h"
#include "strata/csg/solid_lists.h"
#include "strata/mesh/check/mesh_check.h"
#include "strata/voxelize/grid_fit.h"
#include "voxelize/open/lost_walls.h"

namespace strata::apps {
namespace {

/// Refuses what would be found out only after the work.
Result<void> check_output(const MeshCommand& command) {
  const bool binary = command.format != SolidFormat::kObj && command.format != SolidFormat::kOff;
  if (command.output == "-" && binary && isatty(STDOUT_FILENO) != 0) {
    return fail(ErrorCode::kUsage, "standard output is a terminal, but {} files are binary",
                solid_format_name(command.format));
  }
  for (const std::string* path : {&command.output, &command.materials}) {
    if (path->empty() || is_stream(*path)) continue;
    if (auto file = AtomicFile::create(*path); !file) return tl::unexpected(file.error());
  }
  return {};
}

/// Colours for parts that have none: hues a golden section of the circle apart, so that no two of
/// the first parts look alike.
void colour_parts(SolidMesh& mesh) {
  constexpr double kGoldenSection = 0.6180339887498949;
  for (std::size_t part = 0; part < mesh.parts.size(); ++part) {
    if (mesh.parts[part].colour) continue;
    const double turn = std::fmod(static_cast<double>(part) * kGoldenSection, 1.0);
    glm::vec4 colour(1.0f);
    for (int k = 0; k < 3; ++k) {
      // A hue's red, green and blue rise and fall in turn; two thirds of them, on a light ground.
      const double phase = std::fmod(6.0 * turn + 4.0 * k, 6.0);
      const double share = std::clamp(std::abs(phase - 3.0) - 1.0, 0.0, 1.0);
      colour[k] = static_cast<float>(1.0 / 3.0 + 2.0 / 3.0 * share);
    }
    mesh.parts[part].colour = colour;
  }
}

/// Tells which holes were closed.
void warn_of_caps(const csg::BoundaryReport& report, const csg::Tree& tree, Session& session) {
  struct Holes {
    std::uint64_t count = 0, edges = 0;
    double area = 0.0;
  };
  std::map<std::uint32_t, Holes> solids;
  for (const csg::BoundaryCap& cap : report.caps) {
    Holes& holes = solids[cap.solid];
    ++holes.count;
    holes.edges += cap.edges;
    holes.area += cap.area;
  }
  for (const auto& [solid, holes] : solids) {
    session.warn("open",
                 fmt::format("{}: {} with {} closed by caps of {:.3g} square units; --open fail "
                             "refuses, --method contour -r N lets winding numbers decide",
                             tree.solids()[solid].name, counted(holes.count, "hole"),
                             counted(holes.edges, "edge"), holes.area));
  }
}

std::optional<std::uint64_t> size_of_output(const MeshCommand& command, const Session& session) {
  struct stat status {};
  if (command.output == "-" || stat(session.place_of(command.output).c_str(), &status) != 0 ||
      !S_ISREG(status.st_mode)) {
    return std::nullopt;
  }
  return static_cast<std::uint64_t>(status.st_size);
}

class MeshRun {
 public:
  MeshRun(const MeshCommand& command, Session& session) : command_(command), session_(session) {}

  Result<void> run() {
    if (auto done = check_output(command_); !done) return done;
    auto made = command_.method == MeshMethod::kExact ? make_exact() : make_contour();
    if (!made) return made;
    if (auto strict = session_.check_strict(); !strict) return strict;
    outcome_.box = box_of(outcome_.mesh);
    if (auto done = write(); !done) return done;
    return report();
  }

 private:
  static Bounds box_of(const SolidMesh& mesh) {
    Bounds box;
    for (const glm::dvec3& p : mesh.positions) box.include(p);
    return box;
  }
  Result<void> make_exact();
  Result<void> make_contour();
  Result<void> warn_of_lost_walls(const csg::SolidInput& input, const ContourOptions& options);
  Result<void> write();
  Result<void> report();

  const MeshCommand& command_;
  Session& session_;
  MeshOutcome outcome_;
};

Result<void> MeshRun::make_exact() {
  csg::SceneInput input = command_.input;
  input.attributes = command_.boundary.parts != csg::BoundaryParts::kOne;
  std::vector<csg::InputFacts> facts;
  auto scene = csg::load_scene(input, messages_of(session_), session_.execution("reading", 0.3),
                               input.attributes ? &facts : nullptr);
  if (!scene) return tl::unexpected(scene.error());
  if (auto strict = session_.check_strict(); !strict) return strict;
  outcome_.read_ms = session_.milliseconds();
  const csg::Tree& tree = scene->tree;
  outcome_.flat = scene->flat;
  outcome_.solids = tree.solids().size();
  outcome_.nodes = tree.nodes().size();
  for (const csg::Solid& solid : tree.solids()) {
    outcome_.names.push_back(solid.name);
    if (solid.mesh) outcome_.triangles += solid.mesh->triangles.size();
  }
  const auto faces =
      face_parts(tree, facts, command_.boundary.parts, session_, session_.execution("colours"));
  if (!faces) return tl::unexpected(faces.error());
  facts = {};
  if (auto strict = session_.check_strict(); !strict) return strict;
  auto made = csg::boundary_mesh(tree, tree.root(), command_.boundary, *faces,
                                 session_.execution("meshing", 0.8));
  if (!made) return tl::unexpected(made.error());
  outcome_.mesh = std::move(made->mesh);
  outcome_.boundary = std::move(made->report);
  outcome_.mesh_ms = session_.milliseconds() - outcome_.read_ms;
  warn_of_caps(*outcome_.boundary, tree, session_);
  if (outcome_.boundary->coarsened > 0) {
    session_.warn(
        "coarse",
        fmt::format("solids reach far beyond the result, so the lattice has {} less: its "
                    "steps are {:.3g} units",
                    counted(static_cast<std::uint64_t>(outcome_.boundary->coarsened), "bit"),
                    outcome_.boundary->step));
  }
  if (scene->flat) {
    session_.warn("flat", fmt::format("{}: the scene is flat; its outlines are slabs with z from "
                                      "-0.5 to 0.5",
                                      command_.input.files.front()));
  }
  if (command_.boundary.parts == csg::BoundaryParts::kSolids) colour_parts(outcome_.mesh);
  return {};
}

/// What --open says of meshes that are not closed.
Result<void> check_open(const MeshCommand& command, const csg::SolidInput& input,
                        Session& session) {
  if (input.closed) return {};
  const auto file = std::find_if(input.files.begin(), input.files.end(),
                                 [](const csg::InputFacts& facts) { return !facts.open.empty(); });
  if (file == input.files.end()) return {};
  if (command.open == OpenMode::kFail) {
    return fail(ErrorCode::kGeometry, "{} (--open fail)", file->open);
  }
  if (input.tree) {
    session.warn("open",
                 fmt::format("{}: scenes and expressions do not use winding numbers: each ray "
                             "pairs the faces it meets",
                             file->path));
  }
  return {};
}

/// Tells of walls that lie between voxel centres, as `strata voxelize` does.
Result<void> MeshRun::warn_of_lost_walls(const csg::SolidInput& input,
                                         const ContourOptions& options) {
  LostWallOptions search;
  search.rule = options.rule;
  search.filter = options.filter;
  if (!input.has_scene()) search.longest_edge = input.longest_edge;
  if (input.tree) {
    search.taken_away = [&](std::uint32_t t) { return input.tree->is_subtracted(t); };
  }
  const auto lost = find_lost_walls(input.soup, outcome_.grid, search, session_.execution("walls"));
  if (!lost) return tl::unexpected(lost.error());
  if (lost->count == 0) return {};
  session_.warn("thin", fmt::format("{} thinner than a voxel fell between voxel centres; {} {:.3g} "
                                    "voxels thick; a larger -r keeps more of them",
                                    counted(lost->count, "wall"),
                                    lost->count == 1 ? "it is" : "the largest is",
                                    lost->largest.front().thickness));
  return {};
}

/// The floats of an STL may make triangles of a contour meet: its vertices are only a lattice
/// apart.
Result<void> check_floats(const MeshCommand& command, SolidMesh& mesh, const Execution& execution) {
  for (glm::dvec3& p : mesh.positions) {
    for (int k = 0; k < 3; ++k) {
      const volatile float rounded =
          static_cast<float>(p[k]);  // else g++ 12 leaves the rounding out
      p[k] = rounded;
    }
  }
  const auto checked = check_mesh(mesh.positions, mesh.triangles, execution);
  if (!checked) return tl::unexpected(checked.error());
  const std::uint64_t wrong = checked->meeting_pairs() + checked->degenerate + checked->duplicates;
  if (wrong == 0) return {};
  return fail(ErrorCode::kGeometry,
              "{}: at the floats of an STL {} of triangles meet or have no area; 3mf and ply hold "
              "doubles, and a smaller -r leaves more room",
              command.output, counted(wrong, "pair"));
}

Result<void> MeshRun::make_contour() {
  auto input = csg::load_solids(command_.input, false, messages_of(session_),
                                session_.execution("reading", 0.3));
  if (!input) return tl::unexpected(input.error());
  if (auto valid = check_open(command_, *input, session_); !valid) return valid;
  if (auto strict = session_.check_strict(); !strict) return strict;
  outcome_.read_ms = session_.milliseconds();
  outcome_.triangles = input->soup.triangles.size();
  outcome_.solids = input->scene ? input->scene->solids().size() : input->files.size();
  outcome_.nodes = input->scene ? input->scene->nodes().size() : outcome_.solids;
  const auto grid = fit_input_grid(input->bounds, command_.grid, command_.input.files.front());
  if (!grid) return tl::unexpected(grid.error());
  outcome_.grid = *grid;
  if (auto fitted = input->fit(*grid, session_.execution("fitting", 0.1)); !fitted) return fitted;
  ContourOptions options;
  options.open = command_.open;
  options.rule = input->rule;
  options.closedness = input->closed ? Closedness::kAssumeClosed : Closedness::kAssumeOpen;
  if (input->tree) {  // its filter makes closed lists, and knows the solids' rules
    options.filter = &input->tree->unlabelled_filter();
    options.closedness = Closedness::kAssumeClosed;
    options.rule = InsideRule::kWinding;
  }
  auto made = contour(input->soup, *grid, options, session_.execution("meshing", 0.8));
  if (!made) return tl::unexpected(made.error());
  outcome_.mesh = std::move(made->mesh);
  outcome_.contour = made->report;
  if (command_.format == SolidFormat::kStl) {
    auto sound = check_floats(command_, outcome_.mesh, session_.execution("checking", 0.5));
    if (!sound) return sound;
  }
  outcome_.mesh_ms = session_.milliseconds() - outcome_.read_ms;
  return input->closed ? warn_of_lost_walls(*input, options) : Result<void>();
}

Result<void> MeshRun::write() {
  if (command_.output.empty()) return {};
  if (outcome_.mesh.triangles.empty()) {
    return fail(ErrorCode::kGeometry, "{}: the result is empty, so there is no mesh to write",
                command_.input.files.front());
  }
  const double begin = session_.milliseconds();
  SolidWriteOptions options;
  options.format = command_.format;
  options.unit = unit_of_output(command_.input);
  options.materials = command_.materials;
  auto written =
      write_solid(command_.output, outcome_.mesh, options, session_.execution("writing", 1.0));
  if (!written) return written;
  outcome_.output_bytes = size_of_output(command_, session_);
  outcome_.write_ms = session_.milliseconds() - begin;
  return {};
}

Result<void> MeshRun::report() {
  session_.end_progress();
  // The texts are made before the outputs get their names: a run that lacks memory leaves none.
  const std::string text = mesh_text(command_, outcome_);
  const std::string json = command_.json ? mesh_json(command_, outcome_, session_) : "";
  const bool to_file = command_.json && *command_.json != "-";
  if (to_file) {
    if (auto done = print_report(json, *command_.json, false); !done) return done;
  }
  if (auto done = commit_outputs(session_); !done) return done;
  if (!command_.common.quiet) {
    if (auto done = print_report(text, "-", true); !done) return done;
  }
  if (!command_.json || to_file) return {};
  return print_report(json, "-", command_.output == "-");
}

}  // namespace

Result<void> run_mesh(const MeshCommand& command, Session& session) {
  return MeshRun(command, session).run();
}

}  // namespace strata::apps
