#include "strata/voxelize/distance/signed_distance.h"

#include <algorithm>
#include <array>
#include <cfloat>
#include <glm/common.hpp>
#include <mutex>
#include <utility>
#include <vector>

#include "strata/mesh/diagnose.h"
#include "strata/raster/lattice_mesh.h"
#include "strata/voxelize/grid_fit.h"
#include "voxelize/distance/nearest_triangles.h"
#include "voxelize/distance/tile_distance.h"
#include "voxelize/distance/triangle_bins.h"

namespace strata {
namespace {

constexpr int kSide = DistanceTile::kSide;
constexpr int kSinkLayers = 64;  // that a sink gets at once
constexpr int kBlocks = kSide / ScalarField::kBlockSide;

std::size_t size(int value) { return static_cast<std::size_t>(value); }

double longest_side(const VoxelGrid& grid) {
  return std::max({grid.voxel_size.x, grid.voxel_size.y, grid.voxel_size.z});
}

/// What of a row of tiles along x is inside, found from runs along x.
class InsideRow {
 public:
  /// @param y, z  of the first voxels of the row of tiles
  void start(const VoxelIntervals& slab, int y, int z, int tiles) {
    slab_ = &slab;
    y_ = y, z_ = z;
    cursors_.fill(0);
    mixed_.assign(size(tiles), 0);
    whole_.assign(size(tiles) + 1, 0);
    const glm::ivec3 dims = slab.grid().dims;
    rows_y_ = std::min(kSide, dims.y - y);
    rows_z_ = std::min(kSide, slab.v_end() - z);
    for (int k = 0; k < rows_z_; ++k) {
      for (int j = 0; j < rows_y_; ++j) {
        for (const Interval& run : slab.column(y + j, z + k)) note(run, dims.x);
      }
    }
    int covered = 0;
    for (int tile = 0; tile < tiles; ++tile) {
      covered += whole_[size(tile)];
      // Also where some rows are inside from end to end, and others outside.
      if (covered != 0 && covered != rows_y_ * rows_z_) mixed_[size(tile)] = 1;
      whole_[size(tile)] = covered;
    }
  }
  [[nodiscard]] bool mixed(int tile) const { return mixed_[size(tile)] != 0; }
  [[nodiscard]] bool inside(int tile) const { return !mixed(tile) && whole_[size(tile)] != 0; }

  /// Bit x of word y * kSide + z: whether voxel (x, y, z) of a tile is inside. Tiles have to come
  /// in increasing order.
  void words(int tile, std::span<std::uint32_t, DistanceTile::kWords> words) {
    const int begin = tile * kSide, end = begin + kSide;
    std::fill(words.begin(), words.end(), 0);
    for (int k = 0; k < rows_z_; ++k) {
      for (int j = 0; j < rows_y_; ++j) {
        const auto column = slab_->column(y_ + j, z_ + k);
        std::uint32_t& next = cursors_[size(j * kSide + k)];
        while (next < column.size() && column[next].end() <= begin) ++next;
        std::uint32_t bits = 0;
        for (std::size_t i = next; i < column.size() && column[i].begin() < end; ++i) {
          const int from = std::max(column[i].begin(), begin) - begin;
          const int length = std::min(column[i].end(), end) - begin - from;
          bits |= (~std::uint32_t{0} >> (kSide - length)) << from;
        }
        words[size(j * kSide + k)] = bits;
      }
    }
  }

 private:
  void note(const Interval& run, int width) {
    const int first = (run.begin() + kSide - 1) / kSide;
    // The last tile may be cut off by the grid.
    const int last = run.end() == width ? (width + kSide - 1) / kSide : run.end() / kSide;
    if (run.begin() % kSide != 0) mixed_[size(run.begin() / kSide)] = 1;
    if (run.end() != width && run.end() % kSide != 0) mixed_[size(run.end() / kSide)] = 1;
    if (first >= last) return;
    ++whole_[size(first)];
    --whole_[size(last)];
  }

