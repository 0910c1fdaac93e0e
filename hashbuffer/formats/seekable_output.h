#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "strata/core/result.h"

namespace strata {

/// An output that libraries write as they like, going back to fill in what they did not know. Bytes
/// are gathered into large writes to an AtomicFile; where one cannot go back (standard output,
/// pipes, devices) the whole is kept in memory and written by finish(). Nothing stands under the
/// final name before.
class SeekableOutput {
 public:
  /// @return as AtomicFile::create
  static Result<SeekableOutput> create(const std::string& path);

  /// Writes at the current position, which moves on. After an error every call returns it again.
  Result<void> write(const void* data, std::size_t bytes);
  /// @pre at most the end of what was written
  void seek(std::uint64_t position) { position_ = position; }
  [[nodiscard]] std::uint64_t position() const { return position_; }
  [[nodiscard]] std::uint64_t end() const { return end_; }
  /// The first error so far.
  [[nodiscard]] const Result<void>& status() const { return status_; }
  /// Writes what is left and gives the file its name. @return kOutput, also for an earlier error
  Result<void> finish();

 private:
  explicit SeekableOutput(AtomicFile file);
  Result<void> flush();

  AtomicFile file_;
  bool in_memory_;
  std::vector<char> buffer_;  // the whole output, or bytes from buffer_begin_ on
  std::uint64_t buffer_begin_ = 0;
  std::uint64_t position_ = 0, end_ = 0;
  Result<void> status_;
};

}  // namespace strata
