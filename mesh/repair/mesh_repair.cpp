#include "mesh/repair/mesh_repair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <optional>
#include <tuple>

#include "mesh/check/triangles_meet.h"
#include "mesh/repair/changing_mesh.h"
#include "mesh/repair/near_triangles.h"

namespace strata {
namespace {

using exact::FilePoint;
using Index = std::uint32_t;

constexpr int kMostRounds = 5;
// Edges are short, and vertices near, up to so many distances between neighbouring positions.
constexpr double kNear = 16;
constexpr std::size_t kMostConflicts =
    1000;  // of the triangles around a step: more are not told apart

using Key = std::array<std::int64_t, 3>;
Key key(const FilePoint& p) { return {p.x, p.y, p.z}; }

class Repair {
 public:
  /// @param thorough  whether all steps are tried before one is chosen
  Repair(RoundedMesh& mesh, const WrittenPositions& written, bool thorough)
      : written_(written), thorough_(thorough), mesh_(mesh), near_(mesh) {}

  /// Mends what it can. @return how many changes were kept
  std::size_t run(std::vector<MeshConflict> conflicts, const std::stop_token& stop);

 private:
  // The edge from a to b of a triangle, and its third corner.
  struct Edge {
    Index a, b, c;
  };

  std::array<Key, 3> sorted_corners(Index t) const;
  double unit(Index vertex) const;
  bool mend(const MeshConflict& conflict);
  bool contract_points(const std::vector<Edge>& edges);
  bool join(Index a, Index b);
  bool close_flap(const MeshConflict& conflict);
  void accept();
  void try_contractions(const std::vector<Edge>& edges);
  void try_flips(const std::vector<Edge>& edges);
  void try_snaps(const MeshConflict& conflict);
  void try_moves(const std::vector<Index>& vertices, int distance);
  bool has_conflict(const MeshConflict& conflict) const;
  std::vector<Edge> edges_of(const MeshConflict& conflict) const;
  template <class Step>
  void try_step(const std::vector<Index>& ends, const Step& step);

