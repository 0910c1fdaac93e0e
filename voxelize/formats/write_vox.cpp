// MagicaVoxel .vox, version 150 (github.com/ephtracy/voxel-model, MagicaVoxel-file-format-vox.txt
// and -extension.txt). A model has at most 256 voxels a side; larger grids are several models,
// put in their places by a scene graph:
//   nTRN 0 - nGRP 1 - for each model m: nTRN 2 + 2m (its translation) - nSHP 3 + 2m
// A model stands on its centre, floor(size / 2). The grid's own centre is put at 0: the editor
// shows places from -1000 to 999 and cuts off what lies beyond. Grids beyond that are several files
// (vox_pieces.h), with one palette. The format lists voxels one by one, and has no place for the
// world transform; z is up, as here.

#include <sys/stat.h>

#include <array>
#include <cstring>
#include <glm/common.hpp>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "core/atomic_file.h"
#include "voxelize/formats/vox_pieces.h"
#include "voxelize/output/block_output.h"
#include "voxelize/output/palette.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

constexpr int kModelSide = 256;
constexpr int kTilesPerModel = kModelSide / VoxelIntervals::kTileSide;
constexpr std::uint64_t kLargestFile = 0x7fffffff;  // sizes are signed 32-bit
constexpr std::uint8_t kColour = 1;                 // white, in the palette of files without one
constexpr std::int32_t kVersion = 150;

void put_int(Bytes& out, std::int64_t value) {
  for (int i = 0; i < 4; ++i) out.push_back(static_cast<std::byte>(value >> (8 * i)));
}
void put_text(Bytes& out, std::string_view text) {
  for (const char letter : text) out.push_back(static_cast<std::byte>(letter));
}
void put_string(Bytes& out, std::string_view text) {
  put_int(out, static_cast<std::int64_t>(text.size()));
  put_text(out, text);
}
// [id:32 | bytes of content:32 | bytes of child chunks:32 | content]
void put_chunk_head(Bytes& out, std::string_view id, std::uint64_t content,
                    std::uint64_t children) {
  put_text(out, id);
  put_int(out, static_cast<std::int64_t>(content));
  put_int(out, static_cast<std::int64_t>(children));
}
void put_chunk(Bytes& out, std::string_view id, const Bytes& content) {
  put_chunk_head(out, id, content.size(), 0);
  out.insert(out.end(), content.begin(), content.end());
}

struct Model {
  glm::ivec3 begin{0}, size{0};  // voxels
  std::uint64_t voxels = 0;
};

