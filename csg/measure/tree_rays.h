#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "csg/geometry.h"
#include "csg/measure/ray_boxes.h"
#include "csg/program.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/surface/surface_image.h"
#include "strata/csg/tree.h"
#include "strata/raster/view.h"

namespace strata::csg {

/// A point of the visible surface of a tree.
struct SurfacePoint {
  std::uint32_t solid = 0, triangle = 0;  ///< of the tree; of the solid
  glm::dvec3 where{0.0};                  ///< world space, on the plane of the triangle
  glm::dvec3 normal{0.0};                 ///< of the triangle, of length 1, towards the eye
  glm::dvec3 inner{0.0};                  ///< the same point, moved into the triangle by a trifle
  bool cut = false;                       ///< a face where a subtracted solid or a section ends
};

/// Measures the material of a tree's result along any line. It meets each line with the triangles
/// of all solids and evaluates the tree along it: lists without a raster, in doubles.
///
/// Whether a line meets a triangle is decided by signs of edge functions in sheared coordinates, so
/// that closed meshes stay closed: S. Woop, C. Benthin, I. Wald, "Watertight ray/triangle
/// intersection" (2013). We differ: lines through an edge or a vertex are moved by an infinitesimal
/// amount, as in law 3, instead of hitting both triangles.
class TreeRays {
 public:
  /// Keeps the tree's meshes alive.
  /// @param relative_precision  as for Preview
  /// @param former  rays of another tree, whose sorted triangles are taken over where a solid has
  /// the same mesh at the same place; null: none
  TreeRays(const Tree& tree, Tree::NodeId root, double relative_precision,
           const Execution& execution = {}, const TreeRays* former = nullptr);

  /// The length of the material that begins at `from`, in direction `along`: to where the result is
  /// left. Pieces and gaps shorter than slack() are ignored. 0: there is no material at `from`;
  /// infinity: it is never left. @pre `along` has length 1. Threads may call it at once
  [[nodiscard]] double thickness(const glm::dvec3& from, const glm::dvec3& along) const;

  /// What a picture shows at a pixel. @param image,view  of the same tree
  /// @pre there is something at that pixel
  [[nodiscard]] SurfacePoint point(const View& view, const SurfaceImage& image, int u, int v) const;

  /// For each pixel the thickness from the visible surface inwards, against its normal; 0 where
  /// nothing is visible. @param light  becomes eye_light() of each pixel's face; null: not wanted
  /// @return kCancelled
  Result<std::vector<float>> wall_image(const View& view, const SurfaceImage& image,
                                        const Execution& execution = {},
                                        std::vector<float>* light = nullptr) const;

  /// Lengths up to this one are nothing.
  [[nodiscard]] double slack() const { return slack_; }
  [[nodiscard]] const Geometry& geometry() const { return geometry_; }
  /// A whole solid in world space, also where it is vast.
  [[nodiscard]] TriangleSoup solid_mesh(std::uint32_t solid) const;
  /// Calls body(solid, triangle) for all triangles whose box meets `box`.
  template <class Body>
  void near(const Bounds& box, const Body& body) const {
    solids_.in_box(box, [&](std::uint32_t solid) {
      triangles_[solid]->in_box(box, [&](std::uint32_t triangle) { body(solid, triangle); });
    });
  }

 private:
  struct Scratch;
  double thickness(const glm::dvec3& from, const glm::dvec3& along, Scratch& scratch) const;
  void gather(const RaySpan& ray, Scratch& scratch) const;
  [[nodiscard]] SurfacePoint point(const View& view, const glm::dmat4& world_from_image,
                                   const SurfaceImage& image, int u, int v) const;

  Geometry geometry_;
  Program program_;
  double slack_ = 0.0, reach_ = 0.0;
  std::vector<std::shared_ptr<const TriangleSoup>> meshes_;
  std::vector<glm::dmat4> places_;
  std::vector<std::shared_ptr<const RayBoxes>> triangles_;  ///< of each solid
  RayBoxes solids_;
};

}  // namespace strata::csg
