#include <pybind11/stl.h>

#include <fmt/format.h>

#include <glm/matrix.hpp>

#include "csg/solids/primitives.h"
#include "python/call.h"
#include "python/data.h"
#include "strata/contour/contour.h"
#include "strata/csg/input/scene_input.h"
#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/writers/write_solid.h"
#include "strata/voxelize/grid_fit.h"
#include "strata/voxelize/readers/read_voxel_grid.h"

namespace strata::python {

csg::InputMessages collect(Warnings& warnings) {
  csg::InputMessages messages;
  messages.warn = [&warnings](std::string, std::string message) {
    warnings.push_back(std::move(message));
  };
  return messages;
}

Result<MeshPtr> mesh_of(TriangleSoup soup, const std::string& name, InsideRule rule,
                        bool keep_orientation, Warnings& warnings, const Execution& execution) {
  auto mesh = std::make_shared<MeshData>();
  csg::SceneInput input;
  input.rule = rule;
  input.keep_orientation = keep_orientation;
  MeshReadStats stats;
  stats.format = "arrays";
  stats.vertices = soup.positions.size();
  stats.triangles = soup.triangles.size();
  stats.faces = soup.face_elements.empty() ? stats.triangles : soup.face_elements.back() + 1;
  auto facts = csg::inspect_mesh(soup, std::move(stats), name, input, collect(warnings), execution);
  if (!facts) return tl::unexpected(facts.error());
  mesh->input.rule = facts->rule;
  mesh->input.soup = std::move(soup);
  mesh->input.add(*std::move(facts));
  return mesh;
}

namespace {

constexpr std::pair<const char*, InsideRule> kRules[] = {{"winding", InsideRule::kWinding},
                                                         {"nonzero", InsideRule::kNonzero},
                                                         {"parity", InsideRule::kParity}};

InsideRule rule_of(const std::string& word) {
  for (const auto& [name, rule] : kRules) {
    if (word == name) return rule;
  }
  refuse(ErrorCode::kUsage,
         fmt::format("rule must be 'winding', 'nonzero' or 'parity', got '{}'", word));
}

const char* word_of(InsideRule rule) { return kRules[static_cast<int>(rule)].first; }

/// Where a file's mesh comes to lie.
csg::MeshPlacement placement_of(double unit_metres, const std::string& up,
                                const std::array<double, 3>& scale,
                                const std::array<double, 3>& translate) {
  csg::MeshPlacement made;
  made.unit_metres = unit_metres;
  if (up == "y") {
    made.up = csg::MeshPlacement::Up::kY;
  } else if (up == "z") {
    made.up = csg::MeshPlacement::Up::kZ;
  } else if (up != "file") {
    refuse(ErrorCode::kUsage, fmt::format("up must be 'file', 'y' or 'z', got '{}'", up));
  }
  made.scale = vec_of(scale);
  made.translate = vec_of(translate);
  return made;
}

std::pair<MeshPtr, Warnings> read_mesh_file(const std::string& path, const std::string& rule,
                                            bool keep_orientation,
                                            const std::vector<std::string>& parts,
                                            const csg::MeshPlacement& placement,
                                            const Limits& limits) {
  csg::SceneInput input;
  input.placement = placement;
  input.files = {path};
  input.rule = rule_of(rule);
  input.keep_orientation = keep_orientation;
  input.parts = parts;
  input.attributes = true;
  if (csg::is_scene_name(path)) {
    refuse(ErrorCode::kUsage, fmt::format("{}: it is a scene; strata.csg.load() reads it", path));
  }
  Warnings warnings;
  auto mesh = std::make_shared<MeshData>();
  mesh->input = run(limits, [&](const Execution& execution) {
    return csg::load_solids(input, false, collect(warnings), execution);
  });
  return {mesh, warnings};
}

/// Corners of triangles, or of polygons where `offsets` says which belong to a face.
TriangleSoup soup_of(const Values<double>& vertices, const Values<std::int64_t>& corners,
                     const std::optional<Values<std::int64_t>>& offsets) {
  std::vector<glm::dvec3> positions(static_cast<std::size_t>(vertices.shape(0)));
  const double* v = vertices.data();
  for (glm::dvec3& p : positions) p = {v[0], v[1], v[2]}, v += 3;
  const std::int64_t* c = corners.data();
  const auto at = [&](std::int64_t i) { return static_cast<std::uint32_t>(c[i]); };
  if (!offsets) {
    TriangleSoup soup;
    soup.positions = std::move(positions);
    soup.triangles.resize(static_cast<std::size_t>(corners.size()) / 3);
    for (glm::uvec3& t : soup.triangles) t = {at(0), at(1), at(2)}, c += 3;
    return soup;
  }
  std::vector<std::vector<std::uint32_t>> faces(static_cast<std::size_t>(offsets->size() - 1));
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (std::int64_t i = offsets->data()[f]; i < offsets->data()[f + 1]; ++i) {
      faces[f].push_back(at(i));
    }
  }
  return csg::make_faces(std::move(positions), faces);
}

std::pair<MeshPtr, Warnings> make_mesh(const Values<double>& vertices,
                                       const Values<std::int64_t>& corners,
                                       const std::optional<Values<std::int64_t>>& offsets,
                                       const std::optional<Values<std::uint8_t>>& vertex_colours,
                                       const std::optional<Values<std::uint8_t>>& face_colours,
                                       const std::string& name, const std::string& rule,
                                       bool keep_orientation, const Limits& limits) {
  const InsideRule inside = rule_of(rule);
  Warnings warnings;
  auto mesh = run(limits, [&](const Execution& execution) {
    return mesh_of(soup_of(vertices, corners, offsets), name, inside, keep_orientation, warnings,
                   execution);
  });
  const auto take = [](const std::optional<Values<std::uint8_t>>& from) {
    std::vector<glm::u8vec4> colours;
    for (py::ssize_t i = 0; from && i < from->size(); i += 4) {
      const std::uint8_t* c = from->data() + i;
      colours.emplace_back(c[0], c[1], c[2], c[3]);
    }
    return colours;
  };
  mesh->input.attributes.vertex_colours = take(vertex_colours);
  mesh->input.attributes.element_colours = take(face_colours);
  return {mesh, warnings};
}

py::dict info_of(const MeshData& mesh, const Limits& limits) {
  const csg::InputFacts& facts = mesh.input.files.front();
  const MeshDiagnosis found = run(limits, [&](const Execution& execution) -> Result<MeshDiagnosis> {
    return diagnose(mesh.input.soup, execution);
  });
  py::dict info;
  info["name"] = facts.path;
  info["format"] = facts.stats.format;
  info["vertices"] = found.vertices;
  info["welded_vertices"] = found.welded_vertices;
  info["triangles"] = found.triangles;
  info["faces"] = facts.stats.faces;
  info["components"] = found.components;
  info["closed"] = facts.closed;
  info["rule"] = word_of(facts.rule);
  info["area"] = found.area;
  info["volume"] = found.volume;
  info["low"] = tuple_of(found.bounds.low);
  info["high"] = tuple_of(found.bounds.high);
  info["edges"] = found.edges;
  info["boundary_edges"] = found.boundary_edges;
  info["non_manifold_edges"] = found.non_manifold_edges;
  info["misoriented_edges"] = found.misoriented_edges;
  info["unbalanced_edges"] = found.unbalanced_edges;
  info["degenerate_faces"] = found.degenerate_faces;
  info["duplicate_faces"] = found.duplicate_faces;
  info["dropped_faces"] = facts.stats.dropped_faces();
  info["turned_around"] = facts.turned_around;
  std::vector<std::string> parts;
  for (const MeshPart& part : mesh.input.attributes.parts) parts.push_back(part.name);
  info["parts"] = parts;
  info["coloured"] = mesh.input.attributes.coloured();
  return info;
}

void save_mesh(const MeshData& mesh, const std::string& path, const Limits& limits) {
  run(limits, [&](const Execution& execution) -> Result<void> {
    const TriangleSoup& soup = mesh.input.soup;
    if (solid_format_of(path) != SolidFormat::k3mf) return write_mesh(path, soup);
    return write_solid(path, {soup.positions, soup.triangles, {}, {MeshPart{}}}, {}, execution);
  });
}

MeshPtr contour_mesh(const MeshData& mesh, const VoxelGrid& grid, Warnings& warnings,
                     const Limits& limits) {
  const csg::SolidInput& input = mesh.input;
  return run(limits, [&](const Execution& execution) -> Result<MeshPtr> {
    auto made =
        contour(input.soup, grid,
                {.rule = input.rule,
                 .closedness = input.closed ? Closedness::kAssumeClosed : Closedness::kAssumeOpen},
                execution);
    if (!made) return tl::unexpected(made.error());
    return mesh_of({std::move(made->mesh.positions), std::move(made->mesh.triangles), {}},
                   "the contour", InsideRule::kWinding, true, warnings, execution);
  });
}

VoxelFileGrid make_grid(const std::array<std::int64_t, 3>& dims,
                        const std::array<double, 3>& origin, const std::array<double, 3>& spacing,
                        const std::optional<std::array<std::array<double, 3>, 3>>& direction) {
  for (const std::int64_t side : dims) {
    if (side < 1 || side > kMaxGridSide) {
      refuse(ErrorCode::kUsage, fmt::format("dims must be 1 to {} along each axis, got {}, {}, {}",
                                            kMaxGridSide, dims[0], dims[1], dims[2]));
    }
  }
  VoxelFileGrid made;
  made.grid.dims = glm::ivec3(glm::vec<3, std::int64_t>(dims[0], dims[1], dims[2]));
  made.grid.origin = vec_of(origin);
  made.grid.voxel_size = vec_of(spacing);
  value_of(check_grid(made.grid));
  if (direction)
    made.frame.direction = glm::transpose(
        glm::dmat3(vec_of((*direction)[0]), vec_of((*direction)[1]), vec_of((*direction)[2])));
  return made;
}

VoxelFileGrid fitted_grid(const std::array<double, 3>& low, const std::array<double, 3>& high,
                          std::optional<std::int64_t> resolution,
                          const std::optional<std::array<double, 3>>& voxel_size,
                          const std::optional<std::array<std::int64_t, 3>>& dims,
                          const std::optional<std::array<std::array<double, 3>, 2>>& bounds,
                          const std::optional<std::array<double, 3>>& origin, std::int64_t padding,
                          bool align) {
  GridRequest request;
  request.resolution = resolution;
  if (voxel_size) request.voxel_size = vec_of(*voxel_size);
  request.dims = dims;
  if (bounds) request.bounds = Bounds{vec_of((*bounds)[0]), vec_of((*bounds)[1])};
  if (origin) request.origin = vec_of(*origin);
  request.padding = padding;
  request.align = align;
  return {value_of(fit_grid({vec_of(low), vec_of(high)}, request)), {}};
}

VoxelFileGrid grid_of_file(const std::string& path, const Limits& limits) {
  return run(limits, [&](const Execution& execution) { return read_voxel_grid(path, execution); });
}

void bind_grid(py::module_& module) {
  py::class_<VoxelFileGrid>(module, "Grid")
      .def(py::init(&make_grid), py::arg("dims"), py::arg("origin"), py::arg("spacing"),
           py::arg("direction"))
      .def_property_readonly("dims",
                             [](const VoxelFileGrid& g) {
                               const glm::ivec3& d = g.grid.dims;
                               return py::make_tuple(d.x, d.y, d.z);
                             })
      .def_property_readonly("origin",
                             [](const VoxelFileGrid& g) { return tuple_of(g.grid.origin); })
      .def_property_readonly("spacing",
                             [](const VoxelFileGrid& g) { return tuple_of(g.grid.voxel_size); })
      .def_property_readonly("direction", [](const VoxelFileGrid& g) {
        const glm::dmat3 rows = glm::transpose(g.frame.direction);
        return py::make_tuple(tuple_of(rows[0]), tuple_of(rows[1]), tuple_of(rows[2]));
      });
  module.def("grid_of_file", &grid_of_file, py::arg("path"), py::arg("limits"));
  module.def("fit_grid", &fitted_grid, py::arg("low"), py::arg("high"), py::arg("resolution"),
             py::arg("voxel_size"), py::arg("dims"), py::arg("bounds"), py::arg("origin"),
             py::arg("padding"), py::arg("align"));
}

}  // namespace

