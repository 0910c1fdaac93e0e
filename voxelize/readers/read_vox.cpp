// MagicaVoxel .vox, versions 150 and 200 (github.com/ephtracy/voxel-model): models of up to 256
// voxels a side, placed by a scene graph of transforms (nTRN), groups (nGRP) and shapes (nSHP). A
// model turns about its middle voxel's lower corner, floor(size / 2). Without a graph all models
// lie at 0. Palette index n is label n.

#include <algorithm>
#include <array>
#include <charconv>
#include <climits>
#include <glm/common.hpp>
#include <map>
#include <string>
#include <vector>

#include "voxelize/readers/readers.h"
#include "voxelize/volume/dense_array.h"
#include "voxelize/volume/tile_runs.h"

namespace strata {
namespace {

constexpr int kDeepest = 64;                   // of the scene graph
constexpr std::size_t kMostPlaced = 1u << 20;  // nodes, with repetitions
constexpr int kFarthestMove = 1 << 20;         // of a translation

struct Model {
  glm::ivec3 size{0};
  std::string_view voxels;  // x, y, z, colour: a byte each
};

/// A signed permutation of axes and a translation: row r has `sign[r]` in column `column[r]`.
struct Placing {
  std::array<int, 3> column{0, 1, 2}, sign{1, 1, 1};
  glm::ivec3 move{0};

  /// The voxel where a voxel of the model goes; `at` counts from the model's pivot.
  [[nodiscard]] glm::ivec3 voxel(const glm::ivec3& at) const {
    glm::ivec3 result;
    for (int r = 0; r < 3; ++r) {
      const auto i = static_cast<std::size_t>(r);
      // The middle of a voxel is turned, and rounded down.
      result[r] = sign[i] > 0 ? at[column[i]] : -at[column[i]] - 1;
    }
    return result + move;
  }
  [[nodiscard]] Placing operator*(const Placing& inner) const {
    Placing both;
    for (int r = 0; r < 3; ++r) {
      const auto i = static_cast<std::size_t>(r);
      const auto through = static_cast<std::size_t>(column[i]);
      both.column[i] = inner.column[through];
      both.sign[i] = sign[i] * inner.sign[through];
      both.move[r] = sign[i] * inner.move[column[i]] + move[r];
    }
    return both;
  }
};

struct Node {
  Placing placing;
  std::vector<std::int32_t> children;  // of transforms and groups
  std::vector<std::int32_t> models;    // of shapes
  bool hidden = false;
};

struct Placed {
  std::size_t model = 0;
  Placing placing;
};

using Dictionary = std::map<std::string, std::string, std::less<>>;

class VoxReader {
 public:
  explicit VoxReader(ReadContext& context) : context_(context), cursor_(context.bytes) {}
  Result<VoxelVolume> read();

 private:
  [[nodiscard]] tl::unexpected<Error> fault(std::uint64_t at, std::string_view what) const {
    return fail(ErrorCode::kInput, "{}: byte {}: {}", context_.path, at, what);
  }
  Result<void> read_chunks();
  Result<void> take_chunk(std::string_view id, ByteCursor content, std::uint64_t at);
  Result<void> take_voxels(ByteCursor content, std::uint64_t at);
  static Dictionary dictionary(ByteCursor& content);
  void take_transform(ByteCursor& content);
  Result<void> place(std::int32_t node, const Placing& placing, int depth);
  Result<VoxelVolume> fill();
  [[nodiscard]] std::vector<glm::u8vec4> palette() const;

