#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "apps/view/voxels/voxel_scene.h"
#include "strata/csg/input/scene_input.h"
#include "strata/raster/view.h"

namespace strata::view {

/// What undo brings back: from where a scene is seen, its section, what is hidden, and how voxels
/// are looked at.
struct ViewState {
  Camera camera;
  std::optional<csg::SectionPlane> section;
  std::vector<std::uint8_t> hidden;
  VoxelLooks voxels = {};
  friend bool operator==(const ViewState& a, const ViewState& b) {
    const auto same_section = [&] {
      if (!a.section || !b.section) return a.section.has_value() == b.section.has_value();
      return a.section->normal == b.section->normal && a.section->offset == b.section->offset;
    };
    return a.camera.target == b.camera.target && a.camera.rotation == b.camera.rotation &&
           a.camera.distance == b.camera.distance && a.camera.projection == b.camera.projection &&
           a.hidden == b.hidden && a.voxels == b.voxels && same_section();
  }
};

/// Steps back and forth between the states in which the hand rested.
class ViewHistory {
 public:
  static constexpr std::size_t kMostSteps = 200;

  /// The hand rests: a state that differs from the last one is a step.
  void rest(const ViewState& now) {
    if (!last_) last_ = now;
    if (*last_ == now) return;
    undone_.clear();
    steps_.push_back(*std::exchange(last_, now));
    if (steps_.size() > kMostSteps) steps_.erase(steps_.begin());
  }
  /// The state before, if there is one.
  [[nodiscard]] std::optional<ViewState> undo(const ViewState& now) {
    rest(now);
    return step(steps_, undone_);
  }
  /// The state that undo() left.
  [[nodiscard]] std::optional<ViewState> redo(const ViewState& now) {
    rest(now);
    return step(undone_, steps_);
  }
  [[nodiscard]] bool can_undo() const { return !steps_.empty(); }
  [[nodiscard]] bool can_redo() const { return !undone_.empty(); }

 private:
  std::optional<ViewState> step(std::vector<ViewState>& from, std::vector<ViewState>& to) {
    if (from.empty()) return {};
    to.push_back(*std::exchange(last_, std::move(from.back())));
    from.pop_back();
    return last_;
  }

  std::optional<ViewState> last_;
  std::vector<ViewState> steps_, undone_;
};

}  // namespace strata::view
