// OpenVDB files, version 224, written straight from leaves.
//
// The tree is OpenVDB's (tree/RootNode.h, InternalNode.h, LeafNodeMask.h, LeafNodeBool.h,
// LeafNode.h and io/Compression.h of OpenVDB 10.0), topology and then buffers, both depth first:
//   topology  root, upper node (32^3 lower nodes), lower node (16^3 leaves), mask of a leaf
//   buffers   mask of a leaf again, then its origin (mask), its origin and the mask once more as
//             values (bool), or its active values (float: a fog volume, ids; three floats: colours)
// Not with the library itself: loading libopenvdb takes 45 ms, several times what a whole 1024^3
// solid takes here, and a lower node of its tree is 33 KB to be filled and freed. The tests read
// the files back with OpenVDB and compare the bytes of the tree with those that OpenVDB writes.

#include <algorithm>
#include <array>
#include <climits>
#include <cmath>
#include <cstring>
#include <glm/common.hpp>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "voxelize/formats/level_set.h"
#include "voxelize/formats/vdb_header.h"
#include "voxelize/formats/vdb_leaves.h"
#include "voxelize/output/block_output.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

constexpr std::size_t kLowerSlots = 4096;
constexpr std::size_t kUpperSlots = 32768;
constexpr std::size_t kLeafVoxels = 512;
constexpr std::size_t kLeafColumns = std::size_t{kLowerLeaves} * kLowerLeaves;  // of a lower node
// Origin, two masks of the slots, and how the values are stored; the values follow.
constexpr std::size_t kHeadBytes = sizeof(glm::ivec3) + 2 * kUpperSlots / 8 + 1;
constexpr std::size_t kLowerBytes = 2 * kLowerSlots / 8 + 1;
// Every inactive value is the background: such a list of values holds the active ones only.
constexpr std::uint8_t kActiveValuesOnly = 0;

int parts(int voxels, int part) { return (voxels + part - 1) / part; }
std::size_t size(int value) { return static_cast<std::size_t>(value); }

/// The one value of several things, as they come: the bits of a float > 0; without values 1.
class OneValue {
 public:
  void add(std::uint32_t value) { value_ = value_ == 0 || value_ == value ? value : kSeveral; }
  [[nodiscard]] std::uint32_t get() const { return value_; }
  [[nodiscard]] bool several() const { return value_ == kSeveral; }

 private:
  static constexpr std::uint32_t kSeveral = ~std::uint32_t{0};
  std::uint32_t value_ = 0;
};

/// What is known of a lower node after counting.
struct LowerNode {
  std::uint32_t leaves = 0;  // partly solid: stored
  std::uint32_t solid = 0;   // all solid: active tiles of the node
  OneValue value;            // of those

  [[nodiscard]] bool all_solid() const {  // a tile of its parent
    return solid == kLowerSlots && !value.several();
  }
  [[nodiscard]] bool stored() const { return !all_solid() && (leaves != 0 || solid != 0); }
};

/// An upper node that is stored.
struct Upper {
  glm::ivec3 index{0};    // in upper nodes of the whole grid
  std::size_t solid = 0;  // lower nodes that are all solid: active tiles of the node
};

/// An upper node that is all solid.
struct RootTile {
  glm::ivec3 index{0};
  std::uint32_t value = 0;
};

/// A piece of the file that one thread makes: the head of an upper node, or the topology or the
/// buffers of its lower nodes at (x, y), which stand one after the other in both.
struct TreeBlock {
  enum Kind { kHead, kTopology, kBuffers } kind = kHead;
  std::size_t upper = 0;  // index in uppers_
  int x = 0, y = 0;       // in lower nodes of the whole grid
};

