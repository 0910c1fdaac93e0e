#pragma once

#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <cstdint>
#include <vector>

#include "strata/mesh/triangle_soup.h"

/// Between triangle soups and OpenMesh's half-edge meshes, for programs that use both. The only
/// header that includes OpenMesh.
namespace strata {

/// Meshes of doubles, as soups have them.
struct OpenMeshTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;   ///< positions
  using Normal = OpenMesh::Vec3d;  ///< normals
};
/// A mesh of triangles.
using OpenMeshTriMesh = OpenMesh::TriMesh_ArrayKernelT<OpenMeshTraits>;
/// A mesh of polygons.
using OpenMeshPolyMesh = OpenMesh::PolyMesh_ArrayKernelT<OpenMeshTraits>;

/// What to_openmesh had to do.
struct OpenMeshReport {
  /// Triangles that a half-edge mesh cannot connect to their neighbours (a third face at an edge, a
  /// pinched vertex): they get three vertices of their own. Their edges look like boundary, so use
  /// diagnose() to find out whether a mesh is closed, never OpenMesh.
  std::uint64_t detached_triangles = 0;
  std::uint64_t dropped_triangles = 0;  ///< two corners the same vertex, which OpenMesh cannot hold
};

namespace detail {
/// Keeps OpenMesh from writing to standard error while it lives.
class QuietOpenMesh {
 public:
  QuietOpenMesh() : errors_(omerr().is_enabled()), log_(omlog().is_enabled()) {
    omerr().disable();
    omlog().disable();
  }
  ~QuietOpenMesh() {
    if (errors_) omerr().enable();
    if (log_) omlog().enable();
  }
  QuietOpenMesh(const QuietOpenMesh&) = delete;
  QuietOpenMesh& operator=(const QuietOpenMesh&) = delete;

 private:
  bool errors_, log_;
};
}  // namespace detail

/// Fills an OpenMesh mesh. Vertex i of the soup is vertex handle i; triangles keep their order but
/// for dropped ones.
template <class Mesh = OpenMeshTriMesh>
[[nodiscard]] Mesh to_openmesh(const TriangleSoup& soup, OpenMeshReport* report = nullptr) {
  using Point = typename Mesh::Point;
  using Scalar = typename Point::value_type;
  const detail::QuietOpenMesh quiet;
  OpenMeshReport counts;
  Mesh mesh;
  mesh.reserve(soup.positions.size(), soup.triangles.size() * 3 / 2, soup.triangles.size());
  const auto add_vertex = [&mesh](const glm::dvec3& p) {
    return mesh.add_vertex(
        Point(static_cast<Scalar>(p.x), static_cast<Scalar>(p.y), static_cast<Scalar>(p.z)));
  };
  for (const glm::dvec3& p : soup.positions) add_vertex(p);
  for (const glm::uvec3& t : soup.triangles) {
    if (t.x == t.y || t.y == t.z || t.z == t.x) {
      ++counts.dropped_triangles;
      continue;
    }
    const auto handle = [](std::uint32_t v) { return OpenMesh::VertexHandle(static_cast<int>(v)); };
    if (mesh.add_face(handle(t.x), handle(t.y), handle(t.z)).is_valid()) continue;
    ++counts.detached_triangles;
    const auto a = add_vertex(soup.positions[t.x]);
    const auto b = add_vertex(soup.positions[t.y]);
    const auto c = add_vertex(soup.positions[t.z]);
    mesh.add_face(a, b, c);
  }
  if (report != nullptr) *report = counts;
  return mesh;
}

/// The faces of any OpenMesh mesh as fans, without those marked as deleted. Vertex handle i is
/// vertex i of the soup.
template <class Mesh>
[[nodiscard]] TriangleSoup from_openmesh(const Mesh& mesh) {
  TriangleSoup soup;
  soup.positions.reserve(mesh.n_vertices());
  for (std::size_t v = 0; v < mesh.n_vertices(); ++v) {
    const auto& p = mesh.point(OpenMesh::VertexHandle(static_cast<int>(v)));
    soup.positions.emplace_back(p[0], p[1], p[2]);
  }
  bool identity = true;
  std::vector<std::uint32_t> corners;
  for (std::size_t f = 0; f < mesh.n_faces(); ++f) {
    const OpenMesh::FaceHandle face(static_cast<int>(f));
    if (mesh.has_face_status() && mesh.status(face).deleted()) continue;
    corners.clear();
    for (auto v = mesh.cfv_iter(face); v.is_valid(); ++v) {
      corners.push_back(static_cast<std::uint32_t>(v->idx()));
    }
    for (std::size_t i = 2; i < corners.size(); ++i) {
      identity = identity && soup.triangles.size() == f;
      soup.triangles.emplace_back(corners[0], corners[i - 1], corners[i]);
      soup.face_elements.push_back(static_cast<std::uint32_t>(f));
    }
  }
  if (identity) soup.face_elements = {};
  return soup;
}

// Compiled once, in strata::openmesh.
/// @cond
extern template OpenMeshTriMesh to_openmesh<OpenMeshTriMesh>(const TriangleSoup&, OpenMeshReport*);
extern template TriangleSoup from_openmesh<OpenMeshTriMesh>(const OpenMeshTriMesh&);
/// @endcond

}  // namespace strata
