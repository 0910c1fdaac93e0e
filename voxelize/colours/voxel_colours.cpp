#include "strata/voxelize/colours/voxel_colours.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <new>
#include <span>
#include <utility>
#include <vector>

#include "strata/raster/lattice_mesh.h"
#include "voxelize/colours/near_triangle.h"
#include "voxelize/colours/nearest_points.h"
#include "voxelize/shell_tiles.h"

namespace strata {
namespace {

constexpr int kSide = VoxelIntervals::kTileSide;
constexpr double kHalfDiagonal = 0.8660254037844387;  // of a voxel: the farthest that it touches
constexpr double kSolidReach = 1.0;                   // between centres of voxels that share a face
constexpr std::uint64_t kFar = ~std::uint64_t{0};

/// A tile's voxels that may have a colour of the surface, and what is nearest to them.
struct NearVoxels {
  std::span<const std::uint32_t> offsets;  // of runs, by column
  std::span<const Interval> runs;
  std::vector<std::uint32_t> first;  // the first voxel of each run, and how many there are
  /// [square of the distance:32 | place of the triangle in the tile:32]; then colours
  std::vector<std::uint64_t> keys;

  /// @return false if there are too many
  bool reset(std::span<const std::uint32_t> offsets_of, std::span<const Interval> runs_of) {
    offsets = offsets_of, runs = runs_of;
    first.resize(runs.size() + 1);
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < runs.size(); ++i) {
      first[i] = static_cast<std::uint32_t>(count);
      count += static_cast<std::uint64_t>(runs[i].length());
    }
    if (count > 0xffffffffu) return false;
    first[runs.size()] = static_cast<std::uint32_t>(count);
    keys.assign(count, kFar);
    return true;
  }
};

/// A voxel that takes its colour from a triangle.
struct NearVoxel {
  std::uint32_t key = 0;      // its place among the keys
  std::uint8_t u = 0, v = 0;  // of the tile
  std::uint16_t w = 0;
};

/// Centres of voxels near one triangle, and the keys that wait for them.
struct Batch {
  VoxelCentres centres;
  std::array<std::uint64_t*, VoxelCentres::kMost> keys{};
  std::array<double, VoxelCentres::kMost> squares{};
  std::array<glm::dvec3, VoxelCentres::kMost> weights{};
  std::array<glm::u8vec4, VoxelCentres::kMost> colours{};
};

/// The triangles near a tile. They are kept, or made as they are needed where there are many.
class TileTriangles {
 public:
  /// @param numbers, mesh, frame  must outlive the use of the triangles
  void start(std::span<const std::uint32_t> numbers, const LatticeMesh& mesh,
             const AxisFrame& frame, const shell::Vector& origin) {
    numbers_ = numbers, mesh_ = &mesh, frame_ = &frame, origin_ = origin;
    kept_.clear();
    if (numbers.size() > kMostKept) return;
    for (std::size_t place = 0; place < numbers.size(); ++place) kept_.push_back(make(place));
  }
  [[nodiscard]] std::size_t size() const { return numbers_.size(); }
  [[nodiscard]] std::uint32_t number(std::size_t place) const { return numbers_[place]; }
  template <class Use>
  void with(std::size_t place, Use&& use) const {
    kept_.empty() ? use(make(place)) : use(kept_[place]);
  }
  [[nodiscard]] std::uint64_t bytes() const { return kept_.capacity() * sizeof(NearTriangle); }

 private:
  static constexpr std::size_t kMostKept = 8192;

  [[nodiscard]] NearTriangle make(std::size_t place) const {
    return {shell::corners(*mesh_, numbers_[place], *frame_), origin_};
  }

  std::span<const std::uint32_t> numbers_;
  const LatticeMesh* mesh_ = nullptr;
  const AxisFrame* frame_ = nullptr;
  shell::Vector origin_{};
  std::vector<NearTriangle> kept_;
};

struct Worker {
  explicit Worker(SurfaceColours::Probe asks)
      : probe(std::move(asks)), batch(std::make_unique<Batch>()) {}

