// OpenVDB files, versions 222 to 224 (OpenVDB 3 and later): trees of branching 5, 4, 3 of bool,
// mask, int32, int64, float and double, the last two also as halves; of Vec3s, which are colours;
// plain, packed by zlib or Blosc, with or without inactive values. Not by libopenvdb: it trusts the
// file, takes 45 ms to load, and
// ./dev demo builds without it. The tests compare with what OpenVDB reads and writes.
//
// Masks and bools become runs tile by tile, straight from the leaves. Numbers become blocks of a
// field, which are leaves, too.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <glm/common.hpp>
#include <optional>
#include <string>
#include <vector>

#include "strata/voxelize/packed_colour.h"
#include "voxelize/heads/grid_axes.h"
#include "voxelize/readers/readers.h"
#include "voxelize/readers/vdb_tree.h"
#include "voxelize/volume/dense_array.h"
#include "voxelize/volume/tile_runs.h"

namespace strata {
namespace {

constexpr std::size_t kBoolLeafBytes = 64 + 12 + 64;  // mask, origin, values

std::size_t size(int value) { return static_cast<std::size_t>(value); }

class VdbReader {
 public:
  VdbReader(ReadContext& context, VdbGridHead head, VdbTreeType type, std::uint64_t blocks_at)
      : context_(context),
        head_(std::move(head)),
        type_(type),
        lists_(type, head_.compression),
        blocks_at_(blocks_at) {}

  /// @param tree_at  of the topology
  Result<VoxelVolume> read(std::uint64_t tree_at);

 private:
  [[nodiscard]] Result<VoxelGrid> box() const;
  [[nodiscard]] std::string meta(const std::string& name) const {
    const auto found = head_.metadata.find(name);
    return found == head_.metadata.end() ? std::string() : found->second;
  }
  Result<void> take_bools();
  /// A leaf or a box that meets a tile of columns.
  struct Item {
    int z = 0;
    std::uint32_t index = 0;
    bool box = false;
  };
  using Items = std::vector<std::vector<Item>>;
  Result<Items> items_of_tiles(const VoxelIntervals& set) const;
  Result<VoxelIntervals> make_runs(const VoxelGrid& grid);
  void add_leaf(std::size_t leaf, const glm::ivec3& tile, TileRuns& runs) const;
  void add_box(const VdbTile& box, const glm::ivec3& tile, TileRuns& runs) const;
  Result<ScalarField> make_field(const VoxelGrid& grid);
  Result<void> read_leaves(ScalarField& field);
  Result<VoxelVolume> coloured(VoxelVolume volume, const VoxelGrid& grid);
  [[nodiscard]] VoxelKind kind() const;

