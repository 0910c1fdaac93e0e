#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>

#include "strata/core/result.h"

namespace strata::detail {

/// All bytes of a file, mapped where the system can, else read. One byte past the end is readable
/// and zero, so that text scanners need no bounds check: it ends every token.
class InputBytes {
 public:
  /// @param path  a file; "-" is standard input @param limit  most bytes to hold from a pipe, 0:
  /// any
  /// @param stop  ends the waiting for a pipe
  /// @return kInput naming path and reason; kLimit; kCancelled
  static Result<InputBytes> open(const std::string& path, std::uint64_t limit,
                                 const std::stop_token& stop = {});

  InputBytes(InputBytes&& other) noexcept;
  InputBytes& operator=(InputBytes&& other) noexcept;
  ~InputBytes();

  [[nodiscard]] std::string_view view() const { return {data_, size_}; }
  /// True when the file behind a mapping has another size than when it was opened.
  [[nodiscard]] bool changed() const;

 private:
  InputBytes() = default;
  static Result<InputBytes> read_all(int descriptor, const std::string& name, std::uint64_t limit,
                                     const std::stop_token& stop);
  const char* data_ = "";
  std::size_t size_ = 0;
  std::size_t mapped_ = 0;  ///< bytes of the mapping, 0 if none
  int descriptor_ = -1;     ///< kept to ask for the size again
  std::string owned_;
};

}  // namespace strata::detail
