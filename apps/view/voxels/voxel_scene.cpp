#include "apps/view/voxels/voxel_scene.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "voxelize/volume/voxel_facts.h"

namespace strata::view {
Bounds solid_box(const VoxelIntervals& set) {
  Bounds box;
  const VoxelGrid& grid = set.grid();
  for_each_run(set, [&](const glm::ivec3& first, const glm::ivec3& last, std::uint32_t) {
    box.include(grid.origin + glm::dvec3(first) * grid.voxel_size);
    box.include(grid.origin + glm::dvec3(last + 1) * grid.voxel_size);
  });
  if (!box.empty()) return box;
  box.include(grid.origin);
  box.include(grid.origin + glm::dvec3(grid.dims) * grid.voxel_size);
  return box;
}

std::optional<VoxelStyle> find_voxel_style(std::string_view name) {
  constexpr std::pair<std::string_view, VoxelStyle> kStyles[] = {{"auto", VoxelStyle::kAuto},
                                                                 {"blocks", VoxelStyle::kBlocks},
                                                                 {"smooth", VoxelStyle::kSmooth},
                                                                 {"xray", VoxelStyle::kXray}};
  for (const auto& [text, style] : kStyles) {
    if (text == name) return style;
  }
  return std::nullopt;
}

Result<std::shared_ptr<const VoxelScene>> VoxelScene::load(const std::string& path,
                                                           const Execution& execution) {
  auto volume = read_voxels(path, {}, execution);
  if (!volume) return tl::unexpected(volume.error());
  auto scene = std::make_shared<VoxelScene>();
  if (!volume->values.empty()) scene->range_ = volume->values.range();
  scene->facts_ = voxel_facts(*volume);
  scene->box_ = solid_box(volume->set);
  scene->volume_ = std::make_shared<const VoxelVolume>(*std::move(volume));
  return scene;
}

std::string VoxelScene::describe(const glm::ivec3& voxel, std::uint32_t label) const {
  const glm::ivec3 at = voxel + volume_->first_index;
  std::string text = fmt::format("voxel ({}, {}, {})", at.x, at.y, at.z);
  if (volume_->set.has_labels() && label != 0) text += fmt::format(", label {}", label);
  if (!volume_->values.empty()) {
    text += fmt::format(", value {:.6g}", volume_->values.value(voxel.x, voxel.y, voxel.z));
  }
  return text;
}

Result<VoxelSlice> VoxelScene::slice_of(std::string_view text) const {
  constexpr std::string_view kIndices = "ijk", kPlaces = "xyz";
  double at = 0.0;
  const auto wrong = [&] {
    return fail(ErrorCode::kUsage,
                "the slice must be like k=12 (a voxel) or z=3.5 (a place), got '{}'", text);
  };
  if (text.size() < 3 || text[1] != '=') return wrong();
  const auto [end, error] = std::from_chars(text.data() + 2, text.data() + text.size(), at);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(at))
    return wrong();
  const bool index = kIndices.find(text[0]) != std::string_view::npos;
  const std::size_t axis = (index ? kIndices : kPlaces).find(text[0]);
  if (axis == std::string_view::npos) return wrong();
  const auto a = static_cast<int>(axis);
  const VoxelGrid& grid = volume_->grid();
  const double place =
      index ? at - volume_->first_index[a] : std::floor((at - grid.origin[a]) / grid.voxel_size[a]);
  if (!(place >= 0 && place < grid.dims[a])) {
    const double low = grid.origin[a];
    return index ? fail(ErrorCode::kUsage, "the slice must be {0}={1} to {0}={2}, got {3}", text[0],
                        volume_->first_index[a], volume_->first_index[a] + grid.dims[a] - 1, text)
                 : fail(ErrorCode::kUsage, "the slice must be {0}={1:.6g} to {0}={2:.6g}, got {3}",
                        text[0], low, low + grid.dims[a] * grid.voxel_size[a], text);
  }
  return VoxelSlice{static_cast<Axis>(a), static_cast<int>(place)};
}

std::shared_ptr<const VoxelIntervals> VoxelScene::solid(std::optional<float> threshold,
                                                        const Execution& execution) const {
  if (!threshold || *threshold == volume_->threshold || volume_->values.empty()) {
    return {volume_, &volume_->set};
  }
  const SolidRule rule =
      volume_->kind == VoxelKind::kDistances ? SolidRule::kBelow : SolidRule::kAbove;
  return std::make_shared<const VoxelIntervals>(
      solid_voxels(volume_->values, volume_->grid(), rule, *threshold, execution));
}

}  // namespace strata::view
