#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>

#include "core/printable.h"
#include "csg/outline/formats/outline_import.h"
#include "csg/outline/text.h"
#include "csg/scene/evaluator.h"
#include "csg/solids/height_map.h"
#include "csg/solids/primitives.h"
#include "strata/mesh/formats/read_mesh.h"
#include "strata/mesh/soup_tools.h"

namespace strata::csg {
namespace {

/// The position of an argument that can only be given by name.
constexpr auto kNamedOnly = std::numeric_limits<std::uint32_t>::max();

/// Reads indices of points as OpenSCAD does, and describes their faults.
class IndexReader {
 public:
  /// @param list  the kind of list in messages, such as "face"
  IndexReader(std::string_view list, std::size_t points) : list_(list), points_(points) {}

  /// @param at  number of the list
  void read(const ValueRef& value, std::size_t at, std::vector<std::uint32_t>& indices) {
    const double number = value.number(-1.0);
    const bool there = number >= 0.0 && number < static_cast<double>(points_);
    if (there) indices.push_back(static_cast<std::uint32_t>(number));
    if (there && number == std::floor(number)) return;
    Fault& fault = there ? broken_ : out_of_range_;
    if (fault.count++ == 0) fault.first = fmt::format("{} in {} {}", value.shown(), list_, at);
  }
  /// One sentence for each kind of fault.
  [[nodiscard]] std::vector<std::string> faults() const {
    std::vector<std::string> texts;
    if (out_of_range_.count > 0) {
      texts.push_back(
          fmt::format("{} corners of {}s are not indices of the {} points, the first is "
                      "{}; they are left out",
                      out_of_range_.count, list_, points_, out_of_range_.first));
    }
    if (broken_.count > 0) {
      texts.push_back(
          fmt::format("{} corners of {}s are not whole numbers, the first is {}; they "
                      "are rounded down",
                      broken_.count, list_, broken_.first));
    }
    return texts;
  }

