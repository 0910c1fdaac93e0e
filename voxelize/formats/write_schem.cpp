// Sponge schematics, version 2 (github.com/SpongePowered/Schematic-Specification): NBT, big-endian,
// in gzip. In Minecraft y is up: z here is y there, and y here is minus z there, so that nothing is
// mirrored. Blocks are indices of a palette, a byte each since it has fewer than 128: x fastest,
// then z, then y.

#include <fmt/core.h>

#include <glm/vec3.hpp>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "voxelize/formats/minecraft_blocks.h"
#include "voxelize/output/block_output.h"
#include "voxelize/output/deflated_layers.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

constexpr std::int32_t kDataVersion = 2586;       // of Minecraft 1.16.5; later ones read it too
constexpr int kLongestSide = 65535;               // sides are unsigned 16-bit
constexpr std::int64_t kMostBlocks = 0x7fffffff;  // lengths of arrays are signed 32-bit
constexpr std::size_t kSchemSide = VoxelIntervals::kTileSide;

enum class Tag : char {
  kEnd = 0,
  kShort = 2,
  kInt = 3,
  kBytes = 7,
  kText = 8,
  kList = 9,
  kCompound = 10,
  kInts = 11
};

class NbtText {
 public:
  void begin(Tag tag, std::string_view name) {
    bytes_ += static_cast<char>(tag);
    put(name.size(), 2);
    bytes_ += name;
  }
  void put(std::uint64_t value, int count) {
    for (int i = count - 1; i >= 0; --i) bytes_ += static_cast<char>(value >> (8 * i) & 0xff);
  }
  void number(Tag tag, std::string_view name, int value) {
    begin(tag, name);
    put(static_cast<std::uint64_t>(value), tag == Tag::kShort ? 2 : 4);
  }
  void end() { bytes_ += static_cast<char>(Tag::kEnd); }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

VoxelWriterOptions as_ids() {
  VoxelWriterOptions options;
  options.ids = static_cast<std::uint32_t>(MinecraftBlocks::count());
  return options;
}

class SchemWriter final : public SlabWriter {
 public:
  SchemWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
              BlockOutput output)
      : SlabWriter(path, grid, Axis::kX),
        rgba_(options.rgba),
        values_(as_ids()),
        output_(std::move(output)),
        layers_(grid, values_) {}

  Result<void> begin() {
    NbtText nbt;
    nbt.begin(Tag::kCompound, "Schematic");
    nbt.number(Tag::kInt, "Version", 2);
    nbt.number(Tag::kInt, "DataVersion", kDataVersion);
    nbt.number(Tag::kShort, "Width", dims().x);
    nbt.number(Tag::kShort, "Height", dims().z);
    nbt.number(Tag::kShort, "Length", dims().y);
    nbt.begin(Tag::kInts, "Offset");
    nbt.put(3, 4);
    for (int i = 0; i < 3; ++i) nbt.put(0, 4);
    const std::size_t count = MinecraftBlocks::count();
    nbt.number(Tag::kInt, "PaletteMax", static_cast<int>(count) + 1);
    nbt.begin(Tag::kCompound, "Palette");
    nbt.number(Tag::kInt, "minecraft:air", 0);
    for (std::size_t i = 0; i < count; ++i) {
      nbt.number(Tag::kInt, fmt::format("minecraft:{}", MinecraftBlocks::name(i)),
                 static_cast<int>(i) + 1);
    }
    nbt.end();
    nbt.begin(Tag::kBytes, "BlockData");
    nbt.put(blocks(), 4);
    std::string head(DeflatedLayers::kGzipHead);
    append_stored(nbt.bytes(), head);
    return output_.append(head);
  }

 private:
  [[nodiscard]] std::uint64_t blocks() const {
    return static_cast<std::uint64_t>(dims().x) * static_cast<std::uint64_t>(dims().y) *
           static_cast<std::uint64_t>(dims().z);
  }

