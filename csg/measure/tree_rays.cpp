#include "csg/measure/tree_rays.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <optional>
#include <utility>

#include "strata/mesh/shapes.h"

namespace strata::csg {
namespace {

struct Crossing {
  double t = 0.0;
  std::uint32_t solid = 0;
  bool exit = false;
};

/// Meets triangles with one line.
class LineTest {
 public:
  LineTest(const glm::dvec3& from, const glm::dvec3& along) : from_(from) {
    const glm::dvec3 size = glm::abs(along);
    kz_ = size.x > size.y ? 0 : 1;
    if (size.z > size[kz_]) kz_ = 2;
    kx_ = (kz_ + 1) % 3, ky_ = (kz_ + 2) % 3;
    if (along[kz_] < 0) std::swap(kx_, ky_);
    shear_ = glm::dvec3(along[kx_], along[ky_], 1.0) / along[kz_];
  }

  /// Where the line meets the triangle, and whether it leaves there.
  [[nodiscard]] std::optional<std::pair<double, bool>> meet(const glm::dvec3& p,
                                                            const glm::dvec3& q,
                                                            const glm::dvec3& r) const {
    const glm::dvec3 a = sheared(p), b = sheared(q), c = sheared(r);
    const int u = side(b, c), v = side(c, a), w = side(a, b);
    if (u != v || v != w) return {};
    const double U = edge(b, c), V = edge(c, a), W = edge(a, b);
    const double sum = U + V + W;
    double t = sum != 0.0 ? (U * a.z + V * b.z + W * c.z) / sum : a.z;
    t = std::clamp(t, std::min({a.z, b.z, c.z}), std::max({a.z, b.z, c.z}));
    return std::pair(t, u > 0);
  }

 private:
  /// x, y: across the line; z: the parameter along it.
  [[nodiscard]] glm::dvec3 sheared(const glm::dvec3& p) const {
    const glm::dvec3 d = p - from_;
    return {d[kx_] - shear_.x * d[kz_], d[ky_] - shear_.y * d[kz_], shear_.z * d[kz_]};
  }
  static double edge(const glm::dvec3& a, const glm::dvec3& b) { return a.x * b.y - a.y * b.x; }
  /// The sign of edge(), of a line that is moved by (e, e^2).
  static int side(const glm::dvec3& a, const glm::dvec3& b) {
    const double value = edge(a, b);
    if (value != 0.0) return value > 0.0 ? 1 : -1;
    if (a.y != b.y) return b.y - a.y > 0.0 ? 1 : -1;
    if (a.x != b.x) return b.x - a.x > 0.0 ? -1 : 1;
    return 0;
  }

  glm::dvec3 from_, shear_;
  int kx_ = 0, ky_ = 1, kz_ = 2;
};

/// The line of a pixel: a point of it and its direction, away from the eye.
RaySpan line_of(const View& view, const glm::dmat4& world_from_image, int u, int v) {
  const auto at = [&](double depth) {
    const glm::dvec4 world = world_from_image * glm::dvec4(u + 0.5, v + 0.5, depth, 1.0);
    return glm::dvec3(world) / world.w;
  };
  RaySpan ray;
  ray.from = at(0.0);
  ray.direction = glm::normalize(at(kPictureDepthLimit - 1.0) - ray.from);
  if (view.perspective) {
    // The first and the last depth may be near each other; the eye is exact.
    const glm::dmat4& eye = view.eye_from_world;
    const glm::dvec3 along = ray.from + glm::transpose(glm::dmat3(eye)) * glm::dvec3(eye[3]);
    if (glm::length(along) > 0.0) ray.direction = glm::normalize(along);
  }
  return ray;
}

/// The point of a triangle that is nearest to `p`, which lies in its plane, moved inwards.
glm::dvec3 into_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                         const glm::dvec3& c) {
  const glm::dvec3 n = glm::cross(b - a, c - a);
  const double area = glm::dot(n, n);
  if (!(area > 0.0)) return a;
  glm::dvec3 weight(glm::dot(glm::cross(c - b, p - b), n), glm::dot(glm::cross(a - c, p - c), n),
                    glm::dot(glm::cross(b - a, p - a), n));
  weight = glm::max(weight / area, glm::dvec3(1e-7));
  weight /= weight.x + weight.y + weight.z;
  return a * weight.x + b * weight.y + c * weight.z;
}

}  // namespace

/// What one thread needs for a line.
struct TreeRays::Scratch {
  explicit Scratch(const Program& program) : state(program) {}
  ProgramState state;
  std::vector<Crossing> crossings;
  std::vector<std::pair<double, std::uint32_t>> toggles;  ///< where, and which solid
  std::vector<std::uint32_t> toggled;
};

