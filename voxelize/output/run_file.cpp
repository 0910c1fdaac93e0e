#include "voxelize/output/run_file.h"

#include <sys/stat.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>
#include <string_view>
#include <utility>

#include "voxelize/output/block_output.h"
#include "voxelize/output/slab_writer.h"

namespace strata {
namespace {

constexpr std::string_view kRunFileTitle = "strata runs 1\n";
constexpr int kRunTile = VoxelIntervals::kTileSide;
constexpr std::size_t kRunHeadBytes = 4 * sizeof(std::uint32_t) + sizeof(std::uint64_t);

/// What stands before a tile, and at the end.
void put_run_head(const std::uint32_t (&words)[4], std::uint64_t bytes, std::byte* to) {
  std::memcpy(to, words, sizeof words);
  std::memcpy(to + sizeof words, &bytes, sizeof bytes);
}

class RunWriter final : public SlabWriter {
 public:
  RunWriter(const std::string& path, const VoxelGrid& grid, Axis axis, BlockOutput output)
      : SlabWriter(path, grid, axis, false, true), output_(std::move(output)) {}

  Result<void> begin() { return output_.append(kRunFileTitle); }

 private:
  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    const auto count =
        static_cast<std::size_t>(slab.tiles_u()) * static_cast<std::size_t>(slab.tiles_v());
    for (std::size_t i = 0; i < count; ++i) {
      const auto tile_u = static_cast<std::size_t>(slab.tiles_u());
      tiles_ += slab.tile_empty(static_cast<int>(i % tile_u), static_cast<int>(i / tile_u)) ? 0 : 1;
    }
    return output_.append_blocks(execution, count, [&](std::size_t index, Bytes& out, int) {
      const int tu = static_cast<int>(index) % slab.tiles_u();
      const int tv = static_cast<int>(index) / slab.tiles_u();
      pack(slab, tu, tv, out);
    });
  }

  static void pack(const VoxelIntervals& slab, int tu, int tv, Bytes& out) {
    const VoxelIntervals::TileView tile = slab.tile(tu, tv);
    out.clear();
    if (tile.items.empty()) return;
    std::vector<std::uint32_t> counts(VoxelIntervals::kTileColumns);
    for (std::size_t i = 0; i < counts.size(); ++i) {
      counts[i] = tile.offsets[i + 1] - tile.offsets[i];
    }
    const std::size_t counted = counts.size() * sizeof counts[0];
    std::vector<unsigned char> bytes(counted + tile.items.size_bytes() + tile.labels.size_bytes());
    std::memcpy(bytes.data(), counts.data(), counted);
    std::memcpy(bytes.data() + counted, tile.items.data(), tile.items.size_bytes());
    if (!tile.labels.empty()) {
      std::memcpy(bytes.data() + counted + tile.items.size_bytes(), tile.labels.data(),
                  tile.labels.size_bytes());
    }
    uLongf packed = compressBound(bytes.size());
    out.resize(kRunHeadBytes + packed);
    // It fails only where memory runs out, as vectors do.
    if (compress2(reinterpret_cast<Bytef*>(out.data() + kRunHeadBytes), &packed, bytes.data(),
                  bytes.size(), Z_BEST_SPEED) != Z_OK) {
      throw std::bad_alloc();
    }
    out.resize(kRunHeadBytes + packed);
    const auto v = static_cast<std::uint32_t>(slab.v_begin() / kRunTile + tv);
    put_run_head({static_cast<std::uint32_t>(tu), v, tile.labels.empty() ? 0u : 1u,
                  static_cast<std::uint32_t>(packed)},
                 bytes.size(), out.data());
  }

  Result<void> finish_output(const Execution&) override {
    constexpr std::uint32_t kEnd = ~std::uint32_t{0};
    std::byte end[kRunHeadBytes];
    put_run_head({kEnd, kEnd, 0, 0}, tiles_, end);
    if (auto written = output_.append(end, sizeof end); !written) return written;
    return output_.commit();
  }

  BlockOutput output_;
  std::uint64_t tiles_ = 0;
};

}  // namespace

VoxelWriterResult open_run_writer(const std::string& path, const VoxelGrid& grid, Axis axis) {
  Result<BlockOutput> output = BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  auto writer = std::make_unique<RunWriter>(path, grid, axis, std::move(*output));
  if (Result<void> begun = writer->begin(); !begun) return tl::unexpected(begun.error());
  return writer;
}

tl::unexpected<Error> RunFileReader::damaged(std::string_view what) const {
  return fail(ErrorCode::kInput, "{}: damaged at tile {}: {}", path_, tiles_, what);
}

Result<RunFileReader> RunFileReader::open(const std::string& path, const VoxelGrid& grid, Axis axis,
                                          const VoxelRows& rows, std::uint32_t largest_label) {
  RunFileReader reader;
  reader.path_ = path;
  reader.grid_ = grid;
  reader.axis_ = axis;
  reader.next_ = rows.begin;
  reader.end_ = rows.end;
  reader.largest_label_ = largest_label;
  struct stat status {};
  if (stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode)) {
    return fail(ErrorCode::kInput, "{}: it is no regular file", path);
  }
  reader.file_.reset(std::fopen(path.c_str(), "rbe"));
  if (!reader.file_ || fstat(fileno(reader.file_.get()), &status) != 0) {
    return fail(ErrorCode::kInput, "{}: cannot read: {}", path, std::strerror(errno));
  }
  reader.left_ = static_cast<std::uint64_t>(status.st_size);
  char title[kRunFileTitle.size()];
  if (std::fread(title, 1, sizeof title, reader.file_.get()) != sizeof title ||
      std::string_view(title, sizeof title) != kRunFileTitle) {
    return fail(ErrorCode::kInput, "{}: it is no file of runs of a shard", path);
  }
  reader.left_ -= sizeof title;
  if (auto read = reader.next_head(); !read) return tl::unexpected(read.error());
  return reader;
}

