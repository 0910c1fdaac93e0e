#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <optional>
#include <string>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/file_identity.h"
#include "strata/core/result.h"
#include "strata/raster/view.h"
#include "strata/transparency/stream/frame.h"
#include "strata/transparency/stream/transparent_scene.h"

// Participating media inside closed solids and spherical particles. WORDS:
//   extinction   the part of the light that collides per world unit of its way
//   albedo       the part of the light that collides and is scattered, not absorbed
//   medium       what fills a solid evenly: one extinction, one albedo
//   S, Q         the sums of extinction, and of extinction times albedo, of the media at a point

namespace strata::transparency {

/// The largest extinction, and the brightest light.
inline constexpr double kMostExtinction = 1e6;
/// The largest coordinate and radius of a particle or light.
inline constexpr double kFarthest = 1e15;

/// What fills a solid evenly.
struct Medium {
  glm::vec3 extinction{0.0f};  ///< red, green, blue; per world unit; 0 to kMostExtinction
  glm::vec3 albedo{1.0f};      ///< red, green, blue; in [0, 1]
  /// The solid's own surface is drawn, too, as without a medium.
  bool surface = false;
  /// Colour and opacity of the surface, not premultiplied; none: the object's.
  std::optional<glm::vec4> surface_colour = {};
};

/// The medium of some objects.
struct NamedMedium {
  /// Name of the objects of the scene that it fills; each `*` stands for any text. The name of an
  /// object itself goes before patterns, a longer pattern before a shorter one.
  std::string object;
  Medium medium;  ///< in each of them
};

/// A ball of a homogeneous medium. Particles may overlap each other and solids.
struct Particle {
  glm::dvec3 centre{0.0};      ///< world
  double radius = 1.0;         ///< world units, above 0
  glm::vec3 extinction{1.0f};  ///< as Medium::extinction
  glm::vec3 albedo{1.0f};      ///< as Medium::albedo
};

/// How a shadow map keeps what comes through along a ray of the light.
enum class ShadowVisibility : std::uint8_t {
  kLists,      ///< all crossings, exact, in colours
  kSlices,     ///< opacity shadow map: the transmittance behind each of equal slices of depth
  kOccupancy,  ///< occupancy map: a bit for each slice
  kFourier,    ///< Fourier opacity map: terms of a series
  kNodes,      ///< adaptive volumetric shadow map: steps at depths of their own
};

/// A light that is so far away that its rays are parallel, or one at a point.
struct MediaLight {
  glm::dvec3 at{0.0, 0.0, 1.0};  ///< the direction to the light, of any length; or its place
  bool point = false;            ///< `at` is the place
  /// The light that arrives, without shadows. Media scatter 3 / (16 pi) (1 + cos^2) of it to the
  /// eye.
  glm::vec3 radiance{0.0f};
  /// Surfaces of colour c are lit by this light and the ambient one, c (ambient + radiance cos /
  /// pi), instead of by the lamps at the eye. Surfaces, media and particles cast coloured shadows.
  bool shadows = false;
  int shadow_size = 1024;  ///< pixels of a side of the shadow map; 1 to 8192
  /// Shadows in media: parts into which a ray is cut between two crossings, each with the light in
  /// its middle; at most 1024. 0: light in media has no shadows.
  int shadow_steps = 0;
  /// All kinds but lists are grey and of a fixed size.
  ShadowVisibility visibility = ShadowVisibility::kLists;
  int visibility_size = 16;  ///< slices, terms or nodes of a ray; 1 to 64
};

/// The media of a scene, and their light.
struct MediaSettings {
  std::vector<NamedMedium> media;   ///< of the objects of the scene
  glm::vec3 ambient{1.0f};          ///< light from everywhere, that media scatter
  MediaLight light;                 ///< one more light
  std::vector<Particle> particles;  ///< besides the solids
  std::vector<FileIdentity> files;  ///< that read_media() has read, the media file first
};

/// Reads settings from a JSON file; docs/media.md says what it holds. @return kInput naming the
/// file, the member and the number; kUsage where this build reads no JSON
Result<MediaSettings> read_media(const std::string& path);

/// What a picture showed about a solid that holds a medium.
struct SolidReport {
  std::string object;        ///< its name
  std::uint64_t pixels = 0;  ///< pixels (samples) whose rays cross it
  /// Pixels where rays do not enter it as often as they leave it: the solid is not closed. Its
  /// medium is left out there.
  std::uint64_t unbalanced_pixels = 0;
};

/// A picture with media.
struct MediaRendering {
  Rendering rendering;              ///< the picture, and what it cost
  std::vector<SolidReport> solids;  ///< the objects with a medium, in the order of the scene
};

/// The picture of a scene with media. Objects without a medium are surfaces, as for techniques.
/// Distances are measured along each ray. Same bits for any number of threads. @return kUsage
/// (settings, naming the medium and the number; a medium whose object the scene does not have),
/// kGeometry, kLimit, kCancelled
Result<MediaRendering> render_media(const Scene& scene, const View& view,
                                    const MediaSettings& settings, const FrameOptions& options = {},
                                    const Execution& execution = {});

}  // namespace strata::transparency