  const VoxelIntervals* slab_ = nullptr;
  int y_ = 0, z_ = 0, rows_y_ = 0, rows_z_ = 0;
  std::array<std::uint32_t, DistanceTile::kWords> cursors_{};
  std::vector<std::uint8_t> mixed_;
  std::vector<int> whole_;
};

/// What one thread works with.
struct Scratch {
  std::vector<float> squares;
  bool clean = false;  ///< all squares are the band's
  std::array<std::uint32_t, DistanceTile::kWords> words{};
  InsideRow inside;
  std::vector<std::pair<int, std::uint32_t>> pairs;  ///< tile, triangle
  std::vector<std::uint32_t> first, triangles;       ///< by tile
  DistanceReport report;
};

/// The surface, ready to be asked for the distances of layers.
class DistanceField {
 public:
  DistanceField(const LatticeMesh& mesh, const VoxelGrid& grid, const DistanceOptions& options,
                const Execution& execution)
      : mesh_(&mesh),
        grid_(grid),
        everywhere_(options.everywhere),
        scratch_(size(execution.thread_count())) {
    const double band = options.band;
    const double unit = longest_side(grid);
    tile_.scale = grid.voxel_size / unit;
    tile_.band = band;
    scale_.band_square = static_cast<float>(band * band);
    scale_.unit = static_cast<float>(unit);
    scale_.band = static_cast<float>(band * unit);
    if (everywhere_) nearest_ = NearestTriangles(mesh, tile_.scale, execution.stop);
    bins_ = TriangleBins(mesh, grid, (band + 0.01) / tile_.scale, execution);
  }

  [[nodiscard]] float band() const { return scale_.band; }

  /// Layers [z, z + kSide), as far as there are any, to field layers from field_z on.
  /// @param inside  holds these layers @pre z is a multiple of kSide
  void layers(const VoxelIntervals& inside, int z, ScalarField& field, int field_z,
              const Execution& execution) {
    field_ = &field;
    field_z_ = field_z;
    parallel_for(execution, size(bins_.tiles().y), [&](std::size_t y, int worker) {
      row(inside, static_cast<int>(y), z / kSide, scratch_[size(worker)], execution.stop);
    });
  }

  void report(DistanceReport& report) const {
    for (const Scratch& scratch : scratch_) {
      report.band_voxels += scratch.report.band_voxels;
      report.inside_voxels += scratch.report.inside_voxels;
      report.least = std::min(report.least, scratch.report.least);
      report.greatest = std::max(report.greatest, scratch.report.greatest);
    }
  }

 private:
  void row(const VoxelIntervals& inside, int y, int z, Scratch& scratch,
           const std::stop_token& stop);
  void sort_triangles(int y, int z, Scratch& scratch) const;
  void tile(const glm::ivec3& tile, const std::stop_token& stop, Scratch& scratch);
  void cut(const glm::ivec3& extent, float square, Scratch& scratch) const;
  void find_squares(const DistanceTile& tile, std::span<const std::uint32_t> triangles,
                    const std::stop_token& stop, Scratch& scratch) const;
  void fill_constant(const glm::ivec3& first, const glm::ivec3& last, float value);