  const WrittenPositions& written_;
  bool thorough_;
  ChangingMesh mesh_;
  NearTriangles near_;
  bool done_ = false;                // the conflict at hand is mended
  std::size_t best_gain_ = 0;        // conflicts that the best step took away
  std::function<bool()> best_step_;  // to be made again
  std::vector<Index> ends_;          // of the last step that was tried
  std::vector<Index> triangles_;     // around them
  std::size_t before_ = 0;           // conflicts of these
};

std::array<Key, 3> Repair::sorted_corners(Index t) const {
  std::array<Key, 3> keys;
  for (int k = 0; k < 3; ++k) {
    keys[static_cast<std::size_t>(k)] = key(mesh_.position(mesh_.triangle(t)[k]));
  }
  std::sort(keys.begin(), keys.end());
  return keys;
}

// The largest distance from a position to the next ones.
double Repair::unit(Index vertex) const {
  const FilePoint& at = mesh_.position(vertex);
  std::int64_t result = 1;
  for (int k = 0; k < 3; ++k) {
    result = std::max(result, written_.neighbour(at, k, true)[k] - at[k]);
    result = std::max(result, at[k] - written_.neighbour(at, k, false)[k]);
  }
  return static_cast<double>(result);
}

bool Repair::has_conflict(const MeshConflict& conflict) const {
  const auto corners = [this](Index t) {
    const glm::uvec3& c = mesh_.triangle(t);
    return TriangleCorners{mesh_.position(c.x), mesh_.position(c.y), mesh_.position(c.z)};
  };
  if (!mesh_.alive(conflict.first) || !mesh_.alive(conflict.second)) return false;
  const TriangleCorners a = corners(conflict.first);
  if (conflict.first == conflict.second) return !has_area(a[0], a[1], a[2]);
  return !is_clean(triangles_meet(a, corners(conflict.second)));
}

// Makes a step, counts the conflicts of the triangles around it, which before_ tells for the mesh
// as it is, and takes the step back.
template <class Step>
void Repair::try_step(const std::vector<Index>& ends, const Step& step) {
  if (done_) return;
  if (ends != ends_) {
    ends_ = ends;
    triangles_.clear();
    for (const Index vertex : ends) {
      const auto around = mesh_.around(vertex);
      triangles_.insert(triangles_.end(), around.begin(), around.end());
    }
    before_ = near_.count_conflicts(triangles_, kMostConflicts);
  }
  if (before_ <= best_gain_) return;
  if (!step()) {
    mesh_.take_back();
    return;
  }
  std::vector<Index> changed = triangles_;
  changed.insert(changed.end(), mesh_.changed().begin(), mesh_.changed().end());
  const std::size_t after = near_.count_conflicts(std::move(changed), before_ - best_gain_);
  mesh_.take_back();
  if (after + best_gain_ >= before_) return;
  best_gain_ = before_ - after;
  best_step_ = step;
  done_ = after == 0;
}

std::vector<Repair::Edge> Repair::edges_of(const MeshConflict& conflict) const {
  std::vector<Edge> edges;
  for (const Index t : {conflict.first, conflict.second}) {
    const glm::uvec3& c = mesh_.triangle(t);
    for (int k = 0; k < 3; ++k) edges.push_back({c[k], c[(k + 1) % 3], c[(k + 2) % 3]});
    if (conflict.first == conflict.second) break;
  }
  const auto order = [this](const Edge& edge) {
    const Key a = key(mesh_.position(edge.a)), b = key(mesh_.position(edge.b));
    const glm::dvec3 along(mesh_.position(edge.b) - mesh_.position(edge.a));
    return std::tuple(glm::dot(along, along), std::min(a, b), std::max(a, b),
                      key(mesh_.position(edge.c)));
  };
  std::sort(edges.begin(), edges.end(),
            [&](const Edge& x, const Edge& y) { return order(x) < order(y); });
  return edges;
}

// The shortest edges first; onto the end that is less.
void Repair::try_contractions(const std::vector<Edge>& edges) {
  for (const Edge& edge : edges) {
    const FilePoint &a = mesh_.position(edge.a), &b = mesh_.position(edge.b);
    if (glm::length(glm::dvec3(b - a)) > kNear * std::max(unit(edge.a), unit(edge.b))) continue;
    const bool a_first = key(a) < key(b);
    const Index least = a_first ? edge.a : edge.b, other = a_first ? edge.b : edge.a;
    try_step({edge.a, edge.b}, [this, least, other] { return mesh_.contract(other, least); });
    try_step({edge.a, edge.b}, [this, least, other] { return mesh_.contract(least, other); });
  }
}

// Edges that the third corner lies on, nearly.
void Repair::try_flips(const std::vector<Edge>& edges) {
  for (auto edge = edges.rbegin(); edge != edges.rend(); ++edge) {
    const Index a = edge->a, b = edge->b;
    const glm::dvec3 along(mesh_.position(b) - mesh_.position(a)),
        to(mesh_.position(edge->c) - mesh_.position(a));
    const double length = glm::length(along);
    if (glm::length(glm::cross(along, to)) > kNear * unit(edge->c) * length) continue;
    std::vector<Index> ends = {a, b, edge->c};
    for (const Index t : mesh_.around(a)) {  // the triangle on the other side
      const glm::uvec3& c = mesh_.triangle(t);
      for (int k = 0; k < 3; ++k) {
        if (c[k] == b && c[(k + 1) % 3] == a) ends.push_back(c[(k + 2) % 3]);
      }
    }
    try_step(ends, [this, a, b] { return mesh_.flip(a, b); });
  }
}

// A vertex of one triangle is near the other one: an equal position is put into that one's nearest
// vertex, edge, or inside.
void Repair::try_snaps(const MeshConflict& conflict) {
  if (conflict.first == conflict.second) return;
  for (const auto& [s, t] :
       {std::pair(conflict.first, conflict.second), std::pair(conflict.second, conflict.first)}) {
    const glm::uvec3 corners = mesh_.triangle(t);
    const std::vector<Index> ends = {corners.x, corners.y, corners.z};
    for (int k = 0; k < 3; ++k) {
      const Index vertex = mesh_.triangle(s)[k];
      const FilePoint at = mesh_.position(vertex);
      const double near = kNear * unit(vertex);
      bool known = false;
      for (const Index end : ends) {
        known = known || mesh_.position(end) == at;
        if (glm::length(glm::dvec3(mesh_.position(end) - at)) > near) continue;
        try_step({end}, [this, end, at] {
          mesh_.move(end, at);
          return true;
        });
      }
      if (known) continue;
      bool inside = true;
      for (int i = 0; i < 3; ++i) {
        const Index a = corners[i], b = corners[(i + 1) % 3];
        const glm::dvec3 along(mesh_.position(b) - mesh_.position(a)), to(at - mesh_.position(a));
        const double length = glm::length(along), share = glm::dot(along, to);
        if (share <= 0 || share >= length * length ||
            glm::length(glm::cross(along, to)) > near * length) {
          continue;
        }
        inside = false;
        try_step({a, b}, [this, a, b, at] { return mesh_.divide_edge(a, b, at); });
      }
      if (!inside) continue;
      const glm::dvec3 u(mesh_.position(corners.y) - mesh_.position(corners.x)),
          v(mesh_.position(corners.z) - mesh_.position(corners.x)),
          to(at - mesh_.position(corners.x)), normal = glm::cross(u, v);
      if (std::abs(glm::dot(normal, to)) > near * glm::length(normal)) continue;
      try_step(ends, [this, t = t, at] {
        mesh_.divide_triangle(t, at);
        return true;
      });
    }
  }
}

// To the 26 positions around, or to farther ones.
void Repair::try_moves(const std::vector<Index>& vertices, int distance) {
  for (const Index vertex : vertices) {
    for (int direction = 0; direction < 27; ++direction) {
      if (direction == 13) continue;  // no move
      FilePoint to = mesh_.position(vertex);
      for (int k = 0, rest = direction; k < 3; ++k, rest /= 3) {
        if (rest % 3 == 1) continue;
        for (int i = 0; i < distance; ++i) to = written_.neighbour(to, k, rest % 3 == 2);
      }
      try_step({vertex}, [this, vertex, to] {
        mesh_.move(vertex, to);
        return true;
      });
      if (done_) return;
    }
  }
}

// Contracts an edge whose ends have one position.
bool Repair::join(Index a, Index b) {
  const Index from = std::max(a, b), to = std::min(a, b);
  return mesh_.contract(from, to) || mesh_.contract_and_cut(from, to);
}

// Edges whose ends have one position are contracted if the mesh stays a manifold: no point of it
// moves.
bool Repair::contract_points(const std::vector<Edge>& edges) {
  for (const Edge& edge : edges) {
    if (mesh_.position(edge.a) != mesh_.position(edge.b)) continue;
    if (join(edge.a, edge.b)) {
      accept();
      return true;
    }
  }
  return false;
}

// Two triangles at an edge that have the same positions, and no room between them: both are taken
// out, and the other edges of one are joined to those of the other.
bool Repair::close_flap(const MeshConflict& conflict) {
  const glm::uvec3 s = mesh_.triangle(conflict.first), t = mesh_.triangle(conflict.second);
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      const Index a = s[i], b = s[(i + 1) % 3], c = s[(i + 2) % 3], d = t[(k + 2) % 3];
      if (t[k] != b || t[(k + 1) % 3] != a || mesh_.position(c) != mesh_.position(d)) continue;
      if (mesh_.flip(a, b) && join(c, d)) {
        accept();
        return true;
      }
      mesh_.take_back();
    }
  }
  return false;
}