TreeRays::TreeRays(const Tree& tree, Tree::NodeId root, double relative_precision,
                   const Execution& execution, const TreeRays* former)
    : geometry_(tree, execution), program_(compile(tree, root)) {
  const auto& parts = geometry_.parts();
  const Bounds& box = geometry_.box();
  const double size = box.empty() ? 0.0 : glm::length(box.high - box.low);
  // Pictures find coincident faces within some of their 2^24 depth steps.
  slack_ = geometry_.world_error(tree, relative_precision) + size * 0x1p-21;
  reach_ = 4.0 * size;
  for (const Solid& solid : tree.solids()) {
    meshes_.push_back(solid.mesh);
    places_.push_back(solid.world_from_mesh);
  }
  triangles_.resize(parts.size());
  parallel_for(execution, parts.size(), [&](std::size_t i, int) {
    const Geometry::Part& part = parts[i];
    const bool whole = part.box == part.whole;
    if (former != nullptr && whole && i < former->meshes_.size() && meshes_[i] != nullptr &&
        former->meshes_[i] == meshes_[i] && former->places_[i] == places_[i] &&
        former->geometry_.parts()[i].box == part.box) {
      triangles_[i] = former->triangles_[i];
      return;
    }
    std::vector<Bounds> boxes(part.triangles.size());
    for (std::size_t t = 0; t < boxes.size(); ++t) {
      for (int k = 0; k < 3; ++k) boxes[t].include(part.positions[part.triangles[t][k]]);
    }
    triangles_[i] = std::make_shared<const RayBoxes>(boxes);
  });
  std::vector<Bounds> boxes(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (program_.leaves[i].parent != Program::kNone) boxes[i] = parts[i].box;
  }
  solids_ = RayBoxes(boxes);
}

void TreeRays::gather(const RaySpan& ray, Scratch& scratch) const {
  scratch.crossings.clear();
  const LineTest line(ray.from, ray.direction);
  const auto& parts = geometry_.parts();
  solids_.on_ray(ray, [&](std::uint32_t solid) {
    const Geometry::Part& part = parts[solid];
    triangles_[solid]->on_ray(ray, [&](std::uint32_t t) {
      const glm::uvec3& corners = part.triangles[t];
      const auto met = line.meet(part.positions[corners.x], part.positions[corners.y],
                                 part.positions[corners.z]);
      if (met && met->first >= ray.low) {
        scratch.crossings.push_back({met->first, solid, met->second});
      }
    });
  });
  std::sort(scratch.crossings.begin(), scratch.crossings.end(),
            [](const Crossing& a, const Crossing& b) {
              if (a.solid != b.solid) return a.solid < b.solid;
              return a.t != b.t ? a.t < b.t : a.exit < b.exit;
            });
  // What lies ahead tells where the line begins: far away it is outside of all solids.
  scratch.toggles.clear();
  for (std::size_t i = 0; i < scratch.crossings.size();) {
    const std::uint32_t solid = scratch.crossings[i].solid;
    std::size_t end = i;
    int winding = 0;
    for (; end < scratch.crossings.size() && scratch.crossings[end].solid == solid; ++end) {
      winding += scratch.crossings[end].exit ? 1 : -1;
    }
    const InsideRule rule = parts[solid].rule;
    bool inside = is_inside(rule, winding);
    if (inside) scratch.toggles.emplace_back(ray.low, solid);
    for (; i < end; ++i) {
      winding += scratch.crossings[i].exit ? -1 : 1;
      if (is_inside(rule, winding) == inside) continue;
      inside = !inside;
      scratch.toggles.emplace_back(scratch.crossings[i].t, solid);
    }
  }
  std::sort(scratch.toggles.begin(), scratch.toggles.end());
}

double TreeRays::thickness(const glm::dvec3& from, const glm::dvec3& along,
                           Scratch& scratch) const {
  const double far = glm::length(from - 0.5 * (geometry_.box().low + geometry_.box().high));
  gather({from, along, -4.0 * slack_, reach_ + 2.0 * far}, scratch);
  ProgramState& state = scratch.state;
  const auto& toggles = scratch.toggles;
  scratch.toggled.clear();
  double begin = 0.0, end = -1.0, result = 0.0;
  bool inside = state.value();
  bool any = inside;
  std::size_t i = 0;
  while (i < toggles.size()) {
    const double t = toggles[i].first;
    for (; i < toggles.size() && toggles[i].first == t; ++i) {
      state.toggle(toggles[i].second);
      scratch.toggled.push_back(toggles[i].second);
    }
    if (state.value() == inside) continue;
    inside = state.value();
    if (inside) {
      if (end >= 0.0 && t - end > slack_) break;  // a gap
      if (!any) {
        if (t > 4.0 * slack_) break;  // there is nothing at the point itself
        begin = std::max(t, 0.0);
      }
      any = true;
      end = -1.0;
    } else if (t - begin > slack_) {
      end = t;
    } else {
      any = false;
      end = -1.0;
    }
  }
  if (any && inside && end < 0.0) result = std::numeric_limits<double>::infinity();
  if (any && end >= 0.0) result = end;
  for (const std::uint32_t solid : scratch.toggled) state.toggle(solid);
  return result;
}

