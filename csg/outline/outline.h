#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "csg/outline/segments.h"
#include "mesh/polygons/triangulate.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/mesh/triangle_soup.h"

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

// --- flat to solid ------------------------------------------------------------------------------

struct LinearExtrude {
  glm::dvec3 direction{0, 0, 1};  ///< unit vector
  double height = 100;
  bool centre = false;
  double twist = 0;  ///< degrees, clockwise looking down
  glm::dvec2 scale{1};
  int slices = 0;               ///< 0: the number follows from `segments`
  int outline_segments = 0;     ///< newer dialect: divide edges to this number; 0: do not
  bool divide_outline = false;  ///< newer dialect: divide the edges of twisted outlines
  Segments segments;
};
/// The number of pieces that an extrusion makes, for limits.
struct ExtrusionSize {
  double steps = 0;      ///< slices, or steps around the axis
  double triangles = 0;  ///< approximate
};
[[nodiscard]] ExtrusionSize size_of(const Outline& outline, const LinearExtrude& options);
/// A closed mesh with shared vertices. Empty for an empty outline, for height <= 0 and beyond 2^28
/// vertices.
[[nodiscard]] TriangleSoup linear_extrude(const Outline& outline, const LinearExtrude& options,
                                          OutlineJob* job = nullptr);

struct RotateExtrude {
  double angle = 360;     ///< degrees
  double start = 0;       ///< degrees; full turns of the older dialect start at 180
  bool round_up = false;  ///< newer dialect: round the number of steps up
  Segments segments;
};
[[nodiscard]] ExtrusionSize size_of(const Outline& outline, const RotateExtrude& options);
/// A closed mesh. @return kLimit beyond 2^28 vertices; kGeometry when the outline crosses the axis;
/// the job's error
Result<TriangleSoup> rotate_extrude(const Outline& outline, const RotateExtrude& options,
                                    OutlineJob* job = nullptr);

/// A closed slab between z = low and z = high. Flat scenes are shown as slabs 1 mm thick.
[[nodiscard]] TriangleSoup make_slab(const Outline& outline, double low, double high,
                                     OutlineJob* job = nullptr);

/// OpenSCAD's `roof`: a straight-skeleton or Voronoi roof over the outline. @return kGeometry if
/// the roof cannot be constructed
Result<TriangleSoup> make_roof(const Outline& outline, const std::string& method,
                               const Segments& segments);

/// Triangulates the outline as a whole (mesh/polygons/triangulate.h).
[[nodiscard]] inline std::vector<glm::uvec3> triangulate(const Outline& outline) {
  return strata::triangulate(outline.contours);
}
/// Triangulates piece by piece, an outer contour with its holes at a time, where there are many
/// pieces, such as the letters of a text.
[[nodiscard]] std::vector<glm::uvec3> triangulate_pieces(const Outline& outline,
                                                         OutlineJob* job = nullptr);

// --- solid to flat ------------------------------------------------------------------------------

/// The shadow of triangles on the xy plane.
[[nodiscard]] Outline shadow(const TriangleSoup& mesh, OutlineJob* job = nullptr);
/// The cross-section at z = 0 of a closed mesh.
[[nodiscard]] Outline cross_section(const TriangleSoup& mesh);

// --- files and text -----------------------------------------------------------------------------

struct OutlineImport {
  std::string layer;  ///< read only this DXF layer, or this SVG group by its id; empty: all
  glm::dvec2 origin{0};
  double scale = 1;
  double dpi = 72;  ///< SVG: pixels per inch, where the file gives no unit
  bool centre = false;
  Segments segments;
};
/// Reads an SVG or DXF file, chosen by its extension. Lines of a DXF file are joined into contours
/// when their ends are no farther apart than one unit of the file's last decimal place, provided
/// the file writes at least three places. `warnings` gets a sentence about contours that do not
/// close and about lines that belong to no contour. @return kInput naming file and line; kLimit;
/// kCancelled
Result<Outline> read_outline(const std::string& path, const OutlineImport& options,
                             const Execution& execution = {},
                             std::vector<std::string>* warnings = nullptr);

struct TextOptions {
  std::string text, font, direction, language, script, halign = "left", valign = "baseline";
  double size = 10, spacing = 1;
  Segments segments;
};
/// Text as OpenSCAD sets it (FreeType, HarfBuzz, fontconfig). The spacing of letters is that of
/// versions after 2021.01; older versions set letters 2.3 % closer. `missing` gets the name of a
/// requested font that is not installed and was replaced. @return kInput when no font at all is
/// found; kLimit beyond 1 MiB of text or 20 million points; the job's error
Result<Outline> make_text(const TextOptions& options, std::string& missing,
                          OutlineJob* job = nullptr);

}  // namespace strata::csg
