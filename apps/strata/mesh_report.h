#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/commands/commands.h"
#include "apps/session/session.h"
#include "strata/contour/contour.h"
#include "strata/core/grid.h"
#include "strata/csg/boundary/boundary_mesh.h"
#include "strata/mesh/solid_mesh.h"
#include "strata/mesh/soup_tools.h"

namespace strata::apps {

/// All that `strata mesh` can tell of a run.
struct MeshOutcome {
  std::uint64_t solids = 0, nodes = 0, triangles = 0;
  bool flat = false;
  SolidMesh mesh;
  Bounds box;                                   ///< of its positions
  std::optional<csg::BoundaryReport> boundary;  ///< of the exact method
  std::optional<ContourReport> contour;         ///< of the contour
  VoxelGrid grid;                               ///< of the contour
  std::vector<std::string> names;               ///< of the tree's solids
  std::optional<std::uint64_t> output_bytes;
  double read_ms = 0, mesh_ms = 0, write_ms = 0;
};

/// For people: a line a topic.
[[nodiscard]] std::string mesh_text(const MeshCommand& command, const MeshOutcome& outcome);

/// For programs, as docs/json.md says.
[[nodiscard]] std::string mesh_json(const MeshCommand& command, const MeshOutcome& outcome,
                                    const Session& session);

}  // namespace strata::apps
