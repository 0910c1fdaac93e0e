#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <optional>
#include <string>
#include <vector>

#include "strata/mesh/triangle_soup.h"

namespace strata::transparency {

/// A part of a scene with one colour.
struct Object {
  std::string name;  ///< for messages and reports
  /// Red, green, blue, opacity in [0, 1]; not premultiplied. An opacity of 1 is opaque.
  glm::vec4 colour{0.7f, 0.7f, 0.7f, 0.5f};
  /// The object that it bounds a solid together with, such as the faces of another material. Media
  /// fill whole solids. Empty: it bounds one by itself.
  std::optional<std::uint32_t> part_of = {};
};

/// Triangles with colours, seen from both sides.
struct Scene {
  TriangleSoup mesh;                     ///< world space; object after object
  std::vector<std::uint32_t> object_of;  ///< of each triangle; empty: all belong to object 0
  std::vector<Object> objects;           ///< at least one if there are triangles
};

}  // namespace strata::transparency
