#include "csg/outline/extrude.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>
#include <queue>
#include <utility>

#include "csg/outline/triangulate_pieces.h"
#include "mesh/polygons/plane_predicates.h"

namespace strata::csg {
namespace {

/// Most vertices of an extrusion. A number of slices that would exceed it is reduced.
constexpr std::size_t kMostVertices = std::size_t{1} << 28;

using Contour = std::vector<glm::dvec2>;

/// Maps the outline to the slice at height t in [0, 1]: rotates it first, then scales it.
struct Slice {
  double cosine, sine;
  glm::dvec2 scale;

  Slice(const LinearExtrude& options, double t) {
    const double angle = -options.twist * t;
    cosine = cos_degrees(angle), sine = sin_degrees(angle);
    // The top has exactly the given scale, so that a scale of 0 makes an edge or a point.
    scale = t == 1 ? options.scale : 1.0 - (1.0 - options.scale) * t;
  }
  glm::dvec2 operator()(const glm::dvec2& p) const {
    return scale * glm::dvec2(cosine * p.x - sine * p.y, sine * p.x + cosine * p.y);
  }
};

/// Length of an Archimedean spiral from its centre to the angle `theta`.
double spiral_length(double a, double theta) {
  return 0.5 * a * (theta * std::sqrt(1 + theta * theta) + std::asinh(theta));
}

double slices_for_twist(const LinearExtrude& options, double radius) {
  const Segments& s = options.segments;
  const double degrees = std::abs(options.twist), radians = degrees * std::numbers::pi / 180.0;
  const double least = std::max(std::ceil(degrees / 120.0), 1.0);
  if (radius < 0x1p-20 || !std::isfinite(s.fn)) return least;
  if (s.fn > 0) return std::max(std::ceil(degrees * s.fn / 360.0), least);
  double flat = radians * radius;  // length of the farthest point's path, seen from above
  if (options.scale.x == options.scale.y && options.scale.x != 1) {
    const double scale = options.scale.x;
    const double end = scale > 1 ? radians * scale / (scale - 1) : radians / (1 - scale);
    const double a = radius / end;
    flat = spiral_length(a, end) - spiral_length(a, end - radians);
  }
  const double length = std::hypot(flat, options.height * options.direction.z);
  const double by_angle = std::ceil(degrees / std::max(s.fa, 0.01));
  const double by_length = std::ceil(length / std::max(s.fs, 0.01));
  return std::max(std::min(by_angle, by_length), least);
}

double slices_for_scale(const LinearExtrude& options, double farthest) {
  const Segments& s = options.segments;
  if (farthest < 0x1p-20 || !std::isfinite(s.fn)) return 1;
  if (s.fn > 0) return std::max(std::trunc(s.fn), 1.0);
  const double length = std::hypot(farthest, options.height * options.direction.z);
  return std::max(std::ceil(length / std::max(s.fs, 0.01)), 1.0);
}

double slice_count(const Outline& outline, const LinearExtrude& options) {
  double slices = options.slices;
  if (options.slices <= 0) {
    double radius = 0, farthest = 0;
    for (const Contour& contour : outline.contours) {
      for (const glm::dvec2& p : contour) {
        radius = std::max(radius, glm::length(p));
        farthest = std::max(farthest, glm::length(p - p * options.scale));
      }
    }
    slices = 1;
    if (options.twist != 0) slices = slices_for_twist(options, radius);
    if (options.scale.x != options.scale.y) {
      slices = std::max(slices, slices_for_scale(options, farthest));
    }
  }
  return std::max(slices, 1.0);
}

/// The greatest length that each edge of the contour has in any slice.
std::vector<double> edge_lengths(const Contour& contour, const LinearExtrude& options,
                                 std::size_t slices) {
  std::vector<double> lengths(contour.size(), 0.0);
  const bool uniform = options.scale.x == options.scale.y;
  // A sample suffices when there are very many slices.
  constexpr std::size_t kMostLooks = 20'000'000;
  const std::size_t step = 1 + slices * contour.size() / kMostLooks;
  for (std::size_t j = 0; j <= (uniform ? 0 : slices); j += step) {
    const Slice slice(options, static_cast<double>(j) / static_cast<double>(slices));
    for (std::size_t i = 0; i < contour.size(); ++i) {
      const double length =
          glm::distance(slice(contour[i]), slice(contour[(i + 1) % contour.size()]));
      lengths[i] = std::max(lengths[i], length * (uniform ? std::max(options.scale.x, 1.0) : 1.0));
    }
  }
  return lengths;
}

Contour divided(const Contour& contour, const std::vector<std::size_t>& parts) {
  if (parts.empty()) return contour;
  Contour result;
  for (std::size_t i = 0; i < contour.size(); ++i) {
    const glm::dvec2 &p = contour[i], &q = contour[(i + 1) % contour.size()];
    for (std::size_t k = 0; k < parts[i]; ++k) {
      const double t = static_cast<double>(k) / static_cast<double>(parts[i]);
      result.push_back((1 - t) * p + t * q);
    }
  }
  return result;
}

/// Divides edges into parts until the contour has `wanted` vertices or one step more would exceed
/// them. Each step divides the edges with the longest parts; edges whose parts are about equally
/// long are divided together.
std::vector<std::size_t> divide_to_count(const Contour& contour, const LinearExtrude& options,
                                         std::size_t slices, std::size_t wanted) {
  if (contour.size() >= wanted) return {};
  const std::vector<double> lengths = edge_lengths(contour, options, slices);
  std::vector<std::size_t> parts(contour.size(), 1);
  // Lies between the length of a part now and after one more division.
  const auto measure = [&](std::size_t i) {
    return lengths[i] / (static_cast<double>(parts[i]) + 0.5);
  };
  std::priority_queue<std::pair<double, std::size_t>> queue;
  for (std::size_t i = 0; i < contour.size(); ++i) queue.emplace(measure(i), i);
  std::size_t total = contour.size();
  std::vector<std::size_t> group;
  while (total < wanted && queue.top().first > 0) {
    constexpr double kAboutEqual = 0.999;
    const double longest = queue.top().first;
    group.clear();
    while (!queue.empty() && queue.top().first >= kAboutEqual * longest) {
      group.push_back(queue.top().second);
      queue.pop();
    }
    total += group.size();
    if (total > wanted) break;
    for (const std::size_t i : group) {
      ++parts[i];
      queue.emplace(measure(i), i);
    }
  }
  return parts;
}

std::vector<std::size_t> divide_to_length(const Contour& contour, const LinearExtrude& options,
                                          std::size_t slices, double length) {
  const std::vector<double> lengths = edge_lengths(contour, options, slices);
  std::vector<std::size_t> parts;
  for (const double whole : lengths) {
    parts.push_back(static_cast<std::size_t>(std::clamp(std::ceil(whole / length), 1.0, 1e6)));
  }
  return parts;
}

/// The number of parts that each edge of each contour is divided into. A contour that stays as it
/// is has an empty list.
std::vector<std::vector<std::size_t>> divide_edges(const Outline& outline,
                                                   const LinearExtrude& options,
                                                   std::size_t slices) {
  const bool bent = options.twist != 0 || options.scale.x != options.scale.y;
  const Segments& s = options.segments;
  std::vector<std::vector<std::size_t>> result;
  for (const Contour& contour : outline.contours) {
    std::vector<std::size_t>& parts = result.emplace_back();
    if (options.outline_segments > 0) {
      parts = divide_to_count(contour, options, slices,
                              static_cast<std::size_t>(options.outline_segments));
    } else if (!options.divide_outline || !bent || !std::isfinite(s.fn)) {
      continue;
    } else if (s.fn > 0) {
      const auto wanted = static_cast<std::size_t>(std::min(std::max(s.fn, 3.0), 1e6));
      parts = divide_to_count(contour, options, slices, wanted);
    } else {
      const auto by_angle = static_cast<std::size_t>(std::ceil(360.0 / std::max(s.fa, 0.01)));
      if (contour.size() >= by_angle) continue;
      parts = divide_to_length(contour, options, slices, std::max(s.fs, 0.01));
      if (std::accumulate(parts.begin(), parts.end(), std::size_t{0}) >= by_angle) {
        parts = divide_to_count(contour, options, slices, by_angle);
      }
    }
  }
  return result;
}

/// Whether the diagonal of a wall runs from low0 to high1 rather than from low1 to high0. The
/// shorter one is taken. Lengths that differ by less than 1e-5 count as equal; then
/// `falls_if_equal`, which the twist's direction sets, decides, so that neighbours agree.
bool rising_diagonal(const glm::dvec2& low0, const glm::dvec2& low1, const glm::dvec2& high0,
                     const glm::dvec2& high1, bool falls_if_equal) {
  const double rising = glm::distance(low0, high1), falling = glm::distance(low1, high0);
  constexpr double kEqual = 1e-5;
  if (2 * std::abs(rising - falling) > (rising + falling) * kEqual) return rising < falling;
  return !falls_if_equal;
}

/// Adds the side of a pyramid: the outline at the bottom, one apex at the top.
void close_at_point(const Outline& outline, std::size_t bottom, const glm::dvec3& apex,
                    TriangleSoup& mesh) {
  const auto top = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.push_back(apex);
  auto first = static_cast<std::uint32_t>(bottom);
  for (const Contour& contour : outline.contours) {
    const auto count = static_cast<std::uint32_t>(contour.size());
    for (std::uint32_t i = 0; i < count; ++i) {
      mesh.triangles.emplace_back(first + i, first + (i + 1) % count, top);
    }
    first += count;
  }
}

/// The points on an edge. They are numbered from `first` on.
struct Dots {
  std::uint32_t first = 0, count = 0;
};

/// Triangulates the triangle (a, b, c), whose edges have dots on them. An edge with dots becomes a
/// fan around the corner opposite to it.
void fan(const glm::uvec3& corners, const Dots (&dots)[3], std::vector<glm::uvec3>& triangles) {
  const int edge = dots[0].count > 0 ? 0 : dots[1].count > 0 ? 1 : 2;
  if (dots[edge].count == 0) {
    triangles.push_back(corners);
    return;
  }
  const std::uint32_t from = corners[edge], to = corners[(edge + 1) % 3];
  const std::uint32_t tip = corners[(edge + 2) % 3];
  std::uint32_t last = from;
  for (std::uint32_t k = 0; k <= dots[edge].count; ++k) {
    const std::uint32_t next = k == dots[edge].count ? to : dots[edge].first + k;
    const Dots left[3] = {
        {}, next == to ? dots[(edge + 1) % 3] : Dots{}, k == 0 ? dots[(edge + 2) % 3] : Dots{}};
    fan({last, next, tip}, left, triangles);
    last = next;
  }
}

/// Triangulates `divided`, which is `raw` with additional points on its edges. It takes the
/// triangles of `raw` and cuts them into fans that reach these points. Clipping the ears of a
/// million points in a line would take hours.
std::vector<glm::uvec3> triangulate_divided(const Outline& raw, const Outline& divided,
                                            const std::vector<std::vector<std::size_t>>& parts,
                                            OutlineJob* job) {
  std::vector<glm::uvec3> coarse = triangulate_pieces(raw, job);
  std::vector<std::uint32_t> next, number;  // for each point of raw; numbers in `divided`
  std::vector<Dots> dots;                   // on the edge after each point
  std::uint32_t at = 0;
  for (std::size_t c = 0; c < raw.contours.size(); ++c) {
    const auto first = static_cast<std::uint32_t>(next.size());
    const auto count = static_cast<std::uint32_t>(raw.contours[c].size());
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto more = static_cast<std::uint32_t>(parts[c].empty() ? 0 : parts[c][i] - 1);
      next.push_back(first + (i + 1) % count);
      number.push_back(at);
      dots.push_back({at + 1, more});
      at += 1 + more;
    }
  }
  std::size_t undone = 0;  // edges with dots that no triangle has used
  for (const Dots& edge : dots) undone += edge.count > 0 ? 1 : 0;
  std::vector<glm::uvec3> triangles;
  triangles.reserve(at);
  for (const glm::uvec3& t : coarse) {
    Dots on[3];
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t from = t[i];
      if (next[from] != t[(i + 1) % 3] || dots[from].count == 0) continue;
      on[i] = std::exchange(dots[from], Dots{});
      --undone;
    }
    fan({number[t.x], number[t.y], number[t.z]}, on, triangles);
  }
  // Points in the same place may have been exchanged in the triangles.
  return undone == 0 ? triangles : triangulate_pieces(divided, job);
}

