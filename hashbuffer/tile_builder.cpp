#include "hashbuffer/tile_builder.h"

#include <algorithm>
#include <cstring>
#include <new>
#include <optional>
#include <utility>

#include "hashbuffer/tile_store.h"
#include "strata/hashbuffer/depth_list_store.h"
#include "strata/hashbuffer/resize_policy.h"

namespace strata {
template <class Record>
struct TileBuilder<Record>::Impl {
  using Bits = typename Record::Word;
  /// Of each list.
  static constexpr int kMostPlanes = kMaxPlanes / kSides<Key>, kFirstPlanes = 8 / kSides<Key>;
  static constexpr std::size_t kLists = TileTable<Record>::kLists;
  /// Layers of a tile, in the mean over its pixels, from which the count/scan store is faster: each
  /// insertion passes the records before it.
  static constexpr std::uint64_t kDeepLayers = 8;

  TileStoreOptions options;
  TileTable<Record> table;
  TileLog<Record> log;
  std::vector<std::uint32_t> offsets;  ///< compressed rows
  std::vector<Key> keys;
  std::uint64_t rebuilt = 0;
  std::optional<bool> deep;            ///< the last tile was; unknown at first
  int dirty_begin = 0, dirty_end = 0;  ///< rows of the table that hold records

  void resize_table(int planes) {
    table.size = 0;  // a thread whose memory was refused here may be given another tile
    const std::size_t size = static_cast<std::size_t>(planes) * kLists;
    table.cells.assign(size + table.kPadding, 0);
    table.offsets = probe_offsets(size);
    table.planes = options.offsets == OffsetKind::kPlaneFirst ? std::min(planes, kMostPlanes) : 0;
    table.oldest = 0;
    table.mixed = false;
    dirty_begin = dirty_end = 0;
    table.size = size;
  }

  std::vector<std::uint32_t> probe_offsets(std::size_t size) const {
    const auto offsets64 = make_offsets(options.offsets, {.pixels = kLists,
                                                          .cells = size,
                                                          .width = kTileSide,
                                                          .ages = Record::kAgeMax,
                                                          .seed = options.seed});
    return {offsets64.begin(), offsets64.end()};
  }

  void clear_table() {
    if (table.mixed) {
      std::fill(table.cells.begin(), table.cells.end(), Bits{0});
    } else {
      const std::size_t begin = static_cast<std::size_t>(dirty_begin) * kTileSide;
      const std::size_t length =
          static_cast<std::size_t>(std::max(0, dirty_end - dirty_begin)) * kTileSide;
      const std::size_t planes = static_cast<std::size_t>(table.oldest) * kSides<Key>;
      for (std::size_t plane = 0; plane < planes; ++plane) {
        std::fill_n(table.cells.begin() + static_cast<std::ptrdiff_t>(plane * kTilePixels + begin),
                    length, Bits{0});
      }
    }
    table.oldest = 0;
    table.mixed = false;
    table.failures = 0;
  }

  static bool is_deep(std::uint64_t fragments) { return fragments > kDeepLayers * kTilePixels; }

  /// About how many fragments a tile has: each triangle covers half of its box.
  static std::uint64_t expected_fragments(const TileInput& input) {
    constexpr std::size_t kSamples = 1024;
    const AxisFrame frame(input.target.axis);
    const std::size_t step = input.triangles.size() / kSamples + 1;
    std::uint64_t pixels = 0;
    for (std::size_t i = 0; i < input.triangles.size(); i += step) {
      const glm::uvec3& t = input.mesh.triangles[input.triangles[i]];
      const auto side = [&](int axis, int begin, int end) {
        const auto [low, high] =
            std::minmax({input.mesh.vertices[t.x][axis], input.mesh.vertices[t.y][axis],
                         input.mesh.vertices[t.z][axis]});
        const std::int32_t first = low >> kLatticeBits, last = high >> kLatticeBits;
        return static_cast<std::uint64_t>(
            std::max(0, std::min(last, end) - std::max(first, begin)));
      };
      pixels +=
          side(frame.u, input.clip.u0, input.clip.u1) * side(frame.v, input.clip.v0, input.clip.v1);
    }
    return pixels * step / 2;
  }

  static int planes_for(std::uint64_t cells) {
    return static_cast<int>((cells + kLists - 1) / kLists);
  }

  void append_list(std::size_t list) {
    for (int age = 1; age <= table.oldest; ++age) {
      std::size_t cell = list + table.offset(age);
      if (cell >= table.size) cell -= table.size;
      const Bits record = table.cells[cell];
      const int found = static_cast<int>(Record::age(record));
      if (found == age) keys.push_back(tile_key<Record>(record));
      if (found < age) break;  // a younger record here would have been displaced
    }
  }

  /// Collects the lists of a table in which fragments of different pixels are mixed.
  void compact_table() {
    offsets.resize(kTilePixels + 1);
    keys.clear();
    for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
      const std::size_t begin = keys.size();
      offsets[pixel] = static_cast<std::uint32_t>(begin);
      append_list(pixel);
      if constexpr (kSides<Key> == 2) {
        const auto middle = static_cast<std::ptrdiff_t>(keys.size());
        append_list(pixel + kTilePixels);
        std::inplace_merge(keys.begin() + static_cast<std::ptrdiff_t>(begin), keys.begin() + middle,
                           keys.end());
      }
    }
    offsets[kTilePixels] = static_cast<std::uint32_t>(keys.size());
  }

