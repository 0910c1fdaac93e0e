#pragma once

#include <memory>
#include <span>
#include <vector>

#include "csg/arrangement/boundary_faces.h"
#include "mesh/polygons/face_sweep.h"
#include "mesh/repair/umbrellas.h"

namespace strata::csg {

/// Triangles of some planes.
struct FaceTriangles {
  std::vector<glm::uvec3> triangles;  ///< points, counter-clockwise from outside
  std::vector<std::uint32_t> labels;  ///< of the triangles
  std::vector<WedgeEdge> wedges;
  /// Of the triangles: the index of their plane, with kNotSimple where edges meet once they are
  /// rounded.
  std::vector<std::uint32_t> planes;
  static constexpr std::uint32_t kNotSimple = 0x80000000u;
};

/// Triangulates the faces of planes of a boundary. One object serves one thread.
class FaceTriangulation {
 public:
  /// @param positions  rounded, of all points; both are borrowed
  FaceTriangulation(const BoundaryFaces& faces, const std::vector<exact::FilePoint>& positions)
      : faces_(faces), positions_(positions) {}

  /// Appends the constrained Delaunay triangulation of the rounded points of a plane, which does
  /// not depend on orders: of four points of a circle, the one that the sweep meets first has the
  /// diagonal. Where rounding makes edges meet, the exact points make the
  /// triangulation, so that each edge has its triangle.
  /// @return false when the plane's edges do not bound a region: a fault of whoever made them
  bool append(std::uint32_t plane, FaceTriangles& out);

 private:
  using Index = std::uint32_t;

  bool append_triangle(const BoundaryPlane& plane, FaceTriangles& out) const;
  bool append_quad(const BoundaryPlane& plane, FaceTriangles& out) const;
  void collect(const BoundaryPlane& plane);
  bool sort_corners();
  bool number_edges(const BoundaryPlane& plane);
  bool cut_exactly(const BoundaryPlane& plane);
  void append_mesh(const BoundaryPlane& plane, FaceTriangles& out) const;

  struct Corner {
    std::int64_t key;  // how far along the sweep
    exact::FlatPoint at;
    Index point;

    friend bool operator<(const Corner& a, const Corner& b) {
      return a.key != b.key     ? a.key < b.key
             : a.at.y != b.at.y ? a.at.y < b.at.y
                                : a.point < b.point;
    }
  };

  const BoundaryFaces& faces_;
  const std::vector<exact::FilePoint>& positions_;
  int u_ = 0, v_ = 1;
  std::unique_ptr<Index[]> number_of_;  // of a point of the plane; the others are not set
  std::vector<Corner> corners_;         // in the order of the sweep
  std::vector<exact::FlatPoint> flat_;
  std::vector<FlatEdge> edges_;
  FaceSweep sweep_;
  DelaunayMesh mesh_;
};

}  // namespace strata::csg