class VoxWriter final : public SlabWriter {
 public:
  VoxWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
            BlockOutput output)
      : SlabWriter(path, grid, Axis::kZ),
        output_(std::move(output)),
        rgba_(options.rgba),
        palette_(options.colours),
        pieces_(grid.dims),
        models_along_((grid.dims + kModelSide - 1) / kModelSide),
        piece_voxels_(static_cast<std::size_t>(pieces_.total())) {
    for (int y = 0; y < models_along_.y; ++y) {
      for (int x = 0; x < models_along_.x; ++x) {
        for (int z = 0; z < models_along_.z; ++z) {
          const glm::ivec3 begin = glm::ivec3(x, y, z) * kModelSide;
          models_.push_back({begin, glm::min(glm::ivec3(kModelSide), grid.dims - begin), 0});
        }
      }
    }
  }

  [[nodiscard]] std::vector<std::string> pieces() const override { return files_; }

 private:
  /// A tile of a slab that is gone.
  struct Tile {
    int u = 0, v = 0;  // in tiles of the grid
    std::vector<std::uint32_t> offsets;
    std::vector<Interval> items;
    std::vector<std::uint8_t> colours;  // of the items, or none
    std::vector<std::uint32_t> rgba;    // of the items, until there is a palette
    std::vector<std::uint64_t> voxels;  // of each model along z
  };

  /// The lowest of the models that a tile meets; those above it follow.
  [[nodiscard]] Model* models_of(const Tile& tile) {
    const int x = tile.u / kTilesPerModel, y = tile.v / kTilesPerModel;
    return models_.data() + (y * models_along_.x + x) * models_along_.z;
  }

  [[nodiscard]] std::size_t piece_of(const Model& model) const {
    const glm::ivec3 at = model.begin / pieces_.side;
    return static_cast<std::size_t>((at.z * pieces_.count.y + at.y) * pieces_.count.x + at.x);
  }

  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    counts_.resize(std::max(counts_.size(), static_cast<std::size_t>(execution.thread_count())));
    const std::size_t before = tiles_.size();
    for (int tv = 0; tv < slab.tiles_v(); ++tv) {
      for (int tu = 0; tu < slab.tiles_u(); ++tu) {
        if (slab.tile_empty(tu, tv)) continue;
        tiles_.push_back({tu, slab.v_begin() / VoxelIntervals::kTileSide + tv, {}, {}, {}, {}, {}});
      }
    }
    parallel_for(execution, tiles_.size() - before, [&](std::size_t index, int worker) {
      Tile& tile = tiles_[before + index];
      keep(slab.tile(tile.u, tile.v - slab.v_begin() / VoxelIntervals::kTileSide), tile,
           counts_[static_cast<std::size_t>(worker)]);
    });
    for (std::size_t i = before; i < tiles_.size(); ++i) {
      Model* model = models_of(tiles_[i]);
      for (const std::uint64_t voxels : tiles_[i].voxels) {
        model->voxels += voxels;
        piece_voxels_[piece_of(*model++)] += voxels;
      }
    }
    for (std::size_t piece = 0; piece < piece_voxels_.size(); ++piece) {
      if (piece_voxels_[piece] * 4 <= kLargestFile) continue;
      return fail(ErrorCode::kLimit, "{}: {} or more solid voxels; .vox holds at most {}",
                  pieces_.path(path(), static_cast<int>(piece)), piece_voxels_[piece],
                  kLargestFile / 4);
    }
    return {};
  }

  void keep(const VoxelIntervals::TileView& view, Tile& tile, ColourCounts& counts) const {
    tile.offsets.assign(view.offsets.begin(), view.offsets.end());
    tile.items.assign(view.items.begin(), view.items.end());
    count_voxels(tile);
    if (rgba_) {
      tile.rgba.assign(view.labels.begin(), view.labels.end());
      counts.add(tile.rgba, tile.items);
      return;
    }
    tile.colours.reserve(view.labels.size());
    for (const std::uint32_t label : view.labels) {
      tile.colours.push_back(static_cast<std::uint8_t>(label));
    }
  }

  void count_voxels(Tile& tile) const {
    tile.voxels.resize(static_cast<std::size_t>(models_along_.z));
    for (const Interval& interval : tile.items) {
      for (int z = interval.begin(); z < interval.end();) {
        const int model = z / kModelSide;
        const int end = std::min(interval.end(), (model + 1) * kModelSide);
        tile.voxels[static_cast<std::size_t>(model)] += static_cast<std::uint64_t>(end - z);
        z = end;
      }
    }
  }

  /// Few colours for those of the voxels.
  void choose_palette(const Execution& execution) {
    ColourCounts all;
    for (ColourCounts& counts : counts_) all.add(std::move(counts));
    counts_.clear();
    const Palette chosen = all.palette(kVoxColours, execution);
    palette_ = chosen.colours();
    parallel_for(execution, tiles_.size(), [&](std::size_t index, int) {
      Tile& tile = tiles_[index];
      tile.colours.reserve(tile.rgba.size());
      for (const std::uint32_t colour : tile.rgba) {
        tile.colours.push_back(static_cast<std::uint8_t>(chosen.index_of(colour) + 1));
      }
      tile.rgba = {};
    });
  }

  Result<void> finish_output(const Execution& execution) override {
    if (rgba_) choose_palette(execution);
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    columns_.resize(static_cast<std::size_t>(models_along_.x * models_along_.y));
    for (const Tile& tile : tiles_) columns_[column_of(tile.u, tile.v)].push_back(&tile);
    if (pieces_.total() == 1) return write_piece(0, output_, execution);
    return write_pieces(execution);
  }

  /// All files or none. Pieces without a voxel are none, but the first if there is no voxel at all.
  Result<void> write_pieces(const Execution& execution) {
    std::optional<OutputGroup> together;
    if (!OutputGroup::lives()) together.emplace();
    std::vector<std::string> files;
    const bool empty = std::all_of(piece_voxels_.begin(), piece_voxels_.end(),
                                   [](std::uint64_t voxels) { return voxels == 0; });
    for (std::size_t piece = 0; piece < piece_voxels_.size(); ++piece) {
      if (piece_voxels_[piece] == 0 && !(empty && piece == 0)) continue;
      files.push_back(pieces_.path(path(), static_cast<int>(piece)));
      std::optional<BlockOutput> next;
      if (piece != 0) {
        Result<BlockOutput> created = BlockOutput::create(files.back());
        if (!created) return tl::unexpected(created.error());
        next = std::move(*created);
      }
      Result<void> written = write_piece(piece, next ? *next : output_, execution);
      if (!written) return written;
    }
    if (together) {
      if (Result<void> named = together->commit(); !named) return named;
    }
    files_ = std::move(files);
    return {};
  }

  Result<void> write_piece(std::size_t piece, BlockOutput& output, const Execution& execution) {
    const glm::ivec3 begin = pieces_.place(static_cast<int>(piece)) * pieces_.side;
    const glm::ivec3 size = glm::min(pieces_.side, dims() - begin);
    const bool one = glm::max(size, glm::ivec3(kModelSide)) == glm::ivec3(kModelSide);
    std::vector<Model> kept;
    const Model* first = nullptr;
    for (const Model& model : models_) {
      if (piece_of(model) != piece) continue;
      if (first == nullptr) first = &model;
      if (one || model.voxels != 0) kept.push_back(model);
    }
    if (kept.empty()) kept.push_back(*first);  // a file has at least one
    const Bytes graph = one ? Bytes() : scene_graph(kept, begin + size / 2);
    constexpr std::uint64_t kModelHeads = 12 + 12 + 12 + 4;  // SIZE, XYZI and its count
    const Bytes colours = palette_.empty() ? Bytes() : palette();
    const std::uint64_t children =
        kept.size() * kModelHeads + piece_voxels_[piece] * 4 + graph.size() + colours.size();
    if (children > kLargestFile) {
      return fail(ErrorCode::kLimit, "{}: {} bytes; a .vox file holds at most {}",
                  pieces_.path(path(), static_cast<int>(piece)), children, kLargestFile);
    }
    Bytes head;
    put_text(head, "VOX ");
    put_int(head, kVersion);
    put_chunk_head(head, "MAIN", 0, children);
    if (Result<void> written = output.append(head.data(), head.size()); !written) return written;
    for (const Model& model : kept) {
      if (Result<void> written = write_model(model, output, execution); !written) return written;
    }
    for (const Bytes* chunks : {&graph, &colours}) {
      if (Result<void> written = output.append(chunks->data(), chunks->size()); !written) {
        return written;
      }
    }
    return output.commit();
  }

  /// Of models above each other, by tile.
  [[nodiscard]] std::size_t column_of(int u, int v) const {
    return static_cast<std::size_t>(v / kTilesPerModel * models_along_.x + u / kTilesPerModel);
  }

  /// Colour i stands at i - 1.
  [[nodiscard]] Bytes palette() const {
    Bytes content, chunk;
    for (std::size_t i = 0; i < 256; ++i) {
      const glm::u8vec4 colour = i < palette_.size() ? palette_[i] : glm::u8vec4(255);
      for (int c = 0; c < 4; ++c) content.push_back(static_cast<std::byte>(colour[c]));
    }
    put_chunk(chunk, "RGBA", content);
    return chunk;
  }

  Result<void> write_model(const Model& model, BlockOutput& output, const Execution& execution) {
    Bytes head;
    put_chunk_head(head, "SIZE", 12, 0);
    for (int axis = 0; axis < 3; ++axis) put_int(head, model.size[axis]);
    put_chunk_head(head, "XYZI", 4 + 4 * model.voxels, 0);
    put_int(head, static_cast<std::int64_t>(model.voxels));
    if (Result<void> written = output.append(head.data(), head.size()); !written) return written;
    const std::vector<const Tile*>& tiles = columns_[column_of(
        model.begin.x / VoxelIntervals::kTileSide, model.begin.y / VoxelIntervals::kTileSide)];
    return output.append_blocks(execution, tiles.size(), [&](std::size_t index, Bytes& out, int) {
      make_voxels(*tiles[index], model, out);
    });
  }

  // x, y, z within the model, colour: a byte each.
  static void make_voxels(const Tile& tile, const Model& model, Bytes& out) {
    constexpr int kSide = VoxelIntervals::kTileSide;
    std::size_t voxels = 0;
    for (const Interval& interval : tile.items) {
      const int begin = std::max(interval.begin() - model.begin.z, 0);
      const int end = std::min(interval.end() - model.begin.z, kModelSide);
      voxels += static_cast<std::size_t>(std::max(end - begin, 0));
    }
    out.resize(4 * voxels);
    std::byte* to = out.data();
    for (int local = 0; local < kSide * kSide; ++local) {
      const int x = tile.u * kSide + local % kSide - model.begin.x;
      const int y = tile.v * kSide + local / kSide - model.begin.y;
      for (std::uint32_t i = tile.offsets[static_cast<std::size_t>(local)];
           i < tile.offsets[static_cast<std::size_t>(local) + 1]; ++i) {
        const int begin = std::max(tile.items[i].begin() - model.begin.z, 0);
        const int end = std::min(tile.items[i].end() - model.begin.z, kModelSide);
        const std::uint8_t colour = tile.colours.empty() ? kColour : tile.colours[i];
        for (int z = begin; z < end; ++z, to += 4) {
          const std::uint8_t voxel[4] = {static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y),
                                         static_cast<std::uint8_t>(z), colour};
          std::memcpy(to, voxel, sizeof voxel);
        }
      }
    }
  }

  /// @param middle  the voxel at 0
  static Bytes scene_graph(const std::vector<Model>& models, const glm::ivec3& middle) {
    constexpr int kNoDictionary = 0, kReserved = -1, kNoLayer = -1, kFrames = 1;
    Bytes graph, content;
    const auto put_transform = [&](int id, int child, int layer, const std::string& translation) {
      content.clear();
      for (const int value : {id, kNoDictionary, child, kReserved, layer, kFrames}) {
        put_int(content, value);
      }
      put_int(content, translation.empty() ? 0 : 1);
      if (!translation.empty()) {
        put_string(content, "_t");
        put_string(content, translation);
      }
      put_chunk(graph, "nTRN", content);
    };
    const int count = static_cast<int>(models.size());
    put_transform(0, 1, kNoLayer, "");
    content.clear();
    for (const int value : {1, kNoDictionary, count}) put_int(content, value);
    for (int m = 0; m < count; ++m) put_int(content, 2 + 2 * m);
    put_chunk(graph, "nGRP", content);
    for (int m = 0; m < count; ++m) {
      const Model& model = models[static_cast<std::size_t>(m)];
      const glm::ivec3 centre = model.begin + model.size / 2 - middle;
      put_transform(2 + 2 * m, 3 + 2 * m, 0, fmt::format("{} {} {}", centre.x, centre.y, centre.z));
      content.clear();
      for (const int value : {3 + 2 * m, kNoDictionary, 1, m, kNoDictionary}) {
        put_int(content, value);
      }
      put_chunk(graph, "nSHP", content);
    }
    return graph;
  }

  BlockOutput output_;                // of the first piece
  bool rgba_;                         // labels are colours
  std::vector<ColourCounts> counts_;  // of them, by worker
  std::vector<glm::u8vec4> palette_;  // none: MagicaVoxel's
  VoxPieces pieces_;
  glm::ivec3 models_along_;
  std::vector<Model> models_;
  std::vector<std::uint64_t> piece_voxels_;
  std::vector<Tile> tiles_;  // by rows of tiles, since slabs come so
  std::vector<std::vector<const Tile*>> columns_;
  std::vector<std::string> files_;  // of several pieces
};

