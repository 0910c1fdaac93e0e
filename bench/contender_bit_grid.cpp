#include <sys/mman.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>
#include <vector>

#include "bench/contenders.h"

#ifdef __PCLMUL__
#include <immintrin.h>
#endif

// E. Eisemann, X. Decoret: Single-pass GPU solid voxelization for real-time applications, 2008;
// M. Schwarz, H.-P. Seidel: Fast parallel surface and solid voxelization on GPUs, 2010.
// We differ: one bit a crossing and a prefix XOR in place of flipping all that lies behind.

namespace strata::bench {
namespace {

constexpr int kStep = 256;           // lattice steps a voxel, as in Strata, so that counts compare
constexpr int kDepthFraction = 24;   // fraction bits of a depth in lattice steps
constexpr int kDepthShift = 8 + 24;  // from a depth to a voxel

/// Bits of a grid, columns along z: bit k % 64 of word (y * nx + x) * words + k / 64.
class BitGrid : public VoxelSet {
 public:
  explicit BitGrid(glm::ivec3 dims)
      : nx(dims.x), ny(dims.y), nz(dims.z), words((static_cast<std::size_t>(nz) + 63) / 64) {
    bytes_ = words * 8 * static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
    void* const pages =
        mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (pages == MAP_FAILED) return;
    madvise(pages, bytes_, MADV_HUGEPAGE);
    data = static_cast<std::uint64_t*>(pages);
  }
  BitGrid(const BitGrid&) = delete;
  BitGrid& operator=(const BitGrid&) = delete;
  ~BitGrid() override {
    if (data != nullptr) munmap(data, bytes_);
  }
  [[nodiscard]] std::uint64_t solid_voxels() const override {
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < bytes_ / 8; ++i) {
      count += static_cast<std::uint64_t>(std::popcount(data[i]));
    }
    return count;
  }

  int nx, ny, nz;
  std::size_t words;  ///< of a column
  std::uint64_t* data = nullptr;

 private:
  std::size_t bytes_ = 0;
};

/// Vertices in lattice steps, shifted so that centres of columns are multiples of kStep.
struct Corner {
  std::int32_t x, y, z;
};

std::vector<Corner> snap(const TriangleSoup& mesh, const VoxelGrid& grid) {
  std::vector<Corner> corners(mesh.positions.size());
  const glm::dvec3 scale = static_cast<double>(kStep) / grid.voxel_size;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const glm::dvec3 p = (mesh.positions[i] - grid.origin) * scale + 0.5;
    corners[i] = {static_cast<std::int32_t>(std::floor(p.x)) - kStep / 2,
                  static_cast<std::int32_t>(std::floor(p.y)) - kStep / 2,
                  static_cast<std::int32_t>(std::floor(p.z)) - kStep / 2};
  }
  return corners;
}

/// The first multiple of kStep that is not below a, in steps.
std::int32_t ceil_step(std::int32_t a) { return (a + kStep - 1) >> 8; }
std::int32_t ceil_step(double a) { return static_cast<std::int32_t>(std::ceil(a * (1.0 / kStep))); }

/// An edge from its lower to its upper end, so that both its triangles find the same points on it.
struct Edge {
  double x, y, slope;
  Edge(const Corner& low, const Corner& high)
      : x(low.x),
        y(low.y),
        slope(static_cast<double>(high.x - low.x) / static_cast<double>(high.y - low.y)) {}
  [[nodiscard]] double at(int row) const { return x + (row * kStep - y) * slope; }
};

class Rasterizer {
 public:
  Rasterizer(BitGrid& grid, int row_begin, int row_end)
      : grid_(grid), row_begin_(row_begin), row_end_(row_end) {
    touched_.assign(static_cast<std::size_t>(row_end - row_begin), {grid.nx, 0});
  }