  [[nodiscard]] std::uint64_t bytes() const {
    return triangles.bytes() + collector.bytes() + near_items.capacity() * sizeof(Interval) +
           near.keys.capacity() * sizeof(std::uint64_t) +
           near_voxels.capacity() * sizeof(NearVoxel) +
           items.capacity() * (sizeof(Interval) + sizeof(std::uint32_t));
  }

  SurfaceColours::Probe probe;
  std::unique_ptr<Batch> batch;
  TileTriangles triangles;
  shell::RunCollector collector;
  std::vector<std::uint32_t> near_offsets;
  std::vector<Interval> near_items;
  NearVoxels near;
  std::vector<std::uint32_t> near_ends;  // of the voxels of each triangle
  std::vector<NearVoxel> near_voxels;    // by triangle
  // The result.
  std::vector<std::uint32_t> offsets, labels;
  std::vector<Interval> items;
};

/// Appends the voxels that two columns have in common.
void append_common(std::span<const Interval> a, std::span<const Interval> b,
                   std::vector<Interval>& out) {
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    const std::uint16_t first = std::max(a[i].first, b[j].first);
    const std::uint16_t last = std::min(a[i].last, b[j].last);
    if (first <= last) out.push_back({first, last});
    a[i].last < b[j].last ? ++i : ++j;
  }
}

}  // namespace

glm::u8vec4 solid_colour_bytes(const glm::vec4& colour) {
  glm::u8vec4 bytes(glm::clamp(colour, 0.0f, 1.0f) * 255.0f + 0.5f);
  bytes.w = std::max<std::uint8_t>(bytes.w, 1);
  return bytes;
}

VoxelIntervals relabelled(const VoxelIntervals& slab,
                          const std::function<std::uint32_t(std::uint32_t)>& label,
                          const Execution& execution) {
  VoxelIntervals made(slab.grid(), slab.axis(), slab.v_begin(), slab.v_end());
  const auto tiles_u = static_cast<std::size_t>(slab.tiles_u());
  const auto one = [&](std::size_t index, int) {
    const int tu = static_cast<int>(index % tiles_u), tv = static_cast<int>(index / tiles_u);
    const VoxelIntervals::TileView tile = slab.tile(tu, tv);
    if (tile.items.empty()) return;
    std::vector<std::uint32_t> offsets{0}, labels;
    std::vector<Interval> items;
    for (std::size_t local = 0; local < VoxelIntervals::kTileColumns; ++local) {
      for (std::uint32_t i = tile.offsets[local]; i < tile.offsets[local + 1]; ++i) {
        const std::uint32_t given = label(tile.label(i));
        if (items.size() > offsets.back() && labels.back() == given &&
            items.back().end() == tile.items[i].begin()) {
          items.back().last = tile.items[i].last;
          continue;
        }
        items.push_back(tile.items[i]);
        labels.push_back(given);
      }
      offsets.push_back(static_cast<std::uint32_t>(items.size()));
    }
    made.set_tile(tu, tv, offsets, items, labels);
  };
  parallel_for(execution, tiles_u * static_cast<std::size_t>(slab.tiles_v()), one);
  return made;
}

struct VoxelColouring::Impl {
  VoxelColourOptions options;
  LatticeMesh mesh;
  const SurfaceColours* colours = nullptr;
  std::vector<Worker> workers;

  [[nodiscard]] double reach() const { return options.solid ? kSolidReach : kHalfDiagonal; }
  bool find_near(const VoxelIntervals::TileView& tile, const glm::ivec3& size,
                 Worker& worker) const;
  void find_nearest(const glm::ivec3& size, Worker& worker) const;
  void lower_keys(const NearTriangle& triangle, std::size_t place, const glm::ivec3& size,
                  Worker& worker) const;
  void lower_batch(const NearTriangle& triangle, std::size_t place, Batch& batch) const;
  void sort_by_triangle(Worker& worker) const;
  void find_colours(Worker& worker) const;
  void colour_tile(const VoxelIntervals::TileView& tile, Worker& worker) const;
  void append(int first, int last, std::uint32_t label, Worker& worker) const;
};

