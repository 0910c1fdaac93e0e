#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "raster/triangle_setup.h"
#include "strata/core/result.h"
#include "strata/gl/buffer.h"
#include "strata/gl/context.h"
#include "strata/gl/shader_program.h"
#include "strata/raster/gl/producer.h"
#include "strata/raster/lattice_mesh.h"

namespace strata::gl {

/// Rasterizes snapped meshes with the GPU's own rasterizer: a fragment shader inserts, as in:
/// Lefebvre, Hornus, Lasram, "HA-Buffer", INRIA RR-8282, 2013, section 4.
/// We differ: the depth key is no interpolated number but computed from the triangle's lattice
/// positions in double precision, so it is the CPU's, and the same in every pass; nothing is
/// discarded, so early tests stay early.
///
/// Pixels whose centre lies exactly on an edge go where the driver says, which differs from law 3:
/// so lists may differ from the CPU's in pixels of silhouettes, and where two triangles meet the
/// other one may be named. Depths differ by a step at most. Triangles that reach far out of the
/// screen are clipped by the driver, which moves their edges by its rounding.
class HardwareRasterizer final : public Producer {
 public:
  /// The context must be current, then and later.
  [[nodiscard]] static Result<std::unique_ptr<HardwareRasterizer>> create(const Context& context);
  ~HardwareRasterizer() override;
  HardwareRasterizer(const HardwareRasterizer&) = delete;
  HardwareRasterizer& operator=(const HardwareRasterizer&) = delete;

  /// Uploads a mesh; it may go afterwards. @return kLimit without the memory, or if its vertices or
  /// triangles are larger than one binding (ComputeRasterizer takes those)
  [[nodiscard]] Result<void> set_mesh(const LatticeMesh& mesh);
  /// What the rays see: rows [v_begin, v_end) of `target` become the screen.
  void set_target(const RasterTarget& target, int v_begin, int v_end);
  void set_target(const RasterTarget& target) { set_target(target, 0, target.height); }

  [[nodiscard]] std::uint32_t width() const override {
    return static_cast<std::uint32_t>(target_.width);
  }
  [[nodiscard]] std::uint32_t height() const override {
    return static_cast<std::uint32_t>(v_end_ - v_begin_);
  }
  /// Payload: [exit:1 | triangle:31]. Binds its own framebuffer, and the one before again.
  [[nodiscard]] Result<void> draw(const StoreGlsl& store, PixelRows rows) override;
  /// Draws into the images of `framebuffer`, which have the size of the screen and which
  /// strata_insert may read and write. The triangles come in their order. `set_state` is called
  /// before them, for blending or stencil tests; what it enables it must disable in `reset_state`.
  /// @return kLimit where the screen is larger than a viewport allows
  [[nodiscard]] Result<void> draw_into(unsigned framebuffer, const StoreGlsl& store,
                                       const std::function<void()>& set_state = {},
                                       const std::function<void()>& reset_state = {});

 private:
  explicit HardwareRasterizer(const Limits& limits) : limits_(limits) {}
  [[nodiscard]] Result<const Program*> program_for(const StoreGlsl& store);
  /// Pixels along a side of what is drawn at once.
  [[nodiscard]] std::uint32_t largest_tile() const;
  void bind(const Program& program);
  void draw_tile(const Program& program, std::uint32_t u, std::uint32_t v, std::uint32_t width,
                 std::uint32_t height);

  Limits limits_;
  RasterTarget target_;
  int v_begin_ = 0, v_end_ = 0;
  Buffer vertices_, triangles_;
  std::uint32_t triangle_count_ = 0;
  unsigned vertex_array_ = 0, framebuffer_ = 0;
  std::vector<std::pair<StoreGlsl, Program>> programs_;
};

}  // namespace strata::gl
