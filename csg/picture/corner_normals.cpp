#include "csg/picture/corner_normals.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numeric>
#include <utility>

// Weights by angle are those of G. Thuermer and C. Wuethrich, "Computing vertex normals from
// polygonal facets" (1998). We differ: a face stops counting where it is turned far away from the
// face whose corner it is, so that the tip of a cone does not look along its axis.

namespace strata::csg {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;
/// Faces of one smooth surface count for each other up to this many creases.
constexpr double kFarthestCreases = 2.5;
/// From the cosine on, a corner's normal is that of its face: 0.05 degrees.
constexpr double kSame = 1.0 - 4e-7;
constexpr std::size_t kVerticesAtOnce = 4096;

template <class Body>
void for_ranges(const Execution& execution, std::size_t count, Body&& body) {
  parallel_for(execution, (count + kVerticesAtOnce - 1) / kVerticesAtOnce,
               [&](std::size_t range, int) {
                 for (std::size_t i = range * kVerticesAtOnce;
                      i < std::min(count, (range + 1) * kVerticesAtOnce); ++i)
                   body(i);
               });
}

/// The first vertex at the position of each.
class Welds {
 public:
  Welds(std::span<const glm::dvec3> positions, const Execution& execution)
      : positions_(positions), slots_(std::bit_ceil(positions.size() * 2 + 1)) {
    for (auto& slot : slots_) slot.store(kNone, std::memory_order_relaxed);
    for_ranges(execution, positions.size(),
               [&](std::size_t i) { insert(static_cast<std::uint32_t>(i)); });
    first_.resize(positions.size());
    for_ranges(execution, positions.size(),
               [&](std::size_t i) { first_[i] = slot_of(static_cast<std::uint32_t>(i)).load(); });
  }
  [[nodiscard]] std::vector<std::uint32_t>& first() { return first_; }

 private:
  using Bits = std::array<std::uint64_t, 3>;
  [[nodiscard]] Bits bits(std::uint32_t vertex) const {
    const glm::dvec3 p = positions_[vertex] + 0.0;  // -0 becomes 0
    return {std::bit_cast<std::uint64_t>(p.x), std::bit_cast<std::uint64_t>(p.y),
            std::bit_cast<std::uint64_t>(p.z)};
  }
  [[nodiscard]] std::size_t hash(const Bits& position) const {
    std::uint64_t h = 0;
    for (const std::uint64_t one : position) {
      h = (h ^ one) * 0x9e3779b97f4a7c15u;
      h ^= h >> 32;
    }
    return static_cast<std::size_t>(h) & (slots_.size() - 1);
  }
  void insert(std::uint32_t vertex) {
    const Bits position = bits(vertex);
    for (std::size_t at = hash(position);; at = (at + 1) & (slots_.size() - 1)) {
      std::uint32_t found = slots_[at].load();
      if (found == kNone && slots_[at].compare_exchange_strong(found, vertex)) return;
      if (bits(found) != position) continue;
      while (vertex < found && !slots_[at].compare_exchange_weak(found, vertex)) {
      }
      return;
    }
  }
  [[nodiscard]] std::atomic<std::uint32_t>& slot_of(std::uint32_t vertex) {
    const Bits position = bits(vertex);
    std::size_t at = hash(position);
    while (bits(slots_[at].load()) != position) at = (at + 1) & (slots_.size() - 1);
    return slots_[at];
  }

  std::span<const glm::dvec3> positions_;
  std::vector<std::atomic<std::uint32_t>> slots_;
  std::vector<std::uint32_t> first_;
};

/// The angle of a cosine, off by less than 1e-4 (M. Abramowitz and I. Stegun, 4.4.45), from
/// arithmetic that is the same on every machine.
double angle_of(double cosine) {
  const double x = std::min(1.0, std::abs(cosine));
  const double angle =
      std::sqrt(1.0 - x) * (1.5707288 + x * (-0.2121144 + x * (0.0742610 + x * -0.0187293)));
  return cosine < 0 ? 3.14159265358979 - angle : angle;
}

/// The normals of the corners that meet at one vertex. Scratch of one thread.
class Fan {
 public:
  /// @param crease, farthest  cosines
  Fan(double crease, double farthest)
      : crease_(crease),
        half_crease_(std::sqrt(std::max(0.0, 0.5 + 0.5 * crease))),
        farthest_(farthest) {}

