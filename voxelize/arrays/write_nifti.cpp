// NIfTI (nifti.nimh.nih.gov: nifti1.h, nifti2.h): `.nii`, and `.nii.gz` as one gzip stream, x
// fastest. Version 2 where a side is above 32767, which version 1 cannot say. Both sform and qform
// place the grid; srow is the centre of the first voxel. Ids beyond 16 bits are int32, since many
// programs do not know uint32.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <memory>
#include <string>
#include <utility>

#include "core/letters.h"
#include "voxelize/output/block_output.h"
#include "voxelize/output/dense_room.h"
#include "voxelize/output/dense_writer.h"
#include "voxelize/output/grid_text.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

int nifti_code(const DenseValues& values) {
  constexpr int kUint8 = 2, kInt32 = 8, kFloat32 = 16, kUint16 = 512, kRgba32 = 2304;
  if (values.components == 4) return kRgba32;
  if (values.is_float()) return kFloat32;
  return values.bytes == 1 ? kUint8 : values.bytes == 2 ? kUint16 : kInt32;
}

/// A rotation as nifti1.h has it: b, c, d of a quaternion with a >= 0, and the sign of the third
/// axis.
struct Quaternion {
  double a = 1.0, b = 0.0, c = 0.0, d = 0.0, flip = 1.0;

  explicit Quaternion(glm::dmat3 direction) {
    if (glm::determinant(direction) < 0.0) {
      flip = -1.0;
      direction[2] = -direction[2];
    }
    const auto r = [&](int row, int column) { return direction[column][row]; };
    // The largest of the four is had from its square, the others by it.
    const std::array<double, 4> squares = {
        1 + r(0, 0) + r(1, 1) + r(2, 2), 1 + r(0, 0) - r(1, 1) - r(2, 2),
        1 - r(0, 0) + r(1, 1) - r(2, 2), 1 - r(0, 0) - r(1, 1) + r(2, 2)};
    std::size_t most = 0;
    for (std::size_t i = 1; i < 4; ++i) most = squares[i] > squares[most] ? i : most;
    const double s = 2 * std::sqrt(squares[most]);  // 4 times the largest
    const double ab = (r(2, 1) - r(1, 2)) / s, ac = (r(0, 2) - r(2, 0)) / s;
    const double ad = (r(1, 0) - r(0, 1)) / s, bc = (r(0, 1) + r(1, 0)) / s;
    const double bd = (r(0, 2) + r(2, 0)) / s, cd = (r(1, 2) + r(2, 1)) / s;
    if (most == 0) a = s / 4, b = ab, c = ac, d = ad;
    if (most == 1) a = ab, b = s / 4, c = bc, d = bd;
    if (most == 2) a = ac, b = bc, c = s / 4, d = cd;
    if (most == 3) a = ad, b = bd, c = cd, d = s / 4;
    if (a < 0.0) a = -a, b = -b, c = -c, d = -d;
  }
};

/// What both versions say.
class NiftiText {
 public:
  NiftiText(const VoxelGrid& grid, const VoxelWriterOptions& options, const DenseValues& values)
      : grid_(grid),
        axes_(world_axes(grid, options.frame, "right-anterior-superior")),
        turn_(axes_.direction),
        values_(values),
        name_(one_line(options.name)) {
    const double unit = options.frame.unit_metres;
    units_ = unit_name(unit) == "m"    ? 1
             : unit_name(unit) == "mm" ? 2
             : unit_name(unit) == "um" ? 3
                                       : 0;
  }

  /// With the four bytes that say that no extension follows.
  [[nodiscard]] std::string text() {
    const glm::ivec3 dims = grid_.dims;
    return std::max({dims.x, dims.y, dims.z}) > 32767 ? second() : first();
  }