/// Whether the mesh would exceed the memory limit of the job, or the job has ended.
bool too_large(double vertices, double triangles, const char* what, OutlineJob* job) {
  if (!job || job->error || job->execution.memory_limit == 0) return job && job->error;
  const double bytes = vertices * sizeof(glm::dvec3) + triangles * sizeof(glm::uvec3);
  if (bytes <= static_cast<double>(job->execution.memory_limit)) return false;
  job->error = Error{
      ErrorCode::kLimit,
      fmt::format(
          "{}: {:.3g} vertices and {:.3g} triangles need {:.3g} bytes, but the memory limit is {}",
          what, vertices, triangles, bytes, job->execution.memory_limit)};
  return true;
}

}  // namespace

ExtrusionSize size_of(const Outline& outline, const LinearExtrude& options) {
  const double slices = slice_count(outline, options);
  const bool bent = options.twist != 0 || options.scale.x != options.scale.y;
  const Segments& s = options.segments;
  double divided = 0;  // points of the contours after division
  if (options.outline_segments > 0) {
    divided = options.outline_segments;
  } else if (options.divide_outline && bent && s.fn > 0) {
    divided = std::min(s.fn, 1e6);
  }
  double points = 0;
  for (const Contour& contour : outline.contours) {
    points += std::max(divided, static_cast<double>(contour.size()));
  }
  return {slices, 2.0 * points * (slices + 1.0)};
}

