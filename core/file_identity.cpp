#include "strata/core/file_identity.h"

#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

namespace strata {

FileIdentity identify_file(const std::string& path) {
  FileIdentity file{path, 0, 0};
  struct stat facts {};
  if (stat(path.c_str(), &facts) == 0) {
    file.device = static_cast<std::uint64_t>(facts.st_dev);
    file.inode = static_cast<std::uint64_t>(facts.st_ino);
  }
  return file;
}

bool lies_below(const std::string& path, const std::string& root) {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::canonical(root, error);
  if (error) return false;
  const std::filesystem::path real = std::filesystem::weakly_canonical(path, error);
  return !error && std::mismatch(folder.begin(), folder.end(), real.begin(), real.end()).first ==
                       folder.end();
}

bool has_extension(std::string_view path, std::string_view extension) {
  if (path.size() < extension.size()) return false;
  path.remove_prefix(path.size() - extension.size());
  return std::equal(path.begin(), path.end(), extension.begin(), [](char a, char b) {
    return (a >= 'A' && a <= 'Z' ? static_cast<char>(a - 'A' + 'a') : a) == b;
  });
}

}  // namespace strata
