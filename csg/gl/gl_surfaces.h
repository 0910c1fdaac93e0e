#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "csg/surface/surface_source.h"
#include "strata/gl/context.h"
#include "strata/hashbuffer/gl/store.h"

namespace strata::csg {

/// Finds surfaces by a walk over the lists of all solids, in a compute shader over any store, with
/// one bit per solid and the tree simplified tile by tile as on the CPU. A pixel that the walk
/// cannot decide (coincident faces, solids that are open or overlap themselves) is decided by the
/// CPU's code from its downloaded list. So the surfaces are bit-identical to the CPU's.
///
/// Tiles where the near plane cuts a solid, or that meet more than 1024 solids or nodes, are left
/// to the CPU.
class GlSurfaceSource final : public SurfaceSource {
 public:
  /// @param store keeps whole payloads; its lists may be of any length
  /// @param pixels_at_once about how many pixels are drawn at once, in whole rows of tiles
  /// @return kUsage where the driver cannot; kInternal where it refuses a shader
  [[nodiscard]] static Result<std::unique_ptr<GlSurfaceSource>> create(
      const gl::Context& context, std::unique_ptr<gl::Store> store,
      std::uint64_t pixels_at_once = std::uint64_t{1} << 22);
  ~GlSurfaceSource() override;

  Result<void> find(const FrameInput& frame, SurfaceImage& image, DrawReport& report,
                    std::vector<std::uint32_t>& left, const Execution& execution) override;

  /// Who found the surfaces of the last frame, GPU or CPU.
  struct Counts {
    std::uint64_t walked = 0;    ///< pixels that the walk decided, in tiles with solids
    std::uint64_t doubtful = 0;  ///< pixels decided from their lists
    std::uint64_t left = 0;      ///< tiles left to the CPU
  };
  [[nodiscard]] const Counts& counts() const;

 private:
  struct Impl;
  explicit GlSurfaceSource(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace strata::csg