  ReadContext& context_;
  ByteCursor cursor_;
  std::vector<Model> models_;
  std::string_view colours_;
  std::map<std::int32_t, Node> nodes_;
  std::vector<Placed> placed_;
  std::size_t visits_ = 0;
};

Dictionary VoxReader::dictionary(ByteCursor& content) {
  Dictionary entries;
  const auto count = content.get<std::int32_t>();
  for (std::int32_t i = 0; i < count && !content.failed(); ++i) {
    std::string key(content.take(content.get<std::uint32_t>()));
    entries[std::move(key)] = content.take(content.get<std::uint32_t>());
  }
  return entries;
}

void VoxReader::take_transform(ByteCursor& content) {
  Node node;
  const auto id = content.get<std::int32_t>();
  const Dictionary attributes = dictionary(content);
  const auto hidden = attributes.find("_hidden");
  node.hidden = hidden != attributes.end() && hidden->second == "1";
  node.children = {content.get<std::int32_t>()};
  content.take(12);  // reserved, layer, frames
  const Dictionary frame = dictionary(content);
  if (const auto move = frame.find("_t"); move != frame.end()) {
    const char* from = move->second.data();
    const char* const end = from + move->second.size();
    for (int axis = 0; axis < 3; ++axis) {
      while (from < end && *from == ' ') ++from;
      int value = 0;
      from = std::from_chars(from, end, value).ptr;
      node.placing.move[axis] = std::clamp(value, -kFarthestMove, kFarthestMove);
    }
  }
  if (const auto turn = frame.find("_r"); turn != frame.end()) {
    unsigned bits = 4;
    std::from_chars(turn->second.data(), turn->second.data() + turn->second.size(), bits);
    const int first = static_cast<int>(bits & 3), second = static_cast<int>(bits >> 2 & 3);
    if (first < 3 && second < 3 && first != second) {
      node.placing.column = {first, second, 3 - first - second};
      for (std::size_t r = 0; r < 3; ++r)
        node.placing.sign[r] = (bits >> (4 + r) & 1) != 0 ? -1 : 1;
    }
  }
  nodes_[id] = std::move(node);
}

Result<void> VoxReader::take_voxels(ByteCursor content, std::uint64_t at) {
  if (models_.empty() || models_.back().voxels.data() != nullptr) {
    return fault(at, "XYZI without a SIZE before it");
  }
  const auto count = content.get<std::uint32_t>();
  Model& model = models_.back();
  model.voxels = content.take(std::uint64_t{count} * 4);
  if (content.failed()) {
    return fault(at, fmt::format("XYZI announces {} voxels, the chunk ends before", count));
  }
  for (std::size_t i = 0; i < model.voxels.size(); i += 4) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto byte =
          static_cast<unsigned char>(model.voxels[i + static_cast<std::size_t>(axis)]);
      if (byte >= model.size[axis]) {
        return fault(at + 16 + i, fmt::format("a voxel at {} = {}, the model has {}", "xyz"[axis],
                                              static_cast<int>(byte), model.size[axis]));
      }
    }
  }
  return {};
}

Result<void> VoxReader::take_chunk(std::string_view id, ByteCursor content, std::uint64_t at) {
  if (id == "SIZE") {
    Model& model = models_.emplace_back();
    for (int axis = 0; axis < 3; ++axis) {
      model.size[axis] = content.get<std::int32_t>();
      if (model.size[axis] < 1 || model.size[axis] > 256) {
        return fault(at, fmt::format("a model of {} voxels along {}; at most 256 are allowed",
                                     model.size[axis], "xyz"[axis]));
      }
    }
  } else if (id == "XYZI") {
    return take_voxels(content, at);
  } else if (id == "RGBA") {
    colours_ = content.take(1024);
  } else if (id == "nTRN") {
    take_transform(content);
  } else if (id == "nGRP" || id == "nSHP") {
    Node node;
    const auto number = content.get<std::int32_t>();
    dictionary(content);
    const auto count = content.get<std::int32_t>();
    for (std::int32_t i = 0; i < count && !content.failed(); ++i) {
      const auto child = content.get<std::int32_t>();
      (id == "nGRP" ? node.children : node.models).push_back(child);
      if (id == "nSHP") dictionary(content);
    }
    nodes_[number] = std::move(node);
  }
  if (content.failed()) return fault(at, fmt::format("the chunk {} ends before its content", id));
  return {};
}

