// MagicaVoxel .vox, version 150 (github.com/ephtracy/voxel-model, MagicaVoxel-file-format-vox.txt
// and -extension.txt). A model has at most 256 voxels a side; larger grids are several models,
// put in their places by a scene graph:
//   nTRN 0 - nGRP 1 - for each model m: nTRN 2 + 2m (its translation) - nSHP 3 + 2m
// A model stands on its centre, floor(size / 2). The grid's own centre is put at 0: the editor
// shows places from -1000 to 999 and cuts off what lies beyond. The format lists voxels one by one,
// and has no place for the world transform; z is up, as here.

#include <array>
#include <cstring>
#include <glm/common.hpp>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "voxelize/output/block_output.h"
#include "voxelize/output/palette.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

constexpr int kModelSide = 256;
constexpr int kTilesPerModel = kModelSide / VoxelIntervals::kTileSide;
constexpr int kLargestSide = 2000;                  // of a MagicaVoxel 0.99 scene
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
        models_along_((grid.dims + kModelSide - 1) / kModelSide) {
    for (int y = 0; y < models_along_.y; ++y) {
      for (int x = 0; x < models_along_.x; ++x) {
        for (int z = 0; z < models_along_.z; ++z) {
          const glm::ivec3 begin = glm::ivec3(x, y, z) * kModelSide;
          models_.push_back({begin, glm::min(glm::ivec3(kModelSide), grid.dims - begin), 0});
        }
      }
    }
  }

 private:
  /// A tile of a slab that is gone.
  struct Tile {
    int u = 0, v = 0;  // in tiles of the grid
    std::vector<std::uint32_t> offsets;
    std::vector<Interval> items;
    std::vector<std::uint8_t> colours;  // of the items, or none
    std::vector<std::uint32_t> rgba;    // of the items, until there is a palette
  };

  [[nodiscard]] Model& model_of(const Tile& tile, int z) {
    const int x = tile.u / kTilesPerModel, y = tile.v / kTilesPerModel;
    return models_[static_cast<std::size_t>((y * models_along_.x + x) * models_along_.z +
                                            z / kModelSide)];
  }

  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    counts_.resize(std::max(counts_.size(), static_cast<std::size_t>(execution.thread_count())));
    const std::size_t before = tiles_.size();
    for (int tv = 0; tv < slab.tiles_v(); ++tv) {
      for (int tu = 0; tu < slab.tiles_u(); ++tu) {
        if (slab.tile_empty(tu, tv)) continue;
        tiles_.push_back({tu, slab.v_begin() / VoxelIntervals::kTileSide + tv, {}, {}, {}, {}});
      }
    }
    parallel_for(execution, tiles_.size() - before, [&](std::size_t index, int worker) {
      Tile& tile = tiles_[before + index];
      keep(slab.tile(tile.u, tile.v - slab.v_begin() / VoxelIntervals::kTileSide), tile,
           counts_[static_cast<std::size_t>(worker)]);
    });
    for (std::size_t i = before; i < tiles_.size(); ++i) {
      for (const Interval& interval : tiles_[i].items) {
        total_ += static_cast<std::uint64_t>(interval.length());
        for (int z = interval.begin(); z < interval.end();) {
          const int end = std::min(interval.end(), (z / kModelSide + 1) * kModelSide);
          model_of(tiles_[i], z).voxels += static_cast<std::uint64_t>(end - z);
          z = end;
        }
      }
    }
    if (total_ * 4 > kLargestFile) {
      return fail(ErrorCode::kLimit, "{}: {} or more solid voxels; .vox holds at most {}", path(),
                  total_, kLargestFile / 4);
    }
    return {};
  }

  void keep(const VoxelIntervals::TileView& view, Tile& tile, ColourCounts& counts) const {
    tile.offsets.assign(view.offsets.begin(), view.offsets.end());
    tile.items.assign(view.items.begin(), view.items.end());
    if (rgba_) {
      tile.rgba.assign(view.labels.begin(), view.labels.end());
      for (std::size_t i = 0; i < tile.rgba.size(); ++i) {
        counts.add(tile.rgba[i], static_cast<std::uint64_t>(tile.items[i].length()));
      }
      return;
    }
    tile.colours.reserve(view.labels.size());
    for (const std::uint32_t label : view.labels) {
      tile.colours.push_back(static_cast<std::uint8_t>(label));
    }
  }

  /// Few colours for those of the voxels.
  void choose_palette(const Execution& execution) {
    ColourCounts all;
    for (const ColourCounts& counts : counts_) all.add(counts);
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
    const bool one = models_.size() == 1;
    std::vector<Model> kept;
    for (const Model& model : models_) {
      if (one || model.voxels != 0) kept.push_back(model);
    }
    if (kept.empty()) kept.push_back(models_.front());  // a file has at least one
    const Bytes graph = one ? Bytes() : scene_graph(kept, dims());
    constexpr std::uint64_t kModelHeads = 12 + 12 + 12 + 4;  // SIZE, XYZI and its count
    const Bytes colours = palette_.empty() ? Bytes() : palette();
    const std::uint64_t children =
        kept.size() * kModelHeads + total_ * 4 + graph.size() + colours.size();
    if (children > kLargestFile) {
      return fail(ErrorCode::kLimit, "{}: {} bytes; a .vox file holds at most {}", path(), children,
                  kLargestFile);
    }
    Bytes head;
    put_text(head, "VOX ");
    put_int(head, kVersion);
    put_chunk_head(head, "MAIN", 0, children);
    if (Result<void> written = output_.append(head.data(), head.size()); !written) return written;
    for (const Model& model : kept) {
      if (Result<void> written = write_model(model, execution); !written) return written;
    }
    for (const Bytes* chunks : {&graph, &colours}) {
      if (Result<void> written = output_.append(chunks->data(), chunks->size()); !written) {
        return written;
      }
    }
    return output_.commit();
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

  Result<void> write_model(const Model& model, const Execution& execution) {
    Bytes head;
    put_chunk_head(head, "SIZE", 12, 0);
    for (int axis = 0; axis < 3; ++axis) put_int(head, model.size[axis]);
    put_chunk_head(head, "XYZI", 4 + 4 * model.voxels, 0);
    put_int(head, static_cast<std::int64_t>(model.voxels));
    if (Result<void> written = output_.append(head.data(), head.size()); !written) return written;
    std::vector<const Tile*> tiles;  // by rows of tiles, since slabs came so
    for (const Tile& tile : tiles_) {
      if (tile.u / kTilesPerModel == model.begin.x / kModelSide &&
          tile.v / kTilesPerModel == model.begin.y / kModelSide) {
        tiles.push_back(&tile);
      }
    }
    return output_.append_blocks(execution, tiles.size(), [&](std::size_t index, Bytes& out, int) {
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
        const int colour = tile.colours.empty() ? kColour : tile.colours[i];
        for (int z = begin; z < end; ++z) {
          const int bytes[4] = {x, y, z, colour};
          for (const int byte : bytes) *to++ = static_cast<std::byte>(byte);
        }
      }
    }
  }

  static Bytes scene_graph(const std::vector<Model>& models, const glm::ivec3& dims) {
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
      const glm::ivec3 centre = model.begin + model.size / 2 - dims / 2;
      put_transform(2 + 2 * m, 3 + 2 * m, 0, fmt::format("{} {} {}", centre.x, centre.y, centre.z));
      content.clear();
      for (const int value : {3 + 2 * m, kNoDictionary, 1, m, kNoDictionary}) {
        put_int(content, value);
      }
      put_chunk(graph, "nSHP", content);
    }
    return graph;
  }

  BlockOutput output_;
  bool rgba_;                         // labels are colours
  std::vector<ColourCounts> counts_;  // of them, by worker
  std::vector<glm::u8vec4> palette_;  // none: MagicaVoxel's
  glm::ivec3 models_along_;
  std::vector<Model> models_;
  std::vector<Tile> tiles_;
  std::uint64_t total_ = 0;
};

}  // namespace

VoxelWriterResult open_vox_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options) {
  for (int axis = 0; axis < 3; ++axis) {
    if (grid.dims[axis] > kLargestSide) {
      return fail(ErrorCode::kUsage, "{}: {} voxels along {}; a .vox scene holds at most {}", path,
                  grid.dims[axis], "xyz"[axis], kLargestSide);
    }
  }
  Result<BlockOutput> output = BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  return std::make_unique<VoxWriter>(path, grid, options, std::move(*output));
}

}  // namespace strata
