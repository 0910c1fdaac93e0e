#include "voxelize/open/lost_walls.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <memory>
#include <mutex>
#include <tuple>
#include <utility>

#include "hashbuffer/tile_builder.h"
#include "mesh/disjoint_sets.h"
#include "raster/tile_bins.h"
#include "raster/triangle_setup.h"
#include "strata/hashbuffer/build_ldi.h"

// Three looks, each at what the last one left: cells in which faces look opposite ways; rays there,
// some way apart; all columns of the tiles where such a ray found a wall.

namespace strata {
namespace {

constexpr int kMostCells = 64;             // a side
constexpr double kFacing = 0.5;            // a face looks along an axis: 60 degrees
constexpr double kOpposite = -0.985;       // two look opposite ways: 10 degrees
constexpr double kNoThickness = 1e-6;      // voxels
constexpr double kMostColumns = 1u << 17;  // looked at closely along an axis, about
constexpr std::size_t kBlock = 1u << 14;   // triangles a task

/// Bits of a cell: along axis a, faces that are entered are 1 << 2 a, those that are left 2 << 2 a.
using Sides = std::uint8_t;

using Corners = std::array<glm::dvec3, 3>;

/// A triangle in cells.
struct Face {
  Corners corners;
  glm::dvec3 normal;  ///< of any length
  double square;      ///< of that length

  /// Whether it looks along an axis, or against it.
  [[nodiscard]] bool faces(int axis) const {
    return (normal[axis] * normal[axis] >= kFacing * kFacing * square) & (square > 0.0);
  }
};

class WallSearch {
 public:
  WallSearch(const TriangleSoup& mesh, const VoxelGrid& grid, const LostWallOptions& options,
             const Execution& execution)
      : mesh_(mesh), grid_(grid), options_(options), execution_(execution) {
    execution_.progress = {};
    const int side = std::max({grid.dims.x, grid.dims.y, grid.dims.z});
    step_ = std::max(1, (side + kMostCells - 1) / kMostCells);
    scale_ = 1.0 / (grid.voxel_size * double(step_));
    shift_ = -grid.origin * scale_;
    cells_ = (grid.dims + step_ - 1) / step_;
    count_ = static_cast<std::size_t>(cells_.x) * static_cast<std::size_t>(cells_.y) *
             static_cast<std::size_t>(cells_.z);
    sides_.reset(static_cast<Sides*>(std::calloc(count_, 1)));
  }

  Result<LostWalls> run() {
    if (sides_ == nullptr)
      return fail(ErrorCode::kLimit, "out of memory while looking for thin walls");
    mark_sides();
    if (stopped()) return fail(ErrorCode::kCancelled, "stopped");
    if (!keep_near()) return LostWalls{};
    auto snapped = snap_to_lattice(mesh_, grid_, execution_);
    if (!snapped) return tl::unexpected(snapped.error());
    lattice_ = std::move(*snapped);
    choose_near();
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      const std::vector<char> tiles = sample(axis);
      if (stopped()) return fail(ErrorCode::kCancelled, "stopped");
      if (auto done = walk(axis, tiles); !done) return tl::unexpected(done.error());
    }
    return gather();
  }

 private:
  struct Free {
    void operator()(Sides* memory) const { std::free(memory); }
  };
  /// A crossing of a ray of sample().
  struct Hit {
    std::uint32_t column, depth, triangle;
    bool exit;
  };
  /// A column that passes through a wall between two centres.
  struct Miss {
    int axis, u, v;
    std::uint32_t in, out;  ///< triangles
    double low, high;       ///< along the axis, voxels
    std::uint32_t wall = 0;
  };

  /// The cells of a box.
  struct CellBox {
    glm::ivec3 first, last;
    /// At most 8 cells; a triangle within the box is taken to pass through all of them.
    [[nodiscard]] bool small() const {
      const glm::ivec3 size = last - first;
      return size.x <= 1 && size.y <= 1 && size.z <= 1;
    }
  };