 private:
  struct Fault {
    std::uint64_t count = 0;
    std::string first;
  };
  std::string_view list_;
  std::size_t points_;
  Fault out_of_range_, broken_;
};

namespace fs = std::filesystem;

/// A sentence about a unit that is not the millimetre; empty where there is none to tell. Numbers
/// are taken as they are, so such a model has a different size.
std::string unit_note(const std::string& path, const MeshReadStats& stats) {
  constexpr std::pair<double, std::string_view> kUnits[] = {
      {1e-6, "micron"}, {1e-2, "centimeter"}, {0.0254, "inch"}, {0.3048, "foot"}, {1.0, "meter"}};
  for (const auto& [metres, name] : kUnits) {
    if (stats.unit_metres != metres) continue;
    return fmt::format(
        "{}: its unit is the {}{}; the numbers are taken as they are{}; scale({:g}) makes them "
        "millimetres",
        path, name, stats.y_up ? " and y is up" : "", stats.y_up ? "" : ", as OpenSCAD does",
        metres * 1000);
  }
  return {};
}

/// A file's name as messages show it.
std::string shown(std::string_view name) { return printable(name, 120); }

std::string extension_of(const std::string& path) {
  std::string extension = fs::path(path).extension().string();
  for (char& c : extension) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  return extension;
}

void move_to_middle(TriangleSoup& mesh) {
  const Bounds box = bounds(mesh);
  if (box.empty()) return;
  const glm::dvec3 middle = 0.5 * box.low + 0.5 * box.high;
  for (glm::dvec3& p : mesh.positions) p -= middle;
}

/// Looks for `name` in a folder and the folders around it. Returns the first path that passes the
/// test.
template <class Test>
std::optional<std::string> first_place(const std::string& folder, const std::string& name,
                                       Test&& test) {
  if (fs::path(name).is_absolute()) return test(name) ? std::optional(name) : std::nullopt;
  constexpr int kMostLevels = 8;
  fs::path around(folder);
  for (int level = 0; level < kMostLevels; ++level, around /= "..") {
    const fs::path path = around / name;
    if (test(path)) return path.string();
  }
  return std::nullopt;
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

/// One mesh shared by all primitives with the same arguments; none if it would exceed the limits.
template <class Make>
std::shared_ptr<const TriangleSoup> Evaluator::primitive(std::uint32_t node,
                                                         std::vector<double> key, double segments,
                                                         double triangles, const Make& make) {
  auto& mesh = primitives_[{name(node), std::move(key)}];
  if (mesh || !fits(node, fmt::format("{:g} segments", segments), triangles, Made::kTriangles)) {
    return mesh;
  }
  mesh = std::make_shared<const TriangleSoup>(make());
  return mesh;
}

void Evaluator::cube(std::uint32_t node, const Context& context) {
  glm::dvec3 size;
  read_sizes(node, std::span(&size.x, 3));
  for (int i = 0; i < 3; ++i) {
    if (!is_length(node, "a size", size[i])) return;
  }
  const bool centre = arguments(node).find("center", 1).truth(false);
  add_solid(node, context, primitive(node, {size.x, size.y, size.z, double(centre)}, 4, 12, [&] {
              return make_cube(size, centre);
            }));
}

void Evaluator::sphere(std::uint32_t node, const Context& context) {
  const double radius = this->radius(node, "r", "d", 0, 1.0);
  if (!is_length(node, "the radius", radius)) return;
  const Segments round = segments(node);
  const double count = round.count(radius);
  add_solid(node, context,
            primitive(node, {radius, count}, count, sphere_triangle_count(radius, round),
                      [&] { return make_sphere(radius, round); }));
}

void Evaluator::cylinder(std::uint32_t node, const Context& context) {
  const NodeArguments given = arguments(node);
  const double height = number(node, "h", given.find("h", 0), 1.0);
  const double both = radius(node, "r", "d", kNamedOnly, 1.0);
  const double radius1 = radius(node, "r1", "d1", 1, both);
  const double radius2 = radius(node, "r2", "d2", 2, both);
  if (!is_length(node, "the height", height) || !is_length(node, "the radius r1", radius1) ||
      !is_length(node, "the radius r2", radius2)) {
    return;
  }
  const bool centre = given.find("center", 3).truth(false);
  const Segments round = segments(node);
  const double count = round.count(std::max(radius1, radius2));
  add_solid(node, context,
            primitive(node, {height, radius1, radius2, double(centre), count}, count, 4.0 * count,
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
                  fmt::format("point {} of the polyhedron is {}, not three finite numbers; the "
                              "polyhedron is left out",
                              points.size(), point.shown()));
    }
    points.emplace_back(p[0], p[1], p[2]);
  }
  ValueRef list = given.find("faces", 1);
  if (!list.given()) list = given.find("triangles");
  std::vector<std::vector<std::uint32_t>> faces;
  IndexReader reader("face", points.size());
  for (const ValueRef face : list) {
    std::vector<std::uint32_t>& corners = faces.emplace_back();
    for (const ValueRef corner : face) reader.read(corner, faces.size() - 1, corners);
    std::reverse(corners.begin(), corners.end());  // clockwise in the file, seen from outside
  }
  for (const std::string& text : reader.faults()) warn(node, "geometry", text);
  BentFaces bent;
  TriangleSoup mesh = make_faces(std::move(points), faces, &bent);
  if (bent.count > 0) {
    warn(
        node, "non-planar",
        fmt::format("face {} of the polyhedron is not flat: {} ({} in all); it can be divided into "
                    "triangles in several ways",
                    bent.first, bent.bend.text(), bent.count));
  }
  if (mesh.triangles.empty()) return;
  const InsideRule rule = inspect(node, mesh);
  add_solid(node, context, std::move(mesh), rule);
}

void Evaluator::square(std::uint32_t node, const Context& context) {
  glm::dvec2 size;
  read_sizes(node, std::span(&size.x, 2));
  if (!is_length(node, "a size", size.x) || !is_length(node, "a size", size.y)) return;
  add_outline(node, context, make_square(size, arguments(node).find("center", 1).truth(false)));
}

void Evaluator::circle(std::uint32_t node, const Context& context) {
  const double radius = this->radius(node, "r", "d", 0, 1.0);
  if (!is_length(node, "the radius", radius)) return;
  const Segments round = segments(node);
  const double count = round.count(radius);
  if (!fits(node, fmt::format("{:g} segments", count), count, Made::kPoints)) return;
  add_outline(node, context, make_circle(radius, round));
}

void Evaluator::polygon(std::uint32_t node, const Context& context) {
  const NodeArguments given = arguments(node);
  std::vector<glm::dvec2> points;
  for (const ValueRef point : given.find("points", 0)) {
    double p[2];
    if (point.numbers(p, 2) < 2 || !(std::abs(p[0]) < kMostCoordinate) ||
        !(std::abs(p[1]) < kMostCoordinate)) {
      return warn(node, "geometry",
                  fmt::format("point {} of the polygon is {}, not two numbers below {:g}; the "
                              "polygon is left out",
                              points.size(), point.shown(), kMostCoordinate));
    }
    points.emplace_back(p[0], p[1]);
  }
  std::vector<std::vector<std::uint32_t>> paths;
  IndexReader reader("path", points.size());
  std::vector<std::uint32_t> flat_path;  // `paths = [0, 1, 2]` is one path without its own brackets
  for (const ValueRef path : given.find("paths", 1)) {
    if (!path.is_list()) {
      reader.read(path, 0, flat_path);
      continue;
    }
    std::vector<std::uint32_t>& corners = paths.emplace_back();
    for (const ValueRef corner : path) reader.read(corner, paths.size() - 1, corners);
  }
  if (!flat_path.empty()) paths.push_back(std::move(flat_path));
  for (const std::string& text : reader.faults()) warn(node, "geometry", text);
  auto outline = make_polygon(points, paths, &job_);
  if (!outline) {
    return leave_out(node, "geometry", outline.error(), "the polygon is left out");
  }
  add_outline(node, context, *std::move(outline));
}

void Evaluator::text(std::uint32_t node, const Context& context) {
  const NodeArguments given = arguments(node);
  TextOptions options;
  options.text = given.find("text", 0).string();
  if (options.text.empty()) return;
  options.size = number(node, "size", given.find("size", 1), options.size);
  options.font = given.find("font", 2).string();
  options.spacing = number(node, "spacing", options.spacing);
  options.direction = given.find("direction").string();
  options.language = given.find("language").string();
  options.script = given.find("script").string();
  options.halign = given.find("halign").string(options.halign);
  options.valign = given.find("valign").string(options.valign);
  options.segments = segments(node);
  // A letter has about twenty curves, each of an eighth of a circle or less.
  const double count = options.segments.count(options.size);
  const double points = 20.0 * static_cast<double>(options.text.size()) * (count / 8 + 1);
  if (!fits(node, fmt::format("{} bytes with {:g} segments a circle", options.text.size(), count),
            points, Made::kPoints)) {
    return;
  }
  std::string missing;
  auto outline = make_text(options, missing, &job_);
  if (!outline) {
    return leave_out(node, "missing-font", outline.error(),
                     fmt::format("the text '{}' is left out", options.text));
  }
  if (!missing.empty()) {
    warn(node, "missing-font",
         fmt::format("the font '{}' is not installed; another font is used", missing));
  }
  add_outline(node, context, *std::move(outline));
}

void Evaluator::surface(std::uint32_t node, const Context& context) {
  const NodeArguments given = arguments(node);
  const std::string file = given.find("file", 0).string();
  if (file.empty()) return;
  const auto path = asset(node, file);
  if (!path) return;
  std::string short_rows;
  auto mesh = read_surface(*path, given.find("center", 1).truth(false),
                           given.truth("invert", false), &short_rows, execution_);
  if (!short_rows.empty()) warn(node, "geometry", short_rows);
  if (!mesh) return leave_out(node, "geometry", mesh.error(), "the surface is left out");
  add_solid(node, context, *std::move(mesh));
}

std::optional<std::string> find_asset(const std::string& folder, const std::string& name) {
  return first_place(folder, name, [](const fs::path& path) {
    std::error_code ignored;
    return fs::is_regular_file(path, ignored);
  });
}

std::optional<std::string> Evaluator::asset(std::uint32_t node, const std::string& file) {
  if (auto found = find_asset(folder_, file)) {
    if (!root_.empty() && !lies_below(*found, root_)) {
      stop(ErrorCode::kInput, node,
           fmt::format("'{}' needs the file '{}', which lies outside of the root folder {}",
                       name(node), shown(file), root_));
      return std::nullopt;
    }
    if (asked_for_.insert(*found).second) scene_.files.push_back(identify_file(*found));
    return found;
  }
  const std::string wanted = (fs::path(folder_) / file).string();
  if (asked_for_.insert(wanted).second) scene_.files.push_back({wanted, 0, 0});
  const auto other = first_place(folder_, file, [](const fs::path& path) {
    std::error_code ignored;
    return fs::exists(path, ignored);
  });
  warn(node, "missing-file",
       fmt::format("'{}' needs the file '{}', which is {}; it is left out", name(node), shown(file),
                   !other                     ? "missing"
                   : fs::is_directory(*other) ? "a folder"
                                              : "not a regular file"));
  return std::nullopt;
}

void Evaluator::import(std::uint32_t node, const Context& context) {
  const NodeArguments given = arguments(node);
  const std::string file = given.find("file", 0).string();
  if (file.empty()) return;
  const std::string extension = extension_of(file);
  const bool flat = extension == ".svg" || extension == ".dxf";
  const bool solid = mesh_format_of(file) != MeshFormat::kAuto;
  const auto path = asset(node, file);
  if (!path) return;
  if (flat) return add_outline(node, context, import_outline(node, *path));
  if (!solid) {
    return warn(node, "not-done",
                extension == ".nef3"
                    ? fmt::format("'{}': Nef polyhedra are not read; it is left out", shown(file))
                    : fmt::format("'{}': the file's type is unknown; it is left out", shown(file)));
  }
  const bool centre = given.truth("center", false);
  Imported& imported = imports_[{*path, centre}];
  if (!imported.mesh) {
    Execution execution = execution_;
    execution.progress = {};
    auto mesh = read_mesh(*path, {}, execution);
    if (!mesh) {
      leave_out(node, "geometry", mesh.error(), "it is left out");
      if (error_) return;
    } else {
      if (mesh->stats.dropped_faces() > 0) {
        warn(node, "geometry",
             fmt::format("{}: {} of {} faces are broken and left out", *path,
                         mesh->stats.dropped_faces(), mesh->stats.faces));
      }
      for (const std::string& text : mesh->stats.warnings) warn(node, "geometry", text);
      if (const std::string text = unit_note(*path, mesh->stats); !text.empty()) {
        warn(node, "geometry", text);
      }
      if (centre) move_to_middle(mesh->soup);
      if (!mesh->soup.triangles.empty()) imported.rule = inspect(node, mesh->soup);
    }
    imported.mesh =
        std::make_shared<const TriangleSoup>(mesh ? std::move(mesh->soup) : TriangleSoup());
  }
  add_solid(node, context, imported.mesh, imported.rule);
}

Outline Evaluator::import_outline(std::uint32_t node, const std::string& path) {
  const NodeArguments given = arguments(node);
  OutlineImport options;
  options.layer = given.find("layer", 1).string();
  if (const std::string id = given.find("id").string(); !id.empty()) options.layer = id;
  double origin[2] = {0.0, 0.0};
  given.find("origin", 3).numbers(origin, 2);
  options.origin = {origin[0], origin[1]};
  options.scale = number(node, "scale", given.find("scale", 4), options.scale);
  options.dpi = number(node, "dpi", options.dpi);
  options.centre = given.truth("center", false);
  options.segments = segments(node);
  std::vector<std::string> warnings;
  auto outline = read_outline(path, options, execution_, &warnings);
  for (const std::string& text : warnings) warn(node, "geometry", text);
  if (outline) return *std::move(outline);
  leave_out(node, "geometry", outline.error(), "it is left out");
  return {};
}

}  // namespace strata::csg
