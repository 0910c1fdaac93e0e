#include "csg/scene/zip_entry.h"

#ifdef STRATA_HAVE_LIBZIP
#include <zip.h>
#endif

#include <memory>
#include <new>

namespace strata::csg {

#ifdef STRATA_HAVE_LIBZIP

// libzip, since minizip refuses the archives that lib3mf 1 writes, and with it OpenSCAD 2021.
Result<std::string> unzip_first(const std::string& path,
                                const std::function<bool(std::string_view name)>& wanted) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 31;
  struct Close {
    void operator()(zip_t* archive) const { zip_discard(archive); }
    void operator()(zip_file_t* file) const { zip_fclose(file); }
  };
  int reason = 0;
  const std::unique_ptr<zip_t, Close> archive(zip_open(path.c_str(), ZIP_RDONLY, &reason));
  if (!archive) {
    zip_error_t error;
    zip_error_init_with_code(&error, reason);
    const std::string text = zip_error_strerror(&error);
    zip_error_fini(&error);
    return fail(ErrorCode::kInput, "{}: no zip archive ({})", path, text);
  }
  const zip_int64_t count = zip_get_num_entries(archive.get(), 0);
  for (zip_int64_t i = 0; i < count; ++i) {
    const auto index = static_cast<zip_uint64_t>(i);
    const char* name = zip_get_name(archive.get(), index, 0);
    if (!name || !wanted(name)) continue;
    const std::unique_ptr<zip_file_t, Close> file(zip_fopen_index(archive.get(), index, 0));
    if (!file) {
      return fail(ErrorCode::kInput, "{}: '{}' in the archive: {}", path, name,
                  zip_strerror(archive.get()));
    }
    std::string bytes;
    try {
      char buffer[1 << 16];
      for (;;) {
        const zip_int64_t read = zip_fread(file.get(), buffer, sizeof buffer);
        if (read < 0) {
          return fail(ErrorCode::kInput, "{}: '{}' in the archive is damaged", path, name);
        }
        if (read == 0) return bytes;
        bytes.append(buffer, static_cast<std::size_t>(read));
        if (bytes.size() > kMostBytes) {
          return fail(ErrorCode::kLimit, "{}: '{}' is more than 2 GiB unpacked", path, name);
        }
      }
    } catch (const std::bad_alloc&) {
      return fail(ErrorCode::kLimit, "{}: no memory for '{}'", path, name);
    }
  }
  return fail(ErrorCode::kInput, "{}: the archive has no model", path);
}

#else

Result<std::string> unzip_first(const std::string& path,
                                const std::function<bool(std::string_view name)>&) {
  return fail(ErrorCode::kUsage, "{}: this build cannot unpack it (libzip-dev was missing)", path);
}

#endif

}  // namespace strata::csg
