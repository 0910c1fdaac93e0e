#include "strata/voxelize/formats/voxel_writer.h"

#include <algorithm>
#include <exception>
#include <string_view>

#include "core/did_you_mean.h"
#include "core/letters.h"
#include "strata/voxelize/grid_fit.h"
#include "voxelize/formats/labelled_distances.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

bool is_folder(const VoxelFormat& format) { return format.extension.ends_with('/'); }

std::string meant_format(std::string_view text) {
  std::vector<std::string_view> names;
  for (const VoxelFormat& format : voxel_formats()) names.push_back(format.name);
  return did_you_mean(text, names);
}

template <class Holds>
std::string names_of_those_that(Holds&& holds) {
  std::string names;
  for (const VoxelFormat& format : voxel_formats()) {
    if (!holds(format)) continue;
    names += names.empty() ? "" : ", ";
    names += format.name;
  }
  return names;
}

std::string format_names() {
  return names_of_those_that([](const VoxelFormat&) { return true; });
}

std::string_view default_name(const VoxelWriterOptions& options, const VoxelFormat& format) {
  if (options.band != 0) return format.name == "vdb" ? "surface" : "distance";
  if (options.rgba) return "colours";
  if (options.fog != 0) return "density";
  return options.ids != 0 ? "ids" : "solid";
}

VoxelWriterResult open_format(const std::string& path, const std::string& name,
                              const VoxelGrid& grid, const VoxelWriterOptions& options) {
  if (name == "vdb") return open_vdb_writer(path, grid, options);
  if (name == "png") return open_png_writer(path, grid, options);
  if (name == "sl1") return open_sl1_writer(path, grid, options);
  if (name == "npy") return open_npy_writer(path, grid, options);
  if (name == "npz") return open_npz_writer(path, grid, options);
  if (name == "nrrd") return open_nrrd_writer(path, grid, options);
  if (name == "vti") return open_vti_writer(path, grid, options);
  if (name == "binvox") return open_binvox_writer(path, grid);
  if (name == "vox") return open_vox_writer(path, grid, options);
  if (name == "raw") return open_raw_writer(path, grid, options);
  if (name == "mha") return open_metaimage_writer(path, grid, options);
  if (name == "nii") return open_nifti_writer(path, grid, options, false);
  if (name == "nii.gz") return open_nifti_writer(path, grid, options, true);
  if (name == "tif") return open_tiff_writer(path, grid, options);
#ifdef STRATA_HAVE_HDF5
  if (name == "h5") return open_hdf5_writer(path, grid, options);
#endif
  if (name == "ome.zarr") return open_ome_zarr_writer(path, grid, options);
  if (name == "zarr") return open_zarr_writer(path, grid, options);
  if (name == "ply") return open_ply_writer(path, grid, options);
  if (name == "xyz") return open_xyz_writer(path, grid, options);
  if (name == "schem") return open_schem_writer(path, grid, options);
  return fail(ErrorCode::kInternal, "format {} has no writer", name);
}

}  // namespace

Result<VoxelFormat> voxel_format_for(const std::string& path, const std::string& format) {
  const bool picture = lower_case(path).ends_with(".png");
  const auto checked = [&](const VoxelFormat& found) -> Result<VoxelFormat> {
    if (picture && is_folder(found)) {
      return fail(ErrorCode::kUsage,
                  "{}: format {} is a folder of files; its name must end with /, as {}/", path,
                  found.name, path.substr(0, path.size() - 4));
    }
    if (path == "-" && is_folder(found)) {
      return fail(ErrorCode::kUsage, "format {} is a folder and cannot go to standard output",
                  found.name);
    }
    return found;
  };
  if (!format.empty()) {
    for (const VoxelFormat& candidate : voxel_formats()) {
      if (same_word(candidate.name, format)) return checked(candidate);
    }
    return fail(ErrorCode::kUsage, "unknown voxel format '{}'; it must be one of {}{}", format,
                format_names(), meant_format(format));
  }
  if (path == "-") {
    return fail(ErrorCode::kUsage, "standard output needs a format: {}", format_names());
  }
  std::string name = lower_case(path);
  const bool slash = name.ends_with('/');
  while (name.ends_with('/')) name.pop_back();
  const VoxelFormat* plain_folder = nullptr;
  for (const VoxelFormat& candidate : voxel_formats()) {
    std::string_view extension = candidate.extension;
    if (is_folder(candidate)) extension.remove_suffix(1);
    if (extension.empty()) {
      plain_folder = &candidate;
      continue;
    }
    const bool also = !candidate.also.empty() && name.ends_with(candidate.also);
    if ((!slash || is_folder(candidate)) && (also || name.ends_with(extension))) {
      return checked(candidate);
    }
  }
  if (slash && plain_folder != nullptr) return checked(*plain_folder);
  if (picture) {
    return fail(
        ErrorCode::kUsage,
        "{}: voxels are written as a folder of PNG slices; its name must end with /, as {}/", path,
        path.substr(0, path.size() - 4));
  }
  return fail(
      ErrorCode::kUsage,
      "{}: the extension must be that of a voxel format: {} (a folder's name ends with /){}", path,
      format_names(), meant_format(name.substr(name.rfind('.') + 1)));
}

