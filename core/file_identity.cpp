#include "strata/core/file_identity.h"

#include <sys/stat.h>

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

}  // namespace strata
