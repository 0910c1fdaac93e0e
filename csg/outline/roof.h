#pragma once

#include <string>

#include "csg/outline/outline.h"
#include "csg/outline/segments.h"
#include "strata/core/result.h"
#include "strata/mesh/triangle_soup.h"

namespace strata::csg {

/// OpenSCAD's `roof`: a straight-skeleton or Voronoi roof over the outline. @return kGeometry if
/// the roof cannot be constructed
Result<TriangleSoup> make_roof(const Outline& outline, const std::string& method,
                               const Segments& segments);

}  // namespace strata::csg
