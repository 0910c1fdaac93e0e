// CGAL as it is meant to be used: exact predicates and constructions. Takes a minute to compile.

#include "tests/mesh/check/cgal_check.h"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/helpers.h>

#include <array>
#include <utility>
#include <vector>

namespace strata::oracle {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Point = Kernel::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;
using Face = Mesh::Face_index;

std::array<Point, 3> corners(const Mesh& mesh, Face face) {
  const auto first = mesh.halfedge(face);
  return {mesh.point(mesh.source(first)), mesh.point(mesh.target(first)),
          mesh.point(mesh.target(mesh.next(first)))};
}

bool is_vertex(const Point& p, const std::array<Point, 3>& t) {
  return p == t[0] || p == t[1] || p == t[2];
}

// Whether two triangles share one vertex or edge of both, or nothing.
bool clean(const Mesh& mesh, Face a, Face b) {
  const std::array<Point, 3> s = corners(mesh, a), t = corners(mesh, b);
  const auto shared = CGAL::intersection(Kernel::Triangle_3(s[0], s[1], s[2]),
                                         Kernel::Triangle_3(t[0], t[1], t[2]));
  if (!shared) return true;
  if (const auto* point = boost::get<Point>(&*shared))
    return is_vertex(*point, s) && is_vertex(*point, t);
  if (const auto* edge = boost::get<Kernel::Segment_3>(&*shared)) {
    return is_vertex(edge->source(), s) && is_vertex(edge->source(), t) &&
           is_vertex(edge->target(), s) && is_vertex(edge->target(), t);
  }
  return false;
}

}  // namespace

CgalCheck cgal_check(std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles) {
  CgalCheck result;
  std::vector<Point> points;
  for (const glm::dvec3& p : positions) points.emplace_back(p.x, p.y, p.z);
  std::vector<std::array<std::size_t, 3>> faces;
  for (const glm::uvec3& t : triangles) faces.push_back({t.x, t.y, t.z});
  result.mesh = pmp::is_polygon_soup_a_polygon_mesh(faces);
  if (!result.mesh) return result;
  Mesh mesh;
  pmp::polygon_soup_to_polygon_mesh(points, faces, mesh);
  result.closed = CGAL::is_closed(mesh);
  std::vector<std::pair<Face, Face>> pairs;
  pmp::self_intersections<CGAL::Sequential_tag>(mesh, std::back_inserter(pairs));
  for (const auto& [a, b] : pairs) result.meeting_pairs += !clean(mesh, a, b);
  if (!result.closed || result.meeting_pairs > 0) return result;
  result.bounds_volume = pairs.empty() ? pmp::does_bound_a_volume(mesh) : true;
  result.outward = pairs.empty() ? pmp::is_outward_oriented(mesh) : true;
  return result;
}

}  // namespace strata::oracle
