#include "apps/strata/mesh_report.h"

#include <algorithm>
#include <cmath>

#include "apps/commands/choice_words.h"
#include "apps/session/report.h"
#include "core/printable.h"

namespace strata::apps {
namespace {

/// "#rrggbbaa".
std::string hexadecimal(const glm::vec4& colour) {
  std::string text = "#";
  for (int k = 0; k < 4; ++k) {
    text += fmt::format("{:02x}", std::lround(255.0f * std::clamp(colour[k], 0.0f, 1.0f)));
  }
  return text;
}

void write_parts(JsonWriter& json, const SolidMesh& mesh) {
  std::vector<std::uint64_t> triangles(mesh.parts.size(), 0);
  if (mesh.part_of.empty() && !triangles.empty()) triangles[0] = mesh.triangles.size();
  for (const std::uint32_t part : mesh.part_of) ++triangles[part];
  json.key("parts").begin_array();
  for (std::size_t part = 0; part < mesh.parts.size(); ++part) {
    json.begin_object();
    json.member("name", mesh.parts[part].name);
    json.key("colour");
    const auto& colour = mesh.parts[part].colour;
    colour ? json.value(hexadecimal(*colour)) : json.null();
    json.member("triangles", triangles[part]);
    json.end_object();
  }
  json.end_array();
}

void write_boundary(JsonWriter& json, const csg::BoundaryReport& report,
                    const std::vector<std::string>& names) {
  json.key("boundary").begin_object();
  json.member("step", report.step);
  json.member("coarsened_bits", report.coarsened);
  json.member("solids", report.solids);
  json.member("triangles", report.triangles);
  json.member("pairs", report.pairs);
  json.member("points", report.points);
  json.member("pieces", report.pieces);
  json.member("cells", report.cells);
  json.member("shells", report.shells);
  json.member("repaired", report.repaired);
  json.member("repair_rounds", report.repair_rounds);
  json.member("vertices_split", report.vertices_split);
  json.key("caps").begin_array();
  for (const csg::BoundaryCap& cap : report.caps) {
    json.begin_object();
    json.member("solid", cap.solid);
    json.member("name", cap.solid < names.size() ? names[cap.solid] : std::string());
    json.member("edges", cap.edges);
    json.member("length", cap.length);
    json.member("area", cap.area);
    json.end_object();
  }
  json.end_array();
  json.end_object();
}

void write_contour(JsonWriter& json, const ContourReport& report, const VoxelGrid& grid) {
  json.key("contour").begin_object();
  json.member("dims", grid.dims);
  json.member("voxel_size", grid.voxel_size);
  json.member("closed", report.closed);
  json.member("crossings", report.crossings);
  json.member("cells", report.cells);
  json.member("ambiguous_cells", report.ambiguous_cells);
  json.member("fans", report.fans);
  json.member("merged_crossings", report.merged_crossings);
  json.member("middle_vertices", report.middle_vertices);
  json.member("clamped_vertices", report.clamped_vertices);
  json.member("lost_crossings", report.lost_crossings);
  json.member("guessed_crossings", report.guessed_crossings);
  json.end_object();
}

}  // namespace

std::string mesh_text(const MeshCommand& command, const MeshOutcome& outcome) {
  std::string text;
  const auto line = [&](std::string_view topic, const std::string& rest) {
    text += fmt::format("{:<9} {}\n", topic, rest);
  };
  const SolidMesh& mesh = outcome.mesh;
  std::string counts = fmt::format(
      "{}, {}", counted(mesh.triangles.size(), "triangle"),
      mesh.positions.size() == 1 ? "1 vertex" : fmt::format("{} vertices", mesh.positions.size()));
  if (outcome.boundary) counts += ", " + counted(outcome.boundary->shells, "shell");
  if (mesh.parts.size() > 1) counts += ", " + counted(mesh.parts.size(), "part");
  line("mesh", command.output.empty() || command.output == "-"
                   ? counts
                   : fmt::format("{}: {}", printable(command.output), counts));
  if (!mesh.triangles.empty()) {
    line("bounds", fmt::format("{} to {}", triple(outcome.box.low), triple(outcome.box.high)));
  }
  if (outcome.boundary) {
    const csg::BoundaryReport& report = *outcome.boundary;
    line("lattice", fmt::format("{} with {} on steps of {:.3g}", counted(report.solids, "solid"),
                                counted(report.triangles, "triangle"), report.step));
    line("checked",
         fmt::format("closed, manifold, no two triangles meet{}",
                     report.repaired == 0
                         ? std::string()
                         : fmt::format("; {} repaired in {}", counted(report.repaired, "place"),
                                       counted(static_cast<std::uint64_t>(report.repair_rounds),
                                               "round"))));
  }
  if (outcome.contour) {
    const glm::ivec3& dims = outcome.grid.dims;
    line("grid",
         fmt::format("{} x {} x {} voxels, {} cut, {} of them ambiguous", dims.x, dims.y, dims.z,
                     counted(outcome.contour->cells, "cell"), outcome.contour->ambiguous_cells));
  }
  return text;
}

std::string mesh_json(const MeshCommand& command, const MeshOutcome& outcome,
                      const Session& session) {
  JsonWriter json;
  begin_report(json, "mesh");
  json.key("scene").begin_object();
  json.member("solids", outcome.solids);
  json.member("nodes", outcome.nodes);
  json.member("triangles", outcome.triangles);
  json.member("flat", outcome.flat);
  json.end_object();
  json.member("method", word_of(kMeshMethodWords, command.method));
  json.key("mesh").begin_object();
  json.member("vertices", outcome.mesh.positions.size());
  json.member("triangles", outcome.mesh.triangles.size());
  json.member("low", outcome.box.low);
  json.member("high", outcome.box.high);
  write_parts(json, outcome.mesh);
  json.end_object();
  if (outcome.boundary) write_boundary(json, *outcome.boundary, outcome.names);
  if (outcome.contour) write_contour(json, *outcome.contour, outcome.grid);
  json.key("output");
  if (command.output.empty()) {
    json.null();
  } else {
    json.begin_object();
    json.member("path", command.output);
    json.member("format", solid_format_name(command.format));
    json.key("bytes");
    outcome.output_bytes ? json.value(*outcome.output_bytes) : json.null();
    json.end_object();
  }
  write_timings(
      json, session,
      {{"read", outcome.read_ms}, {"mesh", outcome.mesh_ms}, {"write", outcome.write_ms}});
  write_memory(json);
  write_warnings(json, session);
  json.end_object();
  return json.take();
}

}  // namespace strata::apps