  /// Toggles the first voxel behind each crossing of a triangle.
  void triangle(Corner a, Corner b, Corner c) {
    if (b.y < a.y) std::swap(a, b);
    if (c.y < b.y) std::swap(b, c);
    if (b.y < a.y) std::swap(a, b);
    const int first = std::max(ceil_step(a.y), row_begin_);
    const int last = std::min(ceil_step(c.y), row_end_);
    if (first >= last) return;
    const std::int64_t ux = b.x - a.x, uy = b.y - a.y, vx = c.x - a.x, vy = c.y - a.y;
    const std::int64_t area = ux * vy - uy * vx;
    if (area == 0) return;
    const auto uz = static_cast<double>(b.z - a.z), vz = static_cast<double>(c.z - a.z);
    const double inverse = 1.0 / static_cast<double>(area);
    const double dzdx = (uz * static_cast<double>(vy) - vz * static_cast<double>(uy)) * inverse;
    const double dzdy = (vz * static_cast<double>(ux) - uz * static_cast<double>(vx)) * inverse;
    constexpr double kScale = std::int64_t{1} << kDepthFraction;
    // A crossing exactly at a centre is in front of it; depths were shifted by half a voxel.
    const double z0 = a.z + kStep;
    const auto step = static_cast<std::int64_t>(dzdx * (kStep * kScale));

    const Edge whole(a, c);
    const bool whole_is_left = area > 0;  // b lies at larger x than the edge a c
    const int middle = std::clamp(ceil_step(b.y), first, last);
    const auto part = [&](const Edge& edge, int from, int to) {
      for (int row = from; row < to; ++row) {
        const double p = whole.at(row), q = edge.at(row);
        const int begin = std::max(ceil_step(whole_is_left ? p : q), 0);
        const int end = std::min(ceil_step(whole_is_left ? q : p), grid_.nx);
        if (begin >= end) continue;
        const double z = z0 + dzdx * (begin * kStep - a.x) + dzdy * (row * kStep - a.y);
        span(row, begin, end, static_cast<std::int64_t>(z * kScale), step);
      }
    };
    if (first < middle) part(Edge(a, b), first, middle);
    if (middle < last) part(Edge(b, c), middle, last);
  }

  /// Fills along all columns.
  void fill() {
    for (int row = row_begin_; row < row_end_; ++row) {
      const auto [begin, end] = touched_[static_cast<std::size_t>(row - row_begin_)];
      for (int x = begin; x < end; ++x) fill_column(column(row, x));
    }
  }

 private:
  [[nodiscard]] std::uint64_t* column(int row, int x) const {
    return grid_.data + (static_cast<std::size_t>(row) * static_cast<std::size_t>(grid_.nx) +
                         static_cast<std::size_t>(x)) *
                            grid_.words;
  }

  void span(int row, int begin, int end, std::int64_t z, std::int64_t step) {
    auto& [low, high] = touched_[static_cast<std::size_t>(row - row_begin_)];
    low = std::min(low, begin);
    high = std::max(high, end);
    std::uint64_t* words = column(row, begin);
    for (int x = begin; x < end; ++x, z += step, words += grid_.words) {
      const std::int64_t k = std::max<std::int64_t>(z >> kDepthShift, 0);
      if (k < grid_.nz) words[k >> 6] ^= std::uint64_t{1} << (k & 63);
    }
  }

  static std::uint64_t prefix_xor(std::uint64_t x) {
#ifdef __PCLMUL__
    const __m128i product =
        _mm_clmulepi64_si128(_mm_cvtsi64_si128(static_cast<long long>(x)), _mm_set1_epi8(-1), 0);
    return static_cast<std::uint64_t>(_mm_cvtsi128_si64(product));
#else
    x ^= x << 1;
    x ^= x << 2;
    x ^= x << 4;
    x ^= x << 8;
    x ^= x << 16;
    return x ^ x << 32;
#endif
  }

