#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "strata/core/result.h"

namespace strata::gl {

/// A part of a shader's text. Error messages give its name and the line within it. Files are
/// embedded by strata_embed_glsl (cmake/StrataTargets.cmake).
struct GlslPiece {
  std::string_view name;  ///< "hashbuffer/gl/insert_32.glsl"
  std::string_view text;  ///< without #version
};

/// Text between `#version 450 core` and the pieces.
struct GlslSettings {
  std::vector<std::string> extensions;                       ///< required ones
  std::vector<std::pair<std::string, std::string>> defines;  ///< macros: name and text
};

/// A linked shader program of the current context. Move-only.
class Program {
 public:
  Program() = default;
  ~Program() { reset(); }
  /// Leaves `other` empty.
  Program(Program&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
  /// Deletes the program held before; leaves `other` empty.
  Program& operator=(Program&& other) noexcept {
    if (this != &other) {
      reset();
      id_ = std::exchange(other.id_, 0);
    }
    return *this;
  }

  /// A program of one compute shader. @return kInternal with the compiler's log, piece and line
  /// named, if the driver refuses it
  [[nodiscard]] static Result<Program> compute(std::span<const GlslPiece> pieces,
                                               const GlslSettings& settings = {});
  /// A program of a vertex and a fragment shader. @return as compute()
  [[nodiscard]] static Result<Program> graphics(std::span<const GlslPiece> vertex,
                                                std::span<const GlslPiece> fragment,
                                                const GlslSettings& settings = {});

  /// The name that OpenGL gave it; 0 if there is none.
  [[nodiscard]] unsigned id() const { return id_; }
  /// True if there is a program.
  [[nodiscard]] explicit operator bool() const { return id_ != 0; }
  /// Makes it the program of what is drawn next.
  void use() const;

  /// Sets a uniform of that name; a uniform that the compiler removed is not an error.
  void set(const char* name, std::uint32_t value) const;
  /// The same for an int.
  void set(const char* name, std::int32_t value) const;
  /// The same for a float.
  void set(const char* name, float value) const;
  /// The same for a uvec2.
  void set(const char* name, std::uint32_t x, std::uint32_t y) const;

  /// Runs a compute program on that many work groups. @pre within Limits::compute_groups
  void dispatch(std::uint32_t x, std::uint32_t y = 1, std::uint32_t z = 1) const;

 private:
  void reset() noexcept;
  unsigned id_ = 0;
};

/// A grid of work groups.
struct Groups {
  std::uint32_t x = 1;  ///< at most 65535
  std::uint32_t y = 1;  ///< rows
};
/// Work groups for `items` items, `group_size` in each, as a grid that every driver takes:
/// 65535 x n. A shader computes its item as
/// `(gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * group_size + local index`, and
/// returns if there is none of that number.
[[nodiscard]] Groups groups_for(std::uint64_t items, std::uint32_t group_size);

}  // namespace strata::gl