/// Of a surface all voxels are near it; of a solid those are looked for.
bool VoxelColouring::Impl::find_near(const VoxelIntervals::TileView& tile, const glm::ivec3& size,
                                     Worker& worker) const {
  if (!options.solid) return worker.near.reset(tile.offsets, tile.items);
  worker.collector.clear();
  for (std::size_t place = 0; place < worker.triangles.size(); ++place) {
    worker.triangles.with(place, [&](const NearTriangle& triangle) {
      triangle.columns_within(reach(), size, [&](int u, int v, int first, int last) {
        worker.collector.add(v * kSide + u, first, last);
      });
    });
    worker.collector.compact_if_large();
  }
  worker.collector.finish();
  const auto offsets = worker.collector.offsets();
  worker.near_offsets.assign(1, 0);
  worker.near_items.clear();
  for (std::size_t local = 0; local < VoxelIntervals::kTileColumns; ++local) {
    append_common(
        tile.items.subspan(tile.offsets[local], tile.offsets[local + 1] - tile.offsets[local]),
        worker.collector.items().subspan(offsets[local], offsets[local + 1] - offsets[local]),
        worker.near_items);
    worker.near_offsets.push_back(static_cast<std::uint32_t>(worker.near_items.size()));
  }
  return worker.near.reset(worker.near_offsets, worker.near_items);
}

void VoxelColouring::Impl::find_nearest(const glm::ivec3& size, Worker& worker) const {
  for (std::size_t place = 0; place < worker.triangles.size(); ++place) {
    worker.triangles.with(
        place, [&](const NearTriangle& triangle) { lower_keys(triangle, place, size, worker); });
  }
}

/// Keys of all voxels that are nearer to a triangle than to those before it.
void VoxelColouring::Impl::lower_keys(const NearTriangle& triangle, std::size_t place,
                                      const glm::ivec3& size, Worker& worker) const {
  NearVoxels& near = worker.near;
  Batch& batch = *worker.batch;
  batch.centres.count = 0;
  triangle.columns_within(reach(), size, [&](int u, int v, int first, int last) {
    const auto local = static_cast<std::size_t>(v * kSide + u);
    for (std::uint32_t i = near.offsets[local]; i < near.offsets[local + 1]; ++i) {
      const Interval run = near.runs[i];
      if (run.last < first) continue;
      if (run.first > last) break;
      const int begin = std::max<int>(first, run.first), end = std::min<int>(last, run.last);
      std::uint64_t* key = near.keys.data() + near.first[i] + (begin - run.first);
      for (int w = begin; w <= end; ++w, ++key) {
        if (batch.centres.count == VoxelCentres::kMost) lower_batch(triangle, place, batch);
        batch.keys[batch.centres.count] = key;
        batch.centres.add(u, v, w);
      }
    }
  });
  lower_batch(triangle, place, batch);
}

/// Keys of the voxels of a batch.
void VoxelColouring::Impl::lower_batch(const NearTriangle& triangle, std::size_t place,
                                       Batch& batch) const {
  constexpr double kScale = 2147483648.0;  // the square of the farthest is 1
  const double most = reach() * reach() + 1e-9;
  find_distances2(triangle, batch.centres, batch.squares);
  for (std::size_t i = 0; i < batch.centres.count; ++i) {
    const double square = batch.squares[i];
    const auto far = static_cast<std::int64_t>(std::min(square, 2.0) * kScale + 0.5);
    const std::uint64_t key = static_cast<std::uint64_t>(far) << 32 | place;
    *batch.keys[i] = std::min(*batch.keys[i], square > most ? kFar : key);
  }
  batch.centres.count = 0;
}

