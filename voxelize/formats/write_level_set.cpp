// OpenVDB level sets: a FloatGrid of signed distances, of the class "level set", whose background
// is half the width of the band in world units.
//
// The tree is that of write_vdb.cpp, and so is the order of its parts. Voxels in the band are
// active; the others are +background or -background, as single voxels of leaves and as tiles, which
// are not active. One byte, and a mask where both occur, says which (io/Compression.h of OpenVDB
// 10.0). Active values stand as they are: floats of distances hardly shrink, and programs read them
// faster.

#include <algorithm>
#include <array>
#include <bit>
#include <climits>
#include <cmath>
#include <cstring>
#include <glm/common.hpp>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "voxelize/formats/level_set.h"
#include "voxelize/formats/vdb_header.h"
#include "voxelize/output/block_output.h"

namespace strata {
namespace {

constexpr int kLeafSide = ScalarField::kBlockSide;
constexpr std::size_t kLeafWords = 8, kLowerWords = 64, kUpperWords = 512;

std::size_t count_of(int value) { return static_cast<std::size_t>(value); }

/// Bits of a node's slots, as OpenVDB has them: z fastest, bit 0 of word 0 first.
template <std::size_t words>
struct SlotMask {
  std::array<std::uint64_t, words> bits{};

  void set(std::size_t slot) { bits[slot / 64] |= std::uint64_t{1} << slot % 64; }
  [[nodiscard]] bool test(std::size_t slot) const {
    return (bits[slot / 64] >> slot % 64 & 1) != 0;
  }
  [[nodiscard]] std::size_t count() const {
    std::size_t sum = 0;
    for (const std::uint64_t word : bits) sum += count_of(std::popcount(word));
    return sum;
  }
};

/// What the inactive slots of a node are.
enum class Inactive : std::uint8_t { kOutside = 0, kInside = 1, kBoth = 3 };

Inactive inactive_of(std::size_t inside, std::size_t outside) {
  return inside == 0 ? Inactive::kOutside : outside == 0 ? Inactive::kInside : Inactive::kBoth;
}

struct Leaf {
  std::uint16_t slot = 0;  // of its lower node
  Inactive inactive = Inactive::kOutside;
  std::uint32_t first = 0;  // of its values in the part
  SlotMask<kLeafWords> active, outside;
};

/// The leaves of a lower node that came at once.
struct Part {
  std::vector<Leaf> leaves;
  std::vector<float> values;  // of active voxels
};

struct Lower {
  std::vector<Part> parts;
  SlotMask<kLowerWords> inside;  // tiles

  [[nodiscard]] std::size_t leaves() const {
    std::size_t sum = 0;
    for (const Part& part : parts) sum += part.leaves.size();
    return sum;
  }
  [[nodiscard]] Inactive inactive() const {
    const std::size_t tiles = inside.count();
    return inactive_of(tiles, kLowerWords * 64 - tiles - leaves());
  }
  [[nodiscard]] bool all_inside() const { return inside.count() == kLowerWords * 64; }
};

std::uint64_t mix_bits(std::uint64_t value) {
  value = (value ^ value >> 31) * 0x9e3779b97f4a7c15u;
  return value ^ value >> 29;
}

/// What is known of all leaves together.
struct Totals {
  std::uint64_t voxels = 0, hash = 0;
  glm::ivec3 lower{INT_MAX}, upper{INT_MIN};

  void add(const Totals& other) {
    voxels += other.voxels, hash += other.hash;
    lower = glm::min(lower, other.lower), upper = glm::max(upper, other.upper);
  }
};

class LevelSetWriter final : public VoxelWriter {
 public:
  LevelSetWriter(std::string path, const VoxelGrid& grid, const VoxelWriterOptions& options,
                 BlockOutput output)
      : path_(std::move(path)),
        grid_(grid),
        band_(options.band),
        name_(options.name),
        frame_(options.frame),
        output_(std::move(output)),
        lower_dims_((grid.dims + kLowerVoxels - 1) / kLowerVoxels),
        lowers_(count_of(lower_dims_.x) * count_of(lower_dims_.y) * count_of(lower_dims_.z)) {}

  Result<void> add(const VoxelIntervals&, const Execution&) override {
    return fail(ErrorCode::kInternal, "{}: a level set takes distances", path_);
  }
  Result<void> add_distances(const ScalarField& layers, int z_begin,
                             const Execution& execution) override;
  Result<void> finish(const Execution& execution) override;

