#include <pybind11/stl.h>

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <glm/matrix.hpp>

#include "core/printable.h"
#include "python/call.h"
#include "python/data.h"
#include "python/voxel_values.h"
#include "strata/csg/boundary/boundary_mesh.h"
#include "strata/csg/picture/picture.h"
#include "strata/csg/solid_lists.h"
#include "strata/mesh/shapes.h"
#include "strata/raster/lattice_mesh.h"
#include "strata/voxelize/distance/inner_faces.h"
#include "strata/voxelize/voxelize.h"
#include "voxelize/open/lost_walls.h"

// Voxels of meshes and trees.

namespace strata::python {
namespace {

/// What voxelize() takes beside the mesh and the grid.
struct VoxelChoice {
  bool solid = true, surface = false, ids = false;
  std::int64_t coverage = 0;  ///< rays along a voxel's side; 0: none
  bool colours = false;
  std::optional<std::array<std::uint8_t, 3>> fill;  ///< colour of what is deep inside
  bool sdf = false;
  double band = 0;  ///< of distances, in voxels; 0: everywhere
  std::string open, surface_kind;
};

VoxelizeOptions options_of(const VoxelChoice& choice) {
  VoxelizeOptions options;
  options.solid = choice.solid;
  options.surface = choice.surface;
  if (!choice.solid && !choice.surface) {
    refuse(ErrorCode::kUsage, "solid and surface must not both be False");
  }
  constexpr std::int64_t kMostRays = 16;
  if (choice.coverage < 0 || choice.coverage > kMostRays ||
      (choice.coverage != 0 && !std::has_single_bit(static_cast<unsigned>(choice.coverage)))) {
    refuse(ErrorCode::kUsage,
           fmt::format("coverage must be 1, 2, 4, 8 or 16 rays, got {}", choice.coverage));
  }
  options.rays = static_cast<int>(choice.coverage);
  if (options.rays != 0 && (choice.ids || choice.surface)) {
    refuse(ErrorCode::kUsage, "coverage is of solid voxels: ids and surface must be False");
  }
  if (int{choice.ids} + int{options.rays != 0} + int{choice.colours} + int{choice.sdf} > 1) {
    refuse(ErrorCode::kUsage, "a voxel holds one of ids, coverage, colours and sdf");
  }
  if (choice.sdf && (choice.surface || !choice.solid)) {
    refuse(ErrorCode::kUsage, "distances are those of a solid: surface must be False");
  }
  constexpr std::pair<const char*, OpenMode> kModes[] = {
      {"vote", OpenMode::kVote}, {"surface", OpenMode::kSurface}, {"fail", OpenMode::kFail}};
  const auto mode = std::find_if(std::begin(kModes), std::end(kModes),
                                 [&](const auto& m) { return choice.open == m.first; });
  if (mode == std::end(kModes)) {
    refuse(ErrorCode::kUsage,
           fmt::format("open must be 'vote', 'surface' or 'fail', got '{}'", choice.open));
  }
  options.open = mode->second;
  constexpr std::pair<const char*, SurfaceKind> kKinds[] = {
      {"conservative", SurfaceKind::kConservative},
      {"26", SurfaceKind::k26},
      {"6", SurfaceKind::k6}};
  const auto kind = std::find_if(std::begin(kKinds), std::end(kKinds),
                                 [&](const auto& k) { return choice.surface_kind == k.first; });
  if (kind == std::end(kKinds)) {
    refuse(ErrorCode::kUsage, fmt::format("surface_kind must be 'conservative', '26' or '6', got "
                                          "'{}'",
                                          choice.surface_kind));
  }
  options.surface_kind = kind->second;
  return options;
}

/// Whether a mesh fits the lattice of a grid without clamping.
bool fits_lattice(const Bounds& box, const VoxelGrid& grid) {
  constexpr double kMost = kMaxLatticeCoordinate - 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double scale = kLatticeSteps / grid.voxel_size[axis];
    if (!((box.high[axis] - grid.origin[axis]) * scale < kMost)) return false;
    if (!((box.low[axis] - grid.origin[axis]) * scale > -kMost)) return false;
  }
  return true;
}

}  // namespace

