#pragma once

#include <glm/vec2.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "csg/outline/segments.h"

namespace strata::csg {

struct SvgLine {
  std::vector<glm::dvec2> points;  ///< the first is not repeated at the end
  bool closed = false;
};

/// Reads numbers, commands and flags as the grammar of SVG path data and lists of points has them:
/// `1.5.5-3` are three numbers.
class SvgScanner {
 public:
  explicit SvgScanner(std::string_view text) : text_(text) {}
  [[nodiscard]] bool at_end();
  /// The next letter, or 0 if a number or the end comes.
  char letter();
  /// False when no finite number comes.
  bool number(double& value);
  bool flag(bool& value);
  /// Whether a number comes.
  bool number_follows();
  [[nodiscard]] std::size_t position() const { return at_; }

 private:
  void skip();
  std::string_view text_;
  std::size_t at_ = 0;
};

/// The lines of path data (SVG 1.1, chapter 8); curves are cut as OpenSCAD cuts them, and not more
/// coarsely than `segments`. `error` gets what is wrong, and where; what comes before is kept.
std::vector<SvgLine> svg_path_lines(std::string_view data, const Segments& segments,
                                    std::string& error);

}  // namespace strata::csg
