#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "csg/program.h"
#include "csg/transition.h"
#include "strata/hashbuffer/tile_lists.h"

// Private to csg/.

namespace strata::csg {

/// A program's value in three-valued logic (Kleene): a solid holds the point, does not, or nobody
/// knows. A solid is a leaf once, so the tree's value is unknown exactly where it depends on the
/// unknown solids.
class TernaryState {
 public:
  /// All solids outside.
  explicit TernaryState(const Program& program);

  void set_inside(std::uint32_t solid, bool inside);
  void set_unknown(std::uint32_t solid, bool unknown);
  [[nodiscard]] bool inside(std::uint32_t solid) const { return inside_[solid] != 0; }
  [[nodiscard]] bool unknown() const { return root_ == Value::kUnknown; }

 private:
  enum class Value : std::uint8_t { kFalse, kTrue, kUnknown };
  struct Counts {
    std::uint32_t yes = 0, unknown = 0;  // edges
    [[nodiscard]] Value value() const {
      if (yes > 0) return Value::kTrue;
      return unknown > 0 ? Value::kUnknown : Value::kFalse;
    }
  };
  [[nodiscard]] Value value_of(std::uint32_t solid) const;
  void climb(std::uint32_t solid, Value before, Value after);

  const Program* program_;
  std::vector<Counts> counts_;  // of each node
  std::vector<std::uint8_t> inside_, unknown_;
  Value root_ = Value::kFalse;
};

/// Finds the voxels of a column where the faces of solids are part of the surface of their tree.
/// Scratch of one thread.
class ColumnSurface {
 public:
  explicit ColumnSurface(const Program& program);

  /// See TileListFilter::Worker::surface(). @param transitions of the column's ray
  void find(std::span<const Transition> transitions, std::span<const FaceRun> faces,
            std::vector<VoxelRun>& kept);

 private:
  struct Event {
    int voxel = 0;  // from this one on
    std::uint32_t solid = 0;
    int faces = 0;  // +1, -1: a run begins, has ended; 0: the solid is entered or left
  };
  void take(const Event& event);

  TernaryState state_;
  std::vector<int> runs_;  // of each solid, at the place of the sweep
  std::vector<Event> events_;
};

}  // namespace strata::csg