  void clear() { corners_.clear(); }
  /// @param next, before  the other vertices of the triangle @param normal  of length 1
  void add(std::uint32_t next, std::uint32_t before, const glm::dvec3& normal, double angle) {
    corners_.push_back({next, before, static_cast<std::uint32_t>(corners_.size()), normal, angle});
  }
  /// The normal of each corner, in the order in which they came.
  [[nodiscard]] const std::vector<glm::dvec3>& normals() {
    const auto count = static_cast<std::uint32_t>(corners_.size());
    result_.resize(count);
    if (one_surface()) return result_;
    connect();
    constexpr std::uint32_t kFew = 256;  // beyond, in proportion to the number
    if (count > kFew) sums_.assign(count, glm::dvec3(0.0));
    for (std::uint32_t i = 0; i < count && count > kFew; ++i) {
      sums_[root(i)] += corners_[i].angle * corners_[i].normal;
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      glm::dvec3 sum(0.0);
      for (std::uint32_t j = 0; j < count && count <= kFew; ++j) {
        if (root(i) == root(j) && glm::dot(corners_[i].normal, corners_[j].normal) >= farthest_) {
          sum += corners_[j].angle * corners_[j].normal;
        }
      }
      if (count > kFew) sum = sums_[root(i)];
      const double length = glm::length(sum);
      result_[i] = length > 0 ? sum / length : corners_[i].normal;
    }
    return result_;
  }

 private:
  struct Corner {
    std::uint32_t next, before, group;
    glm::dvec3 normal;
    double angle;
  };

  /// Most fans turn so little that all of it is one surface: no two normals are a crease apart.
  [[nodiscard]] bool one_surface() {
    glm::dvec3 sum(0.0);
    for (const Corner& corner : corners_) {
      if (glm::dot(corner.normal, corners_.front().normal) < half_crease_) return false;
      sum += corner.angle * corner.normal;
    }
    const double length = glm::length(sum);
    if (!(length > 0)) return false;
    std::fill(result_.begin(), result_.end(), sum / length);
    return true;
  }
  [[nodiscard]] std::uint32_t root(std::uint32_t i) {
    while (corners_[i].group != i) i = corners_[i].group = corners_[corners_[i].group].group;
    return i;
  }
  /// Unites the groups of corners that share an edge which is no crease.
  void connect() {
    by_next_.resize(corners_.size());
    std::iota(by_next_.begin(), by_next_.end(), 0u);
    std::sort(by_next_.begin(), by_next_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(corners_[a].next, a) < std::pair(corners_[b].next, b);
    });
    for (std::uint32_t i = 0; i < corners_.size(); ++i) {
      constexpr int kMost = 8;  // faces at one edge that are looked at
      auto at = std::lower_bound(by_next_.begin(), by_next_.end(), corners_[i].before,
                                 [&](std::uint32_t corner, std::uint32_t vertex) {
                                   return corners_[corner].next < vertex;
                                 });
      for (int tried = 0; tried < kMost && at != by_next_.end(); ++tried, ++at) {
        if (corners_[*at].next != corners_[i].before) break;
        if (glm::dot(corners_[i].normal, corners_[*at].normal) < crease_) continue;
        const std::uint32_t a = root(i), b = root(*at);
        corners_[std::max(a, b)].group = std::min(a, b);
      }
    }
  }

  double crease_, half_crease_, farthest_;
  std::vector<Corner> corners_;
  std::vector<std::uint32_t> by_next_;
  std::vector<glm::dvec3> sums_, result_;
};

/// Which corners meet at each vertex: [offsets[v], offsets[v + 1]) of `corners`, increasing.
struct CornersOfVertices {
  std::vector<std::uint32_t> offsets, corners;

  CornersOfVertices(std::span<const glm::uvec3> triangles, const std::vector<std::uint32_t>& first,
                    const Execution& execution)
      : offsets(first.size() + 1, 0), corners(triangles.size() * 3) {
    std::vector<std::atomic<std::uint32_t>> ends(first.size());
    for_ranges(execution, triangles.size(), [&](std::size_t t) {
      for (int c = 0; c < 3; ++c) ++ends[first[triangles[t][c]]];
    });
    for (std::size_t v = 0; v < first.size(); ++v) {
      offsets[v + 1] = offsets[v] + ends[v].load();
      ends[v].store(offsets[v]);
    }
    for_ranges(execution, triangles.size(), [&](std::size_t t) {
      for (std::uint32_t c = 0; c < 3; ++c) {
        const std::uint32_t vertex = first[triangles[t][static_cast<int>(c)]];
        corners[ends[vertex]++] = static_cast<std::uint32_t>(t * 3 + c);
      }
    });
    for_ranges(execution, first.size(), [&](std::size_t v) {
      std::sort(corners.begin() + offsets[v], corners.begin() + offsets[v + 1]);
    });
  }
};

}  // namespace

