#include <algorithm>
#include <atomic>
#include <limits>
#include <span>

#include "mesh/formats/reader_common.h"
#include "mesh/polygons/polygon_cutter.h"

namespace strata::detail {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 16;
constexpr std::uint64_t kNone = std::numeric_limits<std::uint64_t>::max();

bool finite(const glm::dvec3& p) {
  // The sum of products with zero is zero unless a coordinate is NaN or infinite. One comparison
  // serves all three.
  return p.x * 0.0 + p.y * 0.0 + p.z * 0.0 == 0.0;
}

/// Calls check(begin, end) for blocks of [0, count). Returns true when a call returns true.
template <class Check>
bool any_block(const Execution& execution, std::size_t count, Check&& check) {
  std::atomic<bool> found = false;
  Execution all = execution;
  all.stop = {};  // half a check would be worthless
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

/// The first face dropped for each cause.
struct Losses {
  std::uint64_t first_out_of_range = kNone, out_of_range_vertex = 0;
  std::uint64_t first_non_finite = kNone, non_finite_vertex = 0;
};

/// Removes faces with indices out of range or coordinates that are not finite. Triangles with two
/// corners at one vertex stay for now, because polygons are cut again first.
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
      soup.triangles[kept++] = soup.triangles[t];
      elements.push_back(element);
    }
  }
  soup.triangles.resize(kept);
  soup.face_elements = std::move(elements);
  return losses;
}

/// Removes vertices that are not finite. No triangle uses them now.
void drop_non_finite_vertices(TriangleSoup& soup, DroppedVertices* dropped) {
  std::vector<std::uint32_t> new_index(soup.positions.size());
  std::uint32_t kept = 0;
  for (std::size_t v = 0; v < soup.positions.size(); ++v) {
    new_index[v] = kept;
    if (finite(soup.positions[v])) {
      soup.positions[kept++] = soup.positions[v];
    } else if (dropped != nullptr) {
      dropped->all.push_back(static_cast<std::uint32_t>(v));
    }
  }
  soup.positions.resize(kept);
  for (glm::uvec3& t : soup.triangles) t = {new_index[t.x], new_index[t.y], new_index[t.z]};
}

/// The polygons that are not flat.
struct Bent {
  std::uint64_t count = 0, first = kNone;
  Bend bend;  ///< the bend of the first one
};

/// Cuts polygons again where the reader's fan from the first corner is wrong.
class PolygonCuts {
 public:
  explicit PolygonCuts(TriangleSoup& soup) : soup_(soup) {}

  /// @param execution  after a stop request some polygons keep their fans
  Bent run(const Execution& execution) {
    const std::size_t count = soup_.face_elements.size();  // 0 if all faces are triangles
    const std::size_t blocks = (count + kBlock - 1) / kBlock;
    std::vector<Bent> bent(blocks);
    parallel_for(execution, blocks, [&](std::size_t block, int) {
      bent[block] =
          cut_block(block * kBlock, std::min(count, (block + 1) * kBlock), execution.stop);
    });
    Bent all;
    for (const Bent& one : bent) {
      if (all.count == 0)
        all = one;
      else
        all.count += one.count;
    }
    return all;
  }
  /// Whether surplus triangles are left. All three corners of such a triangle are kNoVertex, or the
  /// same vertex.
  [[nodiscard]] bool left_over() const { return left_over_; }

 private:
  /// Cuts the polygons that begin in [begin, end).
  Bent cut_block(std::size_t begin, std::size_t end, const std::stop_token& stop_token) {
    const std::vector<std::uint32_t>& elements = soup_.face_elements;
    Bent bent;
    PolygonCutter cutter;
    while (begin > 0 && begin < end && elements[begin] == elements[begin - 1]) ++begin;
    for (std::size_t stop = begin; begin < end; begin = stop) {
      for (stop = begin + 1; stop < elements.size() && elements[stop] == elements[begin];) ++stop;
      if (stop - begin < 2) continue;
      constexpr std::size_t kMany = 1024;  // corners of a polygon whose cut may take long
      if (stop - begin > kMany && stop_token.stop_requested()) break;
      const Bend bend = stop - begin == 2 ? cut_quad_at(begin) : cut_at(begin, stop, cutter);
      if (bend.large() && bent.count++ == 0) {
        bent.first = elements[begin];
        bent.bend = bend;
      }
    }
    return bent;
  }

  Bend cut_quad_at(std::size_t at) {
    glm::uvec3 &first = soup_.triangles[at], &second = soup_.triangles[at + 1];
    const std::uint32_t a = first.x, b = first.y, c = first.z, d = second.z;
    const std::vector<glm::dvec3>& p = soup_.positions;
    const QuadCut quad = cut_quad(p[a], p[b], p[c], p[d]);
    if (!quad.fan) {
      first = {b, c, d};
      second = {b, d, a};
    }
    return quad.bend;
  }

