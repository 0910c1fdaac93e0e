#include <pybind11/stl.h>

#include <fmt/format.h>

#include "python/call.h"
#include "python/data.h"
#include "strata/csg/solid_lists.h"
#include "strata/hashbuffer/build_ldi.h"
#include "strata/lists.h"
#include "strata/raster/lattice_mesh.h"
#include "strata/voxelize/grid_frame.h"

namespace strata::python {
namespace {

/// Offsets and crossings, as DepthItem has them.
py::tuple arrays_of(LayeredDepthImage&& image) {
  const auto count = static_cast<py::ssize_t>(image.items.size());
  return py::make_tuple(array_of(std::move(image.offsets)),
                        array_of(std::move(image.items), py::dtype::of<std::uint64_t>(), {count}));
}

Result<LayeredDepthImage> lists_of(TriangleSoup& soup, const Bounds& box, const VoxelGrid& grid,
                                   Axis axis, const TileListFilter* filter,
                                   const Execution& execution) {
  if (filter == nullptr) {
    if (auto done = fit_lattice(soup, box, grid, execution); !done) {
      return tl::unexpected(done.error());
    }
  }
  const auto lattice = snap_to_lattice(soup, grid, execution);
  if (!lattice) return tl::unexpected(lattice.error());
  return build_ldi(*lattice, raster_target(grid, axis), {}, execution, filter);
}

const VoxelGrid& straight(const VoxelFileGrid& grid) {
  if (grid.frame.turned()) {
    refuse(ErrorCode::kUsage, "depth lists need a grid along the axes of the world");
  }
  return grid.grid;
}

py::tuple mesh_lists(const MeshData& mesh, const VoxelFileGrid& placed, int axis,
                     const Limits& limits) {
  const VoxelGrid& grid = straight(placed);
  return arrays_of(run(limits, [&](const Execution& execution) {
    TriangleSoup soup = mesh.input.soup;
    return lists_of(soup, mesh.input.bounds, grid, static_cast<Axis>(axis), nullptr, execution);
  }));
}

py::tuple solid_lists(const SolidData& solid, const VoxelFileGrid& placed, int axis,
                      const Limits& limits) {
  const VoxelGrid& grid = straight(placed);
  return arrays_of(run(limits, [&](const Execution& execution) -> Result<LayeredDepthImage> {
    csg::SolidLists lists(solid.scene.tree, solid.scene.tree.root());
    if (auto done = lists.fit(grid, nullptr, execution); !done) {
      return tl::unexpected(done.error());
    }
    TriangleSoup soup = lists.take_soup();
    return lists_of(soup, {}, grid, static_cast<Axis>(axis), &lists.filter(), execution);
  }));
}

/// Fragments in arrays; Python code has checked their lengths.
struct Fragments {
  Values<std::int64_t> pixel;
  Values<std::uint32_t> depth, payload;
};

/// All of them into one kind of lists.
template <class Lists>
Result<void> built(int width, int height, const std::vector<Fragments>& parts,
                   std::vector<std::uint64_t>& offsets, std::vector<std::uint32_t>& depths,
                   std::vector<std::uint32_t>& payloads, const Execution& execution) {
  std::uint64_t count = 0;
  for (const Fragments& part : parts) count += static_cast<std::uint64_t>(part.pixel.size());
  auto lists = Lists::create(width, height, count);
  if (!lists) return tl::unexpected(lists.error());
  const auto report = lists->build(
      [&](auto& sink) {
        for (const Fragments& part : parts) {
          const auto size = static_cast<std::size_t>(part.pixel.size());
          constexpr std::size_t kBlock = std::size_t{1} << 16;
          parallel_for(execution, (size + kBlock - 1) / kBlock, [&](std::size_t block, int) {
            for (std::size_t i = block * kBlock; i < std::min(size, (block + 1) * kBlock); ++i) {
              const std::int64_t pixel = part.pixel.data()[i];
              sink.insert(static_cast<int>(pixel % width), static_cast<int>(pixel / width),
                          part.depth.data()[i], part.payload.data()[i]);
            }
          });
        }
      },
      execution);
  if (!report) return tl::unexpected(report.error());
  offsets.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) + 1);
  depths.reserve(count), payloads.reserve(count);
  offsets.push_back(0);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      lists->for_each(x, y, [&](Fragment fragment) {
        depths.push_back(fragment.depth), payloads.push_back(fragment.payload);
      });
      offsets.push_back(depths.size());
    }
  }
  return {};
}

py::tuple build_lists(std::int64_t width, std::int64_t height, bool hashed,
                      const std::vector<std::array<py::array, 3>>& arrays, const Limits& limits) {
  std::vector<Fragments> parts;
  for (const auto& [pixel, depth, payload] : arrays) parts.push_back({pixel, depth, payload});
  std::vector<std::uint64_t> offsets;
  std::vector<std::uint32_t> depths, payloads;
  run(limits, [&](const Execution& execution) -> Result<void> {
    const int w = static_cast<int>(width), h = static_cast<int>(height);
    if (hashed) return built<OnePassLists>(w, h, parts, offsets, depths, payloads, execution);
    return built<PayloadLists>(w, h, parts, offsets, depths, payloads, execution);
  });
  return py::make_tuple(array_of(std::move(offsets)), array_of(std::move(depths)),
                        array_of(std::move(payloads)));
}

}  // namespace

void bind_lists(py::module_& module) {
  module.def("mesh_lists", &mesh_lists);
  module.def("solid_lists", &solid_lists);
  module.def("build_lists", &build_lists);
}

}  // namespace strata::python
