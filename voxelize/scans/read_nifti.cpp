// NIfTI, versions 1 and 2, both byte orders, plain or gzip (voxelize/heads/nifti_head.h). Numbers
// that the head scales become values.

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "voxelize/heads/nifti_head.h"
#include "voxelize/scans/scan_readers.h"
#include "voxelize/volume/inflate_stream.h"

namespace strata {
namespace {

/// The bytes of a file, as they are or unpacked, one after the other.
class NiftiBytes {
 public:
  explicit NiftiBytes(const ReadContext& context) : context_(context), bytes_(context.bytes) {
    if (bytes_.starts_with("\x1f\x8b")) {
      stream_.emplace(bytes_, InflateStream::kGzip, context.path);
    }
  }
  [[nodiscard]] bool packed() const { return stream_.has_value(); }

  Result<void> read(std::byte* to, std::size_t count) {
    if (stream_) return stream_->read(to, count);
    if (count > bytes_.size() - at_) {
      return fail(ErrorCode::kInput, "{}: the file ends at byte {}", context_.path, bytes_.size());
    }
    std::copy_n(reinterpret_cast<const std::byte*>(bytes_.data()) + at_, count, to);
    at_ += count;
    return {};
  }
  Result<void> skip(std::uint64_t count) {
    std::vector<std::byte> gone(std::size_t{1} << 16);
    while (count > 0) {
      const auto piece = static_cast<std::size_t>(std::min<std::uint64_t>(count, gone.size()));
      if (auto done = read(gone.data(), piece); !done) return done;
      count -= piece;
    }
    return {};
  }

 private:
  const ReadContext& context_;
  std::string_view bytes_;
  std::size_t at_ = 0;
  std::optional<InflateStream> stream_;
};

Result<NiftiHead> read_head(const ReadContext& context, NiftiBytes& bytes, std::uint64_t& read) {
  if (!bytes.packed())
    return parse_nifti_head(context.bytes.substr(0, kNiftiHeadBytes), context.path);
  std::string head(348, '\0');
  const auto more = [&](std::size_t from) {
    return bytes.read(reinterpret_cast<std::byte*>(head.data()) + from, head.size() - from);
  };
  if (auto done = more(0); !done) return tl::unexpected(done.error());
  if (head.compare(4, 3, "n+2") == 0 || head.compare(4, 3, "ni2") == 0) {
    head.resize(540);
    if (auto done = more(348); !done) return tl::unexpected(done.error());
  }
  read = head.size();
  return parse_nifti_head(head, context.path);
}

}  // namespace

Result<VoxelVolume> read_nifti_voxels(ReadContext& context) {
  NiftiBytes bytes(context);
  std::uint64_t read = 0;
  const auto head = read_head(context, bytes, read);
  if (!head) return tl::unexpected(head.error());
  if (head->volumes != 1.0) {
    return fail(ErrorCode::kInput, "{}: {} volumes; one is read", context.path, head->volumes);
  }
  auto placed = placed_layout(context, head->axes);
  if (!placed) return tl::unexpected(placed.error());
  DenseLayout& layout = placed->layout;
  layout.type = head->type;
  context.colours = head->colours;
  layout.big_endian = head->big_endian && !head->colours;
  const bool scaled =
      !head->colours && head->slope != 0.0 && !(head->slope == 1.0 && head->intercept == 0.0);
  DenseData data;
  const RowConverter converter(layout);
  std::vector<std::byte> numbers;
  if (!bytes.packed() && !scaled) {
    const auto all = voxel_bytes(context, context.bytes, head->data_at, layout);
    if (!all) return tl::unexpected(all.error());
    data.all = *all;
  } else {
    if (auto done = bytes.skip(head->data_at - std::min(read, head->data_at)); !done) {
      return tl::unexpected(done.error());
    }
    data.next = [&](std::byte* to, std::size_t count) { return bytes.read(to, count); };
  }
  if (scaled) {
    const std::size_t number_bytes = bytes_of(layout.type);
    layout.type = NumberType::kF32;
    layout.big_endian = false;
    data.next = [&, number_bytes](std::byte* to, std::size_t size) -> Result<void> {
      const std::size_t count = size / sizeof(float);
      numbers.resize(count * number_bytes);
      if (auto done = bytes.read(numbers.data(), numbers.size()); !done) return done;
      auto* values = reinterpret_cast<float*>(to);
      converter.to_floats(numbers.data(), count, values);
      for (std::size_t i = 0; i < count; ++i) {
        values[i] =
            static_cast<float>(head->slope * static_cast<double>(values[i]) + head->intercept);
      }
      return {};
    };
  }
  return read_placed(context, *placed, data, head->placed);
}

Result<VoxelFileGrid> nifti_file_grid(ReadContext& context) {
  NiftiBytes bytes(context);
  std::uint64_t read = 0;
  const auto head = read_head(context, bytes, read);
  if (!head) return tl::unexpected(head.error());
  return nifti_grid(*head, context.path);
}

}  // namespace strata