Result<void> VoxReader::read_chunks() {
  if (cursor_.take(4) != "VOX ") {
    return fault(0, "no .vox file of MagicaVoxel: it does not begin with 'VOX '");
  }
  cursor_.get<std::int32_t>();
  if (cursor_.take(4) != "MAIN") return fault(8, "the first chunk must be MAIN");
  const auto content = cursor_.get<std::uint32_t>(), children = cursor_.get<std::uint32_t>();
  cursor_.take(content);
  const std::uint64_t end = cursor_.at() + children;
  if (cursor_.failed() || end > context_.bytes.size()) {
    return fault(12, fmt::format("MAIN announces {} bytes, the file has {}", children,
                                 context_.bytes.size()));
  }
  while (cursor_.at() < end) {
    const std::uint64_t at = cursor_.at();
    const std::string_view id = cursor_.take(4);
    const auto bytes = cursor_.get<std::uint32_t>(), inner = cursor_.get<std::uint32_t>();
    const ByteCursor chunk(cursor_.take(bytes));
    cursor_.take(inner);
    if (cursor_.failed() || cursor_.at() > end) return fault(at, "the file ends within a chunk");
    if (auto taken = take_chunk(id, chunk, at); !taken) return taken;
  }
  if (models_.empty()) return fault(20, "there is no model");
  return {};
}

Result<void> VoxReader::place(std::int32_t number, const Placing& placing, int depth) {
  const auto found = nodes_.find(number);
  if (found == nodes_.end()) {
    return fail(ErrorCode::kInput, "{}: node {} of the scene is not there", context_.path, number);
  }
  const Node& node = found->second;
  if (++visits_ > kMostPlaced) {
    return fail(ErrorCode::kLimit, "{}: more than {} nodes in the scene", context_.path,
                kMostPlaced);
  }
  if (depth > kDeepest) {
    return fail(ErrorCode::kInput, "{}: node {} lies {} nodes deep; at most {} are read",
                context_.path, number, depth, kDeepest);
  }
  if (node.hidden) return {};
  const Placing here = placing * node.placing;
  if (glm::max(glm::abs(here.move), glm::ivec3(kMaxGridSide)) != glm::ivec3(kMaxGridSide)) {
    return fail(ErrorCode::kInput, "{}: node {} lies at ({}, {}, {}); at most {} is read",
                context_.path, number, here.move.x, here.move.y, here.move.z, kMaxGridSide);
  }
  for (const std::int32_t model : node.models) {
    if (model < 0 || static_cast<std::size_t>(model) >= models_.size()) {
      return fail(ErrorCode::kInput, "{}: node {} shows model {}, the file has {}", context_.path,
                  number, model, models_.size());
    }
    placed_.push_back({static_cast<std::size_t>(model), here});
  }
  for (const std::int32_t child : node.children) {
    if (auto done = place(child, here, depth + 1); !done) return done;
  }
  return {};
}

// What MagicaVoxel uses for files without a palette: 6 levels of blue, then green, then red, down
// from white and without black; then 10 levels of red, green, blue and grey.
std::vector<glm::u8vec4> default_palette() {
  std::vector<glm::u8vec4> colours;
  for (int i = 0; i < 215; ++i) {
    const auto level = [](int step) { return static_cast<std::uint8_t>(255 - 51 * step); };
    colours.emplace_back(level(i / 36), level(i / 6 % 6), level(i % 6), 255);
  }
  constexpr std::uint8_t kRamp[] = {0xee, 0xdd, 0xbb, 0xaa, 0x88, 0x77, 0x55, 0x44, 0x22, 0x11};
  for (int hue = 0; hue < 4; ++hue) {
    for (const std::uint8_t level : kRamp) {
      const auto is = [&](int c) { return hue == c || hue == 3 ? level : std::uint8_t{0}; };
      colours.emplace_back(is(0), is(1), is(2), 255);
    }
  }
  return colours;
}

