#include "csg/column_surface.h"

#include <algorithm>

#include "strata/raster/lattice_mesh.h"

namespace strata::csg {

TernaryState::TernaryState(const Program& program)
    : program_(&program),
      counts_(program.nodes.size()),
      inside_(program.leaves.size(), 0),
      unknown_(program.leaves.size(), 0) {
  for (std::size_t i = 0; i < counts_.size(); ++i)
    counts_[i].yes = program.nodes[i].true_when_outside;
  if (!counts_.empty()) root_ = counts_.back().value();
}

TernaryState::Value TernaryState::value_of(std::uint32_t solid) const {
  if (unknown_[solid] != 0) return Value::kUnknown;
  return inside_[solid] != 0 ? Value::kTrue : Value::kFalse;
}

void TernaryState::set_inside(std::uint32_t solid, bool inside) {
  const Value before = value_of(solid);
  inside_[solid] = inside ? 1 : 0;
  climb(solid, before, value_of(solid));
}

void TernaryState::set_unknown(std::uint32_t solid, bool unknown) {
  const Value before = value_of(solid);
  unknown_[solid] = unknown ? 1 : 0;
  climb(solid, before, value_of(solid));
}

void TernaryState::climb(std::uint32_t solid, Value before, Value after) {
  Program::Up up = program_->leaves[solid];
  const auto change = [](Counts& counts, Value value, bool inverted, std::uint32_t by) {
    if (value == Value::kUnknown) counts.unknown += by;
    if (value == (inverted ? Value::kFalse : Value::kTrue)) counts.yes += by;
  };
  while (before != after && up.parent != Program::kNone) {
    Counts& counts = counts_[up.parent];
    const Value was = counts.value();
    change(counts, before, up.inverted, ~0u);
    change(counts, after, up.inverted, 1);
    before = was;
    after = counts.value();
    if (up.parent + 1 == counts_.size()) root_ = after;
    up = program_->nodes[up.parent].up;
  }
}

ColumnSurface::ColumnSurface(const Program& program)
    : state_(program), runs_(program.leaves.size(), 0) {}

void ColumnSurface::take(const Event& event) {
  if (event.faces == 0) return state_.set_inside(event.solid, !state_.inside(event.solid));
  int& runs = runs_[event.solid];
  const bool before = runs > 0;
  runs += event.faces;
  if (before != (runs > 0)) state_.set_unknown(event.solid, runs > 0);
}

void ColumnSurface::find(std::span<const Transition> transitions, std::span<const FaceRun> faces,
                         std::vector<VoxelRun>& kept) {
  events_.clear();
  for (const FaceRun& run : faces) {
    events_.push_back({run.first, run.solid, 1});
    events_.push_back({run.last + 1, run.solid, -1});
  }
  for (const Transition& transition : transitions) {
    const std::uint32_t voxel = (transition.depth + kLatticeSteps / 2) >> kLatticeBits;
    events_.push_back({static_cast<int>(voxel), transition.solid, 0});
  }
  std::sort(events_.begin(), events_.end(),
            [](const Event& a, const Event& b) { return a.voxel < b.voxel; });
  const std::size_t before = kept.size();
  for (std::size_t i = 0; i < events_.size();) {
    const int voxel = events_[i].voxel;
    for (; i < events_.size() && events_[i].voxel == voxel; ++i) take(events_[i]);
    if (!state_.unknown()) continue;  // never after the last event: all runs have ended
    const int last = events_[i].voxel - 1;
    if (kept.size() > before && kept.back().last + 1 == voxel) {
      kept.back().last = last;
    } else {
      kept.push_back({voxel, last});
    }
  }
  for (const Transition& transition : transitions) {
    if (state_.inside(transition.solid)) state_.set_inside(transition.solid, false);
  }
}

}  // namespace strata::csg
