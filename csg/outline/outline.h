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

/// Outlines have coordinates below this: larger ones could not be subtracted.
inline constexpr double kMostCoordinate = 1e150;

/// A flat region: contours in the plane. Clean regions have counter-clockwise outer contours and
/// clockwise holes, do not cross themselves and are filled by the nonzero rule.
struct Outline {
  std::vector<std::vector<glm::dvec2>> contours;  ///< closed; the last point is not the first again
  [[nodiscard]] bool empty() const { return contours.empty(); }
};

enum class Fill { kEvenOdd, kNonzero };

/// Lets operations on outlines end early: one that is stopped, or meets a limit, says so here and
/// gives an empty outline. Without a job nothing ends early. A stopped operation of Clipper goes on
/// in a thread of its own, whose result is thrown away.
struct OutlineJob {
  explicit OutlineJob(const Execution& given) : execution(given) {}
  /// Whether the result does not count; asks for a stop.
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
/// `polygon`: one path for each contour (empty: all points in order), cleaned by even-odd.
/// @return kInput naming the index that is out of range; the job's error
Result<Outline> make_polygon(std::span<const glm::dvec2> points,
                             std::span<const std::vector<std::uint32_t>> paths,
                             OutlineJob* job = nullptr);

// --- operations (Clipper; coordinates on a fine integer grid) ----------------------------------

[[nodiscard]] Outline clean(const Outline& outline, Fill fill, OutlineJob* job = nullptr);
[[nodiscard]] Outline unite(std::span<const Outline> operands, OutlineJob* job = nullptr);
[[nodiscard]] Outline intersect(std::span<const Outline> operands, OutlineJob* job = nullptr);
/// The first minus all others.
[[nodiscard]] Outline subtract(std::span<const Outline> operands, OutlineJob* job = nullptr);
[[nodiscard]] Outline convex_hull(std::span<const Outline> operands);
/// Empty if an operand is.
[[nodiscard]] Outline minkowski_sum(std::span<const Outline> operands, OutlineJob* job = nullptr);
/// `fill`: without holes.
[[nodiscard]] Outline without_holes(const Outline& outline, OutlineJob* job = nullptr);
/// Rounded joins with `segments` for a circle of the radius; negative shrinks.
[[nodiscard]] Outline offset_round(const Outline& outline, double radius, const Segments& segments,
                                   OutlineJob* job = nullptr);
/// Points that it makes at most, for limits: the joins of a contour turn as far as its corners.
[[nodiscard]] double offset_point_count(const Outline& outline, double radius,
                                        const Segments& segments);
/// Mitered or chamfered joins.
[[nodiscard]] Outline offset_delta(const Outline& outline, double delta, bool chamfer,
                                   OutlineJob* job = nullptr);
/// p' = m * (p, 1); contours are turned when m mirrors.
[[nodiscard]] Outline transform(const Outline& outline, const glm::dmat3& m);
/// `resize` in the plane: see csg_format; 0 keeps an axis, or follows the largest given one.
[[nodiscard]] Outline resize(const Outline& outline, const glm::dvec2& size,
                             const bool (&follow)[2]);

// --- flat to solid ------------------------------------------------------------------------------

struct LinearExtrude {
  glm::dvec3 direction{0, 0, 1};  ///< unit vector
  double height = 100;
  bool centre = false;
  double twist = 0;  ///< degrees, clockwise looking down
  glm::dvec2 scale{1};
  int slices = 0;               ///< 0: from `segments`
  int outline_segments = 0;     ///< newer dialect: divides edges; 0: not
  bool divide_outline = false;  ///< newer dialect: divide edges of twisted outlines
  Segments segments;
};
/// How many pieces an extrusion is made of, for limits.
struct ExtrusionSize {
  double steps = 0;      ///< slices, or steps around the axis
  double triangles = 0;  ///< about
};
[[nodiscard]] ExtrusionSize size_of(const Outline& outline, const LinearExtrude& options);
/// A closed mesh with shared vertices; empty for an empty outline or height <= 0, and beyond 2^28
/// vertices.
[[nodiscard]] TriangleSoup linear_extrude(const Outline& outline, const LinearExtrude& options,
                                          OutlineJob* job = nullptr);

struct RotateExtrude {
  double angle = 360;     ///< degrees
  double start = 0;       ///< degrees; full turns of the older dialect start at 180
  bool round_up = false;  ///< newer dialect: number of steps is rounded up
  Segments segments;
};
[[nodiscard]] ExtrusionSize size_of(const Outline& outline, const RotateExtrude& options);
/// A closed mesh. @return kLimit beyond 2^28 vertices; kGeometry when the outline crosses the axis;
/// the job's error
Result<TriangleSoup> rotate_extrude(const Outline& outline, const RotateExtrude& options,
                                    OutlineJob* job = nullptr);

/// A closed slab between z = low and z = high: flat scenes, 1 mm thick.
[[nodiscard]] TriangleSoup make_slab(const Outline& outline, double low, double high,
                                     OutlineJob* job = nullptr);

/// `roof`: straight skeleton or Voronoi roof over the outline. @return kGeometry if it cannot be
/// done
Result<TriangleSoup> make_roof(const Outline& outline, const std::string& method,
                               const Segments& segments);

/// Triangles of the outline, as mesh/polygons/triangulate.h says.
[[nodiscard]] inline std::vector<glm::uvec3> triangulate(const Outline& outline) {
  return strata::triangulate(outline.contours);
}
/// The same, an outer contour with its holes at a time where there are many: letters of a text.
[[nodiscard]] std::vector<glm::uvec3> triangulate_pieces(const Outline& outline,
                                                         OutlineJob* job = nullptr);

// --- solid to flat ------------------------------------------------------------------------------

/// The shadow of triangles on the xy plane.
[[nodiscard]] Outline shadow(const TriangleSoup& mesh, OutlineJob* job = nullptr);
/// The cross-section at z = 0 of a closed mesh.
[[nodiscard]] Outline cross_section(const TriangleSoup& mesh);

// --- files and text -----------------------------------------------------------------------------

struct OutlineImport {
  std::string layer;  ///< DXF: only this layer; SVG: the id of a group; empty: all
  glm::dvec2 origin{0};
  double scale = 1;
  double dpi = 72;  ///< SVG: pixels an inch where the file gives no unit
  bool centre = false;
  Segments segments;
};
/// An SVG or DXF file, by its extension. Lines of a DXF file whose ends are no farther apart than
/// its last decimal place, if it is the third or a later one, make contours; `warnings` gets a
/// sentence about contours that do not close and lines that are in none. @return kInput naming file
/// and line; kLimit; kCancelled
Result<Outline> read_outline(const std::string& path, const OutlineImport& options,
                             const Execution& execution = {},
                             std::vector<std::string>* warnings = nullptr);

struct TextOptions {
  std::string text, font, direction, language, script, halign = "left", valign = "baseline";
  double size = 10, spacing = 1;
  Segments segments;
};
/// Text as OpenSCAD sets it (FreeType, HarfBuzz, fontconfig); letters are as far apart as in
/// versions after 2021.01, which set them 2.3 % closer. `missing` gets the name of a font
/// that is not installed and was replaced. @return kInput when no font at all is found; kLimit
/// beyond 1 MiB of text or 20 million points; the job's error
Result<Outline> make_text(const TextOptions& options, std::string& missing,
                          OutlineJob* job = nullptr);

}  // namespace strata::csg
