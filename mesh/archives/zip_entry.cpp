#include "mesh/archives/zip_entry.h"

#ifdef STRATA_HAVE_LIBZIP
#include <zip.h>
#endif

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "core/letters.h"
#include "mesh/text/text_scanner.h"

namespace strata {
namespace {

std::string_view without_slash(std::string_view name) {
  return name.starts_with('/') ? name.substr(1) : name;
}

}  // namespace

std::optional<std::string> ZipArchive::find(std::string_view name) const {
  const auto look = [&](std::string_view wanted) -> std::optional<std::string> {
    for (const std::string& known : names_) {
      if (same_word(wanted, without_slash(known))) return known;
    }
    return std::nullopt;
  };
  const std::string_view wanted = without_slash(name);
  auto found = look(wanted);
  if (found || wanted.find('%') == std::string_view::npos) return found;
  return look(strata::detail::without_escapes(wanted));
}

#ifdef STRATA_HAVE_LIBZIP

namespace {

/// Why a file cannot be opened as an archive. @param text  libzip's words
std::string what_is_no_archive(const std::string& path, const std::string& text) {
  std::ifstream file(path, std::ios::binary);
  char begin[4] = {};
  file.read(begin, sizeof begin);
  if (file.gcount() == 0) return "the file is empty";
  std::error_code unknown;
  const auto bytes = std::filesystem::file_size(path, unknown);
  const std::string_view head(begin, static_cast<std::size_t>(file.gcount()));
  if (!unknown && std::string_view("PK\3\4").starts_with(head)) {
    return fmt::format(
        "the file ends in the middle: {} bytes, and the archive's list of files, "
        "which stands at its end, is missing ({})",
        bytes, text);
  }
  return fmt::format("not a zip archive ({})", text);
}

}  // namespace

Result<ZipArchive> ZipArchive::open(const std::string& path) {
  int reason = 0;
  zip_t* const opened = zip_open(path.c_str(), ZIP_RDONLY, &reason);
  if (!opened) {
    zip_error_t error;
    zip_error_init_with_code(&error, reason);
    const std::string text = zip_error_strerror(&error);
    zip_error_fini(&error);
    if (reason == ZIP_ER_MEMORY) return fail(ErrorCode::kLimit, "{}: {}", path, text);
    if (reason == ZIP_ER_NOENT || reason == ZIP_ER_OPEN || reason == ZIP_ER_READ) {
      return fail(ErrorCode::kInput, "{}: {}", path, text);
    }
    return fail(ErrorCode::kInput, "{}: {}", path, what_is_no_archive(path, text));
  }
  ZipArchive archive;
  archive.archive_ =
      std::shared_ptr<void>(opened, [](void* at) { zip_discard(static_cast<zip_t*>(at)); });
  archive.path_ = path;
  const zip_int64_t count = zip_get_num_entries(opened, 0);
  for (zip_int64_t i = 0; i < count; ++i) {
    const char* name = zip_get_name(opened, static_cast<zip_uint64_t>(i), 0);
    archive.names_.emplace_back(name ? name : "");
  }
  return archive;
}

Result<std::string> ZipArchive::read(const std::string& name, const Execution& execution) const {
  constexpr std::size_t kMostBytes = std::size_t{1} << 31;
  struct Close {
    void operator()(zip_file_t* file) const { zip_fclose(file); }
  };
  auto* const archive = static_cast<zip_t*>(archive_.get());
  const auto at = std::find(names_.begin(), names_.end(), name);
  const std::unique_ptr<zip_file_t, Close> file(
      at == names_.end()
          ? nullptr
          : zip_fopen_index(archive, static_cast<zip_uint64_t>(at - names_.begin()), 0));
  if (!file) {
    return fail(ErrorCode::kInput, "{}: '{}' in the archive: {}", path_, name,
                at == names_.end() ? "it is missing" : zip_strerror(archive));
  }
  const std::uint64_t most = execution.memory_limit == 0
                                 ? kMostBytes
                                 : std::min<std::uint64_t>(kMostBytes, execution.memory_limit);
  std::string bytes;
  char buffer[1 << 16];
  zip_stat_t stat;
  zip_stat_init(&stat);
  constexpr zip_uint64_t kSizes = ZIP_STAT_SIZE | ZIP_STAT_COMP_SIZE;
  if (zip_stat_index(archive, static_cast<zip_uint64_t>(at - names_.begin()), 0, &stat) == 0 &&
      (stat.valid & kSizes) == kSizes) {
    // The archive may claim any size, so the room is bounded: deflate packs at most 1032 to 1.
    constexpr std::uint64_t kMostRatio = 1032, kMostClaim = std::uint64_t{1} << 28;
    const std::uint64_t possible = std::min(stat.comp_size, kMostClaim) * kMostRatio;
    bytes.reserve(std::min({stat.size, possible, kMostClaim, most}) + sizeof buffer);
  }
  for (;;) {
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    const zip_int64_t read = zip_fread(file.get(), buffer, sizeof buffer);
    if (read < 0) {
      return fail(ErrorCode::kInput, "{}: '{}' in the archive is damaged", path_, name);
    }
    if (read == 0) return bytes;
    bytes.append(buffer, static_cast<std::size_t>(read));
    if (bytes.size() > most) {
      return fail(ErrorCode::kLimit, "{}: '{}' has more than {} bytes unpacked, which is the {}",
                  path_, name, most, most == kMostBytes ? "most that is read" : "memory limit");
    }
  }
}

#else

Result<ZipArchive> ZipArchive::open(const std::string& path) {
  return fail(ErrorCode::kUsage, "{}: this build cannot unpack it (libzip-dev was missing)", path);
}

Result<std::string> ZipArchive::read(const std::string& name, const Execution&) const {
  return fail(ErrorCode::kUsage, "{}: this build cannot unpack '{}' (libzip-dev was missing)",
              path_, name);
}

#endif

}  // namespace strata
