#include <glm/geometric.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "mesh/reader_common.h"

namespace strata::detail {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 16;
constexpr std::uint64_t kNone = std::numeric_limits<std::uint64_t>::max();

bool finite(const glm::dvec3& p) {
  // A sum of products with zero is zero unless one factor is NaN or infinite; one compare for
  // three.
  return p.x * 0.0 + p.y * 0.0 + p.z * 0.0 == 0.0;
}

/// Calls check(begin, end) for blocks of [0, count); true when one of them says true.
template <class Check>
bool any_block(const Execution& execution, std::size_t count, Check&& check) {
  std::atomic<bool> found = false;
  Execution all = execution;
  all.stop = {};  // half a check would be none
  parallel_for(all, (count + kBlock - 1) / kBlock, [&](std::size_t block, int) {
    if (check(block * kBlock, std::min(count, (block + 1) * kBlock))) found = true;
  });
  return found;
}

bool any_non_finite(const Execution& execution, const std::vector<glm::dvec3>& positions) {
  return any_block(execution, positions.size(), [&](std::size_t i, std::size_t end) {
    bool bad = false;
    for (; i < end; ++i) bad |= !finite(positions[i]);
    return bad;
  });
}

bool any_bad_triangle(const Execution& execution, const TriangleSoup& soup) {
  const auto count = static_cast<std::uint32_t>(soup.positions.size());
  return any_block(execution, soup.triangles.size(), [&](std::size_t i, std::size_t end) {
    bool bad = false;
    for (; i < end; ++i) {
      const glm::uvec3 t = soup.triangles[i];
      bad |= (t.x >= count) | (t.y >= count) | (t.z >= count) | (t.x == t.y) | (t.y == t.z) |
             (t.z == t.x);
    }
    return bad;
  });
}

/// What the slow way found: the first face of each cause.
struct Losses {
  std::uint64_t first_out_of_range = kNone, out_of_range_vertex = 0;
  std::uint64_t first_non_finite = kNone, non_finite_vertex = 0;
};

/// Removes what cannot stay, face by face.
Losses drop_bad_faces(RawMesh& mesh) {
  TriangleSoup& soup = mesh.soup;
  Losses losses;
  const std::size_t vertices = soup.positions.size();
  std::vector<std::uint32_t> elements;
  elements.reserve(soup.triangles.size());
  const auto element_of = [&](std::size_t t) {
    return soup.face_elements.empty() ? static_cast<std::uint32_t>(t) : soup.face_elements[t];
  };
  std::size_t kept = 0;
  for (std::size_t begin = 0, end = 0; begin < soup.triangles.size(); begin = end) {
    const std::uint32_t element = element_of(begin);
    for (end = begin + 1; end < soup.triangles.size() && element_of(end) == element;) ++end;
    std::uint64_t beyond = kNone, unusable = kNone;
    for (std::size_t t = begin; t < end; ++t) {
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t v = soup.triangles[t][k];
        if (v >= vertices) {
          beyond = std::min<std::uint64_t>(beyond, v);
        } else if (!finite(soup.positions[v])) {
          unusable = std::min<std::uint64_t>(unusable, v);
        }
      }
    }
    if (beyond != kNone) {
      if (mesh.stats.out_of_range++ == 0) {
        losses.first_out_of_range = element;
        losses.out_of_range_vertex = beyond;
      }
      continue;
    }
    if (unusable != kNone) {
      if (mesh.stats.non_finite++ == 0) {
        losses.first_non_finite = element;
        losses.non_finite_vertex = unusable;
      }
      continue;
    }
    for (std::size_t t = begin; t < end; ++t) {
      const glm::uvec3 triangle = soup.triangles[t];
      if (triangle.x == triangle.y || triangle.y == triangle.z || triangle.z == triangle.x) {
        ++mesh.stats.degenerate;
        continue;
      }
      soup.triangles[kept++] = triangle;
      elements.push_back(element);
    }
  }
  soup.triangles.resize(kept);
  soup.face_elements = std::move(elements);
  return losses;
}

/// Removes vertices that are not finite; no triangle uses them any more.
void drop_non_finite_vertices(TriangleSoup& soup) {
  std::vector<std::uint32_t> new_index(soup.positions.size());
  std::uint32_t kept = 0;
  for (std::size_t v = 0; v < soup.positions.size(); ++v) {
    new_index[v] = kept;
    if (finite(soup.positions[v])) soup.positions[kept++] = soup.positions[v];
  }
  soup.positions.resize(kept);
  for (glm::uvec3& t : soup.triangles) t = {new_index[t.x], new_index[t.y], new_index[t.z]};
}