void Repair::accept() {
  near_.enter(mesh_.changed());
  mesh_.keep();
  ends_.clear();
}

bool Repair::mend(const MeshConflict& conflict) {
  done_ = false;
  best_gain_ = 0;
  ends_.clear();
  const std::vector<Edge> edges = edges_of(conflict);
  if (contract_points(edges) || close_flap(conflict)) return true;
  std::vector<Index> vertices;
  for (const Edge& edge : edges) vertices.push_back(edge.a);
  for (const Index t : {conflict.first, conflict.second}) {
    try_step(vertices, [this, t] { return mesh_.take_out_tetrahedron(t); });
  }
  try_contractions(edges);
  const auto go_on = [this] { return best_gain_ == 0 || thorough_; };
  if (go_on()) try_flips(edges);
  if (go_on()) try_snaps(conflict);
  std::sort(vertices.begin(), vertices.end(),
            [this](Index a, Index b) { return key(mesh_.position(a)) < key(mesh_.position(b)); });
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  for (int distance = 1; distance <= (best_gain_ > 0 ? 1 : 16) && go_on(); distance *= 2) {
    try_moves(vertices, distance);
  }
  if (best_gain_ == 0) return false;
  best_step_();
  accept();
  return true;
}

std::size_t Repair::run(std::vector<MeshConflict> conflicts, const std::stop_token& stop) {
  const auto order = [this](const MeshConflict& conflict) {
    const auto a = sorted_corners(conflict.first), b = sorted_corners(conflict.second);
    return std::pair(std::min(a, b), std::max(a, b));
  };
  std::sort(conflicts.begin(), conflicts.end(),
            [&](const MeshConflict& a, const MeshConflict& b) { return order(a) < order(b); });
  std::size_t count = 0;
  for (const MeshConflict& conflict : conflicts) {
    // A step may leave the conflict, and take others away.
    for (int i = 0; i < 4 && has_conflict(conflict) && !stop.stop_requested(); ++i) {
      if (!mend(conflict)) break;
      ++count;
    }
  }
  return count;
}

