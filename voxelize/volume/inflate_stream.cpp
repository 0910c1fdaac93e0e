#include "voxelize/volume/inflate_stream.h"

#include <algorithm>
#include <utility>

namespace strata {

InflateStream::InflateStream(std::string_view bytes, int kind, std::string name)
    : all_(bytes), kind_(kind), name_(std::move(name)) {
  ready_ = inflateInit2(&stream_, kind) == Z_OK;
}

InflateStream::~InflateStream() {
  if (ready_) inflateEnd(&stream_);
}

Result<void> InflateStream::read(std::byte* to, std::size_t bytes) {
  constexpr std::size_t kMost = std::size_t{1} << 30;  // zlib counts in 32 bits
  if (!ready_) return fail(ErrorCode::kLimit, "{}: no memory for zlib", name_);
  while (bytes != 0) {
    if (stream_.avail_in == 0 && given_ < all_.size()) {
      const std::size_t piece = std::min(all_.size() - given_, kMost);
      stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(all_.data() + given_));
      stream_.avail_in = static_cast<uInt>(piece);
      given_ += piece;
    }
    if (ended_) {  // of a member
      if (kind_ != kGzip || stream_.avail_in == 0 || inflateReset(&stream_) != Z_OK) {
        return fail(ErrorCode::kInput, "{}: the packed data end {} bytes early", name_, bytes);
      }
      ended_ = false;
    }
    const std::size_t wanted = std::min(bytes, kMost);
    stream_.next_out = reinterpret_cast<Bytef*>(to);
    stream_.avail_out = static_cast<uInt>(wanted);
    const int code = inflate(&stream_, Z_NO_FLUSH);
    const std::size_t got = wanted - stream_.avail_out;
    to += got;
    bytes -= got;
    if (code == Z_STREAM_END) {
      ended_ = true;
    } else if (code == Z_BUF_ERROR ||
               (code == Z_OK && got == 0 && stream_.avail_in == 0 && given_ == all_.size())) {
      return fail(ErrorCode::kInput, "{}: the packed data end {} bytes early", name_, bytes);
    } else if (code != Z_OK) {
      return fail(ErrorCode::kInput, "{}: byte {} of the packed data is damaged: {}", name_,
                  given_ - stream_.avail_in, stream_.msg != nullptr ? stream_.msg : "zlib failed");
    }
  }
  return {};
}

}  // namespace strata
