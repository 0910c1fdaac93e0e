#include <pybind11/stl.h>

#include <fmt/format.h>

#include <cmath>
#include <glm/matrix.hpp>

#include "csg/input/frame_scene.h"
#include "csg/outline/segments.h"
#include "csg/solids/primitives.h"
#include "python/call.h"
#include "python/data.h"
#include "strata/csg.h"
#include "strata/csg/input/scene_input.h"
#include "strata/mesh/writers/write_solid.h"

namespace strata::python {
namespace {

SolidPtr solid_of(TriangleSoup soup, InsideRule rule, const std::string& name) {
  auto made = std::make_shared<SolidData>();
  csg::Solid solid;
  solid.mesh = std::make_shared<const TriangleSoup>(std::move(soup));
  solid.rule = rule;
  solid.name = name;
  made->scene.tree = csg::Tree(std::move(solid));
  return made;
}

csg::Segments segments_of(double fn, double fa, double fs) {
  csg::Segments segments;
  const auto check = [](const char* name, double value, double least) {
    if (!(value >= least) || !std::isfinite(value)) {
      refuse(ErrorCode::kUsage, fmt::format("{} must be at least {}, got {}", name, least, value));
    }
  };
  check("fn", fn, 0), check("fa", fa, 0.01), check("fs", fs, 0.01);
  segments.fn = fn, segments.fa = fa, segments.fs = fs;
  return segments;
}

void check_length(const char* name, double value, bool may_be_zero) {
  if (std::isfinite(value) && (value > 0 || (may_be_zero && value == 0))) return;
  refuse(ErrorCode::kUsage, fmt::format("{} must be a number {}, got {}", name,
                                        may_be_zero ? "of at least 0" : "above 0", value));
}

SolidPtr make_cube_solid(const std::array<double, 3>& size, bool centre) {
  for (const double side : size) check_length("size", side, false);
  return solid_of(csg::make_cube(vec_of(size), centre), InsideRule::kWinding, "cube");
}

SolidPtr make_sphere_solid(double radius, double fn, double fa, double fs) {
  check_length("r", radius, false);
  const csg::Segments segments = segments_of(fn, fa, fs);
  constexpr double kMost = 2e7;
  if (const double count = csg::sphere_triangle_count(radius, segments); count > kMost) {
    refuse(ErrorCode::kLimit, fmt::format("a sphere of {:g} triangles is too large, {:g} are the "
                                          "most",
                                          count, kMost));
  }
  return solid_of(csg::make_sphere(radius, segments), InsideRule::kWinding, "sphere");
}

SolidPtr make_cylinder_solid(double height, double r1, double r2, bool centre, double fn, double fa,
                             double fs) {
  check_length("h", height, false), check_length("r1", r1, true), check_length("r2", r2, true);
  check_length("the larger of r1 and r2", std::max(r1, r2), false);
  return solid_of(csg::make_cylinder(height, r1, r2, centre, segments_of(fn, fa, fs)),
                  InsideRule::kWinding, "cylinder");
}

SolidPtr solid_of_mesh(const MeshData& mesh) {
  return solid_of(mesh.input.soup, mesh.input.rule, mesh.input.files.front().path);
}

/// A scene, its warnings, and the lines that its program prints.
std::tuple<SolidPtr, Warnings, std::vector<std::string>> solid_of_scene(csg::Scene&& scene) {
  auto made = std::make_shared<SolidData>();
  Warnings warnings;
  for (const csg::SceneWarning& warning : scene.warnings) warnings.push_back(warning.message);
  std::vector<std::string> notes = scene.notes;
  made->scene = std::move(scene);
  if (made->scene.tree.root() == csg::Tree::kNone) {
    made->scene.tree.set_root(made->scene.tree.add(csg::Operation::kUnion, {}));
  }
  return {made, warnings, notes};
}

/// A scene, or a mesh, of which each part may be a solid.
std::tuple<SolidPtr, Warnings, std::vector<std::string>> load_scene_file(
    const std::string& path, const std::vector<std::string>& defines, const std::string& root,
    bool parts, const Limits& limits) {
  csg::SceneInput input;
  input.files = {path};
  input.scene.root_folder = root;
  input.split_parts = parts;
  for (const std::string& define : defines) {
    input.scene.openscad_options.insert(input.scene.openscad_options.end(), {"-D", define});
  }
  Warnings warnings;
  std::vector<std::string> notes;
  csg::InputMessages messages = collect(warnings);
  messages.echo = [&notes](std::string_view line) { notes.emplace_back(line); };
  auto made = solid_of_scene(run(limits, [&](const Execution& execution) {
    return csg::load_scene(input, messages, execution);
  }));
  return {std::get<0>(made), std::move(warnings), std::move(notes)};
}

auto parse_scene_text(const std::string& text, const std::string& folder, const Limits& limits) {
  csg::ReadSceneOptions options;
  options.asset_folder = folder;
  return solid_of_scene(run(limits, [&](const Execution& execution) {
    return csg::parse_scene(text, "the scene", options, execution);
  }));
}

SolidPtr combine(csg::Operation operation, const std::vector<SolidPtr>& operands) {
  auto made = std::make_shared<SolidData>();
  csg::Tree& tree = made->scene.tree;
  std::vector<csg::Tree::NodeId> nodes;
  for (const SolidPtr& operand : operands) {
    const csg::Scene& scene = operand->scene;
    nodes.push_back(tree.append(scene.tree, scene.tree.root()));
    made->scene.relative_precision =
        std::max(made->scene.relative_precision, scene.relative_precision);
  }
  tree.set_root(tree.add(operation, nodes));
  return made;
}

SolidPtr moved(const SolidData& solid, const Values<double>& matrix) {
  glm::dmat4 m;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) m[column][row] = matrix.at(row, column);
  }
  const double scale = glm::determinant(glm::dmat3(m));
  if (m[0][3] != 0 || m[1][3] != 0 || m[2][3] != 0 || m[3][3] != 1) {
    refuse(ErrorCode::kUsage, fmt::format("the last row of matrix must be 0, 0, 0, 1, got {}, {}, "
                                          "{}, {}",
                                          m[0][3], m[1][3], m[2][3], m[3][3]));
  }
  if (!std::isfinite(scale) || scale == 0) {
    refuse(ErrorCode::kUsage,
           fmt::format("matrix must not flatten solids: its determinant is {}", scale));
  }
  auto made = std::make_shared<SolidData>(solid);
  made->scene.tree = csg::transform(m, std::move(made->scene.tree));
  made->scene.view.reset();
  return made;
}

