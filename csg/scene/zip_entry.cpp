#include "csg/scene/zip_entry.h"

#ifdef STRATA_HAVE_MINIZIP
#include <minizip/unzip.h>
#endif

#include <memory>
#include <new>

namespace strata::csg {

#ifdef STRATA_HAVE_MINIZIP

Result<std::string> unzip_first(const std::string& path,
                                const std::function<bool(std::string_view name)>& wanted) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 31;
  struct Close {
    void operator()(void* archive) const { unzClose(archive); }
  };
  const std::unique_ptr<void, Close> archive(unzOpen64(path.c_str()));
  if (!archive) return fail(ErrorCode::kInput, "{}: no zip archive", path);
  for (int found = unzGoToFirstFile(archive.get()); found == UNZ_OK;
       found = unzGoToNextFile(archive.get())) {
    char name[1024];
    if (unzGetCurrentFileInfo64(archive.get(), nullptr, name, sizeof name, nullptr, 0, nullptr,
                                0) != UNZ_OK) {
      break;
    }
    name[sizeof name - 1] = '\0';
    if (!wanted(name)) continue;
    if (unzOpenCurrentFile(archive.get()) != UNZ_OK) {
      return fail(ErrorCode::kInput, "{}: '{}' in the archive cannot be opened", path, name);
    }
    std::string bytes;
    try {
      char buffer[1 << 16];
      for (;;) {
        const int read = unzReadCurrentFile(archive.get(), buffer, sizeof buffer);
        if (read < 0) {
          return fail(ErrorCode::kInput, "{}: '{}' in the archive is damaged", path, name);
        }
        if (read == 0) break;
        bytes.append(buffer, static_cast<std::size_t>(read));
        if (bytes.size() > kMostBytes) {
          return fail(ErrorCode::kLimit, "{}: '{}' is more than 2 GiB unpacked", path, name);
        }
      }
    } catch (const std::bad_alloc&) {
      return fail(ErrorCode::kLimit, "{}: no memory for '{}'", path, name);
    }
    if (unzCloseCurrentFile(archive.get()) != UNZ_OK) {
      return fail(ErrorCode::kInput, "{}: '{}' in the archive is damaged", path, name);
    }
    return bytes;
  }
  return fail(ErrorCode::kInput, "{}: the archive has no model", path);
}

#else

Result<std::string> unzip_first(const std::string& path,
                                const std::function<bool(std::string_view name)>&) {
  return fail(ErrorCode::kUsage, "{}: this build cannot unpack it (libminizip-dev was missing)",
              path);
}

#endif

}  // namespace strata::csg
