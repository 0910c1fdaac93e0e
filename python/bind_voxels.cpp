#include <pybind11/stl.h>

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <map>

#include "picture/encode_png.h"
#include "python/call.h"
#include "python/data.h"
#include "strata/voxelize/checksum.h"
#include "strata/voxelize/colours/voxel_colours.h"
#include "strata/voxelize/formats/voxel_writer.h"
#include "strata/voxelize/picture/voxel_picture.h"
#include "strata/voxelize/readers/read_voxels.h"

namespace strata::python {
namespace {

// --- made from arrays and files ------------------------------------------------------------------

/// Runs of one tile of columns along z; a voxel is at (x * ny + y) * nz + z.
template <class Value>
void set_tile_of(VoxelIntervals& set, const Value* values, int tu, int tv, bool labelled) {
  const glm::ivec3 dims = set.grid().dims;
  std::vector<std::uint32_t> offsets(VoxelIntervals::kTileColumns + 1, 0), labels;
  std::vector<Interval> items;
  for (std::size_t local = 0; local < VoxelIntervals::kTileColumns; ++local) {
    const int u = tu * kTileSide + static_cast<int>(local) % kTileSide;
    const int v = tv * kTileSide + static_cast<int>(local) / kTileSide;
    if (u < dims.x && v < dims.y) {
      const Value* column =
          values + (static_cast<std::size_t>(u) * static_cast<std::size_t>(dims.y) +
                    static_cast<std::size_t>(v)) *
                       static_cast<std::size_t>(dims.z);
      for (int k = 0; k < dims.z;) {
        const Value value = column[k];
        const int first = k;
        while (k < dims.z && column[k] == value) ++k;
        if (value == 0) continue;
        items.push_back({static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(k - 1)});
        if (labelled) labels.push_back(static_cast<std::uint32_t>(value));
      }
    }
    offsets[local + 1] = static_cast<std::uint32_t>(items.size());
  }
  if (!items.empty()) set.set_tile(tu, tv, offsets, items, labels);
}

template <class Value>
VoxelsPtr voxels_of(const Values<Value>& values, const VoxelFileGrid& grid, const Limits& limits) {
  constexpr bool kLabelled = !std::is_same_v<Value, bool>;
  return run(limits, [&](const Execution& execution) -> Result<VoxelsPtr> {
    auto voxels = std::make_shared<VoxelsData>();
    voxels->volume.kind = kLabelled ? VoxelKind::kIds : VoxelKind::kMask;
    voxels->frame = grid.frame;
    VoxelIntervals set(grid.grid, Axis::kZ);
    const auto tiles =
        static_cast<std::size_t>(set.tiles_u()) * static_cast<std::size_t>(set.tiles_v());
    parallel_for(execution, tiles, [&](std::size_t tile, int) {
      const int tu = static_cast<int>(tile) % set.tiles_u();
      const int tv = static_cast<int>(tile) / set.tiles_u();
      set_tile_of(set, values.data(), tu, tv, kLabelled);
    });
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    voxels->volume.set = std::move(set);
    return voxels;
  });
}

VoxelsPtr read_voxel_file(const std::string& path, const std::string& grid,
                          std::optional<float> threshold, const std::string& integers,
                          const Limits& limits) {
  ReadVoxelsOptions options;
  options.grid = grid;
  options.threshold = threshold;
  if (integers == "ids") {
    options.integers = IntegerVoxels::kIds;
  } else if (integers == "values") {
    options.integers = IntegerVoxels::kValues;
  } else if (integers != "auto") {
    refuse(ErrorCode::kUsage,
           fmt::format("integers must be 'auto', 'ids' or 'values', got '{}'", integers));
  }
  auto voxels = std::make_shared<VoxelsData>();
  voxels->volume = run(
      limits, [&](const Execution& execution) { return read_voxels(path, options, execution); });
  return voxels;
}

// --- read ----------------------------------------------------------------------------------------

/// Also where no voxel is solid.
bool has_labels(const VoxelsData& voxels) {
  const VoxelKind kind = voxels.volume.kind;
  return voxels.volume.set.has_labels() || voxels.full != 0 || kind == VoxelKind::kIds ||
         kind == VoxelKind::kColours;
}

std::uint32_t largest_label(const VoxelIntervals& set) {
  std::uint32_t most = 0;
  for (int tv = 0; tv < set.tiles_v(); ++tv) {
    for (int tu = 0; tu < set.tiles_u(); ++tu) {
      for (const std::uint32_t label : set.tile(tu, tv).labels) most = std::max(most, label);
    }
  }
  return std::max(most, 1u);
}

/// In the order of the memory: x is next to x.
py::array column_major(auto&& values, const py::dtype& type, const glm::ivec3& dims) {
  const auto size = static_cast<py::ssize_t>(type.itemsize());
  const py::ssize_t x = dims.x, y = dims.y, z = dims.z;
  return array_of(std::move(values), type, {x, y, z}, {size, size * x, size * x * y});
}

Result<void> check_memory(const VoxelGrid& grid, std::uint64_t bytes_each, std::uint64_t limit) {
  const auto dims = glm::dvec3(grid.dims);
  const double bytes = dims.x * dims.y * dims.z * static_cast<double>(bytes_each);
  if (bytes <= static_cast<double>(limit)) return {};
  return fail(ErrorCode::kLimit,
              "an array of {} x {} x {} voxels needs {:.3g} bytes, the limit is {}; runs() and "
              "slice() need less",
              grid.dims.x, grid.dims.y, grid.dims.z, bytes, limit);
}

py::array dense_values(const VoxelsData& voxels, const Limits& limits) {
  const VoxelGrid& grid = voxels.volume.grid();
  auto values = run(limits, [&](const Execution& execution) -> Result<std::vector<float>> {
    if (auto fits = check_memory(grid, sizeof(float), execution.memory_limit); !fits) {
      return tl::unexpected(fits.error());
    }
    const auto nx = static_cast<std::size_t>(grid.dims.x),
               ny = static_cast<std::size_t>(grid.dims.y);
    std::vector<float> all(nx * ny * static_cast<std::size_t>(grid.dims.z));
    parallel_for(execution, static_cast<std::size_t>(grid.dims.z), [&](std::size_t k, int) {
      float* out = all.data() + k * nx * ny;
      for (int j = 0; j < grid.dims.y; ++j) {
        for (int i = 0; i < grid.dims.x; ++i) {
          *out++ = voxels.volume.values.value(i, j, static_cast<int>(k));
        }
      }
    });
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    return all;
  });
  return column_major(std::move(values), py::dtype::of<float>(), grid.dims);
}

/// Labels as what they mean: fractions as floats, colours as four bytes. The bits stay in place.
void give_meaning(const VoxelsData& voxels, std::vector<std::uint32_t>& labels,
                  const Execution& execution) {
  if (voxels.full == 0) return;
  const double full = voxels.full;
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  parallel_for(execution, (labels.size() + kBlock - 1) / kBlock, [&](std::size_t block, int) {
    const std::size_t end = std::min(labels.size(), (block + 1) * kBlock);
    for (std::size_t i = block * kBlock; i < end; ++i) {
      labels[i] = std::bit_cast<std::uint32_t>(static_cast<float>(labels[i] / full));
    }
  });
}

py::array dense_mask(const VoxelsData& voxels, const Limits& limits) {
  const VoxelIntervals& set = voxels.volume.set;
  auto values = run(limits, [&](const Execution& execution) -> Result<std::vector<std::uint8_t>> {
    if (auto fits = check_memory(set.grid(), 1, execution.memory_limit); !fits) {
      return tl::unexpected(fits.error());
    }
    return to_dense(set, execution);
  });
  return column_major(std::move(values), py::dtype::of<bool>(), set.grid().dims);
}

py::array dense_labels(const VoxelsData& voxels, const Limits& limits) {
  const VoxelIntervals& set = voxels.volume.set;
  const VoxelGrid& grid = set.grid();
  auto values = run(limits, [&](const Execution& execution) -> Result<std::vector<std::uint32_t>> {
    if (auto fits = check_memory(grid, sizeof(float), execution.memory_limit); !fits) {
      return tl::unexpected(fits.error());
    }
    auto labels = to_dense_labels(set, execution);
    if (labels) give_meaning(voxels, *labels, execution);
    return labels;
  });
  if (voxels.rgba) {
    const py::ssize_t x = grid.dims.x, y = grid.dims.y, z = grid.dims.z;
    return array_of(std::move(values), py::dtype::of<std::uint8_t>(), {x, y, z, 4},
                    {4, 4 * x, 4 * x * y, 1});
  }
  const py::dtype type = voxels.full != 0 ? py::dtype::of<float>() : py::dtype::of<std::uint32_t>();
  return column_major(std::move(values), type, grid.dims);
}

/// A run of voxels: the first one, and how many.
struct RunRow {
  std::int32_t x, y, z, length;
  std::uint32_t label;
};

py::array runs_of(const VoxelsData& voxels) {
  std::vector<RunRow> rows;
  Limits limits;
  run(limits, [&](const Execution&) -> Result<void> {
    rows.reserve(voxels.volume.set.interval_count());
    for_each_run(voxels.volume.set,
                 [&](const glm::ivec3& first, const glm::ivec3& last, std::uint32_t label) {
                   const glm::ivec3 size = last - first;
                   rows.push_back({first.x, first.y, first.z, size.x + size.y + size.z + 1, label});
                 });
    return {};
  });
  const auto count = static_cast<py::ssize_t>(rows.size());
  return array_of(std::move(rows), py::dtype::of<RunRow>(), {count});
}

/// Calls body(point's number, voxel) for points of the world in the grid.
template <class Body>
void for_each_voxel_at(const VoxelsData& voxels, const Values<double>& points,
                       const Execution& execution, Body&& body) {
  const VoxelGrid& grid = voxels.volume.grid();
  const glm::dmat3 turn = glm::inverse(voxels.frame.direction);
  const auto count = static_cast<std::size_t>(points.shape(0));
  constexpr std::size_t kBlock = 4096;
  parallel_for(execution, (count + kBlock - 1) / kBlock, [&](std::size_t block, int) {
    for (std::size_t i = block * kBlock; i < std::min(count, (block + 1) * kBlock); ++i) {
      const double* p = points.data() + 3 * i;
      const glm::dvec3 at = (turn * glm::dvec3(p[0], p[1], p[2]) - grid.origin) / grid.voxel_size;
      const glm::dvec3 floor = glm::floor(at);
      if (glm::all(glm::greaterThanEqual(floor, glm::dvec3(0))) &&
          glm::all(glm::lessThan(floor, glm::dvec3(grid.dims)))) {
        body(i, glm::ivec3(floor));
      }
    }
  });
}

py::array contains(const VoxelsData& voxels, const Values<double>& points, const Limits& limits) {
  std::vector<std::uint8_t> inside(static_cast<std::size_t>(points.shape(0)), 0);
  run(limits, [&](const Execution& execution) -> Result<void> {
    for_each_voxel_at(voxels, points, execution, [&](std::size_t i, const glm::ivec3& at) {
      inside[i] = voxels.volume.set.contains(at.x, at.y, at.z) ? 1 : 0;
    });
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    return {};
  });
  const auto count = static_cast<py::ssize_t>(inside.size());
  return array_of(std::move(inside), py::dtype::of<bool>(), {count});
}

// --- slices and pictures -------------------------------------------------------------------------

void check_slice(const VoxelGrid& grid, int axis, std::int64_t index) {
  if (index < 0 || index >= grid.dims[axis]) {
    refuse(ErrorCode::kUsage, fmt::format("index must be 0 to {} along {}, got {}",
                                          grid.dims[axis] - 1, "xyz"[axis], index));
  }
}

/// Labels of a plane, as [u, v].
py::array slice_labels(const VoxelsData& voxels, int axis, int index, bool labels) {
  const VoxelIntervals& set = voxels.volume.set;
  const AxisFrame plane(static_cast<Axis>(axis)), lists(set.axis());
  const auto width = static_cast<std::size_t>(set.grid().dims[plane.u]);
  const auto height = static_cast<std::size_t>(set.grid().dims[plane.v]);
  std::vector<std::uint32_t> ids(labels ? width * height : 0);
  std::vector<std::uint8_t> mask(labels ? 0 : width * height);
  const auto mark = [&](const glm::ivec3& at, std::uint32_t label) {
    const std::size_t to =
        static_cast<std::size_t>(at[plane.u]) * height + static_cast<std::size_t>(at[plane.v]);
    if (labels)
      ids[to] = label;
    else
      mask[to] = 1;
  };
  const int u0 = lists.u == axis ? index : 0, v0 = lists.v == axis ? index : 0;
  const int u1 = lists.u == axis ? index + 1 : set.columns();
  const int v1 = lists.v == axis ? index + 1 : set.v_end();
  for (int v = v0; v < v1; ++v) {
    for (int u = u0; u < u1; ++u) {
      for_each_labelled(set, u, v, [&](const Interval& interval, std::uint32_t label) {
        int first = interval.begin(), end = interval.end();
        if (lists.w == axis) first = std::max(first, index), end = std::min(end, index + 1);
        glm::ivec3 at;
        at[lists.u] = u, at[lists.v] = v;
        for (int w = first; w < end; ++w) at[lists.w] = w, mark(at, label);
      });
    }
  }
  const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(width),
                                       static_cast<py::ssize_t>(height)};
  if (labels && voxels.rgba) {
    return array_of(std::move(ids), py::dtype::of<std::uint8_t>(), {shape[0], shape[1], 4});
  }
  if (labels) {
    give_meaning(voxels, ids, {.threads = 1});
    const bool shares = voxels.full != 0;
    return array_of(std::move(ids),
                    shares ? py::dtype::of<float>() : py::dtype::of<std::uint32_t>(), shape);
  }
  return array_of(std::move(mask), py::dtype::of<bool>(), shape);
}

py::array slice_values(const VoxelsData& voxels, int axis, int index) {
  const AxisFrame plane(static_cast<Axis>(axis));
  const glm::ivec3 dims = voxels.volume.grid().dims;
  std::vector<float> values;
  glm::ivec3 at;
  at[axis] = index;
  for (at[plane.u] = 0; at[plane.u] < dims[plane.u]; ++at[plane.u]) {
    for (at[plane.v] = 0; at[plane.v] < dims[plane.v]; ++at[plane.v]) {
      values.push_back(voxels.volume.values.value(at.x, at.y, at.z));
    }
  }
  return array_of(std::move(values), py::dtype::of<float>(), {dims[plane.u], dims[plane.v]});
}

/// The set as pictures take it, and its look. Colours become entries of a palette.
std::pair<std::shared_ptr<const VoxelIntervals>, VoxelLook> shown(const VoxelsPtr& voxels,
                                                                  const Execution& execution) {
  VoxelLook look;
  std::shared_ptr<const VoxelIntervals> set(voxels, &voxels->volume.set);  // lives as long
  if (voxels->rgba) {
    std::map<std::uint32_t, std::uint32_t> entries;
    for_each_run(*set, [&](const glm::ivec3&, const glm::ivec3&, std::uint32_t label) {
      entries.try_emplace(label, 0);
    });
    for (auto& [colour, entry] : entries) {
      look.colours.emplace_back(unpacked_colour(colour));
      entry = static_cast<std::uint32_t>(look.colours.size());
    }
    set = std::make_shared<const VoxelIntervals>(relabelled(
        *set, [&](std::uint32_t label) { return entries.at(label); }, execution));
    return {set, look};
  }
  for (const glm::u8vec4& colour : voxels->volume.colours) look.colours.emplace_back(colour);
  if (!voxels->volume.values.empty()) {
    look.value = [voxels](const glm::ivec3& at) {
      return voxels->volume.values.value(at.x, at.y, at.z);
    };
    look.distances = voxels->volume.kind == VoxelKind::kDistances;
  } else if (voxels->full != 0) {
    look.source = VoxelColours::kPlain;
    look.value = [voxels](const glm::ivec3& at) {
      return static_cast<float>(voxels->volume.set.label(at.x, at.y, at.z).value_or(0)) /
             static_cast<float>(voxels->full);
    };
  }
  return {set, look};
}

Picture voxel_picture(const VoxelsPtr& voxels, std::optional<std::pair<int, std::int64_t>> slice,
                      const CameraChoice& choice, const std::array<std::int64_t, 2>& size,
                      int samples, const Limits& limits) {
  if (slice) check_slice(voxels->volume.grid(), slice->first, slice->second);
  return run(limits, [&](const Execution& execution) -> Result<Picture> {
    const auto pixels = size_of(size[0], size[1], execution);
    if (!pixels) return tl::unexpected(pixels.error());
    auto [set, look] = shown(voxels, execution);
    auto drawer = VoxelPicture::create(std::move(set), std::move(look), execution);
    if (!drawer) return tl::unexpected(drawer.error());
    VoxelPictureOptions options;
    options.samples = samples;
    if (slice) {
      return drawer->draw_slice({static_cast<Axis>(slice->first), static_cast<int>(slice->second)},
                                *pixels, options, execution);
    }
    Camera camera = choice.camera();
    if (!choice.placed()) {
      frame_camera(camera, drawer->box(), static_cast<double>(pixels->x) / pixels->y);
    }
    return drawer->draw(camera, *pixels, options, execution);
  });
}

// --- written -------------------------------------------------------------------------------------

void save_voxels(const VoxelsData& voxels, const std::string& path, const Limits& limits) {
  run(limits, [&](const Execution& execution) -> Result<void> {
    VoxelWriterOptions options;
    options.frame = voxels.frame;
    const VoxelIntervals& set = voxels.volume.set;
    if (voxels.volume.kind == VoxelKind::kDistances && voxels.made) {
      options.band = voxels.band == 0 ? std::numeric_limits<float>::infinity()
                                      : static_cast<float>(voxels.band);
      auto writer = open_voxel_writer(path, {}, set.grid(), options);
      if (!writer) return tl::unexpected(writer.error());
      auto added = (*writer)->add_distances(voxels.volume.values, 0, execution);
      return added ? (*writer)->finish(execution) : added;
    }
    if (!voxels.volume.values.empty()) {
      return fail(ErrorCode::kUsage,
                  "{}: voxels with numbers that were read from a file cannot be saved", path);
    }
    if (voxels.full != 0) {
      options.fog = voxels.full;
    } else if (voxels.rgba) {
      options.rgba = true;
    } else if (set.has_labels()) {
      if (voxels.volume.kind == VoxelKind::kColours && !voxels.volume.colours.empty()) {
        options.colours = voxels.volume.colours;
      } else {
        options.ids = largest_label(set);
      }
    }
    return write_voxels(set, path, options, execution);
  });
}

// --- bindings ------------------------------------------------------------------------------------

void bind_voxel_class(py::class_<VoxelsData, VoxelsPtr>& type) {
  type.def_property_readonly("grid",
                             [](const VoxelsData& v) {
                               return VoxelFileGrid{v.volume.grid(), v.frame};
                             })
      .def_property_readonly(
          "axis", [](const VoxelsData& v) { return static_cast<int>(v.volume.set.axis()); })
      .def_property_readonly(
          "kind", [](const VoxelsData& v) { return std::string(name_of(v.volume.kind)); })
      .def_property_readonly("has_labels", &has_labels)
      .def_property_readonly("has_values",
                             [](const VoxelsData& v) { return !v.volume.values.empty(); })
      .def_property_readonly("notes", [](const VoxelsData& v) { return v.volume.notes; })
      .def_property_readonly("count",
                             [](const VoxelsData& v) { return v.volume.set.solid_voxels(); })
      .def_property_readonly("direction",
                             [](const VoxelsData& v) {
                               const glm::dmat3& d = v.frame.direction;
                               std::vector<double> rows;
                               for (int r = 0; r < 3; ++r) {
                                 for (int c = 0; c < 3; ++c) rows.push_back(d[c][r]);
                               }
                               return array_of(std::move(rows), py::dtype::of<double>(), {3, 3});
                             })
      .def("checksum",
           [](const VoxelsData& v, const Limits& limits) {
             return run(limits, [&](const Execution& execution) -> Result<std::uint64_t> {
               return set_checksum(v.volume.set, execution);
             });
           })
      .def("mask", &dense_mask)
      .def("labels", &dense_labels)
      .def("values", &dense_values)
      .def("runs", &runs_of)
      .def("contains", &contains, py::arg("points"), py::arg("limits"))
      .def("slice",
           [](const VoxelsData& v, int axis, std::int64_t index) {
             check_slice(v.volume.grid(), axis, index);
             const int at = static_cast<int>(index);
             if (!v.volume.values.empty()) return slice_values(v, axis, at);
             return slice_labels(v, axis, at, has_labels(v));
           })
      .def("save", &save_voxels, py::arg("path"), py::arg("limits"))
      .def("picture", [](const VoxelsPtr& v, std::optional<std::pair<int, std::int64_t>> slice,
                         const CameraChoice& camera, const std::array<std::int64_t, 2>& size,
                         int samples, const Limits& limits) {
        return array_of_picture(voxel_picture(v, slice, camera, size, samples, limits));
      });
}

}  // namespace