CornerNormals::CornerNormals(std::span<const glm::dvec3> positions,
                             std::span<const glm::uvec3> triangles, double crease,
                             const Execution& execution) {
  constexpr std::size_t kMostTriangles = kNone / 3;
  if (!(crease > 0) || triangles.empty() || triangles.size() > kMostTriangles) return;
  // A hundredth of a degree less: an edge of exactly that angle is a crease, whatever the rounding.
  const auto cosine = [](double degrees) {
    return std::cos(std::min(degrees, 180.0) * (3.14159265358979 / 180.0));
  };
  const double smooth = crease >= 180.0 ? -2.0 : cosine(crease - 0.01);
  const double farthest = cosine(kFarthestCreases * crease);
  std::vector<glm::dvec3> faces(triangles.size());
  for_ranges(execution, triangles.size(), [&](std::size_t t) {
    const glm::dvec3& a = positions[triangles[t].x];
    const glm::dvec3 across =
        glm::cross(positions[triangles[t].y] - a, positions[triangles[t].z] - a);
    const double length = glm::length(across);
    faces[t] = length > 0 && length < 1e300 ? across / length : glm::dvec3(0.0);
  });
  Welds welds(positions, execution);
  const std::vector<std::uint32_t>& first = welds.first();
  const CornersOfVertices around(triangles, first, execution);
  if (execution.stop.stop_requested()) return;

  packed_.resize(triangles.size() * 3);
  std::atomic<bool> curved{false};
  const auto vertex = [&](std::size_t v, Fan& fan) {
    const auto corners = std::span(around.corners)
                             .subspan(around.offsets[v], around.offsets[v + 1] - around.offsets[v]);
    fan.clear();
    for (const std::uint32_t corner : corners) {
      const glm::uvec3& t = triangles[corner / 3];
      const int c = static_cast<int>(corner % 3), next = (c + 1) % 3, before = (c + 2) % 3;
      const glm::dvec3 to_next = positions[t[next]] - positions[t[c]];
      const glm::dvec3 to_before = positions[t[before]] - positions[t[c]];
      const double lengths = glm::length(to_next) * glm::length(to_before);
      const double angle = lengths > 0 ? angle_of(glm::dot(to_next, to_before) / lengths) : 0.0;
      fan.add(first[t[next]], first[t[before]], faces[corner / 3], angle);
    }
    const auto& normals = fan.normals();
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const glm::dvec3& face = faces[corners[i] / 3];
      const bool flat = !(glm::dot(normals[i], face) < kSame) || face == glm::dvec3(0.0);
      packed_[corners[i]] = flat ? kFlat : pack(normals[i]);
    }
  };
  parallel_for(execution, (positions.size() + kVerticesAtOnce - 1) / kVerticesAtOnce,
               [&](std::size_t range, int) {
                 Fan fan(smooth, farthest);
                 const std::size_t end = std::min(positions.size(), (range + 1) * kVerticesAtOnce);
                 for (std::size_t v = range * kVerticesAtOnce; v < end; ++v) vertex(v, fan);
               });
  for_ranges(execution, triangles.size(), [&](std::size_t t) {
    std::uint32_t* corners = packed_.data() + t * 3;
    if (std::all_of(corners, corners + 3, [](std::uint32_t p) { return p == kFlat; })) return;
    for (int c = 0; c < 3; ++c) {
      if (corners[c] == kFlat) corners[c] = pack(faces[t]);
    }
    curved.store(true, std::memory_order_relaxed);
  });
  if (!curved) packed_ = {};
}

std::uint32_t CornerNormals::pack(const glm::dvec3& unit) {
  const double sum = std::abs(unit.x) + std::abs(unit.y) + std::abs(unit.z);
  glm::dvec2 at = glm::dvec2(unit) / sum;
  if (unit.z < 0) {
    at = {(1.0 - std::abs(at.y)) * (at.x < 0 ? -1.0 : 1.0),
          (1.0 - std::abs(at.x)) * (at.y < 0 ? -1.0 : 1.0)};
  }
  // [x:16 | y:16], from 0 to 65534: kFlat is no normal.
  const auto bits = [](double part) {
    return static_cast<std::uint32_t>(std::floor((part + 1.0) * 32767.0 + 0.5));
  };
  return bits(at.x) << 16 | bits(at.y);
}

glm::dvec3 CornerNormals::unpack(std::uint32_t packed) {
  const glm::dvec2 at((packed >> 16) / 32767.0 - 1.0, (packed & 0xffffu) / 32767.0 - 1.0);
  glm::dvec3 normal(at, 1.0 - std::abs(at.x) - std::abs(at.y));
  if (normal.z < 0) {
    normal.x = (1.0 - std::abs(at.y)) * (at.x < 0 ? -1.0 : 1.0);
    normal.y = (1.0 - std::abs(at.x)) * (at.y < 0 ? -1.0 : 1.0);
  }
  return glm::normalize(normal);
}

}  // namespace strata::csg
