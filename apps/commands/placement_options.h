#pragma once

#include <string>

#include "strata/core/result.h"
#include "strata/csg/input/scene_input.h"

namespace CLI {
class App;
}

namespace strata::apps {

/// The options that say where meshes come to lie, as words. Empty: not given.
struct PlacementWords {
  std::string unit, scale, up, translate;
  /// The first option that is given; empty: none.
  [[nodiscard]] std::string_view given() const;
};

void define_placement_options(CLI::App& app, PlacementWords& words);

/// @return kUsage naming the option and the number
Result<void> read_placement_options(const PlacementWords& words, csg::MeshPlacement& placement);

}  // namespace strata::apps