// --- pictures and cameras ------------------------------------------------------------------------

Camera CameraChoice::camera() const {
  Camera camera;
  const glm::dvec3 middle = target ? vec_of(*target) : glm::dvec3(0.0);
  if (eye) camera = look_at(vec_of(*eye), middle);
  camera.target = middle;
  if (rotation) camera.rotation = vec_of(*rotation);
  if (distance) camera.distance = *distance;
  camera.field_of_view = field_of_view;
  if (orthographic) camera.projection = Projection::kOrthographic;
  return camera;
}

py::array array_of_picture(Picture&& picture) {
  const py::ssize_t width = picture.width, height = picture.height;
  return array_of(std::move(picture.pixels), py::dtype::of<std::uint8_t>(), {height, width, 4});
}

Result<glm::ivec2> size_of(std::int64_t width, std::int64_t height, const Execution& execution) {
  if (width < 1 || height < 1 || width > kMaxPictureSide || height > kMaxPictureSide) {
    return fail(ErrorCode::kUsage, "size must be 1 to {} pixels along each side, got {} x {}",
                kMaxPictureSide, width, height);
  }
  constexpr double kBytesOfPixel = 64;  // while it is drawn
  const double bytes = kBytesOfPixel * static_cast<double>(width) * static_cast<double>(height);
  if (bytes > static_cast<double>(execution.memory_limit)) {
    return fail(ErrorCode::kLimit,
                "a picture of {} x {} pixels takes {:.3g} bytes to draw, the limit is {}", width,
                height, bytes, execution.memory_limit);
  }
  return glm::ivec2(static_cast<int>(width), static_cast<int>(height));
}