  // Bytes as they are: a stored block of DEFLATE (RFC 1951).
  void append_stored(std::string_view bytes, std::string& out) {
    const std::size_t length = bytes.size();  // far below 65536
    out += '\0';
    for (const std::size_t value : {length, ~length}) {
      out += static_cast<char>(value & 0xff);
      out += static_cast<char>(value >> 8 & 0xff);
    }
    out += bytes;
    crc_ = static_cast<std::uint32_t>(
        crc32_z(crc_, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
    bytes_ += bytes.size();
  }

  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    return layers_.append(turned(slab, execution), output_, crc_, execution);
  }

  /// Labels become blocks, and rows come in the opposite order.
  [[nodiscard]] VoxelIntervals turned(const VoxelIntervals& slab,
                                      const Execution& execution) const {
    VoxelIntervals result(slab.grid(), slab.axis(), slab.v_begin(), slab.v_end());
    const auto tiles_u = static_cast<std::size_t>(slab.tiles_u());
    const int columns = slab.columns();
    parallel_for(
        execution, tiles_u * static_cast<std::size_t>(slab.tiles_v()), [&](std::size_t tile, int) {
          const int tu = static_cast<int>(tile % tiles_u), tv = static_cast<int>(tile / tiles_u);
          std::vector<std::uint32_t> offsets{0}, labels;
          std::vector<Interval> items;
          for (std::size_t local = 0; local < VoxelIntervals::kTileColumns; ++local) {
            const int u = tu * VoxelIntervals::kTileSide + static_cast<int>(local % kSchemSide);
            const int v = slab.v_begin() + tv * VoxelIntervals::kTileSide +
                          static_cast<int>(local / kSchemSide);
            if (u < columns && v < slab.v_end()) {
              for_each_labelled(slab, columns - 1 - u, v,
                                [&](const Interval& interval, std::uint32_t label) {
                                  items.push_back(interval);
                                  labels.push_back(block_of(label));
                                });
            }
            offsets.push_back(static_cast<std::uint32_t>(items.size()));
          }
          if (!items.empty()) result.set_tile(tu, tv, offsets, items, labels);
        });
    return result;
  }
  [[nodiscard]] std::uint32_t block_of(std::uint32_t label) const {
    return 1 + (rgba_ ? static_cast<std::uint32_t>(blocks_.nearest(label)) : 0);
  }

  Result<void> finish_output(const Execution&) override {
    NbtText nbt;
    nbt.begin(Tag::kList, "BlockEntities");
    nbt.put(static_cast<std::uint64_t>(Tag::kCompound), 1);
    nbt.put(0, 4);
    nbt.end();
    bytes_ += blocks();
    std::string end;
    append_stored(nbt.bytes(), end);
    end += DeflatedLayers::gzip_end(crc_, bytes_);
    if (Result<void> written = output_.append(end); !written) return written;
    return output_.commit();
  }

  bool rgba_;
  DenseValues values_;
  MinecraftBlocks blocks_;
  BlockOutput output_;
  DeflatedLayers layers_;
  std::uint32_t crc_ = 0;
  std::uint64_t bytes_ = 0;  // before deflation
};

}  // namespace

VoxelWriterResult open_schem_writer(const std::string& path, const VoxelGrid& grid,
                                    const VoxelWriterOptions& options) {
  const glm::ivec3 dims = grid.dims;
  for (int axis = 0; axis < 3; ++axis) {
    if (dims[axis] <= kLongestSide) continue;
    return fail(ErrorCode::kUsage, "{}: {} voxels along {}; a .schem holds at most {}", path,
                dims[axis], "xyz"[axis], kLongestSide);
  }
  if (std::int64_t{dims.x} * dims.y * dims.z > kMostBlocks) {
    return fail(ErrorCode::kUsage, "{}: {} x {} x {} blocks; a .schem holds at most {}", path,
                dims.x, dims.y, dims.z, kMostBlocks);
  }
  Result<BlockOutput> output = BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  return begun(std::make_unique<SchemWriter>(path, grid, options, std::move(*output)));
}

}  // namespace strata
