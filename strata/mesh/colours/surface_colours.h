#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/mesh/mesh_attributes.h"
#include "strata/mesh/triangle_soup.h"

namespace strata {

/// Settings of SurfaceColours.
struct SurfaceColourOptions {
  glm::u8vec4 none{204, 204, 204, 255};  ///< where no colour is given; sRGB, straight alpha
  /// World lengths of the box along x, y, z whose mean is asked for, such as a voxel.
  glm::dvec3 footprint{1.0};
};

/// The colour of any point of a surface: the product, in linear light, of all that a file gives for
/// it: the texture and the colour of the face's material, the colours of the face, of its vertices
/// and of its corners. Without any of them it is the colour of the part, or
/// SurfaceColourOptions::none. Colours of vertices and corners are interpolated, and textures are
/// filtered, in linear light and weighted by alpha.
///
/// Textures are filtered by box-filtered mip maps, trilinear, with up to 16 probes where a texture
/// is stretched: a colour is the mean over a box of about the footprint's size.
class SurfaceColours {
 public:
  /// Makes the mip maps of the textures. The mesh and the attributes must outlive this object.
  /// @return kInput: attributes that are not those of the mesh; kLimit: memory; kCancelled
  static Result<SurfaceColours> make(const TriangleSoup& mesh, const MeshAttributes& attributes,
                                     const SurfaceColourOptions& options = {},
                                     const Execution& execution = {});
  /// One colour for each triangle, sRGB and straight alpha.
  static SurfaceColours of_triangles(std::vector<glm::u8vec4> colours);

  SurfaceColours(SurfaceColours&&) noexcept;
  SurfaceColours& operator=(SurfaceColours&&) noexcept;
  ~SurfaceColours();

  /// What one thread asks.
  class Probe {
   public:
    Probe(Probe&&) noexcept;
    Probe& operator=(Probe&&) noexcept;
    ~Probe();
    /// The colour at a point of a triangle. @param weights of its corners; not negative, their sum
    /// is 1 @return sRGB, straight alpha; all 0 where alpha rounds to 0
    [[nodiscard]] glm::u8vec4 colour(std::uint32_t triangle, const glm::dvec3& weights);
    /// The colours at many points of a triangle. @pre colours.size() >= weights.size()
    void colours(std::uint32_t triangle, std::span<const glm::dvec3> weights,
                 std::span<glm::u8vec4> colours);
    /// The colour of all points of a triangle, if it has one.
    [[nodiscard]] std::optional<glm::u8vec4> only_colour(std::uint32_t triangle);

   private:
    friend class SurfaceColours;
    struct Cache;
    explicit Probe(std::unique_ptr<Cache> cache);
    std::unique_ptr<Cache> cache_;
  };
  /// The surface must outlive it.
  [[nodiscard]] Probe probe() const;

  [[nodiscard]] std::uint64_t memory_bytes() const;  ///< bytes of the mip maps and of a probe

 private:
  struct Impl;
  explicit SurfaceColours(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace strata
