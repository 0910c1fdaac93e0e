#include <cmath>

#include "voxelize/scans/scan_readers.h"

namespace strata {

Result<PlacedLayout> placed_layout(const ReadContext& context, const GridAxes& axes) {
  auto along = grid_of_axes(context.path, axes);  // its own axes
  if (!along) return tl::unexpected(along.error());
  PlacedLayout placed;
  placed.layout.grid = along->grid;
  const glm::dmat3& direction = along->frame.direction;
  std::array<int, 3> to{-1, -1, -1};
  for (int axis = 0; axis < 3; ++axis) {
    for (int c = 0; c < 3; ++c) {
      if (std::abs(direction[axis][c]) == 1.0) to[static_cast<std::size_t>(axis)] = c;
    }
  }
  const bool straight = to[0] >= 0 && to[1] >= 0 && to[2] >= 0;
  if (!straight) {
    placed.note = "the file turns the grid; it is shown along its own axes";
    return placed;
  }
  placed.layout.axes = to;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const int c = to[a];
    placed.layout.flipped[a] = direction[axis][c] < 0.0;
    const double size = along->grid.voxel_size[axis];
    placed.layout.grid.dims[c] = along->grid.dims[axis];
    placed.layout.grid.voxel_size[c] = size;
    const double first = axes.place[c] - (axes.corner ? 0.0 : 0.5 * size);
    placed.layout.grid.origin[c] =
        placed.layout.flipped[a]
            ? axes.place[c] - size * (along->grid.dims[axis] - (axes.corner ? 0.0 : 0.5))
            : first;
  }
  return placed;
}

Result<VoxelVolume> read_placed(ReadContext& context, const PlacedLayout& placed,
                                const DenseData& data, bool is_placed) {
  Result<VoxelVolume> volume = read_dense(context, placed.layout, data);
  if (!volume) return volume;
  volume->placed = is_placed;
  if (!placed.note.empty()) volume->notes.push_back(placed.note);
  return volume;
}

Result<detail::InputBytes> open_data_file(const ReadContext& context, const std::string& name) {
  if (name.empty() || name.find('/') != std::string::npos || name == "..") {
    return fail(ErrorCode::kInput,
                "{}: its voxels are in '{}'; they are read from a file of the same folder",
                context.path, name.substr(0, 80));
  }
  const std::string folder = context.path.substr(0, context.path.rfind('/') + 1);
  auto opened = detail::InputBytes::open(folder + name, context.execution.memory_limit,
                                         context.execution.stop);
  if (opened) return opened;
  return fail(opened.error().code, "{}: its voxels: {}", context.path, opened.error().message);
}

Result<std::string_view> voxel_bytes(const ReadContext& context, std::string_view data,
                                     std::uint64_t at, const DenseLayout& layout) {
  const std::uint64_t there = data.size() - std::min<std::uint64_t>(at, data.size());
  if (there >= layout.bytes()) return data.substr(at, layout.bytes());
  return fail(ErrorCode::kInput, "{}: {} bytes of voxels; {} x {} x {} of type {} need {}",
              context.path, there, layout.grid.dims.x, layout.grid.dims.y, layout.grid.dims.z,
              name_of(layout.type), layout.bytes());
}

}  // namespace strata
