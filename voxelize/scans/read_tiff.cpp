// A TIFF stack as an array: a page a layer of z, rows along y (tiff_file.h).

#include <algorithm>
#include <memory>

#include "voxelize/scans/scan_readers.h"
#include "voxelize/scans/tiff_file.h"
#include "voxelize/volume/inflate_stream.h"

namespace strata {
namespace {

/// The bytes of all strips, one after the other.
class StripBytes {
 public:
  StripBytes(const ReadContext& context, const TiffFile& file) : context_(context), file_(file) {}

  Result<void> read(std::byte* to, std::size_t count) {
    while (count > 0) {
      if (left_ == 0) {
        if (auto begun = begin(); !begun) return begun;
      }
      const auto piece = static_cast<std::size_t>(std::min<std::uint64_t>(left_, count));
      if (stream_) {
        if (auto done = stream_->read(to, piece); !done) return done;
      } else {
        std::copy_n(reinterpret_cast<const std::byte*>(context_.bytes.data()) + at_, piece, to);
        at_ += piece;
      }
      left_ -= piece, to += piece, count -= piece;
    }
    return {};
  }

 private:
  Result<void> begin() {
    if (next_ == file_.strips.size()) {
      return fail(ErrorCode::kInput, "{}: its strips end too early", context_.path);
    }
    const TiffFile::Strip& strip = file_.strips[next_++];
    left_ = strip.dense;
    at_ = strip.at;
    if (file_.packed) {
      stream_ = std::make_unique<InflateStream>(context_.bytes.substr(strip.at, strip.bytes),
                                                InflateStream::kZlib, context_.path);
    }
    return {};
  }

  const ReadContext& context_;
  const TiffFile& file_;
  std::size_t next_ = 0;
  std::uint64_t left_ = 0, at_ = 0;
  std::unique_ptr<InflateStream> stream_;
};

}  // namespace

Result<VoxelVolume> read_tiff_voxels(ReadContext& context) {
  const auto file = parse_tiff(context.bytes, context.path);
  if (!file) return tl::unexpected(file.error());
  auto placed = placed_layout(context, file->axes);
  if (!placed) return tl::unexpected(placed.error());
  placed->layout.type = file->type;
  context.colours = file->colours;
  placed->layout.big_endian = file->big_endian && !file->colours;
  StripBytes strips(context, *file);
  return read_placed(context, *placed,
                     {{}, [&](std::byte* to, std::size_t bytes) { return strips.read(to, bytes); }},
                     file->placed);
}

Result<VoxelFileGrid> tiff_grid(ReadContext& context) {
  const auto file = parse_tiff(context.bytes, context.path);
  if (!file) return tl::unexpected(file.error());
  if (!file->placed) {
    return fail(ErrorCode::kInput, "{}: it does not say where its voxels lie", context.path);
  }
  auto grid = grid_of_axes(context.path, file->axes);
  if (!grid) return grid;
  grid->frame.unit_metres = file->unit_metres;
  grid->frame.space = file->space;
  return grid;
}

}  // namespace strata
