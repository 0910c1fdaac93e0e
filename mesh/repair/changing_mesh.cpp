#include "mesh/repair/changing_mesh.h"

#include <algorithm>

namespace strata {

using exact::FilePoint;
using Index = ChangingMesh::Index;

namespace {

constexpr glm::uvec3 kNoTriangle(0);

}  // namespace

ChangingMesh::ChangingMesh(RoundedMesh& mesh) : mesh_(mesh), first_(mesh.positions.size() + 1, 0) {
  for (const glm::uvec3& t : mesh.triangles) ++first_[t.x], ++first_[t.y], ++first_[t.z];
  Index sum = 0;
  for (Index& first : first_) first = sum += first;
  at_.resize(3 * mesh.triangles.size());
  for (Index t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) at_[--first_[mesh.triangles[t][k]]] = t;
  }
  keep();
}

std::span<const Index> ChangingMesh::around(Index vertex) const {
  const auto found = fans_.find(vertex);
  if (found != fans_.end()) return found->second;
  return std::span(at_).subspan(first_[vertex], first_[vertex + 1] - first_[vertex]);
}

std::vector<Index>& ChangingMesh::fan(Index vertex) {
  const auto [found, added] = fans_.try_emplace(vertex);
  if (added && vertex + 1 < first_.size()) {
    found->second.assign(at_.begin() + first_[vertex], at_.begin() + first_[vertex + 1]);
  }
  return found->second;
}

// Keeps the fans of its corners up to date.
void ChangingMesh::set_triangle(Index t, const glm::uvec3& corners) {
  glm::uvec3& triangle = mesh_.triangles[t];
  if (alive(t)) {
    for (int k = 0; k < 3; ++k) std::erase(fan(triangle[k]), t);
  }
  triangle = corners;
  if (alive(t)) {
    for (int k = 0; k < 3; ++k) fan(triangle[k]).push_back(t);
  }
  mesh_.groups[t] = RoundedMesh::kNoGroup;
}

// A change that is taken back.
void ChangingMesh::change_triangle(Index t, const glm::uvec3& corners) {
  old_triangles_.emplace_back(t, mesh_.triangles[t]);
  set_triangle(t, corners);
  changed_.push_back(t);
}

void ChangingMesh::add_triangle(const glm::uvec3& corners, Index like) {
  mesh_.triangles.push_back(kNoTriangle);
  mesh_.labels.push_back(Index(mesh_.labels[like]));
  mesh_.groups.push_back(RoundedMesh::kNoGroup);
  change_triangle(static_cast<Index>(mesh_.triangles.size() - 1), corners);
}

Index ChangingMesh::triangle_of(Index a, Index b) const {
  for (const Index t : around(a)) {
    const glm::uvec3& c = mesh_.triangles[t];
    if ((c.x == a && c.y == b) || (c.y == a && c.z == b) || (c.z == a && c.x == b)) return t;
  }
  return kNone;
}

Index ChangingMesh::opposite(Index t, Index a, Index b) const {
  const glm::uvec3& c = mesh_.triangles[t];
  return c.x != a && c.x != b ? c.x : c.y != a && c.y != b ? c.y : c.z;
}

