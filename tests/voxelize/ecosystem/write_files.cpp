// Writes a part that no mirroring and no exchange of axes leaves as it is, in every format, of
// every kind of value and in three frames: read_by_others.py, which knows the same part, reads
// them.
//
// usage: write_files FOLDER

#include <cstdio>
#include <string>

#include "strata/voxelize/formats/voxel_writer.h"
#include "tests/voxelize/voxel_samples.h"

namespace strata::testing {
namespace {

constexpr std::uint32_t kFog = 64;

// An L with a hole, which begins at no side of the grid but z = 0. Beyond a chunk of 64 along x.
bool is_solid(int i, int j, int k) {
  const bool l = i >= 2 && i < 67 && j >= 1 && (i < 9 || j < 4) && j < 11 && k < 6;
  return l && !(i >= 4 && i < 6 && j >= 5 && j < 7);
}

struct Values {
  std::string name;
  VoxelWriterOptions options;
  std::uint32_t labels;  // 1 to this; 0: none
};

std::uint32_t label_of(const Values& values, int i, int j, int k) {
  if (!is_solid(i, j, k)) return 0;
  const auto number = static_cast<std::uint32_t>(i / 7 + 11 * (j / 2) + 37 * k);
  if (values.options.rgba) return 0x80000000u + number * 2654435761u % 0x7fffffffu;
  return 1 + number * 977 % values.labels;
}

std::vector<Values> all_values() {
  std::vector<Values> all(7);
  all[0] = {"flags", {}, 0};
  all[1] = {"ids8", {}, 250};
  all[2] = {"ids16", {}, 60000};
  all[3] = {"ids32", {}, 90000};
  for (std::size_t i = 1; i < 4; ++i) all[i].options.ids = all[i].labels;
  all[4] = {"shares", {}, kFog};
  all[4].options.fog = kFog;
  all[4].options.fog_floats = false;
  all[5] = all[4];
  all[5].name = "floats";
  all[5].options.fog_floats = true;
  all[6] = {"colours", {}, 0xffffffff};
  all[6].options.rgba = true;
  return all;
}

std::vector<std::pair<std::string, GridFrame>> all_frames() {
  std::vector<std::pair<std::string, GridFrame>> frames(3);
  frames[0].first = "plain";
  frames[1].first = "turned";
  frames[1].second.direction = glm::dmat3(0.6, 0.8, 0.0, -0.8, 0.6, 0.0, 0.0, 0.0, 1.0) *
                               glm::dmat3(1.0, 0.0, 0.0, 0.0, 0.28, 0.96, 0.0, -0.96, 0.28);
  frames[1].second.unit_metres = 1e-3;
  frames[2] = frames[1];
  frames[2].first = "ras";
  frames[2].second.space = "right-anterior-superior";
  return frames;
}

int write_all(const std::string& folder) {
  const VoxelGrid grid = make_grid({70, 11, 7}, {-3.5, 20.25, 1.125}, {0.5, 0.25, 0.75});
  for (const VoxelFormat& format : voxel_formats()) {
    for (Values& values : all_values()) {
      if (!check_values(format, values.options)) continue;
      if (format.name == "binvox") continue;  // voxels are no cubes
      const IdOf label = [&](int i, int j, int k) { return label_of(values, i, j, k); };
      const Sample sample{"", grid, is_solid};
      const VoxelIntervals set = values.labels == 0 ? intervals_of(sample, format.axis)
                                                    : labelled(grid, format.axis, label);
      for (const auto& [name, frame] : all_frames()) {
        if (!check_frame(format, frame)) continue;
        values.options.frame = frame;
        values.options.levels = format.levels ? 3 : 1;
        for (const std::string& extension : {format.extension, format.also}) {
          if (extension.empty()) continue;
          const std::string stem = folder + "/" + values.name + "_" + name;
          const std::string path =
              stem + (format.name == "png" ? std::string("_slices/") : extension);
          const auto written = write_voxels(set, path, values.options);
          if (written) continue;
          std::fprintf(stderr, "%s\n", written.error().message.c_str());
          return 1;
        }
      }
    }
  }
  return 0;
}

}  // namespace
}  // namespace strata::testing

int main(int count, char** arguments) {
  return count == 2 ? strata::testing::write_all(arguments[1]) : 2;
}
