#include "voxelize/volume/dense_array.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>
#include <vector>

#include "voxelize/volume/tile_runs.h"

namespace strata {
namespace {

constexpr std::size_t kBatchBytes = std::size_t{1} << 20;
constexpr std::uint64_t kLongSlab = 1u << 16;  // runs of a slab from which ids may be noise
constexpr double kIdRun = 1.5;                 // voxels of a run of ids in the mean, at least

std::size_t size(int value) { return static_cast<std::size_t>(value); }

/// Calls run(first, last, label) for the runs of equal labels that are not 0.
template <class T, class Run>
void for_each_run_of(const T* row, std::size_t count, Run&& run) {
  for (std::size_t i = 0; i < count;) {
    const T label = row[i];
    std::size_t past = i + 1;
    if constexpr (sizeof(T) == 1) {
      std::uint64_t word, eight = 0x0101010101010101u * label;
      for (; past + 8 <= count; past += 8) {
        std::memcpy(&word, row + past, sizeof word);
        if (word == eight) continue;
        past += size(std::countr_zero(word ^ eight)) / 8;
        break;
      }
    }
    while (past < count && row[past] == label) ++past;
    if (label != 0) run(static_cast<int>(i), static_cast<int>(past) - 1, std::uint32_t{label});
    i = past;
  }
}

/// Reads ids or booleans, a slab of 64 layers of the file's slowest axis at a time.
class IdReader {
 public:
  IdReader(ReadContext& context, const DenseLayout& layout, const DenseData& data)
      : context_(context),
        layout_(layout),
        data_(data),
        converter_(layout),
        frame_(static_cast<Axis>(layout.axes[0])),
        row_(layout.grid.dims[layout.axes[0]]),
        rows_(layout.grid.dims[layout.axes[1]]),
        layers_(layout.grid.dims[layout.axes[2]]),
        set_(layout.grid, static_cast<Axis>(layout.axes[0])) {}

  Result<VoxelVolume> read();

 private:
  struct Worker {
    std::vector<TileRuns> tiles;
    std::vector<std::byte> bytes;
    std::vector<std::uint32_t> ids;
  };
  Result<void> read_slab(int slab, Worker& worker);
  Result<void> read_rows(const std::byte* from, int layer, int first_row, int rows, Worker& worker);
  Result<void> store_slab(int slab, Worker& worker);

