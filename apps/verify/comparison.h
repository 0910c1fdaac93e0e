#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "apps/verify/exact_solid.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"

namespace strata::apps {

struct VerifyOptions {
  int resolution = 48;  ///< voxels along the longest side of the grid that is compared whole
  int point_resolution = 1024;   ///< of the grid whose voxels are drawn at random
  int measure_resolution = 256;  ///< of volume and area
  int points = 2000;             ///< random ones
  std::uint64_t seed = 1;
};

/// A number by the lists and by CGAL.
struct SizeCheck {
  double lists = 0, exact = 0;
  double bound = 0;  ///< of what they may differ
  [[nodiscard]] double difference() const;
  [[nodiscard]] bool within() const { return difference() <= bound; }
};

/// Points at which both say inside or outside.
struct PointCheck {
  std::uint64_t compared = 0;
  std::uint64_t inside = 0;    ///< by CGAL
  std::uint64_t boundary = 0;  ///< exactly on the result's surface: either will do
  std::uint64_t near = 0;      ///< they differ, a surface is within 1/256 voxel: the snap
  std::uint64_t wrong = 0;     ///< they differ otherwise
  struct Example {
    glm::dvec3 point{0.0};
    bool inside = false;  ///< by CGAL
  };
  std::vector<Example> examples;  ///< the first wrong ones
};

/// Exact volumes of the same snapped solids, by csg/boundary and by CGAL, compared as fractions.
struct SnapCheck {
  bool compared = false;
  std::string reason;              ///< why they were not compared
  double boundary = 0, exact = 0;  ///< about
  bool equal = true;               ///< as fractions
};

/// What a comparison found.
struct Verification {
  SizeCheck volume;  ///< bound: area * length of a voxel (invariant I18)
  SizeCheck area;    ///< bound: edges of faces cross cells, ExactSolid::creases()
  PointCheck voxels, points;
  SnapCheck snapped;
  ExactSolid::Facts exact;
  [[nodiscard]] bool agrees() const {
    return volume.within() && area.within() && voxels.wrong == 0 && points.wrong == 0 &&
           snapped.equal;
  }
};

/// Compares what Strata makes of `tree` with what CGAL makes of `other`, which is the same tree
/// unless someone wants to know whether two trees are one solid.
/// @return as ExactSolid::evaluate(), csg::measure() and voxelize(); that they differ is no error
Result<Verification> verify(const csg::Tree& tree, const csg::Tree& other,
                            const VerifyOptions& options = {}, const Execution& execution = {});

}  // namespace strata::apps