/// Lists the voxels of each triangle. Keys are 0 afterwards, the colour of none.
void VoxelColouring::Impl::sort_by_triangle(Worker& worker) const {
  NearVoxels& near = worker.near;
  std::vector<std::uint32_t>& next = worker.near_ends;
  next.assign(worker.triangles.size() + 1, 0);
  for (const std::uint64_t key : near.keys) {
    if (key != kFar) ++next[static_cast<std::uint32_t>(key) + 1];
  }
  for (std::size_t i = 1; i < next.size(); ++i) next[i] += next[i - 1];
  worker.near_voxels.resize(next.back());
  for (std::size_t local = 0; local < VoxelIntervals::kTileColumns; ++local) {
    for (std::uint32_t run = near.offsets[local]; run < near.offsets[local + 1]; ++run) {
      std::uint32_t at = near.first[run];
      for (int w = near.runs[run].begin(); w < near.runs[run].end(); ++w, ++at) {
        const std::uint64_t key = near.keys[at];
        near.keys[at] = 0;
        if (key == kFar) continue;
        worker.near_voxels[next[static_cast<std::uint32_t>(key)]++] = {
            at, static_cast<std::uint8_t>(local % kSide), static_cast<std::uint8_t>(local / kSide),
            static_cast<std::uint16_t>(w)};
      }
    }
  }
}

/// Puts colours in the place of keys.
void VoxelColouring::Impl::find_colours(Worker& worker) const {
  Batch& batch = *worker.batch;
  std::uint32_t at = 0;
  for (std::size_t place = 0; place < worker.triangles.size(); ++place) {
    const std::uint32_t end = worker.near_ends[place];
    if (at == end) continue;
    const std::uint32_t number = worker.triangles.number(place);
    if (const auto one = worker.probe.only_colour(number)) {
      for (; at < end; ++at) worker.near.keys[worker.near_voxels[at].key] = packed_colour(*one);
    }
    while (at < end) {
      const std::uint32_t begin = at;
      batch.centres.count = 0;
      for (; at < end && batch.centres.count < VoxelCentres::kMost; ++at) {
        const NearVoxel& voxel = worker.near_voxels[at];
        batch.centres.add(voxel.u, voxel.v, voxel.w);
      }
      worker.triangles.with(place, [&](const NearTriangle& triangle) {
        find_nearest_points(triangle, batch.centres, batch.weights);
      });
      worker.probe.colours(number, std::span(batch.weights).first(at - begin), batch.colours);
      for (std::uint32_t i = begin; i < at; ++i) {
        worker.near.keys[worker.near_voxels[i].key] = packed_colour(batch.colours[i - begin]);
      }
    }
  }
}

void VoxelColouring::Impl::append(int first, int last, std::uint32_t label, Worker& worker) const {
  const bool starts = worker.items.size() == worker.offsets.back();
  if (!starts && worker.labels.back() == label && worker.items.back().last + 1 == first) {
    worker.items.back().last = static_cast<std::uint16_t>(last);
    return;
  }
  worker.items.push_back({static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(last)});
  worker.labels.push_back(label);
}

void VoxelColouring::Impl::colour_tile(const VoxelIntervals::TileView& tile, Worker& worker) const {
  const NearVoxels& near = worker.near;
  const std::uint32_t inside = packed_colour(options.inside);
  worker.offsets.assign(1, 0);
  worker.items.clear();
  worker.labels.clear();
  for (std::size_t local = 0; local < VoxelIntervals::kTileColumns; ++local) {
    std::uint32_t run = near.offsets[local];
    for (std::uint32_t i = tile.offsets[local]; i < tile.offsets[local + 1]; ++i) {
      const Interval interval = tile.items[i];
      int at = interval.begin();
      for (; run < near.offsets[local + 1] && near.runs[run].begin() < interval.end(); ++run) {
        if (near.runs[run].begin() > at) {
          append(at, near.runs[run].begin() - 1, inside, worker);
        }
        const std::uint64_t* colour = near.keys.data() + near.first[run];
        for (at = near.runs[run].begin(); at < near.runs[run].end(); ++at, ++colour) {
          auto label = static_cast<std::uint32_t>(*colour);
          if (label == 0 && options.solid) label = inside;
          if (label != 0) append(at, at, label, worker);
        }
      }
      if (at < interval.end()) append(at, interval.end() - 1, inside, worker);
    }
    worker.offsets.push_back(static_cast<std::uint32_t>(worker.items.size()));
  }
}

