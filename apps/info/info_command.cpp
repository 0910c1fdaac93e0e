#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>
#include <utility>

#include "apps/info/attribute_report.h"
#include "apps/info/check_report.h"
#include "apps/info/gl_info.h"
#include "apps/session/file_conflicts.h"
#include "apps/session/json_writer.h"
#include "apps/session/report.h"
#include "apps/session/session.h"
#include "apps/strata/allocation_failures.h"
#include "apps/strata/library_session.h"
#include "apps/strata/run_commands.h"
#include "core/printable.h"
#include "strata/core/file_identity.h"
#include "strata/csg/input/scene_input.h"
#include "strata/csg/input/solid_input.h"
#include "strata/csg/measure/measure.h"
#include "strata/csg/solid_lists.h"
#include "strata/mesh/diagnose.h"
#include "strata/mesh/orient.h"
#include "strata/voxelize/readers/read_voxels.h"
#include "voxelize/volume/voxel_facts.h"

namespace strata::apps {
namespace {

struct FileInfo {
  std::string path;
  MeshReadStats stats;
  MeshDiagnosis found;
  Orientation orientation;
  double world_metres = 0.0;  ///< length of the world's unit; 0: unknown
  std::string unit_doubt;     ///< as csg::unit_doubt()
  AttributeFacts attributes;
  std::optional<FileCheck> check;  ///< with --check
};

std::string info_text(const FileInfo& info) {
  const MeshDiagnosis& found = info.found;
  std::string text = printable(info.path) + "\n";
  const auto line = [&](std::string_view topic, const std::string& rest) {
    text += fmt::format("  {:<12} {}\n", topic, rest);
  };
  const auto triple = [](const glm::dvec3& v) {
    return fmt::format("({:.9g}, {:.9g}, {:.9g})", v.x + 0.0, v.y + 0.0, v.z + 0.0);  // no -0
  };
  line("format", fmt::format("{}, {} bytes", info.stats.format, info.stats.bytes));
  line("triangles", fmt::format("{} of {} faces", found.triangles, info.stats.faces));
  line("vertices",
       fmt::format("{}, {} different positions", found.vertices, found.welded_vertices));
  line("components", std::to_string(found.components));
  line("bounds", fmt::format("{} to {}", triple(found.bounds.low), triple(found.bounds.high)));
  const std::string unit =
      csg::describe_unit(info.stats.unit_metres, info.world_metres, info.unit_doubt);
  if (!unit.empty()) line("unit", unit);
  line("area", fmt::format("{:.9g}", found.area));
  line("volume", fmt::format("{:.9g}{}", found.volume, found.closed ? "" : " (the mesh is open)"));
  line("orientation", !found.closed      ? "not known: the mesh is open"
                      : found.inverted   ? "inside out"
                      : found.volume > 0 ? "outward"
                                         : "no volume");
  for (const std::string& text_of : sentences(info.orientation, false)) line("", text_of);
  if (found.closed) {
    line("closed", fmt::format("yes, all {} edges are balanced", found.edges));
  } else {
    line("closed", fmt::format("no, {} of {} edges are unbalanced ({} border a hole, {} join faces "
                               "of opposite orientation)",
                               found.unbalanced_edges, found.edges, found.boundary_edges,
                               found.misoriented_edges));
    for (const UnbalancedEdge& edge : found.examples) line("", csg::describe(edge));
    if (found.examples.size() < found.unbalanced_edges) {
      line("", fmt::format("and {} more", found.unbalanced_edges - found.examples.size()));
    }
  }
  if (found.non_manifold_edges > 0) {
    line("non-manifold",
         fmt::format("{} used more than twice", counted(found.non_manifold_edges, "edge")));
  }
  const auto defect = [&](std::uint64_t count, const char* topic, const char* what) {
    if (count > 0) line(topic, fmt::format("{} {}", counted(count, "face"), what));
  };
  defect(found.degenerate_faces + info.stats.degenerate, "degenerate", "without area");
  defect(found.duplicate_faces, "duplicate", "that repeat another");
  defect(info.stats.out_of_range, "dropped", "with an invalid vertex index");
  defect(info.stats.non_finite, "dropped", "with a coordinate that is not finite");
  defect(info.stats.too_few_vertices, "dropped", "with fewer than three vertices");
  defect(info.stats.non_planar, "non-planar", "that are non-planar polygons");
  if (info.stats.ignored > 0) {
    line("ignored", counted(info.stats.ignored, "element") + " that are not faces");
  }
  for (const auto& [topic, rest] : attribute_lines(info.attributes)) line(topic, rest);
  if (info.check) {
    for (const auto& [topic, rest] : check_lines(*info.check)) line(topic, rest);
  }
  return text;
}

void write_edge(JsonWriter& json, const UnbalancedEdge& edge) {
  json.begin_object();
  json.member("from", edge.from);
  json.member("to", edge.to);
  json.member("face", edge.element);
  json.member("forward", edge.forward);
  json.member("backward", edge.backward);
  json.end_object();
}

void write_info(JsonWriter& json, const FileInfo& info) {
  const MeshDiagnosis& found = info.found;
  json.begin_object();
  json.member("path", info.path);
  json.member("format", info.stats.format);
  json.member("bytes", info.stats.bytes);
  json.member("faces", info.stats.faces);
  json.member("triangles", found.triangles);
  json.member("vertices", found.vertices);
  json.member("welded_vertices", found.welded_vertices);
  json.member("components", found.components);
  json.key("bounds").begin_object();
  json.member("low", found.bounds.low);
  json.member("high", found.bounds.high);
  json.end_object();
  write_unit(json, info.stats.unit_metres, info.world_metres,
             csg::unit_factor(info.stats.unit_metres, info.world_metres), info.unit_doubt);
  json.member("area", found.area);
  json.member("volume", found.volume);
  json.member("closed", found.closed);
  json.member("even", found.even);
  json.member("inverted", found.inverted);
  json.key("orientation").begin_object();
  json.member("parts", info.orientation.parts);
  json.member("parts_inside_out", info.orientation.turned_parts);
  json.member("turned_triangles", info.orientation.turned_triangles);
  json.member("double_faces", info.orientation.double_faces);
  json.member("not_orientable", info.orientation.not_orientable);
  json.end_object();
  json.key("edges").begin_object();
  json.member("total", found.edges);
  json.member("unbalanced", found.unbalanced_edges);
  json.member("boundary", found.boundary_edges);
  json.member("misoriented", found.misoriented_edges);
  json.member("non_manifold", found.non_manifold_edges);
  json.key("examples").begin_array();
  for (const UnbalancedEdge& edge : found.examples) write_edge(json, edge);
  json.end_array();
  json.end_object();
  json.key("bad_faces").begin_object();
  json.member("degenerate", found.degenerate_faces + info.stats.degenerate);
  json.member("duplicate", found.duplicate_faces);
  json.member("out_of_range", info.stats.out_of_range);
  json.member("non_finite", info.stats.non_finite);
  json.member("too_few_vertices", info.stats.too_few_vertices);
  json.member("non_planar", info.stats.non_planar);
  json.member("ignored", info.stats.ignored);
  json.end_object();
  write_attributes(json, info.attributes);
  if (info.check) write_check(json, *info.check);
  json.end_object();
}

struct SceneInfo {
  std::string path;
  csg::InputFacts facts;
  std::uint64_t solids = 0, nodes = 0;
  csg::Measures result;
  std::optional<SceneCheck> check;  ///< with --check
};

std::string info_text(const SceneInfo& info) {
  std::string text = printable(info.path) + "\n";
  const auto line = [&](std::string_view topic, const std::string& rest) {
    text += fmt::format("  {:<12} {}\n", topic, rest);
  };
  const auto triple = [](const glm::dvec3& v) {
    return fmt::format("({:.9g}, {:.9g}, {:.9g})", v.x + 0.0, v.y + 0.0, v.z + 0.0);  // no -0
  };
  const csg::Measures& m = info.result;
  const auto check = [&] {
    if (!info.check) return;
    for (const auto& [topic, rest] : check_lines(*info.check)) line(topic, rest);
  };
  line("format", fmt::format("{}, {} bytes", info.facts.stats.format, info.facts.stats.bytes));
  line("solids", fmt::format("{} in {}", info.solids, counted(info.nodes, "node")));
  line("triangles", fmt::format("{} of all solids", info.facts.stats.triangles));
  if (m.empty) {
    line("result", "empty, or smaller than a voxel of the measuring grid");
    check();
    return text;
  }
  line("bounds", fmt::format("{} to {}, error at most {:.2g}", triple(m.low), triple(m.high),
                             m.bounds_error));
  line("area", fmt::format("{:.6g}, error about {:.2g}", m.area, m.area_error));
  line("volume", fmt::format("{:.6g}, error at most {:.2g}", m.volume, m.volume_error));
  line("closed", info.facts.closed ? "yes, all meshes of the result"
                                   : fmt::format("no, {}", printable(info.facts.open)));
  check();
  return text;
}

void write_info(JsonWriter& json, const SceneInfo& info) {
  const csg::Measures& m = info.result;
  json.begin_object();
  json.member("path", info.path);
  json.member("format", info.facts.stats.format);
  json.member("bytes", info.facts.stats.bytes);
  json.member("solids", info.solids);
  json.member("nodes", info.nodes);
  json.member("triangles", info.facts.stats.triangles);
  json.member("vertices", info.facts.stats.vertices);
  json.member("empty", m.empty);
  json.key("bounds").begin_object();
  json.member("low", m.low);
  json.member("high", m.high);
  json.end_object();
  json.member("bounds_error", m.bounds_error);
  json.member("area", m.area);
  json.member("area_error", m.area_error);
  json.member("volume", m.volume);
  json.member("volume_error", m.volume_error);
  json.member("closed", info.facts.closed);
  if (info.check) write_check(json, *info.check);
  json.end_object();
}

Result<SceneInfo> look_at_scene(const std::string& path, const InfoCommand& command,
                                Session& session) {
  csg::SceneInput one = command.input;
  one.files = {path};
  std::vector<csg::InputFacts> facts;
  const auto scene =
      csg::load_scene(one, messages_of(session), session.execution("reading"), &facts);
  if (!scene) return tl::unexpected(scene.error());
  Execution execution = session.execution("measuring");
  execution.progress = {};
  auto measures =
      csg::measure(scene->tree, scene->tree.root(),
                   {.resolution = {}, .relative_precision = scene->relative_precision}, execution);
  if (!measures) return tl::unexpected(measures.error());
  SceneInfo info{path,
                 std::move(facts.front()),
                 scene->tree.solids().size(),
                 scene->tree.nodes().size(),
                 *measures,
                 {}};
  if (command.common.strict && !info.facts.closed) {
    session.warn("open", fmt::format("{}: {}", path, info.facts.open));
  }
  if (command.check) {
    auto check = check_solids(scene->tree, execution);
    if (!check) {
      return fail(check.error().code, "{}: {}", printable(path), check.error().message);
    }
    info.check = std::move(*check);
    warn_of_check(path, *info.check, session);
  }
  return info;
}

/// Reads a mesh with its attributes. If these are wrong, a warning says so, and the mesh counts: a
/// pipe, which cannot be read twice, is an error then.
Result<MeshFile> read_with_attributes(const std::string& path, const csg::InputKind& kind,
                                      csg::SceneInput input, const Execution& execution,
                                      Session& session) {
  input.attributes = true;
  auto file = csg::read_mesh_input(path, kind, input, execution);
  std::error_code unknown;
  if (file || !std::filesystem::is_regular_file(path, unknown) || session.interrupted())
    return file;
  input.attributes = false;
  auto plain = csg::read_mesh_input(path, kind, input, execution);
  if (plain) session.warn("reader", file.error().message);
  return plain;
}

Result<FileInfo> look_at(const std::string& path, const csg::InputKind& kind,
                         const InfoCommand& command, Session& session) {
  const double share =
      0.5 / static_cast<double>(std::max<std::size_t>(command.input.files.size(), 1));
  csg::SceneInput one = command.input;  // a file by itself
  one.files = {path};
  auto file = read_with_attributes(path, kind, one, session.execution("reading", share), session);
  if (!file) return tl::unexpected(file.error());
  if (auto kept = session.opened(file->opened); !kept) return tl::unexpected(kept.error());
  MeshReadStats told = file->stats;
  told.missing.clear();  // the report says that
  csg::warn_of_reading(path, told, messages_of(session));
  Execution execution = session.execution("checking");
  execution.progress = {};
  FileInfo info{path,
                file->stats,
                diagnose(file->soup, execution),
                orient_parts(file->soup, execution, {.change = false}),
                csg::world_unit(one),
                {},
                {},
                {}};
  if (!std::isfinite(info.found.area) || !std::isfinite(info.found.volume)) {
    return fail(
        ErrorCode::kGeometry,
        "{}: the mesh is {:.3g} long, and its area or volume is beyond the range of double; "
        "a small --scale helps",
        path, info.found.bounds.longest_side());
  }
  info.unit_doubt = csg::unit_doubt(info.stats, one, info.found.bounds);
  info.attributes = look_at_attributes(*file, info.found.closed, execution);
  if (session.interrupted()) return fail(ErrorCode::kCancelled, "stopped");
  if (command.common.strict && !info.found.closed) {
    session.warn("open", fmt::format("{}: the mesh is not closed: {} of {} edges are unbalanced",
                                     path, info.found.unbalanced_edges, info.found.edges));
  }
  if (command.check) {
    const auto check = check_mesh(file->soup, session.execution("checking", share));
    if (!check) {
      return fail(check.error().code, "{}: {}", printable(path), check.error().message);
    }
    info.check =
        FileCheck{*check, info.orientation, info.stats.dropped_faces() + info.stats.degenerate};
    warn_of_check(path, *info.check, session);
  }
  return info;
}

struct VoxelInfo {
  std::string path;
  std::uint64_t bytes = 0;
  VoxelVolume volume;
};

std::string info_text(const VoxelInfo& info) {
  std::string text = printable(info.path) + "\n";
  for (const auto& [topic, rest] : voxel_facts(info.volume)) {
    text += fmt::format("  {:<12} {}\n", topic, printable(rest));
  }
  if (info.volume.grids.size() > 1) {
    std::string names;
    for (const std::string& name : info.volume.grids) {
      names += (names.empty() ? "" : ", ") + printable(name);
    }
    text += fmt::format("  {:<12} {}\n", "grids", names);
  }
  for (const std::string& note : info.volume.notes) {
    text += fmt::format("  {:<12} {}\n", "note", printable(note));
  }
  return text;
}

void write_info(JsonWriter& json, const VoxelInfo& info) {
  const VoxelVolume& volume = info.volume;
  json.begin_object();
  json.member("path", info.path);
  json.member("format", volume.format);
  json.member("bytes", info.bytes);
  json.member("kind", std::string(name_of(volume.kind)));
  json.member("type", volume.type);
  json.member("name", volume.name);
  json.member("dims", volume.grid().dims);
  json.member("origin", volume.grid().origin);
  json.member("voxel_size", volume.grid().voxel_size);
  json.member("placed", volume.placed);
  json.member("solid", volume.set.solid_voxels());
  json.member("threshold", static_cast<double>(volume.threshold));
  json.end_object();
}

Result<VoxelInfo> look_at_voxels(const std::string& path, Session& session) {
  auto volume = read_voxels(path, {}, session.execution("reading"));
  if (!volume) return tl::unexpected(volume.error());
  std::error_code none;
  const std::uintmax_t bytes =
      std::filesystem::is_directory(path, none) ? 0 : std::filesystem::file_size(path, none);
  return VoxelInfo{path, none ? 0 : bytes, *std::move(volume)};
}

/// --gl, which says what it can beside files that failed.
void add_gl(JsonWriter& json, std::string& text, std::optional<Error>& first_error,
            Session& session) {
  const auto told = tell_gl(json, text);
  if (told) return;
  if (first_error) session.complain(*first_error);
  first_error = told.error();
}

}  // namespace

Result<void> run_info(const InfoCommand& command, Session& session) {
  JsonWriter json;
  begin_report(json, "info");
  json.key("files").begin_array();
  std::string text;
  std::optional<Error> first_error;  // the other files are still looked at
  bool scene_failed = false;
  for (const std::string& path : command.input.files) {
    const auto tell = [&](const auto& info) -> Result<void> {
      if (!info) return tl::unexpected(info.error());
      write_info(json, *info);
      if (!text.empty()) text += '\n';
      text += info_text(*info);
      return {};
    };
    const csg::InputKind kind = csg::kind_of(path, command.input);
    const auto told = is_voxel_file(path) ? tell(look_at_voxels(path, session))
                      : kind.is_scene     ? tell(look_at_scene(path, command, session))
                                          : tell(look_at(path, kind, command, session));
    if (told) continue;
    if (session.interrupted()) return told;
    if (first_error) session.complain(*first_error);
    // A report must not overwrite what a scene has opened.
    if (kind.is_scene && told.error().code == ErrorCode::kUsage) return told;
    scene_failed = scene_failed || kind.is_scene;
    first_error = told.error();
  }
  json.end_array();
  const bool replaces =
      command.json && !is_stream(*command.json) && identify_file(*command.json).is_there();
  if (scene_failed && replaces) {
    session.complain(*first_error);
    return fail(
        first_error->code,
        "--json {}: the file is not overwritten, since a scene that cannot be read may need it",
        *command.json);
  }
  if (command.gl) add_gl(json, text, first_error, session);
  write_memory(json);
  write_timings(json, session);
  write_warnings(json, session);
  json.end_object();
  session.end_progress();
  const auto printed = command.json ? print_report(json.take(), *command.json, false)
                                    : print_report(text, "-", false);
  if (!printed) return printed;
  if (auto done = commit_outputs(session); !done) return done;
  if (first_error) return tl::unexpected(*first_error);
  return session.check_strict();
}

}  // namespace strata::apps
