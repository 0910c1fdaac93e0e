#pragma once

#include <cstdint>
#include <string>

#include "strata/core/result.h"

namespace strata {

/// Looks whether the disk has room for a file before hours of work write it. What is no file on a
/// disk, such as a pipe, has room. @param bytes  of the file, or fewer
/// @return kLimit naming both numbers
[[nodiscard]] Result<void> check_room(const std::string& path, std::uint64_t bytes);

}  // namespace strata
