#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>

#include "strata/core/result.h"

namespace strata::detail {

/// All bytes of a file, mapped if the system allows it, otherwise read. The byte after the end is
/// readable and zero. It ends every token, so text scanners need no bounds check.
class InputBytes {
 public:
  /// @param path  a file; "-" is standard input
  /// @param limit  most bytes to hold from a pipe; 0: any number
  /// @param stop  ends the wait for a pipe
  /// @return kInput naming path and reason; kLimit; kCancelled
  static Result<InputBytes> open(const std::string& path, std::uint64_t limit,
                                 const std::stop_token& stop = {});

  InputBytes(InputBytes&& other) noexcept;
  InputBytes& operator=(InputBytes&& other) noexcept;
  ~InputBytes();

  [[nodiscard]] std::string_view view() const { return {data_, size_}; }
  /// Gives back the memory of a range that has been read; it may be read again, from the file. Only
  /// of large mapped files; else nothing happens. Any thread may call it.
  void forget(const char* begin, const char* end) const;
  /// Whether the size of a mapped file has changed since it was opened.
  [[nodiscard]] bool changed() const;

 private:
  InputBytes() = default;
  static Result<InputBytes> read_all(int descriptor, const std::string& name, std::uint64_t limit,
                                     const std::stop_token& stop);
  const char* data_ = "";
  std::size_t size_ = 0;
  std::size_t mapped_ = 0;  ///< size of the mapping; 0 if there is none
  int descriptor_ = -1;     ///< kept to check the size again
  std::string owned_;
};

}  // namespace strata::detail
