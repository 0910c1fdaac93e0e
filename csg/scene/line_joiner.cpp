#include "csg/scene/line_joiner.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <set>

namespace strata::csg {
namespace {

std::int64_t cell_of(double x, double size) {
  constexpr double kMost = 4e18;
  return static_cast<std::int64_t>(std::clamp(std::floor(x / size), -kMost, kMost));
}

}  // namespace

std::uint32_t LineJoiner::number(const glm::dvec2& p) {
  const double size = 2 * tolerance_;
  // Whatever is within the tolerance lies in the cells of the corners of a box around p.
  for (const double dx : {-tolerance_, tolerance_}) {
    for (const double dy : {-tolerance_, tolerance_}) {
      const auto [first, last] =
          cells_.equal_range({cell_of(p.x + dx, size), cell_of(p.y + dy, size)});
      for (auto i = first; i != last; ++i) {
        if (glm::distance(points_[i->second], p) <= tolerance_) return i->second;
      }
    }
  }
  const auto made = static_cast<std::uint32_t>(points_.size());
  points_.push_back(p);
  cells_.emplace(std::pair(cell_of(p.x, size), cell_of(p.y, size)), made);
  return made;
}

void LineJoiner::add(const glm::dvec2& from, const glm::dvec2& to) {
  const std::uint32_t a = number(from), b = number(to);
  if (a != b) lines_.emplace_back(a, b);
}

std::vector<std::vector<glm::dvec2>> LineJoiner::paths() const {
  std::vector<std::vector<std::uint32_t>> at(points_.size());  // lines, first added first
  for (std::uint32_t i = 0; i < lines_.size(); ++i) {
    at[lines_[i].first].push_back(i);
    at[lines_[i].second].push_back(i);
  }
  std::vector<std::uint32_t> left(points_.size());  // lines at a point that are not used
  for (std::size_t p = 0; p < at.size(); ++p) left[p] = static_cast<std::uint32_t>(at[p].size());
  std::vector<std::uint32_t> looked(points_.size(), 0);  // lines before are used
  std::vector<bool> used(lines_.size(), false);
  std::set<std::uint32_t> ends;  // unused lines that are alone at one of their points
  const auto note = [&](std::uint32_t p) {
    if (left[p] != 1) return;
    for (std::uint32_t& i = looked[p]; i < at[p].size(); ++i) {
      if (!used[at[p][i]]) {
        ends.insert(at[p][i]);
        return;
      }
    }
  };
  for (std::uint32_t p = 0; p < points_.size(); ++p) note(p);
  std::vector<std::vector<glm::dvec2>> paths;
  const auto walk = [&](std::uint32_t line, std::uint32_t from) {
    std::vector<glm::dvec2> path{points_[from]};
    const std::uint32_t start = from;
    while (true) {
      const std::uint32_t to =
          lines_[line].first == from ? lines_[line].second : lines_[line].first;
      used[line] = true;
      ends.erase(line);
      --left[from], --left[to];
      note(from);
      from = to;
      std::uint32_t& i = looked[from];
      while (i < at[from].size() && used[at[from][i]]) ++i;
      if (i == at[from].size()) break;
      path.push_back(points_[from]);
      line = at[from][i];
    }
    if (from != start) path.push_back(points_[from]);
    if (path.size() >= 3) paths.push_back(std::move(path));
  };
  std::uint32_t next = 0;
  while (true) {
    if (!ends.empty()) {
      const std::uint32_t line = *ends.begin();
      walk(line, left[lines_[line].first] == 1 ? lines_[line].first : lines_[line].second);
      continue;
    }
    while (next < lines_.size() && used[next]) ++next;
    if (next == lines_.size()) break;
    walk(next, lines_[next].first);
  }
  return paths;
}

}  // namespace strata::csg
