// Lists that come from elsewhere are taken as the tiles' own are.

#include "strata/hashbuffer/build_ldi.h"

#include <gtest/gtest.h>

#include "strata/mesh/shapes.h"
#include "strata/voxelize/voxelize.h"
#include "tests/support/reference_lists.h"
#include "tests/support/trouble.h"

namespace strata {
namespace {

/// The CPU's lists, some rows at a time.
class RowsOfTheCpu final : public ListSource {
 public:
  explicit RowsOfTheCpu(int rows) : rows_(rows) {}
  Result<void> set_mesh(const LatticeMesh& mesh) override {
    mesh_ = &mesh;
    filter_ = nullptr;
    return {};
  }
  bool use_filter(const TileListFilter& filter) override {
    if (filters) filter_ = &filter;
    return filters;
  }
  Result<LayeredDepthImage> lists(const RasterTarget& target, int v_begin, int v_end) override {
    asked += v_end - v_begin;
    if (v_end > fails_from) return fail(ErrorCode::kLimit, "no more");
    const auto whole = build_ldi(*mesh_, target);
    if (!whole) return whole;
    LayeredDepthImage part;
    part.width = target.width;
    part.height = v_end - v_begin;
    part.depth_limit = target.depth_limit;
    part.offsets.assign(1, 0);
    for (int v = v_begin; v < v_end; ++v) {
      for (int u = 0; u < target.width; ++u) {
        const auto list = whole->list(u, v);
        part.items.insert(part.items.end(), list.begin(), list.end());
        part.offsets.push_back(part.items.size());
      }
    }
    crossings_ = part.items.size();
    if (filter_ != nullptr) return filter_lists(part, *filter_);
    return part;
  }
  std::uint64_t crossings() const override { return crossings_; }
  int rows_at_once(const RasterTarget&) const override { return rows_; }

  bool filters = false;
  int asked = 0;
  int fails_from = 1 << 30;  ///< row

 private:
  const LatticeMesh* mesh_ = nullptr;
  const TileListFilter* filter_ = nullptr;
  int rows_;
  std::uint64_t crossings_ = 0;
};

/// Keeps the crossings of even triangles.
class EvenTriangles final : public TileListFilter {
 public:
  class Even final : public Worker {
   public:
    TileLists<DepthItem> apply(const TileLists<DepthItem>& lists) override {
      offsets_.assign(1, 0);
      keys_.clear();
      for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
        for_each_item(lists, pixel, [this](DepthItem item) {
          if (item.triangle() % 2 == 0) keys_.push_back(item);
        });
        offsets_.push_back(static_cast<std::uint32_t>(keys_.size()));
      }
      TileLists<DepthItem> result;
      result.row_end = kTileSide;
      result.fragments = keys_.size();
      result.offsets = offsets_.data();
      result.keys = keys_.data();
      return result;
    }

   private:
    std::vector<std::uint32_t> offsets_;
    std::vector<DepthItem> keys_;
  };
  std::unique_ptr<Worker> worker() const override { return std::make_unique<Even>(); }
};

TEST(ListSource, GivesTheImageThatTheTilesGive) {
  const TriangleSoup soup = make_torus_knot(2, 3, 0.4, 40, 10);
  const EvenTriangles filter;
  for (const int resolution : {1, 63, 64, 150}) {
    const VoxelGrid grid = testkit::grid_around(soup, resolution);
    const auto mesh = snap_to_lattice(soup, grid);
    ASSERT_TRUE(mesh);
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      const RasterTarget target = raster_target(grid, axis);
      for (const TileListFilter* chosen : {static_cast<const TileListFilter*>(nullptr),
                                           static_cast<const TileListFilter*>(&filter)}) {
        const auto expected = build_ldi(*mesh, target, {}, {}, chosen);
        for (const bool filters : {false, true}) {
          RowsOfTheCpu source(64);
          source.filters = filters;
          const auto found = build_ldi(source, *mesh, target, {}, chosen);
          ASSERT_TRUE(expected && found);
          EXPECT_TRUE(*found == *expected) << resolution;
          EXPECT_EQ(source.asked, target.height);
        }
      }
    }
  }
}

TEST(ListSource, GivesTheVoxelsThatTheTilesGive) {
  TriangleSoup open = make_icosphere(1.0, 3);
  open.triangles.resize(open.triangles.size() - 40);
  for (const bool closed : {true, false}) {
    const TriangleSoup soup = closed ? make_torus(1.0, 0.4, 30, 20) : open;
    const VoxelGrid grid = testkit::grid_around(soup, 140, 2);
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      VoxelizeOptions options;
      options.axis = axis;
      options.closedness = closed ? Closedness::kCheck : Closedness::kAssumeOpen;
      options.statistics = true;
      VoxelizeReport expected, found;
      ASSERT_TRUE(voxelize(soup, grid, options, {}, &expected));
      RowsOfTheCpu source(64);
      options.source = &source;
      ASSERT_TRUE(voxelize(soup, grid, options, {}, &found));
      EXPECT_GT(found.solid_voxels, 0u);
      EXPECT_EQ(found.checksum, expected.checksum);
      EXPECT_EQ(found.crossings, expected.crossings);
      EXPECT_EQ(found.depth_histogram, expected.depth_histogram);
      EXPECT_EQ(found.unbalanced_columns, expected.unbalanced_columns);
    }
  }
}

TEST(ListSource, ThatFiltersGivesTheVoxelsAndTheReportOfTheTiles) {
  const TriangleSoup soup = make_torus_knot(2, 3, 0.4, 40, 10);
  const VoxelGrid grid = testkit::grid_around(soup, 140, 2);
  const EvenTriangles filter;
  VoxelizeOptions options;
  options.rule = InsideRule::kParity;
  options.statistics = true;
  options.filter = &filter;
  VoxelizeReport expected;
  ASSERT_TRUE(voxelize(soup, grid, options, {}, &expected));
  for (const bool filters : {false, true}) {
    for (const int fails_from : {64, 1 << 30}) {
      RowsOfTheCpu source(64);
      source.filters = filters;
      source.fails_from = fails_from;
      ListSourceOrCpu both(source, {}, [](const Error&) {});
      options.source = &both;
      VoxelizeReport found;
      ASSERT_TRUE(voxelize(soup, grid, options, {}, &found));
      EXPECT_EQ(found.checksum, expected.checksum);
      EXPECT_EQ(found.crossings, expected.crossings);
      EXPECT_EQ(found.depth_histogram, expected.depth_histogram);
    }
  }
}

TEST(ListSource, ThatFailsHalfWayIsFollowedByTheCpu) {
  const TriangleSoup soup = make_torus_knot(2, 3, 0.4, 40, 10);
  const VoxelGrid grid = testkit::grid_around(soup, 200);
  const auto mesh = snap_to_lattice(soup, grid);
  ASSERT_TRUE(mesh);
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    const RasterTarget target = raster_target(grid, axis);
    const auto expected = build_ldi(*mesh, target);
    for (const int fails_from : {0, 64, 1 << 30}) {
      RowsOfTheCpu source(64);
      source.fails_from = fails_from;
      int failures = 0;
      ListSourceOrCpu both(source, {}, [&failures](const Error&) { ++failures; });
      const auto found = build_ldi(both, *mesh, target);
      ASSERT_TRUE(expected && found);
      EXPECT_TRUE(*found == *expected);
      EXPECT_EQ(failures, target.height > fails_from ? 1 : 0);
    }
  }
}

}  // namespace
}  // namespace strata
