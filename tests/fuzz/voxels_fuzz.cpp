// Files of voxels: the first byte chooses the format.

#include <iterator>

#include "tests/fuzz/mesh_fuzzing.h"
#include "voxelize/readers/readers.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using strata::must;
  constexpr const char* kFormats[] = {"vdb",    "npy", "npz", "nrrd", "vti",
                                      "binvox", "vox", "nii", "mha",  "tif"};
  if (size == 0) return 0;
  const char* format = kFormats[data[0] % std::size(kFormats)];
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  strata::Execution execution;
  execution.threads = 1;
  execution.memory_limit = std::uint64_t{64} << 20;
  const auto volume = strata::parse_voxels(bytes, format, "input", {}, execution);
  if (!volume) {
    must(volume.error().message.starts_with("input"), "a refusal names the file");
    must(volume.error().code == strata::ErrorCode::kInput ||
             volume.error().code == strata::ErrorCode::kLimit ||
             volume.error().code == strata::ErrorCode::kUsage,
         "a refusal is the file's fault, or a limit");
    return 0;
  }
  const strata::VoxelIntervals& set = volume->set;
  const int depth = set.grid().dims[static_cast<int>(set.axis())];
  for (int tv = 0; tv < set.tiles_v(); ++tv) {
    for (int tu = 0; tu < set.tiles_u(); ++tu) {
      for (const strata::Interval& run : set.tile(tu, tv).items) {
        must(run.begin() < run.end() && run.end() <= depth, "runs lie in the grid");
      }
    }
  }
  must(volume->values.empty() || volume->values.dims() == set.grid().dims,
       "values are those of the grid");
  return 0;
}
