#pragma once

#include <zlib.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "strata/core/result.h"

namespace strata {

/// Bytes that zlib unpacks, piece by piece. (Internal to voxelize/.)
class InflateStream {
 public:
  static constexpr int kZlib = 15, kGzip = 31, kBare = -15;  ///< what the packed bytes are
  /// @param bytes  outlive this; gzip members may follow one another
  InflateStream(std::string_view bytes, int kind, std::string name);
  InflateStream(const InflateStream&) = delete;
  InflateStream& operator=(const InflateStream&) = delete;
  ~InflateStream();

  /// Fills `to`. @return kInput naming the byte where the packed data are damaged or end
  Result<void> read(std::byte* to, std::size_t bytes);

 private:
  z_stream stream_{};
  std::string_view all_;
  std::size_t given_ = 0;  // bytes of all_ that zlib was given
  int kind_;
  bool ready_ = false, ended_ = false;
  std::string name_;
};

}  // namespace strata