/// A pipe, a device or an open file.
bool is_one_stream(const std::string& path) {
  struct stat status {};
  return path == "-" || path.starts_with("/dev/") ||
         (stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode));
}

}  // namespace

VoxelWriterResult open_vox_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options) {
  const VoxPieces pieces(grid.dims);
  if (pieces.total() > VoxPieces::kMost) {
    return fail(ErrorCode::kUsage,
                "{}: {} x {} x {} voxels would be {} .vox files of at most {} voxels a side; at "
                "most {} are written",
                path, grid.dims.x, grid.dims.y, grid.dims.z, pieces.total(), VoxPieces::kSide,
                VoxPieces::kMost);
  }
  if (pieces.total() > 1 && is_one_stream(path)) {
    return fail(ErrorCode::kUsage,
                "{}: {} x {} x {} voxels are {} .vox files, since one holds at most {} a side; "
                "give a path that is no stream, or a coarser grid",
                path == "-" ? "standard output" : path, grid.dims.x, grid.dims.y, grid.dims.z,
                pieces.total(), VoxPieces::kLargestSide);
  }
  Result<BlockOutput> output = BlockOutput::create(pieces.path(path, 0));
  if (!output) return tl::unexpected(output.error());
  return std::make_unique<VoxWriter>(path, grid, options, std::move(*output));
}

}  // namespace strata
