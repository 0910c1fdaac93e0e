#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <unordered_map>
#include <utility>
#include <vector>

namespace strata::csg {

/// Joins lines at their ends to paths. Ends closer than the tolerance are one point.
class LineJoiner {
 public:
  explicit LineJoiner(double tolerance) : tolerance_(tolerance) {}

  void add(const glm::dvec2& from, const glm::dvec2& to);
  [[nodiscard]] std::size_t size() const { return lines_.size(); }
  /// Paths of at least three points, all meant as closed: those that begin where a line is alone
  /// first, then those that close by themselves. Each line is used once, earlier ones first, as
  /// OpenSCAD does: lines drawn twice cancel when the paths are filled by the even-odd rule.
  [[nodiscard]] std::vector<std::vector<glm::dvec2>> paths() const;

 private:
  std::uint32_t number(const glm::dvec2& p);

  struct CellHash {
    std::size_t operator()(const std::pair<std::int64_t, std::int64_t>& cell) const {
      const auto x = static_cast<std::uint64_t>(cell.first),
                 y = static_cast<std::uint64_t>(cell.second);
      const std::uint64_t h = x * 0x9e3779b97f4a7c15u ^ (y + 0x165667b1u) * 0xc2b2ae3d27d4eb4fu;
      return static_cast<std::size_t>(h ^ (h >> 31));
    }
  };
  double tolerance_;
  std::vector<glm::dvec2> points_;
  std::unordered_multimap<std::pair<std::int64_t, std::int64_t>, std::uint32_t, CellHash> cells_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> lines_;
};

}  // namespace strata::csg