  const LatticeMesh* mesh_;
  VoxelGrid grid_;
  bool everywhere_;
  NearestTriangles nearest_;  // with everywhere_
  DistanceTile tile_;         // without its place
  DistanceScale scale_;
  TriangleBins bins_;
  std::vector<Scratch> scratch_;  // by worker
  ScalarField* field_ = nullptr;
  int field_z_ = 0;
  std::mutex mutex_;  // of field_
};

/// Triangles by tile of the row.
void DistanceField::sort_triangles(int y, int z, Scratch& scratch) const {
  const std::size_t tiles = size(bins_.tiles().x);
  scratch.pairs.clear();
  scratch.first.assign(tiles + 1, 0);
  for (const std::uint32_t t : bins_.row(y, z)) {
    const TriangleBins::Box box = bins_.box(t);
    for (int x = box.low.x; x <= box.high.x; ++x) {
      scratch.pairs.emplace_back(x, t);
      ++scratch.first[size(x)];
    }
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& first : scratch.first) first = sum += first;
  scratch.triangles.resize(sum);
  for (const auto& [x, t] : scratch.pairs) scratch.triangles[--scratch.first[size(x)]] = t;
}

void DistanceField::row(const VoxelIntervals& inside, int y, int z, Scratch& scratch,
                        const std::stop_token& stop) {
  const int tiles = bins_.tiles().x;
  sort_triangles(y, z, scratch);
  scratch.inside.start(inside, y * kSide, z * kSide, tiles);
  const auto is_plain = [&](int x) {
    return !everywhere_ && scratch.first[size(x)] == scratch.first[size(x) + 1] &&
           !scratch.inside.mixed(x);
  };
  for (int x = 0; x < tiles && !stop.stop_requested();) {
    if (!is_plain(x)) {
      scratch.inside.words(x, scratch.words);
      tile({x, y, z}, stop, scratch);
      ++x;
      continue;
    }
    const int begin = x;
    const bool is_inside = scratch.inside.inside(x);
    while (x < tiles && is_plain(x) && scratch.inside.inside(x) == is_inside) ++x;
    if (!is_inside) continue;
    const int field_block = field_z_ / ScalarField::kBlockSide;
    fill_constant({begin * kBlocks, y * kBlocks, field_block},
                  {x * kBlocks, (y + 1) * kBlocks, field_block + kBlocks}, -scale_.band);
  }
}

void DistanceField::fill_constant(const glm::ivec3& first, const glm::ivec3& last, float value) {
  const std::lock_guard lock(mutex_);
  field_->fill_blocks(first, last, value);
}

/// Sets the squares of voxels beyond the grid.
void DistanceField::cut(const glm::ivec3& extent, float square, Scratch& scratch) const {
  if (extent == glm::ivec3(kSide)) return;
  for (int x = 0; x < kSide; ++x) {
    for (int y = 0; y < kSide; ++y) {
      float* row = scratch.squares.data() + DistanceTile::offset(x, y, 0);
      const int begin = x < extent.x && y < extent.y ? extent.z : 0;
      std::fill(row + begin, row + kSide, square);
    }
  }
}

/// Whether a block of a tile has voxels inside, outside.
std::pair<bool, bool> sides_of(std::span<const std::uint32_t, DistanceTile::kWords> words,
                               const glm::ivec3& at) {
  std::uint32_t any = 0, all = ~std::uint32_t{0};
  for (int y = 0; y < 8; ++y) {
    for (int z = 0; z < 8; ++z) {
      const std::uint32_t word = words[size((at.y + y) * kSide + at.z + z)];
      any |= word;
      all &= word;
    }
  }
  const std::uint32_t byte = std::uint32_t{0xff} << at.x;
  return {(any & byte) != 0, (all & byte) != byte};
}

/// Squares of a tile.
void DistanceField::find_squares(const DistanceTile& tile, std::span<const std::uint32_t> triangles,
                                 const std::stop_token& stop, Scratch& scratch) const {
  scratch.squares.resize(DistanceTile::kFloats);
  if (!scratch.clean) {
    std::fill(scratch.squares.begin(), scratch.squares.end(), scale_.band_square);
  }
  scratch.clean = triangles.empty() && !everywhere_;
  if (!triangles.empty()) add_triangles(*mesh_, triangles, tile, scratch.squares.data());
  if (everywhere_) nearest_.lower(tile, scale_.band_square, scratch.squares.data(), stop);
  if (!scratch.clean) cut(tile.size, everywhere_ ? FLT_MAX : scale_.band_square, scratch);
}

void DistanceField::tile(const glm::ivec3& at, const std::stop_token& stop, Scratch& scratch) {
  DistanceTile tile = tile_;
  tile.low = at * kSide;
  tile.size = glm::min(glm::ivec3(kSide), grid_.dims - tile.low);
  const std::uint32_t begin = scratch.first[size(at.x)], end = scratch.first[size(at.x) + 1];
  find_squares(tile, std::span(scratch.triangles).subspan(begin, end - begin), stop, scratch);
  struct Found {
    glm::ivec3 at;
    bool whole;  // all inside, without a band
    float* values;
  };
  std::array<Found, std::size_t{kBlocks} * kBlocks * kBlocks> found;
  std::size_t count = 0;
  for (int i = 0; i < kBlocks * kBlocks * kBlocks; ++i) {
    const glm::ivec3 block(i / (kBlocks * kBlocks), i / kBlocks % kBlocks, i % kBlocks);
    const glm::ivec3 corner = block * 8;
    if (corner.x >= tile.size.x || corner.y >= tile.size.y || corner.z >= tile.size.z) continue;
    bool stored = everywhere_ || (begin != end && block_has_band(scratch.squares.data(), corner,
                                                                 scale_.band_square));
    if (!stored) {
      const auto [some_inside, some_outside] = sides_of(scratch.words, corner);
      if (!some_inside) continue;
      stored = some_outside;
    }
    found[count++] = {block, !stored, nullptr};
  }
  const glm::ivec3 first(at.x * kBlocks, at.y * kBlocks, field_z_ / ScalarField::kBlockSide);
  {
    const std::lock_guard lock(mutex_);
    for (Found& block : std::span(found).first(count)) {
      const glm::ivec3 place = first + block.at;
      if (block.whole) {
        field_->fill_blocks(place, place + 1, -scale_.band);
      } else {
        block.values = field_->edit_block(place.x, place.y, place.z);
      }
    }
  }
  DistanceScale scale = scale_;
  if (everywhere_) scale.band_square = scale.band = FLT_MAX;
  for (const Found& block : std::span(found).first(count)) {
    if (block.whole) continue;
    const BlockCounts counts =
        finish_block(scratch.squares.data(), scratch.words, block.at * 8, scale, block.values);
    DistanceReport& report = scratch.report;
    report.band_voxels += counts.voxels;
    report.inside_voxels += counts.inside;
    report.least = std::min(report.least, -counts.deepest);
    report.greatest = std::max(report.greatest, counts.farthest);
  }
}

Result<void> check_band(double band) {
  if (band >= 0.5 && band <= kMaxDistanceBand) return {};
  return fail(ErrorCode::kUsage, "the band must be 0.5 to {} voxels, got {}", kMaxDistanceBand,
              band);
}

/// Gives a field for layers from z on, and the layer of the field that z is.
using FieldAt = std::function<std::pair<ScalarField*, int>(int z)>;
using LayersDone = std::function<Result<void>(int z)>;

/// False for an open mesh of which only the surface is to be kept. If that has to be found out,
/// `options` say it from then on, so that voxelize_slabs() does not look again.
bool has_inside(const TriangleSoup& mesh, VoxelizeOptions& options, const Execution& execution) {
  if (options.open != OpenMode::kSurface || options.filter != nullptr) return true;
  if (options.closedness == Closedness::kCheck) {
    const bool closed = is_closed(mesh, execution) ||
                        (options.rule == InsideRule::kParity && diagnose(mesh, execution).even);
    options.closedness = closed ? Closedness::kAssumeClosed : Closedness::kAssumeOpen;
  }
  return options.closedness == Closedness::kAssumeClosed;
}

/// As voxelize_slabs() where no voxel is solid.
Result<VoxelizeReport> without_inside(const VoxelGrid& grid, const SlabSink& sink) {
  if (auto valid = check_grid(grid); !valid) return tl::unexpected(valid.error());
  for (int z = 0; z < grid.dims.z; z += VoxelIntervals::kTileSide) {
    const int end = std::min(grid.dims.z, z + VoxelIntervals::kTileSide);
    if (auto done = sink(VoxelIntervals(grid, Axis::kX, z, end)); !done) {
      return tl::unexpected(done.error());
    }
  }
  VoxelizeReport report;
  report.closed = false;
  return report;
}

/// The work of both entry points: 32 layers at a time.
Result<DistanceReport> run(const TriangleSoup& mesh, const VoxelGrid& grid,
                           const DistanceOptions& options, const Execution& execution,
                           const FieldAt& field_at, const LayersDone& layers_done) {
  if (auto valid = check_band(options.band); !valid) return tl::unexpected(valid.error());
  const auto lattice =
      snap_to_lattice(options.surface != nullptr ? *options.surface : mesh, grid, execution);
  if (!lattice) return tl::unexpected(lattice.error());
  Execution quiet = execution;
  quiet.progress = {};
  if (options.everywhere && lattice->triangles.empty()) {
    return fail(ErrorCode::kGeometry, "there are no triangles that a distance could be one to");
  }
  DistanceField distances(*lattice, grid, options, quiet);
  VoxelizeOptions solid = options.solid;
  solid.axis = Axis::kX;
  solid.samples = 1;
  solid.solid = true;
  solid.surface = false;
  std::uint64_t inside_voxels = 0;
  const auto sink = [&](const VoxelIntervals& slab) -> Result<void> {
    inside_voxels += slab.solid_voxels();
    if (options.inside) {
      if (auto done = options.inside(slab); !done) return done;
    }
    for (int z = slab.v_begin(); z < slab.v_end(); z += kSide) {
      if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
      const auto [field, field_z] = field_at(z);
      distances.layers(slab, z, *field, field_z, quiet);
      if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
      if (auto done = layers_done(z); !done) return done;
      if (execution.progress) {
        execution.progress(static_cast<double>(std::min(z + kSide, grid.dims.z)) / grid.dims.z);
      }
    }
    return {};
  };
  auto made = has_inside(mesh, solid, quiet) ? voxelize_slabs(mesh, grid, solid, quiet, sink)
                                             : without_inside(grid, sink);
  if (!made) return tl::unexpected(made.error());
  DistanceReport report;
  report.solid = *made;
  report.solid.solid_voxels = inside_voxels;
  report.band = options.everywhere ? 0.0 : distances.band();
  distances.report(report);
  return report;
}

}  // namespace

double band_in_world(const VoxelGrid& grid, double band) { return band * longest_side(grid); }

Result<DistanceReport> signed_distance_slabs(const TriangleSoup& mesh, const VoxelGrid& grid,
                                             const DistanceOptions& options,
                                             const Execution& execution, const DistanceSink& sink) {
  const auto band = static_cast<float>(band_in_world(grid, options.band));
  ScalarField field;
  return run(
      mesh, grid, options, execution,
      [&](int z) {
        const int in_field = z % kSinkLayers;
        if (in_field == 0) {
          const int layers = std::min(kSinkLayers, grid.dims.z - z);
          field = ScalarField({grid.dims.x, grid.dims.y, layers}, band);
        }
        return std::pair(&field, in_field);
      },
      [&](int z) -> Result<void> {
        const int begin = z / kSinkLayers * kSinkLayers;
        const bool last = z + kSide >= begin + field.dims().z;
        return last ? sink(field, begin) : Result<void>();
      });
}

Result<ScalarField> signed_distance(const TriangleSoup& mesh, const VoxelGrid& grid,
                                    const DistanceOptions& options, const Execution& execution,
                                    DistanceReport* report) {
  const auto band = static_cast<float>(band_in_world(grid, options.band));
  ScalarField field(grid.dims, band);
  const auto made = run(
      mesh, grid, options, execution, [&](int z) { return std::pair(&field, z); },
      [](int) { return Result<void>(); });
  if (!made) return tl::unexpected(made.error());
  if (report != nullptr) *report = *made;
  return field;
}

}  // namespace strata
