// The sizes of voxel files follow from the writers in voxelize/formats. What those write for a run
// is known; how many runs there can be follows from the triangles: rays change between inside and
// outside only where they cross one, and a leaf of an OpenVDB tree, or a chunk of a Zarr array, is
// even unless it meets one.

#include "apps/voxelize/file_size.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <vector>

#include "voxelize/arrays/npy_voxels.h"
#include "voxelize/formats/vox_pieces.h"

namespace strata::apps {
namespace {

constexpr double kHeads = 2048;      // of a file, without names
constexpr double kBlockBytes = 180;  // the codes and the end of a block of RunDeflater

/// Counts boxes of a grid that triangles may meet. Of a grid that is not too large a box counts
/// once, else once for each triangle.
class BoxCount {
 public:
  /// @param side   of a box, in voxels @param along  an axis along which boxes are endless: they
  ///               are the rays through voxel centres, and count once for each triangle; 3: none
  /// @param reach  of triangles beyond themselves, in voxels
  BoxCount(const VoxelGrid& grid, int side, int along, const glm::dvec3& reach = glm::dvec3(0.0))
      : grid_(grid),
        side_(side),
        along_(along),
        reach_(reach),
        boxes_((grid.dims + side - 1) / side) {
    constexpr double kMostMarks = 1 << 29;  // 64 MiB
    const double all = static_cast<double>(boxes_.x) * boxes_.y * boxes_.z;
    if (along == 3 && all <= kMostMarks) marks_.resize(static_cast<std::size_t>(all));
  }

  double operator()(const TriangleSoup& soup, const Execution& execution) {
    // Large triangles are cut into pieces, which meet fewer boxes than the box around them.
    constexpr double kMostPieces = 1 << 20;
    const auto count = static_cast<double>(std::max<std::size_t>(1, soup.triangles.size()));
    const int cuts = std::clamp(static_cast<int>(std::log2(kMostPieces / count)), 0, 16);
    double boxes = 0;
    std::size_t done = 0;
    for (const glm::uvec3& t : soup.triangles) {
      if ((++done & 0xfff) == 0 && execution.stop.stop_requested()) break;
      boxes += met(place(soup.positions[t.x]), place(soup.positions[t.y]),
                   place(soup.positions[t.z]), cuts);
    }
    return boxes;
  }

  /// How many groups of neighbours along an axis the boxes are, at most. @pre they are counted
  [[nodiscard]] double groups(Axis axis, double counted) const {
    if (marks_.empty()) return counted;
    const auto a = static_cast<int>(axis);
    const std::size_t step =
        a == 0   ? 1
        : a == 1 ? static_cast<std::size_t>(boxes_.x)
                 : static_cast<std::size_t>(boxes_.x) * static_cast<std::size_t>(boxes_.y);
    const auto side = static_cast<std::size_t>(boxes_[a]);
    double count = 0;
    for (std::size_t i = 0; i < marks_.size(); ++i) {
      if (marks_[i] && (i / step % side == 0 || !marks_[i - step])) ++count;
    }
    return count;
  }

