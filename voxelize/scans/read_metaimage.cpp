// MetaImage: `.mha`, and `.mhd` with its voxels in a file beside it; plain or zlib, both byte
// orders (voxelize/heads/metaimage_head.h).

#include <optional>
#include <string>

#include "voxelize/heads/metaimage_head.h"
#include "voxelize/scans/scan_readers.h"
#include "voxelize/volume/inflate_stream.h"

namespace strata {

Result<VoxelVolume> read_metaimage_voxels(ReadContext& context) {
  const auto head = parse_metaimage_head(context.bytes, context.path);
  if (!head) return tl::unexpected(head.error());
  context.colours = head->channels == 4 && head->type == NumberType::kU8;
  if (head->channels != 1 && !context.colours) {
    return fail(ErrorCode::kInput,
                "{}: {} numbers a voxel; one is read, or red, green, blue and "
                "alpha of 8 bits",
                context.path, head->channels);
  }
  auto placed = placed_layout(context, head->axes);
  if (!placed) return tl::unexpected(placed.error());
  DenseLayout& layout = placed->layout;
  layout.type = context.colours ? NumberType::kU32 : head->type;
  layout.big_endian = head->big_endian && !context.colours;

  std::string_view data = context.bytes.substr(head->data_at);
  std::optional<detail::InputBytes> beside;
  if (head->data_file != "LOCAL") {
    auto opened = open_data_file(context, head->data_file);
    if (!opened) return tl::unexpected(opened.error());
    beside = std::move(*opened);
    data = beside->view();
  }
  if (head->compressed) {
    InflateStream stream(data, InflateStream::kZlib, context.path);
    return read_placed(
        context, *placed,
        {{}, [&](std::byte* to, std::size_t bytes) { return stream.read(to, bytes); }},
        head->placed);
  }
  const std::uint64_t at = head->skip >= 0                ? static_cast<std::uint64_t>(head->skip)
                           : data.size() > layout.bytes() ? data.size() - layout.bytes()
                                                          : 0;
  const auto all = voxel_bytes(context, data, at, layout);
  if (!all) return tl::unexpected(all.error());
  return read_placed(context, *placed, {*all, {}}, head->placed);
}

Result<VoxelFileGrid> metaimage_file_grid(ReadContext& context) {
  const auto head = parse_metaimage_head(context.bytes, context.path);
  if (!head) return tl::unexpected(head.error());
  return metaimage_grid(*head, context.path);
}

}  // namespace strata