/// The active values of an inner node as they stand in a file: true, or numbers. Tiles are few, so
/// numbers stand as they are: [minus their bytes:64 | floats, one or three a value].
class TileValues {
 public:
  explicit TileValues(VdbValues values) : values_(values) {}
  [[nodiscard]] bool numbers() const {
    return values_ == VdbValues::kFloat || values_ == VdbValues::kColour;
  }
  /// Of one value.
  [[nodiscard]] std::size_t value_bytes() const {
    return values_ == VdbValues::kColour  ? 3 * sizeof(float)
           : values_ == VdbValues::kFloat ? sizeof(float)
                                          : 1;
  }
  [[nodiscard]] std::size_t bytes(std::size_t n) const {
    return (numbers() ? sizeof(std::int64_t) : 0) + n * value_bytes();
  }
  /// Writes the list of n values. `values`, the bits of floats or colours, count with numbers only.
  void copy(std::size_t n, std::byte* to, std::span<const std::uint32_t> values) const {
    if (!numbers()) {
      std::memset(to, 1, n);
      return;
    }
    const std::int64_t count = -static_cast<std::int64_t>(n * value_bytes());
    std::memcpy(to, &count, sizeof count);
    to += sizeof count;
    for (std::size_t i = 0; i < n; ++i, to += value_bytes()) put(values[i], to);
  }
  /// Writes one value. @param value 0: the background
  void put(std::uint32_t value, std::byte* to) const {
    if (values_ == VdbValues::kColour) {
      const std::array<float, 3> light = VdbLeafBuilder::light_of(value);
      std::memcpy(to, light.data(), sizeof light);
    } else {
      std::memcpy(to, &value, value_bytes());
    }
  }

 private:
  VdbValues values_;
};

class VdbWriter final : public SlabWriter {
 public:
  VdbWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
            BlockOutput output)
      : SlabWriter(path, grid, Axis::kZ, false, options.part.has_value()),
        divisor_(options.ids != 0 || options.rgba ? 1 : options.fog),
        kind_(options.rgba    ? VdbValues::kColour
              : divisor_ != 0 ? VdbValues::kFloat
              : options.mask  ? VdbValues::kMask
                              : VdbValues::kBool),
        fog_(options.fog != 0),
        name_(options.rgba && options.name == "colours" ? "Cd" : options.name),
        frame_(options.frame),
        output_(std::move(output)),
        tiles_x_(parts(grid.dims.x, VoxelIntervals::kTileSide)),
        tiles_y_(parts(grid.dims.y, VoxelIntervals::kTileSide)),
        lowers_(parts(grid.dims.x, kLowerVoxels), parts(grid.dims.y, kLowerVoxels),
                parts(grid.dims.z, kLowerVoxels)),
        tiles_(size(tiles_x_) * size(tiles_y_)),
        values_(kind_) {}

 private:
  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override;
  Result<void> finish_output(const Execution& execution) override;

  /// One of the 16 x 16 leaf columns above a lower column, and how far it has been walked.
  struct LeafColumn {
    const VdbLeafTile* tile = nullptr;
    std::uint32_t leaf = 0, leaf_end = 0, run = 0, run_end = 0;
  };
  using LeafColumnArray = std::array<LeafColumn, kLeafColumns>;
  [[nodiscard]] LeafColumnArray leaf_columns(int x, int y, int first_z) const;
  [[nodiscard]] LowerNode* lower_column(int x, int y) {
    return lower_nodes_.data() + (size(x) * size(lowers_.y) + size(y)) * size(lowers_.z);
  }

  void count(const Execution& execution);
  void lay_out();
  void lay_out_upper(const glm::ivec3& upper);
  [[nodiscard]] std::string root() const;
  [[nodiscard]] VdbHeader header(std::uint64_t topology_bytes) const;
  /// Lower nodes of an upper node: from its first along each axis to one past its last.
  [[nodiscard]] glm::ivec3 first_lower(const glm::ivec3& upper) const {
    return upper * kUpperLowers;
  }
  [[nodiscard]] glm::ivec3 last_lower(const glm::ivec3& upper) const {
    return glm::min(first_lower(upper) + kUpperLowers, lowers_);
  }
  void make_head(const TreeBlock& block, Bytes& out);
  void make_topology(const TreeBlock& block, Bytes& out);
  void make_buffers(const TreeBlock& block, Bytes& out);
  /// Of a leaf without numbers: mask, origin and, of bools, the mask as values.
  [[nodiscard]] std::size_t leaf_buffer_bytes() const {
    return sizeof(VdbLeaf) + sizeof(glm::ivec3) + (kind_ == VdbValues::kBool ? sizeof(VdbLeaf) : 0);
  }

  std::uint32_t divisor_;  // of labels, which makes them values; 0: no values
  VdbValues kind_;
  bool fog_;
  std::string name_;
  GridFrame frame_;
  BlockOutput output_;
  int tiles_x_, tiles_y_;
  glm::ivec3 lowers_;  // lower nodes along x, y, z
  std::vector<std::unique_ptr<VdbLeafTile>> tiles_;
  std::vector<std::unique_ptr<VdbLeafBuilder>> builders_;  // by worker
  std::vector<LowerNode> lower_nodes_;                     // z fastest, then y
  std::vector<Upper> uppers_;                              // stored nodes
  std::vector<RootTile> root_tiles_;
  std::vector<TreeBlock> blocks_;
  TileValues values_;
  std::uint64_t leaves_ = 0;
};

