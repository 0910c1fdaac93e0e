#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "strata/core/result.h"

namespace strata::view {

/// Something in a folder.
struct FolderEntry {
  std::string name;
  bool is_folder = false;
  std::uint64_t bytes = 0;  ///< of a file
};

/// Whether the window opens a file of this name: a scene or a mesh.
[[nodiscard]] bool can_open(const std::string& name);

/// The folders in a folder, then the files that can be opened, each by name; without what begins
/// with a dot. @return kInput naming the folder and the system's reason
Result<std::vector<FolderEntry>> list_folder(const std::string& path);

}  // namespace strata::view