 private:
  template <class T, class V>
  void put(std::size_t at, V number) {
    const T value = static_cast<T>(number);
    std::memcpy(bytes_.data() + at, &value, sizeof value);
  }
  void put_text(std::size_t at, const std::string& text, std::size_t most) {
    std::memcpy(bytes_.data() + at, text.data(), std::min(text.size(), most));
  }
  template <class Size, class Real>
  void put_grid(std::size_t dim, std::size_t pixdim, std::size_t quaternion, std::size_t srow) {
    const int counts[8] = {3, grid_.dims.x, grid_.dims.y, grid_.dims.z, 1, 1, 1, 1};
    const double sizes[8] = {
        turn_.flip, grid_.voxel_size.x, grid_.voxel_size.y, grid_.voxel_size.z, 1, 1, 1, 1};
    for (std::size_t i = 0; i < 8; ++i) {
      put<Size>(dim + i * sizeof(Size), counts[i]);
      put<Real>(pixdim + i * sizeof(Real), sizes[i]);
    }
    const double place[6] = {turn_.b,        turn_.c,        turn_.d,
                             axes_.centre.x, axes_.centre.y, axes_.centre.z};
    for (std::size_t i = 0; i < 6; ++i) put<Real>(quaternion + i * sizeof(Real), place[i]);
    for (std::size_t row = 0; row < 3; ++row) {
      const auto r = static_cast<int>(row);
      for (std::size_t column = 0; column < 4; ++column) {
        const double number =
            column == 3 ? axes_.centre[r] : axes_.steps[static_cast<int>(column)][r];
        put<Real>(srow + (4 * row + column) * sizeof(Real), number);
      }
    }
  }
  // The code of a form that places a scanner's grid; of other grids "aligned".
  static constexpr int kPlaced = 2;

  std::string first() {
    bytes_.assign(352, '\0');
    put<std::int32_t>(0, 348);
    put<std::int16_t>(70, nifti_code(values_));
    put<std::int16_t>(72, 8 * values_.bytes);
    put<float>(108, 352);
    put<float>(112, 1);
    put<std::uint8_t>(123, units_);
    put_text(148, name_, 79);
    put<std::int16_t>(252, kPlaced);
    put<std::int16_t>(254, kPlaced);
    put_grid<std::int16_t, float>(40, 76, 256, 280);
    put_text(344, "n+1", 4);
    return bytes_;
  }
  std::string second() {
    bytes_.assign(544, '\0');
    put<std::int32_t>(0, 540);
    put_text(4, std::string("n+2\0\r\n\x1a\n", 8), 8);
    put<std::int16_t>(12, nifti_code(values_));
    put<std::int16_t>(14, 8 * values_.bytes);
    put<std::int64_t>(168, 544);
    put<double>(176, 1);
    put_text(240, name_, 79);
    put<std::int32_t>(344, kPlaced);
    put<std::int32_t>(348, kPlaced);
    put<std::int32_t>(500, units_);
    put_grid<std::int64_t, double>(16, 104, 352, 400);
    return bytes_;
  }

  const VoxelGrid& grid_;
  WorldAxes axes_;
  Quaternion turn_;
  const DenseValues& values_;
  std::string name_;
  int units_ = 0;
  std::string bytes_;
};

}  // namespace

VoxelWriterResult open_nifti_writer(const std::string& path, const VoxelGrid& grid,
                                    const VoxelWriterOptions& options, bool packed) {
  const bool gzip = packed || lower_case(path).ends_with(".gz");
  const auto packing = gzip ? DenseStream::Packing::kGzip : DenseStream::Packing::kNone;
  const DenseValues values(options);
  const std::string head = NiftiText(grid, options, values).text();
  if (!gzip) {
    const auto room = check_dense_room(path, grid.dims, values, head.size());
    if (!room) return tl::unexpected(room.error());
  }
  Result<BlockOutput> output = BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  return begun(std::make_unique<DenseWriter>(path, grid, options, packing, std::move(*output)), "",
               head);
}

}  // namespace strata