void bind_meshes(py::module_& module) {
  bind_grid(module);
  py::class_<csg::MeshPlacement>(module, "Placement")
      .def(py::init(&placement_of), py::arg("unit_metres"), py::arg("up"), py::arg("scale"),
           py::arg("translate"));
  py::class_<MeshData, MeshPtr>(module, "Mesh")
      .def_property_readonly("vertices",
                             [](const MeshPtr& mesh) {
                               const auto& p = mesh->input.soup.positions;
                               return view_of(p.empty() ? nullptr : &p.data()->x, p.size(), 3,
                                              py::cast(mesh));
                             })
      .def_property_readonly("faces",
                             [](const MeshPtr& mesh) {
                               const auto& t = mesh->input.soup.triangles;
                               return view_of(t.empty() ? nullptr : &t.data()->x, t.size(), 3,
                                              py::cast(mesh));
                             })
      .def_property_readonly("closed", [](const MeshData& m) { return m.input.closed; })
      .def_property_readonly("name", [](const MeshData& m) { return m.input.files.front().path; })
      .def_property_readonly("rule", [](const MeshData& m) { return word_of(m.input.rule); })
      .def_property_readonly("area", [](const MeshData& m) { return m.input.area; })
      .def_property_readonly("volume", [](const MeshData& m) { return m.input.volume; })
      .def_property_readonly("low", [](const MeshData& m) { return tuple_of(m.input.bounds.low); })
      .def_property_readonly("high",
                             [](const MeshData& m) { return tuple_of(m.input.bounds.high); })
      .def("info", &info_of, py::arg("limits"))
      .def("save", &save_mesh, py::arg("path"), py::arg("limits"))
      .def(
          "contour",
          [](const MeshData& mesh, const VoxelFileGrid& grid, const Limits& limits) {
            Warnings warnings;
            if (grid.frame.turned()) {
              refuse(ErrorCode::kUsage, "contour() needs a grid along the axes of the world");
            }
            MeshPtr made = contour_mesh(mesh, grid.grid, warnings, limits);
            return std::pair(std::move(made), std::move(warnings));
          },
          py::arg("grid"), py::arg("limits"));
  module.def("read_mesh", &read_mesh_file, py::arg("path"), py::arg("rule"),
             py::arg("keep_orientation"), py::arg("parts"), py::arg("placement"),
             py::arg("limits"));
  module.def("make_mesh", &make_mesh, py::arg("vertices"), py::arg("corners"), py::arg("offsets"),
             py::arg("vertex_colours"), py::arg("face_colours"), py::arg("name"), py::arg("rule"),
             py::arg("keep_orientation"), py::arg("limits"));
}

}  // namespace strata::python
