#include "strata/voxelize/formats/openvdb_bridge.h"

#include <algorithm>
#include <bit>
#include <exception>
#include <new>
#include <type_traits>

#include "voxelize/formats/vdb_leaves.h"
#include "voxelize/output/transposed.h"

namespace strata {
namespace {

using openvdb::Coord;

template <class Grid>
constexpr bool kIsFloat = std::is_same_v<typename Grid::ValueType, float>;

/// Fills a tree from the leaves that the .vdb writer works with.
template <class Grid>
class TreeFiller {
 public:
  using Tree = typename Grid::TreeType;
  using Leaf = typename Tree::LeafNodeType;
  using Value = typename Grid::ValueType;

  /// @param set along z @param divisor of labels; 0: all values are one
  TreeFiller(const VoxelIntervals& set, std::uint32_t divisor, Grid& grid)
      : set_(set), divisor_(divisor), nodes_(grid.tree()) {}

  void add(const VdbLeafTile& tile, int tile_x, int tile_y) {
    for (int column = 0; column < VdbLeafTile::kLeafColumns; ++column) {
      const auto index = static_cast<std::size_t>(column);
      const Coord corner(tile_x * VoxelIntervals::kTileSide + column / 8 * 8,
                         tile_y * VoxelIntervals::kTileSide + column % 8 * 8, 0);
      for (std::uint32_t i = tile.first_run[index]; i < tile.first_run[index + 1]; ++i) {
        for (int z = tile.runs[i].begin; z < tile.runs[i].end; ++z) {
          nodes_.addTile(1, corner + Coord(0, 0, 8 * z), value_of_run(tile, i), true);
        }
      }
      for (std::uint32_t i = tile.first_leaf[index]; i < tile.first_leaf[index + 1]; ++i) {
        add_leaf(corner + Coord(0, 0, 8 * tile.leaf_z[i]), tile.leaves[i]);
      }
    }
  }

 private:
  Value value_of_run(const VdbLeafTile& tile, std::uint32_t run) const {
    if constexpr (std::is_same_v<Value, float>) {
      return divisor_ == 0 ? 1.0f : std::bit_cast<float>(tile.run_value(run));
    } else {
      return true;
    }
  }

  void add_leaf(const Coord& corner, const VdbLeaf& voxels) {
    typename Leaf::NodeMaskType mask;
    for (openvdb::Index word = 0; word < 8; ++word) {
      mask.template getWord<openvdb::Index64>(word) = voxels.words[word];
    }
    auto* leaf = new Leaf(corner, Value(false), false);
    leaf->setValueMask(mask);
    if constexpr (std::is_same_v<Value, float>) {
      set_values(*leaf);
    } else if constexpr (!std::is_same_v<Grid, openvdb::MaskGrid>) {
      leaf->buffer() = typename Leaf::Buffer(mask);
    }
    nodes_.addLeaf(leaf);  // which owns it now
  }

  void set_values(openvdb::FloatTree::LeafNodeType& leaf) const {
    const Coord& corner = leaf.origin();
    for (auto voxel = leaf.beginValueOn(); voxel; ++voxel) voxel.setValue(1.0f);
    if (divisor_ == 0) return;
    for (int x = corner.x(); x < std::min(corner.x() + 8, set_.grid().dims.x); ++x) {
      for (int y = corner.y(); y < std::min(corner.y() + 8, set_.grid().dims.y); ++y) {
        set_column(leaf, x, y);
      }
    }
  }

  void set_column(openvdb::FloatTree::LeafNodeType& leaf, int x, int y) const {
    const int begin = leaf.origin().z(), end = begin + 8;
    const auto items = set_.column(x, y);
    const auto labels = set_.column_labels(x, y);
    const auto first = std::partition_point(items.begin(), items.end(),
                                            [&](Interval item) { return item.end() <= begin; });
    for (auto i = static_cast<std::size_t>(first - items.begin()); i < items.size(); ++i) {
      if (items[i].begin() >= end) break;
      const double label = labels.empty() ? 1 : labels[i];
      for (int z = std::max(begin, items[i].begin()); z < std::min(end, items[i].end()); ++z) {
        leaf.setValueOnly(Coord(x, y, z), static_cast<float>(label / divisor_));
      }
    }
  }