  void fill_column(std::uint64_t* words) const {
    std::uint64_t carry = 0;
    for (std::size_t w = 0; w < grid_.words; ++w) {
      const std::uint64_t filled = prefix_xor(words[w]) ^ carry;
      words[w] = filled;
      carry = 0 - (filled >> 63);
    }
    const int rest = grid_.nz & 63;
    if (rest != 0) words[grid_.words - 1] &= (std::uint64_t{1} << rest) - 1;
  }

  BitGrid& grid_;
  int row_begin_, row_end_;
  std::vector<std::pair<int, int>> touched_;  // columns of each row, [begin, end)
};

class BitGridXor : public Contender {
 public:
  explicit BitGridXor(std::size_t slab_bytes) : slab_bytes_(slab_bytes) {}
  [[nodiscard]] std::string name() const override {
    return slab_bytes_ == 0 ? "bit grid XOR" : "bit grid XOR, slabs";
  }
  [[nodiscard]] int threads() const override { return 1; }
  std::shared_ptr<VoxelSet> voxelize(const TriangleSoup& mesh, const VoxelGrid& grid) override {
    auto bits = std::make_shared<BitGrid>(grid.dims);
    if (bits->data == nullptr) return nullptr;
    const std::vector<Corner> corners = snap(mesh, grid);
    if (slab_bytes_ == 0) {
      Rasterizer rasterizer(*bits, 0, bits->ny);
      for (const glm::uvec3& t : mesh.triangles) {
        rasterizer.triangle(corners[t.x], corners[t.y], corners[t.z]);
      }
      rasterizer.fill();
    } else {
      in_slabs(*bits, corners, mesh.triangles);
    }
    return bits;
  }

 private:
  void in_slabs(BitGrid& bits, const std::vector<Corner>& corners,
                const std::vector<glm::uvec3>& triangles) const {
    const std::size_t row_bytes = bits.words * 8 * static_cast<std::size_t>(bits.nx);
    const int rows = static_cast<int>(std::max<std::size_t>(1, slab_bytes_ / row_bytes));
    const int slabs = (bits.ny + rows - 1) / rows;
    // Which slabs a triangle touches; none when last < first.
    const auto reach = [&](const glm::uvec3& t) {
      const auto [low, high] = std::minmax({corners[t.x].y, corners[t.y].y, corners[t.z].y});
      const int first = std::max(ceil_step(low), 0);
      const int last = std::min(ceil_step(high), bits.ny) - 1;
      return last < first ? std::pair(1, 0) : std::pair(first / rows, last / rows);
    };
    std::vector<std::uint32_t> offsets(static_cast<std::size_t>(slabs) + 1);
    for (const glm::uvec3& t : triangles) {
      const auto [first, last] = reach(t);
      for (int s = first; s <= last; ++s) ++offsets[static_cast<std::size_t>(s)];
    }
    std::uint32_t sum = 0;
    for (std::uint32_t& offset : offsets) sum = offset += sum;
    std::vector<std::uint32_t> order(sum);
    for (std::size_t i = triangles.size(); i-- > 0;) {
      const auto [first, last] = reach(triangles[i]);
      for (int s = first; s <= last; ++s) {
        order[--offsets[static_cast<std::size_t>(s)]] = static_cast<std::uint32_t>(i);
      }
    }
    for (int s = 0; s < slabs; ++s) {
      Rasterizer rasterizer(bits, s * rows, std::min(bits.ny, (s + 1) * rows));
      for (std::uint32_t i = offsets[static_cast<std::size_t>(s)];
           i < offsets[static_cast<std::size_t>(s) + 1]; ++i) {
        const glm::uvec3& t = triangles[order[i]];
        rasterizer.triangle(corners[t.x], corners[t.y], corners[t.z]);
      }
      rasterizer.fill();
    }
  }

  std::size_t slab_bytes_;
};

}  // namespace

std::unique_ptr<Contender> make_bit_grid(std::size_t slab_bytes) {
  return std::make_unique<BitGridXor>(slab_bytes);
}

}  // namespace strata::bench
