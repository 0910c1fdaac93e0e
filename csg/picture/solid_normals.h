#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "csg/geometry.h"
#include "csg/picture/corner_normals.h"
#include "strata/core/execution.h"

namespace strata::csg {

/// The normals of the solids that pictures have shown so far. Private to csg/.
class SolidNormals {
 public:
  explicit SolidNormals(const Geometry& geometry)
      : geometry_(&geometry), normals_(geometry.parts().size()) {}

  /// Makes those of the solids that are marked, with all threads. Another crease than before begins
  /// anew. @param crease  degrees; 0: all are flat
  void make(std::span<const std::uint8_t> seen, double crease, const Execution& execution);
  /// A solid was moved: its normals are made again. @param others  all are
  void forget(std::uint32_t solid, bool others);

  [[nodiscard]] bool empty() const { return !(crease_ > 0); }  ///< all are flat
  /// Null of solids that the last make() did not ask for: a picture does not depend on others that
  /// were drawn before.
  [[nodiscard]] const CornerNormals* of(std::uint32_t solid) const {
    return solid < seen_.size() && seen_[solid] != 0 ? normals_[solid].get() : nullptr;
  }

 private:
  const Geometry* geometry_;
  double crease_ = 0.0;
  std::vector<std::uint8_t> seen_;
  std::vector<std::unique_ptr<CornerNormals>> normals_;
};

}  // namespace strata::csg
