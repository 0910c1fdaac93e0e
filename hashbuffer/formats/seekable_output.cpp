#include "hashbuffer/formats/seekable_output.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace strata {
namespace {
constexpr std::size_t kBufferBytes = std::size_t{1} << 20;
}  // namespace

SeekableOutput::SeekableOutput(AtomicFile file)
    : file_(std::move(file)), in_memory_(file_.temporary_path() == file_.path()) {}

Result<SeekableOutput> SeekableOutput::create(const std::string& path) {
  Result<AtomicFile> file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  return SeekableOutput(std::move(*file));
}

Result<void> SeekableOutput::flush() {
  if (status_ && !buffer_.empty()) {
    status_ = file_.write_at(buffer_begin_, buffer_.data(), buffer_.size());
  }
  buffer_.clear();
  return status_;
}

Result<void> SeekableOutput::write(const void* data, std::size_t bytes) {
  if (!status_) return status_;
  const char* from = static_cast<const char*>(data);
  if (in_memory_) {
    if (buffer_.size() < position_ + bytes) buffer_.resize(position_ + bytes);
    std::copy_n(from, bytes, buffer_.begin() + static_cast<std::ptrdiff_t>(position_));
  } else {
    if (position_ != buffer_begin_ + buffer_.size() || buffer_.size() + bytes > kBufferBytes) {
      if (!flush()) return status_;
      buffer_begin_ = position_;
    }
    if (bytes > kBufferBytes) {
      status_ = file_.write_at(position_, data, bytes);
      buffer_begin_ = position_ + bytes;
    } else {
      buffer_.insert(buffer_.end(), from, from + bytes);
    }
  }
  position_ += bytes;
  end_ = std::max(end_, position_);
  return status_;
}

Result<void> SeekableOutput::finish() {
  if (in_memory_) {
    if (status_) status_ = file_.write(buffer_.data(), buffer_.size());
  } else {
    (void)flush();
  }
  if (status_) status_ = file_.commit();
  return status_;
}

}  // namespace strata
