#pragma once

#include <optional>
#include <string>
#include <vector>

#include "strata/mesh/triangle_soup.h"
#include "tests/support/trouble.h"

// Real meshes, where present. Tests that need one skip with `missing_reason` when it is not there.

namespace strata::testkit {

/// A model of the folder shared/models beside the source tree, by its stem ("cow").
[[nodiscard]] std::optional<TriangleSoup> shared_model(const std::string& stem);

/// All models there, in a fixed order; empty when there is no such folder.
[[nodiscard]] std::vector<NamedMesh> shared_models();

/// Meshes of Debian's assimp-testmodels, libcgal-demo and openscad-testing-data, those that are
/// installed, that the readers take, and that have at most `max_triangles`; in a fixed order.
[[nodiscard]] std::vector<NamedMesh> debian_meshes(std::size_t max_triangles);

inline constexpr char kNoModels[] =
    "no models: they are looked for in shared/models beside the source tree";
inline constexpr char kNoCorpus[] =
    "no corpus: install assimp-testmodels, libcgal-demo or openscad-testing-data";

}  // namespace strata::testkit
