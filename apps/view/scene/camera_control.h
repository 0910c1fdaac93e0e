#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string_view>

#include "strata/raster/view.h"

// How a hand moves a camera. Pixels count from the upper left corner of the picture, downwards.

namespace strata::view {

/// OpenSCAD's views.
enum class NamedView { kTop, kBottom, kLeft, kRight, kFront, kBack, kDiagonal };

/// `top`, `bottom`, `left`, `right`, `front`, `back`, `diagonal`.
[[nodiscard]] std::optional<NamedView> find_named_view(std::string_view name);

/// Turns the camera; target and distance stay.
void look_from(Camera& camera, NamedView view);

/// Turns the scene with the mouse: along x about the world's z axis, along y about the screen's
/// horizontal. 0.7 degrees a pixel, as in OpenSCAD.
void orbit(Camera& camera, const glm::dvec2& pixels);

/// World units a pixel is wide at the camera's target.
[[nodiscard]] double world_per_pixel(const Camera& camera, const glm::ivec2& size);

/// Moves the scene with the mouse: what lies at the target's depth stays below the cursor.
void pan(Camera& camera, const glm::dvec2& pixels, const glm::ivec2& size);

/// Nearer by a tenth each step, farther for negative ones. What lies below the cursor at the
/// target's depth stays there. The distance stays within [1e-9, 1e12].
void zoom(Camera& camera, double steps, const glm::dvec2& cursor, const glm::ivec2& size);

/// All of `box` in view, from where the camera looks now.
void view_all(Camera& camera, const Bounds& box, const glm::ivec2& size);

/// A world point as a pixel. Empty when it is not before the eye.
[[nodiscard]] std::optional<glm::dvec2> project(const Camera& camera, const glm::ivec2& size,
                                                const glm::dvec3& world);

/// How far a point that slides along `direction` (world space, of length 1) goes when the mouse
/// moves: the part of the movement that lies along the direction's picture. Where the direction
/// points at the eye, its picture is short and the way up the screen counts instead.
[[nodiscard]] double slide(const Camera& camera, const glm::ivec2& size, const glm::dvec3& point,
                           const glm::dvec3& direction, const glm::dvec2& pixels);

/// The world point of a depth (steps of the view) at a pixel's centre.
[[nodiscard]] glm::dvec3 world_of(const View& view, const glm::dvec2& pixel_centre, double depth);

}  // namespace strata::view