Result<void> VdbWriter::add_slab(const VoxelIntervals& slab, const Execution& execution) {
  builders_.resize(std::max(builders_.size(), size(execution.thread_count())));
  const std::size_t first = size(slab.v_begin() / VoxelIntervals::kTileSide) * size(tiles_x_);
  const std::size_t count = size(slab.tiles_u()) * size(slab.tiles_v());
  parallel_for(execution, count, [&](std::size_t index, int worker) {
    const int tu = static_cast<int>(index) % slab.tiles_u();
    const int tv = static_cast<int>(index) / slab.tiles_u();
    if (slab.tile_empty(tu, tv)) return;
    std::unique_ptr<VdbLeafBuilder>& builder = builders_[size(worker)];
    if (!builder)
      builder = std::make_unique<VdbLeafBuilder>(dims().z, divisor_, kind_ == VdbValues::kColour);
    tiles_[first + index] = builder->build(slab, tu, tv);
  });
  return {};
}

// --- layout -------------------------------------------------------------------------------------

VdbWriter::LeafColumnArray VdbWriter::leaf_columns(int x, int y, int first_z) const {
  LeafColumnArray columns;
  for (int c = 0; c < kLowerLeaves * kLowerLeaves; ++c) {
    const int leaf_x = x * kLowerLeaves + c / kLowerLeaves,
              leaf_y = y * kLowerLeaves + c % kLowerLeaves;
    const int tile_x = leaf_x / 8, tile_y = leaf_y / 8;
    if (tile_x >= tiles_x_ || tile_y >= tiles_y_) continue;
    const VdbLeafTile* tile = tiles_[size(tile_y) * size(tiles_x_) + size(tile_x)].get();
    if (tile == nullptr) continue;
    const std::size_t i = size(leaf_x % 8 * 8 + leaf_y % 8);
    LeafColumn& column = columns[size(c)];
    column = {tile, tile->first_leaf[i], tile->first_leaf[i + 1], tile->first_run[i],
              tile->first_run[i + 1]};
    if (first_z == 0) continue;
    const std::uint16_t* leaf_z = tile->leaf_z.data();
    column.leaf = static_cast<std::uint32_t>(
        std::lower_bound(leaf_z + column.leaf, leaf_z + column.leaf_end, first_z) - leaf_z);
    while (column.run < column.run_end && tile->runs[column.run].end <= first_z) ++column.run;
  }
  return columns;
}

void VdbWriter::count(const Execution& execution) {
  lower_nodes_.resize(size(lowers_.x) * size(lowers_.y) * size(lowers_.z));
  parallel_for(execution, size(lowers_.x) * size(lowers_.y), [&](std::size_t index, int) {
    const int x = static_cast<int>(index) / lowers_.y, y = static_cast<int>(index) % lowers_.y;
    LowerNode* nodes = lower_column(x, y);
    for (const LeafColumn& column : leaf_columns(x, y, 0)) {
      for (std::uint32_t i = column.leaf; i < column.leaf_end; ++i) {
        ++nodes[column.tile->leaf_z[i] / kLowerLeaves].leaves;
      }
      for (std::uint32_t i = column.run; i < column.run_end; ++i) {
        const VdbLeafTile::Run run = column.tile->runs[i];
        for (int begin = run.begin; begin < run.end;) {
          const int end = std::min<int>(run.end, (begin / kLowerLeaves + 1) * kLowerLeaves);
          nodes[begin / kLowerLeaves].solid += static_cast<std::uint32_t>(end - begin);
          nodes[begin / kLowerLeaves].value.add(column.tile->run_value(i));
          begin = end;
        }
      }
    }
  });
}