  [[nodiscard]] bool stopped() const { return execution_.stop.stop_requested(); }
  [[nodiscard]] bool taken_away(std::size_t t) const {
    return options_.taken_away && options_.taken_away(static_cast<std::uint32_t>(t));
  }
  [[nodiscard]] Corners corners_of(std::size_t t) const {
    const glm::uvec3 corners = mesh_.triangles[t];
    return {mesh_.positions[corners.x] * scale_ + shift_,
            mesh_.positions[corners.y] * scale_ + shift_,
            mesh_.positions[corners.z] * scale_ + shift_};
  }
  [[nodiscard]] Face face(std::size_t t) const { return face_of(corners_of(t)); }
  [[nodiscard]] static Face face_of(const Corners& corners) {
    Face result;
    result.corners = corners;
    const auto& [a, b, c] = corners;
    result.normal = glm::cross(b - a, c - a);
    result.square = glm::dot(result.normal, result.normal);
    return result;
  }
  [[nodiscard]] static Sides sides_of(const Face& face, bool away) {
    unsigned sides = 0;  // without branches, which are hard to foretell
    for (int axis = 0; axis < 3; ++axis) {
      const unsigned side = 1u + static_cast<unsigned>((face.normal[axis] > 0.0) != away);
      sides |= side * static_cast<unsigned>(face.faces(axis)) << (2 * axis);
    }
    return static_cast<Sides>(sides);
  }

  [[nodiscard]] std::size_t cell(const glm::ivec3& at) const {
    return (static_cast<std::size_t>(at.z) * static_cast<std::size_t>(cells_.y) +
            static_cast<std::size_t>(at.y)) *
               static_cast<std::size_t>(cells_.x) +
           static_cast<std::size_t>(at.x);
  }

  /// The cells of the box of a triangle. @return false outside of the grid
  [[nodiscard]] bool find_box(const Corners& corners, CellBox& box) const {
    const auto& [a, b, c] = corners;
    const glm::dvec3 low = glm::min(a, glm::min(b, c)), high = glm::max(a, glm::max(b, c));
    const glm::dvec3 most(cells_);
    if (!(high.x >= 0 && high.y >= 0 && high.z >= 0) || low.x >= most.x || low.y >= most.y ||
        low.z >= most.z) {
      return false;
    }
    box = {glm::ivec3(glm::max(low, 0.0)), glm::ivec3(glm::min(high, most - 1.0))};
    return true;
  }
  /// Calls visit(cell) for the cells of a small box, for some several times, without a branch:
  /// whether a box is one cell wide or two is hard to foretell.
  template <class Visit>
  void for_small_box(const CellBox& box, Visit&& visit) const {
    const std::size_t first = cell(box.first), row = cell({box.first.x, box.last.y, box.first.z}),
                      layer = cell({box.first.x, box.first.y, box.last.z}) - first;
    const auto wide = static_cast<std::size_t>(box.last.x - box.first.x);
    for (const std::size_t at : {first, row, first + layer, row + layer}) {
      visit(at);
      visit(at + wide);
    }
  }
  /// Calls visit(cell) for the cells of the box of a face that it may pass through.
  template <class Visit>
  void for_cells(const Face& face, const CellBox& box, Visit&& visit) const {
    if (box.small()) return for_small_box(box, visit);
    const auto& [first, last] = box;
    const glm::dvec3& a = face.corners[0];
    const glm::dvec3 most(cells_);
    const glm::dvec3 n = glm::abs(face.normal);
    const int w = n.x >= n.y && n.x >= n.z ? 0 : n.y >= n.z ? 1 : 2;
    const AxisFrame frame(static_cast<Axis>(w));
    const double du = -face.normal[frame.u] / face.normal[w],
                 dv = -face.normal[frame.v] / face.normal[w];
    const double room = 0.5 * (std::abs(du) + std::abs(dv)) + 1e-6;
    glm::ivec3 place;
    for (int v = first[frame.v]; v <= last[frame.v]; ++v) {
      for (int u = first[frame.u]; u <= last[frame.u]; ++u) {
        const double middle = a[w] + du * (u + 0.5 - a[frame.u]) + dv * (v + 0.5 - a[frame.v]);
        place[frame.u] = u, place[frame.v] = v;
        const int begin =
            std::max(first[w], static_cast<int>(std::clamp(middle - room, 0.0, most[w])));
        const int end = static_cast<int>(std::clamp(middle + room, -1.0, double(last[w])));
        for (int k = begin; k <= end; ++k) {
          place[w] = k;
          visit(cell(place));
        }
      }
    }
  }

