// MetaImage (itk.org/Wiki/ITK/MetaIO/Documentation): `.mha`, one file, or `.mhd` with the voxels
// beside it in a `.zraw`; zlib, x fastest. Offset is the centre of the first voxel, TransformMatrix
// the direction of one axis after the other, as ITK writes them. A pipe cannot have the packed size
// filled in later, and gets the bytes as they are.

#include <fmt/core.h>

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/letters.h"
#include "voxelize/output/block_output.h"
#include "voxelize/output/dense_stream.h"
#include "voxelize/output/file_pair.h"
#include "voxelize/output/grid_text.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

constexpr std::size_t kSizeDigits = 20;

std::string_view element_type(const DenseValues& values) {
  if (values.is_float()) return "MET_FLOAT";
  return values.number_bits() == 8    ? "MET_UCHAR"
         : values.number_bits() == 16 ? "MET_USHORT"
                                      : "MET_UINT";
}

std::string three(const glm::dvec3& vector) {
  return fmt::format("{} {} {}", vector.x + 0.0, vector.y + 0.0, vector.z + 0.0);
}

class MetaImageWriter final : public SlabWriter {
 public:
  MetaImageWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
                  BlockOutput head, std::optional<BlockOutput> data)
      : SlabWriter(path, grid, Axis::kX),
        values_(options),
        head_(std::move(head)),
        data_(std::move(data)),
        packed_(!head_.sequential()),
        stream_(grid, values_,
                packed_ ? DenseStream::Packing::kZlib : DenseStream::Packing::kNone) {}

  Result<void> begin(const GridFrame& frame, const std::string& data_file) {
    const WorldAxes axes = world_axes(grid(), frame, "left-posterior-superior");
    std::string text = fmt::format(
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
        "CompressedData = {}\n",
        packed_ ? "True" : "False");
    if (packed_) {
      text += "CompressedDataSize = ";
      size_at_ = text.size();
      text += std::string(kSizeDigits, ' ') + "\n";
    }
    const std::string_view unit = unit_name(frame.unit_metres);
    text += fmt::format(
        "TransformMatrix = {} {} {}\nOffset = {}\nCenterOfRotation = 0 0 0\n"
        "ElementSpacing = {}\nDimSize = {} {} {}\n{}ElementType = {}\n{}ElementDataFile = {}\n",
        three(axes.direction[0]), three(axes.direction[1]), three(axes.direction[2]),
        three(axes.centre), three(grid().voxel_size), dims().x, dims().y, dims().z,
        values_.components == 1 ? "" : "ElementNumberOfChannels = 4\n", element_type(values_),
        unit.empty() ? "" : fmt::format("DistanceUnits = {}\n", unit), data_file);
    if (auto written = head_.append(text); !written) return written;
    data_begin_ = data().position();
    return stream_.begin(data());
  }

 private:
  [[nodiscard]] BlockOutput& data() { return data_ ? *data_ : head_; }

  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    return stream_.append(slab, data(), execution);
  }

  Result<void> finish_output(const Execution&) override {
    if (Result<void> written = stream_.end(data()); !written) return written;
    if (packed_) {
      const std::string size = fmt::format("{:<{}}", data().position() - data_begin_, kSizeDigits);
      if (auto patched = head_.patch(size_at_, size.data(), size.size()); !patched) return patched;
    }
    if (data_) {
      if (Result<void> there = data_->commit(); !there) return there;
    }
    return head_.commit();
  }

  DenseValues values_;
  BlockOutput head_;
  std::optional<BlockOutput> data_;  // of .mhd
  bool packed_;
  DenseStream stream_;
  std::uint64_t size_at_ = 0, data_begin_ = 0;
};

}  // namespace

VoxelWriterResult open_metaimage_writer(const std::string& path, const VoxelGrid& grid,
                                        const VoxelWriterOptions& options) {
  std::string head_path = path, data_file = "LOCAL";
  std::optional<BlockOutput> data;
  if (lower_case(path).ends_with(".mhd")) {
    const FilePair pair(path, ".mhd", ".zraw");
    Result<BlockOutput> created = BlockOutput::create(pair.data);
    if (!created) return tl::unexpected(created.error());
    data = std::move(*created);
    head_path = pair.head;
    data_file = pair.data_name();
  }
  Result<BlockOutput> head = BlockOutput::create(head_path);
  if (!head) return tl::unexpected(head.error());
  return begun(
      std::make_unique<MetaImageWriter>(path, grid, options, std::move(*head), std::move(data)),
      options.frame, data_file);
}

}  // namespace strata
