#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "strata/core/file_identity.h"

// Whether files that a scene is made of have changed on the disk.

namespace strata::view {

/// Looks at files when asked. A change counts once the file has stayed the same from one look to
/// the next, and only while it can be read: editors write in steps, or remove a file and put
/// another one in its place.
class FileWatch {
 public:
  /// Watches the files and, of scenes (.csg, .scad), what they name: meshes, outlines, pictures,
  /// included programs, and what those name.
  /// @param asset_folder where scenes look for files; empty: beside the scene
  explicit FileWatch(std::vector<std::string> files, std::string asset_folder = {});

  /// Whether something has changed since the last time this said so. Costs a stat() a file.
  [[nodiscard]] bool changed();
  /// Reads anew which files the scenes name. To be called when they have been loaded.
  /// @param opened what was read then; of what could not be loaded the text alone tells
  void refresh(std::span<const FileIdentity> opened = {});

  [[nodiscard]] std::vector<std::string> files() const;

 private:
  struct Stamp {
    std::int64_t seconds = 0, nanoseconds = 0;
    std::uint64_t inode = 0, size = 0;
    bool there = false;
    friend bool operator==(const Stamp&, const Stamp&) = default;
  };
  struct Watched {
    std::string path;
    Stamp loaded;  ///< when it was last said to have changed
    Stamp seen;    ///< at the last look
  };
  static Stamp stamp_of(const std::string& path);

  std::vector<std::string> roots_;
  std::string asset_folder_;
  std::vector<Watched> watched_;
};

}  // namespace strata::view