void VdbWriter::lay_out() {
  const glm::ivec3 uppers(parts(dims().x, kUpperVoxels), parts(dims().y, kUpperVoxels),
                          parts(dims().z, kUpperVoxels));
  // The root is a sorted map of coordinates: x slowest.
  for (int x = 0; x < uppers.x; ++x) {
    for (int y = 0; y < uppers.y; ++y) {
      for (int z = 0; z < uppers.z; ++z) lay_out_upper({x, y, z});
    }
  }
  // All topology stands before all buffers.
  const std::size_t topology_blocks = blocks_.size();
  for (std::size_t i = 0; i < topology_blocks; ++i) {
    if (blocks_[i].kind != TreeBlock::kTopology) continue;
    blocks_.push_back(blocks_[i]);
    blocks_.back().kind = TreeBlock::kBuffers;
  }
}

void VdbWriter::lay_out_upper(const glm::ivec3& upper) {
  const glm::ivec3 first = first_lower(upper), last = last_lower(upper);
  std::size_t solid = 0;
  OneValue value;
  const std::size_t blocks_before = blocks_.size();
  blocks_.push_back({TreeBlock::kHead, uppers_.size(), 0, 0});
  for (int x = first.x; x < last.x; ++x) {
    for (int y = first.y; y < last.y; ++y) {
      bool stored = false;
      const LowerNode* nodes = lower_column(x, y);
      for (int z = first.z; z < last.z; ++z) {
        if (nodes[z].all_solid()) {
          ++solid;
          value.add(nodes[z].value.get());
        }
        if (!nodes[z].stored()) continue;
        stored = true;
        leaves_ += nodes[z].leaves;
      }
      if (stored) blocks_.push_back({TreeBlock::kTopology, uppers_.size(), x, y});
    }
  }
  const bool nothing = solid == 0 && blocks_.size() == blocks_before + 1;
  if (nothing || (solid == kUpperSlots && !value.several())) {
    blocks_.pop_back();
    if (!nothing) root_tiles_.push_back({upper, value.get()});
    return;
  }
  uppers_.push_back({upper, solid});
}

// --- bytes --------------------------------------------------------------------------------------

