// The centres of solid voxels as points in the world, x fastest, then y, then z: binary
// little-endian PLY, or lines of text (.xyz). Coordinates are floats where floats tell a 64th of a
// voxel, else doubles. The number of points stands before them in a PLY and is filled in at the
// end; a pipe cannot be filled in later, and gets the points when all are there.

#include <fmt/format.h>

#include <cstring>
#include <glm/common.hpp>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

#include "voxelize/output/block_output.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

/// What a point has besides its place.
enum class PointValue { kNone, kId, kColour };

template <class T>
void put_number(Bytes& out, T value) {
  const std::size_t at = out.size();
  out.resize(at + sizeof value);
  std::memcpy(out.data() + at, &value, sizeof value);
}

class PointWriter final : public SlabWriter {
 public:
  PointWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
              bool text, BlockOutput output)
      : SlabWriter(path, grid, Axis::kX),
        value_(options.rgba       ? PointValue::kColour
               : options.ids != 0 ? PointValue::kId
                                  : PointValue::kNone),
        text_(text),
        direction_(options.frame.direction),
        output_(std::move(output)) {
    const glm::dvec3 high = grid.origin + grid.voxel_size * glm::dvec3(grid.dims);
    const glm::dvec3 most = glm::max(glm::abs(grid.origin), glm::abs(high));
    for (int axis = 0; axis < 3; ++axis) {
      doubles_ |= most[axis] * 0x1p-24 > grid.voxel_size[axis] / 64;
    }
  }

  Result<void> begin() {
    if (text_ || output_.sequential()) return {};
    return output_.append(head());
  }

 private:
  /// Always of the same length.
  [[nodiscard]] std::string head() const {
    const char* type = doubles_ ? "double" : "float";
    std::string text = "ply\nformat binary_little_endian 1.0\ncomment centres of voxels";
    const std::string count = std::to_string(points_);
    text.append(20 - count.size(), ' ');
    text += fmt::format("\nelement vertex {}\n", count);
    for (const char axis : {'x', 'y', 'z'}) text += fmt::format("property {} {}\n", type, axis);
    if (value_ == PointValue::kId) text += "property int id\n";
    if (value_ == PointValue::kColour) {
      for (const char* name : {"red", "green", "blue", "alpha"}) {
        text += fmt::format("property uchar {}\n", name);
      }
    }
    return text + "end_header\n";
  }

  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    if (!text_) points_ += slab.solid_voxels();
    const auto make = [&](std::size_t index, Bytes& out, int) {
      out.clear();
      const int z = slab.v_begin() + static_cast<int>(index);
      for (int y = 0; y < slab.columns(); ++y) {
        for_each_labelled(slab, y, z, [&](const Interval& interval, std::uint32_t label) {
          for (int x = interval.begin(); x < interval.end(); ++x) {
            const glm::dvec3 at =
                direction_ * (grid().origin + (glm::dvec3(x, y, z) + 0.5) * grid().voxel_size);
            text_ ? put_line(out, at, label) : put_point(out, at, label);
          }
        });
      }
    };
    const auto rows = static_cast<std::size_t>(slab.v_end() - slab.v_begin());
    if (text_ || !output_.sequential()) return output_.append_blocks(execution, rows, make);
    Bytes row;
    for (std::size_t i = 0; i < rows; ++i) {
      make(i, row, 0);
      kept_.insert(kept_.end(), row.begin(), row.end());
      if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    }
    return {};
  }

  void put_point(Bytes& out, const glm::dvec3& at, std::uint32_t label) const {
    for (int axis = 0; axis < 3; ++axis) {
      doubles_ ? put_number(out, at[axis]) : put_number(out, static_cast<float>(at[axis]));
    }
    if (value_ != PointValue::kNone) put_number(out, label);
  }

  void put_line(Bytes& out, const glm::dvec3& at, std::uint32_t label) const {
    char line[128];
    char* end = line;
    for (int axis = 0; axis < 3; ++axis) {
      if (axis > 0) *end++ = ' ';
      end = doubles_ ? fmt::format_to(end, "{}", at[axis])
                     : fmt::format_to(end, "{}", static_cast<float>(at[axis]));
    }
    if (value_ == PointValue::kId) end = fmt::format_to(end, " {}", label);
    if (value_ == PointValue::kColour) {
      end = fmt::format_to(end, " {} {} {}", label & 0xff, label >> 8 & 0xff, label >> 16 & 0xff);
    }
    *end++ = '\n';
    const auto* bytes = reinterpret_cast<const std::byte*>(line);
    out.insert(out.end(), bytes, bytes + (end - line));
  }

  Result<void> finish_output(const Execution&) override {
    if (!text_) {
      const std::string text = head();
      const bool late = output_.sequential();
      Result<void> written =
          late ? output_.append(text) : output_.patch(0, text.data(), text.size());
      if (written && late) written = output_.append(kept_.data(), kept_.size());
      if (!written) return written;
    }
    return output_.commit();
  }

  PointValue value_;
  bool text_;
  glm::dmat3 direction_;
  bool doubles_ = false;
  BlockOutput output_;
  std::uint64_t points_ = 0;  // not of text
  Bytes kept_;                // for a pipe
};

VoxelWriterResult open_point_writer(const std::string& path, const VoxelGrid& grid,
                                    const VoxelWriterOptions& options, bool text) {
  Result<BlockOutput> output = BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  return begun(std::make_unique<PointWriter>(path, grid, options, text, std::move(*output)));
}

}  // namespace

VoxelWriterResult open_ply_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options) {
  return open_point_writer(path, grid, options, false);
}

VoxelWriterResult open_xyz_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options) {
  return open_point_writer(path, grid, options, true);
}

}  // namespace strata
