#include "strata/voxelize/distance/inner_faces.h"

#include <atomic>
#include <glm/geometric.hpp>
#include <memory>
#include <vector>

#include "strata/hashbuffer/tile_lists.h"

namespace strata {
namespace {

/// Finds whether rays meet faces that have the inside on both sides. Leaves the lists as they are.
class InnerFaces final : public TileListFilter {
 public:
  InnerFaces(const TriangleSoup& mesh, InsideRule rule) : mesh_(mesh), rule_(rule) {}

  [[nodiscard]] bool found() const { return found_; }
  [[nodiscard]] std::unique_ptr<TileListFilter::Worker> worker() const override {
    return std::make_unique<Worker>(*this);
  }

 private:
  class Worker final : public TileListFilter::Worker {
   public:
    explicit Worker(const InnerFaces& faces) : faces_(faces) {}
    TileLists<DepthItem> apply(const TileLists<DepthItem>& lists) override {
      if (!faces_.found_ && lists.fragments != 0 && has_inner(lists)) faces_.found_ = true;
      return lists;
    }

   private:
    bool has_inner(const TileLists<DepthItem>& lists) {
      for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
        together_.clear();
        int winding = 0;
        bool found = false;
        for_each_item(lists, pixel, [&](const DepthItem& item) {
          if (!together_.empty() && together_.back().depth() != item.depth()) {
            found = found || pass(winding);
          }
          together_.push_back(item);
        });
        if (found || pass(winding)) return true;
      }
      return false;
    }
    /// Passes the crossings at one depth. @return whether they lie within the inside
    bool pass(int& winding) {
      const int before = winding;
      for (const DepthItem& item : together_) winding += item.exit() ? -1 : 1;
      const bool inner = (faces_.is_inside(before) && faces_.is_inside(winding) &&
                          (before != winding || coincide())) ||
                         faces_.overlaps(winding);
      together_.clear();
      return inner;
    }
    /// Whether two faces lie on each other: a ray along the edge of a notch passes two as well.
    [[nodiscard]] bool coincide() const {
      for (std::size_t i = 0; i < together_.size(); ++i) {
        for (std::size_t k = 0; k < i; ++k) {
          const glm::dvec3 sum =
              faces_.normal(together_[i].triangle()) + faces_.normal(together_[k].triangle());
          if (glm::length(sum) < 1e-3) return true;
        }
      }
      return false;
    }

    const InnerFaces& faces_;
    std::vector<DepthItem> together_;
  };

  [[nodiscard]] bool is_inside(int winding) const {
    if (rule_ == InsideRule::kParity) return winding % 2 != 0;
    return rule_ == InsideRule::kNonzero ? winding != 0 : winding > 0;
  }
  /// Whether solids overlap behind crossings, also where all of them lie at one depth.
  [[nodiscard]] bool overlaps(int winding) const {
    if (rule_ == InsideRule::kParity) return false;
    return rule_ == InsideRule::kNonzero ? winding > 1 || winding < -1 : winding > 1;
  }
  [[nodiscard]] glm::dvec3 normal(std::uint32_t triangle) const {
    const glm::uvec3 t = mesh_.triangles[triangle];
    const glm::dvec3 a = mesh_.positions[t.x];
    return glm::normalize(glm::cross(mesh_.positions[t.y] - a, mesh_.positions[t.z] - a));
  }

  const TriangleSoup& mesh_;
  InsideRule rule_;
  mutable std::atomic<bool> found_ = false;
};

}  // namespace

Result<bool> has_inner_faces(const TriangleSoup& mesh, const VoxelGrid& grid,
                             const VoxelizeOptions& options, const Execution& execution) {
  const InnerFaces faces(mesh, options.rule);
  VoxelizeOptions lists = options;
  lists.statistics = false;
  lists.source = nullptr;
  lists.filter = &faces;
  Execution quiet = execution;
  quiet.progress = {};
  // Faces along an axis are met by rays of the other two alone.
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    lists.axis = axis;
    const auto done = voxelize_slabs(mesh, grid, lists, quiet,
                                     [](const VoxelIntervals&) { return Result<void>(); });
    if (!done) return tl::unexpected(done.error());
    if (faces.found()) break;
  }
  return faces.found();
}

}  // namespace strata
