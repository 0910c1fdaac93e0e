#include "voxelize/formats/vdb_leaves.h"

#include <zlib.h>

#include <algorithm>
#include <climits>
#include <cstring>
#include <utility>

#include "core/srgb.h"

namespace strata {
namespace {

static_assert(std::endian::native == std::endian::little, "VdbLeaf counts bytes from the low end");

constexpr int kSide = VoxelIntervals::kTileSide;
constexpr std::uint64_t kAll = ~std::uint64_t{0};
constexpr VdbLeaf kWhole{{kAll, kAll, kAll, kAll, kAll, kAll, kAll, kAll}};

// The finisher of splitmix64 (Steele, Lea, Flood, 2014).
constexpr std::uint64_t mix(std::uint64_t value) {
  value = (value ^ value >> 30) * 0xbf58476d1ce4e5b9u;
  value = (value ^ value >> 27) * 0x94d049bb133111ebu;
  return value ^ value >> 31;
}

}  // namespace

std::array<float, 3> VdbLeafBuilder::light_of(std::uint32_t value) {
  const std::array<float, 256>& light = linear_light();
  return {light[value & 0xff], light[value >> 8 & 0xff], light[value >> 16 & 0xff]};
}

VdbLeafBuilder::VdbLeafBuilder(int depth, std::uint32_t divisor, bool colours)
    : leaves_z_((depth + 7) / 8),
      divisor_(divisor),
      colours_(colours),
      // One more than leaves: an interval may cease at the very end.
      flips_(static_cast<std::size_t>(leaves_z_) + 1),
      has_flip_((flips_.size() + 7) / 8 * 8) {}

std::unique_ptr<VdbLeafTile> VdbLeafBuilder::build(const VoxelIntervals& slab, int tile_u,
                                                   int tile_v) {
  view_ = slab.tile(tile_u, tile_v);
  if (view_.items.empty()) return nullptr;
  leaves_.clear();
  leaf_z_.clear();
  runs_.clear();
  run_values_.clear();
  first_value_.assign(1, 0);
  values_.clear();
  hash_ = 0;

  auto tile = std::make_unique<VdbLeafTile>();
  set_bounds(view_, *tile);  // first, since it reads the items in order, so that they are near
  const int first_x = tile_u * (kSide / 8);
  const int first_y = slab.v_begin() / 8 + tile_v * (kSide / 8);
  for (int column = 0; column < VdbLeafTile::kLeafColumns; ++column) {
    const int x = column / 8, y = column % 8;
    const std::uint64_t place = static_cast<std::uint64_t>(first_x + x) << 32 |
                                static_cast<std::uint64_t>(first_y + y) << 16;
    first_run_ = runs_.size();
    collect_leaf_column(x, y);
    sweep_leaf_column(place);
    for (std::size_t i = first_run_; i < runs_.size(); ++i) {
      hash_ += mix(place + runs_[i].begin) * 3 + mix(place + runs_[i].end) * 5;
      if (divisor_ != 0) hash_ += mix(mix(place + runs_[i].begin) + run_values_[i]) * 7;
    }
    const auto next = static_cast<std::size_t>(column) + 1;
    tile->first_leaf[next] = static_cast<std::uint32_t>(leaves_.size());
    tile->first_run[next] = static_cast<std::uint32_t>(runs_.size());
  }
  // Copies, which take no more room than they need.
  tile->leaves = leaves_;
  tile->leaf_z = leaf_z_;
  tile->runs = runs_;
  if (divisor_ != 0) {
    tile->run_values = run_values_;
    tile->values.assign(values_.begin(), values_.end());
    tile->first_value = first_value_;
  }
  tile->hash = hash_;
  tile->lower += glm::ivec3(first_x * 8, first_y * 8, 0);
  tile->upper += glm::ivec3(first_x * 8, first_y * 8, 0);
  return tile;
}

// Counts the voxels and bounds them, relative to the corner of the tile.
void VdbLeafBuilder::set_bounds(const VoxelIntervals::TileView& view, VdbLeafTile& tile) {
  int first = INT_MAX, last = 0;
  for (const Interval& interval : view.items) {
    tile.voxels += static_cast<std::uint64_t>(interval.length());
    first = std::min<int>(first, interval.first);
    last = std::max<int>(last, interval.last);
  }
  tile.lower = glm::ivec3(INT_MAX, INT_MAX, first);
  tile.upper = glm::ivec3(0, 0, last);
  for (int y = 0; y < kSide; ++y) {
    const std::uint32_t* offsets = view.offsets.data() + y * kSide;
    if (offsets[0] == offsets[kSide]) continue;
    tile.lower.y = std::min(tile.lower.y, y);
    tile.upper.y = y;
    int left = 0, right = kSide - 1;
    while (offsets[left + 1] == offsets[0]) ++left;
    while (offsets[right] == offsets[kSide]) --right;
    tile.lower.x = std::min(tile.lower.x, left);
    tile.upper.x = std::max(tile.upper.x, right);
  }
}

// Enters the interval ends of 8 x 8 columns: at each end all voxels of its column from there on
// flip, which flips_ has for the leaf that the end lies in.
void VdbLeafBuilder::collect_leaf_column(int leaf_x, int leaf_y) {
  const Interval* const items = view_.items.data();
  VdbLeaf* const flips = flips_.data();
  std::uint8_t* const has_flip = has_flip_.data();
  for (int y = 0; y < 8; ++y) {
    const std::uint32_t* offsets = view_.offsets.data() + (leaf_y * 8 + y) * kSide + leaf_x * 8;
    for (int x = 0; x < 8; ++x) {
      const std::uint32_t begin = offsets[x], end = offsets[x + 1];
      if (divisor_ != 0) columns_[static_cast<std::size_t>(x * 8 + y)] = {begin, end};
      const auto flip_from = [&](int z) {
        const auto leaf = static_cast<std::size_t>(z) / 8;
        const std::uint64_t rest = 0xffu << z % 8 & 0xffu;
        flips[leaf].words[static_cast<std::size_t>(x)] ^= rest << (8 * y);
        has_flip[leaf] = 1;
      };
      for (std::uint32_t i = begin; i < end; ++i) {
        flip_from(items[i].begin());
        flip_from(items[i].end());
      }
    }
  }
}

// Walks up the flips of a leaf column; between two of them all leaves are alike.
void VdbLeafBuilder::sweep_leaf_column(std::uint64_t place) {
  VdbLeaf solid;  // each byte is 0 or 0xff: what its column is from here on
  bool any = false, all = false;
  int done = 0;
  for (std::size_t group = 0; group < has_flip_.size(); group += 8) {
    std::uint64_t marks;
    std::memcpy(&marks, has_flip_.data() + group, sizeof marks);
    if (marks == 0) continue;
    std::memset(has_flip_.data() + group, 0, sizeof marks);
    for (; marks != 0; marks &= marks - 1) {
      const int z = static_cast<int>(group) + std::countr_zero(marks) / 8;
      if (all) {
        put_whole(done, z, place);
      } else if (any) {
        for (; done < z; ++done) put_leaf(done, solid, place);
      }
      VdbLeaf leaf = std::exchange(flips_[static_cast<std::size_t>(z)], {});
      for (std::size_t i = 0; i < 8; ++i) {
        leaf.words[i] ^= solid.words[i];
        solid.words[i] = (leaf.words[i] >> 7 & 0x0101010101010101u) * 0xff;  // the last voxel's bit
      }
      if (leaf == kWhole) {
        put_whole(z, z + 1, place);
      } else if (leaf != VdbLeaf{}) {
        put_leaf(z, leaf, place);
      }
      any = solid != VdbLeaf{};
      all = solid == kWhole;
      done = z + 1;
    }
  }
}

// Leaves that are all solid, and alike: a run if they are of one value.
void VdbLeafBuilder::put_whole(int begin, int end, std::uint64_t place) {
  if (begin >= end) return;
  if (divisor_ == 0) return put_run(begin, end, 1);
  std::uint32_t first = 0;
  bool alike = true;
  for_each_value(begin, [&](std::uint32_t value, int) {
    if (first == 0) first = value;
    alike = alike && value == first;
  });
  if (alike) return put_run(begin, end, first);
  for (int z = begin; z < end; ++z) put_leaf(z, kWhole, place);
}

void VdbLeafBuilder::put_run(int begin, int end, std::uint32_t value) {
  const bool goes_on = runs_.size() > first_run_ && runs_.back().end == begin &&
                       (divisor_ == 0 || run_values_.back() == value);
  if (goes_on) {
    runs_.back().end = static_cast<std::uint16_t>(end);
    return;
  }
  runs_.push_back({static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(end)});
  if (divisor_ != 0) run_values_.push_back(value);
}

// Calls run(value, length) for the solid voxels of leaf z of the leaf column, in OpenVDB's order.
// The leaves have to be asked for from below, one of them as often as wanted.
template <class Run>
void VdbLeafBuilder::for_each_value(int z, Run&& run) {
  const int begin = z * 8, end = begin + 8;
  for (Column& column : columns_) {
    while (column.item < column.end && view_.items[column.item].end() <= begin) ++column.item;
    for (std::uint32_t i = column.item; i < column.end; ++i) {
      const Interval& item = view_.items[i];
      if (item.begin() >= end) break;
      run(value_of(view_.label(i)), std::min(end, item.end()) - std::max(begin, item.begin()));
    }
  }
}

// Appends the values of a leaf as OpenVDB has them, [bytes:64 | zlib stream], or minus the bytes
// and the values themselves where that is shorter. @return a hash of them
std::uint64_t VdbLeafBuilder::put_values(int z, std::size_t voxels) {
  const std::size_t begin = values_.size();
  values_.resize(begin + sizeof(std::int64_t));
  std::uint64_t hash = 0;
  append_zlib_stream(deflater_, values_, [&](RunDeflater& to) {
    for_each_value(z, [&](std::uint32_t value, int length) {
      to.run(value, static_cast<std::uint64_t>(length));
      hash = (hash ^ value) * 0x9e3779b97f4a7c15u + static_cast<std::uint64_t>(length);
    });
  });
  const std::size_t plain = voxels * sizeof(std::uint32_t);
  auto count = static_cast<std::int64_t>(values_.size() - begin - sizeof(std::int64_t));
  if (static_cast<std::size_t>(count) >= plain) {
    count = -static_cast<std::int64_t>(plain);
    values_.resize(begin + sizeof count + plain);
    std::byte* to = values_.data() + begin + sizeof count;
    for_each_value(z, [&](std::uint32_t value, int length) {
      for (int i = 0; i < length; ++i, to += sizeof value) std::memcpy(to, &value, sizeof value);
    });
  }
  std::memcpy(values_.data() + begin, &count, sizeof count);
  first_value_.push_back(static_cast<std::uint32_t>(values_.size()));
  return hash;
}

// The same of colours, three floats each. Those of a texture hardly compress, so they are packed
// only where they come in runs.
std::uint64_t VdbLeafBuilder::put_colours(int z, std::size_t voxels) {
  constexpr std::size_t kLongRuns = 4;
  std::uint64_t hash = 0;
  std::size_t runs = 0;
  lights_.clear();
  for_each_value(z, [&](std::uint32_t value, int length) {
    ++runs;
    lights_.insert(lights_.end(), static_cast<std::size_t>(length), light_of(value));
    hash = (hash ^ value) * 0x9e3779b97f4a7c15u + static_cast<std::uint64_t>(length);
  });
  const std::size_t begin = values_.size(), plain = lights_.size() * sizeof lights_[0];
  uLongf packed = compressBound(plain);
  values_.resize(begin + sizeof(std::int64_t) + std::max<std::size_t>(packed, plain));
  std::byte* to = values_.data() + begin + sizeof(std::int64_t);
  auto count = -static_cast<std::int64_t>(plain);
  const bool pack = runs * kLongRuns < voxels &&
                    compress2(reinterpret_cast<Bytef*>(to), &packed,
                              reinterpret_cast<const Bytef*>(lights_.data()), plain, 1) == Z_OK &&
                    packed < plain;
  if (pack) {
    count = static_cast<std::int64_t>(packed);
  } else {
    std::memcpy(to, lights_.data(), plain);
  }
  std::memcpy(values_.data() + begin, &count, sizeof count);
  values_.resize(begin + sizeof count + (pack ? packed : plain));
  first_value_.push_back(static_cast<std::uint32_t>(values_.size()));
  return hash;
}

void VdbLeafBuilder::put_leaf(int z, const VdbLeaf& leaf, std::uint64_t place) {
  leaves_.push_back(leaf);
  leaf_z_.push_back(static_cast<std::uint16_t>(z));
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    // Odd factors, one a word, so that swapped words differ.
    sum += (leaf.words[i] ^ leaf.words[i] >> 32) * (0x9e3779b97f4a7c15u + 2 * i);
  }
  if (divisor_ != 0) {
    const auto voxels = static_cast<std::size_t>(leaf.count());
    sum += colours_ ? put_colours(z, voxels) : put_values(z, voxels);
  }
  hash_ += mix(sum ^ mix(place + static_cast<std::uint64_t>(z)));
}

}  // namespace strata