namespace {

/// Adds the walls between a slice, whose points begin at `low`, and the next slice.
/// @param lean  how far the next slice is moved along x and y
void add_walls(const Outline& outline, std::size_t low, std::size_t stride, const glm::dvec2& lean,
               bool twists_down, bool shrinks, TriangleSoup& mesh) {
  std::size_t first = 0;
  for (const Contour& contour : outline.contours) {
    const bool falls_if_equal = (signed_area(contour) < 0) != twists_down;
    for (std::size_t i = 0; i < contour.size(); ++i) {
      const auto a = static_cast<std::uint32_t>(low + first + i);
      const auto b = static_cast<std::uint32_t>(low + first + (i + 1) % contour.size());
      const auto rise = static_cast<std::uint32_t>(stride);
      const auto flat = [&](std::uint32_t k) { return glm::dvec2(mesh.positions[k]); };
      const bool rising = rising_diagonal(flat(a) + lean, flat(b) + lean, flat(a + rise),
                                          flat(b + rise), falls_if_equal);
      if (rising != shrinks) {
        mesh.triangles.emplace_back(a, b, b + rise);
        mesh.triangles.emplace_back(a, b + rise, a + rise);
      } else {
        mesh.triangles.emplace_back(a, b, a + rise);
        mesh.triangles.emplace_back(b, b + rise, a + rise);
      }
    }
    first += contour.size();
  }
}

}  // namespace

