#pragma once

#include <cstdint>
#include <memory>

#include "hashbuffer/gl/compute_lists.h"
#include "strata/core/execution.h"

namespace strata::csg {

/// Lists of a mesh on the GPU and, if the mesh is the soup of SolidLists, of the tree's result,
/// bit-identical to the filter's. A walk over the solids' lists computes them on the GPU, with one
/// bit per solid and the tree simplified tile by tile. Pixels that the walk does not decide (solids
/// that are open or overlap themselves, tiles of more than 1024 solids or nodes) are downloaded
/// unchanged and filtered on the CPU; so are all rows of a batch in which a list is longer than a
/// thread may walk.
class GlResultSource final : public gl::ComputeListSource {
 public:
  /// As ComputeListSource::create(). @param execution threads of the filter as well
  [[nodiscard]] static Result<std::unique_ptr<GlResultSource>> create(
      const gl::Context& context, std::unique_ptr<gl::Store> store,
      std::unique_ptr<gl::Store> spare = nullptr,
      std::int64_t pixels_at_once = std::int64_t{1} << 22, const Execution& execution = {});
  ~GlResultSource() override;

  Result<void> set_mesh(const LatticeMesh& mesh) override;
  bool use_filter(const TileListFilter& filter) override;

  /// Who computed the lists since the filter was set. Rows with a list that is too long to walk are
  /// not counted.
  struct Counts {
    std::uint64_t walked = 0;       ///< pixels with crossings that the walk decided
    std::uint64_t handed_over = 0;  ///< pixels that the filter decided
  };
  [[nodiscard]] const Counts& counts() const;

 private:
  friend struct ResultListsForTests;
  struct Impl;
  explicit GlResultSource(std::unique_ptr<Impl> impl);
  Result<LayeredDepthImage> read(gl::Store& store, const RasterTarget& target, int v_begin,
                                 int v_end) override;
  std::unique_ptr<Impl> impl_;
};

}  // namespace strata::csg
