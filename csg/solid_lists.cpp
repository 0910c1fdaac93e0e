#include "strata/csg/solid_lists.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <utility>

#include "csg/column_surface.h"
#include "csg/geometry.h"
#include "csg/program.h"
#include "csg/transition.h"
#include "csg/tree_filter.h"
#include "strata/raster/lattice_mesh.h"

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
  void toggle(std::uint32_t number) {
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

class BooleanWorker final : public TileListFilter::Worker {
 public:
  BooleanWorker(const Shared& shared, bool labelled)
      : shared_(&shared),
        labelled_(labelled),
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
    surface_->find(transitions_, faces, kept);
  }

 private:
  [[nodiscard]] std::uint32_t solid_of(DepthItem item) const {
    return shared_->solid_of[item.triangle()];
  }

  void toggle(std::uint32_t solid) {
    state_.toggle(solid);
    if (labelled() && shared_->ranks[solid] != Shared::kNoRank)
      added_.toggle(shared_->ranks[solid]);
  }
  [[nodiscard]] bool labelled() const { return labelled_; }
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
          toggle(solid);
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
      if (is_inside(shared_->rules[solid], winding)) toggle(solid);
      balanced = balanced && shared_->rules[solid] == InsideRule::kParity && winding % 2 == 0;
    }
    if (!balanced) keys_.resize(before);
    return balanced;
  }

  /// The same where a solid is open: partners are found solid by solid.
  void walk_open() {
    find_flips();
    std::uint32_t last = label();
    for (std::size_t i = 0; i < transitions_.size();) {
      const std::size_t begin = i;
      for (; i < transitions_.size() && transitions_[i].depth == transitions_[begin].depth; ++i) {
        toggle(transitions_[i].solid);
      }
      if (label() == last) continue;
      last = label();
      put(transitions_[begin].depth, last, transitions_[begin].triangle);
    }
  }

  /// Where the ray of items_ enters and leaves each solid, by depth.
  void find_flips() {
    std::stable_sort(items_.begin(), items_.end(),
                     [this](DepthItem a, DepthItem b) { return solid_of(a) < solid_of(b); });
    transitions_.clear();
    for (std::size_t i = 0; i < items_.size();) {
      const std::size_t begin = i;
      const std::uint32_t solid = solid_of(items_[begin]);
      while (i < items_.size() && solid_of(items_[i]) == solid) ++i;
      transitions_of(std::span(items_).subspan(begin, i - begin), solid, shared_->rules[solid],
                     false, transitions_);
    }
    std::sort(transitions_.begin(), transitions_.end(),
              [](const Transition& a, const Transition& b) {
                return a.depth != b.depth ? a.depth < b.depth : a.solid < b.solid;
              });
  }

  const Shared* shared_;
  bool labelled_;
  ProgramState state_;
  LeastOf added_;  ///< ranks of the solids that the ray is in
  std::vector<int> windings_;
  std::vector<std::uint32_t> offsets_;
  std::vector<DepthItem> keys_, items_;
  std::vector<Transition> transitions_;
  std::optional<ColumnSurface> surface_;
};

class BooleanFilter final : public TreeFilter {
 public:
  /// @param unlabelled  without labels, whether there are some or not
  BooleanFilter(const Shared& shared, bool unlabelled)
      : shared_(&shared), unlabelled_(unlabelled) {}
  [[nodiscard]] std::unique_ptr<Worker> worker() const override {
    return std::make_unique<BooleanWorker>(*shared_, labelled());
  }
  [[nodiscard]] Tables tables() const override {
    return {shared_->program, shared_->rules, shared_->solid_of};
  }
  [[nodiscard]] bool labelled() const override { return !unlabelled_ && !shared_->labels.empty(); }
  [[nodiscard]] std::uint32_t solid_of(std::uint32_t triangle) const override {
    return shared_->solid_of[triangle];
  }

 private:
  const Shared* shared_;
  bool unlabelled_;
};

}  // namespace

struct SolidLists::Impl {
  Shared shared;
  TriangleSoup soup;
  Bounds box;                        ///< around the soup
  std::vector<std::uint32_t> added;  ///< solids by rank
  BooleanFilter filter{shared, false}, unlabelled{shared, true};
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
    impl_->box.include(part.box);
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
const TileListFilter& SolidLists::unlabelled_filter() const { return impl_->unlabelled; }
bool SolidLists::is_subtracted(std::uint32_t triangle) const {
  return impl_->shared.ranks[solid_of(triangle)] == Shared::kNoRank;
}
void SolidLists::set_labels(const std::vector<std::uint32_t>& labels) {
  impl_->shared.labels.clear();
  for (const std::uint32_t solid : impl_->added) {
    impl_->shared.labels.push_back(labels[solid]);
  }
}
Result<void> SolidLists::fit(const VoxelGrid& grid, TriangleSoup* taken,
                             const Execution& execution) {
  TriangleSoup& soup = taken != nullptr ? *taken : impl_->soup;
  const auto sources = fit_lattice(soup, impl_->box, grid, execution);
  if (!sources) return tl::unexpected(sources.error());
  if (sources->empty()) return {};
  std::vector<std::uint32_t> solid_of;
  solid_of.reserve(sources->size());
  for (const std::uint32_t source : *sources) solid_of.push_back(impl_->shared.solid_of[source]);
  impl_->shared.solid_of = std::move(solid_of);
  impl_->box = bounds(soup);
  return {};
}
std::uint32_t SolidLists::solid_of(std::uint32_t triangle) const {
  return impl_->shared.solid_of[triangle];
}

}  // namespace strata::csg
