#include "apps/view/files/file_watch.h"

#include <sys/stat.h>

#include <algorithm>
#include <utility>

#include "apps/view/files/scene_files.h"

namespace strata::view {
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

void FileWatch::refresh(std::span<const FileIdentity> opened) {
  std::vector<Watched> watched;
  std::vector<std::string> files = with_scene_files(roots_, asset_folder_);
  for (const FileIdentity& file : opened) {
    if (std::find(files.begin(), files.end(), file.path) == files.end()) files.push_back(file.path);
  }
  for (const std::string& path : files) {
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
