#pragma once

#include <cstdint>
#include <string>

#include "strata/core/result.h"
#include "strata/gl/shader_program.h"

// The interface between producers of fragments on the GPU (raster/gl) and stores (hashbuffer/gl).

namespace strata::gl {

/// What a pass does with a fragment: GLSL text that defines
///
///     void strata_insert(uint pixel, uint depth, uint payload);
///
/// pixel = y * width + x of the whole screen; depth is clamped to 24 bits; payload is the surface
/// tag [exit:1 | triangle:31]. Fragments outside the pass's rows may be given and are ignored.
/// The text declares names that begin with `store_` or `strata_`, and uses the bindings 8 to 15 of
/// storage blocks and of uniform blocks; 0 to 7 are the producer's. It can be used in any shader
/// stage that has storage blocks. The function returns early for helper invocations by itself only
/// where the producer defines STRATA_FRAGMENT_STAGE before it.
///
/// Programs made from it can be reused: the same text and settings mean the same in every frame.
struct StoreGlsl {
  std::string name;       ///< for error messages
  GlslSettings settings;  ///< extensions and defines that the text needs
  std::string text;       ///< GLSL

  /// The text as a part of a shader. Borrows this object.
  [[nodiscard]] GlslPiece piece() const { return {name, text}; }
  /// Equal in all but the name.
  friend bool operator==(const StoreGlsl& a, const StoreGlsl& b) {
    return a.text == b.text && a.settings.extensions == b.settings.extensions &&
           a.settings.defines == b.settings.defines;
  }
};

/// The rows [begin, end) of the screen.
struct PixelRows {
  std::uint32_t begin = 0;  ///< first row
  std::uint32_t end = 0;    ///< one past the last row
};

/// A source of fragments: produces the same fragments, in any order, each time it is asked.
class Producer {
 public:
  virtual ~Producer() = default;
  [[nodiscard]] virtual std::uint32_t width() const = 0;   ///< pixels
  [[nodiscard]] virtual std::uint32_t height() const = 0;  ///< pixels
  /// Passes every fragment of `rows` to the store's strata_insert once; it may pass others as well.
  /// The store's buffers are bound. Leaves them visible to the shaders that follow.
  [[nodiscard]] virtual Result<void> draw(const StoreGlsl& store, PixelRows rows) = 0;
};

}  // namespace strata::gl
