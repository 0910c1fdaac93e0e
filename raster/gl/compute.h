#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "raster/triangle_setup.h"
#include "strata/core/result.h"
#include "strata/gl/buffer.h"
#include "strata/gl/context.h"
#include "strata/gl/shader_program.h"
#include "strata/raster/gl/producer.h"
#include "strata/raster/lattice_mesh.h"

namespace strata::gl {

/// Rasterizes snapped meshes in compute shaders, in the CPU's integers: the fragments are those of
/// rasterize_exact() for every triangle, bit for bit (laws 2 to 4).
///
/// This work is related to: M. Kenzel et al., A High-Performance Software Graphics Pipeline
/// Architecture for the GPU, 2018; S. Laine, T. Karras, High-Performance Software Rasterization on
/// GPUs, 2011. We differ: fragments need no order, so there are no bins to sort; small triangles
/// are a thread's each, and the blocks of 32 x 32 pixels of larger ones a group's each.
///
/// Needs 64-bit integers in shaders (Info::has_int64). One context, one thread.
class ComputeRasterizer final : public Producer {
 public:
  /// Compiles what does not depend on the store. The context must be current, then and later.
  /// @return kUsage with a sentence where the driver has no 64-bit integers
  [[nodiscard]] static Result<std::unique_ptr<ComputeRasterizer>> create(const Context& context);

  /// Uploads a mesh; it may go afterwards. Meshes of any size are taken in parts that the bindings
  /// hold. @return kLimit without the memory
  [[nodiscard]] Result<void> set_mesh(const LatticeMesh& mesh);
  /// What the rays see: rows [v_begin, v_end) of `target` become the screen.
  void set_target(const RasterTarget& target, int v_begin, int v_end);

  [[nodiscard]] std::uint32_t width() const override {
    return static_cast<std::uint32_t>(target_.width);
  }
  [[nodiscard]] std::uint32_t height() const override {
    return static_cast<std::uint32_t>(v_end_ - v_begin_);
  }
  /// Payload: [exit:1 | triangle:31]. @return kLimit without the memory for the blocks of large
  /// triangles (fewer rows need less)
  [[nodiscard]] Result<void> draw(const StoreGlsl& store, PixelRows rows) override;

  /// How many fragments draw() gives for `rows`: a pass without depths. @return as draw()
  [[nodiscard]] Result<std::uint64_t> count(PixelRows rows);

  /// How the triangles were sorted out for the rows of the last draw().
  struct Counts {
    std::uint64_t small = 0;   ///< triangles of at most 64 pixels' box
    std::uint64_t large = 0;   ///< all others that cover something
    std::uint64_t blocks = 0;  ///< of those
  };
  [[nodiscard]] const Counts& counts() const { return counts_; }

 private:
  /// Triangles [first, first + count) of the mesh.
  struct Part {
    std::uint32_t first = 0, count = 0;
    Buffer own_vertices;  ///< where the mesh's do not fit one binding: three a triangle
    Buffer triangles, small, large, blocks;
    std::uint32_t small_count = 0, large_count = 0, block_count = 0;
  };
  struct Pass {
    StoreGlsl store;
    Program small, large;
  };

  ComputeRasterizer() = default;
  Result<void> bin(PixelRows rows);
  Result<void> bin(Part& part);
  Result<const Pass*> pass_for(const StoreGlsl& store);
  void bind(const Part& part) const;

  std::uint64_t binding_bytes_ = 0;
  Program bin_program_;
  std::vector<Pass> passes_;
  Buffer vertices_, view_, counters_, sums_;
  std::vector<Part> parts_;
  RasterTarget target_;
  int v_begin_ = 0, v_end_ = 0;
  PixelRows binned_;  ///< rows of the screen that the parts are sorted out for; none: begin = end
  Counts counts_;
};

}  // namespace strata::gl