/// How many polygons leave the plane of their mean normal by more than 1/1000 of their diagonal: a
/// fan of such a polygon is one of several surfaces it could mean. The bound is wide enough for
/// coordinates written with four digits.
std::uint64_t count_non_planar(const TriangleSoup& soup, std::uint64_t& first) {
  std::uint64_t count = 0;
  const auto& elements = soup.face_elements;
  for (std::size_t begin = 0, end = 0; begin < elements.size(); begin = end) {
    for (end = begin + 1; end < elements.size() && elements[end] == elements[begin];) ++end;
    if (end - begin < 2) continue;
    const glm::dvec3 anchor = soup.positions[soup.triangles[begin].x];
    glm::dvec3 normal(0.0), low(anchor), high(anchor);
    for (std::size_t t = begin; t < end; ++t) {
      const glm::dvec3 b = soup.positions[soup.triangles[t].y];
      const glm::dvec3 c = soup.positions[soup.triangles[t].z];
      normal += glm::cross(b - anchor, c - anchor);
      low = glm::min(low, glm::min(b, c));
      high = glm::max(high, glm::max(b, c));
    }
    double least = 0.0, most = 0.0;
    for (std::size_t t = begin; t < end; ++t) {
      for (int k = 1; k < 3; ++k) {
        const double height = glm::dot(normal, soup.positions[soup.triangles[t][k]] - anchor);
        least = std::min(least, height);
        most = std::max(most, height);
      }
    }
    if (most - least > 1e-3 * glm::length(normal) * glm::length(high - low)) {
      if (count++ == 0) first = elements[begin];
    }
  }
  return count;
}

std::string faces_text(std::uint64_t count) {
  return count == 1 ? "1 face was dropped" : fmt::format("{} faces were dropped", count);
}

}  // namespace

Result<MeshFile> finish_mesh(const ReaderInput& input, RawMesh&& raw, const LocateFace& locate) {
  MeshReadStats& stats = raw.stats;
  TriangleSoup& soup = raw.soup;
  stats.bytes = input.text.size();
  if (soup.positions.empty()) return fail(ErrorCode::kInput, "{}: no vertices", input.name);
  if (stats.faces == 0) return fail(ErrorCode::kInput, "{}: no faces", input.name);
  const std::size_t vertices = soup.positions.size();
  const bool non_finite = any_non_finite(input.execution, soup.positions);
  Losses losses;
  if (non_finite || any_bad_triangle(input.execution, soup)) losses = drop_bad_faces(raw);

  if (stats.too_few_vertices != 0) {
    stats.warnings.push_back(
        fmt::format("{}: face has fewer than 3 vertices; {}",
                    locate(static_cast<std::uint32_t>(raw.first_short_face)).place,
                    faces_text(stats.too_few_vertices)));
  }
  if (stats.out_of_range != 0) {
    const FacePlace at = locate(static_cast<std::uint32_t>(losses.first_out_of_range));
    stats.warnings.push_back(
        fmt::format("{}: face refers to vertex {}, the file has {}; {}", at.place,
                    at.vertex.empty() ? std::to_string(losses.out_of_range_vertex) : at.vertex,
                    vertices, faces_text(stats.out_of_range)));
  }
  if (stats.non_finite != 0) {
    const glm::dvec3 p = soup.positions[losses.non_finite_vertex];
    stats.warnings.push_back(
        fmt::format("{}: face uses the vertex ({}, {}, {}), which is not finite; {}",
                    locate(static_cast<std::uint32_t>(losses.first_non_finite)).place, p.x, p.y,
                    p.z, faces_text(stats.non_finite)));
  }
  if (input.options.strict && stats.dropped_faces() != 0) {
    return fail(ErrorCode::kInput, "{}", stats.warnings.front());
  }
  if (stats.degenerate != 0) {
    stats.warnings.push_back(
        fmt::format("{}: {} triangle{} with two corners at the same vertex {} dropped", input.name,
                    stats.degenerate, stats.degenerate == 1 ? "" : "s",
                    stats.degenerate == 1 ? "was" : "were"));
  }
  if (soup.triangles.empty()) {
    return fail(ErrorCode::kInput, "{}: none of its {} faces can be used{}{}", input.name,
                stats.faces, stats.warnings.empty() ? "" : ", first: ",
                stats.warnings.empty() ? std::string() : stats.warnings.front());
  }
  if (non_finite) drop_non_finite_vertices(soup);
  std::uint64_t first_bent = 0;
  stats.non_planar = count_non_planar(soup, first_bent);
  if (stats.non_planar != 0) {
    stats.warnings.push_back(fmt::format(
        "{}: polygon is not flat ({} such); it was cut into a fan from its first vertex",
        locate(static_cast<std::uint32_t>(first_bent)).place, stats.non_planar));
  }
  bool identity = true;
  for (std::size_t t = 0; t < soup.face_elements.size() && identity; ++t) {
    identity = soup.face_elements[t] == t;
  }
  if (identity) soup.face_elements = {};
  stats.vertices = soup.positions.size();
  stats.triangles = soup.triangles.size();
  return MeshFile{std::move(soup), std::move(stats)};
}

}  // namespace strata::detail
