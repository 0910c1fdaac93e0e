#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace strata {

/// Identity of a file when it was opened. A name may later belong to another file, and links give
/// one file several names.
struct FileIdentity {
  std::string path;          ///< as it was opened
  std::uint64_t device = 0;  ///< with the inode: the file, on this machine
  std::uint64_t inode = 0;   ///< 0: there was no file

  /// Whether there was a file of that name.
  [[nodiscard]] bool is_there() const { return inode != 0; }
  /// Whether both names lead to one file that exists.
  [[nodiscard]] bool is_same_file(const FileIdentity& other) const {
    return is_there() && device == other.device && inode == other.inode;
  }
};

/// Identity of the file that a name leads to now, links followed.
[[nodiscard]] FileIdentity identify_file(const std::string& path);

/// Whether a file lies in a folder or in those below it, links followed.
[[nodiscard]] bool lies_below(const std::string& path, const std::string& folder);

/// Whether a file's name ends with `extension` (lower case, with the dot), in either case.
[[nodiscard]] bool has_extension(std::string_view path, std::string_view extension);

}  // namespace strata