TriangleSoup linear_extrude(const Outline& raw, const LinearExtrude& given, OutlineJob* job) {
  LinearExtrude options = given;
  options.scale = glm::max(options.scale, glm::dvec2(0));
  const glm::dvec3 way = options.direction * options.height;
  const auto finite = [](double x) { return std::isfinite(x); };
  if (raw.empty() || !(options.height > 0) || way.z == 0) return {};
  if (!finite(way.x) || !finite(way.y) || !finite(way.z) || !finite(options.twist) ||
      !finite(options.scale.x) || !finite(options.scale.y)) {
    return {};
  }
  const double wanted = slice_count(raw, options);
  const auto slices = static_cast<std::size_t>(std::min(wanted, double{kMostVertices}));
  const auto parts = divide_edges(raw, options, slices);
  Outline outline;
  std::size_t stride = 0;
  for (std::size_t i = 0; i < raw.contours.size(); ++i) {
    outline.contours.push_back(divided(raw.contours[i], parts[i]));
    stride += outline.contours.back().size();
  }
  if (stride == 0 || stride > kMostVertices / (slices + 1)) return {};
  const double walls = static_cast<double>(stride) * static_cast<double>(slices);
  if (too_large(walls + static_cast<double>(stride), 2 * walls, "linear_extrude", job)) return {};

  const glm::dvec3 bottom = options.centre ? -way / 2.0 : glm::dvec3(0);
  const bool pointed = options.scale == glm::dvec2(0);
  TriangleSoup mesh;
  mesh.positions.reserve(stride * (slices + 1));
  mesh.triangles.reserve(stride * 2 * (slices + 1));
  for (std::size_t j = 0; j < slices + (pointed ? 0 : 1); ++j) {
    if (job && job->ended()) return {};
    const double t = static_cast<double>(j) / static_cast<double>(slices);
    const Slice slice(options, t);
    // The offset is half the way, counted from the middle, so that both ends are rounded alike.
    const glm::dvec3 at = options.centre && j == slices ? way / 2.0 : bottom + way * t;
    for (const Contour& contour : outline.contours) {
      for (const glm::dvec2& p : contour) mesh.positions.emplace_back(glm::dvec3(slice(p), 0) + at);
    }
  }
  for (std::size_t j = 1; j < slices + (pointed ? 0 : 1); ++j) {
    if (job && job->ended()) return {};
    // An edge that shrinks to nothing at the top must not keep the long diagonal.
    const bool shrinks = j == slices && (options.scale.x == 0 || options.scale.y == 0);
    const glm::dvec2 lean = glm::dvec2(way) / static_cast<double>(slices);
    add_walls(outline, (j - 1) * stride, stride, lean, options.twist <= 0, shrinks, mesh);
  }
  // Slices are affine images of the outline, so its triangles close both ends.
  const auto top = static_cast<std::uint32_t>(slices * stride);
  const bool same = outline.contours == raw.contours;
  for (const glm::uvec3& t :
       same ? triangulate_pieces(outline, job) : triangulate_divided(raw, outline, parts, job)) {
    mesh.triangles.emplace_back(t.x, t.z, t.y);
    if (!pointed) mesh.triangles.push_back(t + top);
  }
  if (job && job->ended()) return {};
  if (pointed) close_at_point(outline, (slices - 1) * stride, bottom + way, mesh);
  if (way.z < 0) {
    for (glm::uvec3& t : mesh.triangles) std::swap(t.y, t.z);
  }
  return mesh;
}

