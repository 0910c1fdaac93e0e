#include "core/atomic_file.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

namespace strata {
namespace {

// --- the table of temporary names ---------------------------------------------------------------

// free -> filling -> live -> free by the owner; live -> removing -> removed by a signal handler. A
// handler owns a slot while it reads the name, so it never unlinks a name that is half overwritten.
enum class SlotState : int { kFree, kFilling, kLive, kRemoving, kRemoved };

struct Slot {
  std::atomic<SlotState> state{SlotState::kFree};
  bool folder = false;
  pid_t owner = 0;  // a forked child must not remove what its parent is writing
  std::array<char, PATH_MAX> name{};
};
static_assert(std::atomic<SlotState>::is_always_lock_free, "used in signal handlers");

std::array<Slot, kMaxTemporaries> temporaries;  // zero pages until used

// Index of a slot that holds `name`, or -1 when all are taken.
int enter_temporary(const std::string& name, bool folder) noexcept {
  if (name.size() >= PATH_MAX) return -1;
  for (int i = 0; i < kMaxTemporaries; ++i) {
    Slot& slot = temporaries[static_cast<std::size_t>(i)];
    SlotState expected = SlotState::kFree;
    if (!slot.state.compare_exchange_strong(expected, SlotState::kFilling)) continue;
    slot.folder = folder;
    slot.owner = getpid();
    std::memcpy(slot.name.data(), name.c_str(), name.size() + 1);
    slot.state.store(SlotState::kLive);
    return i;
  }
  return -1;
}

void leave_temporary(int& index) noexcept {
  if (index < 0) return;
  Slot& slot = temporaries[static_cast<std::size_t>(std::exchange(index, -1))];
  // Only a handler on another thread can hold the slot, and it never waits for us.
  SlotState expected = SlotState::kLive;
  while (!slot.state.compare_exchange_weak(expected, SlotState::kFree)) {
    if (expected != SlotState::kRemoved) expected = SlotState::kLive;
  }
}

// Removes what a folder holds with system calls alone; opendir would allocate.
void remove_content(int folder, int depth) noexcept {
  constexpr int kDeepest = 8;  // our folder formats have two levels
  struct Entry {               // linux_dirent64
    ino64_t inode;
    off64_t next;
    unsigned short length;
    unsigned char type;
    char name[1];
  };
  alignas(Entry) std::array<char, 2048> buffer;
  for (;;) {
    const long got = syscall(SYS_getdents64, folder, buffer.data(), buffer.size());
    if (got <= 0) return;
    for (long at = 0; at < got;) {
      const auto* entry = reinterpret_cast<const Entry*>(buffer.data() + at);
      const char* name = buffer.data() + at + offsetof(Entry, name);
      at += entry->length;
      if (std::strcmp(name, ".") == 0 || std::strcmp(name, "..") == 0) continue;
      if (unlinkat(folder, name, 0) == 0 || depth >= kDeepest) continue;
      const int child = openat(folder, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
      if (child < 0) continue;
      remove_content(child, depth + 1);
      close(child);
      unlinkat(folder, name, AT_REMOVEDIR);
    }
  }
}

void remove_folder(const char* name) noexcept {
  constexpr int kAttempts = 16;  // other threads may still add files while we empty the folder
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const int folder = open(name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (folder < 0) return;
    remove_content(folder, 0);
    close(folder);
    if (rmdir(name) == 0) return;
  }
}

// --- names --------------------------------------------------------------------------------------

std::string reason_text(int reason) { return std::generic_category().message(reason); }

tl::unexpected<Error> cannot_create(const std::string& path, int reason) {
  if (reason == ENOTEMPTY) {
    return fail(ErrorCode::kOutput,
                "{}: the folder is not empty; remove it, or choose another name", path);
  }
  const std::size_t slash = path.find_last_not_of('/') == std::string::npos
                                ? std::string::npos
                                : path.rfind('/', path.find_last_not_of('/'));
  if (reason == ENOENT && slash != std::string::npos &&
      access(path.substr(0, std::max<std::size_t>(slash, 1)).c_str(), F_OK) != 0) {
    return fail(ErrorCode::kOutput, "{}: cannot create: there is no folder {}", path,
                path.substr(0, slash));
  }
  return fail(ErrorCode::kOutput, "{}: cannot create: {}", path, reason_text(reason));
}

tl::unexpected<Error> too_many(const std::string& path) {
  return fail(ErrorCode::kLimit, "{}: more than {} output files are open at once", path,
              kMaxTemporaries);
}

// The next candidate for a temporary name beside `target`: ".name.tmp.PID-N".
std::string temporary_name(const std::string& target) {
  static std::atomic<unsigned> counter{0};
  constexpr std::size_t kLongestName = 200;  // NAME_MAX is 255, and ours is longer than the target
  const std::size_t slash = target.rfind('/');
  const std::size_t start = slash == std::string::npos ? 0 : slash + 1;
  return fmt::format("{}.{}.tmp.{}-{}", target.substr(0, start), target.substr(start, kLongestName),
                     getpid(), counter.fetch_add(1));
}

constexpr int kNameAttempts = 1000;  // names can be left over from a killed process of our number

/// Finds a name beside `target` that nothing has, and makes something of that name.
/// @param temporary, slot  its name, and its place among those that a signal removes
/// @param make  of a name; false with errno
template <class Make>
Result<void> make_temporary(const std::string& path, const std::string& target, bool folder,
                            std::string& temporary, int& slot, Make&& make) {
  for (int attempt = 0; attempt < kNameAttempts; ++attempt) {
    temporary = temporary_name(target);
    // Entered before it exists: a signal between the two finds nothing, rather than forgets it.
    slot = enter_temporary(temporary, folder);
    if (slot < 0) {
      return temporary.size() >= PATH_MAX ? cannot_create(path, ENAMETOOLONG) : too_many(path);
    }
    if (make(temporary.c_str())) return {};
    const int reason = errno;
    leave_temporary(slot);
    if (reason != EEXIST && reason != EINTR) return cannot_create(path, reason);
  }
  return cannot_create(path, EEXIST);
}

/// Of this thread, while it lives.
thread_local OutputGroup* current_group = nullptr;

void remove_tree(const std::string& name) noexcept {
  std::error_code ignored;
  std::filesystem::remove_all(name, ignored);
}

}  // namespace

void remove_temporary_files() noexcept {
  const int saved = errno;  // a handler must not disturb the code it interrupts
  const pid_t self = getpid();
  for (Slot& slot : temporaries) {
    SlotState expected = SlotState::kLive;
    if (!slot.state.compare_exchange_strong(expected, SlotState::kRemoving)) continue;
    if (slot.owner != self) {
      slot.state.store(SlotState::kLive);
      continue;
    }
    if (slot.folder) {
      remove_folder(slot.name.data());
    } else {
      unlink(slot.name.data());
    }
    slot.state.store(SlotState::kRemoved);
  }
  errno = saved;
}

// --- AtomicFile ---------------------------------------------------------------------------------

std::string follow_link(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_symlink(path, error)) return path;
  const std::filesystem::path target = std::filesystem::canonical(path, error);
  return error ? path : target.string();
}

Result<AtomicFile> AtomicFile::create(const std::string& path) {
  AtomicFile file;
  file.path_ = path;
  if (path == "-") {
    file.temporary_ = path;
    file.descriptor_ = STDOUT_FILENO;
    return file;
  }
  if (path.empty()) return fail(ErrorCode::kOutput, "the output has no name");

  struct stat status {};
  const bool exists = stat(path.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) return cannot_create(path, EISDIR);
  if (exists && access(path.c_str(), W_OK) != 0) return cannot_create(path, errno);
  if (exists && !S_ISREG(status.st_mode)) {
    file.temporary_ = path;
    file.descriptor_ = open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (file.descriptor_ < 0) return cannot_create(path, errno);
    return file;
  }

  file.target_ = follow_link(path);
  const auto made =
      make_temporary(path, file.target_, false, file.temporary_, file.slot_, [&](const char* name) {
        file.descriptor_ = open(name, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC,
                                S_IRUSR | S_IWUSR | S_IRGRP | S_IWGRP | S_IROTH | S_IWOTH);
        return file.descriptor_ >= 0;
      });
  if (!made) return tl::unexpected(made.error());
  if (file.descriptor_ <= STDERR_FILENO) {
    // A caller with a closed standard stream must not print into this file.
    const int higher = fcntl(file.descriptor_, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
    const int reason = errno;
    close(std::exchange(file.descriptor_, higher));
    if (higher < 0) return cannot_create(path, reason);
  }
  // Best effort: a file that is replaced keeps its permissions.
  if (exists) (void)!fchmod(file.descriptor_, status.st_mode & 07777);
  return file;
}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      temporary_(std::move(other.temporary_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      slot_(std::exchange(other.slot_, -1)),
      written_(other.written_),
      failed_(other.failed_.load()) {}

AtomicFile& AtomicFile::operator=(AtomicFile&& other) noexcept {
  if (this == &other) return *this;
  discard();
  path_ = std::move(other.path_);
  target_ = std::move(other.target_);
  temporary_ = std::move(other.temporary_);
  descriptor_ = std::exchange(other.descriptor_, -1);
  slot_ = std::exchange(other.slot_, -1);
  written_ = other.written_;
  failed_ = other.failed_.load();
  return *this;
}

AtomicFile::~AtomicFile() { discard(); }

void AtomicFile::discard() noexcept {
  if (descriptor_ > STDERR_FILENO) close(descriptor_);
  descriptor_ = -1;
  if (slot_ >= 0) unlink(temporary_.c_str());
  leave_temporary(slot_);
}

tl::unexpected<Error> AtomicFile::write_failure(std::size_t bytes, std::uint64_t offset,
                                                int reason) {
  failed_ = true;
  return fail(ErrorCode::kOutput, "{}: cannot write {} bytes at position {}: {}",
              path_ == "-" ? "standard output" : path_, bytes, offset, reason_text(reason));
}

Result<void> AtomicFile::write(const void* data, std::size_t bytes) {
  const char* from = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t done = ::write(descriptor_, from, bytes);
    if (done > 0) {
      from += done;
      bytes -= static_cast<std::size_t>(done);
      written_ += static_cast<std::uint64_t>(done);
      continue;
    }
    const int reason = done == 0 ? ENOSPC : errno;
    if (reason == EINTR) continue;
    if (reason == EAGAIN) {  // a pipe that its other end made non-blocking
      pollfd ready{descriptor_, POLLOUT, 0};
      (void)!poll(&ready, 1, -1);
      continue;
    }
    return write_failure(bytes, written_, reason);
  }
  return {};
}

Result<void> AtomicFile::write_at(std::uint64_t offset, const void* data, std::size_t bytes) {
  const char* from = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t done = pwrite(descriptor_, from, bytes, static_cast<off_t>(offset));
    if (done > 0) {
      from += done;
      bytes -= static_cast<std::size_t>(done);
      offset += static_cast<std::uint64_t>(done);
      continue;
    }
    const int reason = done == 0 ? ENOSPC : errno;
    if (reason == EINTR) continue;
    return write_failure(bytes, offset, reason);
  }
  return {};
}

Result<void> AtomicFile::commit() {
  if (descriptor_ < 0) return fail(ErrorCode::kInternal, "{}: committed twice", path_);
  if (failed_) {
    discard();
    return fail(ErrorCode::kOutput, "{}: not written, since a part of it failed", path_);
  }
  if (descriptor_ <= STDERR_FILENO) {
    descriptor_ = -1;
    return {};
  }
  // Not repeated after EINTR: Linux has released the descriptor by then.
  if (close(std::exchange(descriptor_, -1)) != 0 && errno != EINTR) {
    const int reason = errno;  // network file systems report a full disk here
    discard();
    return fail(ErrorCode::kOutput, "{}: cannot finish: {}", path_, reason_text(reason));
  }
  if (target_.empty()) return {};
  if (current_group != nullptr) {
    current_group->waiting_.reserve(current_group->waiting_.size() + 1);  // else the slot is lost
    current_group->waiting_.push_back({path_, target_, temporary_, std::exchange(slot_, -1)});
    return {};
  }
  if (std::rename(temporary_.c_str(), target_.c_str()) != 0) {
    const int reason = errno;
    discard();
    return fail(ErrorCode::kOutput, "{}: cannot rename {} to this name: {}", path_, temporary_,
                reason_text(reason));
  }
  leave_temporary(slot_);
  return {};
}

Result<void> write_file(const std::string& path, const void* data, std::size_t bytes) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  if (auto written = file->write(data, bytes); !written) return written;
  return file->commit();
}

// --- AtomicFolder -------------------------------------------------------------------------------

Result<AtomicFolder> AtomicFolder::create(const std::string& path) {
  AtomicFolder folder;
  folder.path_ = path;
  folder.target_ = path;
  while (folder.target_.size() > 1 && folder.target_.back() == '/') folder.target_.pop_back();
  if (path.empty()) return fail(ErrorCode::kOutput, "the output folder has no name");
  if (path == "-") {
    return fail(ErrorCode::kOutput, "a folder cannot be written to standard output");
  }
  const std::filesystem::path name(folder.target_);
  if (!name.has_filename() || name.filename() == "." || name.filename() == "..") {
    return cannot_create(path, EEXIST);
  }

  std::error_code reason;
  const std::filesystem::file_status status = std::filesystem::status(name, reason);
  if (std::filesystem::exists(status)) {
    if (!std::filesystem::is_directory(status)) return cannot_create(path, ENOTDIR);
    const bool empty = std::filesystem::is_empty(name, reason);
    if (reason) return cannot_create(path, reason.value());
    if (!empty) return cannot_create(path, ENOTEMPTY);
    folder.target_ = follow_link(folder.target_);
  }
  const auto made =
      make_temporary(path, folder.target_, true, folder.temporary_, folder.slot_,
                     [](const char* folder_name) { return mkdir(folder_name, 0777) == 0; });
  if (!made) return tl::unexpected(made.error());
  return folder;
}

AtomicFolder::AtomicFolder(AtomicFolder&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      temporary_(std::move(other.temporary_)),
      slot_(std::exchange(other.slot_, -1)) {}

AtomicFolder& AtomicFolder::operator=(AtomicFolder&& other) noexcept {
  if (this == &other) return *this;
  discard();
  path_ = std::move(other.path_);
  target_ = std::move(other.target_);
  temporary_ = std::move(other.temporary_);
  slot_ = std::exchange(other.slot_, -1);
  return *this;
}

AtomicFolder::~AtomicFolder() { discard(); }

void AtomicFolder::discard() noexcept {
  if (slot_ >= 0) remove_tree(temporary_);
  leave_temporary(slot_);
}

Result<void> AtomicFolder::commit() {
  if (slot_ < 0) return fail(ErrorCode::kInternal, "{}: committed twice", path_);
  if (current_group != nullptr) {
    current_group->waiting_.reserve(current_group->waiting_.size() + 1);  // else the slot is lost
    current_group->waiting_.push_back({path_, target_, temporary_, std::exchange(slot_, -1), true});
    return {};
  }
  // Takes the place of an empty folder in one step; the system refuses one with content.
  if (std::rename(temporary_.c_str(), target_.c_str()) != 0) {
    const int reason = errno;
    discard();
    return fail(ErrorCode::kOutput, "{}: cannot rename {} to this name: {}", path_, temporary_,
                reason_text(reason));
  }
  leave_temporary(slot_);
  return {};
}

// --- OutputGroup --------------------------------------------------------------------------------

OutputGroup::OutputGroup() { current_group = this; }

OutputGroup::~OutputGroup() {
  current_group = nullptr;
  for (Waiting& output : waiting_) {
    remove_tree(output.temporary);
    leave_temporary(output.slot);
  }
}

bool OutputGroup::lives() { return current_group != nullptr; }

std::string OutputGroup::place_of(const std::string& path) const {
  for (const Waiting& output : waiting_) {
    if (output.path == path) return output.temporary;
  }
  return path;
}

// Gives an output its name. Returns 0 or the system's reason.
int OutputGroup::place(Waiting& output) const {
  struct stat before {};
  const bool there = lstat(output.target.c_str(), &before) == 0;
  // Only of several may one have to be taken back. A folder takes the place of an empty one alone.
  if (waiting_.size() > 1 && there && !output.folder && !S_ISDIR(before.st_mode)) {
    output.exchanged = renameat2(AT_FDCWD, output.temporary.c_str(), AT_FDCWD,
                                 output.target.c_str(), RENAME_EXCHANGE) == 0;
    if (output.exchanged) return 0;
  }
  if (std::rename(output.temporary.c_str(), output.target.c_str()) != 0) return errno;
  output.replaced = there && !output.folder;
  return 0;
}

void OutputGroup::take_back(Waiting& output) noexcept {
  if (output.exchanged) {
    (void)!renameat2(AT_FDCWD, output.temporary.c_str(), AT_FDCWD, output.target.c_str(),
                     RENAME_EXCHANGE);
  } else if (!output.replaced) {
    (void)!std::rename(output.target.c_str(), output.temporary.c_str());
  }
}

Result<void> OutputGroup::commit() {
  std::size_t placed = 0;
  int reason = 0;
  while (placed < waiting_.size() && (reason = place(waiting_[placed])) == 0) ++placed;
  Result<void> result;
  if (reason != 0) {
    result = fail(ErrorCode::kOutput, "{}: cannot rename {} to this name: {}",
                  waiting_[placed].path, waiting_[placed].temporary, reason_text(reason));
    for (std::size_t i = placed; i-- > 0;) take_back(waiting_[i]);
  }
  for (Waiting& output : waiting_) {
    if (reason != 0 || output.exchanged) remove_tree(output.temporary);
    leave_temporary(output.slot);
  }
  waiting_.clear();
  return result;
}

}  // namespace strata
