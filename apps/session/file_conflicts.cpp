#include "apps/session/file_conflicts.h"

#include <filesystem>
#include <system_error>

namespace strata::apps {
namespace {

namespace fs = std::filesystem;

/// Most links to links that are followed; the system follows as many.
constexpr int kMaxLinks = 40;

/// The file that a name would make, links followed even where nothing is there yet.
fs::path resolved(const std::string& name) {
  std::string bare = name;
  while (bare.size() > 1 && bare.ends_with('/')) bare.pop_back();
  std::error_code error;
  fs::path path = fs::weakly_canonical(fs::absolute(bare, error), error);
  for (int i = 0; i < kMaxLinks && fs::is_symlink(path, error); ++i) {
    const fs::path target = fs::read_symlink(path, error);
    if (error) break;
    path = fs::weakly_canonical(path.parent_path() / target, error);
  }
  return path;
}

bool same_file(const std::string& a, const std::string& b) {
  std::error_code error;
  if (fs::equivalent(a, b, error) && !error) return true;  // hard links, too
  return resolved(a) == resolved(b);
}

/// Whether the folder that a name means has a file in it, at any depth. A folder of files takes its
/// place.
bool holds(const std::string& folder, const std::string& file) {
  std::error_code error;
  return fs::is_directory(folder, error) && lies_below(resolved(file).string(), folder);
}

/// Whether one works in a folder or below it: files are written there without a thought.
bool is_worked_in(const std::string& folder) {
  std::error_code error;
  const fs::path here = fs::current_path(error);
  return fs::equivalent(folder, here, error) || lies_below(here.string(), folder);
}

tl::unexpected<Error> overwrites(const FileUse& out, std::string_view what,
                                 const std::string& path) {
  return fail(ErrorCode::kUsage, "{} {} would overwrite {} {}", out.asked_by, out.path, what, path);
}

}  // namespace

bool is_stream(const std::string& path) {
  if (path == "-") return true;
  for (const char* begin : {"/dev/std", "/dev/fd/", "/proc/"}) {
    if (path.starts_with(begin)) return true;
  }
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

Result<void> check_files(const std::vector<FileUse>& read, const std::vector<FileUse>& written) {
  for (std::size_t i = 0; i < written.size(); ++i) {
    const FileUse& out = written[i];
    if (is_stream(out.path)) continue;
    for (const FileUse& in : read) {
      if (is_stream(in.path)) continue;
      if (same_file(in.path, out.path) || holds(out.path, in.path)) {
        return overwrites(out, in.asked_by, in.path);
      }
      if (holds(in.path, out.path) && !is_worked_in(in.path)) {
        return fail(ErrorCode::kUsage, "{} {} must not lie in {} {}", out.asked_by, out.path,
                    in.asked_by, in.path);
      }
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (is_stream(written[j].path) || !same_file(written[j].path, out.path)) continue;
      return fail(ErrorCode::kUsage, "{} {} and {} {} would be written to one file",
                  written[j].asked_by, written[j].path, out.asked_by, out.path);
    }
  }
  return {};
}

Result<void> check_opened(const FileIdentity& opened, const std::vector<FileUse>& written) {
  if (!opened.is_there()) return {};
  for (const FileUse& out : written) {
    if (is_stream(out.path)) continue;
    if (opened.is_same_file(identify_file(out.path)) || holds(out.path, opened.path)) {
      return overwrites(out, "a file of the scene,", opened.path);
    }
  }
  return {};
}

}  // namespace strata::apps