TriangleSoup make_slab(const Outline& outline, double low, double high, OutlineJob* job) {
  LinearExtrude options;
  options.height = high - low;
  TriangleSoup mesh = linear_extrude(outline, options, job);
  for (glm::dvec3& p : mesh.positions) p.z = p.z > 0 ? high : low;
  return mesh;
}

namespace {

/// Steps around the axis for an outline of this width.
double step_count(double width, const RotateExtrude& options) {
  const double angle =
      std::isfinite(options.angle) ? std::min(std::abs(options.angle), 360.0) : 360;
  const double steps = options.segments.count(width) * angle / 360.0;
  return std::max(options.round_up ? std::ceil(steps) : std::floor(steps), 1.0);
}

/// An outline at the steps of its turn around the axis. What is added is incomplete once the job
/// has ended.
struct Turned {
  const Outline& outline;
  std::vector<std::uint32_t> vertex;  ///< of each point of the outline at each step
  std::size_t stride, fragments, rings;

  void add_vertices(double start, double turn, TriangleSoup& mesh, OutlineJob* job) {
    vertex.resize(rings * stride);
    for (std::size_t j = 0; j < rings && !(job && job->ended()); ++j) {
      const double at = start + turn * static_cast<double>(j) / static_cast<double>(fragments);
      const double cosine = cos_degrees(at), sine = sin_degrees(at);
      std::size_t i = 0;
      for (const Contour& contour : outline.contours) {
        for (const glm::dvec2& p : contour) {
          // A point on the axis does not move: all steps share one vertex.
          if (p.x == 0 && j > 0) {
            vertex[j * stride + i] = vertex[i];
          } else {
            vertex[j * stride + i] = static_cast<std::uint32_t>(mesh.positions.size());
            mesh.positions.emplace_back(p.x * cosine, p.x * sine, p.y);
          }
          ++i;
        }
      }
    }
  }
  void add_walls(TriangleSoup& mesh, OutlineJob* job) const {
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      if (a != b && b != c && c != a) mesh.triangles.emplace_back(a, b, c);
    };
    for (std::size_t j = 0; j < fragments && !(job && job->ended()); ++j) {
      const std::uint32_t *here = &vertex[j * stride], *there = &vertex[(j + 1) % rings * stride];
      std::size_t first = 0;
      for (const Contour& contour : outline.contours) {
        for (std::size_t i = 0; i < contour.size(); ++i) {
          const std::size_t a = first + i, b = first + (i + 1) % contour.size();
          add(here[a], there[a], there[b]);
          add(here[a], there[b], here[b]);
        }
        first += contour.size();
      }
    }
  }
  void add_ends(TriangleSoup& mesh, OutlineJob* job) const {
    if (job && job->ended()) return;
    const std::uint32_t* last = &vertex[fragments * stride];
    for (const glm::uvec3& t : triangulate_pieces(outline, job)) {
      mesh.triangles.emplace_back(vertex[t.x], vertex[t.y], vertex[t.z]);
      mesh.triangles.emplace_back(last[t.x], last[t.z], last[t.y]);
    }
  }
};

}  // namespace

