#include "strata/voxelize/readers/read_voxel_grid.h"

#include <unistd.h>

#include <new>
#include <string>
#include <vector>

#include "core/letters.h"
#include "mesh/text/input_bytes.h"
#include "strata/voxelize/readers/read_voxels.h"
#include "voxelize/heads/grid_axes.h"
#include "voxelize/readers/readers.h"
#include "voxelize/scans/scan_readers.h"

namespace strata {
namespace {

bool is_there(const std::string& path) { return ::access(path.c_str(), F_OK) == 0; }

/// Three numbers. @return kInput if the member is there and is not that
Result<std::optional<glm::dvec3>> vector_of(const JsonValue& json, std::string_view name,
                                            const std::string& path) {
  if (json.find(name) == nullptr) return std::nullopt;
  const auto numbers = json.numbers(name, 3);
  if (!numbers) return fail(ErrorCode::kInput, "{}: {} must be 3 numbers", path, name);
  return glm::dvec3((*numbers)[0], (*numbers)[1], (*numbers)[2]);
}

/// Three rows of three numbers.
Result<glm::dmat3> direction_of(const JsonValue& json, const std::string& path) {
  glm::dmat3 direction(1.0);
  const JsonValue* rows = json.find("direction");
  if (rows == nullptr) return direction;
  bool whole = rows->items.size() == 3;
  for (std::size_t row = 0; row < 3 && whole; ++row) {
    const std::vector<JsonValue>& items = rows->items[row].items;
    whole = items.size() == 3;
    for (std::size_t column = 0; column < 3 && whole; ++column) {
      whole = items[column].kind == JsonValue::kNumber;
      direction[static_cast<int>(column)][static_cast<int>(row)] = items[column].number;
    }
  }
  if (!whole) return fail(ErrorCode::kInput, "{}: direction must be 3 rows of 3 numbers", path);
  return direction;
}

/// `origin`, `voxel_size` or `spacing`, `direction`, `space`, `unit` of our own JSON files.
Result<VoxelFileGrid> grid_of_json(const JsonValue& json, const std::array<double, 3>& sizes,
                                   const std::string& path) {
  const auto origin = vector_of(json, "origin", path);
  const auto spacing =
      vector_of(json, json.find("spacing") != nullptr ? "spacing" : "voxel_size", path);
  const auto direction = direction_of(json, path);
  if (!origin) return tl::unexpected(origin.error());
  if (!spacing) return tl::unexpected(spacing.error());
  if (!direction) return tl::unexpected(direction.error());
  if (!*origin || !*spacing) {
    return fail(ErrorCode::kInput, "{}: {} is missing, which says where the voxels lie", path,
                *origin ? "spacing" : "origin");
  }
  auto result = grid_of_frame(path, sizes, **origin, **spacing, *direction);
  if (!result) return result;
  const JsonValue *space = json.find("space"), *unit = json.find("unit");
  if (space != nullptr) result->frame.space = space->text;
  if (unit != nullptr) result->frame.unit_metres = unit_named(unit->text);
  return result;
}

Result<VoxelFileGrid> npy_file_grid(ReadContext& context) {
  const auto sizes = npy_sizes(context);
  if (!sizes) return tl::unexpected(sizes.error());
  const std::string beside = context.path + ".json";
  if (!is_there(beside)) {
    return fail(ErrorCode::kInput,
                "{}: a .npy does not say where its voxels lie; a file {} with origin and spacing "
                "would",
                context.path, beside);
  }
  const auto json = read_json_file(beside, context.execution);
  if (!json) return tl::unexpected(json.error());
  return grid_of_json(*json, *sizes, beside);
}

/// Scale and translation of OME-Zarr 0.4, of one axis after the other.
struct OmePlace {
  std::vector<double> scale, translation;
};
void add_transforms(const JsonValue* list, OmePlace& place) {
  if (list == nullptr) return;
  for (const JsonValue& step : list->items) {
    const JsonValue *type = step.find("type"), *scale = step.find("scale");
    const JsonValue* translation = step.find("translation");
    if (type == nullptr) continue;
    for (std::size_t axis = 0; axis < place.scale.size(); ++axis) {
      if (type->text == "scale" && scale != nullptr && axis < scale->items.size()) {
        place.scale[axis] *= scale->items[axis].number;
        place.translation[axis] *= scale->items[axis].number;
      }
      if (type->text == "translation" && translation != nullptr &&
          axis < translation->items.size()) {
        place.translation[axis] += translation->items[axis].number;
      }
    }
  }
}

/// `shape` of a .zarray, as far as it is one.
Result<std::vector<double>> zarr_shape(const std::string& array, const Execution& execution) {
  const auto json = read_json_file(array, execution);
  if (!json) return tl::unexpected(json.error());
  std::vector<double> shape;
  if (const JsonValue* list = json->find("shape")) {
    for (const JsonValue& item : list->items) shape.push_back(item.number);
  }
  return shape;
}

/// @param shape  of the array; empty: it is in the first data set of the group
Result<VoxelFileGrid> ome_grid(const std::string& folder, const JsonValue& attributes,
                               std::vector<double> shape, const Execution& execution) {
  const std::string path = folder + "/.zattrs";
  const JsonValue* scales = attributes.find("multiscales");
  if (scales == nullptr || scales->items.empty()) {
    return fail(ErrorCode::kInput, "{}: neither origin and voxel_size nor multiscales are there",
                path);
  }
  const JsonValue& scale = scales->items.front();
  const JsonValue *sets = scale.find("datasets"), *axes = scale.find("axes");
  if (sets == nullptr || sets->items.empty() || axes == nullptr) {
    return fail(ErrorCode::kInput, "{}: multiscales must have axes and datasets", path);
  }
  const JsonValue& first = sets->items.front();
  if (shape.empty()) {
    const JsonValue* name = first.find("path");
    auto found =
        zarr_shape(folder + "/" + (name == nullptr ? "0" : name->text) + "/.zarray", execution);
    if (!found) return tl::unexpected(found.error());
    shape = *std::move(found);
  }
  OmePlace place{std::vector<double>(axes->items.size(), 1.0),
                 std::vector<double>(axes->items.size(), 0.0)};
  add_transforms(first.find("coordinateTransformations"), place);
  add_transforms(scale.find("coordinateTransformations"), place);
  GridAxes grid;
  double unit = 0.0;
  int found = 0;
  for (std::size_t axis = 0; axis < axes->items.size() && axis < shape.size(); ++axis) {
    const JsonValue &item = axes->items[axis], *name = item.find("name"),
                    *given = item.find("unit");
    const std::string letter = name == nullptr ? item.text : name->text;
    const std::size_t to = std::string_view("xyz").find(letter);
    if (letter.size() != 1 || to == std::string_view::npos) continue;
    const auto t = static_cast<int>(to);
    grid.sizes[to] = shape[axis];
    grid.steps[t][t] = place.scale[axis];
    grid.place[t] = place.translation[axis];
    if (given != nullptr) unit = unit_named(given->text);
    ++found;
  }
  if (found != 3) return fail(ErrorCode::kInput, "{}: no axes x, y and z", path);
  auto result = grid_of_axes(path, grid);
  if (!result) return result;
  result->frame.unit_metres = unit;
  const auto direction = direction_of(attributes, path);  // an attribute of ours
  if (!direction) return tl::unexpected(direction.error());
  result->frame.direction = *direction;
  return result;
}

Result<VoxelFileGrid> zarr_file_grid(ReadContext& context) {
  const std::string attributes = context.path + "/.zattrs", array = context.path + "/.zarray";
  std::vector<double> shape;
  if (is_there(array)) {
    auto found = zarr_shape(array, context.execution);
    if (!found) return tl::unexpected(found.error());
    shape = *std::move(found);
    if (shape.empty()) return fail(ErrorCode::kInput, "{}: shape is missing", array);
  }
  if (!is_there(attributes)) {
    return fail(ErrorCode::kInput, "{}: it is missing, and would say where the voxels lie",
                attributes);
  }
  const auto json = read_json_file(attributes, context.execution);
  if (!json) return tl::unexpected(json.error());
  if (shape.size() == 3 && json->find("voxel_size") != nullptr) {
    return grid_of_json(*json, {shape[0], shape[1], shape[2]}, attributes);
  }
  return ome_grid(context.path, *json, std::move(shape), context.execution);
}

Result<VoxelFileGrid> slices_grid(ReadContext& context) {
  const std::string path = context.path + "/slices.json";
  const auto json = read_json_file(path, context.execution);
  if (!json) return tl::unexpected(json.error());
  const auto dims = json->numbers("dims", 3);
  if (!dims) return fail(ErrorCode::kInput, "{}: dims must be 3 numbers", path);
  return grid_of_json(*json, {(*dims)[0], (*dims)[1], (*dims)[2]}, path);
}

/// Of formats whose head alone does not say it.
Result<VoxelFileGrid> grid_of_voxels(const std::string& path, const Execution& execution) {
  if (!is_voxel_file(path)) {
    return fail(ErrorCode::kUsage,
                "{}: a grid is read from .nrrd, .nhdr, .mha, .mhd, .nii, .nii.gz, .h5, .vdb, .vti, "
                ".npz, .zarr, and from a .npy with a .npy.json",
                path);
  }
  const auto volume = read_voxels(path, {}, execution);
  if (!volume) return tl::unexpected(volume.error());
  if (!volume->placed) {
    return fail(ErrorCode::kInput, "{}: a .{} does not say where its voxels lie", path,
                volume->format);
  }
  return VoxelFileGrid{volume->grid(), {}};
}

using GridReader = Result<VoxelFileGrid> (*)(ReadContext&);

GridReader reader_of(const std::string& path) {
  constexpr std::pair<std::string_view, GridReader> kReaders[] = {{".npy", npy_file_grid},
                                                                  {".npz", npz_grid},
                                                                  {".nrrd", nrrd_file_grid},
                                                                  {".nhdr", nrrd_file_grid},
                                                                  {".raw", raw_grid},
                                                                  {".tif", tiff_grid},
                                                                  {".tiff", tiff_grid},
                                                                  {".mha", metaimage_file_grid},
                                                                  {".mhd", metaimage_file_grid},
                                                                  {".nii", nifti_file_grid},
                                                                  {".nii.gz", nifti_file_grid},
#ifdef STRATA_HAVE_HDF5
                                                                  {".h5", hdf5_grid},
                                                                  {".hdf5", hdf5_grid},
#endif
                                                                  {".vti", vti_grid},
                                                                  {".vdb", vdb_grid}};
  const std::string name = lower_case(path);
  for (const auto& [extension, reader] : kReaders) {
    if (name.ends_with(extension)) return reader;
  }
  return nullptr;
}

}  // namespace

Result<VoxelFileGrid> read_voxel_grid(const std::string& path, const Execution& execution) {
  const ReadVoxelsOptions options;
  MemoryBudget budget(execution.memory_limit != 0 ? execution.memory_limit : ~std::uint64_t{0});
  try {
    if (is_folder(path)) {
      ReadContext context{path, {}, options, execution, budget};
      if (is_there(path + "/slices.json")) return slices_grid(context);
      if (is_there(path + "/.zarray") || is_there(path + "/.zattrs")) {
        return zarr_file_grid(context);
      }
      return fail(ErrorCode::kInput, "{}: the folder holds neither a Zarr array nor slices.json",
                  path);
    }
    const GridReader reader = reader_of(path);
    if (reader == nullptr) return grid_of_voxels(path, execution);
    const auto file = detail::InputBytes::open(path, execution.memory_limit, execution.stop);
    if (!file) return tl::unexpected(file.error());
    ReadContext context{path, file->view(), options, execution, budget};
    return reader(context);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: no memory for its head", path);
  }
}

}  // namespace strata
