#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "strata/core/result.h"

namespace strata {

/// An output that libraries write in any order, going back to fill in earlier bytes. Bytes are
/// collected into large writes to an AtomicFile. If the output cannot seek (standard output, pipes,
/// devices), everything is kept in memory until finish() writes it. The final name does not exist
/// before finish().
class SeekableOutput {
 public:
  /// @return as AtomicFile::create
  static Result<SeekableOutput> create(const std::string& path);

  /// Writes at the current position and advances it. After an error every call returns that error.
  Result<void> write(const void* data, std::size_t bytes);
  /// @pre position <= the number of bytes written
  void seek(std::uint64_t position) { position_ = position; }
  [[nodiscard]] std::uint64_t position() const { return position_; }
  [[nodiscard]] std::uint64_t end() const { return end_; }
  /// The first error.
  [[nodiscard]] const Result<void>& status() const { return status_; }
  /// Writes the remaining bytes and gives the file its name. @return kOutput, also for an earlier
  /// error
  Result<void> finish();

 private:
  explicit SeekableOutput(AtomicFile file);
  Result<void> flush();

  AtomicFile file_;
  bool in_memory_;
  std::vector<char> buffer_;  // the whole output, or the bytes from buffer_begin_ on
  std::uint64_t buffer_begin_ = 0;
  std::uint64_t position_ = 0, end_ = 0;
  Result<void> status_;
};

}  // namespace strata
