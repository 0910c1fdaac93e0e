#pragma once

#include <string>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"

namespace strata::apps {

/// The volume of a tree's result, exactly, after its solids were snapped to a lattice.
struct SnappedVolume {
  std::string six_volumes;  ///< in cubic steps: a fraction in lowest terms, `2/3` or `2`
  double volume = 0;        ///< cubic world units
  double step = 1;          ///< of the lattice, world units
  csg::Tree snapped;        ///< the tree with its snapped solids, in steps
};

/// By csg/boundary. @return as csg::exact_measures()
Result<SnappedVolume> snapped_volume(const csg::Tree& tree, const Execution& execution = {});

}  // namespace strata::apps
