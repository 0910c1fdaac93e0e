#include "apps/view/file_watch.h"

#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "apps/csg_scene.h"

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

FileWatch::FileWatch(std::vector<std::string> files, std::string asset_folder)
    : roots_(std::move(files)), asset_folder_(std::move(asset_folder)) {
  refresh();
}

FileWatch::Stamp FileWatch::stamp_of(const std::string& path) {
  struct stat facts {};
  if (stat(path.c_str(), &facts) != 0) return {};
  return {facts.st_mtim.tv_sec, facts.st_mtim.tv_nsec, facts.st_ino,
          static_cast<std::uint64_t>(facts.st_size), true};
}

void FileWatch::refresh() {
  std::vector<std::string> queue = roots_;
  std::set<std::string> known(queue.begin(), queue.end());
  for (std::size_t i = 0; i < queue.size() && queue.size() < kMaxFiles; ++i) {
    if (!apps::is_scene_name(queue[i])) continue;
    const std::filesystem::path own = std::filesystem::path(queue[i]).parent_path();
    for (const std::string& name : quoted_names(text_of(queue[i]))) {
      for (const auto& folder : {own, std::filesystem::path(asset_folder_)}) {
        std::error_code error;
        const std::string path = (folder / name).string();
        if (!std::filesystem::is_regular_file(path, error) || !known.insert(path).second) continue;
        queue.push_back(path);
      }
    }
  }
  std::vector<Watched> watched;
  for (const std::string& path : queue) {
    const auto old = std::find_if(watched_.begin(), watched_.end(),
                                  [&](const Watched& one) { return one.path == path; });
    // What has changed since it was loaded must still be noticed.
    if (old != watched_.end()) {
      watched.push_back(*old);
    } else {
      const Stamp now = stamp_of(path);
      watched.push_back({path, now, now});
    }
  }
  watched_ = std::move(watched);
}

bool FileWatch::changed() {
  bool settled = true, different = false;
  for (Watched& one : watched_) {
    const Stamp now = stamp_of(one.path);
    settled = settled && now == one.seen;
    one.seen = now;
    different = different || (now.there && !(now == one.loaded));
  }
  if (!different || !settled) return false;
  for (Watched& one : watched_) {
    if (one.seen.there) one.loaded = one.seen;
  }
  return true;
}

std::vector<std::string> FileWatch::files() const {
  std::vector<std::string> files;
  for (const Watched& one : watched_) files.push_back(one.path);
  return files;
}

}  // namespace strata::view
