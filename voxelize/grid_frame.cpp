#include "strata/voxelize/grid_frame.h"

namespace strata {

Bounds GridFrame::world_box(const Bounds& box) const {
  if (!turned()) return box;
  Bounds around;
  for (int corner = 0; corner < 8; ++corner) {
    around.include(world({(corner & 1) != 0 ? box.high.x : box.low.x,
                          (corner & 2) != 0 ? box.high.y : box.low.y,
                          (corner & 4) != 0 ? box.high.z : box.low.z}));
  }
  return around;
}

}  // namespace strata