Result<void> check_ids(const VoxelFormat& format, std::uint32_t largest) {
  if (largest <= format.ids) return {};
  const std::string names =
      names_of_those_that([&](const VoxelFormat& other) { return other.ids >= largest; });
  if (names.empty()) {
    const VoxelFormat& widest = *std::ranges::max_element(voxel_formats(), {}, &VoxelFormat::ids);
    return fail(ErrorCode::kUsage, "ids of voxels must be at most {}, got {}", widest.ids, largest);
  }
  if (format.ids == 0) {
    return fail(ErrorCode::kUsage, "format {} cannot store ids; {} can", format.name, names);
  }
  return fail(ErrorCode::kUsage,
              "format {} stores ids up to {}, but they reach {}; {} can store them", format.name,
              format.ids, largest, names);
}

Result<void> check_frame(const VoxelFormat& format, const GridFrame& frame) {
  if (format.turned || !frame.turned()) return {};
  return fail(ErrorCode::kUsage,
              "format {} cannot store a grid that is turned in the world; {} can", format.name,
              names_of_those_that([](const VoxelFormat& other) { return other.turned; }));
}

Result<void> check_values(const VoxelFormat& format, const VoxelWriterOptions& options) {
  if (Result<void> held = check_ids(format, options.ids); !held) return held;
  if (Result<void> held = check_frame(format, options.frame); !held) return held;
  struct Values {
    bool asked, held;
    bool VoxelFormat::*member;
    std::string_view name;
  };
  const Values kinds[] = {
      {options.fog != 0, format.shares, &VoxelFormat::shares, "filled shares of voxels (fog)"},
      {options.rgba, format.rgba, &VoxelFormat::rgba, "colours of single voxels"},
      {options.band != 0, format.distances, &VoxelFormat::distances, "distances"}};
  int asked = int{options.ids != 0} + int{options.mask};
  for (const Values& kind : kinds) {
    asked += int{kind.asked};
    if (!kind.asked || kind.held) continue;
    return fail(ErrorCode::kUsage, "format {} holds no {}; {} can", format.name, kind.name,
                names_of_those_that([&](const VoxelFormat& other) { return other.*kind.member; }));
  }
  if (options.levels != 1 && !format.levels) {
    return fail(ErrorCode::kUsage, "format {} holds one resolution, not {}; {} holds more",
                format.name, options.levels,
                names_of_those_that([](const VoxelFormat& other) { return other.levels; }));
  }
  if (options.levels != 1 && options.band != 0) {
    return fail(ErrorCode::kUsage, "distances have one resolution, not {}", options.levels);
  }
  if (options.mask && format.name != "vdb") {
    return fail(ErrorCode::kUsage, "a mask needs format vdb, got {}", format.name);
  }
  if (asked > 1) {
    return fail(ErrorCode::kUsage,
                "values of voxels are ids, shares (fog), colours, distances or a mask, got {} of "
                "these",
                asked);
  }
  if (options.colours.size() > format.colours) {
    return fail(ErrorCode::kUsage, "{} colours; format {} stores {}", options.colours.size(),
                format.name, format.colours);
  }
  return {};
}

Result<std::unique_ptr<VoxelWriter>> open_voxel_writer(const std::string& path,
                                                       const std::string& format,
                                                       const VoxelGrid& grid,
                                                       const VoxelWriterOptions& options) {
  const Result<VoxelFormat> chosen = voxel_format_for(path, format);
  if (!chosen) return tl::unexpected(chosen.error());
  if (Result<void> valid = check_grid(grid); !valid) return tl::unexpected(valid.error());
  if (Result<void> held = check_values(*chosen, options); !held) {
    return fail(held.error().code, "{}: {}", path, held.error().message);
  }
  try {
    VoxelWriterOptions named = options;
    if (named.name.empty()) named.name = std::string(default_name(options, *chosen));
    VoxelWriterResult writer = open_format(path, chosen->name, grid, named);
    if (writer && options.band != 0 && chosen->name != "vdb") {
      return by_labels(*std::move(writer), grid);
    }
    return writer;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory for a grid of {} x {} x {}", path,
                grid.dims.x, grid.dims.y, grid.dims.z);
  } catch (const std::exception& error) {
    return fail(ErrorCode::kInternal, "{}: {}", path, error.what());
  }
}

Result<void> write_voxels(const VoxelIntervals& set, const std::string& path,
                          const VoxelWriterOptions& options, const Execution& execution) {
  auto writer = open_voxel_writer(path, "", set.grid(), options);
  if (!writer) return tl::unexpected(writer.error());
  if (auto added = (*writer)->add(set, execution); !added) return added;
  return (*writer)->finish(execution);
}

}  // namespace strata
