#include "mesh/polygons/interval_order.h"

namespace strata {

void IntervalOrder::replace_child(Id parent, Id child, Id by) {
  if (parent == kNone) {
    root_ = by;
  } else if (nodes_[parent].left == child) {
    nodes_[parent].left = by;
  } else {
    nodes_[parent].right = by;
  }
  if (by != kNone) nodes_[by].parent = parent;
}

void IntervalOrder::rotate_up(Id id) {
  const Id parent = nodes_[id].parent;
  const bool left = nodes_[parent].left == id;
  const Id inner = left ? nodes_[id].right : nodes_[id].left;
  replace_child(nodes_[parent].parent, parent, id);
  (left ? nodes_[parent].left : nodes_[parent].right) = inner;
  if (inner != kNone) nodes_[inner].parent = parent;
  (left ? nodes_[id].right : nodes_[id].left) = parent;
  nodes_[parent].parent = id;
}

IntervalOrder::Id IntervalOrder::insert_after(Id lower) {
  const Id id = static_cast<Id>(nodes_.size());
  random_ ^= random_ << 13;  // G. Marsaglia, "Xorshift RNGs", 2003
  random_ ^= random_ >> 17;
  random_ ^= random_ << 5;
  Node& node = nodes_.emplace_back();
  node.priority = random_;
  node.previous = lower;
  node.next = lower == kNone ? first_ : nodes_[lower].next;
  if (node.next != kNone) nodes_[node.next].previous = id;
  (lower == kNone ? first_ : nodes_[lower].next) = id;
  // Either the lower neighbour has no right child, or the upper one has no left child.
  if (lower != kNone && nodes_[lower].right == kNone) {
    nodes_[lower].right = id;
    node.parent = lower;
  } else if (node.next != kNone) {
    nodes_[node.next].left = id;
    node.parent = node.next;
  } else {
    root_ = id;
  }
  while (nodes_[id].parent != kNone && nodes_[nodes_[id].parent].priority < nodes_[id].priority) {
    rotate_up(id);
  }
  return id;
}

void IntervalOrder::erase(Id id) {
  while (nodes_[id].left != kNone && nodes_[id].right != kNone) {
    const Id left = nodes_[id].left, right = nodes_[id].right;
    rotate_up(nodes_[left].priority > nodes_[right].priority ? left : right);
  }
  const Node& node = nodes_[id];
  replace_child(node.parent, id, node.left != kNone ? node.left : node.right);
  if (node.next != kNone) nodes_[node.next].previous = node.previous;
  (node.previous == kNone ? first_ : nodes_[node.previous].next) = node.next;
}

}  // namespace strata