 private:
  [[nodiscard]] glm::dvec3 place(const glm::dvec3& p) const {
    return (p - grid_.origin) / grid_.voxel_size;
  }
  double met(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, int cuts) {
    constexpr double kMoved = 1.0 / 16;  // by the lattice, and where faces that coincide act
    const glm::dvec3 low = glm::min(a, glm::min(b, c)) - kMoved - reach_;
    const glm::dvec3 high = glm::max(a, glm::max(b, c)) + kMoved + reach_;
    const bool rays = along_ < 3;
    const glm::dvec3 first =
        glm::max(rays ? glm::ceil(low - 0.5) : glm::floor(low / side_), glm::dvec3(0.0));
    const glm::dvec3 last =
        glm::min(rays ? glm::floor(high - 0.5) : glm::floor(high / side_), glm::dvec3(boxes_ - 1));
    double boxes = 1;
    for (int axis = 0; axis < 3; ++axis) {
      if (axis != along_) boxes *= std::max(0.0, last[axis] - first[axis] + 1);
    }
    if (cuts == 0 || boxes <= 4) return boxes == 0 || marks_.empty() ? boxes : mark(first, last);
    const double ab = glm::distance(a, b), bc = glm::distance(b, c), ca = glm::distance(c, a);
    if (ab >= bc && ab >= ca) return cut(a, b, c, cuts - 1);
    return bc >= ca ? cut(b, c, a, cuts - 1) : cut(c, a, b, cuts - 1);
  }
  /// Of two halves, the edge from a to b cut.
  double cut(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, int cuts) {
    const glm::dvec3 middle = 0.5 * (a + b);
    return met(a, middle, c, cuts) + met(middle, b, c, cuts);
  }
  /// @return how many boxes were not marked
  double mark(const glm::ivec3& first, const glm::ivec3& last) {
    double count = 0;
    for (int z = first.z; z <= last.z; ++z) {
      for (int y = first.y; y <= last.y; ++y) {
        for (int x = first.x; x <= last.x; ++x) {
          const std::size_t at = (static_cast<std::size_t>(z) * static_cast<std::size_t>(boxes_.y) +
                                  static_cast<std::size_t>(y)) *
                                     static_cast<std::size_t>(boxes_.x) +
                                 static_cast<std::size_t>(x);
          if (marks_[at]) continue;
          marks_[at] = true;
          ++count;
        }
      }
    }
    return count;
  }

  const VoxelGrid& grid_;
  double side_;
  int along_;
  glm::dvec3 reach_;
  glm::ivec3 boxes_;         // along x, y, z
  std::vector<bool> marks_;  // of the boxes, x fastest; or none
};

double parts(int voxels, int side) { return std::ceil(static_cast<double>(voxels) / side); }

/// Bounds of what the file of a set holds.
class SizeBound {
 public:
  SizeBound(const VoxelGrid& grid, const MemoryFactors& factors, bool closed,
            const VoxelWriterOptions& file, const Execution& execution)
      : grid_(grid),
        factors_(factors),
        closed_(closed),
        file_(file),
        execution_(execution),
        values_(file),
        cells_(static_cast<double>(grid.dims.x) * grid.dims.y * grid.dims.z) {}

  [[nodiscard]] double bytes() const {
    const std::string_view format = factors_.format;
    if (format == "vdb") return vdb();
    if (format == "binvox") return binvox();
    if (format == "vox") return vox();
    if (format == "ply") return kHeads + 28 * voxels();  // 3 doubles and a value
    if (format == "xyz") return kHeads + 92 * voxels();
    if (format == "png" || format == "sl1") return pictures();
    if (format == "zarr") return zarr();
    if (format == "ome.zarr") return (file_.levels > 1 ? 2.0 : 1.0) * (zarr() + kHeads);
    if (format == "tif") return layers(RunBytes::kIds, cells_) + 512.0 * grid_.dims.z;
    if (format == "h5") return layers(values_.codes, cells_) + hdf5_index();
    return layers(values_.codes, cells_);  // npz, nrrd, vti, nii.gz, mha
  }
  [[nodiscard]] double dense() const { return cells_ * static_cast<double>(values_.bytes); }

