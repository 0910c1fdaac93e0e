#include "csg/solid_lists.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>
#include <utility>

#include "csg/column_surface.h"
#include "csg/geometry.h"
#include "csg/program.h"
#include "csg/solid_labels.h"
#include "csg/surface.h"
#include "csg/tile_surface.h"
#include "csg/tree_filter.h"
#include "hashbuffer/build_ldi.h"
#include "raster/lattice_mesh.h"

namespace strata::csg {
namespace {

/// What the filter's workers share.
struct Shared {
  static constexpr std::uint32_t kNoRank = 0xffffffffu;
  Program program;
  std::vector<InsideRule> rules;        ///< of each solid of the tree
  std::vector<std::uint32_t> solid_of;  ///< of each triangle of the soup
  std::vector<std::uint32_t> ranks;   ///< of each solid: its place among those that add, or kNoRank
  std::vector<std::uint32_t> labels;  ///< of each rank; none: the lists are not labelled
};

/// A set of small numbers that tells its least one: words of bits, and words of which are not 0.
class LeastOf {
 public:
  /// Of numbers below `count`.
  explicit LeastOf(std::size_t count) : words_((count + 63) / 64), tops_((count + 4095) / 4096) {}

  /// Puts a number in, or takes it out.
  void flip(std::uint32_t number) {
    std::uint64_t& word = words_[number / 64];
    word ^= std::uint64_t{1} << (number % 64);
    const std::uint64_t bit = std::uint64_t{1} << (number / 64 % 64);
    std::uint64_t& top = tops_[number / 4096];
    top = word != 0 ? top | bit : top & ~bit;
  }
  /// @pre there is one
  [[nodiscard]] std::uint32_t least() const {
    std::size_t top = 0;
    while (tops_[top] == 0) ++top;
    const std::size_t word = top * 64 + static_cast<std::size_t>(std::countr_zero(tops_[top]));
    return static_cast<std::uint32_t>(word * 64 +
                                      static_cast<std::size_t>(std::countr_zero(words_[word])));
  }

 private:
  std::vector<std::uint64_t> words_, tops_;
};

bool is_inside(InsideRule rule, int winding) {
  switch (rule) {
    case InsideRule::kWinding:
      return winding > 0;
    case InsideRule::kNonzero:
      return winding != 0;
    case InsideRule::kParity:
      break;
  }
  return winding % 2 != 0;
}

/// Sides of a measured box are no less than this part of the longest.
constexpr double kThinnest = 1e-9;

class BooleanWorker final : public TileListFilter::Worker {
 public:
  explicit BooleanWorker(const Shared& shared)
      : shared_(&shared),
        state_(shared.program),
        added_(std::max<std::size_t>(shared.labels.size(), 1)),
        windings_(shared.rules.size(), 0),
        offsets_(kTilePixels + 1) {}

  TileLists<DepthItem> apply(const TileLists<DepthItem>& lists) override {
    keys_.clear();
    int first_row = kTileSide, last_row = 0;
    for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
      offsets_[pixel] = static_cast<std::uint32_t>(keys_.size());
      items_.clear();
      for_each_item(lists, pixel, [this](DepthItem item) { items_.push_back(item); });
      if (items_.empty()) continue;
      if (!walk()) walk_open();
      if (keys_.size() > offsets_[pixel]) {
        const int row = static_cast<int>(pixel) / kTileSide;
        first_row = std::min(first_row, row);
        last_row = row + 1;
      }
    }
    offsets_[kTilePixels] = static_cast<std::uint32_t>(keys_.size());
    TileLists<DepthItem> result;
    result.row_begin = std::min(first_row, last_row);
    result.row_end = last_row;
    result.fragments = keys_.size();
    result.offsets = offsets_.data();
    result.keys = keys_.data();
    return result;
  }

  void surface(const TileLists<DepthItem>& lists, std::size_t pixel, std::span<const FaceRun> faces,
               std::vector<VoxelRun>& kept) override {
    items_.clear();
    for_each_item(lists, pixel, [this](DepthItem item) { items_.push_back(item); });
    find_flips();
    if (!surface_) surface_.emplace(shared_->program);
    surface_->find(flips_, faces, kept);
  }

