#pragma once

#include <glm/vec2.hpp>
#include <span>

#include "csg/outline/outline.h"

namespace strata::csg {

enum class StrokeCap { kButt, kRound, kSquare };
enum class StrokeJoin { kMiter, kRound, kBevel };

/// The band of `width` along a line, open or closed. Rounded parts have `segments` steps to a full
/// circle.
[[nodiscard]] Outline stroke(std::span<const glm::dvec2> line, bool closed, double width,
                             StrokeCap cap, StrokeJoin join, int segments,
                             OutlineJob* job = nullptr);

}  // namespace strata::csg