 private:
  /// Boxes that are neither empty nor solid.
  [[nodiscard]] double mixed(int side) const {
    const glm::ivec3 n = (grid_.dims + side - 1) / side;
    const double all = static_cast<double>(n.x) * n.y * n.z;
    if (factors_.votes) return all;
    // Those at the sides of the grid, too, where a solid that goes on beyond is cut off.
    const double sides = goes_beyond()
                             ? static_cast<double>(n.x) * n.y + static_cast<double>(n.y) * n.z +
                                   static_cast<double>(n.z) * n.x
                             : 0.0;
    return std::min(all, sides + BoxCount(grid_, side, 3, reach())(*factors_.mesh, execution_));
  }
  /// Of the band of distances, in voxels.
  [[nodiscard]] glm::dvec3 reach() const {
    const glm::dvec3 s = grid_.voxel_size;
    if (file_.rgba) return glm::dvec3(1.0);  // how far from the surface voxels have its colours
    return factors_.band * std::max({s.x, s.y, s.z}) / s;
  }
  [[nodiscard]] bool goes_beyond() const {
    const glm::dvec3 margin = grid_.voxel_size / 16.0, low = grid_.origin - margin;
    const glm::dvec3 high = grid_.origin + glm::dvec3(grid_.dims) * grid_.voxel_size + margin;
    return std::any_of(
        factors_.mesh->positions.begin(), factors_.mesh->positions.end(), [&](const glm::dvec3& p) {
          return glm::any(glm::lessThan(p, low)) || glm::any(glm::greaterThan(p, high));
        });
  }
  /// Changes of the value along the rays of an axis.
  [[nodiscard]] double changes(Axis axis) const {
    if (factors_.votes) return cells_;
    if (factors_.everywhere) return cells_;
    if (factors_.band > 0) {  // all voxels of blocks that the band meets, and what lies between
      return std::min(cells_, mixed(ScalarField::kBlockSide) * (ScalarField::kBlockVoxels + 64));
    }
    if (factors_.rays > 0) return std::min(shares(axis), cells_);
    double count = 0;
    if (factors_.solid) {
      const double crossings =
          BoxCount(grid_, 1, static_cast<int>(axis))(*factors_.mesh, execution_);
      count += closed_ ? crossings : 2 * crossings;  // a face without a partner is a thin sheet
    }
    if (factors_.surface) count += 2 * touched();
    // Each voxel near the surface may have a colour of its own.
    if (file_.rgba) count += 2 * BoxCount(grid_, 1, 3, reach())(*factors_.mesh, execution_);
    return std::min(count, cells_);
  }
  /// The runs that filled fractions take as much room as: each voxel at the surface may have a
  /// fraction of its own, which is a literal without copies, and between groups of them is one run.
  [[nodiscard]] double shares(Axis axis) const {
    BoxCount count(grid_, 1, 3);
    const double at_surface = count(*factors_.mesh, execution_);
    const double literals = at_surface * literal_bits();
    return literals / run_bits() + count.groups(axis, at_surface);
  }
  [[nodiscard]] double literal_bits() const { return 10 * static_cast<double>(values_.bytes); }
  /// Of RunBytes::kIds: a literal, and the copy of what is left after the longest ones.
  [[nodiscard]] double run_bits() const { return literal_bits() + 20; }
  [[nodiscard]] double touched() const { return BoxCount(grid_, 1, 3)(*factors_.mesh, execution_); }
  /// Of runs of elements that RunDeflater writes as blocks. The bits are those of its codes.
  [[nodiscard]] double deflated(RunBytes kind, double runs, double elements, double blocks) const {
    const auto e = static_cast<double>(values_.bytes);
    const double bits = kind == RunBytes::kFlags  ? 14 * runs + 3 * elements / 258
                        : kind == RunBytes::kBits ? 28 * runs + 5 * elements / 8 / 258
                                                  : run_bits() * runs + 5 * elements * e / 258;
    return bits / 8 + kBlockBytes * blocks;
  }
  [[nodiscard]] double layers(RunBytes kind, double elements) const {
    const double count = grid_.dims.z + 2;  // with what stands before and after
    return kHeads + 8 * count + deflated(kind, changes(Axis::kX) + count, elements, count);
  }
  /// Chunks of 8 to 16 MB of a layer, and where they lie.
  [[nodiscard]] double hdf5_index() const {
    const double layer =
        static_cast<double>(grid_.dims.x) * grid_.dims.y * static_cast<double>(values_.bytes);
    const double chunks = grid_.dims.z * (1 + std::ceil(layer / (1 << 23)));
    return 8 * kHeads + (128 + kBlockBytes) * chunks;
  }
  /// Pictures of layers, in a folder or an archive.
  [[nodiscard]] double pictures() const {
    const LayerOptions& layers = file_.layers;
    const int axis = static_cast<int>(layers.axis);
    glm::ivec2 size(grid_.dims[axis == 0 ? 1 : 0], grid_.dims[axis == 2 ? 1 : 2]);
    if (layers.display.x > 0) size = layers.display;
    const bool flags = values_.codes == RunBytes::kFlags;
    constexpr double kChunks = 57 + 6;             // signature, heads, sums
    constexpr double kEntry = 76 + 2 * (255 + 9);  // heads of an archive, and the longest names
    const double count = grid_.dims[axis];
    const double row = flags ? 8 * parts(size.x, 8) + 8 : size.x + 1.0;
    const double runs = changes(axis == 0 ? Axis::kY : Axis::kX) + count;
    return kHeads + (kChunks + 8 + (factors_.format == "sl1" ? kEntry : 0.0)) * count +
           (flags ? 0.0 : size.y * count * 4) +
           deflated(flags ? RunBytes::kBits : RunBytes::kIds, runs, row * size.y * count,
                    count + 2);
  }
  [[nodiscard]] double zarr() const {
    constexpr int kSide = 64;
    const double chunks =
        parts(grid_.dims.x, kSide) * parts(grid_.dims.y, kSide) * parts(grid_.dims.z, kSide);
    const double columns = mixed(kSide) * kSide * kSide;  // each may end otherwise than the next
    const double runs = changes(Axis::kZ) + columns +
                        chunks * (values_.codes == RunBytes::kIds ? kSide * kSide : 1);
    return kHeads + 6 * chunks +
           deflated(values_.codes, runs, chunks * kSide * kSide * kSide, chunks);
  }
  [[nodiscard]] double vdb() const {
    const bool level_set = factors_.band > 0;
    const bool floats = file_.ids != 0 || file_.fog != 0 || level_set || file_.rgba;
    const double numbers = file_.rgba ? 3 : 1;  // of a value
    const double leaves = parts(grid_.dims.x, 8) * parts(grid_.dims.y, 8) * parts(grid_.dims.z, 8);
    const double lowers =
        parts(grid_.dims.x, 128) * parts(grid_.dims.y, 128) * parts(grid_.dims.z, 128);
    const double uppers =
        parts(grid_.dims.x, 4096) * parts(grid_.dims.y, 4096) * parts(grid_.dims.z, 4096);
    const double value = floats ? 4 * numbers : 1, list = floats ? 8 : 0;
    const double leaf = floats       ? 64 + 64 + 1 + 64 + 2048 * numbers
                        : file_.mask ? 64 + 76
                                     : 64 + 140;
    const double masks = level_set ? 1.0 : 0.0;  // of what lies inside
    return kHeads + 3 * static_cast<double>(file_.name.size()) +
           uppers * (8205 + list + 17 + masks * 4096) +
           lowers * (1025 + list + value + masks * 512) + leaves * value + mixed(8) * leaf;
  }
  [[nodiscard]] double binvox() const {
    const double side = std::max({grid_.dims.x, grid_.dims.y, grid_.dims.z});
    const double pieces = side * (parts(static_cast<int>(side), 64) + 2);
    return kHeads + 2 * (changes(Axis::kY) + 2 * pieces + side * side * side / 255);
  }
  [[nodiscard]] double vox() const {
    const double models =
        parts(grid_.dims.x, 256) * parts(grid_.dims.y, 256) * parts(grid_.dims.z, 256);
    return kHeads * VoxPieces(grid_.dims).total() + 4 * voxels() + 160 * models;
  }
  [[nodiscard]] double voxels() const {
    return factors_.solid ? cells_ : std::min(cells_, touched());
  }

  const VoxelGrid& grid_;
  const MemoryFactors& factors_;
  bool closed_;
  const VoxelWriterOptions& file_;
  const Execution& execution_;
  DenseValues values_;
  double cells_;
};

}  // namespace

FileSize file_size(const VoxelGrid& grid, const MemoryFactors& factors, bool closed,
                   const VoxelWriterOptions& file, const Execution& execution) {
  const SizeBound bound(grid, factors, closed, file, execution);
  if (factors.format == "npy") {
    const std::string head = npy_head(DenseValues(file), grid.dims);
    return {static_cast<std::uint64_t>(bound.dense()) + head.size(), true};
  }
  if (factors.format == "nii" || factors.format == "raw") {
    const bool second = std::max({grid.dims.x, grid.dims.y, grid.dims.z}) > 32767;
    const std::uint64_t head = factors.format == "raw" ? 0 : second ? 544 : 352;
    return {static_cast<std::uint64_t>(bound.dense()) + head, true};
  }
  const double most = bound.bytes() + 6.0 * static_cast<double>(file.name.size());
  return {
      most < 1e19 ? static_cast<std::uint64_t>(most) : std::uint64_t{10'000'000'000'000'000'000u},
      false};
}

}  // namespace strata::apps