void add_slab(VoxelIntervals& set, const VoxelIntervals& slab) {
  const int first = slab.v_begin() / VoxelIntervals::kTileSide;
  for (int tv = 0; tv < slab.tiles_v(); ++tv) {
    for (int tu = 0; tu < slab.tiles_u(); ++tu) {
      const VoxelIntervals::TileView tile = slab.tile(tu, tv);
      if (tile.offsets.empty()) continue;
      set.set_tile(tu, first + tv, tile.offsets, tile.items, tile.labels);
    }
  }
}

namespace {

/// Keeps the slabs of a large set as long as they fit the memory.
Result<VoxelIntervals> voxelize_large(const TriangleSoup& soup, const VoxelGrid& grid,
                                      const VoxelizeOptions& options, const Execution& execution) {
  VoxelIntervals all(grid, options.axis);
  std::uint64_t bytes = 0;
  const auto keep = [&](const VoxelIntervals& slab) -> Result<void> {
    bytes += slab.memory_bytes();
    if (bytes > execution.memory_limit) {
      return fail(ErrorCode::kLimit,
                  "the runs of the first {} of {} rows of voxels take {} bytes, the limit is {}",
                  slab.v_end(), all.v_end(), bytes, execution.memory_limit);
    }
    add_slab(all, slab);
    return {};
  };
  const auto done = voxelize_slabs(soup, grid, options, execution, keep);
  if (!done) return tl::unexpected(done.error());
  return all;
}

/// All voxels in one piece. The library's own voxelize() does not ask how large that becomes.
Result<VoxelIntervals> voxelize_all(const TriangleSoup& soup, const VoxelGrid& grid,
                                    const VoxelizeOptions& options, const Execution& execution) {
  constexpr std::uint64_t kBytesOfColumn = 64;  // far more than most have
  const auto columns =
      static_cast<std::uint64_t>(grid.dims.x) * static_cast<std::uint64_t>(grid.dims.y);
  if (columns * kBytesOfColumn > execution.memory_limit) {
    return voxelize_large(soup, grid, options, execution);
  }
  return voxelize(soup, grid, options, execution);
}

std::string place(const glm::dvec3& p) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z);
}

/// Tells of walls between voxel centres, as the tool does.
Result<void> warn_of_walls(const TriangleSoup& soup, const VoxelFileGrid& placed,
                           const LostWallOptions& search, const VoxelIntervals& set,
                           Warnings& warnings, const Execution& execution) {
  const auto lost = find_lost_walls(soup, placed.grid, search, execution);
  if (!lost) return tl::unexpected(lost.error());
  if (lost->count > 0) {
    const LostWall& wall = lost->largest.front();
    const Bounds box = placed.frame.world_box({wall.low, wall.high});
    warnings.push_back(fmt::format(
        "{} thinner than a voxel fell between voxel centres; {} {:.3g} voxels thick along {}, from "
        "{} to {}; surface=True keeps all of it",
        counted(lost->count, "wall"), lost->count == 1 ? "it is" : "the largest is", wall.thickness,
        "xyz"[static_cast<int>(wall.axis)], place(box.low), place(box.high)));
  } else if (set.solid_voxels() == 0) {
    warnings.push_back(
        "no voxel is solid: the mesh lies outside the grid, or is thinner than a voxel");
  }
  return {};
}

/// The largest grid that is n times finer.
Result<void> check_rays(const VoxelGrid& grid, const VoxelizeOptions& options) {
  const int longest = std::max({grid.dims.x, grid.dims.y, grid.dims.z});
  if (options.rays * longest <= kMaxGridSide) return {};
  return fail(ErrorCode::kLimit,
              "coverage: {} rays per side on a grid of {} x {} x {} voxels exceed {}", options.rays,
              grid.dims.x, grid.dims.y, grid.dims.z, kMaxGridSide);
}

/// The finest grid that vertices are snapped to.
VoxelGrid finest_of(VoxelGrid grid, const VoxelizeOptions& options) {
  const int n = std::max(1, options.rays);
  grid.dims *= n, grid.voxel_size /= n;
  return grid;
}

