#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <string>
#include <vector>

#include "strata/mesh/solid_mesh.h"
#include "strata/mesh/triangle_soup.h"

namespace strata {

/// How a texture goes on beyond its border.
enum class TextureWrap {
  kRepeat,  ///< it is there again and again
  kClamp,   ///< the texels of the border
  kMirror   ///< it is there again and again, mirrored every second time
};

/// A picture that faces show.
struct Texture {
  std::string name;                 ///< for messages: a path, or a place in a file
  int width = 0;                    ///< texels of a row
  int height = 0;                   ///< rows
  std::vector<glm::u8vec4> texels;  ///< sRGB, straight alpha, row by row; the first row is the top
  TextureWrap wrap_u = TextureWrap::kRepeat;  ///< along rows
  TextureWrap wrap_v = TextureWrap::kRepeat;  ///< across rows
};

/// What a face looks like: `colour`, times the texture if there is one, in linear light. Colours of
/// vertices, corners and faces are factors as well.
struct SurfaceMaterial {
  static constexpr std::uint32_t kNoTexture = 0xffffffffu;  ///< colour alone
  std::string name;                                         ///< of the file; may be empty
  glm::vec4 colour{1.0f};                                   ///< sRGB and alpha, in [0, 1]
  bool coloured = false;               ///< the file gives `colour`, or a texture
  std::uint32_t texture = kNoTexture;  ///< index
};

/// Parts, materials and colours of a mesh file. All is said of face elements and vertices of the
/// file, as TriangleSoup::face_elements and positions number them; so it holds whichever triangles
/// were reversed, dropped, or cut from a polygon.
struct MeshAttributes {
  static constexpr std::uint32_t kNone = 0xffffffffu;  ///< no part, no material

  /// Face elements from `first` up to the next range's.
  struct Range {
    std::uint64_t first = 0;      ///< face element
    std::uint32_t index = kNone;  ///< of a part or material
  };
  /// A corner of a face element.
  struct Corner {
    std::uint32_t vertex = 0;    ///< index into positions
    glm::vec2 texture_at{0.0f};  ///< (0, 0) is the lower left corner of the texture, v goes up
    glm::u8vec4 colour{255};     ///< sRGB and alpha
  };

  /// STL solids, OBJ objects and groups, 3MF objects, glTF nodes. Names are unique: a name that the
  /// file gives again gets " (2)"; in OBJ it is the same part. Each has a face.
  std::vector<MeshPart> parts;
  std::vector<Range> part_ranges;             ///< increasing; empty: one part
  std::vector<SurfaceMaterial> materials;     ///< in the order of the files
  std::vector<Range> material_ranges;         ///< increasing
  std::vector<Texture> textures;              ///< only those that materials use
  std::vector<glm::u8vec4> vertex_colours;    ///< of each position, sRGB; or empty
  std::vector<glm::u8vec4> element_colours;   ///< of each face element, sRGB; or empty
  std::vector<std::uint32_t> corner_offsets;  ///< element e has corners [e] to [e + 1]; or empty
  std::vector<Corner> corners;                ///< where textures or corners' colours are given
  bool corner_colours = false;                ///< Corner::colour is given

  /// Whether any face has a colour of its own.
  [[nodiscard]] bool coloured() const;
  /// The part of a face element; kNone if it has none.
  [[nodiscard]] std::uint32_t part_of(std::uint64_t element) const;
  /// The material of a face element; kNone if it has none.
  [[nodiscard]] std::uint32_t material_of(std::uint64_t element) const;
  /// The corners of a face element; none where the file gives none.
  [[nodiscard]] std::span<const Corner> corners_of(std::uint64_t element) const;
};

/// What the attributes of a mesh are counted by.
struct MeshExtent {
  std::uint64_t elements = 0;  ///< face elements
  std::size_t vertices = 0;    ///< positions
};

/// Adds the attributes of a mesh that append() adds to another. What only one of them has is none,
/// white or without a texture in the other. Parts whose names are there already get " (2)".
/// @param size  of the mesh before, elements as append() counts them: those beyond are given up
/// @param added  size of `other`
void append(MeshAttributes& attributes, const MeshExtent& size, MeshAttributes other,
            const MeshExtent& added);

/// Adds a mesh to another by append() of both. @param elements  face elements of the file of
/// `other`
void append(TriangleSoup& soup, MeshAttributes& attributes, const TriangleSoup& other,
            MeshAttributes other_attributes, std::uint64_t elements);

}  // namespace strata