SolidPtr coloured(const SolidData& solid, const std::array<float, 4>& colour) {
  auto made = std::make_shared<SolidData>(solid);
  for (csg::Solid& leaf : made->scene.tree.solids()) {
    leaf.colour = glm::vec4(colour[0], colour[1], colour[2], colour[3]);
  }
  return made;
}

// --- pictures ------------------------------------------------------------------------------------

/// What a picture of a solid looks like.
struct LookChoice {
  int samples = 1;
  bool edges = false, ground_shadow = false;
  std::string scheme;
  std::optional<std::array<std::uint8_t, 4>> background;
};

csg::PictureOptions options_of(const LookChoice& look) {
  csg::PictureOptions options;
  options.samples = look.samples;
  options.edges = look.edges;
  options.ground_shadow = look.ground_shadow;
  if (!look.scheme.empty()) {
    options.scheme = csg::find_colour_scheme(look.scheme);
    if (options.scheme == nullptr) {
      std::string names;
      for (const csg::ColourScheme& scheme : csg::colour_schemes()) {
        names += fmt::format("{}'{}'", names.empty() ? "" : ", ", scheme.name);
      }
      refuse(ErrorCode::kUsage,
             fmt::format("scheme must be one of {}, got '{}'", names, look.scheme));
    }
  }
  if (look.background) {
    const auto& b = *look.background;
    const Rgba colour = b[3] == 0 ? Rgba(0) : Rgba(b[0], b[1], b[2], 255);
    options.backdrop = Backdrop{colour, colour};
  }
  return options;
}

/// The camera, placed so that all is seen unless the choice says where it stands.
Result<Camera> placed_camera(const csg::Scene& scene, const CameraChoice& choice, bool given,
                             const glm::ivec2& size, const Execution& execution) {
  Camera camera = choice.camera();
  if (!given && scene.view && scene.view->distance) {
    camera.target = scene.view->target.value_or(Camera{}.target);
    camera.rotation = scene.view->rotation.value_or(Camera{}.rotation);
    camera.distance = *scene.view->distance;
    camera.field_of_view = scene.view->field_of_view.value_or(Camera{}.field_of_view);
    return camera;
  }
  if (choice.placed()) return camera;
  const auto box = csg::visible_box(scene, execution);
  if (!box) return tl::unexpected(box.error());
  auto done = csg::frame_scene(scene, *box, {}, {}, static_cast<double>(size.x) / size.y, camera,
                               execution);
  if (!done) return tl::unexpected(done.error());
  if (!std::isfinite(camera.distance)) {
    return fail(ErrorCode::kGeometry,
                "the scene reaches from {:.6g} to {:.6g} along x; these coordinates are too large "
                "for a picture",
                box->low.x, box->high.x);
  }
  return camera;
}

