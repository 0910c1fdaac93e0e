#include "strata/mesh/check/mesh_check.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "exact/flat_predicates.h"
#include "exact/mesh_sums.h"
#include "mesh/block_sum.h"
#include "mesh/check/check_lattice.h"
#include "mesh/check/mesh_links.h"
#include "mesh/check/self_meetings.h"
#include "mesh/weld.h"

namespace strata {
namespace {

using exact::FilePoint;

constexpr std::size_t kExamples = 8;
constexpr std::size_t kMostTriangles = std::size_t{1} << 30;
// What is held at once, beyond the mesh: points, boxes and their copies in cells, uses of edges.
constexpr std::uint64_t kBytesOfTriangle = 110, kBytesOfVertex = 24;

struct Areas {
  double area = 0.0;
  std::uint64_t degenerate = 0;
};

bool has_area(const FilePoint& a, const FilePoint& b, const FilePoint& c) {
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (exact::orient2d({a[u], a[v]}, {b[u], b[v]}, {c[u], c[v]}) != 0) return true;
  }
  return false;
}

Areas sum_areas(const CheckLattice& lattice, std::span<const glm::uvec3> triangles,
                const Execution& execution) {
  return detail::fold_blocks<Areas>(
      execution, triangles.size(),
      [&](Areas& sums, std::size_t i) {
        const glm::uvec3& t = triangles[i];
        const FilePoint &a = lattice.points[t.x], &b = lattice.points[t.y],
                        &c = lattice.points[t.z];
        sums.degenerate += !has_area(a, b, c);
        const glm::dvec3 u = lattice.step * glm::dvec3(b - a), v = lattice.step * glm::dvec3(c - a);
        sums.area += 0.5 * glm::length(glm::cross(u, v));
      },
      [](Areas& total, const Areas& part) {
        total.area += part.area;
        total.degenerate += part.degenerate;
      });
}

FilePoint middle_of(const CheckLattice& lattice) {
  FilePoint high(0);
  for (const FilePoint& point : lattice.points) high = glm::max(high, point);
  return high >> FilePoint(1);
}

// One sum for each shell; the memory of many shells is not spent once for each thread.
std::vector<exact::FileSum> sum_shells(const CheckLattice& lattice,
                                       std::span<const glm::uvec3> triangles,
                                       const MeshLinks& links, const FilePoint& origin,
                                       const Execution& execution) {
  Execution all = execution;
  all.stop = {};
  if (links.shells > 4096) all.threads = 1;
  const auto workers = static_cast<std::size_t>(all.thread_count());
  std::vector<std::vector<exact::FileSum>> sums(workers);
  parallel_for(all, workers, [&](std::size_t part, int) {
    std::vector<exact::FileSum>& own = sums[part];
    own.resize(links.shells);
    const std::size_t end = triangles.size() * (part + 1) / workers;
    for (std::size_t i = triangles.size() * part / workers; i < end; ++i) {
      const glm::uvec3& t = triangles[i];
      own[links.shell_of[i]].add(origin, lattice.points[t.x], lattice.points[t.y],
                                 lattice.points[t.z]);
    }
  });
  for (std::size_t part = 1; part < workers; ++part) {
    for (std::size_t shell = 0; shell < links.shells; ++shell) {
      sums[0][shell].add(sums[part][shell]);
    }
  }
  return std::move(sums[0]);
}

// Triangles with the three positions of an earlier one.
std::uint64_t count_duplicates(const CheckLattice& lattice, std::span<const glm::uvec3> triangles,
                               const Execution& execution) {
  std::vector<std::uint32_t> vertex(lattice.points.size());
  detail::weld_first<std::int64_t>(
      execution, vertex.size(), [&](std::size_t v) { return lattice.points[v]; }, vertex.data());
  std::vector<std::uint32_t> first(triangles.size());
  const auto sorted = [&](std::size_t i) {
    std::uint32_t at[3] = {vertex[triangles[i].x], vertex[triangles[i].y], vertex[triangles[i].z]};
    std::ranges::sort(at);
    return glm::uvec3(at[0], at[1], at[2]);
  };
  return triangles.size() -
         detail::weld_first<std::uint32_t>(execution, triangles.size(), sorted, first.data());
}

MeetingKind kind_of(Meeting meeting) {
  return meeting == Meeting::kOverlap ? MeetingKind::kOverlaps
         : meeting == Meeting::kCross ? MeetingKind::kCrosses
                                      : MeetingKind::kTouches;
}

void add_links(const MeshLinks& links, std::span<const glm::dvec3> positions, MeshCheck& check) {
  check.by_index = links.by_index;
  check.edges = links.edges;
  check.unbalanced_edges = links.unbalanced_edges;
  check.non_manifold_edges = links.non_manifold_edges;
  check.non_manifold_vertices = links.non_manifold_vertices;
  for (const auto& [a, b] : links.edge_examples) {
    check.edge_examples.push_back({positions[a], positions[b]});
  }
  for (const std::uint32_t v : links.vertex_examples) {
    check.vertex_examples.push_back(positions[v]);
  }
  check.shells = links.shells;
}

void add_sums(const CheckLattice& lattice, std::span<const glm::uvec3> triangles,
              const MeshLinks& links, const Execution& execution, MeshCheck& check) {
  const Areas areas = sum_areas(lattice, triangles, execution);
  check.area = areas.area;
  check.degenerate = areas.degenerate;
  if (!check.closed()) return;
  const FilePoint origin = middle_of(lattice);
  exact::FileSum all;
  for (const exact::FileSum& shell : sum_shells(lattice, triangles, links, origin, execution)) {
    check.inward_shells += shell.six_volumes().negative();
    all.add(shell);
  }
  check.volume = all.volume() * lattice.step * lattice.step * lattice.step;
  if (exact::sign_of(all.six_volumes()) == 0) return;
  check.centre =
      lattice.world(glm::dvec3(origin) + glm::dvec3(all.centre(0), all.centre(1), all.centre(2)));
}

void add_meetings(const SelfMeetings& meetings, const CheckLattice& lattice,
                  std::span<const glm::uvec3> triangles, MeshCheck& check) {
  check.touching = meetings.touching;
  check.crossing = meetings.crossing;
  check.overlapping = meetings.overlapping;
  const auto corners = [&](std::uint32_t t) {
    const glm::uvec3& at = triangles[t];
    return TriangleCorners{lattice.points[at.x], lattice.points[at.y], lattice.points[at.z]};
  };
  for (const SelfMeetings::Pair& pair : meetings.first) {
    check.meetings.push_back(
        {pair.first, pair.second, kind_of(pair.meeting),
         lattice.world(meeting_place(corners(pair.first), corners(pair.second)))});
  }
}

}  // namespace

