#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/result.h"

namespace strata {

/// A file in a ZIP archive. (Internal to voxelize/.)
struct ZipMember {
  std::string name;
  bool deflated = false;
  std::uint64_t bytes = 0;    ///< unpacked
  std::string_view packed{};  ///< as they stand in the archive
};

/// The stored and deflated files of an archive, with 64-bit sizes. @return kInput naming the place
Result<std::vector<ZipMember>> zip_members(std::string_view bytes, const std::string& path);

}  // namespace strata
