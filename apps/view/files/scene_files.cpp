#include "apps/view/files/scene_files.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <utility>

#include "strata/csg/input/scene_input.h"
#include "strata/csg/scene/scene.h"

namespace strata::view {
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
  const auto add = [&names](std::string name) {
    // A file that a scene takes has an ending; most quoted text has none.
    if (name.size() > 2 && name.find('.') != std::string::npos) names.insert(std::move(name));
  };
  const auto follows_include = [text](std::size_t at) {
    const std::size_t last =
        text.find_last_not_of(" \t", at == 0 ? std::string_view::npos : at - 1);
    if (at == 0 || last == std::string_view::npos) return false;
    const std::string_view before = text.substr(0, last + 1);
    return before.ends_with("include") || before.ends_with("use");
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '<' && follows_include(i)) {
      const std::size_t end = text.find_first_of(">\n", i + 1);
      if (end == std::string_view::npos) break;
      if (text[end] == '>') add(std::string(text.substr(i + 1, end - i - 1)));
      i = end;
    } else if (text[i] == '"') {
      // A quote that a comment leaves open ends with its line.
      std::string name;
      for (++i; i < text.size() && text[i] != '"' && text[i] != '\n'; ++i) {
        if (text[i] == '\\' && i + 1 < text.size()) ++i;
        name += text[i];
      }
      if (i < text.size() && text[i] == '"') add(std::move(name));
    }
  }
  return {names.begin(), names.end()};
}

std::vector<std::string> with_scene_files(std::vector<std::string> files,
                                          const std::string& asset_folder, bool all_scenes) {
  const std::size_t given = files.size();
  std::set<std::string> known(files.begin(), files.end());
  for (std::size_t i = 0; i < files.size() && files.size() < kMaxFiles; ++i) {
    if (!csg::is_scene_name(files[i]) && !(all_scenes && i < given)) continue;
    std::vector<std::string> folders{std::filesystem::path(files[i]).parent_path().string()};
    if (!asset_folder.empty()) folders.push_back(asset_folder);
    for (const std::string& name : quoted_names(text_of(files[i]))) {
      for (const std::string& folder : folders) {
        auto path = csg::find_asset(folder, name);
        if (path && known.insert(*path).second) files.push_back(*std::move(path));
      }
    }
  }
  return files;
}

}  // namespace strata::view