py::array solid_picture(const SolidData& solid, const std::optional<CameraChoice>& camera,
                        const std::array<std::int64_t, 2>& size, const LookChoice& look,
                        const Limits& limits) {
  const csg::PictureOptions options = options_of(look);
  Picture picture;
  run(limits, [&](const Execution& execution) -> Result<void> {
    const auto pixels = size_of(size[0], size[1], execution);
    if (!pixels) return tl::unexpected(pixels.error());
    csg::Scene scene = solid.scene;
    const auto placed = placed_camera(scene, camera.value_or(CameraChoice{}), camera.has_value(),
                                      *pixels, execution);
    if (!placed) return tl::unexpected(placed.error());
    std::vector<csg::Ghost> ghosts;
    for (const auto node : scene.backgrounds) ghosts.push_back({node, csg::kBackgroundGhost});
    for (const auto node : scene.highlights) ghosts.push_back({node, csg::kHighlightGhost});
    if (!scene.shown.empty()) {
      scene.tree.set_root(scene.tree.add(csg::Operation::kUnion, scene.shown));
    }
    csg::Preview preview(std::move(scene.tree), std::move(ghosts), scene.relative_precision,
                         execution);
    auto drawn = preview.picture(*placed, *pixels, options, execution);
    if (!drawn) return tl::unexpected(drawn.error());
    picture = *std::move(drawn);
    return {};
  });
  return array_of_picture(std::move(picture));
}

// --- sizes and meshes ----------------------------------------------------------------------------

/// @param inertia  of exact measures; else None
py::dict dict_of(const auto& measures, bool exact, double volume_error, py::object inertia) {
  py::dict made;
  made["exact"] = exact;
  made["empty"] = measures.empty;
  made["volume"] = measures.volume;
  made["volume_error"] = volume_error;
  made["area"] = measures.area;
  made["area_error"] = measures.area_error;
  made["centre"] = tuple_of(measures.centre);
  made["low"] = tuple_of(measures.low);
  made["high"] = tuple_of(measures.high);
  made["inertia"] = std::move(inertia);
  return made;
}

py::dict dict_of(const csg::ExactMeasures& exact) {
  const auto& i = exact.inertia;
  return dict_of(exact, true, exact.volume_snap_error,
                 py::make_tuple(py::make_tuple(i[0], i[5], i[4]), py::make_tuple(i[5], i[1], i[3]),
                                py::make_tuple(i[4], i[3], i[2])));
}

py::dict dict_of(const csg::Measures& measures) {
  return dict_of(measures, false, measures.volume_error, py::none());
}

/// Exactly; by rays where a resolution is given, and where solids are open or too large.
py::dict measures_of(const SolidData& solid, std::optional<int> resolution, const Limits& limits) {
  const csg::Tree& tree = solid.scene.tree;
  if (!resolution) {
    const auto exact =
        run(limits, [&](const Execution& execution) -> Result<std::optional<csg::ExactMeasures>> {
          csg::BoundaryOptions options;
          options.open = csg::OpenSolids::kFail;
          auto made = csg::exact_measures(tree, tree.root(), options, execution);
          if (made && std::isfinite(made->volume) && std::isfinite(made->area))
            return *std::move(made);
          if (!made && made.error().code != ErrorCode::kGeometry &&
              made.error().code != ErrorCode::kLimit) {
            return tl::unexpected(made.error());
          }
          return std::nullopt;
        });
    if (exact) return dict_of(*exact);
  }
  return dict_of(run(limits, [&](const Execution& execution) {
    return csg::measure(tree, tree.root(), {resolution, solid.scene.relative_precision}, execution);
  }));
}

