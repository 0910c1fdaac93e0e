#include "voxelize/output/folder_output.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <mutex>
#include <system_error>
#include <utility>

namespace strata {
namespace {

tl::unexpected<Error> cannot_write(const std::string& folder, const std::string& name, int reason) {
  return fail(ErrorCode::kOutput, "{}{}{}: cannot write: {}", folder,
              folder.ends_with('/') ? "" : "/", name, std::generic_category().message(reason));
}

}  // namespace

FolderOutput::FolderOutput(FolderOutput&& other) noexcept
    : path_(std::move(other.path_)),
      folder_(std::move(other.folder_)),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

FolderOutput::~FolderOutput() {
  if (descriptor_ >= 0) close(descriptor_);
}

Result<FolderOutput> FolderOutput::create(const std::string& path) {
  Result<AtomicFolder> folder = AtomicFolder::create(path);
  if (!folder) return tl::unexpected(folder.error());
  const std::string temporary = folder->temporary_path();
  FolderOutput output(path, std::move(*folder));
  if (auto opened = output.open_folder(temporary); !opened) return tl::unexpected(opened.error());
  return output;
}

Result<FolderOutput> FolderOutput::join(const std::string& path) {
  FolderOutput output(path, std::nullopt);
  if (auto opened = output.open_folder(path); !opened) return tl::unexpected(opened.error());
  return output;
}

Result<void> FolderOutput::open_folder(const std::string& path) {
  descriptor_ = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor_ < 0) return cannot_write(path_, "", errno);
  return {};
}

Result<void> FolderOutput::make_folder(const std::string& name) const {
  if (mkdirat(descriptor_, name.c_str(), S_IRWXU | S_IRWXG | S_IRWXO) == 0) return {};
  if (!folder_ && errno == EEXIST) return {};
  return cannot_write(path_, name, errno);
}

Result<void> FolderOutput::write(const std::string& name, const void* data,
                                 std::size_t bytes) const {
  const int file = openat(descriptor_, name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC,
                          S_IRUSR | S_IWUSR | S_IRGRP | S_IWGRP | S_IROTH | S_IWOTH);
  if (file < 0) return cannot_write(path_, name, errno);
  const char* from = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t done = ::write(file, from, bytes);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) {
      const int reason = done < 0 ? errno : ENOSPC;
      close(file);
      return cannot_write(path_, name, reason);
    }
    from += done;
    bytes -= static_cast<std::size_t>(done);
  }
  // Network file systems report a full disk only here.
  if (close(file) != 0 && errno != EINTR) return cannot_write(path_, name, errno);
  return {};
}

Result<void> FolderOutput::for_each(
    const Execution& execution, std::size_t count,
    const std::function<Result<void>(std::size_t, int worker)>& body) {
  std::mutex mutex;
  std::atomic<bool> failed{false};
  std::atomic<std::size_t> begun{0};
  Result<void> outcome;
  parallel_for(execution, count, [&](std::size_t index, int worker) {
    begun.fetch_add(1, std::memory_order_relaxed);
    if (failed.load(std::memory_order_relaxed)) return;
    Result<void> result = body(index, worker);
    if (result) return;
    const std::lock_guard lock(mutex);
    if (!failed.exchange(true)) outcome = std::move(result);
  });
  if (outcome && begun < count) return fail(ErrorCode::kCancelled, "cancelled");
  return outcome;
}

}  // namespace strata
