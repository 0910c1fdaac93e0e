#pragma once

#include <glm/vec2.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "csg/outline/segments.h"

namespace strata::csg {

struct SvgLine {
  std::vector<glm::dvec2> points;  ///< the last point does not repeat the first
  bool closed = false;
};

/// Reads numbers, commands and flags by the grammar of SVG path data and point lists. `1.5.5-3` is
/// three numbers.
class SvgScanner {
 public:
  explicit SvgScanner(std::string_view text) : text_(text) {}
  [[nodiscard]] bool at_end();
  /// Reads the next letter. Returns 0 if a number or the end follows.
  char letter();
  /// @return false when no finite number follows
  bool number(double& value);
  bool flag(bool& value);
  /// Whether a number follows.
  bool number_follows();
  [[nodiscard]] std::size_t position() const { return at_; }

 private:
  void skip();
  std::string_view text_;
  std::size_t at_ = 0;
};

/// The lines of path data (SVG 1.1, chapter 8). Curves are divided as in OpenSCAD, but not more
/// coarsely than `segments`. `error` gets the first fault and its place; the lines before it are
/// kept.
std::vector<SvgLine> svg_path_lines(std::string_view data, const Segments& segments,
                                    std::string& error);

}  // namespace strata::csg
