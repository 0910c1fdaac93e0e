#include "mesh/text/input_bytes.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace strata::detail {
namespace {

/// Pages of larger files are read on first access.
constexpr std::size_t kPopulateLimit = std::size_t{1} << 30;

std::string reason(int error) { return std::strerror(error); }

}  // namespace

InputBytes::InputBytes(InputBytes&& other) noexcept { *this = std::move(other); }

InputBytes& InputBytes::operator=(InputBytes&& other) noexcept {
  std::swap(mapped_, other.mapped_);
  std::swap(descriptor_, other.descriptor_);
  std::swap(size_, other.size_);
  std::swap(data_, other.data_);
  std::swap(owned_, other.owned_);
  // the bytes of a short string move with the object
  if (mapped_ == 0) data_ = owned_.c_str();
  if (other.mapped_ == 0) other.data_ = other.owned_.c_str();
  return *this;
}

InputBytes::~InputBytes() {
  if (mapped_ != 0) ::munmap(const_cast<char*>(data_), mapped_);
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<InputBytes> InputBytes::open(const std::string& path, std::uint64_t limit,
                                    const std::stop_token& stop) {
  if (path == "-") return read_all(STDIN_FILENO, "standard input", limit, stop);
  InputBytes file;
  // open() must not wait for the writer of a pipe: the wait happens where a stop request is
  // noticed.
  struct stat status = {};
  const bool pipe = ::stat(path.c_str(), &status) == 0 && S_ISFIFO(status.st_mode);
  file.descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | (pipe ? O_NONBLOCK : 0));
  if (file.descriptor_ < 0) return fail(ErrorCode::kInput, "{}: {}", path, reason(errno));
  if (::fstat(file.descriptor_, &status) != 0) {
    return fail(ErrorCode::kInput, "{}: {}", path, reason(errno));
  }
  if (!S_ISREG(status.st_mode) || status.st_size == 0) {
    return read_all(file.descriptor_, path, limit, stop);  // pipes, and /proc files whose size is 0
  }
  const auto size = static_cast<std::size_t>(status.st_size);
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  // The mapping is one anonymous, zeroed page longer than the file, so that a zero byte follows
  // even a file that fills its last page.
  const std::size_t span = (size / page + 1) * page;
  void* room = ::mmap(nullptr, span, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (room == MAP_FAILED) return fail(ErrorCode::kLimit, "{}: {}", path, reason(errno));
  const int populate = size <= kPopulateLimit ? MAP_POPULATE : 0;
  if (::mmap(room, size, PROT_READ, MAP_PRIVATE | MAP_FIXED | populate, file.descriptor_, 0) ==
      MAP_FAILED) {
    ::munmap(room, span);
    return read_all(file.descriptor_, path, limit, stop);
  }
  file.data_ = static_cast<const char*>(room);
  file.size_ = size;
  file.mapped_ = span;
  return file;
}

Result<InputBytes> InputBytes::read_all(int descriptor, const std::string& name,
                                        std::uint64_t limit, const std::stop_token& stop) {
  InputBytes file;
  std::size_t filled = 0;
  for (;;) {
    // The writer may never write, so the wait checks for a stop request now and then. The request
    // may come a moment after the signal that interrupts the wait.
    constexpr int kLookMilliseconds = 50;
    pollfd waiting = {.fd = descriptor, .events = POLLIN, .revents = 0};
    int ready = 0;
    while (!stop.stop_requested() && (ready == 0 || (ready < 0 && errno == EINTR))) {
      ready = ::poll(&waiting, 1, kLookMilliseconds);
    }
    if (stop.stop_requested()) return fail(ErrorCode::kCancelled, "{}: stopped", name);
    if (filled == file.owned_.size()) {
      if (limit != 0 && filled >= limit) {
        return fail(ErrorCode::kLimit, "{}: more than the {} bytes of the memory limit", name,
                    limit);
      }
      file.owned_.resize(filled == 0 ? std::size_t{1} << 16 : 2 * filled);
    }
    const ssize_t got =
        ::read(descriptor, file.owned_.data() + filled, file.owned_.size() - filled);
    if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (got < 0 && errno == EBADF && descriptor == STDIN_FILENO) {
      return fail(ErrorCode::kInput, "{} is closed", name);
    }
    if (got < 0) {
      return fail(ErrorCode::kInput, "{}: {} after {} bytes", name, reason(errno), filled);
    }
    if (got == 0) break;
    filled += static_cast<std::size_t>(got);
  }
  file.owned_.resize(filled);
  file.size_ = filled;
  file.data_ = file.owned_.c_str();
  return file;
}

void InputBytes::forget(const char* begin, const char* end) const {
  if (mapped_ == 0 || size_ <= kPopulateLimit) return;
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  const auto from = static_cast<std::size_t>(begin - data_),
             to = static_cast<std::size_t>(end - data_);
  const std::size_t first = (from + page - 1) / page * page, last = to / page * page;
  if (last <= first) return;
  ::madvise(const_cast<char*>(data_) + first, last - first, MADV_DONTNEED);
}

bool InputBytes::changed() const {
  struct stat status = {};
  return mapped_ != 0 &&
         (::fstat(descriptor_, &status) != 0 || static_cast<std::size_t>(status.st_size) != size_);
}

}  // namespace strata::detail
