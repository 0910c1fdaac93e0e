#include <algorithm>
#include <cmath>
#include <limits>

#include "csg/scene/evaluator.h"
#include "csg/scene/primitives.h"
#include "csg/scene/surface.h"

namespace strata::csg {
namespace {

/// More would be a typing mistake, and gigabytes.
constexpr double kMostTriangles = 100e6;

/// A number, or a list of them; one number stands for all.
template <int N>
glm::vec<N, double> read_vector(const ValueRef& value, double otherwise) {
  glm::vec<N, double> result(value.number(otherwise));
  if (value.is_list()) {
    double numbers[N];
    for (double& number : numbers) number = otherwise;
    value.numbers(numbers, N);
    for (int i = 0; i < N; ++i) result[i] = numbers[i];
  }
  return result;
}

/// A radius by `r`, or half the diameter by `d`.
double read_radius(const NodeArguments& given, std::string_view radius, std::string_view diameter,
                   double otherwise) {
  if (const ValueRef value = given.find(diameter); value.is_number()) {
    return 0.5 * value.number(0.0);
  }
  return given.find(radius).number(otherwise);
}

/// An index as OpenSCAD reads it; none if it is not one.
std::optional<std::uint32_t> read_index(const ValueRef& value) {
  const double number = value.number(-1.0);
  if (!(number >= 0.0 && number < 4294967295.0)) return std::nullopt;
  return static_cast<std::uint32_t>(number);
}

}  // namespace

void Evaluator::leaf(std::uint32_t node, const Context& context) {
  using Maker = void (Evaluator::*)(std::uint32_t, const Context&);
  static constexpr std::pair<std::string_view, Maker> kMakers[] = {
      {"cylinder", &Evaluator::cylinder}, {"cube", &Evaluator::cube},
      {"sphere", &Evaluator::sphere},     {"polyhedron", &Evaluator::polyhedron},
      {"square", &Evaluator::square},     {"circle", &Evaluator::circle},
      {"polygon", &Evaluator::polygon},   {"text", &Evaluator::text},
      {"surface", &Evaluator::surface},   {"import", &Evaluator::import}};
  for (const auto& [module, make] : kMakers) {
    if (module == name(node)) return (this->*make)(node, context);
  }
}

/// One mesh for all primitives with these arguments.
template <class Make>
std::shared_ptr<const TriangleSoup> Evaluator::primitive(std::uint32_t node,
                                                         std::vector<double> key,
                                                         const Make& make) {
  auto& mesh = primitives_[{name(node), std::move(key)}];
  if (!mesh) mesh = std::make_shared<const TriangleSoup>(make());
  return mesh;
}

void Evaluator::cube(std::uint32_t node, const Context& context) {
  const NodeArguments given = arguments(node);
  const glm::dvec3 size = read_vector<3>(given.find("size", 0), 1.0);
  const bool centre = given.find("center", 1).truth(false);
  add_solid(node, context, primitive(node, {size.x, size.y, size.z, double(centre)}, [&] {
              return make_cube(size, centre);
            }));
}

void Evaluator::sphere(std::uint32_t node, const Context& context) {
  const NodeArguments given = arguments(node);
  const double radius = read_radius(given, "r", "d", given.find("", 0).number(1.0));
  const Segments round = segments(node);
  if (sphere_triangle_count(radius, round) > kMostTriangles) {
    return stop(
        ErrorCode::kLimit, node,
        fmt::format("a sphere of {} segments would have {:.3g} triangles; the limit is {:g}",
                    round.count(radius), sphere_triangle_count(radius, round), kMostTriangles));
  }
  add_solid(node, context, primitive(node, {radius, double(round.count(radius))}, [&] {
              return make_sphere(radius, round);
            }));
}

void Evaluator::cylinder(std::uint32_t node, const Context& context) {
  const NodeArguments given = arguments(node);
  const double height = given.find("h", 0).number(1.0);
  const double both = read_radius(given, "r", "d", 1.0);
  const double radius1 = read_radius(given, "r1", "d1", both);
  const double radius2 = read_radius(given, "r2", "d2", both);
  const bool centre = given.truth("center", false);
  const Segments round = segments(node);
  const int count = round.count(std::max(radius1, radius2));
  add_solid(node, context,
            primitive(node, {height, radius1, radius2, double(centre), double(count)},
                      [&] { return make_cylinder(height, radius1, radius2, centre, round); }));
}

void Evaluator::polyhedron(std::uint32_t node, const Context& context) {
  const NodeArguments given = arguments(node);
  std::vector<glm::dvec3> points;
  for (const ValueRef point : given.find("points", 0)) {
    double p[3];
    if (point.numbers(p, 3) < 3 || !std::isfinite(p[0]) || !std::isfinite(p[1]) ||
        !std::isfinite(p[2])) {
      return warn(node, "geometry",
                  fmt::format("point {} of the polyhedron is not three finite numbers; the "
                              "polyhedron is left out",
                              points.size()));
    }
    points.emplace_back(p[0], p[1], p[2]);
  }
  ValueRef list = given.find("faces", 1);
  if (!list.given()) list = given.find("triangles");
  std::vector<std::vector<std::uint32_t>> faces;
  std::uint64_t out_of_range = 0;
  for (const ValueRef face : list) {
    std::vector<std::uint32_t>& corners = faces.emplace_back();
    for (const ValueRef corner : face) {
      const auto index = read_index(corner);
      if (index && *index < points.size()) {
        corners.push_back(*index);
      } else {
        ++out_of_range;
      }
    }
    std::reverse(corners.begin(), corners.end());  // clockwise seen from outside in the file
  }
  if (out_of_range > 0) {
    warn(node, "geometry",
         fmt::format("{} corners of faces are no indices of the {} points; they are left out",
                     out_of_range, points.size()));
  }
  TriangleSoup mesh = make_faces(std::move(points), faces);
  if (mesh.triangles.empty()) return;
  const InsideRule rule = inspect(node, mesh);
  add_solid(node, context, std::move(mesh), rule);
}

void Evaluator::square(std::uint32_t node, const Context& context) {
  const NodeArguments given = arguments(node);
  const glm::dvec2 size = read_vector<2>(given.find("size", 0), 1.0);
  if (!(size.x > 0.0 && size.y > 0.0) || !std::isfinite(size.x) || !std::isfinite(size.y)) return;
  add_outline(node, context, make_square(size, given.find("center", 1).truth(false)));
}

void Evaluator::circle(std::uint32_t node, const Context& context) {
  const NodeArguments given = arguments(node);
  const double radius = read_radius(given, "r", "d", given.find("", 0).number(1.0));
  if (!(radius > 0.0) || !std::isfinite(radius)) return;
  add_outline(node, context, make_circle(radius, segments(node)));
}

void Evaluator::polygon(std::uint32_t node, const Context& context) {
  const NodeArguments given = arguments(node);
  std::vector<glm::dvec2> points;
  for (const ValueRef point : given.find("points", 0)) {
    double p[2];
    if (point.numbers(p, 2) < 2 || !std::isfinite(p[0]) || !std::isfinite(p[1])) {
      return warn(node, "geometry",
                  fmt::format("point {} of the polygon is not two finite numbers; the polygon is "
                              "left out",
                              points.size()));
    }
    points.emplace_back(p[0], p[1]);
  }
  std::vector<std::vector<std::uint32_t>> paths;
  std::uint64_t out_of_range = 0;
  const auto add_corner = [&](std::vector<std::uint32_t>& path, const ValueRef& corner) {
    const auto index = read_index(corner);
    if (index && *index < points.size()) {
      path.push_back(*index);
    } else {
      ++out_of_range;
    }
  };
  std::vector<std::uint32_t> flat_path;  // `paths = [0, 1, 2]`: one path without its brackets
  for (const ValueRef path : given.find("paths", 1)) {
    if (!path.is_list()) {
      add_corner(flat_path, path);
      continue;
    }
    std::vector<std::uint32_t>& corners = paths.emplace_back();
    for (const ValueRef corner : path) add_corner(corners, corner);
  }
  if (!flat_path.empty()) paths.push_back(std::move(flat_path));
  if (out_of_range > 0) {
    warn(node, "geometry",
         fmt::format("{} corners of paths are no indices of the {} points; they are left out",
                     out_of_range, points.size()));
  }
  auto outline = make_polygon(points, paths);
  if (!outline) {
    return warn(node, "geometry",
                fmt::format("{}; the polygon is left out", outline.error().message));
  }
  add_outline(node, context, *std::move(outline));
}

void Evaluator::text(std::uint32_t node, const Context& context) {
  const NodeArguments given = arguments(node);
  TextOptions options;
  options.text = given.find("text", 0).string();
  if (options.text.empty()) return;
  options.size = given.find("size", 1).number(options.size);
  options.font = given.find("font", 2).string();
  options.spacing = given.number("spacing", options.spacing);
  options.direction = given.find("direction").string();
  options.language = given.find("language").string();
  options.script = given.find("script").string();
  options.halign = given.find("halign").string(options.halign);
  options.valign = given.find("valign").string(options.valign);
  options.segments = segments(node);
  std::string missing;
  auto outline = make_text(options, missing);
  if (!outline) {
    return warn(
        node, "missing-font",
        fmt::format("{}; the text '{}' is left out", outline.error().message, options.text));
  }
  if (!missing.empty()) {
    warn(node, "missing-font",
         fmt::format("the font '{}' is not installed; another is shown instead", missing));
  }
  add_outline(node, context, *std::move(outline));
}

void Evaluator::surface(std::uint32_t node, const Context& context) {
  const NodeArguments given = arguments(node);
  const std::string file = given.find("file", 0).string();
  if (file.empty()) return;
  const auto path = asset(node, file);
  if (!path) return;
  auto mesh = read_surface(*path, given.truth("center", false), given.truth("invert", false));
  if (!mesh) {
    return mesh.error().code == ErrorCode::kLimit
               ? stop(mesh.error().code, node, mesh.error().message)
               : warn(node, "geometry",
                      fmt::format("{}; the surface is left out", mesh.error().message));
  }
  add_solid(node, context, *std::move(mesh));
}

}  // namespace strata::csg