 private:
  /// A stored upper node, and what its slots without a child are.
  struct Upper {
    glm::ivec3 index{0};  // in upper nodes of the grid
    SlotMask<kUpperWords> child, inside;
    Inactive inactive = Inactive::kOutside;
  };
  /// A piece of the file that one thread makes.
  struct Piece {
    enum Kind { kHead, kTopology, kBuffers } kind = kHead;
    std::size_t index = 0;  // of the upper node or of the lower one
  };

  [[nodiscard]] std::size_t lower_index(const glm::ivec3& at) const {
    return (count_of(at.x) * count_of(lower_dims_.y) + count_of(at.y)) * count_of(lower_dims_.z) +
           count_of(at.z);
  }
  void add_lower(const ScalarField& layers, int z_begin, const glm::ivec3& at);
  void add_leaf(const ScalarField::Block& block, const glm::ivec3& leaf, Part& part);
  Result<void> write(const Execution& execution);
  void lay_out_upper(const glm::ivec3& at);
  [[nodiscard]] std::string root() const;
  [[nodiscard]] std::uint64_t topology_bytes() const;
  [[nodiscard]] std::uint64_t buffers_bytes() const;
  static void make_head(const Upper& upper, Bytes& out);
  static void make_topology(const Lower& lower, Bytes& out);
  static void make_buffers(const Lower& lower, Bytes& out);