csg::BoundaryOptions boundary_options(int bits, const std::string& faces, const std::string& parts,
                                      const std::string& open) {
  csg::BoundaryOptions options;
  options.bits = bits;
  const auto pick = [](const char* name, const std::string& word,
                       std::initializer_list<const char*> words) {
    int index = 0;
    std::string all;
    for (const char* one : words) {
      if (word == one) return index;
      all += fmt::format("{}'{}'", index++ == 0 ? "" : ", ", one);
    }
    refuse(ErrorCode::kUsage, fmt::format("{} must be one of {}, got '{}'", name, all, word));
  };
  options.faces = static_cast<csg::BoundaryFaceKind>(pick("faces", faces, {"canonical", "input"}));
  options.parts =
      static_cast<csg::BoundaryParts>(pick("parts", parts, {"one", "colours", "solids"}));
  options.open = static_cast<csg::OpenSolids>(pick("open", open, {"cap", "fail"}));
  return options;
}

std::pair<MeshPtr, Warnings> mesh_of_solid(const SolidData& solid, int bits,
                                           const std::string& faces, const std::string& open,
                                           const Limits& limits) {
  const csg::BoundaryOptions options = boundary_options(bits, faces, "one", open);
  const csg::Tree& tree = solid.scene.tree;
  Warnings warnings;
  auto mesh = run(limits, [&](const Execution& execution) -> Result<MeshPtr> {
    auto made = csg::boundary_mesh(tree, tree.root(), options, execution);
    if (!made) return tl::unexpected(made.error());
    return mesh_of({std::move(made->mesh.positions), std::move(made->mesh.triangles), {}},
                   "the solid", InsideRule::kWinding, true, warnings, execution);
  });
  return {mesh, warnings};
}

void save_solid(const SolidData& solid, const std::string& path, int bits, const std::string& faces,
                const std::string& parts, const std::string& open, const Limits& limits) {
  csg::BoundaryOptions options = boundary_options(bits, faces, parts, open);
  const csg::Tree& tree = solid.scene.tree;
  run(limits, [&](const Execution& execution) -> Result<void> {
    const SolidFormat format = solid_format_of(path);
    if (format == SolidFormat::kAuto) {
      return fail(ErrorCode::kUsage, "{}: the file name must end in .3mf, .stl, .obj, .ply or .off",
                  path);
    }
    options.float_positions = format == SolidFormat::kStl;
    auto made = csg::boundary_mesh(tree, tree.root(), options, execution);
    if (!made) return tl::unexpected(made.error());
    return write_solid(path, made->mesh, {}, execution);
  });
}

std::pair<py::tuple, py::tuple> bounds_of(const SolidData& solid) {
  const Bounds box = csg::bounds(solid.scene.tree);
  return {tuple_of(box.low), tuple_of(box.high)};
}

std::vector<std::string> names_of(const SolidData& solid) {
  std::vector<std::string> names;
  for (const csg::Solid& leaf : solid.scene.tree.solids()) names.push_back(leaf.name);
  return names;
}

}  // namespace

void bind_solids(py::module_& module) {
  py::class_<LookChoice>(module, "Look")
      .def(py::init([](int samples, bool edges, bool ground_shadow, std::string scheme,
                       std::optional<std::array<std::uint8_t, 4>> background) {
             return LookChoice{samples, edges, ground_shadow, std::move(scheme), background};
           }),
           py::arg("samples"), py::arg("edges"), py::arg("ground_shadow"), py::arg("scheme"),
           py::arg("background"));
  module.def("cube", &make_cube_solid);
  module.def("sphere", &make_sphere_solid);
  module.def("cylinder", &make_cylinder_solid);
  module.def("solid_of_mesh", &solid_of_mesh);
  module.def("load_scene", &load_scene_file);
  module.def("parse_scene", &parse_scene_text);
  module.def("unite",
             [](const std::vector<SolidPtr>& all) { return combine(csg::Operation::kUnion, all); });
  module.def("intersect", [](const std::vector<SolidPtr>& all) {
    return combine(csg::Operation::kIntersection, all);
  });
  module.def("subtract", [](const std::vector<SolidPtr>& all) {
    return combine(csg::Operation::kDifference, all);
  });
  module.def("moved", &moved);
  module.def("coloured", &coloured);
  module.def("solid_picture", &solid_picture);
  module.def("measure", &measures_of);
  module.def("solid_mesh", &mesh_of_solid);
  module.def("save_solid", &save_solid);
  module.def("solid_bounds", &bounds_of);
  module.def("solid_names", &names_of);
}

}  // namespace strata::python
