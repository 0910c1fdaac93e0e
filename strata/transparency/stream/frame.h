#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <span>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/raster/view.h"
#include "strata/transparency/stream/technique.h"
#include "strata/transparency/stream/transparent_scene.h"

namespace strata::transparency {

/// A picture in linear red, green, blue, alpha; premultiplied. Rows from the top.
struct Image {
  int width = 0;                  ///< pixels
  int height = 0;                 ///< pixels
  std::vector<glm::vec4> pixels;  ///< width * height, row by row
};

/// To 8 bits a channel, not premultiplied, each rounded once: to nearest, halves up.
[[nodiscard]] std::vector<glm::u8vec4> to_bytes(const Image& image);

/// A fragment of one's own, instead of triangles.
struct ListedFragment {
  int u = 0;                ///< column of the pixel, from the left
  int v = 0;                ///< row of the pixel, from the top
  std::uint32_t depth = 0;  ///< below 2^24
  std::uint32_t face = 0;   ///< of the colours; below 2^31
  bool exit = false;        ///< the ray leaves a solid there
};

/// Settings of a frame.
struct FrameOptions {
  glm::ivec2 size{0};  ///< pixels; of a frame of listed fragments
  /// Samples a pixel: 1, 2, 4, 8, 16, 32 or 64, on a regular grid. The picture is their mean.
  int samples = 1;
  glm::vec4 background{0.0f};  ///< not premultiplied
  /// Objects of opacity 1 are drawn first, and hide what lies behind them. False: their fragments
  /// are in the stream like all others.
  bool opaque_first = true;
};

/// The picture of a technique, and what it cost.
struct Rendering {
  Image image;                     ///< the picture
  Costs costs;                     ///< counted, the same on every machine
  double seconds = 0.0;            ///< wall clock, all of it
  double technique_seconds = 0.0;  ///< of all threads together, without making the stream
  double raster_seconds = 0.0;     ///< of all threads together, for making the stream
};

class FragmentSource;

/// A scene in a view, to be rendered by any number of techniques. Several threads may render.
class Frame {
 public:
  /// Triangles seen by a camera. Borrows `scene`. @return kUsage (samples, colours), kGeometry,
  /// kLimit, kCancelled
  static Result<Frame> make(const Scene& scene, const View& view, const FrameOptions& options = {},
                            const Execution& execution = {});
  /// Fragments in the order in which they are submitted. @param colours  of each face, not
  /// premultiplied @return kUsage naming the fragment that is out of range
  static Result<Frame> make(std::span<const ListedFragment> fragments,
                            std::span<const glm::vec4> colours, const FrameOptions& options);
  /// Fragments of a source of this library.
  Frame(std::shared_ptr<const FragmentSource> source, const FrameOptions& options);

  /// The settings given to make().
  [[nodiscard]] const FrameOptions& options() const { return options_; }
  /// Where the fragments come from; for techniques of this library.
  [[nodiscard]] const FragmentSource& source() const { return *source_; }

  /// The picture. Same bits for any number of threads. @return kUsage (settings, a technique that
  /// needs triangles), kLimit, kCancelled
  Result<Rendering> render(const Technique& technique, const Settings& settings = {},
                           const Execution& execution = {}) const;

 private:
  FrameOptions options_;
  std::shared_ptr<const FragmentSource> source_;
};

}  // namespace strata::transparency