 private:
  [[nodiscard]] std::uint32_t solid_of(DepthItem item) const {
    return shared_->solid_of[item.triangle()];
  }

  void flip(std::uint32_t solid) {
    state_.flip(solid);
    if (labelled() && shared_->ranks[solid] != Shared::kNoRank) added_.flip(shared_->ranks[solid]);
  }
  [[nodiscard]] bool labelled() const { return !shared_->labels.empty(); }
  /// What the ray is in: the label, 1 without labels; 0: not in the tree. Where the tree is true,
  /// it is in a solid that adds: were all of them outside, more solids would not make it true.
  [[nodiscard]] std::uint32_t label() const {
    if (!state_.value()) return 0;
    return labelled() ? shared_->labels[added_.least()] : 1;
  }
  /// A crossing at which the label becomes `label`; `triangle` is one that made it so.
  void put(std::uint32_t depth, std::uint32_t label, std::uint32_t triangle) {
    keys_.emplace_back(depth, label == 0, labelled() ? label : triangle);
  }

  /// The lists of a ray that leaves every solid as often as it enters it; false, without effect,
  /// for any other.
  bool walk() {
    bool balanced = true;
    const std::size_t before = keys_.size();
    std::uint32_t last = label();
    for (std::size_t i = 0; i < items_.size();) {
      const std::size_t begin = i;
      const std::uint32_t depth = items_[begin].depth();
      const bool value = state_.value();
      DepthItem shown = items_[begin];
      for (; i < items_.size() && items_[i].depth() == depth; ++i) {
        const std::uint32_t solid = solid_of(items_[i]);
        const InsideRule rule = shared_->rules[solid];
        int& winding = windings_[solid];
        const bool was = is_inside(rule, winding);
        winding += items_[i].exit() ? -1 : 1;
        if (is_inside(rule, winding) != was) {
          flip(solid);
          if (state_.value() != value) shown = items_[i];
        }
      }
      if (label() == last) continue;
      last = label();
      put(depth, last, shown.triangle());
    }
    for (const DepthItem item : items_) {
      const std::uint32_t solid = solid_of(item);
      const int winding = std::exchange(windings_[solid], 0);
      if (winding == 0) continue;
      if (is_inside(shared_->rules[solid], winding)) flip(solid);
      balanced = balanced && shared_->rules[solid] == InsideRule::kParity && winding % 2 == 0;
    }
    if (!balanced) keys_.resize(before);
    return balanced;
  }

  /// The same where a solid is open: partners are found solid by solid.
  void walk_open() {
    find_flips();
    std::uint32_t last = label();
    for (std::size_t i = 0; i < flips_.size();) {
      const std::size_t begin = i;
      for (; i < flips_.size() && flips_[i].depth == flips_[begin].depth; ++i) {
        flip(flips_[i].solid);
      }
      if (label() == last) continue;
      last = label();
      put(flips_[begin].depth, last, flips_[begin].triangle);
    }
  }

  /// Where the ray of items_ enters and leaves each solid, by depth.
  void find_flips() {
    std::stable_sort(items_.begin(), items_.end(),
                     [this](DepthItem a, DepthItem b) { return solid_of(a) < solid_of(b); });
    flips_.clear();
    for (std::size_t i = 0; i < items_.size();) {
      const std::size_t begin = i;
      const std::uint32_t solid = solid_of(items_[begin]);
      while (i < items_.size() && solid_of(items_[i]) == solid) ++i;
      flips_of(std::span(items_).subspan(begin, i - begin), solid, shared_->rules[solid], false,
               flips_);
    }
    std::sort(flips_.begin(), flips_.end(), [](const Flip& a, const Flip& b) {
      return a.depth != b.depth ? a.depth < b.depth : a.solid < b.solid;
    });
  }

  const Shared* shared_;
  ProgramState state_;
  LeastOf added_;  ///< ranks of the solids that the ray is in
  std::vector<int> windings_;
  std::vector<std::uint32_t> offsets_;
  std::vector<DepthItem> keys_, items_;
  std::vector<Flip> flips_;
  std::optional<ColumnSurface> surface_;
};

class BooleanFilter final : public TreeFilter {
 public:
  explicit BooleanFilter(const Shared& shared) : shared_(&shared) {}
  [[nodiscard]] std::unique_ptr<Worker> worker() const override {
    return std::make_unique<BooleanWorker>(*shared_);
  }
  [[nodiscard]] Tables tables() const override {
    return {shared_->program, shared_->rules, shared_->solid_of};
  }
  [[nodiscard]] bool labelled() const override { return !shared_->labels.empty(); }
  [[nodiscard]] std::uint32_t solid_of(std::uint32_t triangle) const override {
    return shared_->solid_of[triangle];
  }

