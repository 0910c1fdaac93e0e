#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "csg/outline/segments.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"

namespace strata::csg {

/// Coordinates of outlines are below this limit. The difference of larger ones could overflow.
inline constexpr double kMostCoordinate = 1e150;

/// A flat region: contours in the plane. A clean outline has counter-clockwise outer contours and
/// clockwise holes; it does not cross itself and is filled by the nonzero rule.
struct Outline {
  std::vector<std::vector<glm::dvec2>> contours;  ///< closed; no point is repeated at the end
  [[nodiscard]] bool empty() const { return contours.empty(); }
};

enum class Fill { kEvenOdd, kNonzero };

/// Lets operations on outlines end early. An operation that is stopped or meets a limit sets
/// `error` and returns an empty outline. Without a job no operation ends early. A stopped Clipper
/// operation runs on in a thread of its own, and its result is dropped.
struct OutlineJob {
  explicit OutlineJob(const Execution& given) : execution(given) {}
  /// Whether the operation has failed or was stopped, so that its result does not count.
  bool ended() {
    if (!error && execution.stop.stop_requested()) error = {ErrorCode::kCancelled, "stopped"};
    return error.has_value();
  }

  const Execution& execution;
  std::optional<Error> error;  ///< kCancelled or kLimit
};

// --- shapes ------------------------------------------------------------------------------------

[[nodiscard]] Outline make_square(const glm::dvec2& size, bool centre);
[[nodiscard]] Outline make_circle(double radius, const Segments& segments);
/// Each path makes one contour; without paths all points in order make one. The result is cleaned
/// by the even-odd rule. @return kInput naming an index that is out of range; the job's error
Result<Outline> make_polygon(std::span<const glm::dvec2> points,
                             std::span<const std::vector<std::uint32_t>> paths,
                             OutlineJob* job = nullptr);

// --- operations (Clipper; coordinates on a fine integer grid) ----------------------------------

[[nodiscard]] Outline clean(const Outline& outline, Fill fill, OutlineJob* job = nullptr);
[[nodiscard]] Outline unite(std::span<const Outline> operands, OutlineJob* job = nullptr);
[[nodiscard]] Outline intersect(std::span<const Outline> operands, OutlineJob* job = nullptr);
/// The first operand minus all others.
[[nodiscard]] Outline subtract(std::span<const Outline> operands, OutlineJob* job = nullptr);
[[nodiscard]] Outline convex_hull(std::span<const Outline> operands);
/// Empty if any operand is empty.
[[nodiscard]] Outline minkowski_sum(std::span<const Outline> operands, OutlineJob* job = nullptr);
/// OpenSCAD's `fill`: the outline without its holes.
[[nodiscard]] Outline without_holes(const Outline& outline, OutlineJob* job = nullptr);
/// Offset with rounded joins, `segments` to a circle of the radius. A negative radius shrinks.
[[nodiscard]] Outline offset_round(const Outline& outline, double radius, const Segments& segments,
                                   OutlineJob* job = nullptr);
/// An upper bound of the points that offset_round() makes, for limits. A contour's joins turn as
/// far in total as its corners do.
[[nodiscard]] double offset_point_count(const Outline& outline, double radius,
                                        const Segments& segments);
/// Offset with mitred or chamfered joins.
[[nodiscard]] Outline offset_delta(const Outline& outline, double delta, bool chamfer,
                                   OutlineJob* job = nullptr);
/// Applies p' = m * (p, 1). Contours are reversed when m mirrors.
[[nodiscard]] Outline transform(const Outline& outline, const glm::dmat3& m);
/// OpenSCAD's `resize` in the plane (see csg_format). A size of 0 keeps that axis; with `follow`
/// the axis is scaled like the one with the largest given size.
[[nodiscard]] Outline resize(const Outline& outline, const glm::dvec2& size,
                             const bool (&follow)[2]);

}  // namespace strata::csg