namespace {

py::bytes png_of(const Values<std::uint8_t>& pixels) {
  Picture picture{static_cast<int>(pixels.shape(1)), static_cast<int>(pixels.shape(0)), {}};
  const std::uint8_t* from = pixels.data();
  picture.pixels.resize(static_cast<std::size_t>(pixels.size()) / 4);
  for (Rgba& pixel : picture.pixels) pixel = {from[0], from[1], from[2], from[3]}, from += 4;
  std::vector<std::uint8_t> file;
  run_on_worker([&](const std::stop_token&) { file = encode_png(picture); });
  return {reinterpret_cast<const char*>(file.data()), file.size()};
}

void bind_choices(py::module_& module) {
  using Triple = std::optional<std::array<double, 3>>;
  py::class_<CameraChoice>(module, "Camera")
      .def(py::init([](Triple eye, Triple target, Triple rotation, std::optional<double> distance,
                       double fov, bool orthographic) {
             return CameraChoice{eye, target, rotation, distance, fov, orthographic};
           }),
           py::arg("eye"), py::arg("target"), py::arg("rotation"), py::arg("distance"),
           py::arg("fov"), py::arg("orthographic"));
}

}  // namespace

void bind_voxels(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(RunRow, x, y, z, length, label);
  bind_choices(module);
  py::class_<VoxelsData, VoxelsPtr> type(module, "Voxels");
  bind_voxel_class(type);
  module.def("voxels_of_mask", &voxels_of<bool>);
  module.def("voxels_of_labels", &voxels_of<std::uint32_t>);
  module.def("read_voxels", &read_voxel_file, py::arg("path"), py::arg("grid"),
             py::arg("threshold"), py::arg("integers"), py::arg("limits"));
  module.def("png", &png_of, py::arg("pixels"));
}

}  // namespace strata::python