Result<MeshCheck> check_mesh(std::span<const glm::dvec3> positions,
                             std::span<const glm::uvec3> triangles, const Execution& execution) {
  MeshCheck check;
  check.triangles = triangles.size();
  if (triangles.size() >= kMostTriangles) {
    return fail(ErrorCode::kLimit, "{} triangles cannot be checked, fewer than {} can",
                triangles.size(), kMostTriangles);
  }
  const std::uint64_t bytes =
      triangles.size() * kBytesOfTriangle + positions.size() * kBytesOfVertex;
  if (execution.memory_limit != 0 && bytes > execution.memory_limit) {
    return fail(ErrorCode::kLimit,
                "checking {} triangles needs about {} bytes, the memory limit is {} bytes",
                triangles.size(), bytes, execution.memory_limit);
  }
  const auto stopped = [&] { return execution.stop.stop_requested(); };
  const auto cancelled = [] { return fail(ErrorCode::kCancelled, "stopped"); };
  const auto lattice = check_lattice(positions, execution);
  if (!lattice) return tl::unexpected(lattice.error());
  check.step = lattice->step;
  check.moved_vertices = lattice->moved;
  if (stopped()) return cancelled();
  MeshLinks links = mesh_links(lattice->points, triangles, execution);
  if (stopped()) return cancelled();
  add_links(links, positions, check);
  add_sums(*lattice, triangles, links, execution, check);
  links.shell_of = {};
  std::vector<glm::uvec3> welded;  // where vertices are told apart by position
  if (!links.by_index) {
    welded.reserve(triangles.size());
    for (const glm::uvec3& t : triangles) {
      welded.emplace_back(links.vertex[t.x], links.vertex[t.y], links.vertex[t.z]);
    }
  }
  const auto meetings = find_self_meetings(lattice->points, links.by_index ? triangles : welded,
                                           check.closed(), kExamples, execution);
  if (!meetings) return tl::unexpected(meetings.error());
  add_meetings(*meetings, *lattice, triangles, check);
  if (check.overlapping > 0) {  // else there are none
    check.duplicates = count_duplicates(*lattice, triangles, execution);
  }
  return check;
}

Result<MeshCheck> check_mesh(const TriangleSoup& mesh, const Execution& execution) {
  auto check = check_mesh(std::span(mesh.positions), std::span(mesh.triangles), execution);
  if (check && !mesh.face_elements.empty()) {
    for (MeetingTriangles& pair : check->meetings) {
      pair.first = mesh.face_elements[pair.first];
      pair.second = mesh.face_elements[pair.second];
    }
  }
  return check;
}

}  // namespace strata