/// What labels are when fractions were asked for.
void mark_shares(const VoxelizeOptions& options, VoxelsData& voxels) {
  if (options.rays == 0) return;
  const auto n = static_cast<std::uint32_t>(options.rays);
  voxels.volume.kind = VoxelKind::kFog;
  voxels.full = kLatticeSteps * n * n * n;
}

/// A mesh as a grid sees it: turned into the grid's space, and clamped where it does not fit.
class SeenMesh {
 public:
  Result<void> see(const TriangleSoup& soup, const Bounds& box, const VoxelGrid& finest,
                   const GridFrame& frame, const Execution& execution) {
    soup_ = &soup;
    Bounds seen = box;
    if (frame.turned()) {
      moved_ = transform(soup, glm::dmat4(glm::transpose(frame.direction)));
      soup_ = &moved_, seen = bounds(moved_, execution);
    }
    if (fits_lattice(seen, finest)) return {};
    if (soup_ != &moved_) moved_ = soup, soup_ = &moved_;
    auto done = fit_lattice(moved_, seen, finest, execution);
    if (!done) return tl::unexpected(done.error());
    clamped_ = !done->empty();
    return {};
  }
  [[nodiscard]] const TriangleSoup& soup() const { return *soup_; }
  [[nodiscard]] bool clamped() const { return clamped_; }

 private:
  const TriangleSoup* soup_ = nullptr;
  TriangleSoup moved_;
  bool clamped_ = false;
};

/// The exact boundary of a tree, turned into the space of a grid.
Result<TriangleSoup> boundary_of(const csg::Tree& tree, const Execution& execution) {
  auto made = csg::boundary_mesh(tree, tree.root(), {}, execution);
  if (!made) return tl::unexpected(made.error());
  return TriangleSoup{std::move(made->mesh.positions), std::move(made->mesh.triangles), {}};
}

/// The boundary of a closed mesh that overlaps itself; nothing where its own faces are that.
Result<std::optional<TriangleSoup>> outer_faces(const csg::SolidInput& input,
                                                const TriangleSoup& seen, const VoxelGrid& grid,
                                                const VoxelizeOptions& options,
                                                const Execution& execution) {
  if (!input.closed) return std::optional<TriangleSoup>();
  const auto inner = has_inner_faces(seen, grid, options, execution);
  if (!inner) return tl::unexpected(inner.error());
  if (!*inner) return std::optional<TriangleSoup>();
  csg::Solid solid;
  solid.mesh = std::make_shared<const TriangleSoup>(seen);
  solid.rule = input.rule;
  solid.name = input.files.front().path;
  auto made = boundary_of(csg::Tree(std::move(solid)), execution);
  if (!made) return tl::unexpected(made.error());
  return std::optional(*std::move(made));
}

std::pair<VoxelsPtr, Warnings> voxelize_mesh(const MeshData& mesh, const VoxelFileGrid& placed,
                                             const VoxelChoice& choice, const Limits& limits) {
  VoxelizeOptions options = options_of(choice);
  const csg::SolidInput& input = mesh.input;
  const VoxelGrid& grid = placed.grid;
  options.rule = input.rule;
  options.closedness = input.closed ? Closedness::kAssumeClosed : Closedness::kAssumeOpen;
  Warnings warnings;
  if (choice.colours && !input.attributes.coloured()) {
    warnings.push_back(fmt::format("{}: no colours are given; all voxels are light grey",
                                   input.files.front().path));
  }
  auto voxels = std::make_shared<VoxelsData>();
  voxels->frame = placed.frame;
  run(limits, [&](const Execution& execution) -> Result<void> {
    if (auto fits = check_rays(grid, options); !fits) return fits;
    SeenMesh seen;
    if (auto done =
            seen.see(input.soup, input.bounds, finest_of(grid, options), placed.frame, execution);
        !done) {
      return done;
    }
    if (choice.sdf) {
      const auto surface = outer_faces(input, seen.soup(), grid, options, execution);
      if (!surface) return tl::unexpected(surface.error());
      return distances(seen.soup(), grid, options, *surface ? &**surface : nullptr, choice.band,
                       *voxels, execution);
    }
    auto set = voxelize_all(seen.soup(), grid, options, execution);
    if (!set) return tl::unexpected(set.error());
    voxels->volume.set = *std::move(set);
    mark_shares(options, *voxels);
    if (input.closed && options.rays == 0 && choice.solid && !choice.surface) {
      LostWallOptions search;
      search.rule = input.rule;
      search.longest_edge = input.longest_edge;
      auto told =
          warn_of_walls(seen.soup(), placed, search, voxels->volume.set, warnings, execution);
      if (!told) return told;
    }
    if (!choice.colours) return {};
    if (seen.clamped()) {
      return fail(ErrorCode::kGeometry, "colours need a mesh within 2^20 voxels of the grid");
    }
    const bool solid = choice.solid && (input.closed || options.open != OpenMode::kSurface);
    std::optional<glm::u8vec3> fill;
    if (choice.fill) fill.emplace((*choice.fill)[0], (*choice.fill)[1], (*choice.fill)[2]);
    return colour_of_mesh(mesh, seen.soup(), solid, fill, *voxels, execution);
  });
  return {voxels, warnings};
}

