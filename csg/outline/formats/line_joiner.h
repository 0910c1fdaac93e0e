#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <stop_token>
#include <utility>
#include <vector>

namespace strata::csg {

/// A path whose last line does not lead back to where the first begins.
struct OpenPath {
  glm::dvec2 from{0}, to{0};  ///< its two ends
  std::uint32_t tag = 0;      ///< of the line at `from`
  bool is_line = false;       ///< one line alone, which has no area
};

struct JoinedLines {
  /// Paths of at least three points, all meant as closed.
  std::vector<std::vector<glm::dvec2>> paths;
  std::vector<OpenPath> open;
};

/// Joins lines at their ends to paths. Which ends are one point depends on the ends alone, not on
/// the order of the lines, and what is near is so transitively.
class LineJoiner {
 public:
  /// @param reach  how far each end may lie from where it is meant to be
  /// @param tag  names the line in `OpenPath`
  void add(const glm::dvec2& from, const glm::dvec2& to, double reach, std::uint32_t tag);
  [[nodiscard]] std::size_t size() const { return lines_.size(); }
  /// Ends are one point when they are closer than `tolerance`. Then ends where an odd number of
  /// lines ends, at which a path would be open, take in what lies within the reach of both. No
  /// distance is above 1/1000 of the drawing, `tolerance` not above a millionth: a fine curve must
  /// not shrink to a point. Paths that begin where a line is alone come first, then those that
  /// close by themselves. Each line is used once, earlier ones first, as OpenSCAD does: lines drawn
  /// twice cancel when the paths are filled by the even-odd rule.
  /// What is left when a stop is asked for counts for nothing.
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
