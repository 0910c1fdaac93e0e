#include "strata/voxelize/scalar_field.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>

namespace strata {
namespace {

constexpr int kNodeBlocks = 8;      // blocks along a side of a node
constexpr int kBranchBlocks = 128;  // blocks along a side of a branch

std::size_t slot(int x, int y, int z, int bits) {
  return static_cast<std::size_t>((x << bits | y) << bits | z);
}
std::size_t node_slot(int bi, int bj, int bk) { return slot(bi & 7, bj & 7, bk & 7, 3); }
std::size_t branch_slot(int bi, int bj, int bk) {
  return slot(bi >> 3 & 15, bj >> 3 & 15, bk >> 3 & 15, 4);
}

/// Calls part(lower corner, side) for the cubes of `side` that meet the box, in order.
template <class Part>
void for_each_cube(const glm::ivec3& first, const glm::ivec3& last, int side, Part&& part) {
  for (int x = first.x / side * side; x < last.x; x += side) {
    for (int y = first.y / side * side; y < last.y; y += side) {
      for (int z = first.z / side * side; z < last.z; z += side) part(glm::ivec3(x, y, z));
    }
  }
}

}  // namespace

ScalarField::ScalarField(const glm::ivec3& dims, float background, const glm::ivec3& shift)
    : dims_(dims),
      shift_(shift),
      blocks_((dims + shift + kBlockSide - 1) / kBlockSide),
      branch_dims_((blocks_ + kBranchBlocks - 1) / kBranchBlocks),
      background_(background),
      branches_(static_cast<std::size_t>(branch_dims_.x) *
                    static_cast<std::size_t>(branch_dims_.y) *
                    static_cast<std::size_t>(branch_dims_.z),
                Entry{background, kNone}) {}

std::size_t ScalarField::branch_index(int bi, int bj, int bk) const {
  const auto size = [](int value) { return static_cast<std::size_t>(value); };
  return (size(bi / kBranchBlocks) * size(branch_dims_.y) + size(bj / kBranchBlocks)) *
             size(branch_dims_.z) +
         size(bk / kBranchBlocks);
}

ScalarField::Block ScalarField::block(int bi, int bj, int bk) const {
  const Entry& branch = branches_[branch_index(bi, bj, bk)];
  if (branch.child == kNone) return {nullptr, branch.constant};
  const Entry& node = (*branch_nodes_[branch.child])[branch_slot(bi, bj, bk)];
  if (node.child == kNone) return {nullptr, node.constant};
  const Entry& entry = (*nodes_[node.child])[node_slot(bi, bj, bk)];
  if (entry.child == kNone) return {nullptr, entry.constant};
  return {values_[entry.child]->data(), 0.0f};
}

int ScalarField::equal_blocks_along_z(int bi, int bj, int bk) const {
  const Entry& branch = branches_[branch_index(bi, bj, bk)];
  int alike = 1;
  if (branch.child == kNone) {
    alike = kBranchBlocks - bk % kBranchBlocks;
  } else if ((*branch_nodes_[branch.child])[branch_slot(bi, bj, bk)].child == kNone) {
    alike = kNodeBlocks - bk % kNodeBlocks;
  }
  return std::min(alike, blocks_.z - bk);
}

ScalarField::Node& ScalarField::node_of(int bi, int bj, int bk) {
  Entry& branch = branches_[branch_index(bi, bj, bk)];
  if (branch.child == kNone) {
    branch.child = static_cast<std::uint32_t>(branch_nodes_.size());
    branch_nodes_.push_back(std::make_unique<Branch>());
    branch_nodes_.back()->fill({branch.constant, kNone});
  }
  Entry& node = (*branch_nodes_[branch.child])[branch_slot(bi, bj, bk)];
  if (node.child == kNone) {
    node.child = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back(std::make_unique<Node>());
    nodes_.back()->fill({node.constant, kNone});
  }
  return *nodes_[node.child];
}

float* ScalarField::edit_block(int bi, int bj, int bk) {
  Entry& entry = node_of(bi, bj, bk)[node_slot(bi, bj, bk)];
  if (entry.child == kNone) {
    if (free_values_.empty()) {
      entry.child = static_cast<std::uint32_t>(values_.size());
      values_.push_back(std::make_unique_for_overwrite<Values>());
    } else {
      entry.child = free_values_.back();
      free_values_.pop_back();
    }
    values_[entry.child]->fill(entry.constant);
  }
  return values_[entry.child]->data();
}

void ScalarField::settle_block(int bi, int bj, int bk) {
  if (block(bi, bj, bk).values == nullptr) return;
  Entry& entry = node_of(bi, bj, bk)[node_slot(bi, bj, bk)];
  const Values& values = *values_[entry.child];
  const float first = values[0];
  if (!std::all_of(values.begin(), values.end(), [&](float value) { return value == first; })) {
    return;
  }
  free_values_.push_back(entry.child);
  entry = {first, kNone};
}

void ScalarField::set_block(int bi, int bj, int bk, std::span<const float, kBlockVoxels> values) {
  const float first = values[0];
  const bool equal =
      std::all_of(values.begin(), values.end(), [&](float value) { return value == first; });
  if (equal) return fill_blocks({bi, bj, bk}, {bi + 1, bj + 1, bk + 1}, first);
  std::copy(values.begin(), values.end(), edit_block(bi, bj, bk));
}

void ScalarField::fill_blocks(glm::ivec3 first, glm::ivec3 last, float value) {
  first = glm::max(first, glm::ivec3(0));
  last = glm::min(last, blocks_);
  for_each_cube(first, last, kBranchBlocks, [&](const glm::ivec3& at) {
    const glm::ivec3 end = glm::min(at + kBranchBlocks, blocks_);
    Entry& branch = branches_[branch_index(at.x, at.y, at.z)];
    if (glm::max(first, at) == at && glm::min(last, end) == end && branch.child == kNone) {
      branch.constant = value;
      return;
    }
    if (branch.child == kNone) {
      if (branch.constant == value) return;
      node_of(at.x, at.y, at.z);
    }
    fill_nodes(*branch_nodes_[branches_[branch_index(at.x, at.y, at.z)].child], at,
               glm::max(first, at), glm::min(last, end), value);
  });
}

void ScalarField::fill_nodes(Branch& branch, const glm::ivec3&, const glm::ivec3& first,
                             const glm::ivec3& last, float value) {
  for_each_cube(first, last, kNodeBlocks, [&](const glm::ivec3& at) {
    const glm::ivec3 end = glm::min(at + kNodeBlocks, blocks_);
    Entry& entry = branch[branch_slot(at.x, at.y, at.z)];
    if (glm::max(first, at) == at && glm::min(last, end) == end && entry.child == kNone) {
      entry.constant = value;
      return;
    }
    Node& node = node_of(at.x, at.y, at.z);
    for_each_cube(glm::max(first, at), glm::min(last, end), 1, [&](const glm::ivec3& b) {
      Entry& cell = node[node_slot(b.x, b.y, b.z)];
      if (cell.child != kNone) free_values_.push_back(cell.child);
      cell = {value, kNone};
    });
  });
}

std::uint64_t ScalarField::memory_bytes() const {
  return branches_.size() * sizeof(Entry) + branch_nodes_.size() * sizeof(Branch) +
         nodes_.size() * sizeof(Node) + values_.size() * (kBlockBytes + 24);
}

ScalarField::Range ScalarField::range() const {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Range range{kInfinity, -kInfinity};
  const auto add = [&](float value) {
    if (!std::isfinite(value)) return;
    range.least = std::min(range.least, value);
    range.greatest = std::max(range.greatest, value);
  };
  const auto add_entry = [&](const Entry& entry) {
    if (entry.child == kNone) add(entry.constant);
  };
  for (const Entry& branch : branches_) {
    add_entry(branch);
    if (branch.child == kNone) continue;
    for (const Entry& node : *branch_nodes_[branch.child]) {
      add_entry(node);
      if (node.child == kNone) continue;
      for (const Entry& cell : *nodes_[node.child]) {
        add_entry(cell);
        if (cell.child == kNone) continue;
        for (const float value : *values_[cell.child]) add(value);
      }
    }
  }
  return range.least > range.greatest ? Range{} : range;
}

}  // namespace strata