  std::string path_;
  VoxelGrid grid_;
  float band_;
  std::string name_;
  GridFrame frame_;
  BlockOutput output_;
  glm::ivec3 lower_dims_;                       // lower nodes along x, y, z
  std::vector<std::unique_ptr<Lower>> lowers_;  // null: all outside
  std::vector<Totals> totals_;                  // by column of lower nodes
  std::vector<Upper> uppers_;
  std::vector<glm::ivec3> inside_uppers_;
  std::vector<Piece> pieces_;
  int next_layer_ = 0;
  bool done_ = false;
};

// --- leaves -------------------------------------------------------------------------------------

Result<void> LevelSetWriter::add_distances(const ScalarField& layers, int z_begin,
                                           const Execution& execution) {
  const glm::ivec3 dims = layers.dims();
  const bool fits = !done_ && z_begin == next_layer_ && z_begin % kLeafSide == 0 &&
                    dims.x == grid_.dims.x && dims.y == grid_.dims.y &&
                    z_begin + dims.z <= grid_.dims.z &&
                    (dims.z % kLeafSide == 0 || z_begin + dims.z == grid_.dims.z);
  if (!fits) {
    return fail(ErrorCode::kInternal, "{}: layers {} to {} came, layer {} was expected", path_,
                z_begin, z_begin + dims.z - 1, next_layer_);
  }
  done_ = true;  // until it has succeeded
  const int first = z_begin / kLowerVoxels, last = (z_begin + dims.z - 1) / kLowerVoxels;
  const std::size_t columns = count_of(lower_dims_.x) * count_of(lower_dims_.y);
  totals_.resize(columns);
  try {
    parallel_for(execution, columns, [&](std::size_t column, int) {
      const int x = static_cast<int>(column) / lower_dims_.y;
      const int y = static_cast<int>(column) % lower_dims_.y;
      for (int z = first; z <= last; ++z) add_lower(layers, z_begin, {x, y, z});
    });
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory while writing", path_);
  }
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "cancelled");
  next_layer_ = z_begin + dims.z;
  done_ = false;
  return {};
}

void LevelSetWriter::add_lower(const ScalarField& layers, int z_begin, const glm::ivec3& at) {
  const int shift = z_begin / kLeafSide;
  const glm::ivec3 blocks = layers.blocks();
  const glm::ivec3 first = at * kLowerLeaves;
  const glm::ivec3 last = glm::min(first + kLowerLeaves, blocks + glm::ivec3(0, 0, shift));
  std::unique_ptr<Lower>& lower = lowers_[lower_index(at)];
  Part part;
  for (int x = first.x; x < last.x; ++x) {
    for (int y = first.y; y < last.y; ++y) {
      for (int z = std::max(first.z, shift); z < last.z;) {
        const ScalarField::Block block = layers.block(x, y, z - shift);
        if (block.values == nullptr && block.constant >= band_) {
          z += layers.equal_blocks_along_z(x, y, z - shift);
          continue;
        }
        if (!lower) lower = std::make_unique<Lower>();
        const glm::ivec3 leaf(x, y, z++);
        const bool whole = glm::min((leaf + 1) * kLeafSide, grid_.dims) == (leaf + 1) * kLeafSide;
        if (block.values == nullptr && block.constant <= -band_ && whole) {
          const glm::ivec3 in = leaf - first;
          lower->inside.set(count_of((in.x * kLowerLeaves + in.y) * kLowerLeaves + in.z));
        } else {
          add_leaf(block, leaf, part);
        }
      }
    }
  }
  if (part.leaves.empty()) return;
  part.leaves.shrink_to_fit();
  part.values.shrink_to_fit();
  lower->parts.push_back(std::move(part));
}

void LevelSetWriter::add_leaf(const ScalarField::Block& block, const glm::ivec3& at, Part& part) {
  const glm::ivec3 origin = at * kLeafSide;
  const glm::ivec3 in = at - at / kLowerLeaves * kLowerLeaves;
  const glm::ivec3 extent = glm::min(glm::ivec3(kLeafSide), grid_.dims - origin);
  Leaf leaf;
  leaf.slot = static_cast<std::uint16_t>((in.x * kLowerLeaves + in.y) * kLowerLeaves + in.z);
  leaf.first = static_cast<std::uint32_t>(part.values.size());
  const std::uint64_t z_bits =
      (std::uint64_t{0xff} >> (kLeafSide - extent.z)) * 0x0101010101010101u;
  const std::uint64_t in_grid = z_bits & ~std::uint64_t{0} >> (64 - 8 * extent.y);
  Totals found;
  for (int x = 0; x < kLeafSide; ++x) {
    const float* values = block.values == nullptr ? nullptr : block.values + 64 * x;
    std::uint64_t active = 0, outside = 0;
    for (int i = 0; i < 64; ++i) {
      const float value = values == nullptr ? block.constant : values[i];
      active |= std::uint64_t{value > -band_ && value < band_} << i;
      outside |= std::uint64_t{value >= band_} << i;
    }
    const std::uint64_t there = x < extent.x ? in_grid : 0;
    active &= there;
    outside = (outside & there) | ~there;
    leaf.active.bits[count_of(x)] = active;
    leaf.outside.bits[count_of(x)] = outside;
    if (active == 0) continue;
    for (std::uint64_t left = active; left != 0; left &= left - 1) {
      const float value = values == nullptr ? block.constant : values[std::countr_zero(left)];
      part.values.push_back(value);
      found.hash = mix_bits(found.hash + std::bit_cast<std::uint32_t>(value));
    }
    std::uint64_t z_any = active | active >> 32;
    z_any |= z_any >> 16, z_any |= z_any >> 8;
    const auto z_byte = static_cast<std::uint32_t>(z_any & 0xff);
    const glm::ivec3 low(x, std::countr_zero(active) / 8, std::countr_zero(z_byte));
    const glm::ivec3 high(x, 7 - std::countl_zero(active) / 8, std::bit_width(z_byte) - 1);
    found.lower = glm::min(found.lower, origin + low);
    found.upper = glm::max(found.upper, origin + high);
  }
  const std::size_t outside = leaf.outside.count(), active = leaf.active.count();
  leaf.inactive = inactive_of(512 - outside - active, outside);
  found.voxels = active;
  const auto place = static_cast<std::uint64_t>(at.x) << 32 | static_cast<std::uint64_t>(at.y)
                                                                  << 16;
  found.hash = mix_bits(found.hash ^ mix_bits(place + static_cast<std::uint64_t>(at.z)));
  for (std::size_t i = 0; i < kLeafWords; ++i) {
    found.hash = mix_bits(found.hash + (leaf.active.bits[i] ^ leaf.outside.bits[i] * 3));
  }
  totals_[count_of(at.x / kLowerLeaves) * count_of(lower_dims_.y) + count_of(at.y / kLowerLeaves)]
      .add(found);
  part.leaves.push_back(leaf);
}

// --- layout -------------------------------------------------------------------------------------

void LevelSetWriter::lay_out_upper(const glm::ivec3& at) {
  const glm::ivec3 first = at * kUpperLowers;
  const glm::ivec3 last = glm::min(first + kUpperLowers, lower_dims_);
  Upper upper;
  upper.index = at;
  const std::size_t before = pieces_.size();
  pieces_.push_back({Piece::kHead, uppers_.size()});
  std::size_t inside = 0;
  for (int x = first.x; x < last.x; ++x) {
    for (int y = first.y; y < last.y; ++y) {
      for (int z = first.z; z < last.z; ++z) {
        const std::size_t index = lower_index({x, y, z});
        if (!lowers_[index]) continue;
        const glm::ivec3 in = glm::ivec3(x, y, z) - first;
        const std::size_t slot = count_of((in.x * kUpperLowers + in.y) * kUpperLowers + in.z);
        if (lowers_[index]->all_inside()) {
          upper.inside.set(slot);
          ++inside;
        } else {
          upper.child.set(slot);
          pieces_.push_back({Piece::kTopology, index});
        }
      }
    }
  }
  const std::size_t children = pieces_.size() - before - 1;
  if (children == 0 && (inside == 0 || inside == kUpperWords * 64)) {
    pieces_.pop_back();
    if (inside != 0) inside_uppers_.push_back(at);
    return;
  }
  upper.inactive = inactive_of(inside, kUpperWords * 64 - inside - children);
  uppers_.push_back(upper);
}

std::string LevelSetWriter::root() const {
  std::string bytes;
  const auto put = [&](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  put(std::uint32_t{1});  // one buffer a leaf
  put(band_);             // background
  put(static_cast<std::uint32_t>(inside_uppers_.size()));
  put(static_cast<std::uint32_t>(uppers_.size()));
  for (const glm::ivec3& at : inside_uppers_) {
    put(at * kUpperVoxels);
    put(-band_);
    put(std::uint8_t{0});  // not active
  }
  return bytes;
}

template <class Mask>
std::size_t inactive_bytes(Inactive inactive, const Mask& mask) {
  return 1 + (inactive == Inactive::kBoth ? sizeof mask : 0);
}

std::uint64_t LevelSetWriter::topology_bytes() const {
  std::uint64_t bytes = 0;
  for (const Piece& piece : pieces_) {
    if (piece.kind == Piece::kHead) {
      const Upper& upper = uppers_[piece.index];
      bytes += sizeof(glm::ivec3) + 2 * sizeof upper.child +
               inactive_bytes(upper.inactive, upper.inside);
    } else if (piece.kind == Piece::kTopology) {
      const Lower& lower = *lowers_[piece.index];
      bytes += 2 * sizeof lower.inside + inactive_bytes(lower.inactive(), lower.inside) +
               lower.leaves() * sizeof(Leaf::active);
    }
  }
  return bytes;
}

std::uint64_t LevelSetWriter::buffers_bytes() const {
  std::uint64_t bytes = 0;
  for (const std::unique_ptr<Lower>& lower : lowers_) {
    if (!lower) continue;
    for (const Part& part : lower->parts) {
      for (const Leaf& leaf : part.leaves) {
        bytes += sizeof leaf.active + inactive_bytes(leaf.inactive, leaf.outside);
      }
      bytes += part.values.size() * sizeof(float);
    }
  }
  return bytes;
}

// --- bytes --------------------------------------------------------------------------------------

std::byte* put_bytes(std::byte* to, const void* from, std::size_t bytes) {
  std::memcpy(to, from, bytes);
  return to + bytes;
}

/// What inactive slots are; bits of `outside` are those of +background.
template <class Mask>
std::byte* put_inactive(std::byte* to, Inactive inactive, const Mask& outside) {
  *to++ = static_cast<std::byte>(inactive);
  return inactive == Inactive::kBoth ? put_bytes(to, &outside, sizeof outside) : to;
}

/// Slots that are neither children nor inside.
template <class Mask>
Mask neither(const Mask& child, const Mask& inside) {
  Mask result;
  for (std::size_t i = 0; i < result.bits.size(); ++i) {
    result.bits[i] = ~(child.bits[i] | inside.bits[i]);
  }
  return result;
}

void LevelSetWriter::make_head(const Upper& upper, Bytes& out) {
  const glm::ivec3 origin = upper.index * kUpperVoxels;
  const SlotMask<kUpperWords> active;
  out.resize(sizeof origin + 2 * sizeof active + inactive_bytes(upper.inactive, active));
  std::byte* to = put_bytes(out.data(), &origin, sizeof origin);
  to = put_bytes(to, &upper.child, sizeof upper.child);
  to = put_bytes(to, &active, sizeof active);
  put_inactive(to, upper.inactive, neither(upper.child, upper.inside));
}

/// The leaves of a lower node in the order of their slots, with their values.
template <class Visit>
void for_each_leaf(const Lower& lower, Visit&& visit) {
  std::array<std::pair<const Part*, const Leaf*>, kLowerWords * 64> leaves{};
  for (const Part& part : lower.parts) {
    for (const Leaf& leaf : part.leaves) leaves[leaf.slot] = {&part, &leaf};
  }
  for (const auto& [part, leaf] : leaves) {
    if (leaf != nullptr) visit(*leaf, part->values.data() + leaf->first);
  }
}

void LevelSetWriter::make_topology(const Lower& lower, Bytes& out) {
  SlotMask<kLowerWords> child;
  const SlotMask<kLowerWords> active;
  const Inactive inactive = lower.inactive();
  out.resize(2 * sizeof active + inactive_bytes(inactive, active) +
             lower.leaves() * sizeof(Leaf::active));
  std::byte* to = out.data() + 2 * sizeof active + inactive_bytes(inactive, active);
  for_each_leaf(lower, [&](const Leaf& leaf, const float*) {
    child.set(leaf.slot);
    to = put_bytes(to, &leaf.active, sizeof leaf.active);
  });
  to = put_bytes(out.data(), &child, sizeof child);
  to = put_bytes(to, &active, sizeof active);
  put_inactive(to, inactive, neither(child, lower.inside));
}

void LevelSetWriter::make_buffers(const Lower& lower, Bytes& out) {
  std::size_t bytes = lower.leaves() * (2 * sizeof(Leaf::active) + 1);
  for (const Part& part : lower.parts) bytes += part.values.size() * sizeof(float);
  out.resize(bytes);
  std::byte* to = out.data();
  for_each_leaf(lower, [&](const Leaf& leaf, const float* values) {
    to = put_bytes(to, &leaf.active, sizeof leaf.active);
    to = put_inactive(to, leaf.inactive, leaf.outside);
    to = put_bytes(to, values, leaf.active.count() * sizeof(float));
  });
  out.resize(count_of(static_cast<int>(to - out.data())));
}

Result<void> LevelSetWriter::write(const Execution& execution) {
  // The root is a sorted map of coordinates: x slowest.
  const glm::ivec3 uppers = (lower_dims_ + kUpperLowers - 1) / kUpperLowers;
  for (int x = 0; x < uppers.x; ++x) {
    for (int y = 0; y < uppers.y; ++y) {
      for (int z = 0; z < uppers.z; ++z) lay_out_upper({x, y, z});
    }
  }
  // All topology stands before all buffers.
  const std::size_t topology = pieces_.size();
  for (std::size_t i = 0; i < topology; ++i) {
    if (pieces_[i].kind == Piece::kTopology) pieces_.push_back({Piece::kBuffers, pieces_[i].index});
  }
  Totals totals;
  for (const Totals& column : totals_) totals.add(column);
  for (std::size_t i = 0; i < lowers_.size(); ++i) {
    if (!lowers_[i]) continue;
    for (const std::uint64_t word : lowers_[i]->inside.bits) {
      totals.hash += mix_bits(word + mix_bits(i));
    }
  }
  const std::string tree_head = root();
  VdbHeader header;
  header.name = name_;
  header.grid = grid_;
  header.frame = frame_;
  header.values = VdbValues::kFloat;
  header.level_set = true;
  header.voxels = totals.voxels;
  header.lower = totals.lower, header.upper = totals.upper;
  header.hash = totals.hash;
  header.topology_bytes = tree_head.size() + topology_bytes();
  header.buffers_bytes = buffers_bytes();
  const auto make = [&](std::size_t index, Bytes& out, int) {
    const Piece& piece = pieces_[index];
    if (piece.kind == Piece::kHead) make_head(uppers_[piece.index], out);
    if (piece.kind == Piece::kTopology) make_topology(*lowers_[piece.index], out);
    if (piece.kind == Piece::kBuffers) make_buffers(*lowers_[piece.index], out);
  };
  return write_vdb_file(path_, header, tree_head, pieces_.size(), make, output_, execution);
}

Result<void> LevelSetWriter::finish(const Execution& execution) {
  if (done_ || next_layer_ != grid_.dims.z) {
    return fail(ErrorCode::kInternal, "{}: {} of {} layers were written", path_, next_layer_,
                grid_.dims.z);
  }
  done_ = true;
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "cancelled");
  try {
    return write(execution);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory while writing", path_);
  }
}

}  // namespace

VoxelWriterResult open_level_set_writer(const std::string& path, const VoxelGrid& grid,
                                        const VoxelWriterOptions& options) {
  const glm::dvec3 s = grid.voxel_size;
  if (s.x != s.y || s.y != s.z) {
    return fail(ErrorCode::kUsage,
                "{}: an OpenVDB level set needs voxels that are cubes, got {} x {} x {}; write "
                "another format, or give --voxel-size one number",
                path, s.x, s.y, s.z);
  }
  if (!(options.band > 0) || !std::isfinite(options.band)) {
    return fail(ErrorCode::kUsage, "{}: the band of a level set must be above 0 and finite, got {}",
                path, options.band);
  }
  auto output = BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  return std::make_unique<LevelSetWriter>(path, grid, options, std::move(*output));
}

}  // namespace strata