std::string VdbWriter::root() const {
  std::string bytes;
  const auto put = [&](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  const auto put_value = [&](std::uint32_t value) {
    std::array<std::byte, 3 * sizeof(float)> of_value{};
    values_.put(value, of_value.data());
    bytes.append(reinterpret_cast<const char*>(of_value.data()), values_.value_bytes());
  };
  put(std::uint32_t{1});  // one buffer a leaf
  put_value(0);           // background
  put(static_cast<std::uint32_t>(root_tiles_.size()));
  put(static_cast<std::uint32_t>(uppers_.size()));
  for (const RootTile& tile : root_tiles_) {
    put(tile.index * kUpperVoxels);
    put_value(tile.value);
    put(std::uint8_t{1});  // active
  }
  return bytes;
}

// The origin, two masks of its slots and the values of its tiles.
void VdbWriter::make_head(const TreeBlock& block, Bytes& out) {
  const glm::ivec3 upper = uppers_[block.upper].index;
  const glm::ivec3 first = first_lower(upper), last = last_lower(upper);
  std::array<std::uint32_t, kUpperSlots / 32> child{}, active{};  // a word is a column along z
  std::vector<std::uint32_t> values;
  for (int x = first.x; x < last.x; ++x) {
    for (int y = first.y; y < last.y; ++y) {
      const LowerNode* nodes = lower_column(x, y);
      const std::size_t word = size(x - first.x) * kUpperLowers + size(y - first.y);
      for (int z = first.z; z < last.z; ++z) {
        const std::uint32_t bit = std::uint32_t{1} << (z - first.z);
        if (nodes[z].stored()) child[word] |= bit;
        if (!nodes[z].all_solid()) continue;
        active[word] |= bit;
        values.push_back(nodes[z].value.get());
      }
    }
  }
  const glm::ivec3 origin = upper * kUpperVoxels;
  const std::size_t solid = uppers_[block.upper].solid;
  out.resize(kHeadBytes + values_.bytes(solid));
  std::byte* to = out.data();
  std::memcpy(to, &origin, sizeof origin);
  std::memcpy(to += sizeof origin, child.data(), sizeof child);
  std::memcpy(to += sizeof child, active.data(), sizeof active);
  *(to += sizeof active) = std::byte{kActiveValuesOnly};
  values_.copy(solid, to + 1, values);
}

void VdbWriter::make_topology(const TreeBlock& block, Bytes& out) {
  const glm::ivec3 upper = uppers_[block.upper].index;
  const int z_begin = first_lower(upper).z, z_end = last_lower(upper).z;
  const LowerNode* nodes = lower_column(block.x, block.y);
  // A word is a leaf column: slot number and LeafColumnArray have the same order.
  std::array<std::uint16_t, kLeafColumns> child, active;
  std::size_t bytes = 0;
  for (int z = z_begin; z < z_end; ++z) {
    if (!nodes[z].stored()) continue;
    bytes += kLowerBytes + values_.bytes(nodes[z].solid) + nodes[z].leaves * sizeof(VdbLeaf);
  }
  out.resize(bytes);
  std::byte* to = out.data();
  const bool with_values = values_.numbers();
  std::vector<std::uint32_t> values;
  LeafColumnArray columns = leaf_columns(block.x, block.y, z_begin * kLowerLeaves);
  for (int z = z_begin; z < z_end; ++z) {
    const bool stored = nodes[z].stored();
    const int begin = z * kLowerLeaves, end = begin + kLowerLeaves;
    std::byte* head = to;
    if (stored) to += kLowerBytes + values_.bytes(nodes[z].solid);
    values.clear();
    // Also where nothing is stored, since the columns have to move on.
    for (std::size_t c = 0; c < kLeafColumns; ++c) {
      LeafColumn& column = columns[c];
      unsigned child_bits = 0, active_bits = 0;
      for (; column.run < column.run_end; ++column.run) {
        const VdbLeafTile::Run run = column.tile->runs[column.run];
        if (run.begin >= end) break;
        const int from = std::max<int>(run.begin, begin) - begin;
        const int past = std::min<int>(run.end, end) - begin;
        active_bits |= (1u << past) - (1u << from);
        if (with_values) {
          values.insert(values.end(), size(past - from), column.tile->run_values[column.run]);
        }
        if (run.end > end) break;  // goes on in the next node
      }
      const std::uint32_t first = column.leaf;
      for (; column.leaf < column.leaf_end; ++column.leaf) {
        const int leaf_z = column.tile->leaf_z[column.leaf];
        if (leaf_z >= end) break;
        child_bits |= 1u << (leaf_z - begin);
      }
      if (column.leaf > first) {
        const std::size_t length = (column.leaf - first) * sizeof(VdbLeaf);
        std::memcpy(to, column.tile->leaves.data() + first, length);
        to += length;
      }
      child[c] = static_cast<std::uint16_t>(child_bits);
      active[c] = static_cast<std::uint16_t>(active_bits);
    }
    if (!stored) continue;
    std::memcpy(head, child.data(), sizeof child);
    std::memcpy(head += sizeof child, active.data(), sizeof active);
    *(head += sizeof active) = std::byte{kActiveValuesOnly};
    values_.copy(nodes[z].solid, head + 1, values);
  }
}

void VdbWriter::make_buffers(const TreeBlock& block, Bytes& out) {
  const glm::ivec3 upper = uppers_[block.upper].index;
  const int z_begin = first_lower(upper).z, z_end = last_lower(upper).z;
  const LowerNode* nodes = lower_column(block.x, block.y);
  std::size_t leaves = 0;
  for (int z = z_begin; z < z_end; ++z) leaves += nodes[z].leaves;
  glm::ivec3 origin;
  const std::size_t largest =
      values_.numbers() ? sizeof(VdbLeaf) + 1 + values_.bytes(kLeafVoxels) : leaf_buffer_bytes();
  out.resize(leaves * largest);
  std::byte* to = out.data();
  LeafColumnArray columns = leaf_columns(block.x, block.y, z_begin * kLowerLeaves);
  for (int z = z_begin; z < z_end; ++z) {
    if (nodes[z].leaves == 0) continue;
    const int end = (z + 1) * kLowerLeaves;
    for (std::size_t c = 0; c < kLeafColumns; ++c) {
      LeafColumn& column = columns[c];
      origin.x = (block.x * kLowerLeaves + static_cast<int>(c) / kLowerLeaves) * 8;
      origin.y = (block.y * kLowerLeaves + static_cast<int>(c) % kLowerLeaves) * 8;
      for (; column.leaf < column.leaf_end; ++column.leaf) {
        const int leaf_z = column.tile->leaf_z[column.leaf];
        if (leaf_z >= end) break;
        const VdbLeaf& leaf = column.tile->leaves[column.leaf];
        std::memcpy(to, &leaf, sizeof leaf);
        to += sizeof leaf;
        if (values_.numbers()) {
          *to++ = std::byte{kActiveValuesOnly};
          const std::span<const std::byte> list = column.tile->leaf_values(column.leaf);
          std::memcpy(to, list.data(), list.size());
          to += list.size();
          continue;
        }
        origin.z = leaf_z * 8;
        std::memcpy(to, &origin, sizeof origin);
        to += sizeof origin;
        if (kind_ == VdbValues::kMask) continue;
        std::memcpy(to, &leaf, sizeof leaf);  // the values of a bool are bits, too
        to += sizeof leaf;
      }
    }
  }
  out.resize(static_cast<std::size_t>(to - out.data()));
}

VdbHeader VdbWriter::header(std::uint64_t topology_bytes) const {
  VdbHeader header;
  header.name = name_;
  header.grid = grid();
  header.frame = frame_;
  header.values = kind_;
  header.fog = fog_;
  std::uint64_t value_bytes = 0;
  header.lower = glm::ivec3(INT_MAX);
  header.upper = glm::ivec3(INT_MIN);
  for (const std::unique_ptr<VdbLeafTile>& tile : tiles_) {
    if (!tile) continue;
    header.voxels += tile->voxels;
    header.hash += tile->hash;
    value_bytes += tile->values.size();
    header.lower = glm::min(header.lower, tile->lower);
    header.upper = glm::max(header.upper, tile->upper);
  }
  header.topology_bytes = topology_bytes;
  header.buffers_bytes = values_.numbers() ? leaves_ * (sizeof(VdbLeaf) + 1) + value_bytes
                                           : leaves_ * leaf_buffer_bytes();
  return header;
}

Result<void> VdbWriter::finish_output(const Execution& execution) {
  builders_.clear();
  count(execution);
  lay_out();
  // What was skipped would be missing in the sizes below.
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "cancelled");

  const std::string tree_head = root();
  std::uint64_t topology_bytes = tree_head.size();
  for (const Upper& upper : uppers_) topology_bytes += kHeadBytes + values_.bytes(upper.solid);
  for (const LowerNode& node : lower_nodes_) {
    if (!node.stored()) continue;
    topology_bytes += kLowerBytes + values_.bytes(node.solid) + node.leaves * sizeof(VdbLeaf);
  }
  const auto make = [&](std::size_t index, Bytes& out, int) {
    const TreeBlock& block = blocks_[index];
    if (block.kind == TreeBlock::kHead) make_head(block, out);
    if (block.kind == TreeBlock::kTopology) make_topology(block, out);
    if (block.kind == TreeBlock::kBuffers) make_buffers(block, out);
  };
  return write_vdb_file(path(), header(topology_bytes), tree_head, blocks_.size(), make, output_,
                        execution);
}

}  // namespace

VoxelWriterResult open_vdb_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options) {
  // math/Maps.h: 3 * Tolerance<double>::value(). Such a file can be read, but not copied or scaled.
  constexpr double kLeastVolume = 3e-15;
  const glm::dvec3 s = grid.voxel_size;
  const double volume = s.x * s.y * s.z;
  if (!(volume >= kLeastVolume) || !std::isfinite(volume)) {
    return fail(ErrorCode::kUsage,
                "{}: voxels of {} x {} x {} have a volume of {:.3g}; OpenVDB takes 3e-15 to 1e308: "
                "scale the mesh, or write another format",
                path, s.x, s.y, s.z, volume);
  }
  if (options.band != 0) return open_level_set_writer(path, grid, options);
  Result<BlockOutput> output = BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  return std::make_unique<VdbWriter>(path, grid, options, std::move(*output));
}

}  // namespace strata