std::pair<VoxelsPtr, Warnings> voxelize_solid(const SolidData& solid, const VoxelFileGrid& placed,
                                              const VoxelChoice& choice, const Limits& limits) {
  VoxelizeOptions options = options_of(choice);
  const VoxelGrid& grid = placed.grid;
  csg::Tree tree = solid.scene.tree;
  if (placed.frame.turned()) {
    tree = csg::transform(glm::dmat4(glm::transpose(placed.frame.direction)), std::move(tree));
  }
  Warnings warnings;
  auto voxels = std::make_shared<VoxelsData>();
  voxels->frame = placed.frame;
  run(limits, [&](const Execution& execution) -> Result<void> {
    if (auto fits = check_rays(grid, options); !fits) return fits;
    csg::SolidLists lists(tree, tree.root());
    csg::ColourLabels colours;
    if (choice.ids) {
      lists.set_labels(csg::id_labels(tree));
      voxels->volume.kind = VoxelKind::kIds;
    } else if (choice.colours) {
      colours = csg::colour_labels(tree, tree.root(), csg::plain_solid_colour());
      lists.set_labels(colours.labels);
    }
    if (auto done = lists.fit(finest_of(grid, options), nullptr, execution); !done) return done;
    options.filter = &lists.filter();
    options.closedness = Closedness::kAssumeClosed;
    if (choice.sdf) {
      const auto surface = boundary_of(tree, execution);
      if (!surface) return tl::unexpected(surface.error());
      return distances(lists.soup(), grid, options, &*surface, choice.band, *voxels, execution);
    }
    auto set = voxelize_all(lists.soup(), grid, options, execution);
    if (!set) return tl::unexpected(set.error());
    voxels->volume.set = *std::move(set);
    mark_shares(options, *voxels);
    if (options.rays == 0 && choice.solid && !choice.surface) {
      LostWallOptions search;
      search.filter = &lists.unlabelled_filter();
      search.taken_away = [&](std::uint32_t t) { return lists.is_subtracted(t); };
      auto told =
          warn_of_walls(lists.soup(), placed, search, voxels->volume.set, warnings, execution);
      if (!told) return told;
    }
    return choice.colours ? colour_of_solids(colours.colours, *voxels, execution) : Result<void>();
  });
  return {voxels, warnings};
}

}  // namespace

void bind_voxelize(py::module_& module) {
  py::class_<VoxelChoice>(module, "VoxelChoice")
      .def(py::init([](bool solid, bool surface, bool ids, std::int64_t coverage, bool colours,
                       std::optional<std::array<std::uint8_t, 3>> fill, bool sdf, double band,
                       std::string open, std::string kind) {
             return VoxelChoice{solid, surface, ids,  coverage,        colours,
                                fill,  sdf,     band, std::move(open), std::move(kind)};
           }),
           py::arg("solid"), py::arg("surface"), py::arg("ids"), py::arg("coverage"),
           py::arg("colours"), py::arg("fill"), py::arg("sdf"), py::arg("band"), py::arg("open"),
           py::arg("surface_kind"));
  module.def("voxelize_mesh", &voxelize_mesh);
  module.def("voxelize_solid", &voxelize_solid);
}

}  // namespace strata::python