std::vector<Index> ChangingMesh::neighbours(Index vertex) const {
  std::vector<Index> result;
  for (const Index t : around(vertex)) {
    for (int k = 0; k < 3; ++k) {
      if (mesh_.triangles[t][k] != vertex) result.push_back(mesh_.triangles[t][k]);
    }
  }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

void ChangingMesh::move(Index vertex, const FilePoint& to) {
  old_positions_.emplace_back(vertex, mesh_.positions[vertex]);
  mesh_.positions[vertex] = to;
  for (const Index t : around(vertex)) {
    old_triangles_.emplace_back(t, mesh_.triangles[t]);
    mesh_.groups[t] = RoundedMesh::kNoGroup;
    changed_.push_back(t);
  }
}

bool ChangingMesh::contract(Index from, Index to) {
  const Index left = triangle_of(from, to), right = triangle_of(to, from);
  if (left == kNone || right == kNone) return false;
  // The link condition: only the two triangles at the edge join neighbours of both ends.
  if (common_neighbours(from, to).size() != 2 || around(from).size() + around(to).size() <= 6) {
    return false;
  }
  const std::span<const Index> view = around(from);
  const std::vector<Index> triangles(view.begin(), view.end());
  for (const Index t : triangles) {
    glm::uvec3 corners = mesh_.triangles[t];
    for (int k = 0; k < 3; ++k) {
      if (corners[k] == from) corners[k] = to;
    }
    change_triangle(t, t == left || t == right ? kNoTriangle : corners);
  }
  return true;
}

std::vector<Index> ChangingMesh::common_neighbours(Index a, Index b) const {
  const std::vector<Index> here = neighbours(a), there = neighbours(b);
  std::vector<Index> both;
  std::set_intersection(here.begin(), here.end(), there.begin(), there.end(),
                        std::back_inserter(both));
  return both;
}

// Collects the triangles around a vertex counter-clockwise, from the edge to one neighbour to that
// to another.
bool ChangingMesh::walk_around(Index centre, Index from, Index to,
                               std::vector<Index>& triangles) const {
  std::size_t steps = around(centre).size();
  for (Index at = from; at != to; --steps) {
    const Index t = triangle_of(centre, at);
    if (t == kNone || steps == 0) return false;
    triangles.push_back(t);
    at = opposite(t, centre, at);
  }
  return true;
}

void ChangingMesh::replace(const std::vector<Index>& triangles, Index vertex, Index by) {
  for (const Index t : triangles) {
    glm::uvec3 corners = mesh_.triangles[t];
    for (int k = 0; k < 3; ++k) {
      if (corners[k] == vertex) corners[k] = by;
    }
    if (corners != mesh_.triangles[t]) change_triangle(t, corners);
  }
}

bool ChangingMesh::contract_and_cut(Index from, Index to) {
  const Index left = triangle_of(from, to), right = triangle_of(to, from);
  if (left == kNone || right == kNone) return false;
  const Index l = opposite(left, from, to), r = opposite(right, from, to);
  std::vector<Index> both = common_neighbours(from, to);
  std::erase_if(both, [&](Index v) { return v == l || v == r; });
  if (l == r || both.size() != 1) return false;
  const Index x = both.front();
  // One side has the triangles around `from` that go from l to x, those around `to` that go from x
  // to l, and those around x in between. The other one has the rest.
  std::vector<Index> here, there, between;
  if (!walk_around(from, l, x, here) || !walk_around(to, x, l, there) ||
      !walk_around(x, from, to, between)) {
    return false;
  }
  const std::size_t ring = here.size() + there.size(),
                    all = around(from).size() + around(to).size() - 4;
  if (ring < 3 || all < ring + 3 || between.size() < 3 || around(x).size() < between.size() + 3) {
    return false;
  }
  const auto copy = static_cast<Index>(mesh_.positions.size());
  mesh_.positions.push_back(FilePoint(mesh_.positions[to]));
  mesh_.positions.push_back(FilePoint(mesh_.positions[x]));
  change_triangle(left, kNoTriangle);
  change_triangle(right, kNoTriangle);
  replace(here, from, copy);
  replace(there, to, copy);
  replace(between, x, copy + 1);
  const std::span<const Index> rest = around(from);
  replace({rest.begin(), rest.end()}, from, to);
  return true;
}

bool ChangingMesh::flip(Index a, Index b) {
  const Index left = triangle_of(a, b), right = triangle_of(b, a);
  if (left == kNone || right == kNone) return false;
  const Index c = opposite(left, a, b), d = opposite(right, a, b);
  if (c == d || triangle_of(c, d) != kNone || triangle_of(d, c) != kNone) return false;
  change_triangle(left, {a, d, c});
  change_triangle(right, {d, b, c});
  return true;
}

bool ChangingMesh::take_out_tetrahedron(Index t) {
  const glm::uvec3 corners = mesh_.triangles[t];
  for (int k = 0; k < 3; ++k) {
    if (around(corners[k]).size() != 3) return false;
  }
  const Index next = triangle_of(corners.y, corners.x);
  const Index apex = opposite(next, corners.x, corners.y);
  if (around(apex).size() != 3) return false;
  std::vector<Index> all(around(apex).begin(), around(apex).end());
  all.push_back(t);
  for (const Index part : all) change_triangle(part, kNoTriangle);
  return true;
}

bool ChangingMesh::divide_edge(Index a, Index b, const FilePoint& at) {
  const Index left = triangle_of(a, b), right = triangle_of(b, a);
  if (left == kNone || right == kNone) return false;
  const Index c = opposite(left, a, b), d = opposite(right, a, b);
  const auto v = static_cast<Index>(mesh_.positions.size());
  mesh_.positions.push_back(at);
  change_triangle(left, {a, v, c});
  change_triangle(right, {v, a, d});
  add_triangle({v, b, c}, left);
  add_triangle({b, v, d}, right);
  return true;
}

void ChangingMesh::divide_triangle(Index t, const FilePoint& at) {
  const glm::uvec3 corners = mesh_.triangles[t];
  const auto v = static_cast<Index>(mesh_.positions.size());
  mesh_.positions.push_back(at);
  change_triangle(t, {corners.x, corners.y, v});
  add_triangle({corners.y, corners.z, v}, t);
  add_triangle({corners.z, corners.x, v}, t);
}

void ChangingMesh::keep() {
  old_triangle_count_ = mesh_.triangles.size();
  old_vertex_count_ = mesh_.positions.size();
  changed_.clear();
  old_triangles_.clear();
  old_positions_.clear();
}

void ChangingMesh::take_back() {
  for (std::size_t i = old_triangles_.size(); i-- > 0;) {
    if (mesh_.triangles[old_triangles_[i].first] != old_triangles_[i].second) {
      set_triangle(old_triangles_[i].first, old_triangles_[i].second);
    }
  }
  for (std::size_t i = old_positions_.size(); i-- > 0;) {
    mesh_.positions[old_positions_[i].first] = old_positions_[i].second;
  }
  for (std::size_t v = old_vertex_count_; v < mesh_.positions.size(); ++v) {
    fans_.erase(static_cast<Index>(v));
  }
  mesh_.triangles.resize(old_triangle_count_);
  mesh_.labels.resize(old_triangle_count_);
  mesh_.groups.resize(old_triangle_count_);
  mesh_.positions.resize(old_vertex_count_);
  keep();
}

}  // namespace strata