  const VoxelIntervals& set_;
  std::uint32_t divisor_;
  openvdb::tree::ValueAccessor<Tree> nodes_;
};

template <class Grid>
void describe(const VoxelGrid& voxels, const OpenVdbOptions& options, Grid& grid) {
  const bool ids = kIsFloat<Grid> && options.full_label == 0;
  if (kIsFloat<Grid> && !ids) grid.setGridClass(openvdb::GRID_FOG_VOLUME);
  grid.setName(!options.name.empty() ? options.name
               : ids                 ? "ids"
               : kIsFloat<Grid>      ? "density"
                                     : "solid");
  grid.setCreator("strata");
  const glm::dvec3 size = voxels.voxel_size, centre = voxels.origin + 0.5 * size;
  const openvdb::Vec3d scale(size.x, size.y, size.z), shift(centre.x, centre.y, centre.z);
  openvdb::math::MapBase::Ptr map;
  if (size.x == size.y && size.y == size.z) {
    map = std::make_shared<openvdb::math::UniformScaleTranslateMap>(size.x, shift);
  } else {
    map = std::make_shared<openvdb::math::ScaleTranslateMap>(scale, shift);
  }
  grid.setTransform(std::make_shared<openvdb::math::Transform>(map));
}

template <class Grid>
Result<typename Grid::Ptr> make_grid(const VoxelIntervals& set, const OpenVdbOptions& options,
                                     const Execution& execution) {
  auto grid = Grid::create();
  const bool labels = kIsFloat<Grid> && set.has_labels();
  const std::uint32_t divisor = labels ? std::max(options.full_label, std::uint32_t{1}) : 0;
  VdbLeafBuilder builder(set.grid().dims.z, divisor);
  TreeFiller<Grid> filler(set, divisor, *grid);
  for (int tv = 0; tv < set.tiles_v(); ++tv) {
    for (int tu = 0; tu < set.tiles_u(); ++tu) {
      if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
      if (const auto tile = builder.build(set, tu, tv)) filler.add(*tile, tu, tv);
    }
    if (execution.progress) execution.progress(static_cast<double>(tv + 1) / set.tiles_v());
  }
  grid->tree().prune();
  describe(set.grid(), options, *grid);
  return grid;
}

}  // namespace

template <class Grid>
Result<typename Grid::Ptr> to_openvdb(const VoxelIntervals& set, const OpenVdbOptions& options,
                                      const Execution& execution) {
  const int rows = set.grid().dims[AxisFrame(set.axis()).v];
  if (set.v_begin() != 0 || set.v_end() != rows) {
    return fail(ErrorCode::kUsage, "an OpenVDB grid is made of all {} rows, got rows {} to {}",
                rows, set.v_begin(), set.v_end());
  }
  try {
    if (set.axis() == Axis::kZ) return make_grid<Grid>(set, options, execution);
    const VoxelIntervals turned = transposed(set, Axis::kZ, execution);
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    return make_grid<Grid>(turned, options, execution);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "out of memory for an OpenVDB grid");
  } catch (const openvdb::ArithmeticError&) {
    const glm::dvec3 size = set.grid().voxel_size;
    return fail(ErrorCode::kUsage, "OpenVDB takes no voxels of {} x {} x {}", size.x, size.y,
                size.z);
  } catch (const std::exception& error) {
    return fail(ErrorCode::kInternal, "OpenVDB: {}", error.what());
  }
}

template Result<openvdb::BoolGrid::Ptr> to_openvdb<openvdb::BoolGrid>(const VoxelIntervals&,
                                                                      const OpenVdbOptions&,
                                                                      const Execution&);
template Result<openvdb::MaskGrid::Ptr> to_openvdb<openvdb::MaskGrid>(const VoxelIntervals&,
                                                                      const OpenVdbOptions&,
                                                                      const Execution&);
template Result<openvdb::FloatGrid::Ptr> to_openvdb<openvdb::FloatGrid>(const VoxelIntervals&,
                                                                        const OpenVdbOptions&,
                                                                        const Execution&);

}  // namespace strata
