#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "core/result.h"

namespace strata::csg {

/// Unpacks the first file of a zip archive whose name `wanted` accepts. @return kInput: no archive,
/// no such file, damaged; kLimit: more than 2 GiB unpacked; kUsage: a build without libzip
Result<std::string> unzip_first(const std::string& path,
                                const std::function<bool(std::string_view name)>& wanted);

}  // namespace strata::csg
