#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "apps/commands/commands.h"
#include "apps/view/files/customizer.h"
#include "apps/view/voxels/voxel_scene.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/picture/picture.h"
#include "strata/csg/scene/scene.h"

// What a window shows: the scene as it was read, and how it is looked at.

namespace strata::view {

/// A scene as it was read. Does not change.
struct Model {
  csg::Scene scene;
  Bounds box;  ///< of what can be seen, as `strata csg` fits it into a picture
  std::vector<std::string> warnings;
  std::vector<Parameter> parameters;  ///< of a single .scad
  std::uint64_t triangles = 0;
  double load_ms = 0;
  std::shared_ptr<const VoxelScene> voxels;  ///< a file of voxels; the scene is empty then
};

/// Reads the inputs of a command as `strata csg` does. @return as load_scene(), result_bounds()
Result<std::shared_ptr<const Model>> load_model(const apps::CsgCommand& command,
                                                const Execution& execution);

/// What is shown of a model, but for the camera.
struct Looks {
  std::vector<std::uint8_t> hidden;                      ///< of each solid; short: all shown
  std::unordered_map<std::uint32_t, glm::vec4> colours;  ///< of solids, instead of their own
  std::optional<csg::SectionPlane> section;              ///< not towards_eye: see facing()
  bool ghosts = false;                                   ///< of what is subtracted
  std::optional<std::uint32_t> selected;                 ///< its faces are tinted
  VoxelLooks voxels;                                     ///< of a file of voxels
  friend bool operator==(const Looks& a, const Looks& b);
};

/// What is drawn. Does not change.
struct Arrangement {
  csg::Tree tree;  ///< its first solids are the model's, in the same order
  std::vector<csg::Ghost> ghosts;
  double relative_precision = 0;
  std::size_t model_solids = 0;  ///< those behind were added: sections, ghosts
  bool flat = false;
  std::shared_ptr<const VoxelScene> voxels;  ///< drawn instead of a tree
  VoxelLooks voxel_looks;
  std::optional<csg::SectionPlane> section;  ///< of voxels
};

/// A hidden solid counts as not written: a union and an intersection go on without it, a difference
/// whose first operand is gone is gone.
[[nodiscard]] std::shared_ptr<const Arrangement> arrange(const Model& model, const Looks& looks);

/// Solids by what a person calls them: `@7` by index, `all`, a whole name, or else each name that
/// holds `pattern`. @return kUsage when there is none
Result<std::vector<std::uint32_t>> find_solids(const Model& model, std::string_view pattern);

/// A solid's name without the folders of its file: `cube at plate.csg:12:3`.
[[nodiscard]] std::string short_name(std::string_view name);

/// Carries hidden solids and colours over to a model that was read again: by name, and where names
/// occur more than once by their order. What is not there any more is forgotten.
[[nodiscard]] Looks carry_over(const Looks& looks, const Model& before, const Model& after);

/// `#rgb`, `#rrggbb`, `#rrggbbaa` or a name, as apps::parse_colour() has them.
[[nodiscard]] std::optional<glm::vec4> parse_colour(std::string_view text);

}  // namespace strata::view
