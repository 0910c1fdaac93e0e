#include "bench/csg_products.h"

#include <algorithm>
#include <glm/common.hpp>
#include <utility>

namespace strata::bench {
namespace {

using csg::Operation;
using csg::Tree;

Bounds common(const Bounds& a, const Bounds& b) {
  return {glm::max(a.low, b.low), glm::min(a.high, b.high)};
}

bool is_empty(const Bounds& box) {
  return !(box.low.x <= box.high.x && box.low.y <= box.high.y && box.low.z <= box.high.z);
}

/// A product and the box that its intersected solids have in common.
struct Term {
  Product product;
  Bounds box;
};
using Sum = std::vector<Term>;

class Expander {
 public:
  Expander(const Tree& tree, std::size_t most) : tree_(tree), most_(most) {
    for (const csg::Solid& solid : tree.solids()) boxes_.push_back(csg::bounds(solid));
  }

  Result<Sum> expand(Tree::NodeId node) const {
    const Tree::Node& what = tree_.nodes()[node];
    if (what.operation == Operation::kSolid) {
      if (is_empty(boxes_[what.first])) return Sum{};
      return Sum{{{{what.first}, {}}, boxes_[what.first]}};
    }
    Sum sum;
    bool first = true;
    for (const Tree::NodeId operand : tree_.operands(node)) {
      auto other = expand(operand);
      if (!other) return other;
      if (first) {
        sum = std::move(*other);
        first = false;
      } else if (what.operation == Operation::kUnion) {
        sum.insert(sum.end(), other->begin(), other->end());
      } else if (what.operation == Operation::kIntersection) {
        sum = intersect(sum, *other);
      } else {
        for (const Term& term : *other) sum = subtract(sum, term);
      }
      if (sum.size() > most_) {
        return fail(ErrorCode::kLimit, "the tree has more than {} products", most_);
      }
    }
    return sum;
  }

 private:
  static Sum intersect(const Sum& a, const Sum& b) {
    Sum sum;
    for (const Term& x : a) {
      for (const Term& y : b) {
        Term both = x;
        both.box = common(x.box, y.box);
        if (is_empty(both.box)) continue;
        const auto join = [](std::vector<std::uint32_t>& to, const auto& from) {
          to.insert(to.end(), from.begin(), from.end());
        };
        join(both.product.intersected, y.product.intersected);
        join(both.product.subtracted, y.product.subtracted);
        sum.push_back(std::move(both));
      }
    }
    return sum;
  }

  /// a - (b n c - d - e) = (a - b) + (a - c) + (a n d) + (a n e)
  Sum subtract(const Sum& a, const Term& b) const {
    Sum sum;
    for (const Term& x : a) {
      if (is_empty(common(x.box, b.box))) {
        sum.push_back(x);
        continue;
      }
      for (const std::uint32_t solid : b.product.intersected) {
        Term part = x;
        part.product.subtracted.push_back(solid);
        sum.push_back(std::move(part));
      }
      for (const std::uint32_t solid : b.product.subtracted) {
        Term part = x;
        part.box = common(x.box, boxes_[solid]);
        if (is_empty(part.box)) continue;
        part.product.intersected.push_back(solid);
        sum.push_back(std::move(part));
      }
    }
    return sum;
  }

  const Tree& tree_;
  std::size_t most_;
  std::vector<Bounds> boxes_;
};

}  // namespace

Result<std::vector<Product>> sum_of_products(const csg::Tree& tree, std::size_t most) {
  if (tree.root() == Tree::kNone) return std::vector<Product>{};
  auto sum = Expander(tree, most).expand(tree.root());
  if (!sum) return tl::unexpected(sum.error());
  std::vector<Product> products;
  for (Term& term : *sum) products.push_back(std::move(term.product));
  return products;
}

}  // namespace strata::bench
