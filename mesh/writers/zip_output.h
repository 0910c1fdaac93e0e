#pragma once

#include <string>
#include <vector>

#include "mesh/writers/mesh_blocks.h"

namespace strata::detail {

/// A file of a zip archive.
struct ZipMember {
  std::string name;  ///< ASCII, such as "3D/3dmodel.model"
  Blocks blocks;
};

/// Writes a zip archive. Its members are deflated block by block on all threads, so their bytes do
/// not depend on the number of threads; their time is the first of the year 1980. Holds the
/// deflated bytes of a member. @return kOutput; kLimit: the memory limit, or a member of 4 GiB;
/// kCancelled
Result<void> write_zip(const std::string& path, std::vector<ZipMember> members,
                       const Execution& execution);

}  // namespace strata::detail