TriangleSoup TreeRays::solid_mesh(std::uint32_t solid) const {
  return meshes_[solid] ? transform(*meshes_[solid], places_[solid]) : TriangleSoup{};
}

double TreeRays::thickness(const glm::dvec3& from, const glm::dvec3& along) const {
  Scratch scratch(program_);
  return thickness(from, along, scratch);
}

SurfacePoint TreeRays::point(const View& view, const SurfaceImage& image, int u, int v) const {
  return point(view, glm::inverse(view.image_from_world), image, u, v);
}

SurfacePoint TreeRays::point(const View& view, const glm::dmat4& world_from_image,
                             const SurfaceImage& image, int u, int v) const {
  const auto pixel = static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) +
                     static_cast<std::size_t>(u);
  SurfacePoint point;
  point.solid = image.solid[pixel];
  point.triangle = image.triangle[pixel] & ~SurfaceImage::kExit;
  point.cut = (image.triangle[pixel] & SurfaceImage::kExit) != 0;
  const Geometry::Part& part = geometry_.parts()[point.solid];
  const glm::uvec3& corners = part.triangles[point.triangle];
  const glm::dvec3 &a = part.positions[corners.x], &b = part.positions[corners.y],
                   &c = part.positions[corners.z];
  const RaySpan ray = line_of(view, world_from_image, u, v);
  const glm::dvec4 shown =
      world_from_image * glm::dvec4(u + 0.5, v + 0.5, image.depth[pixel] + 0.5, 1.0);
  point.where = glm::dvec3(shown) / shown.w;
  const glm::dvec3 across = glm::cross(b - a, c - a);
  const double length = glm::length(across);
  if (!(length > 0.0)) {
    point.normal = -ray.direction;
    point.inner = point.where;
    return point;
  }
  point.normal = across / length;
  const double facing = glm::dot(point.normal, ray.direction);
  if (facing > 0.0) point.normal = -point.normal;
  // Seen edge on, the plane says nothing of the depth.
  if (std::abs(facing) > 1e-4) {
    const double t = glm::dot(a - ray.from, across) / glm::dot(ray.direction, across);
    point.where = ray.from + ray.direction * t;
  }
  point.inner = into_triangle(point.where, a, b, c);
  return point;
}

Result<std::vector<float>> TreeRays::wall_image(const View& view, const SurfaceImage& image,
                                                const Execution& execution,
                                                std::vector<float>* light) const {
  const auto width = static_cast<std::size_t>(image.width);
  const auto height = static_cast<std::size_t>(image.height);
  std::vector<float> found(width * height, 0.0f);
  if (light != nullptr) light->assign(width * height, 0.0f);
  const glm::dmat4 world_from_image = glm::inverse(view.image_from_world);
  const glm::dmat3 eye_from_world(view.eye_from_world);
  std::vector<std::unique_ptr<Scratch>> scratch(static_cast<std::size_t>(execution.thread_count()));
  parallel_for(execution, height, [&](std::size_t v, int worker) {
    auto& own = scratch[static_cast<std::size_t>(worker)];
    if (!own) own = std::make_unique<Scratch>(program_);
    for (std::size_t u = 0; u < width; ++u) {
      if (image.depth[v * width + u] == SurfaceImage::kNone) continue;
      const SurfacePoint at =
          point(view, world_from_image, image, static_cast<int>(u), static_cast<int>(v));
      found[v * width + u] = static_cast<float>(thickness(at.inner, -at.normal, *own));
      if (light != nullptr) (*light)[v * width + u] = eye_light(eye_from_world * at.normal);
    }
  });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  // Pixel centres beside an edge, where the lattice of the picture shows a face that ends a trifle
  // before: a neighbour of the same solid knows.
  std::vector<float> filled = found;
  for (std::size_t v = 0; v < height; ++v) {
    for (std::size_t u = 0; u < width; ++u) {
      const std::size_t pixel = v * width + u;
      if (image.depth[pixel] == SurfaceImage::kNone || found[pixel] > 0.0f) continue;
      for (std::size_t y = v > 0 ? v - 1 : 0; y < std::min(v + 2, height); ++y) {
        for (std::size_t x = u > 0 ? u - 1 : 0; x < std::min(u + 2, width); ++x) {
          const std::size_t other = y * width + x;
          if (found[other] > 0.0f && image.solid[other] == image.solid[pixel]) {
            filled[pixel] = found[other];
          }
        }
      }
    }
  }
  return filled;
}

}  // namespace strata::csg