  ReadContext& context_;
  const DenseLayout& layout_;
  const DenseData& data_;
  RowConverter converter_;
  AxisFrame frame_;
  int row_, rows_, layers_;
  VoxelIntervals set_;
};

Result<void> IdReader::read_rows(const std::byte* from, int layer, int first_row, int rows,
                                 Worker& worker) {
  const bool bytes = layout_.type == NumberType::kBool || layout_.type == NumberType::kU8;
  const bool second_is_u = frame_.u == layout_.axes[1];
  const std::size_t row_bytes = size(row_) * bytes_of(layout_.type);
  for (int r = first_row; r < first_row + rows; ++r, from += row_bytes) {
    const int at_row = layout_.flipped[1] ? rows_ - 1 - r : r;
    const int u = second_is_u ? at_row : layer, v = second_is_u ? layer : at_row;
    TileRuns& tile = worker.tiles[size(at_row / kTileSide)];
    const auto local = static_cast<unsigned>(v % kTileSide * kTileSide + u % kTileSide);
    const auto add = [&](int first, int last, std::uint32_t label) {
      if (layout_.flipped[0]) first = row_ - 1 - std::exchange(last, row_ - 1 - first);
      tile.add(local, first, last, layout_.type == NumberType::kBool ? 1 : label);
    };
    if (bytes) {
      for_each_run_of(reinterpret_cast<const std::uint8_t*>(from), size(row_), add);
      continue;
    }
    worker.ids.resize(size(row_));
    if (!converter_.to_ids(from, size(row_), worker.ids.data())) {
      context_.wants_values = true;
      return fail(ErrorCode::kInput,
                  "{}: row {} of layer {} has a number that is no id: an id is 0 "
                  "to 4294967295",
                  context_.path, r, layer);
    }
    for_each_run_of(worker.ids.data(), size(row_), add);
  }
  return {};
}

Result<void> IdReader::read_slab(int slab, Worker& worker) {
  worker.tiles.resize(size((rows_ + kTileSide - 1) / kTileSide));
  const std::size_t row_bytes = size(row_) * bytes_of(layout_.type);
  const int batch =
      static_cast<int>(std::clamp<std::size_t>(kBatchBytes / row_bytes, 1, size(rows_)));
  const int begin = slab * kTileSide, end = std::min(begin + kTileSide, layers_);
  for (int step = begin; step < end; ++step) {
    // The order of the file: a flipped axis begins with the last layer.
    const int layer = layout_.flipped[2] ? end - 1 - (step - begin) : step;
    const int file_layer = layout_.flipped[2] ? layers_ - 1 - layer : layer;
    for (int r = 0; r < rows_; r += batch) {
      if (context_.stopped()) return context_.cancelled();
      const int rows = std::min(batch, rows_ - r);
      const std::size_t bytes = size(rows) * row_bytes;
      const std::byte* from = nullptr;
      if (data_.all.empty()) {
        worker.bytes.resize(bytes);
        if (auto got = data_.next(worker.bytes.data(), bytes); !got) return got;
        from = worker.bytes.data();
      } else {
        const std::size_t at = (size(file_layer) * size(rows_) + size(r)) * row_bytes;
        from = reinterpret_cast<const std::byte*>(data_.all.data()) + at;
      }
      if (auto read = read_rows(from, layer, r, rows, worker); !read) return read;
    }
  }
  return store_slab(slab, worker);
}

Result<void> IdReader::store_slab(int slab, Worker& worker) {
  const bool second_is_u = frame_.u == layout_.axes[1];
  const bool labels = layout_.type != NumberType::kBool;
  std::uint64_t voxels = 0, runs = 0;
  for (std::size_t t = 0; t < worker.tiles.size(); ++t) {
    TileRuns& tile = worker.tiles[t];
    if (tile.empty()) continue;
    const std::uint64_t bytes = tile.pieces() * (labels ? 8 : 4) + VoxelIntervals::kTileColumns * 4;
    if (!context_.budget.take(bytes)) return context_.too_large("the runs of voxels");
    const int tu = second_is_u ? static_cast<int>(t) : slab;
    const int tv = second_is_u ? slab : static_cast<int>(t);
    tile.store(set_, tu, tv, labels);
    if (!labels) continue;
    const VoxelIntervals::TileView view = set_.tile(tu, tv);
    runs += view.items.size();
    for (const Interval& item : view.items) voxels += static_cast<std::uint64_t>(item.length());
  }
  const bool noise =
      runs > kLongSlab && static_cast<double>(voxels) < kIdRun * static_cast<double>(runs);
  if (noise && !context_.colours && context_.options.integers == IntegerVoxels::kAuto) {
    context_.wants_values = true;
    return fail(ErrorCode::kInput, "{}: {} voxels in {} runs are no ids", context_.path, voxels,
                runs);
  }
  return {};
}

Result<VoxelVolume> IdReader::read() {
  const int slabs = (layers_ + kTileSide - 1) / kTileSide;
  const auto threads = size(data_.all.empty() ? 1 : context_.execution.thread_count());
  std::vector<Worker> workers(threads);
  std::vector<Result<void>> results(size(slabs));
  Execution execution = context_.execution;
  execution.threads = static_cast<int>(threads);
  if (data_.all.empty()) {
    for (int i = 0; i < slabs; ++i) {
      const int slab = layout_.flipped[2] ? slabs - 1 - i : i;
      if (auto read = read_slab(slab, workers[0]); !read) return tl::unexpected(read.error());
      if (execution.progress) execution.progress(static_cast<double>(i + 1) / slabs);
    }
  } else {
    parallel_for(execution, size(slabs), [&](std::size_t slab, int worker) {
      results[slab] = read_slab(static_cast<int>(slab), workers[size(worker)]);
    });
    for (const Result<void>& result : results) {
      if (!result) return tl::unexpected(result.error());
    }
  }
  if (context_.stopped()) return context_.cancelled();
  VoxelVolume volume;
  volume.set = std::move(set_);
  if (auto settled = settle_integers(context_, volume, layout_.type); !settled) {
    return tl::unexpected(settled.error());
  }
  return volume;
}

/// Reads numbers into the blocks of a field.
class FieldReader {
 public:
  FieldReader(ReadContext& context, const DenseLayout& layout, const DenseData& data)
      : context_(context),
        layout_(layout),
        data_(data),
        converter_(layout),
        field_(layout.grid.dims) {}

  Result<ScalarField> read();

