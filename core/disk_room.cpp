#include "core/disk_room.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/statvfs.h>

#include <string>

#include "core/atomic_file.h"

namespace strata {
namespace {

std::string size_of(std::uint64_t bytes) {
  const double gigabytes = static_cast<double>(bytes) / 1e9;
  return gigabytes < 1000 ? fmt::format("{:.3g} GB", gigabytes)
                          : fmt::format("{:.6g} TB", gigabytes / 1000);
}

}  // namespace

Result<void> check_room(const std::string& path, std::uint64_t bytes) {
  struct stat there {};
  const bool exists = stat(path.c_str(), &there) == 0;
  if (path == "-" || (exists && !S_ISREG(there.st_mode) && !S_ISDIR(there.st_mode))) return {};
  const std::string target = follow_link(path);  // as AtomicFile writes it
  std::string folder = target.substr(0, target.rfind('/') + 1);
  if (folder.empty()) folder.push_back('.');
  struct statvfs disk {};
  if (statvfs(folder.c_str(), &disk) != 0) return {};  // whoever creates the file says why
  if (disk.f_blocks == 0) return {};                   // the file system does not say
  const std::uint64_t room = std::uint64_t{disk.f_bavail} * std::uint64_t{disk.f_frsize};
  if (bytes <= room) return {};
  return fail(ErrorCode::kLimit, "{}: the file takes {}, but the disk has room for {}", path,
              size_of(bytes), size_of(room));
}

}  // namespace strata
