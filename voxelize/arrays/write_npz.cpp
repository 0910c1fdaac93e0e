// NumPy's .npz (numpy.savez_compressed): a ZIP (PKWARE, APPNOTE.TXT 6.3) of .npy arrays:
//   origin   float64 (3,): lower corner of voxel (0, 0, 0) in world space
//   spacing  float64 (3,): world length of a voxel along x, y, z
//   direction  float64 (3, 3), where the grid is turned: a point p of the grid is at direction @ p
//   voxels   as write_npy.cpp has it, shape (nx, ny, nz)
// The voxels are one deflated entry, made of pieces that threads deflate apart from runs, a layer
// each; libzip would want the bytes. What is known only at the end (CRC, compressed bytes) is
// filled in, or on a pipe follows the data, which flag 3 says. Arrays of 2 GiB and more have 64-bit
// sizes.

#include <zlib.h>

#include <bit>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hashbuffer/formats/npy_head.h"
#include "voxelize/arrays/npy_voxels.h"
#include "voxelize/output/block_output.h"
#include "voxelize/output/deflated_layers.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"
#include "voxelize/output/zip_records.h"

namespace strata {
namespace {

template <class T>
void put(std::string& to, T value) {
  static_assert(std::endian::native == std::endian::little);
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

class NpzWriter final : public SlabWriter {
 public:
  NpzWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
            BlockOutput output)
      : SlabWriter(path, grid, Axis::kX),
        values_(options),
        frame_(options.frame),
        output_(std::move(output)),
        layers_(grid, values_) {}

  Result<void> begin() {
    for (const auto& [name, vector] :
         {std::pair{"origin.npy", grid().origin}, std::pair{"spacing.npy", grid().voxel_size}}) {
      std::string data = npy_head("<f8", false, "(3,)");
      for (int axis = 0; axis < 3; ++axis) put(data, vector[axis]);
      if (auto written = append(name, data); !written) return written;
    }
    if (frame_.turned()) {
      std::string data = npy_head("<f8", false, "(3, 3)");
      for (int i = 0; i < 9; ++i) put(data, frame_.direction[i % 3][i / 3]);
      if (auto written = append("direction.npy", data); !written) return written;
    }
    const std::string head = npy_head(values_, dims());
    ZipEntry& voxels = entries_.emplace_back();
    voxels.name = "voxels.npy";
    voxels.deflated = true;
    voxels.follows = output_.sequential();
    voxels.crc = checksum(head);
    voxels.bytes = head.size() + static_cast<std::uint64_t>(dims().x) *
                                     static_cast<std::uint64_t>(dims().y) *
                                     static_cast<std::uint64_t>(dims().z) * values_.bytes;
    voxels.wide = voxels.bytes >= std::uint64_t{1} << 31;  // ten bits a byte at the most
    voxels.offset = output_.position();
    Bytes deflated;
    RunDeflater deflater(values_.codes, values_.bytes);
    deflater.begin(deflated, false);
    for (const char letter : head) deflater.byte(static_cast<std::uint8_t>(letter));
    deflater.end();
    if (auto written = output_.append(voxels.local_head()); !written) return written;
    data_begin_ = output_.position();
    return output_.append(deflated.data(), deflated.size());
  }

 private:
  /// A small array as it is.
  Result<void> append(const char* name, const std::string& data) {
    ZipEntry& entry = entries_.emplace_back();
    entry.name = name;
    entry.crc = checksum(data);
    entry.bytes = entry.compressed = data.size();
    entry.offset = output_.position();
    return output_.append(entry.local_head() + data);
  }
  static std::uint32_t checksum(const std::string& data) {
    return static_cast<std::uint32_t>(
        crc32_z(crc32_z(0, nullptr, 0), reinterpret_cast<const Bytef*>(data.data()), data.size()));
  }

  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    return layers_.append(slab, output_, entries_.back().crc, execution);
  }

  Result<void> finish_output(const Execution&) override {
    ZipEntry& voxels = entries_.back();
    std::string end(DeflatedLayers::kEnd);
    voxels.compressed = output_.position() + end.size() - data_begin_;
    if (voxels.follows) {
      end += voxels.descriptor();
    } else {
      const std::string head = voxels.local_head();
      auto patched = output_.patch(voxels.offset, head.data(), head.size());
      if (!patched) return patched;
    }
    end += zip_directory(entries_, output_.position() + end.size());
    if (auto written = output_.append(end); !written) return written;
    return output_.commit();
  }

  DenseValues values_;
  GridFrame frame_;
  BlockOutput output_;
  DeflatedLayers layers_;
  std::vector<ZipEntry> entries_;  // the voxels last
  std::uint64_t data_begin_ = 0;
};

}  // namespace

VoxelWriterResult open_npz_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options) {
  Result<BlockOutput> output = BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  return begun(std::make_unique<NpzWriter>(path, grid, options, std::move(*output)));
}

}  // namespace strata
