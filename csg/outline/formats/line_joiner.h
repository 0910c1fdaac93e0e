#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <stop_token>
#include <utility>
#include <vector>

namespace strata::csg {

/// A path that does not return to its start.
struct OpenPath {
  glm::dvec2 from{0}, to{0};  ///< its two ends
  std::uint32_t tag = 0;      ///< tag of the line at `from`
  bool is_line = false;       ///< the path is a single line, which has no area
};

struct JoinedLines {
  /// Paths of at least three points. All of them are to be filled as closed contours.
  std::vector<std::vector<glm::dvec2>> paths;
  std::vector<OpenPath> open;
};

/// Joins lines at their ends into paths. The positions of the ends alone decide which of them are
/// one point, whatever the order of the lines. Nearness is transitive.
class LineJoiner {
 public:
  /// @param reach  how far each end may lie from its intended position
  /// @param tag  names the line in `OpenPath`
  void add(const glm::dvec2& from, const glm::dvec2& to, double reach, std::uint32_t tag);
  [[nodiscard]] std::size_t size() const { return lines_.size(); }
  /// Two ends are one point when they are closer than `tolerance`. Then points where an odd number
  /// of lines ends, at which a path would be open, are united with ends that lie within the sum of
  /// both reaches. To keep fine curves from shrinking to a point, `tolerance` is limited to 1e-6 of
  /// the drawing's size and distances to 1/1000 of it.
  /// Paths that begin at a line's free end come first, then closed paths. Each line is used once,
  /// earlier lines first, as in OpenSCAD: lines drawn twice cancel when the paths are filled by the
  /// even-odd rule. After a stop request the result is meaningless.
  [[nodiscard]] JoinedLines join(double tolerance, const std::stop_token& stop = {}) const;

 private:
  struct Line {
    glm::dvec2 ends[2];
    double reach = 0;
    std::uint32_t tag = 0;
  };
  std::vector<Line> lines_;
};

}  // namespace strata::csg