Result<void> RunFileReader::next_head() {
  unsigned char bytes[kRunHeadBytes];
  if (std::fread(bytes, 1, sizeof bytes, file_.get()) != sizeof bytes) {
    return damaged("the file ends too early");
  }
  left_ -= sizeof bytes;
  const Head before = head_;
  std::uint32_t words[4];
  std::memcpy(words, bytes, sizeof words);
  head_ = {words[0], words[1], words[2], words[3], 0};
  std::memcpy(&head_.bytes, bytes + sizeof words, sizeof head_.bytes);
  if (at_end()) {
    if (head_.bytes != tiles_ || left_ != 0) return damaged("the end is not where it should be");
    return {};
  }
  const AxisFrame frame(axis_);
  const auto tiles_u = static_cast<std::uint32_t>((grid_.dims[frame.u] + kRunTile - 1) / kRunTile);
  const auto first = static_cast<std::uint32_t>(next_ / kRunTile);
  const auto last = static_cast<std::uint32_t>((end_ + kRunTile - 1) / kRunTile);
  const bool follows = tiles_ == 0 || std::pair(before.v, before.u) < std::pair(head_.v, head_.u);
  if (head_.u >= tiles_u || head_.v < first || head_.v >= last || !follows) {
    return damaged("a tile is not where it should be");
  }
  // A column has at most as many runs as voxels, and zlib packs at most to a thousandth.
  const std::uint64_t most =
      VoxelIntervals::kTileColumns * (4 + static_cast<std::uint64_t>(grid_.dims[frame.w]) * 8);
  if (head_.labelled > 1 || head_.packed > left_ || head_.bytes > most ||
      head_.bytes > std::uint64_t{head_.packed} * 1100) {
    return damaged("its size cannot be");
  }
  return {};
}

Result<void> RunFileReader::read_tile(VoxelIntervals& slab) {
  constexpr std::size_t kColumns = VoxelIntervals::kTileColumns;
  packed_.resize(head_.packed);
  bytes_.resize(head_.bytes);
  if (std::fread(packed_.data(), 1, packed_.size(), file_.get()) != packed_.size()) {
    return damaged("the file ends too early");
  }
  left_ -= packed_.size();
  uLongf unpacked = bytes_.size();
  const std::size_t counted = kColumns * sizeof(std::uint32_t);
  const std::size_t run_bytes = sizeof(Interval) + (head_.labelled != 0 ? 4 : 0);
  if (uncompress(bytes_.data(), &unpacked, packed_.data(), packed_.size()) != Z_OK ||
      unpacked != bytes_.size() || unpacked <= counted || (unpacked - counted) % run_bytes != 0) {
    return damaged("the packed data are wrong");
  }
  std::vector<std::uint32_t> counts(kColumns);
  std::memcpy(counts.data(), bytes_.data(), counted);
  std::vector<Interval> items((unpacked - counted) / run_bytes);
  std::memcpy(items.data(), bytes_.data() + counted, items.size() * sizeof(Interval));
  std::vector<std::uint32_t> labels(head_.labelled != 0 ? items.size() : 0);
  if (!labels.empty()) {
    std::memcpy(labels.data(), bytes_.data() + counted + items.size() * sizeof(Interval),
                labels.size() * sizeof labels[0]);
  }
  const AxisFrame frame(axis_);
  const int tu = static_cast<int>(head_.u), tv = static_cast<int>(head_.v);
  std::vector<std::uint32_t> offsets(1, 0);
  for (std::size_t column = 0; column < kColumns; ++column) {
    const std::size_t first = offsets.back(), past = first + counts[column];
    const int u = tu * kRunTile + static_cast<int>(column) % kRunTile;
    const int v = tv * kRunTile + static_cast<int>(column) / kRunTile;
    const bool inside = u < grid_.dims[frame.u] && v < slab.v_end();
    if (past > items.size() || (past > first && !inside)) return damaged("a column is wrong");
    for (std::size_t i = first; i < past; ++i) {
      const bool after = i == first || (labels.empty() ? items[i].first > items[i - 1].last + 1
                                                       : items[i].first > items[i - 1].last);
      if (items[i].last < items[i].first || items[i].end() > grid_.dims[frame.w] || !after ||
          (!labels.empty() && labels[i] == 0)) {
        return damaged("a run is wrong");
      }
      if (!labels.empty() && labels[i] > largest_label_) {
        return damaged(
            fmt::format("a label must be at most {}, got {}", largest_label_, labels[i]));
      }
    }
    offsets.push_back(static_cast<std::uint32_t>(past));
  }
  if (offsets.back() != items.size()) return damaged("a run is of no column");
  slab.set_tile(tu, tv - slab.v_begin() / kRunTile, offsets, items, labels);
  return {};
}

Result<VoxelIntervals> RunFileReader::read(int end) {
  VoxelIntervals slab(grid_, axis_, next_, end);
  while (!at_end() && static_cast<int>(head_.v) * kRunTile < end) {
    if (auto read = read_tile(slab); !read) return tl::unexpected(read.error());
    ++tiles_;
    if (auto read = next_head(); !read) return tl::unexpected(read.error());
  }
  next_ = end;
  return slab;
}

Result<void> RunFileReader::finish() {
  return at_end() ? Result<void>() : damaged("there are more tiles than rows");
}

}  // namespace strata
