#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "strata/core/result.h"
#include "strata/csg/tree.h"

namespace strata::bench {

/// What OpenCSG draws at a time: solids that are intersected, minus others.
struct Product {
  std::vector<std::uint32_t> intersected, subtracted;  ///< indices into Tree::solids()
};

/// The tree as a sum of products, as OpenSCAD's preview expands it: unions are multiplied out, and
/// what bounding boxes show to be empty is dropped on the way.
/// @return kLimit beyond `most` products
Result<std::vector<Product>> sum_of_products(const csg::Tree& tree, std::size_t most);

}  // namespace strata::bench