ExtrusionSize size_of(const Outline& outline, const RotateExtrude& options) {
  double low = 0, high = 0, points = 0;
  for (const Contour& contour : outline.contours) {
    points += static_cast<double>(contour.size());
    for (const glm::dvec2& p : contour) low = std::min(low, p.x), high = std::max(high, p.x);
  }
  const double steps = step_count(high - low, options);
  return {steps, 2.0 * points * (steps + 1.0)};
}

Result<TriangleSoup> rotate_extrude(const Outline& outline, const RotateExtrude& options,
                                    OutlineJob* job) {
  if (outline.empty() || !std::isfinite(options.start)) return TriangleSoup{};
  double low = 0, high = 0;
  std::size_t stride = 0;
  for (const Contour& contour : outline.contours) {
    stride += contour.size();
    for (const glm::dvec2& p : contour) low = std::min(low, p.x), high = std::max(high, p.x);
  }
  if (low < 0 && high > 0) {
    return fail(ErrorCode::kGeometry,
                "rotate_extrude: the outline lies on both sides of the axis, x from {} to {}", low,
                high);
  }
  const double angle = std::isfinite(options.angle) ? options.angle : 360.0;
  if (angle == 0) return TriangleSoup{};
  const bool full = std::abs(angle) >= 360;
  const double turn = full ? 360.0 : angle;
  const auto fragments = static_cast<std::size_t>(step_count(high - low, options));
  if (stride > kMostVertices / (fragments + 1)) {
    return fail(ErrorCode::kLimit, "rotate_extrude: {} steps of {} points; the limit is {} in all",
                fragments, stride, kMostVertices);
  }

  const double walls = static_cast<double>(stride) * static_cast<double>(fragments);
  if (too_large(walls, 2 * walls, "rotate_extrude", job)) return tl::unexpected(*job->error);

  TriangleSoup mesh;
  Turned turned{outline, {}, stride, fragments, full ? fragments : fragments + 1};
  turned.add_vertices(options.start, turn, mesh, job);
  turned.add_walls(mesh, job);
  if (!full) turned.add_ends(mesh, job);
  if (job && job->ended()) return tl::unexpected(*job->error);
  if ((low < 0) != (turn < 0)) {
    for (glm::uvec3& t : mesh.triangles) std::swap(t.y, t.z);
  }
  return mesh;
}

}  // namespace strata::csg
