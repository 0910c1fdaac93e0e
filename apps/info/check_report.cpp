#include "apps/info/check_report.h"

#include <fmt/format.h>

#include <set>
#include <string_view>
#include <utility>

#include "core/printable.h"

namespace strata::apps {
namespace {

std::string at(const glm::dvec3& v) {
  return fmt::format("({:.9g}, {:.9g}, {:.9g})", v.x, v.y, v.z);
}

std::string many(std::uint64_t count, const char* one, const char* more) {
  return fmt::format("{} {}", count, count == 1 ? one : more);
}
std::string vertices(std::uint64_t count) { return many(count, "vertex", "vertices"); }
std::string meshes(std::uint64_t count) { return many(count, "mesh", "meshes"); }

std::string_view word(MeetingKind kind) {
  return kind == MeetingKind::kCrosses    ? "cross"
         : kind == MeetingKind::kOverlaps ? "overlap"
                                          : "touch";
}

std::string pairs(std::uint64_t count, MeetingKind kind) {
  return fmt::format("{} of triangles {}", counted(count, "pair"), word(kind));
}

std::vector<std::string> faults_of(const MeshCheck& mesh) {
  std::vector<std::string> faults;
  const auto add = [&](std::uint64_t count, std::string text) {
    if (count > 0) faults.push_back(std::move(text));
  };
  add(mesh.unbalanced_edges,
      fmt::format("not closed: {} of {} edges are unbalanced", mesh.unbalanced_edges, mesh.edges));
  add(mesh.non_manifold_edges,
      counted(mesh.non_manifold_edges, "edge") + " of more than two triangles");
  add(mesh.non_manifold_vertices,
      vertices(mesh.non_manifold_vertices) + " whose triangles form more than one fan");
  add(mesh.crossing, pairs(mesh.crossing, MeetingKind::kCrosses));
  add(mesh.overlapping, pairs(mesh.overlapping, MeetingKind::kOverlaps));
  add(mesh.touching, pairs(mesh.touching, MeetingKind::kTouches) +
                         " elsewhere than in vertices and edges of both");
  add(mesh.degenerate, counted(mesh.degenerate, "triangle") + " without area");
  add(mesh.duplicates, counted(mesh.duplicates, "triangle") + " with the vertices of another");
  if (mesh.closed() && mesh.volume < 0) faults.emplace_back("inside out");
  return faults;
}

// Where the first faults are.
void add_places(const MeshCheck& mesh, ReportLines& lines) {
  const auto add = [&](std::string text) { lines.emplace_back("", std::move(text)); };
  for (const auto& [from, to] : mesh.edge_examples) {
    add(fmt::format("edge of more than two triangles: {} to {}", at(from), at(to)));
  }
  for (const glm::dvec3& vertex : mesh.vertex_examples) {
    add("vertex of more than one fan: " + at(vertex));
  }
  for (const MeetingTriangles& pair : mesh.meetings) {
    add(fmt::format("faces {} and {} {} at {}", pair.first, pair.second, word(pair.kind),
                    at(pair.place)));
  }
  if (mesh.meetings.size() < mesh.meeting_pairs()) {
    add(fmt::format("and {}", counted(mesh.meeting_pairs() - mesh.meetings.size(), "more pair")));
  }
}

std::string passed_text() { return "passed: closed, 2-manifold, no two triangles meet"; }

}  // namespace

bool FileCheck::passed() const { return faults().empty(); }

std::vector<std::string> FileCheck::faults() const {
  std::vector<std::string> result = faults_of(mesh);
  if (dropped_faces > 0) {
    result.push_back(counted(dropped_faces, "face") + " without area or with bad data");
  }
  if (mesh.volume >= 0 && orientation.turned_parts > 0) {
    result.push_back(counted(orientation.turned_parts, "part") + " inside out");
  }
  return result;
}

Result<SceneCheck> check_solids(const csg::Tree& tree, const Execution& execution) {
  SceneCheck result;
  std::set<const TriangleSoup*> seen;
  for (const csg::Solid& solid : tree.solids()) {
    if (!solid.mesh || solid.mesh->triangles.empty() || !seen.insert(solid.mesh.get()).second) {
      continue;
    }
    const auto check = check_mesh(*solid.mesh, execution);
    if (!check) {
      return fail(check.error().code, "{}: {}", printable(solid.name), check.error().message);
    }
    ++result.meshes;
    auto faults = faults_of(*check);
    if (!faults.empty()) result.faulty.push_back({solid.name, std::move(faults)});
  }
  return result;
}

ReportLines check_lines(const FileCheck& check) {
  const MeshCheck& mesh = check.mesh;
  ReportLines lines;
  if (check.passed()) {
    lines.emplace_back("check", passed_text());
  } else {
    lines.emplace_back("check", "failed");
    for (std::string& fault : check.faults()) lines.emplace_back("", std::move(fault));
    add_places(mesh, lines);
  }
  lines.emplace_back("shells",
                     mesh.inward_shells > 0 && mesh.volume >= 0
                         ? fmt::format("{}, {} of negative volume", mesh.shells, mesh.inward_shells)
                         : std::to_string(mesh.shells));
  if (mesh.closed()) {
    lines.emplace_back("exact volume", fmt::format("{}", mesh.volume));
    if (mesh.volume != 0) {
      lines.emplace_back("centre", fmt::format("({}, {}, {}), of mass", mesh.centre.x,
                                               mesh.centre.y, mesh.centre.z));
    }
  }
  if (mesh.moved_vertices > 0) {
    lines.emplace_back("lattice",
                       fmt::format("{} rounded for the check, by at most {:.2g} along an axis",
                                   vertices(mesh.moved_vertices), mesh.step / 2));
  }
  return lines;
}

ReportLines check_lines(const SceneCheck& check) {
  if (check.faulty.empty()) {
    return {
        {"check", fmt::format("passed by {} of solids: closed, 2-manifold, no two triangles meet",
                              meshes(check.meshes))}};
  }
  ReportLines lines{{"check", fmt::format("failed by {} of {} of solids", check.faulty.size(),
                                          meshes(check.meshes))}};
  for (const SceneCheck::Faulty& one : check.faulty) {
    lines.emplace_back("", fmt::format("{}: {}", printable(one.name), fmt::join(one.faults, "; ")));
  }
  return lines;
}

void write_check(JsonWriter& json, const FileCheck& check) {
  const MeshCheck& mesh = check.mesh;
  json.key("check").begin_object();
  json.member("passed", check.passed());
  json.key("faults").begin_array();
  for (const std::string& fault : check.faults()) json.value(fault);
  json.end_array();
  json.member("by_index", mesh.by_index);
  json.member("closed", mesh.closed());
  json.member("manifold", mesh.manifold());
  json.member("edges", mesh.edges);
  json.member("unbalanced_edges", mesh.unbalanced_edges);
  json.member("non_manifold_edges", mesh.non_manifold_edges);
  json.member("non_manifold_vertices", mesh.non_manifold_vertices);
  json.member("degenerate", mesh.degenerate);
  json.member("duplicates", mesh.duplicates);
  json.key("meetings").begin_object();
  json.member("crossing", mesh.crossing);
  json.member("overlapping", mesh.overlapping);
  json.member("touching", mesh.touching);
  json.key("examples").begin_array();
  for (const MeetingTriangles& pair : mesh.meetings) {
    json.begin_object();
    json.member("first", pair.first);
    json.member("second", pair.second);
    json.member("kind", word(pair.kind));
    json.member("place", pair.place);
    json.end_object();
  }
  json.end_array();
  json.end_object();
  json.member("shells", mesh.shells);
  json.member("negative_shells", mesh.inward_shells);
  json.member("volume", mesh.volume);
  json.member("centre", mesh.centre);
  json.member("step", mesh.step);
  json.member("moved_vertices", mesh.moved_vertices);
  json.end_object();
}

void write_check(JsonWriter& json, const SceneCheck& check) {
  json.key("check").begin_object();
  json.member("passed", check.faulty.empty());
  json.member("meshes", check.meshes);
  json.key("faulty").begin_array();
  for (const SceneCheck::Faulty& one : check.faulty) {
    json.begin_object();
    json.member("name", one.name);
    json.key("faults").begin_array();
    for (const std::string& fault : one.faults) json.value(fault);
    json.end_array();
    json.end_object();
  }
  json.end_array();
  json.end_object();
}

void warn_of_check(const std::string& path, const FileCheck& check, Session& session) {
  if (check.passed()) return;
  session.warn("check", fmt::format("{}: the mesh is not the boundary of a solid: {}", path,
                                    fmt::join(check.faults(), "; ")));
}

void warn_of_check(const std::string& path, const SceneCheck& check, Session& session) {
  if (check.faulty.empty()) return;
  const SceneCheck::Faulty& first = check.faulty.front();
  session.warn("check", fmt::format("{}: {} of {} of solids are not boundaries of solids; {}: {}",
                                    path, check.faulty.size(), meshes(check.meshes), first.name,
                                    fmt::join(first.faults, "; ")));
}

}  // namespace strata::apps
