#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bench/csg_products.h"
#include "strata/core/result.h"
#include "strata/raster/view.h"

namespace strata::bench {

/// A solid as OpenCSG takes it.
struct PeerSolid {
  std::span<const glm::dvec3> positions;  ///< world space
  std::span<const glm::uvec3> triangles;  ///< counter-clockwise from outside
  Bounds box;
  unsigned convexity = 1;  ///< front faces that a ray may meet
};

/// OpenCSG on Mesa's software OpenGL, without a display: what a preview of OpenSCAD does for a
/// frame. Geometry stays in vertex buffers. One at a time, used by the thread that made it.
class OpenCsgPeer {
 public:
  /// @param threads of llvmpipe; counts for the first one of a process only
  static Result<std::unique_ptr<OpenCsgPeer>> make(const glm::ivec2& size, int threads);
  ~OpenCsgPeer();
  OpenCsgPeer(const OpenCsgPeer&) = delete;
  OpenCsgPeer& operator=(const OpenCsgPeer&) = delete;

  /// What runs OpenGL, in its own words.
  [[nodiscard]] std::string renderer() const;

  /// Takes a scene. @param with_boxes  OpenCSG is told where solids lie in the picture
  void load(std::span<const PeerSolid> solids, std::span<const Product> products, const View& view,
            bool with_boxes);
  /// One frame, shaded, from cleared buffers to glFinish().
  void draw();
  /// The frame's window depths in [0, 1], row by row from the top; 1 where nothing is seen. Linear
  /// in View's depth.
  [[nodiscard]] std::vector<float> depths() const;

 private:
  struct Impl;
  explicit OpenCsgPeer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace strata::bench
