#include "apps/scene_files.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <utility>

#include "apps/csg_scene.h"

namespace strata::apps {
namespace {

/// Of a scene no more is read in search of names.
constexpr std::size_t kMaxText = std::size_t{64} << 20;
constexpr std::size_t kMaxFiles = 4096;

std::string text_of(const std::string& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  if (error || size > kMaxText) return {};
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

std::vector<std::string> quoted_names(std::string_view text) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char open = text[i];
    if (open != '"' && open != '<') continue;
    const std::size_t end = text.find_first_of(open == '"' ? "\"\n" : ">\n ", i + 1);
    if (end == std::string_view::npos) break;
    if (text[end] != (open == '"' ? '"' : '>')) {
      if (open == '"') i = end;
      continue;
    }
    const std::string_view name = text.substr(i + 1, end - i - 1);
    // A file that a scene takes has an ending; most quoted text has none.
    if (name.size() > 2 && name.find('.') != std::string_view::npos) names.emplace(name);
    i = end;
  }
  return {names.begin(), names.end()};
}

std::vector<std::string> with_scene_files(std::vector<std::string> files,
                                          const std::string& asset_folder, bool all_scenes) {
  const std::size_t given = files.size();
  std::set<std::string> known(files.begin(), files.end());
  for (std::size_t i = 0; i < files.size() && files.size() < kMaxFiles; ++i) {
    if (!is_scene_name(files[i]) && !(all_scenes && i < given)) continue;
    const std::filesystem::path own = std::filesystem::path(files[i]).parent_path();
    for (const std::string& name : quoted_names(text_of(files[i]))) {
      for (const auto& folder : {own, std::filesystem::path(asset_folder)}) {
        std::error_code error;
        std::string path = (folder / name).string();
        if (!std::filesystem::is_regular_file(path, error) || !known.insert(path).second) continue;
        files.push_back(std::move(path));
      }
    }
  }
  return files;
}

}  // namespace strata::apps
