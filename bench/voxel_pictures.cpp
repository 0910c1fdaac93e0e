// Pictures of voxels: what it takes to prepare a set and to draw it, by grid, style and samples.

#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "bench/support.h"
#include "strata/voxelize/picture/voxel_picture.h"
#include "strata/voxelize/voxelize.h"

namespace {

using namespace strata;
using namespace strata::bench;

constexpr int kRounds = 7;
constexpr glm::ivec2 kSize{1024, 768};

struct Kind {
  const char* name;
  VoxelStyle style;
  int samples;
};
constexpr Kind kKinds[] = {{"auto, 8 samples", VoxelStyle::kAuto, 8},
                           {"auto, 1 sample", VoxelStyle::kAuto, 1},
                           {"blocks, 8 samples", VoxelStyle::kBlocks, 8},
                           {"xray, 1 sample", VoxelStyle::kXray, 1}};

int run() {
  const auto mesh = bench_mesh("knot-200k");
  if (!mesh) return fmt::print(stderr, "{}\n", mesh.error().message), 1;
  fmt::print("{:<8} {:<20} {:>9} {:>9}\n", "voxels", "picture", "wall ms", "cpu ms");
  for (const int resolution : {64, 512, 4096}) {
    const auto grid = bench_grid(mesh->soup, resolution);
    auto made = grid ? voxelize(mesh->soup, *grid) : tl::unexpected(grid.error());
    if (!made) return fmt::print(stderr, "{}\n", made.error().message), 1;
    const auto set = std::make_shared<const VoxelIntervals>(*std::move(made));
    const auto picture = VoxelPicture::create(set);
    Camera camera;
    centre_camera(camera, picture->box());
    fit_camera(camera, picture->box(), static_cast<double>(kSize.x) / kSize.y);
    std::vector<Participant> participants;
    participants.push_back(
        {"prepare",
         [&] { return std::make_shared<Result<VoxelPicture>>(VoxelPicture::create(set)); }});
    for (const Kind& kind : kKinds) {
      participants.push_back({kind.name, [&] {
                                VoxelPictureOptions options;
                                options.style = kind.style;
                                options.samples = kind.samples;
                                return std::make_shared<Result<Picture>>(
                                    picture->draw(camera, kSize, options));
                              }});
    }
    run_interleaved(participants, kRounds, 20'000);
    for (const Participant& one : participants) {
      const Sample time = median(one.samples);
      fmt::print("{:<8} {:<20} {:>9.1f} {:>9.1f}\n", resolution, one.name, time.wall_ms,
                 time.cpu_ms);
    }
  }
  return 0;
}

}  // namespace

int main() { return run(); }