VoxelColouring::VoxelColouring(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VoxelColouring::VoxelColouring(VoxelColouring&&) noexcept = default;
VoxelColouring& VoxelColouring::operator=(VoxelColouring&&) noexcept = default;
VoxelColouring::~VoxelColouring() = default;

Result<VoxelColouring> VoxelColouring::create(const TriangleSoup& mesh, const VoxelGrid& grid,
                                              const SurfaceColours& colours,
                                              const VoxelColourOptions& options,
                                              const Execution& execution) {
  auto lattice = snap_to_lattice(mesh, grid, execution);
  if (!lattice) return tl::unexpected(lattice.error());
  auto impl = std::make_unique<Impl>();
  impl->options = options;
  impl->mesh = *std::move(lattice);
  impl->colours = &colours;
  return VoxelColouring(std::move(impl));
}

Result<VoxelIntervals> VoxelColouring::colour(const VoxelIntervals& slab,
                                              const Execution& execution) {
  try {
    const AxisFrame frame(slab.axis());
    VoxelIntervals result(slab.grid(), slab.axis(), slab.v_begin(), slab.v_end());
    shell::Budget budget(execution.memory_limit);
    const auto margin = static_cast<int>(std::ceil(impl_->reach() * kLatticeSteps)) + 1;
    const auto bins = shell::bin_by_tile(impl_->mesh, slab, execution, budget, margin);
    if (!bins) return tl::unexpected(bins.error());
    auto& workers = impl_->workers;
    while (workers.size() < static_cast<std::size_t>(execution.thread_count())) {
      workers.emplace_back(impl_->colours->probe());
    }
    const auto make_tile = [&](std::size_t tile, int worker_index) {
      Worker& worker = workers[static_cast<std::size_t>(worker_index)];
      const int tu = static_cast<int>(tile) % slab.tiles_u();
      const int tv = static_cast<int>(tile) / slab.tiles_u();
      if (slab.tile_empty(tu, tv)) return true;
      const std::uint64_t held = worker.bytes();
      const auto numbers =
          std::span(bins->triangles)
              .subspan(bins->offsets[tile], bins->offsets[tile + 1] - bins->offsets[tile]);
      const shell::Window window = shell::window_of(slab, tu, tv);
      const glm::ivec3 size(window.u_end - window.u_begin, window.v_end - window.v_begin,
                            window.w_end);
      worker.triangles.start(numbers, impl_->mesh, frame,
                             shell::Vector{window.u_begin, window.v_begin, 0});
      const VoxelIntervals::TileView view = slab.tile(tu, tv);
      if (!impl_->find_near(view, size, worker)) return false;
      impl_->find_nearest(size, worker);
      impl_->sort_by_triangle(worker);
      impl_->find_colours(worker);
      impl_->colour_tile(view, worker);
      if (!worker.items.empty()) {
        result.set_tile(tu, tv, worker.offsets, worker.items, worker.labels);
      }
      const std::uint64_t now = worker.bytes();
      return budget.add((now > held ? now - held : 0) +
                        worker.items.size() * (sizeof(Interval) + sizeof(std::uint32_t)) +
                        worker.offsets.size() * sizeof(std::uint32_t));
    };
    const auto done = shell::for_each_tile(execution, bins->offsets.size() - 1, budget.limit(),
                                           make_tile, "colours of voxels");
    if (!done) return tl::unexpected(done.error());
    return result;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "colours of voxels: out of memory");
  }
}

}  // namespace strata
