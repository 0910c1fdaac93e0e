#include "tests/support/voxel_set.h"

namespace strata::testkit {

VoxelSet set_of(const VoxelIntervals& intervals) {
  const VoxelGrid& grid = intervals.grid();
  const AxisFrame frame(intervals.axis());
  VoxelSet set(grid.dims);
  EXPECT_EQ(intervals.v_begin(), 0);
  EXPECT_EQ(intervals.v_end(), grid.dims[frame.v]);
  bool well_formed = true;
  for (int v = intervals.v_begin(); v < intervals.v_end(); ++v) {
    for (int u = 0; u < intervals.columns(); ++u) {
      int previous_end = -1;
      for (const Interval& interval : intervals.column(u, v)) {
        const bool fits = interval.begin() > previous_end && interval.last >= interval.first &&
                          interval.end() <= grid.dims[frame.w];
        well_formed = well_formed && fits;
        if (!fits) continue;
        previous_end = interval.end();
        glm::ivec3 p{};
        p[frame.u] = u, p[frame.v] = v;
        for (int w = interval.begin(); w < interval.end(); ++w) {
          p[frame.w] = w;
          set.at(p) = 1;
        }
      }
    }
  }
  EXPECT_TRUE(well_formed) << "intervals overlap, touch, or leave the grid";
  return set;
}

}  // namespace strata::testkit