 private:
  const Shared* shared_;
};

}  // namespace

struct SolidLists::Impl {
  Shared shared;
  TriangleSoup soup;
  std::vector<std::uint32_t> added;  ///< solids by rank
  BooleanFilter filter{shared};
};

SolidLists::SolidLists(const Tree& tree, Tree::NodeId root) : impl_(std::make_unique<Impl>()) {
  Shared& shared = impl_->shared;
  TriangleSoup& soup = impl_->soup;
  shared.program = compile(tree, root);
  const Geometry geometry(tree);
  for (std::uint32_t solid = 0; solid < tree.solids().size(); ++solid) {
    shared.rules.push_back(tree.solids()[solid].rule);
    if (shared.program.leaves[solid].parent == Program::kNone) continue;
    const Geometry::Part& part = geometry.parts()[solid];
    const auto first = static_cast<std::uint32_t>(soup.positions.size());
    soup.positions.insert(soup.positions.end(), part.positions.begin(), part.positions.end());
    for (const glm::uvec3& triangle : part.triangles) soup.triangles.push_back(triangle + first);
    shared.solid_of.resize(soup.triangles.size(), solid);
  }
  shared.ranks.resize(tree.solids().size(), Shared::kNoRank);
  impl_->added = added_solids(tree, root);
  for (std::uint32_t rank = 0; rank < impl_->added.size(); ++rank) {
    shared.ranks[impl_->added[rank]] = rank;
  }
}
SolidLists::~SolidLists() = default;
SolidLists::SolidLists(SolidLists&&) noexcept = default;
SolidLists& SolidLists::operator=(SolidLists&&) noexcept = default;

const TriangleSoup& SolidLists::soup() const { return impl_->soup; }
TriangleSoup SolidLists::take_soup() { return std::exchange(impl_->soup, {}); }
const TileListFilter& SolidLists::filter() const { return impl_->filter; }
void SolidLists::set_labels(const std::vector<std::uint32_t>& labels) {
  impl_->shared.labels.clear();
  for (const std::uint32_t solid : impl_->added) {
    impl_->shared.labels.push_back(labels[solid]);
  }
}
std::uint32_t SolidLists::solid_of(std::uint32_t triangle) const {
  return impl_->shared.solid_of[triangle];
}

