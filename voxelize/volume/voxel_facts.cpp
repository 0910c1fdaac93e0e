#include "voxelize/volume/voxel_facts.h"

#include <fmt/core.h>

namespace strata {
namespace {

std::string triple(const glm::dvec3& v) {
  return fmt::format("{:.6g}, {:.6g}, {:.6g}", v.x, v.y, v.z);
}

}  // namespace

std::vector<std::pair<std::string, std::string>> voxel_facts(const VoxelVolume& volume) {
  std::vector<std::pair<std::string, std::string>> rows;
  const VoxelGrid& grid = volume.grid();
  const std::string kind(name_of(volume.kind));
  rows.emplace_back("format", volume.format + ", " + kind + " of " + volume.type);
  if (!volume.name.empty()) rows.emplace_back("name", volume.name);
  rows.emplace_back("voxels", fmt::format("{} x {} x {}", grid.dims.x, grid.dims.y, grid.dims.z));
  rows.emplace_back("voxel size", triple(grid.voxel_size));
  rows.emplace_back("origin", triple(grid.origin) + (volume.placed ? "" : " (not in the file)"));
  const std::uint64_t solid = volume.set.solid_voxels();
  const double all = static_cast<double>(grid.dims.x) * grid.dims.y * grid.dims.z;
  rows.emplace_back("solid",
                    fmt::format("{} ({:.3g} %)", solid, 100.0 * static_cast<double>(solid) / all));
  const glm::dvec3 size = grid.voxel_size;
  rows.emplace_back("volume",
                    fmt::format("{:.6g}", static_cast<double>(solid) * size.x * size.y * size.z));
  if (!volume.values.empty()) {
    const ScalarField::Range range = volume.values.range();
    rows.emplace_back("values", fmt::format("{:.6g} to {:.6g}", range.least, range.greatest));
    rows.emplace_back("threshold", fmt::format("{:.6g}", volume.threshold));
  }
  return rows;
}

}  // namespace strata
