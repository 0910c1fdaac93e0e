#pragma once

#include <cstdint>
#include <span>

#include "csg/program.h"
#include "strata/core/inside_rule.h"
#include "strata/hashbuffer/tile_lists.h"

// Private to csg/.

namespace strata::csg {

/// The filter of SolidLists, which says what it was made of to who does the same elsewhere.
class TreeFilter : public TileListFilter {
 public:
  struct Tables {
    const Program& program;
    std::span<const InsideRule> rules;        ///< of each solid of the tree
    std::span<const std::uint32_t> solid_of;  ///< of each triangle of the soup
  };
  [[nodiscard]] virtual Tables tables() const = 0;
};

}  // namespace strata::csg
