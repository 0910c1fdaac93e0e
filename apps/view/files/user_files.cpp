#include "apps/view/files/user_files.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/atomic_file.h"

namespace strata::view {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRecent = "recent-files";
constexpr const char* kLook = "window-look";
constexpr const char* kSize = "window-size";
constexpr std::size_t kMostLines = 100;  // of a file that another program has spoilt

std::string folder(const char* variable, const char* below_home) {
  // The specification: a path that is not absolute is ignored.
  const char* given = std::getenv(variable);
  if (given != nullptr && given[0] == '/') return (fs::path(given) / "strata").string();
  const char* home = std::getenv("HOME");
  if (home == nullptr || home[0] != '/') return {};
  return (fs::path(home) / below_home / "strata").string();
}

std::vector<std::string> lines_of(const std::string& folder, const char* name) {
  std::vector<std::string> lines;
  if (folder.empty()) return lines;
  std::ifstream in(fs::path(folder) / name, std::ios::binary);
  for (std::string line; lines.size() < kMostLines && std::getline(in, line);) {
    if (!line.empty()) lines.push_back(std::move(line));
  }
  return lines;
}

void write_lines(const std::string& folder, const char* name,
                 const std::vector<std::string>& lines) {
  if (folder.empty()) return;
  std::error_code error;
  fs::create_directories(folder, error);
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  (void)write_file((fs::path(folder) / name).string(), text.data(), text.size());
}

}  // namespace

UserFolders user_folders() {
  return {folder("XDG_CONFIG_HOME", ".config"), folder("XDG_STATE_HOME", ".local/state")};
}

std::vector<std::string> recent_files(const UserFolders& folders) {
  std::vector<std::string> files = lines_of(folders.state, kRecent);
  std::erase_if(files, [](const std::string& path) {
    std::error_code error;
    return !fs::is_regular_file(path, error);
  });
  if (files.size() > kMostRecentFiles) files.resize(kMostRecentFiles);
  return files;
}

void remember_file(const UserFolders& folders, const std::string& path) {
  std::error_code error;
  const std::string whole = fs::weakly_canonical(path, error).string();
  if (error || whole.find('\n') != std::string::npos) return;
  std::vector<std::string> files = recent_files(folders);
  std::erase(files, whole);
  files.insert(files.begin(), whole);
  if (files.size() > kMostRecentFiles) files.resize(kMostRecentFiles);
  write_lines(folders.state, kRecent, files);
}

std::string remembered_look(const UserFolders& folders) {
  const auto lines = lines_of(folders.config, kLook);
  return lines.empty() ? std::string() : lines.front();
}

void remember_look(const UserFolders& folders, std::string_view look) {
  write_lines(folders.config, kLook, {std::string(look)});
}

std::optional<glm::ivec2> remembered_size(const UserFolders& folders) {
  constexpr int kLeast = 100, kMost = 16384;
  const auto lines = lines_of(folders.state, kSize);
  if (lines.empty()) return {};
  std::istringstream words(lines.front());
  glm::ivec2 size(0);
  words >> size.x >> size.y;
  if (!words || std::min(size.x, size.y) < kLeast || std::max(size.x, size.y) > kMost) return {};
  return size;
}

void remember_size(const UserFolders& folders, const glm::ivec2& size) {
  write_lines(folders.state, kSize, {std::to_string(size.x) + " " + std::to_string(size.y)});
}

}  // namespace strata::view