void remove_dead(RoundedMesh& mesh) {
  std::size_t count = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.triangles[t].x == mesh.triangles[t].y) continue;
    mesh.triangles[count] = mesh.triangles[t];
    mesh.labels[count] = mesh.labels[t];
    mesh.groups[count++] = mesh.groups[t];
  }
  mesh.triangles.resize(count);
  mesh.labels.resize(count);
  mesh.groups.resize(count);
}

tl::unexpected<Error> too_many(const RoundedMesh& mesh, const WrittenPositions& written,
                               const std::vector<MeshConflict>& conflicts) {
  const glm::dvec3 at = written.world(mesh.positions[mesh.triangles[conflicts.front().first].x]);
  return fail(ErrorCode::kGeometry,
              "rounding positions to {} makes {} pairs of triangles meet, one near ({}, {}, {}), "
              "which small changes do not mend; {}",
              written.as_float() ? "float" : "double", conflicts.size(), at.x, at.y, at.z,
              written.as_float() ? "a format with double positions or fewer --bits may help"
                                 : "fewer --bits may help");
}

}  // namespace

Result<MeshRepair> repair_mesh(RoundedMesh& mesh, const WrittenPositions& written,
                               const Execution& execution) {
  MeshRepair result;
  std::optional<RoundedMesh> original;  // for a second try, which takes longer
  bool thorough = false;
  while (true) {
    Result<std::vector<MeshConflict>> conflicts = find_conflicts(mesh, execution);
    if (!conflicts) return tl::unexpected(conflicts.error());
    if (conflicts->empty()) return result;
    set_groups(mesh, *conflicts);  // what is changed from here on is searched again
    if (!original) original = mesh;
    const std::size_t mended = result.rounds < kMostRounds
                                   ? Repair(mesh, written, thorough).run(*conflicts, execution.stop)
                                   : 0;
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    if (mended > 0) {
      result.places += mended;
      ++result.rounds;
      remove_dead(mesh);
      continue;
    }
    if (thorough) return too_many(mesh, written, *conflicts);
    thorough = true;
    mesh = *original;
    result = {};
  }
}

}  // namespace strata