  ReadContext& context_;
  VdbGridHead head_;
  VdbTreeType type_;
  VdbValueLists lists_;
  std::uint64_t blocks_at_;
  VdbTree tree_;
};

// The box of the active voxels; one empty voxel if there are none.
Result<VoxelGrid> VdbReader::box() const {
  const glm::ivec3 lower = tree_.empty() ? glm::ivec3(0) : tree_.lower;
  const glm::ivec3 upper = tree_.empty() ? glm::ivec3(0) : tree_.upper;
  std::int64_t sides[3];
  for (int axis = 0; axis < 3; ++axis) {
    sides[axis] = std::int64_t{upper[axis]} - lower[axis] + 1;
  }
  if (auto fits = check_dims(context_, sides[0], sides[1], sides[2]); !fits) {
    return tl::unexpected(fits.error());
  }
  VoxelGrid grid;
  grid.dims = upper - lower + 1;
  grid.voxel_size = head_.voxel_size;
  grid.origin = head_.centre + head_.voxel_size * (glm::dvec3(lower) - 0.5);
  if (auto place = check_place(context_, grid); !place) return tl::unexpected(place.error());
  return grid;
}

// The values of bools take the place of the masks: true and active.
Result<void> VdbReader::take_bools() {
  ByteCursor cursor(context_.bytes, blocks_at_);
  const std::string_view bytes = cursor.take(tree_.leaves.size() * kBoolLeafBytes);
  if (cursor.failed()) {
    return fail(ErrorCode::kInput, "{}: byte {}: {} leaves need {} bytes, the file has {}",
                context_.path, blocks_at_, tree_.leaves.size(),
                tree_.leaves.size() * kBoolLeafBytes, context_.bytes.size());
  }
  for (std::size_t i = 0; i < tree_.masks.size(); ++i) {
    VdbMask values;
    std::memcpy(values.data(), bytes.data() + (i + 1) * kBoolLeafBytes - sizeof values,
                sizeof values);
    for (std::size_t w = 0; w < values.size(); ++w) tree_.masks[i][w] &= values[w];
  }
  std::erase_if(tree_.tiles, [](const VdbTile& tile) { return tile.value == 0.0f; });
  return {};
}

// @param tile  its first column's index in the file
void VdbReader::add_leaf(std::size_t leaf, const glm::ivec3& tile, TileRuns& runs) const {
  const glm::ivec3 at = tree_.leaves[leaf] - tile;  // z is along the grid
  for (int x = 0; x < kLeafSide; ++x) {
    const std::uint64_t word = tree_.masks[leaf][size(x)];
    if (word == 0 || at.x + x < 0 || at.x + x >= kTileSide) continue;
    for (int y = 0; y < kLeafSide; ++y) {
      if (at.y + y < 0 || at.y + y >= kTileSide) continue;
      const auto local = static_cast<unsigned>((at.y + y) * kTileSide + at.x + x);
      for (unsigned bits = word >> (8 * y) & 0xff, z = 0; bits != 0;) {
        const auto empty = static_cast<unsigned>(std::countr_zero(bits));
        bits >>= empty;
        const auto solid = static_cast<unsigned>(std::countr_one(bits));
        const int first = at.z + static_cast<int>(z + empty);
        runs.add(local, first, first + static_cast<int>(solid) - 1, 1);
        bits >>= solid;
        z += empty + solid;
      }
    }
  }
}

void VdbReader::add_box(const VdbTile& box, const glm::ivec3& tile, TileRuns& runs) const {
  const glm::ivec3 first = box.first - tile, last = box.last - tile;
  for (int y = std::max(first.y, 0); y <= std::min(last.y, kTileSide - 1); ++y) {
    for (int x = std::max(first.x, 0); x <= std::min(last.x, kTileSide - 1); ++x) {
      runs.add(static_cast<unsigned>(y * kTileSide + x), first.z, last.z, 1);
    }
  }
}

// What meets each tile of columns, along z.
Result<VdbReader::Items> VdbReader::items_of_tiles(const VoxelIntervals& set) const {
  Items items(size(set.tiles_u()) * size(set.tiles_v()));
  const glm::ivec3 dims = set.grid().dims;
  std::uint64_t held = 0;
  const auto enter = [&](const glm::ivec3& first, const glm::ivec3& last, std::size_t index,
                         bool box) {
    const glm::ivec3 from = first - tree_.lower, to = last - tree_.lower;
    for (int tv = std::max(from.y, 0) / kTileSide; tv <= std::min(to.y, dims.y - 1) / kTileSide;
         ++tv) {
      for (int tu = std::max(from.x, 0) / kTileSide; tu <= std::min(to.x, dims.x - 1) / kTileSide;
           ++tu) {
        items[size(tv) * size(set.tiles_u()) + size(tu)].push_back(
            {first.z, static_cast<std::uint32_t>(index), box});
        ++held;
      }
    }
    return held % 65536 != 0 || context_.budget.take(65536 * sizeof(Item));
  };
  for (std::size_t i = 0; i < tree_.leaves.size(); ++i) {
    const glm::ivec3 at = tree_.leaves[i];
    if (!enter(at, at + (kLeafSide - 1), i, false)) {
      return context_.too_large("the leaves of the tree");
    }
  }
  for (std::size_t i = 0; i < tree_.tiles.size(); ++i) {
    const VdbTile& tile = tree_.tiles[i];
    if (tile.active && !enter(tile.first, tile.last, i, true)) {
      return context_.too_large("the tiles of the tree");
    }
  }
  return items;
}

Result<VoxelIntervals> VdbReader::make_runs(const VoxelGrid& grid) {
  VoxelIntervals set(grid, Axis::kZ);
  if (!context_.budget.take(set.memory_bytes())) return context_.too_large("the grid");
  Result<Items> items = items_of_tiles(set);
  if (!items) return tl::unexpected(items.error());
  std::vector<TileRuns> runs(size(context_.execution.thread_count()));
  std::atomic<bool> full{false};
  parallel_for(context_.execution, items->size(), [&](std::size_t index, int worker) {
    std::vector<Item>& here = (*items)[index];
    if (here.empty() || full) return;
    const int tu = static_cast<int>(index) % set.tiles_u();
    const int tv = static_cast<int>(index) / set.tiles_u();
    std::sort(here.begin(), here.end(), [](const Item& a, const Item& b) { return a.z < b.z; });
    const glm::ivec3 tile = tree_.lower + glm::ivec3(tu, tv, 0) * kTileSide;
    TileRuns& mine = runs[size(worker)];
    for (const Item& item : here) {
      if (item.box) {
        add_box(tree_.tiles[item.index], tile, mine);
      } else {
        add_leaf(item.index, tile, mine);
      }
    }
    const std::uint64_t bytes =
        mine.pieces() * sizeof(Interval) + VoxelIntervals::kTileColumns * sizeof(std::uint32_t);
    full = full || !context_.budget.take(bytes);
    mine.store(set, tu, tv, false);
  });
  if (full) return context_.too_large("the runs of voxels");
  if (context_.stopped()) return context_.cancelled();
  return set;
}

Result<void> VdbReader::read_leaves(ScalarField& field) {
  constexpr std::size_t kBatch = 4096;
  const glm::ivec3 base = tree_.lower - field.shift();
  ByteCursor cursor(context_.bytes, blocks_at_);
  std::vector<std::uint64_t> at(kBatch);
  std::vector<float> values(kBatch * ScalarField::kBlockVoxels);
  std::vector<std::string> wrong(kBatch);
  for (std::size_t first = 0; first < tree_.leaves.size(); first += kBatch) {
    const std::size_t count = std::min(kBatch, tree_.leaves.size() - first);
    for (std::size_t i = 0; i < count; ++i) {
      cursor.take(sizeof(VdbMask));
      at[i] = cursor.at();
      lists_.skip(cursor, tree_.masks[first + i]);
    }
    parallel_for(context_.execution, count, [&](std::size_t i, int) {
      ByteCursor own(context_.bytes, at[i]);
      wrong[i] =
          lists_.read(own, tree_.masks[first + i], values.data() + i * ScalarField::kBlockVoxels);
    });
    if (context_.stopped()) return context_.cancelled();
    for (std::size_t i = 0; i < count; ++i) {
      if (!wrong[i].empty()) {
        return fail(ErrorCode::kInput, "{}: byte {}: leaf {} of {}: {}", context_.path, at[i],
                    first + i + 1, tree_.leaves.size(), wrong[i]);
      }
      const glm::ivec3 block = (tree_.leaves[first + i] - base) / kLeafSide;
      const glm::ivec3 limit = field.blocks();
      // A leaf without active voxels may lie outside of their box.
      if (tree_.leaves[first + i] != glm::max(tree_.leaves[first + i], base)) continue;
      if (block.x >= limit.x || block.y >= limit.y || block.z >= limit.z) continue;
      field.set_block(
          block.x, block.y, block.z,
          std::span<const float, ScalarField::kBlockVoxels>(
              values.data() + i * ScalarField::kBlockVoxels, ScalarField::kBlockVoxels));
    }
    if (field.memory_bytes() > context_.budget.limit()) return context_.too_large("the values");
    if (context_.execution.progress) {
      context_.execution.progress(static_cast<double>(first + count) /
                                  static_cast<double>(tree_.leaves.size()));
    }
  }
  return {};
}

Result<ScalarField> VdbReader::make_field(const VoxelGrid& grid) {
  const glm::ivec3 shift(tree_.lower.x & 7, tree_.lower.y & 7, tree_.lower.z & 7);
  ScalarField field(grid.dims, tree_.background, shift);
  const glm::ivec3 base = tree_.lower - shift;
  for (const VdbTile& tile : tree_.tiles) {
    const glm::ivec3 first = (glm::max(tile.first, base) - base) / kLeafSide;
    if (tile.last != glm::max(tile.last, base)) continue;  // ends before the box
    field.fill_blocks(first, (tile.last - base) / kLeafSide + 1, tile.value);
    if (field.memory_bytes() > context_.budget.limit()) return context_.too_large("the values");
  }
  if (auto read = read_leaves(field); !read) return tl::unexpected(read.error());
  return field;
}

/// Labels from the values that VdbValueLists gives to colours, and a palette.
Result<VoxelVolume> VdbReader::coloured(VoxelVolume volume, const VoxelGrid& grid) {
  volume.kind = VoxelKind::kIds;
  if (auto settled = settle_values(context_, volume, grid); !settled) {
    return tl::unexpected(settled.error());
  }
  if (volume.kind != VoxelKind::kIds) return volume;  // all is black
  settle_colours(volume);
  for (glm::u8vec4& colour : volume.colours) {
    const std::uint32_t packed = packed_colour(colour) - 1;
    colour = unpacked_colour(packed | 0xff000000u);
  }
  return volume;
}

VoxelKind VdbReader::kind() const {
  const std::string grid_class = meta("class");
  const bool real = type_.type == VdbType::kFloat || type_.type == VdbType::kDouble;
  if (!real) return context_.integers_as_values ? VoxelKind::kValues : VoxelKind::kIds;
  if (grid_class == "level set") return VoxelKind::kDistances;
  if (grid_class == "fog volume") return VoxelKind::kFog;
  if (meta("creator") == "strata" && !context_.integers_as_values) return VoxelKind::kIds;
  return VoxelKind::kMask;  // unknown
}

Result<VoxelVolume> VdbReader::read(std::uint64_t tree_at) {
  Result<VdbTree> tree = read_vdb_tree(context_, tree_at, lists_);
  if (!tree) return tl::unexpected(tree.error());
  tree_ = std::move(*tree);
  if (blocks_at_ == 0) blocks_at_ = tree_.end;
  const Result<VoxelGrid> grid = box();
  if (!grid) return tl::unexpected(grid.error());
  VoxelVolume volume;
  volume.first_index = tree_.empty() ? glm::ivec3(0) : tree_.lower;
  volume.type = type_.half ? "half" : std::string(name_of(type_.type));
  if (!head_.note.empty()) volume.notes.push_back(head_.note);
  if (tree_.empty()) {
    volume.notes.push_back("no voxel of the grid is active");
    volume.set = VoxelIntervals(*grid, Axis::kZ);
    return volume;
  }
  if (type_.type == VdbType::kMask || type_.type == VdbType::kBool) {
    if (type_.type == VdbType::kBool) {
      if (auto taken = take_bools(); !taken) return tl::unexpected(taken.error());
    }
    Result<VoxelIntervals> set = make_runs(*grid);
    if (!set) return tl::unexpected(set.error());
    volume.set = std::move(*set);
    return volume;
  }
  Result<ScalarField> field = make_field(*grid);
  if (!field) return tl::unexpected(field.error());
  volume.values = std::move(*field);
  if (lists_.colours()) return coloured(std::move(volume), *grid);
  volume.kind = kind();
  if (volume.kind == VoxelKind::kIds && volume.values.range().least < 0.0f) {
    volume.kind = VoxelKind::kValues;
  }
  if (auto settled = settle_values(context_, volume, *grid); !settled) {
    return tl::unexpected(settled.error());
  }
  return volume;
}

/// The grid that is asked for, or the first that can be read.
Result<const VdbGridEntry*> choose(const ReadContext& context,
                                   const std::vector<VdbGridEntry>& entries) {
  const std::string& wanted = context.options.grid;
  std::string list;
  for (const VdbGridEntry& entry : entries) {
    const bool readable = vdb_tree_type(entry.tree_type).read;
    if (wanted.empty() ? readable : entry.name == wanted) {
      if (readable) return &entry;
      return fail(ErrorCode::kInput,
                  "{}: grid '{}' is a {}; trees of bool, mask, int32, int64, float, double and "
                  "vec3s of 5_4_3 are read",
                  context.path, entry.name, entry.tree_type);
    }
    list += (list.empty() ? "'" : ", '") + entry.name + "' (" + entry.tree_type + ")";
  }
  if (!wanted.empty()) {
    return fail(ErrorCode::kUsage, "{}: no grid '{}'; it has {}", context.path, wanted,
                list.empty() ? "none" : list);
  }
  return fail(ErrorCode::kInput,
              "{}: no grid of bool, mask, int32, int64, float, double or vec3s; it has {}",
              context.path, list.empty() ? "none" : list);
}

}  // namespace

Result<VoxelVolume> read_vdb_voxels(ReadContext& context) {
  const Result<std::vector<VdbGridEntry>> entries = read_vdb_entries(context);
  if (!entries) return tl::unexpected(entries.error());
  const Result<const VdbGridEntry*> entry = choose(context, *entries);
  if (!entry) return tl::unexpected(entry.error());
  Result<VdbGridHead> head = read_vdb_head(context, **entry);
  if (!head) return tl::unexpected(head.error());
  std::uint64_t tree_at = head->tree_at, blocks_at = (*entry)->blocks_at;
  std::string tree_type = (*entry)->tree_type;
  if (!(*entry)->parent.empty()) {  // the tree is another grid's
    const std::string parent = (*entry)->parent.substr(0, (*entry)->parent.find('\x1e'));
    const auto found = std::find_if(entries->begin(), entries->end(), [&](const VdbGridEntry& e) {
      return e.name == parent && e.parent.empty();
    });
    if (found == entries->end()) {
      return fail(ErrorCode::kInput, "{}: grid '{}' has the tree of '{}', which is not there",
                  context.path, (*entry)->name, parent);
    }
    const Result<VdbGridHead> other = read_vdb_head(context, *found);
    if (!other) return tl::unexpected(other.error());
    tree_at = other->tree_at;
    blocks_at = found->blocks_at;
    tree_type = found->tree_type;
    head->compression = other->compression;
  }
  Result<VoxelVolume> volume =
      VdbReader(context, std::move(*head), vdb_tree_type(tree_type), blocks_at).read(tree_at);
  if (!volume) return volume;
  volume->name = (*entry)->name;
  for (const VdbGridEntry& each : *entries) volume->grids.push_back(each.name);
  return volume;
}

Result<VoxelFileGrid> vdb_grid(ReadContext& context) {
  const Result<std::vector<VdbGridEntry>> entries = read_vdb_entries(context);
  if (!entries) return tl::unexpected(entries.error());
  const Result<const VdbGridEntry*> entry = choose(context, *entries);
  if (!entry) return tl::unexpected(entry.error());
  const Result<VdbGridHead> head = read_vdb_head(context, **entry);
  if (!head) return tl::unexpected(head.error());
  const auto corner = [&](const char* name) -> std::optional<glm::ivec3> {
    const auto found = head->metadata.find(name);
    if (found == head->metadata.end() || found->second.size() != 12) return std::nullopt;
    ByteCursor cursor(found->second);
    glm::ivec3 at;
    for (int axis = 0; axis < 3; ++axis) at[axis] = cursor.get<std::int32_t>();
    return at;
  };
  std::optional<glm::ivec3> lower = corner("file_bbox_min"), upper = corner("file_bbox_max");
  if ((!lower || !upper) && (*entry)->parent.empty()) {
    VdbValueLists lists(vdb_tree_type((*entry)->tree_type), head->compression);
    const Result<VdbTree> tree = read_vdb_tree(context, head->tree_at, lists);
    if (!tree) return tl::unexpected(tree.error());
    lower = tree->lower, upper = tree->upper;
  }
  if (!lower || !upper || upper->x < lower->x) {
    return fail(ErrorCode::kInput, "{}: no voxel of the grid is active, so it has no box",
                context.path);
  }
  GridAxes axes;
  axes.steps = head->steps;
  axes.place = head->centre + head->steps * glm::dvec3(*lower);
  for (int axis = 0; axis < 3; ++axis) {
    axes.sizes[static_cast<std::size_t>(axis)] =
        static_cast<double>((*upper)[axis]) - static_cast<double>((*lower)[axis]) + 1.0;
  }
  return grid_of_axes(context.path, axes);
}

}  // namespace strata