std::vector<glm::u8vec4> VoxReader::palette() const {
  if (colours_.empty()) return default_palette();
  std::vector<glm::u8vec4> colours(255);
  for (std::size_t i = 0; i < colours.size(); ++i) {
    for (int c = 0; c < 4; ++c) {
      colours[i][c] = static_cast<std::uint8_t>(colours_[4 * i + static_cast<std::size_t>(c)]);
    }
  }
  return colours;
}

Result<VoxelVolume> VoxReader::fill() {
  glm::ivec3 lower(INT_MAX), upper(INT_MIN);
  std::uint64_t voxels = 0;
  for (const Placed& placed : placed_) {
    const Model& model = models_[placed.model];
    const glm::ivec3 pivot = nodes_.empty() ? glm::ivec3(0) : model.size / 2;
    const glm::ivec3 a = placed.placing.voxel(-pivot);
    const glm::ivec3 b = placed.placing.voxel(model.size - 1 - pivot);
    lower = glm::min(lower, glm::min(a, b));
    upper = glm::max(upper, glm::max(a, b));
    voxels += model.voxels.size() / 4;
  }
  const glm::ivec3 sides = placed_.empty() ? glm::ivec3(0) : upper - lower + 1;
  if (auto fits = check_dims(context_, sides.x, sides.y, sides.z); !fits) {
    return tl::unexpected(fits.error());
  }
  if (!context_.budget.take(voxels * 24)) return context_.too_large("the voxels of the models");
  VoxelGrid grid;
  grid.dims = sides;
  grid.origin = glm::dvec3(lower);
  VoxelVolume volume;
  volume.set = VoxelIntervals(grid, Axis::kZ);
  volume.first_index = lower;
  volume.placed = false;
  volume.kind = VoxelKind::kColours;
  volume.type = "uint8";
  const int tiles_u = volume.set.tiles_u();
  std::map<int, TileRuns> tiles;
  for (const Placed& placed : placed_) {
    if (context_.stopped()) return context_.cancelled();
    const Model& model = models_[placed.model];
    const glm::ivec3 pivot = nodes_.empty() ? glm::ivec3(0) : model.size / 2;
    for (std::size_t i = 0; i < model.voxels.size(); i += 4) {
      const auto byte = [&](std::size_t k) {
        return static_cast<int>(static_cast<unsigned char>(model.voxels[i + k]));
      };
      const glm::ivec3 at =
          placed.placing.voxel(glm::ivec3(byte(0), byte(1), byte(2)) - pivot) - lower;
      const auto local = static_cast<unsigned>(at.y % kTileSide * kTileSide + at.x % kTileSide);
      if (byte(3) == 0) continue;  // no colour, no voxel
      tiles[at.y / kTileSide * tiles_u + at.x / kTileSide].add(local, at.z, at.z,
                                                               static_cast<std::uint32_t>(byte(3)));
    }
  }
  for (auto& [tile, runs] : tiles) runs.store(volume.set, tile % tiles_u, tile / tiles_u, true);
  volume.colours = palette();
  return volume;
}

Result<VoxelVolume> VoxReader::read() {
  if (auto chunks = read_chunks(); !chunks) return tl::unexpected(chunks.error());
  if (nodes_.empty()) {
    for (std::size_t i = 0; i < models_.size(); ++i) placed_.push_back({i, {}});
  } else if (auto done = place(nodes_.begin()->first, {}, 0); !done) {
    return tl::unexpected(done.error());
  }
  return fill();
}

}  // namespace

Result<VoxelVolume> read_vox_voxels(ReadContext& context) {
  Result<VoxelVolume> volume = VoxReader(context).read();
  if (!volume) return volume;
  const bool plain = volume->colours == default_palette();
  if (plain) {  // one colour, and no palette: a mask
    std::vector<glm::u8vec4> colours = std::move(volume->colours);
    volume->kind = VoxelKind::kIds;
    settle_ids(*volume, 1);
    if (volume->kind == VoxelKind::kIds) {
      volume->kind = VoxelKind::kColours;
      volume->colours = std::move(colours);
    }
  }
  return volume;
}

}  // namespace strata
