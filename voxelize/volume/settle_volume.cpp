// What numbers mean: distances, densities or ids; and which voxels are solid.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>
#include <vector>

#include "strata/voxelize/packed_colour.h"
#include "voxelize/volume/dense_array.h"

namespace strata {
namespace {

// Whether neighbours differ by hardly more than a voxel, in world units or in voxels.
bool looks_like_distances(const ScalarField& field, const VoxelGrid& grid) {
  constexpr std::uint64_t kSeldom = 100;
  const double step = 1.01 * std::max(1.0, grid.voxel_size.z);
  std::uint64_t pairs = 0, far = 0;
  const glm::ivec3 blocks = field.blocks();
  for (int bi = 0; bi < blocks.x; ++bi) {
    for (int bj = 0; bj < blocks.y; ++bj) {
      for (int bk = 0; bk < blocks.z;) {
        const float* values = field.block(bi, bj, bk).values;
        if (values == nullptr) {
          bk += field.equal_blocks_along_z(bi, bj, bk);
          continue;
        }
        ++bk;
        if (bk == blocks.z) continue;  // may be filled up beyond the grid
        for (std::size_t i = 1; i < ScalarField::kBlockVoxels; ++i) {
          if (i % 8 == 0) continue;
          ++pairs;
          if (!(std::abs(values[i] - values[i - 1]) <= step)) ++far;
        }
      }
    }
  }
  return far * kSeldom <= pairs;
}

}  // namespace

Result<void> settle_values(ReadContext& context, VoxelVolume& volume, const VoxelGrid& grid) {
  const ScalarField::Range range = volume.values.range();
  if (volume.kind == VoxelKind::kMask) {
    const bool signs = range.least < 0.0f && range.greatest > 0.0f;
    volume.kind = signs && looks_like_distances(volume.values, grid) ? VoxelKind::kDistances
                  : range.least >= 0.0f && range.greatest <= 1.0f    ? VoxelKind::kFog
                                                                     : VoxelKind::kValues;
  }
  const SolidRule rule = volume.kind == VoxelKind::kIds         ? SolidRule::kIds
                         : volume.kind == VoxelKind::kDistances ? SolidRule::kBelow
                                                                : SolidRule::kAbove;
  volume.threshold =
      context.options.threshold.value_or(rule == SolidRule::kAbove ? range.greatest / 2.0f : 0.0f);
  volume.set = solid_voxels(volume.values, grid, rule, volume.threshold, context.execution);
  if (context.stopped()) return context.cancelled();
  if (!context.budget.take(volume.set.memory_bytes())) {
    return context.too_large("the runs of voxels");
  }
  if (volume.kind == VoxelKind::kIds) {
    volume.values = ScalarField();
    settle_ids(volume, 1);
  }
  return {};
}

void settle_ids(VoxelVolume& volume, std::uint32_t largest_of_type) {
  VoxelIntervals& set = volume.set;
  std::uint32_t only = 0;
  for (int pass = 0; pass < 2; ++pass) {  // look; then drop the labels
    for (int tv = 0; tv < set.tiles_v(); ++tv) {
      for (int tu = 0; tu < set.tiles_u(); ++tu) {
        const VoxelIntervals::TileView view = set.tile(tu, tv);
        if (view.items.empty()) continue;
        if (pass == 0) {
          for (const std::uint32_t label : view.labels) {
            if (only == 0) only = label;
            if (label != only || (label != 1 && label != largest_of_type)) return;
          }
          continue;
        }
        const std::vector<std::uint32_t> offsets(view.offsets.begin(), view.offsets.end());
        const std::vector<Interval> items(view.items.begin(), view.items.end());
        set.set_tile(tu, tv, offsets, items);
      }
    }
  }
  volume.kind = VoxelKind::kMask;
}

bool are_fractions(const ReadContext& context, const VoxelVolume& volume) {
  constexpr std::size_t kFull = 255;
  if (volume.kind != VoxelKind::kIds || context.options.integers != IntegerVoxels::kAuto) {
    return false;
  }
  std::array<std::uint64_t, kFull + 1> voxels{};
  const VoxelIntervals& set = volume.set;
  for (int tv = 0; tv < set.tiles_v(); ++tv) {
    for (int tu = 0; tu < set.tiles_u(); ++tu) {
      const VoxelIntervals::TileView view = set.tile(tu, tv);
      for (std::size_t i = 0; i < view.items.size(); ++i) {
        const std::uint32_t label = view.label(i);
        if (label > kFull) return false;
        voxels[label] += static_cast<std::uint64_t>(view.items[i].length());
      }
    }
  }
  const std::uint64_t most = *std::max_element(voxels.begin(), voxels.end() - 1);
  return most > 0 && voxels[kFull] > most;
}

Result<void> settle_integers(ReadContext& context, VoxelVolume& volume, NumberType type) {
  if (type == NumberType::kBool) return {};
  volume.kind = VoxelKind::kIds;
  settle_ids(volume, type == NumberType::kU8 ? 255 : 1);
  if (type != NumberType::kU8 || context.colours || !are_fractions(context, volume)) return {};
  context.wants_values = true;
  return fail(ErrorCode::kInput, "{}: filled fractions are no ids", context.path);
}

Result<void> labels_to_values(ReadContext& context, VoxelVolume& volume,
                              const std::array<float, 256>& value_of_label) {
  const VoxelGrid grid = volume.grid();
  const Axis axis = volume.set.axis();
  const AxisFrame frame(axis);
  ScalarField field(grid.dims);
  std::vector<float> row(static_cast<std::size_t>(grid.dims[frame.w]));
  std::uint64_t held = 0;
  glm::ivec3 at(0);
  for (int& v = at[frame.v]; v < grid.dims[frame.v]; ++v) {
    if (context.stopped()) return context.cancelled();
    for (int& u = at[frame.u] = 0; u < grid.dims[frame.u]; ++u) {
      if (volume.set.column(u, v).empty()) continue;
      std::fill(row.begin(), row.end(), 0.0f);
      for_each_labelled(volume.set, u, v, [&](const Interval& run, std::uint32_t label) {
        std::fill(row.begin() + run.begin(), row.begin() + run.end(), value_of_label[label & 255]);
      });
      put_row(field, frame.w, row.data(), grid.dims[frame.w], at);
    }
    if (v % 8 != 7 && v + 1 != grid.dims[frame.v]) continue;
    glm::ivec3 block(0);
    block[frame.v] = v / 8;
    for (int& bu = block[frame.u] = 0; bu < field.blocks()[frame.u]; ++bu) {
      for (int& bw = block[frame.w] = 0; bw < field.blocks()[frame.w]; ++bw) {
        field.settle_block(block.x, block.y, block.z);
      }
    }
    const std::uint64_t now = field.memory_bytes();
    if (now > held && !context.budget.take(now - held)) return context.too_large("the values");
    held = std::max(held, now);
  }
  volume.values = std::move(field);
  volume.kind = VoxelKind::kValues;
  return settle_values(context, volume, grid);
}

void settle_colours(VoxelVolume& volume) {
  VoxelIntervals& set = volume.set;
  std::vector<std::uint32_t> colours, of_tile;
  const auto for_each_tile = [&](auto&& body) {
    for (int tv = 0; tv < set.tiles_v(); ++tv) {
      for (int tu = 0; tu < set.tiles_u(); ++tu) {
        if (!set.tile_empty(tu, tv)) body(set.tile(tu, tv), tu, tv);
      }
    }
  };
  const auto sort_out = [](std::vector<std::uint32_t>& list) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  };
  for_each_tile([&](const VoxelIntervals::TileView& view, int, int) {
    of_tile.assign(view.labels.begin(), view.labels.end());
    sort_out(of_tile);
    colours.insert(colours.end(), of_tile.begin(), of_tile.end());
  });
  sort_out(colours);
  for_each_tile([&](const VoxelIntervals::TileView& view, int tu, int tv) {
    const std::vector<std::uint32_t> offsets(view.offsets.begin(), view.offsets.end());
    const std::vector<Interval> items(view.items.begin(), view.items.end());
    std::vector<std::uint32_t> labels(view.labels.begin(), view.labels.end());
    for (std::uint32_t& label : labels) {
      const auto found = std::lower_bound(colours.begin(), colours.end(), label);
      label = static_cast<std::uint32_t>(found - colours.begin()) + 1;
    }
    set.set_tile(tu, tv, offsets, items, labels);
  });
  volume.colours.clear();
  for (const std::uint32_t colour : colours) volume.colours.push_back(unpacked_colour(colour));
  volume.kind = VoxelKind::kColours;
}

void set_threshold(VoxelVolume& volume, float threshold, const Execution& execution) {
  const VoxelGrid grid = volume.grid();
  const SolidRule rule =
      volume.kind == VoxelKind::kDistances ? SolidRule::kBelow : SolidRule::kAbove;
  volume.threshold = threshold;
  volume.set = solid_voxels(volume.values, grid, rule, threshold, execution);
}

}  // namespace strata
