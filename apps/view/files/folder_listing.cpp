#include "apps/view/files/folder_listing.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <tuple>

#include "strata/csg/input/scene_input.h"
#include "strata/mesh/formats/read_mesh.h"
#include "strata/voxelize/readers/read_voxels.h"

namespace strata::view {

bool can_open(const std::string& name) {
  return csg::is_scene_name(name) || mesh_format_of(name) != MeshFormat::kAuto ||
         is_voxel_file(name);
}

Result<std::vector<FolderEntry>> list_folder(const std::string& path) {
  constexpr std::size_t kMostEntries = 100'000;
  std::error_code error;
  std::vector<FolderEntry> entries;
  const std::filesystem::directory_iterator none;
  for (std::filesystem::directory_iterator at(path, error); !error && at != none;
       at.increment(error)) {
    if (entries.size() == kMostEntries) break;
    FolderEntry entry;
    entry.name = at->path().filename().string();
    if (entry.name.starts_with('.')) continue;
    std::error_code ignored;
    entry.is_folder = at->is_directory(ignored);
    if (!entry.is_folder && (!at->is_regular_file(ignored) || !can_open(entry.name))) continue;
    if (!entry.is_folder) entry.bytes = at->file_size(ignored);
    entries.push_back(std::move(entry));
  }
  if (error) return fail(ErrorCode::kInput, "{}: {}", path, error.message());
  std::sort(entries.begin(), entries.end(), [](const FolderEntry& a, const FolderEntry& b) {
    return std::tuple(!a.is_folder, a.name) < std::tuple(!b.is_folder, b.name);
  });
  return entries;
}

}  // namespace strata::view
