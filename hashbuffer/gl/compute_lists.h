#pragma once

#include <cstdint>
#include <memory>

#include "strata/core/execution.h"
#include "strata/gl/context.h"
#include "strata/hashbuffer/build_ldi.h"
#include "strata/hashbuffer/gl/store.h"

namespace strata::gl {

class ComputeRasterizer;

/// Lists computed by the compute rasterizer in a store on the GPU; bit-identical to the CPU's.
class ComputeListSource : public ListSource {
 public:
  ~ComputeListSource() override;

  /// `context` stays current while this is used.
  /// @param store  keeps whole payloads
  /// @param spare  used after the first failure of `store`, such as a list beyond its ages; or null
  /// @param pixels_at_once  approximate; see rows_at_once()
  /// @param execution  lists() uses its stop and its memory limit, which bounds a store
  /// @return kUsage if the driver cannot run it
  [[nodiscard]] static Result<std::unique_ptr<ComputeListSource>> create(
      const Context& context, std::unique_ptr<Store> store, std::unique_ptr<Store> spare = nullptr,
      std::int64_t pixels_at_once = std::int64_t{1} << 22, const Execution& execution = {});

  Result<void> set_mesh(const LatticeMesh& mesh) override;
  Result<LayeredDepthImage> lists(const RasterTarget& target, int v_begin, int v_end) override;
  [[nodiscard]] std::uint64_t crossings() const override { return crossings_; }
  [[nodiscard]] int rows_at_once(const RasterTarget& target) const override;

 protected:
  /// @param execution without its progress, since lists() would report only a part of it
  explicit ComputeListSource(const Execution& execution);
  [[nodiscard]] Result<void> open(const Context& context, std::unique_ptr<Store> store,
                                  std::unique_ptr<Store> spare, std::int64_t pixels_at_once);
  /// The lists of rows [v_begin, v_end) of `target`, which `store` holds. Sets crossings_.
  [[nodiscard]] virtual Result<LayeredDepthImage> read(Store& store, const RasterTarget& target,
                                                       int v_begin, int v_end);
  std::uint64_t crossings_ = 0;
  Execution execution_;

 private:
  std::unique_ptr<ComputeRasterizer> rasterizer_;
  std::unique_ptr<Store> store_, spare_;
  std::int64_t pixels_at_once_ = 0;
};

}  // namespace strata::gl
