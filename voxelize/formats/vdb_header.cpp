// Layout: io/Archive.cc, io/GridDescriptor.cc, MetaMap.cc and math/Maps.h of OpenVDB 10.0.

#include "voxelize/formats/vdb_header.h"

#include <fmt/core.h>

#include <climits>
#include <string_view>

namespace strata {
namespace {

constexpr std::uint64_t kMagic = 0x56444220;  // " BDV" on disk
constexpr std::uint32_t kFileVersion = 224;
constexpr std::uint32_t kLibraryMajor = 10, kLibraryMinor = 0;
constexpr std::uint32_t kCompressZip = 1, kCompressActiveMask = 2;

template <class T>
void put(std::string& to, const T& value) {
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}
template <class T>
std::string raw(const T& value) {
  std::string bytes;
  put(bytes, value);
  return bytes;
}
void put_text(std::string& to, std::string_view text) {
  put(to, static_cast<std::uint32_t>(text.size()));
  to.append(text);
}
void put_vec(std::string& to, const glm::dvec3& value) {
  for (int axis = 0; axis < 3; ++axis) put(to, value[axis]);
}

// 16 bytes in the usual groups. OpenVDB takes a random one, and files would never be alike.
std::string uuid(std::uint64_t hash) {
  const std::uint64_t second = (hash ^ 0x5354524154412020u) * 0x9e3779b97f4a7c15u;
  return fmt::format("{:08x}-{:04x}-{:04x}-{:04x}-{:012x}", hash >> 32, hash >> 16 & 0xffff,
                     hash & 0xffff, second >> 48, second & 0xffffffffffffu);
}

std::string metadata(const VdbHeader& header, const std::string& compression) {
  glm::ivec3 lower = header.lower, upper = header.upper;
  if (header.voxels == 0) {  // as OpenVDB writes an empty box
    lower = glm::ivec3(INT_MAX);
    upper = glm::ivec3(INT_MIN);
  }
  std::string entries;
  std::uint32_t count = 0;
  const auto put_meta = [&](std::string_view name, std::string_view type, std::string_view value) {
    put_text(entries, name);
    put_text(entries, type);
    put_text(entries, value);
    ++count;
  };
  if (header.fog) put_meta("class", "string", "fog volume");
  if (header.level_set) put_meta("class", "string", "level set");
  put_meta("creator", "string", "strata");
  put_meta("file_bbox_max", "vec3i", raw(upper));
  put_meta("file_bbox_min", "vec3i", raw(lower));
  put_meta("file_compression", "string", compression);
  put_meta("file_voxel_count", "int64", raw(header.voxels));
  put_meta("name", "string", header.name);
  return raw(count) + entries;
}

/// A matrix for row vectors: the steps along the axes, then the place of index (0, 0, 0).
std::string affine_map(const VoxelGrid& grid, const GridFrame& frame) {
  std::string bytes;
  put_text(bytes, "AffineMap");
  const glm::dmat3 steps = frame.steps(grid.voxel_size);
  for (int row = 0; row < 3; ++row) {
    put_vec(bytes, steps[row]);
    put(bytes, 0.0);
  }
  put_vec(bytes, frame.world(grid.origin + 0.5 * grid.voxel_size));
  put(bytes, 1.0);
  return bytes;
}

std::string transform(const VoxelGrid& grid) {
  const glm::dvec3 size = grid.voxel_size;
  const bool uniform = size.x == size.y && size.y == size.z;
  std::string bytes;
  put_text(bytes, uniform ? "UniformScaleTranslateMap" : "ScaleTranslateMap");
  put_vec(bytes, grid.origin + 0.5 * size);  // index (0, 0, 0) is the centre of the first voxel
  put_vec(bytes, size);
  put_vec(bytes, size);  // lengths of a voxel's sides
  put_vec(bytes, 1.0 / size);
  put_vec(bytes, (1.0 / size) * (1.0 / size));
  put_vec(bytes, 0.5 / size);
  return bytes;
}

}  // namespace

std::string vdb_header_bytes(const VdbHeader& header) {
  std::string bytes;
  put(bytes, kMagic);
  put(bytes, kFileVersion);
  put(bytes, kLibraryMajor);
  put(bytes, kLibraryMinor);
  put(bytes, std::uint8_t{1});  // grid offsets follow
  bytes += uuid(header.hash);
  put(bytes, std::uint32_t{0});  // metadata of the file
  put(bytes, std::uint32_t{1});  // grids

  put_text(bytes, header.name);
  put_text(bytes, header.values == VdbValues::kMask    ? "Tree_mask_5_4_3"
                  : header.values == VdbValues::kBool  ? "Tree_bool_5_4_3"
                  : header.values == VdbValues::kFloat ? "Tree_float_5_4_3"
                                                       : "Tree_vec3s_5_4_3");
  put_text(bytes, "");  // not an instance of another grid

  const bool numbers = header.values == VdbValues::kFloat || header.values == VdbValues::kColour;
  const bool zip = numbers && !header.level_set;
  std::string grid = raw(kCompressActiveMask | (zip ? kCompressZip : 0));
  grid += metadata(header, zip ? "zip + active values" : "active values");
  grid += header.frame.turned() ? affine_map(header.grid, header.frame) : transform(header.grid);
  const std::uint64_t grid_position = bytes.size() + 3 * sizeof(std::uint64_t);
  const std::uint64_t buffers_position = grid_position + grid.size() + header.topology_bytes;
  put(bytes, grid_position);
  put(bytes, buffers_position);
  put(bytes, buffers_position + header.buffers_bytes);
  return bytes + grid;
}

Result<void> write_vdb_file(const std::string& path, const VdbHeader& header,
                            const std::string& root, std::size_t blocks,
                            const BlockOutput::MakeBlock& make, BlockOutput& output,
                            const Execution& execution) {
  if (auto written = output.append(vdb_header_bytes(header) + root); !written) return written;
  const std::uint64_t tree_begin = output.position() - root.size();
  if (auto written = output.append_blocks(execution, blocks, make); !written) return written;
  const std::uint64_t bytes = output.position() - tree_begin;
  const std::uint64_t announced = header.topology_bytes + header.buffers_bytes;
  if (bytes != announced) {
    return fail(ErrorCode::kInternal, "{}: the tree has {} bytes, {} were announced", path, bytes,
                announced);
  }
  return output.commit();
}

}  // namespace strata