  Bend cut_at(std::size_t begin, std::size_t end, PolygonCutter& cutter) {
    std::vector<std::uint32_t> corners;
    std::vector<glm::dvec3> positions;
    const std::vector<glm::uvec3>& fan = soup_.triangles;
    corners = {fan[begin].x};
    for (std::size_t t = begin; t < end; ++t) corners.push_back(fan[t].y);
    corners.push_back(fan[end - 1].z);
    for (const std::uint32_t corner : corners) positions.push_back(soup_.positions[corner]);
    const std::span<const glm::uvec3> cut = cutter.cut(positions);
    if (cut.empty()) return cutter.bend();
    std::size_t twice = 0;  // corners that repeat the previous one
    for (std::size_t i = 0; i < corners.size(); ++i) {
      twice += corners[i] == corners[i == 0 ? corners.size() - 1 : i - 1] ? 1 : 0;
    }
    std::size_t t = begin;
    for (const glm::uvec3& one : cut) {
      soup_.triangles[t++] = {corners[one.x], corners[one.y], corners[one.z]};
    }
    if (t < end) left_over_ = true;
    for (; t < end; ++t) {
      soup_.triangles[t] = glm::uvec3(twice > 0 ? corners[0] : kNoVertex);
      twice -= twice > 0 ? 1 : 0;
    }
    return cutter.bend();
  }

  TriangleSoup& soup_;
  std::atomic<bool> left_over_ = false;
};

/// Removes triangles with two corners at one vertex. Counts them, unless their corners are
/// kNoVertex.
void drop_degenerate(RawMesh& mesh) {
  TriangleSoup& soup = mesh.soup;
  std::size_t kept = 0;
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    const glm::uvec3 triangle = soup.triangles[t];
    if (triangle.x == triangle.y || triangle.y == triangle.z || triangle.z == triangle.x) {
      mesh.stats.degenerate += triangle.x != kNoVertex ? 1 : 0;
      continue;
    }
    soup.triangles[kept] = triangle;
    soup.face_elements[kept++] = soup.face_elements[t];
  }
  soup.triangles.resize(kept);
  soup.face_elements.resize(kept);
}

/// Adds a warning for each cause of dropped faces, naming the first face.
/// @param vertices  number of vertices in the file
void warn_of_dropped_faces(RawMesh& raw, const Losses& losses, std::size_t vertices,
                           const LocateFace& locate) {
  MeshReadStats& stats = raw.stats;
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
    const glm::dvec3 p = raw.soup.positions[losses.non_finite_vertex];
    stats.warnings.push_back(
        fmt::format("{}: face has a vertex at ({}, {}, {}), which is not finite; {}",
                    locate(static_cast<std::uint32_t>(losses.first_non_finite)).place, p.x, p.y,
                    p.z, faces_text(stats.non_finite)));
  }
}

}  // namespace

std::string faces_text(std::uint64_t count) {
  return count == 1 ? "1 face was dropped" : fmt::format("{} faces were dropped", count);
}

Result<MeshFile> finish_mesh(const ReaderInput& input, RawMesh&& raw, const LocateFace& locate) {
  MeshReadStats& stats = raw.stats;
  TriangleSoup& soup = raw.soup;
  stats.bytes = input.text.size();
  if (soup.positions.empty()) return fail(ErrorCode::kInput, "{}: no vertices", input.name);
  if (stats.faces == 0) return fail(ErrorCode::kInput, "{}: no faces", input.name);
  const std::size_t vertices = soup.positions.size();
  const bool non_finite = any_non_finite(input.execution, soup.positions);
  Losses losses;
  const bool bad = non_finite || any_bad_triangle(input.execution, soup);
  if (bad) losses = drop_bad_faces(raw);
  PolygonCuts cuts(soup);
  const Bent bent = cuts.run(input.execution);
  if (input.execution.stop.stop_requested()) {
    return fail(ErrorCode::kCancelled, "{}: reading was stopped", input.name);
  }
  if (bad || cuts.left_over()) drop_degenerate(raw);

  warn_of_dropped_faces(raw, losses, vertices, locate);
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
  if (non_finite) drop_non_finite_vertices(soup, input.dropped);
  stats.non_planar = bent.count;
  if (bent.count != 0) {
    stats.warnings.push_back(fmt::format(
        "{}: polygon is not flat: {} ({} in all); it can be divided into triangles in several ways",
        locate(static_cast<std::uint32_t>(bent.first)).place, bent.bend.text(), bent.count));
  }
  bool identity = true;
  for (std::size_t t = 0; t < soup.face_elements.size() && identity; ++t) {
    identity = soup.face_elements[t] == t;
  }
  if (identity) soup.face_elements = {};
  stats.vertices = soup.positions.size();
  stats.triangles = soup.triangles.size();
  MeshFile file;
  file.soup = std::move(soup);
  file.stats = std::move(stats);
  return file;
}

}  // namespace strata::detail
