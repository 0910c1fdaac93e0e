#pragma once

#include <cstdint>
#include <vector>

namespace strata {

/// The intervals of a sweep line from the lowest to the highest: a search tree whose order the
/// caller makes, so that a new interval beside a known one costs no comparison.
///
/// This work is based on: R. Seidel, C. R. Aragon, "Randomized search trees", 1996. We differ: the
/// priorities are a fixed sequence, so that the tree is the same in every run.
class IntervalOrder {
 public:
  using Id = std::uint32_t;
  static constexpr Id kNone = 0xffffffffu;

  void clear() {
    nodes_.clear();
    root_ = first_ = kNone;
    random_ = 1;
  }

  Id next(Id id) const { return nodes_[id].next; }
  Id previous(Id id) const { return nodes_[id].previous; }
  Id first() const { return first_; }

  /// The highest interval for which `above(id)` holds; it holds for a first part of the order.
  template <class Above>
  Id last_where(const Above& above) const {
    Id found = kNone;
    for (Id id = root_; id != kNone;) {
      if (above(id)) {
        found = id;
        id = nodes_[id].right;
      } else {
        id = nodes_[id].left;
      }
    }
    return found;
  }

  /// A new interval above `lower`, or below all for kNone. Numbers are not used again.
  Id insert_after(Id lower);
  void erase(Id id);

 private:
  struct Node {
    Id parent = kNone, left = kNone, right = kNone, previous = kNone, next = kNone;
    std::uint32_t priority = 0;
  };

  void replace_child(Id parent, Id child, Id by);
  void rotate_up(Id id);

  std::vector<Node> nodes_;
  Id root_ = kNone, first_ = kNone;
  std::uint32_t random_ = 1;
};

}  // namespace strata
