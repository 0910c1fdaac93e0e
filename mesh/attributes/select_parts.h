#pragma once

#include <string>
#include <vector>

#include "strata/core/result.h"
#include "strata/mesh/mesh_file.h"

namespace strata::detail {

/// Keeps the parts that MeshReadOptions::parts names: their triangles, the vertices of these, and
/// what the attributes say of them. Face elements keep their numbers. @param name  of the file
/// @return kInput: a name is not that of a part, or no triangle is left
Result<void> select_parts(const std::vector<std::string>& parts, const std::string& name,
                          MeshFile& file);

}  // namespace strata::detail
