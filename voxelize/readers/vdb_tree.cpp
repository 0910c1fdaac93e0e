// tree/RootNode.h, tree/InternalNode.h and tree/LeafNode.h of OpenVDB 10: the root, nodes of 32^3
// nodes of 16^3 leaves of 8^3 voxels, depth first. Tiles of one value that follow one another along
// z are joined.

#include "voxelize/readers/vdb_tree.h"

#include <algorithm>
#include <bit>
#include <climits>
#include <cstring>
#include <glm/common.hpp>

namespace strata {
namespace {

constexpr int kLowerSide = 128, kUpperSide = 4096;
constexpr int kFarthestIndex = 1 << 29;  // of an index, so that sums fit

class TreeReader {
 public:
  TreeReader(ReadContext& context, std::uint64_t at, VdbValueLists& lists)
      : context_(context), cursor_(context.bytes, at), lists_(lists) {}

  Result<VdbTree> read();

 private:
  [[nodiscard]] tl::unexpected<Error> fault(std::string_view what) const {
    return fail(ErrorCode::kInput, "{}: byte {}: {}", context_.path, cursor_.at(), what);
  }
  [[nodiscard]] Result<glm::ivec3> origin(int side);
  template <std::size_t Words>
  void mask(std::array<std::uint64_t, Words>& words) {
    const std::string_view bytes = cursor_.take(sizeof words);
    words.fill(0);
    if (!bytes.empty()) std::memcpy(words.data(), bytes.data(), bytes.size());
  }
  /// An inner node of 2^Log2 children a side, of `side` voxels each.
  template <int Log2, class Child>
  Result<void> read_node(const glm::ivec3& at, int side, Child&& child);
  Result<void> read_leaf(const glm::ivec3& at);
  Result<void> add_tile(const glm::ivec3& at, int side, float value, bool active);
  void add_bounds(const glm::ivec3& first, const glm::ivec3& last) {
    tree_.lower = glm::min(tree_.lower, first);
    tree_.upper = glm::max(tree_.upper, last);
  }

  ReadContext& context_;
  ByteCursor cursor_;
  VdbValueLists& lists_;
  VdbTree tree_;
};

Result<glm::ivec3> TreeReader::origin(int side) {
  glm::ivec3 at;
  for (int axis = 0; axis < 3; ++axis) at[axis] = cursor_.get<std::int32_t>();
  if (cursor_.failed()) return fault("the file ends within the tree");
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(static_cast<std::int64_t>(at[axis])) > kFarthestIndex || at[axis] % side != 0) {
      return fault(fmt::format("a node at index ({}, {}, {}); nodes lie at multiples of {}", at.x,
                               at.y, at.z, side));
    }
  }
  return at;
}

Result<void> TreeReader::add_tile(const glm::ivec3& at, int side, float value, bool active) {
  if (active) add_bounds(at, at + (side - 1));
  if (!active && value == tree_.background) return {};
  if (!tree_.tiles.empty()) {
    VdbTile& back = tree_.tiles.back();
    const glm::ivec3 next(back.first.x, back.first.y, back.last.z + 1);
    if (next == at && back.last.x - back.first.x + 1 == side && back.value == value &&
        back.active == active) {
      back.last.z += side;
      return {};
    }
  }
  if (!context_.budget.take(sizeof(VdbTile))) return context_.too_large("the tiles of the tree");
  tree_.tiles.push_back({at, at + (side - 1), value, active});
  return {};
}

Result<void> TreeReader::read_leaf(const glm::ivec3& at) {
  VdbMask words;
  mask(words);
  if (cursor_.failed()) return fault("the file ends within the tree");
  std::uint64_t any = 0;
  int x_first = kLeafSide, x_last = -1;
  for (int x = 0; x < kLeafSide; ++x) {
    const std::uint64_t word = words[static_cast<std::size_t>(x)];
    any |= word;
    if (word == 0) continue;
    x_first = std::min(x_first, x);
    x_last = x;
  }
  if (any != 0) {
    std::uint64_t bits = any;  // of all rows, in the low byte
    for (const int shift : {32, 16, 8}) bits |= bits >> shift;
    const auto byte = static_cast<std::uint8_t>(bits);
    add_bounds(at + glm::ivec3(x_first, std::countr_zero(any) / 8, std::countr_zero(byte)),
               at + glm::ivec3(x_last, 7 - std::countl_zero(any) / 8, 7 - std::countl_zero(byte)));
  }
  if (!context_.budget.take(sizeof at + sizeof words)) {
    return context_.too_large("the leaves of the tree");
  }
  tree_.leaves.push_back(at);
  tree_.masks.push_back(words);
  return {};
}

template <int Log2, class Child>
Result<void> TreeReader::read_node(const glm::ivec3& at, int side, Child&& child) {
  constexpr std::size_t kSlots = std::size_t{1} << (3 * Log2);
  std::array<std::uint64_t, kSlots / 64> children, active;
  std::vector<float> values(kSlots);
  mask(children);
  mask(active);
  const std::string wrong = lists_.read(cursor_, active, values.data());
  if (!wrong.empty()) return fault(fmt::format("the values of a node: {}", wrong));
  if (context_.stopped()) return context_.cancelled();
  constexpr int kMask = (1 << Log2) - 1;
  for (std::size_t i = 0; i < kSlots; ++i) {
    const int n = static_cast<int>(i);
    const glm::ivec3 there = at + side * glm::ivec3(n >> (2 * Log2), n >> Log2 & kMask, n & kMask);
    const bool is_child = (children[i / 64] >> i % 64 & 1) != 0;
    const Result<void> done =
        is_child ? child(there)
                 : add_tile(there, side, values[i], (active[i / 64] >> i % 64 & 1) != 0);
    if (!done) return done;
  }
  return {};
}

Result<VdbTree> TreeReader::read() {
  tree_.lower = glm::ivec3(INT_MAX);
  tree_.upper = glm::ivec3(INT_MIN);
  cursor_.get<std::uint32_t>();  // buffers of a leaf
  tree_.background = lists_.one(cursor_);
  if (lists_.colours()) tree_.background = 0.0f;
  lists_.set_background(tree_.background);
  const auto tiles = cursor_.get<std::uint32_t>(), children = cursor_.get<std::uint32_t>();
  for (std::uint32_t i = 0; i < tiles; ++i) {
    const Result<glm::ivec3> at = origin(kUpperSide);
    if (!at) return tl::unexpected(at.error());
    float value = lists_.one(cursor_);
    const bool active = cursor_.get<std::uint8_t>() != 0;
    if (lists_.colours() && !active) value = 0.0f;
    if (auto added = add_tile(*at, kUpperSide, value, active); !added) {
      return tl::unexpected(added.error());
    }
  }
  for (std::uint32_t i = 0; i < children; ++i) {
    const Result<glm::ivec3> at = origin(kUpperSide);
    if (!at) return tl::unexpected(at.error());
    const auto lower = [&](const glm::ivec3& node) {
      return read_node<4>(node, kLeafSide, [&](const glm::ivec3& leaf) { return read_leaf(leaf); });
    };
    if (auto read = read_node<5>(*at, kLowerSide, lower); !read) {
      return tl::unexpected(read.error());
    }
  }
  if (cursor_.failed()) return fault("the file ends within the tree");
  tree_.end = cursor_.at();
  return std::move(tree_);
}

}  // namespace

Result<VdbTree> read_vdb_tree(ReadContext& context, std::uint64_t at, VdbValueLists& lists) {
  return TreeReader(context, at, lists).read();
}

}  // namespace strata