Result<Measures> measure(const Tree& tree, Tree::NodeId root, int resolution,
                         const Execution& execution) {
  if (resolution < 1 || resolution > kMaxGridSide / 2) {
    return fail(ErrorCode::kUsage, "a resolution of {} voxels: 1 to {} can be had", resolution,
                kMaxGridSide / 2);
  }
  Measures result;
  const Bounds box = bounds(tree, root);
  const SolidLists lists(tree, root);
  if (box.empty()) return result;
  const glm::dvec3 extent = box.high - box.low;
  const double longest = std::max({extent.x, extent.y, extent.z});
  if (!(longest > 0) || !std::isfinite(longest)) return result;
  // As many voxels along each side: thin plates and rods are measured as well as cubes. A voxel of
  // room all around, so that no depth of the result is clamped. The solids may reach out: there
  // nothing of the result is.
  VoxelGrid grid;
  grid.voxel_size = glm::max(extent, glm::dvec3(longest * kThinnest)) / double(resolution);
  grid.dims = glm::ivec3(resolution + 2);
  grid.origin = (box.low + box.high) * 0.5 - glm::dvec3(grid.dims) * grid.voxel_size * 0.5;
  auto snapped = snap_to_lattice(lists.soup(), grid, execution);
  if (!snapped) return tl::unexpected(snapped.error());

  glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
  double volumes[3] = {}, half_areas[2] = {};
  glm::dvec3 projected(0);  // area of the surface as it is seen along an axis, all layers
  double outlines = 0;      // area of cells where the number of layers changes
  glm::dvec3 moment(0);
  // Where the columns stand that hold some of the result, and its first moment about them: for an
  // axis whose own rays pass a thin result by.
  glm::dvec3 column_low(low), column_high(high), column_moment(0), column_weight(0);
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    const AxisFrame frame(axis);
    auto image = build_ldi(*snapped, raster_target(grid, axis), {}, execution, &lists.filter());
    if (!image) return tl::unexpected(image.error());
    const glm::dvec3& d = grid.voxel_size;
    const double cell = d[frame.u] * d[frame.v];
    double column_sum = 0;
    std::uint64_t crossings = 0, changes = 0;
    for (int v = 0; v < image->height; ++v) {
      for (int u = 0; u < image->width; ++u) {
        const auto list = image->list(u, v);
        crossings += list.size();
        const auto change = [&](std::size_t other) {
          changes += std::max(list.size(), other) - std::min(list.size(), other);
        };
        if (u > 0) change(image->list(u - 1, v).size());
        if (v > 0) change(image->list(u, v - 1).size());
        result.max_depth_complexity =
            std::max<std::uint64_t>(result.max_depth_complexity, list.size());
        double first_moment = 0, length = 0;
        for (std::size_t i = 0; i < list.size(); ++i) {
          const double depth = (list[i].depth() + 0.5) / kLatticeSteps;
          const double sign = list[i].exit() ? 1.0 : -1.0;
          length += sign * depth;
          first_moment += sign * depth * depth / 2;
          // A crossing stands for an area of cell / |n_axis|; weighted by n_axis^2 the three axes
          // add up to the area itself.
          const glm::uvec3& t = lists.soup().triangles[list[i].triangle()];
          const glm::dvec3& a = lists.soup().positions[t.x];
          const glm::dvec3 across =
              glm::cross(lists.soup().positions[t.y] - a, lists.soup().positions[t.z] - a);
          const double size = glm::length(across);
          if (size > 0) half_areas[(u + v) % 2] += cell * std::abs(across[frame.w]) / size;
          double& low_w = low[frame.w];
          double& high_w = high[frame.w];
          low_w = std::min(low_w, depth);
          high_w = std::max(high_w, depth);
        }
        if (list.empty()) continue;
        column_sum += length;
        moment[frame.w] += first_moment;
        for (const auto& [side, at] : {std::pair(frame.u, u + 0.5), std::pair(frame.v, v + 0.5)}) {
          column_low[side] = std::min(column_low[side], at);
          column_high[side] = std::max(column_high[side], at);
          column_moment[side] += at * length;
          column_weight[side] += length;
        }
      }
    }
    result.result_crossings += crossings;
    projected[frame.w] = cell * static_cast<double>(crossings);
    outlines += cell * static_cast<double>(changes) / 2;
    volumes[frame.w] = column_sum;
    if (execution.progress) execution.progress((frame.w + 1) / 3.0);
  }
  const glm::dvec3& step = grid.voxel_size;
  const double cube = step.x * step.y * step.z;
  const double volume = (volumes[0] + volumes[1] + volumes[2]) / 3;
  result.empty = !(volume > 0);
  if (result.empty) return result;
  result.volume = volume * cube;
  result.area = half_areas[0] + half_areas[1];
  result.area_error = std::max(3 * std::abs(half_areas[0] - half_areas[1]), outlines);
  const auto [least, most] = std::minmax({volumes[0], volumes[1], volumes[2]});
  // The length of a ray varies over a side by at most what is seen from there.
  result.volume_error = std::max(2.0 / 3.0 * glm::dot(projected, step), (most - least) * cube);
  for (int i = 0; i < 3; ++i) {
    if (!(volumes[i] > 0)) {
      low[i] = column_low[i], high[i] = column_high[i];
      moment[i] = column_moment[i], volumes[i] = column_weight[i];
    }
    result.centre[i] = grid.origin[i] + moment[i] / volumes[i] * step[i];
    result.low[i] = grid.origin[i] + low[i] * step[i];
    result.high[i] = grid.origin[i] + high[i] * step[i];
  }
  result.bounds_error = std::max({step.x, step.y, step.z});
  return result;
}

}  // namespace strata::csg