  template <class Body>
  void for_triangles(Body&& body) const {
    const std::size_t count = mesh_.triangles.size();
    parallel_for(execution_, (count + kBlock - 1) / kBlock, [&](std::size_t block, int) {
      body(block, block * kBlock, std::min(count, (block + 1) * kBlock));
    });
  }

  /// Which ways faces look in each cell. Of triangles that are all smaller than a cell every fourth
  /// will do.
  void mark_sides() {
    const glm::dvec3& voxel_size = grid_.voxel_size;
    const double least = std::min({voxel_size.x, voxel_size.y, voxel_size.z}) * step_;
    const std::uint32_t skip = options_.longest_edge > 0 && options_.longest_edge < least ? 3 : 0;
    for_triangles([&](std::size_t, std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        const glm::uvec3 corners = mesh_.triangles[t];
        if (((corners.x + corners.y + corners.z) & skip) != 0) continue;
        const Face triangle = face(t);
        const Sides sides = sides_of(triangle, taken_away(t));
        CellBox box;
        if (sides == 0 || !find_box(triangle.corners, box)) continue;
        for_cells(triangle, box, [&](std::size_t at) {
          std::atomic_ref<Sides> place(sides_[at]);
          if ((place.load(std::memory_order_relaxed) & sides) == sides) return;
          place.fetch_or(sides, std::memory_order_relaxed);
        });
      }
    });
  }

  /// Leaves of the cells those with a face to be entered and one to be left in the same cell or the
  /// next: bit a for axis a. @return whether there are some
  bool keep_near() {
    const std::size_t strides[3] = {
        1, static_cast<std::size_t>(cells_.x),
        static_cast<std::size_t>(cells_.x) * static_cast<std::size_t>(cells_.y)};
    std::vector<std::pair<std::size_t, Sides>> near;
    const auto look = [&](std::size_t at) {
      const unsigned here = sides_[at];
      for (unsigned axis = 0; axis < 3; ++axis) {
        if ((here >> (2 * axis) & 1u) == 0) continue;
        const unsigned left = 2u << (2 * axis);
        const auto length = static_cast<std::size_t>(cells_[static_cast<int>(axis)]);
        const std::size_t beyond = at + strides[axis];  // another row, where `at` is the last
        const bool next = beyond < count_ && (sides_[beyond] & left) != 0 &&
                          at / strides[axis] % length + 1 != length;
        const auto bit = static_cast<Sides>(1u << axis);
        if (next || (here & left) != 0) near.emplace_back(at, bit);
        if (next) near.emplace_back(beyond, bit);
      }
    };
    std::size_t at = 0;
    for (; at + 8 <= count_; at += 8) {
      std::uint64_t word = 0;  // most cells are empty
      std::memcpy(&word, sides_.get() + at, 8);
      if ((word & 0x1515151515151515u) == 0) continue;
      for (std::size_t i = at; i < at + 8; ++i) look(i);
    }
    for (; at < count_; ++at) look(at);
    if (near.empty()) return false;
    std::memset(sides_.get(), 0, count_);
    for (const auto& [place, bit] : near) sides_[place] = static_cast<Sides>(sides_[place] | bit);
    return true;
  }

  /// The column of the n-th sample of row j.
  [[nodiscard]] int sampled(int row, int n) const {
    return n * step_ + (row * (step_ * 5 / 8 | 1)) % step_;
  }