  void sort_log() {
    offsets.assign(kTilePixels + 1, 0);
    for (std::size_t i = 0; i < log.count; ++i) ++offsets[log.pixels[i]];
    std::uint32_t sum = 0;
    for (auto& offset : offsets) sum += std::exchange(offset, sum);
    keys.resize(log.count);
    for (std::size_t i = 0; i < log.count; ++i) keys[offsets[log.pixels[i]]++] = log.keys[i];
    // Each offset has moved to the end of its list, which is the start of the next.
    for (std::size_t pixel = kTilePixels; pixel > 0; --pixel) offsets[pixel] = offsets[pixel - 1];
    offsets[0] = 0;
    for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
      detail::sort_list(keys.data() + offsets[pixel], keys.data() + offsets[pixel + 1]);
    }
  }

  TileLists<Key> scan(const TileInput& input) {
    log.count = 0;
    const TileRasterResult raster = raster_into(input, log);
    sort_log();
    return csr(raster);
  }

  TileLists<Key> csr(const TileRasterResult& raster) const {
    TileLists<Key> lists;
    lists.row_begin = std::min(raster.row_begin, raster.row_end);
    lists.row_end = raster.row_end;
    lists.fragments = raster.fragments;
    lists.offsets = offsets.data();
    lists.keys = keys.data();
    return lists;
  }

  TileLists<Key> build(const TileInput& input) {
    if (options.store == StoreKind::kCountScan) return scan(input);
    // Neighbouring tiles are about equally deep.
    const bool choose = options.store == StoreKind::kAuto;
    if (choose && !deep) deep = is_deep(expected_fragments(input));
    if (choose && *deep) {
      const TileLists<Key> lists = scan(input);
      deep = is_deep(lists.fragments);
      return lists;
    }
    if (table.size == 0) resize_table(kFirstPlanes);
    for (;;) {
      clear_table();
      const TileRasterResult raster = raster_into(input, table);
      dirty_begin = raster.row_begin;
      dirty_end = raster.row_end;
      if (table.failures > 0) {
        // Nothing is lost: the tile is built again with more room. A pixel with more layers than
        // the age can count would fail in any table; the other store has no such limit.
        ++rebuilt;
        table.mixed = true;
        if (raster.fragments < table.size / 2) return scan(input);
        resize_table(planes_for(rebuilt_cells(raster.fragments, table.size)));
        deep = is_deep(raster.fragments);
        if (choose && *deep) return scan(input);
        continue;
      }
      deep = is_deep(raster.fragments);
      if (table.mixed) {
        compact_table();
        const TileLists<Key> lists = csr(raster);
        // More room for the next tile: one that is nearly full, or deeper than its planes.
        const int grown = planes_for(grown_cells(table.size));
        if (is_too_full(raster.fragments, table.size)) {
          resize_table(grown);
        } else if (table.planes > 0 && table.planes < kMostPlanes) {
          resize_table(std::min(kMostPlanes, std::max(grown, table.oldest)));
        }
        return lists;
      }
      TileLists<Key> lists;
      lists.row_begin = std::min(raster.row_begin, raster.row_end);
      lists.row_end = raster.row_end;
      lists.fragments = raster.fragments;
      if constexpr (sizeof(Bits) == 4) {
        lists.planes32 = table.cells.data();
      } else {
        lists.planes64 = table.cells.data();
      }
      lists.ages = table.oldest;
      return lists;
    }
  }
};

template <class Record>
TileBuilder<Record>::TileBuilder(const TileStoreOptions& options)
    : impl_(std::make_unique<Impl>()) {
  impl_->options = options;
}
template <class Record>
TileBuilder<Record>::TileBuilder(TileBuilder&&) noexcept = default;
template <class Record>
TileBuilder<Record>& TileBuilder<Record>::operator=(TileBuilder&&) noexcept = default;
template <class Record>
TileBuilder<Record>::~TileBuilder() = default;

template <class Record>
Result<TileLists<TileKey<Record>>> TileBuilder<Record>::build(
    const LatticeMesh& mesh, const RasterTarget& target, std::span<const std::uint32_t> triangles,
    int tu, int tv) {
  const PixelRect clip{tu * kTileSide, tv * kTileSide, std::min(target.width, (tu + 1) * kTileSide),
                       std::min(target.height, (tv + 1) * kTileSide)};
  try {
    return impl_->build(TileInput{mesh, target, triangles, clip});
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "out of memory for the lists of tile ({}, {}), {} triangles", tu,
                tv, triangles.size());
  }
}

template <class Record>
std::uint64_t TileBuilder<Record>::rebuilt_tiles() const {
  return impl_->rebuilt;
}

template <class Record>
std::uint64_t TileBuilder<Record>::memory_bytes() const {
  return impl_->table.cells.capacity() * sizeof(typename Record::Word) +
         impl_->log.keys.capacity() * (sizeof(Key) + sizeof(std::uint32_t)) +
         impl_->keys.capacity() * sizeof(Key) + impl_->offsets.capacity() * sizeof(std::uint32_t);
}

template class TileBuilder<Record32>;
template class TileBuilder<Record64>;

}  // namespace strata