 private:
  void settle_layer(int layer);
  ReadContext& context_;
  const DenseLayout& layout_;
  const DenseData& data_;
  RowConverter converter_;
  ScalarField field_;
};

// Blocks of 8 layers are complete; those that are of one value need no room.
void FieldReader::settle_layer(int layer) {
  const glm::ivec3 blocks = field_.blocks();
  const int slow = layout_.axes[2], a = layout_.axes[0], b = layout_.axes[1];
  glm::ivec3 at;
  at[slow] = layer >> 3;
  for (at[a] = 0; at[a] < blocks[a]; ++at[a]) {
    for (at[b] = 0; at[b] < blocks[b]; ++at[b]) field_.settle_block(at.x, at.y, at.z);
  }
}

Result<ScalarField> FieldReader::read() {
  const glm::ivec3 dims = layout_.grid.dims;
  const int row = dims[layout_.axes[0]], rows = dims[layout_.axes[1]];
  const int layers = dims[layout_.axes[2]];
  const std::size_t row_bytes = size(row) * bytes_of(layout_.type);
  std::vector<std::byte> bytes(row_bytes);
  std::vector<float> values(size(row));
  std::uint64_t held = 0;
  for (int f = 0; f < layers; ++f) {
    if (context_.stopped()) return context_.cancelled();
    const int layer = layout_.flipped[2] ? layers - 1 - f : f;
    for (int r = 0; r < rows; ++r) {
      const std::byte* from = bytes.data();
      if (data_.all.empty()) {
        if (auto got = data_.next(bytes.data(), row_bytes); !got)
          return tl::unexpected(got.error());
      } else {
        from = reinterpret_cast<const std::byte*>(data_.all.data()) +
               (size(f) * size(rows) + size(r)) * row_bytes;
      }
      converter_.to_floats(from, size(row), values.data());
      if (layout_.flipped[0]) std::reverse(values.begin(), values.end());
      glm::ivec3 at(0);
      at[layout_.axes[1]] = layout_.flipped[1] ? rows - 1 - r : r;
      at[layout_.axes[2]] = layer;
      put_row(field_, layout_.axes[0], values.data(), row, at);
    }
    const bool complete = layout_.flipped[2] ? layer % 8 == 0 : layer % 8 == 7 || f + 1 == layers;
    if (complete) settle_layer(layer);
    const std::uint64_t now = field_.memory_bytes();
    if (now > held && !context_.budget.take(now - held)) return context_.too_large("the values");
    held = std::max(held, now);
    if (context_.execution.progress) {
      context_.execution.progress(static_cast<double>(f + 1) / layers);
    }
  }
  return std::move(field_);
}

}  // namespace

std::optional<NumberType> numpy_type(std::string_view letters) {
  constexpr std::pair<std::string_view, NumberType> kTypes[] = {
      {"b1", NumberType::kBool}, {"?", NumberType::kBool}, {"u1", NumberType::kU8},
      {"i1", NumberType::kI8},   {"u2", NumberType::kU16}, {"i2", NumberType::kI16},
      {"u4", NumberType::kU32},  {"i4", NumberType::kI32}, {"u8", NumberType::kU64},
      {"i8", NumberType::kI64},  {"f2", NumberType::kF16}, {"f4", NumberType::kF32},
      {"f8", NumberType::kF64}};
  for (const auto& [name, type] : kTypes) {
    if (name == letters) return type;
  }
  return std::nullopt;
}

void put_row(ScalarField& field, int axis, const float* row, int count, const glm::ivec3& at) {
  constexpr int kSide = ScalarField::kBlockSide;
  glm::ivec3 step(0);
  step[axis] = 1;
  const std::size_t stride = ScalarField::offset(step.x, step.y, step.z);
  const std::size_t first = ScalarField::offset(at.x & 7, at.y & 7, at.z & 7);
  glm::ivec3 block(at.x >> 3, at.y >> 3, at.z >> 3);
  int length = 0;
  for (int i = 0; i < count; i += length, ++block[axis]) {
    length = std::min(kSide - ((at[axis] + i) & 7), count - i);
    const ScalarField::Block there = field.block(block.x, block.y, block.z);
    const auto equal = [&](float value) { return value == there.constant; };
    if (there.values == nullptr && std::all_of(row + i, row + i + length, equal)) continue;
    const std::size_t begin = first - stride * size(i == 0 ? 0 : at[axis] & 7);
    float* to = field.edit_block(block.x, block.y, block.z) + begin;
    for (int k = 0; k < length; ++k) to[size(k) * stride] = row[i + k];
  }
}

std::size_t bytes_of(NumberType type) {
  constexpr std::size_t kBytes[] = {1, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8};
  return kBytes[static_cast<std::size_t>(type)];
}

bool is_float(NumberType type) {
  return type == NumberType::kF16 || type == NumberType::kF32 || type == NumberType::kF64;
}

std::string_view name_of(NumberType type) {
  constexpr std::string_view kNames[] = {"bool",  "uint8",  "int8",  "uint16", "int16", "uint32",
                                         "int32", "uint64", "int64", "half",   "float", "double"};
  return kNames[static_cast<std::size_t>(type)];
}

Result<VoxelVolume> read_dense(ReadContext& context, const DenseLayout& layout,
                               const DenseData& data) {
  VoxelVolume volume;
  const bool ids = context.colours || layout.type == NumberType::kBool ||
                   (!is_float(layout.type) && !context.integers_as_values);
  if (ids) {
    Result<VoxelVolume> read = IdReader(context, layout, data).read();
    if (!read) return read;
    volume = std::move(*read);
  } else {
    Result<ScalarField> field = FieldReader(context, layout, data).read();
    if (!field) return tl::unexpected(field.error());
    volume.values = std::move(*field);
    volume.kind = is_float(layout.type) ? VoxelKind::kMask : VoxelKind::kValues;
    if (auto done = settle_values(context, volume, layout.grid); !done) {
      return tl::unexpected(done.error());
    }
  }
  volume.type = name_of(layout.type);
  return volume;
}

}  // namespace strata
