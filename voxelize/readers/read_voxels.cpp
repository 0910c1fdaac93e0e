#include "strata/voxelize/readers/read_voxels.h"

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <new>
#include <stdexcept>
#include <string>

#include "core/letters.h"
#include "mesh/text/input_bytes.h"
#include "voxelize/readers/readers.h"
#include "voxelize/scans/scan_readers.h"
#include "voxelize/volume/dense_array.h"

namespace strata {
namespace {

using Reader = Result<VoxelVolume> (*)(ReadContext&);

Result<VoxelVolume> read_exr(ReadContext& context) { return read_list_voxels(context, true); }

struct Format {
  std::string_view name;       // as VoxelFormat::name
  std::string_view extension;  // empty: a folder, by its contents
  Reader read;
  bool folder = false;
  std::string_view content = {};  // of a folder: a file that it has
};
constexpr std::array kFormats = {
    Format{"vdb", ".vdb", read_vdb_voxels},
    Format{"npy", ".npy", read_npy_voxels},
    Format{"npz", ".npz", read_npz_voxels},
    Format{"nrrd", ".nrrd", read_nrrd_voxels},
    Format{"raw", ".raw", read_raw_voxels},
    Format{"raw", ".nhdr", read_nrrd_voxels},
    Format{"nii.gz", ".nii.gz", read_nifti_voxels},
    Format{"nii", ".nii", read_nifti_voxels},
    Format{"mha", ".mha", read_metaimage_voxels},
    Format{"mha", ".mhd", read_metaimage_voxels},
    Format{"tif", ".tif", read_tiff_voxels},
    Format{"tif", ".tiff", read_tiff_voxels},
#ifdef STRATA_HAVE_HDF5
    Format{"h5", ".h5", read_hdf5_voxels},
    Format{"h5", ".hdf5", read_hdf5_voxels},
#endif
    Format{"vti", ".vti", read_vti_voxels},
    Format{"binvox", ".binvox", read_binvox_voxels},
    Format{"vox", ".vox", read_vox_voxels},
    Format{"zarr", "", read_zarr_voxels, true, ".zarray"},
    Format{"ome.zarr", "", read_ome_zarr_voxels, true, ".zgroup"},
    Format{"png", "", read_slice_voxels, true, "slices.json"},
    Format{"sl1", ".sl1", read_sl1_voxels},
    Format{"ldi", ".exr", read_exr},
};
constexpr std::array<std::string_view, kFormats.size()> kNames = [] {
  std::array<std::string_view, kFormats.size()> names;
  for (std::size_t i = 0; i < kFormats.size(); ++i) names[i] = kFormats[i].name;
  return names;
}();

const Format* format_of(const std::string& path, const std::string& name) {
  const bool folder = is_folder(path);
  const std::string file = lower_case(path);
  for (const Format& format : kFormats) {
    if (!name.empty()) {
      if (format.name == name) return &format;
    } else if (folder != format.folder) {
      continue;
    } else if (folder) {
      const std::string inside = path + "/" + std::string(format.content);
      if (::access(inside.c_str(), F_OK) == 0) return &format;
    } else if (file.ends_with(format.extension)) {
      return &format;
    }
  }
  return nullptr;
}

std::uint64_t memory_limit(const Execution& execution) {
  if (execution.memory_limit != 0) return execution.memory_limit;
  const long pages = ::sysconf(_SC_PHYS_PAGES), page = ::sysconf(_SC_PAGE_SIZE);
  if (pages <= 0 || page <= 0) return std::uint64_t{4} << 30;
  return static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(page) / 2;
}

Result<VoxelVolume> read_as(const Format& format, std::string_view bytes, const std::string& path,
                            const ReadVoxelsOptions& options, const Execution& execution) {
  bool as_values = options.integers == IntegerVoxels::kValues;
  while (true) {
    MemoryBudget budget(memory_limit(execution));
    ReadContext context{path, bytes, options, execution, budget};
    context.integers_as_values = as_values;
    try {
      Result<VoxelVolume> volume = format.read(context);
      if (!volume && context.wants_values && !as_values &&
          options.integers != IntegerVoxels::kIds) {
        as_values = true;
        continue;
      }
      if (volume && context.colours) {
        settle_colours(*volume);
        volume->type = "rgba";
      }
      if (volume && volume->format.empty()) volume->format = format.name;
      return volume;
    } catch (const std::bad_alloc&) {
      return fail(ErrorCode::kLimit, "{}: no memory for its voxels", path);
    } catch (const std::length_error&) {
      return fail(ErrorCode::kLimit, "{}: no memory for its voxels", path);
    }
  }
}

std::string list_of_formats() {
  std::string list;
  for (const Format& format : kFormats) {
    const std::string name(format.name);
    if ((list + ", ").find(" " + name + ",") != std::string::npos) continue;  // another extension
    list += (list.empty() ? " " : ", ") + name;
  }
  list.erase(0, 1);
  return list;
}

}  // namespace

bool is_folder(const std::string& path) {
  struct stat status = {};
  return ::stat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode);
}

Result<JsonValue> read_json_file(const std::string& path, const Execution& execution) {
  const auto file = detail::InputBytes::open(path, execution.memory_limit, execution.stop);
  if (!file) return tl::unexpected(file.error());
  return parse_json(file->view(), path);
}

std::span<const std::string_view> readable_voxel_formats() { return kNames; }

bool is_voxel_file(const std::string& path) { return format_of(path, "") != nullptr; }

Result<VoxelVolume> parse_voxels(std::string_view bytes, const std::string& format,
                                 const std::string& name, const ReadVoxelsOptions& options,
                                 const Execution& execution) {
  const Format* found = format_of(name, format);
  if (found == nullptr) return fail(ErrorCode::kUsage, "no format {}", format);
  return read_as(*found, bytes, name, options, execution);
}

Result<VoxelVolume> read_voxels(const std::string& path, const ReadVoxelsOptions& options,
                                const Execution& execution) {
  const Format* format = format_of(path, options.format);
  if (format == nullptr) {
    if (!options.format.empty()) {
      return fail(ErrorCode::kUsage, "{}: format '{}' is none of {}", path, options.format,
                  list_of_formats());
    }
    return fail(ErrorCode::kUsage,
                "{}: no file of voxels by its name; the formats are {}, and --format names one",
                path, list_of_formats());
  }
  if (format->folder) return read_as(*format, {}, path, options, execution);
  const Result<detail::InputBytes> file =
      detail::InputBytes::open(path, execution.memory_limit, execution.stop);
  if (!file) return tl::unexpected(file.error());
  Result<VoxelVolume> volume = read_as(*format, file->view(), path, options, execution);
  if (volume && file->changed()) {
    return fail(ErrorCode::kInput, "{}: the file changed while it was read", path);
  }
  return volume;
}

}  // namespace strata