  /// The triangles that look along an axis in a cell of those: near_, bit a for axis a.
  void choose_near() {
    std::vector<std::vector<std::pair<std::uint32_t, Sides>>> parts(
        (mesh_.triangles.size() + kBlock - 1) / kBlock);
    for_triangles([&](std::size_t block, std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        const Corners corners = corners_of(t);
        CellBox box;
        unsigned axes = 0, cells = 0;
        const auto add_cell = [&](std::size_t at) { cells |= sides_[at]; };
        if (!find_box(corners, box)) continue;
        if (box.small()) {
          for_small_box(box, add_cell);
          if (cells == 0) continue;  // most
        }
        const Face triangle = face_of(corners);
        for (int axis = 0; axis < 3; ++axis) axes |= (triangle.faces(axis) ? 1u : 0u) << axis;
        if (axes == 0) continue;
        if (!box.small()) for_cells(triangle, box, add_cell);
        if ((axes & cells) == 0) continue;
        parts[block].emplace_back(static_cast<std::uint32_t>(t), static_cast<Sides>(axes & cells));
      }
    });
    for (const auto& part : parts) near_.insert(near_.end(), part.begin(), part.end());
  }

  /// The hits of sampled rays on a range of near_.
  void hit(Axis axis, const RasterTarget& target, std::size_t begin, std::size_t end,
           std::vector<Hit>& hits) const {
    const AxisFrame frame(axis);
    const Sides bit = static_cast<Sides>(1u << frame.w);
    for (std::size_t i = begin; i < end; ++i) {
      if ((near_[i].second & bit) == 0) continue;
      const std::uint32_t t = near_[i].first;
      const glm::uvec3 corners = mesh_.triangles[t];
      TriangleSetup setup;
      if (!setup_triangle(lattice_.vertices[corners.x], lattice_.vertices[corners.y],
                          lattice_.vertices[corners.z], frame, setup)) {
        continue;
      }
      const PixelRect box = pixel_bounds(setup, {0, 0, target.width, target.height});
      const TriangleSetup::Edge edges[3] = {setup.edge(0), setup.edge(1), setup.edge(2)};
      const bool exit = setup.exit != taken_away(t);
      for (int row = (box.v0 + step_ - 1) / step_; row * step_ < box.v1; ++row) {
        const int v = row * step_;
        for (int n = std::max(0, box.u0 / step_ - 1); sampled(row, n) < box.u1; ++n) {
          const int u = sampled(row, n);
          if (u < box.u0) continue;
          const std::int64_t pu = std::int64_t{u} * kLatticeSteps + kLatticeSteps / 2,
                             pv = std::int64_t{v} * kLatticeSteps + kLatticeSteps / 2;
          if (std::any_of(std::begin(edges), std::end(edges),
                          [&](const auto& e) { return e.a * pu + e.b * pv + e.c < 0; })) {
            continue;
          }
          const double rise = (static_cast<double>(setup.slope_u) * double(pu - setup.u[0]) +
                               static_cast<double>(setup.slope_v) * double(pv - setup.v[0])) /
                              static_cast<double>(setup.area);
          const std::int64_t depth = setup.w0 + static_cast<std::int64_t>(std::floor(rise));
          if (depth < 0 || depth >= target.depth_limit) continue;
          glm::ivec3 place;
          place[frame.u] = u / step_, place[frame.v] = v / step_;
          place[frame.w] =
              std::min(static_cast<int>(depth / kLatticeSteps) / step_, cells_[frame.w] - 1);
          if ((sides_[cell(place)] & bit) == 0) continue;
          hits.push_back({static_cast<std::uint32_t>(row * (kMostCells + 1) + n),
                          static_cast<std::uint32_t>(depth), t, exit});
        }
      }
    }
  }

  /// Whether a ray along `axis` enters by one triangle and leaves by the other as it does a wall.
  [[nodiscard]] bool is_wall(std::uint32_t in, std::uint32_t out, int axis) const {
    glm::dvec3 a = glm::normalize(face(in).normal), b = glm::normalize(face(out).normal);
    if (taken_away(in)) a = -a;
    if (taken_away(out)) b = -b;
    return a[axis] <= -kFacing && b[axis] >= kFacing && glm::dot(a, b) <= kOpposite;
  }
  static std::uint32_t voxel(std::uint32_t depth) {
    return (depth + kLatticeSteps / 2) >> kLatticeBits;
  }

  /// The tiles in which sampled rays find walls that they may lose. Says how far apart walk() takes
  /// columns.
  std::vector<char> sample(Axis axis) {
    const RasterTarget target = raster_target(grid_, axis);
    const int tiles_u = (target.width + kTileSide - 1) / kTileSide,
              tiles_v = (target.height + kTileSide - 1) / kTileSide;
    std::vector<char> tiles(static_cast<std::size_t>(tiles_u) * static_cast<std::size_t>(tiles_v));
    std::vector<std::vector<Hit>> parts((near_.size() + kBlock - 1) / kBlock);
    parallel_for(execution_, parts.size(), [&](std::size_t block, int) {
      hit(axis, target, block * kBlock, std::min(near_.size(), (block + 1) * kBlock), parts[block]);
    });
    std::vector<Hit> hits;
    for (const auto& part : parts) hits.insert(hits.end(), part.begin(), part.end());
    std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
      return std::tie(a.column, a.depth, a.exit, a.triangle) <
             std::tie(b.column, b.depth, b.exit, b.triangle);
    });
    std::size_t walls = 0;
    for (std::size_t i = 1; i < hits.size(); ++i) {
      const Hit &in = hits[i - 1], &out = hits[i];
      if (in.column != out.column || in.exit || !out.exit || voxel(in.depth) != voxel(out.depth)) {
        continue;
      }
      const int row = static_cast<int>(out.column) / (kMostCells + 1);
      const int u = sampled(row, static_cast<int>(out.column) % (kMostCells + 1));
      char& tile = tiles[static_cast<std::size_t>(row * step_ / kTileSide * tiles_u) +
                         static_cast<std::size_t>(u / kTileSide)];
      if (!is_wall(in.triangle, out.triangle, static_cast<int>(axis))) continue;
      tile = 1;
      ++walls;
    }
    int& apart = apart_[static_cast<std::size_t>(axis)];
    const double columns = static_cast<double>(walls) * step_ * step_;
    while (2 * apart <= step_ && columns > kMostColumns * apart * apart) apart *= 2;
    return tiles;
  }

  /// Where a column meets the plane of a triangle, in voxels.
  [[nodiscard]] double height(std::uint32_t t, const AxisFrame& frame, int u, int v) const {
    const Face triangle = face(t);
    const glm::dvec3 &p = triangle.corners[0], &n = triangle.normal;
    const double at_u = (u + 0.5) / step_, at_v = (v + 0.5) / step_;
    return step_ *
           (p[frame.w] -
            (n[frame.u] * (at_u - p[frame.u]) + n[frame.v] * (at_v - p[frame.v])) / n[frame.w]);
  }

  /// Empty intervals between the faces of walls, of one column.
  void walk_column(std::span<const DepthItem> list, Axis axis, int u, int v, std::uint32_t limit,
                   std::vector<Miss>& misses) const {
    const InsideRule rule = options_.filter != nullptr ? InsideRule::kWinding : options_.rule;
    const AxisFrame frame(axis);
    int winding = 0;
    DepthItem entry;
    for (const DepthItem item : list) {
      const bool was = is_inside(rule, winding);
      winding += item.exit() ? -1 : 1;
      const bool now = is_inside(rule, winding);
      if (now && !was) entry = item;
      if (now || !was) continue;
      if (voxel(item.depth()) != voxel(entry.depth())) continue;
      if (item.depth() == entry.depth() && (entry.depth() == 0 || entry.depth() + 1 >= limit)) {
        continue;  // beyond the grid
      }
      if (!is_wall(entry.triangle(), item.triangle(), frame.w)) continue;
      const double low = height(entry.triangle(), frame, u, v),
                   high = height(item.triangle(), frame, u, v);
      if (!(high - low > kNoThickness)) continue;
      misses.push_back({frame.w, u, v, entry.triangle(), item.triangle(), low, high});
    }
  }

  /// All columns of the tiles.
  Result<void> walk(Axis axis, const std::vector<char>& tiles) {
    std::vector<std::size_t> chosen;
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      if (tiles[i] != 0) chosen.push_back(i);
    }
    if (chosen.empty()) return {};
    const RasterTarget target = raster_target(grid_, axis);
    auto bins = bin_triangles(lattice_, target, execution_);
    if (!bins) return tl::unexpected(bins.error());
    std::mutex mutex;
    Result<void> status;
    std::vector<std::vector<Miss>> parts(chosen.size());
    struct Worker {
      ItemTileBuilder builder;
      std::unique_ptr<TileListFilter::Worker> filter;
      std::vector<DepthItem> list;
    };
    std::vector<Worker> workers(static_cast<std::size_t>(execution_.thread_count()));
    parallel_for(execution_, chosen.size(), [&](std::size_t i, int index) {
      Worker& worker = workers[static_cast<std::size_t>(index)];
      const int tu = static_cast<int>(chosen[i]) % bins->tiles_u,
                tv = static_cast<int>(chosen[i]) / bins->tiles_u;
      const auto built = worker.builder.build(lattice_, target, bins->tile(tu, tv), tu, tv);
      if (!built) {
        const std::lock_guard lock(mutex);
        if (status) status = tl::unexpected(built.error());
        return;
      }
      if (options_.filter != nullptr && !worker.filter) worker.filter = options_.filter->worker();
      const TileLists<DepthItem> lists = worker.filter ? worker.filter->apply(*built) : *built;
      const int apart = apart_[static_cast<std::size_t>(axis)];
      for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
        const int u = tu * kTileSide + static_cast<int>(pixel) % kTileSide,
                  v = tv * kTileSide + static_cast<int>(pixel) / kTileSide;
        if (u % apart != 0 || v % apart != 0) continue;
        worker.list.clear();
        for_each_item(lists, pixel, [&](DepthItem item) { worker.list.push_back(item); });
        walk_column(worker.list, axis, u, v, target.depth_limit, parts[i]);
      }
    });
    if (!status) return status;
    if (stopped()) return fail(ErrorCode::kCancelled, "stopped");
    for (const auto& part : parts) misses_.insert(misses_.end(), part.begin(), part.end());
    return {};
  }

  /// Numbers the walls: triangles that a column joins, or a vertex.
  void join() {
    std::vector<std::uint32_t> involved;
    for (const Miss& miss : misses_) involved.insert(involved.end(), {miss.in, miss.out});
    std::sort(involved.begin(), involved.end());
    involved.erase(std::unique(involved.begin(), involved.end()), involved.end());
    const auto place = [&](std::uint32_t t) {
      return static_cast<std::uint32_t>(std::lower_bound(involved.begin(), involved.end(), t) -
                                        involved.begin());
    };
    detail::DisjointSets walls(involved.size());
    for (const Miss& miss : misses_) walls.join(place(miss.in), place(miss.out));
    struct Corner {
      glm::ivec3 at;
      std::uint32_t triangle;
    };
    std::vector<Corner> corners;
    for (std::uint32_t i = 0; i < involved.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        corners.push_back({lattice_.vertices[mesh_.triangles[involved[i]][k]], i});
      }
    }
    const auto key = [](const Corner& c) { return std::tie(c.at.x, c.at.y, c.at.z); };
    std::sort(corners.begin(), corners.end(),
              [&](const Corner& a, const Corner& b) { return key(a) < key(b); });
    for (std::size_t i = 1; i < corners.size(); ++i) {
      if (corners[i].at != corners[i - 1].at) continue;
      walls.join(corners[i].triangle, corners[i - 1].triangle);
    }
    for (Miss& miss : misses_) miss.wall = walls.find(place(miss.in));
  }

  /// Whether 2 x 2 columns stand together; `misses` are of one wall and axis, sorted by v, u.
  [[nodiscard]] bool is_wide(std::span<const Miss> misses) const {
    const AxisFrame frame(static_cast<Axis>(misses.front().axis));
    const int apart = apart_[static_cast<std::size_t>(frame.w)];
    const int du = grid_.dims[frame.u] > apart ? apart : 0,
              dv = grid_.dims[frame.v] > apart ? apart : 0;
    const auto has = [&](int u, int v) {
      const auto at = std::lower_bound(
          misses.begin(), misses.end(), std::pair(v, u),
          [](const Miss& m, const std::pair<int, int>& p) { return std::pair(m.v, m.u) < p; });
      return at != misses.end() && at->u == u && at->v == v;
    };
    return std::any_of(misses.begin(), misses.end(), [&](const Miss& m) {
      return has(m.u + du, m.v) && has(m.u, m.v + dv) && has(m.u + du, m.v + dv);
    });
  }

  [[nodiscard]] LostWall measure(std::span<const Miss> misses) const {
    const AxisFrame frame(static_cast<Axis>(misses.front().axis));
    const int apart = apart_[static_cast<std::size_t>(frame.w)];
    LostWall wall;
    wall.axis = static_cast<Axis>(frame.w);
    wall.low = glm::dvec3(INFINITY), wall.high = glm::dvec3(-INFINITY);
    for (const Miss& miss : misses) {
      glm::dvec3 low(0), high(0);
      low[frame.u] = miss.u, high[frame.u] = std::min(miss.u + apart, grid_.dims[frame.u]);
      low[frame.v] = miss.v, high[frame.v] = std::min(miss.v + apart, grid_.dims[frame.v]);
      low[frame.w] = miss.low, high[frame.w] = miss.high;
      wall.low = glm::min(wall.low, low);
      wall.high = glm::max(wall.high, high);
      wall.thickness = std::max(wall.thickness, miss.high - miss.low);
    }
    wall.low = grid_.origin + wall.low * grid_.voxel_size;
    wall.high = grid_.origin + wall.high * grid_.voxel_size;
    wall.columns = misses.size() * static_cast<std::size_t>(apart * apart);
    return wall;
  }

  LostWalls gather() {
    LostWalls found;
    if (misses_.empty()) return found;
    join();
    const auto key = [](const Miss& m) { return std::tie(m.wall, m.axis, m.v, m.u, m.low); };
    std::sort(misses_.begin(), misses_.end(),
              [&](const Miss& a, const Miss& b) { return key(a) < key(b); });
    std::vector<LostWall> walls;
    for (std::size_t i = 0; i < misses_.size();) {
      const std::uint32_t number = misses_[i].wall;
      LostWall largest;
      while (i < misses_.size() && misses_[i].wall == number) {
        const int axis = misses_[i].axis;
        std::size_t end = i;
        while (end < misses_.size() && misses_[end].wall == number && misses_[end].axis == axis) {
          ++end;
        }
        const auto seen = std::span<const Miss>(misses_).subspan(i, end - i);
        if (seen.size() > largest.columns && is_wide(seen)) largest = measure(seen);
        i = end;
      }
      if (largest.columns > 0) walls.push_back(largest);
    }
    std::sort(walls.begin(), walls.end(), [](const LostWall& a, const LostWall& b) {
      if (a.columns != b.columns) return a.columns > b.columns;
      return std::tie(a.low.x, a.low.y, a.low.z) < std::tie(b.low.x, b.low.y, b.low.z);
    });
    found.count = walls.size();
    walls.resize(std::min(walls.size(), LostWalls::kMostTold));
    found.largest = std::move(walls);
    return found;
  }

  const TriangleSoup& mesh_;
  const VoxelGrid& grid_;
  const LostWallOptions& options_;
  Execution execution_;
  std::array<int, 3> apart_{1, 1, 1};  ///< columns that walk() takes of each axis: every so many
  int step_ = 1;                       ///< voxels along a cell, and columns between sampled ones
  glm::ivec3 cells_;                   ///< along each axis
  glm::dvec3 scale_, shift_;           ///< world to cells
  std::size_t count_ = 0;
  std::unique_ptr<Sides[], Free> sides_;  ///< of each cell; memory that nobody writes costs nothing
  std::vector<std::pair<std::uint32_t, Sides>> near_;  ///< triangles, and axes
  LatticeMesh lattice_;
  std::vector<Miss> misses_;
};

}  // namespace

Result<LostWalls> find_lost_walls(const TriangleSoup& mesh, const VoxelGrid& grid,
                                  const LostWallOptions& options, const Execution& execution) {
  return WallSearch(mesh, grid, options, execution).run();
}

}  // namespace strata
