#pragma once

#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "raster/view_part.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"

namespace strata::csg {

/// The solids of a tree in world space, made once and seen by many views and grids. Those that are
/// vast beside what they can change, such as half spaces, are cut off around it (kVast): what is
/// seen, measured and filled is the same, and coordinates stay small.
class Geometry {
 public:
  struct Part {
    std::vector<glm::dvec3> positions;  ///< world space
    /// The triangles where they are not the mesh's: of a mirrored solid reversed, of a vast one
    /// those that are left.
    std::vector<glm::uvec3> own_triangles;
    std::span<const glm::uvec3> triangles;  ///< counter-clockwise from outside
    Bounds box;                             ///< of `positions`
    Bounds whole;  ///< of the solid; not `box` where a vast one was cut off
    InsideRule rule = InsideRule::kWinding;
    /// How far its faces may be off, as part of Geometry::world_error(): less than 1 for solids
    /// that are small and near the origin beside what is vast.
    double error_share = 1.0;
    bool convex = false;  ///< known to be, but for rounding

    [[nodiscard]] PlacedMesh placed() const { return {positions, triangles, box}; }
    /// Along the normal of a triangle, outwards; twice as long as its area is large.
    [[nodiscard]] glm::dvec3 across(std::uint32_t triangle) const {
      const glm::uvec3& t = triangles[triangle];
      const glm::dvec3& a = positions[t.x];
      return glm::cross(positions[t.y] - a, positions[t.z] - a);
    }
  };

  /// Keeps the meshes of `tree` alive.
  explicit Geometry(const Tree& tree, const Execution& execution = {});
  Geometry(const Geometry&) = delete;
  Geometry& operator=(const Geometry&) = delete;
  Geometry(Geometry&&) = default;
  Geometry& operator=(Geometry&&) = default;

  /// Puts a solid somewhere else. @param tree  the one that these are the solids of
  /// @return whether other solids may have been cut off elsewhere
  bool move_solid(const Tree& tree, std::uint32_t solid, const glm::dmat4& world_from_mesh);

  [[nodiscard]] const std::vector<Part>& parts() const { return parts_; }
  [[nodiscard]] const Bounds& box() const { return box_; }  ///< around all parts
  [[nodiscard]] std::vector<Bounds> boxes() const;          ///< around each solid
  /// How far faces of the result of `tree`, whose solids these are, may be from where they are
  /// meant when numbers are off by `relative_precision` of themselves. Solids far from the origin,
  /// or cutters that are far larger than what they cut, do not blur what there is: it is never
  /// more than 8 times that part of the result's size.
  [[nodiscard]] double world_error(const Tree& tree, double relative_precision) const;

 private:
  void place(std::uint32_t solid);
  /// Cuts off vast parts. @return whether there are any
  bool cut_off_vast(const Tree& tree);
  void measure();
  void share_error(const Tree& tree);

  std::vector<std::shared_ptr<const TriangleSoup>> meshes_;
  std::vector<glm::dmat4> places_;
  std::vector<Part> parts_;
  Bounds box_;
  bool any_cut_off_ = false;
};

}  // namespace strata::csg
