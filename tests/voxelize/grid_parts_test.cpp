// A grid that is made in parts, as several processes do, is the grid made whole.

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "strata/mesh/shapes.h"
#include "strata/voxelize/area/boundary_area.h"
#include "strata/voxelize/checksum.h"
#include "strata/voxelize/voxelize.h"

namespace strata {
namespace {

struct GridPartsCase {
  std::string name;
  VoxelizeOptions options;
  bool open = false;
};

std::vector<GridPartsCase> grid_parts_cases() {
  std::vector<GridPartsCase> cases(6);
  cases[0].name = "solid";
  cases[1].name = "surface", cases[1].options.surface = true, cases[1].options.solid = false;
  cases[2].name = "both", cases[2].options.surface = true;
  cases[3].name = "samples", cases[3].options.samples = 2;
  cases[4].name = "rays", cases[4].options.rays = 2;
  cases[5].name = "open", cases[5].open = true;
  for (GridPartsCase& one : cases) one.options.statistics = true;
  return cases;
}

/// All that one process, or one of several, knows of its rows.
struct Made {
  VoxelizeReport report;
  std::map<int, std::vector<std::vector<std::uint32_t>>> rows;  ///< v: begin, end, label ... by u
  std::uint64_t faces[3];
  std::vector<BoundaryArea::Seam> seams;
};

Made make_rows(const TriangleSoup& mesh, const VoxelGrid& grid, const VoxelizeOptions& options) {
  Made made;
  BoundaryArea area(grid, options.axis);
  Execution execution;
  execution.threads = 2;
  execution.memory_limit = 1 << 20;  // several slabs
  const auto report =
      voxelize_slabs(mesh, grid, options, execution, [&](const VoxelIntervals& slab) {
        area.add(slab, execution);
        for (int v = slab.v_begin(); v < slab.v_end(); ++v) {
          auto& row = made.rows[v];
          row.resize(static_cast<std::size_t>(slab.columns()));
          for (int u = 0; u < slab.columns(); ++u) {
            auto& column = row[static_cast<std::size_t>(u)];
            for_each_labelled(slab, u, v, [&](const Interval& interval, std::uint32_t label) {
              column.insert(column.end(), {static_cast<std::uint32_t>(interval.begin()),
                                           static_cast<std::uint32_t>(interval.end()), label});
            });
          }
        }
        return Result<void>();
      });
  EXPECT_TRUE(report.has_value()) << report.error().message;
  if (!report) return made;
  made.report = *report;
  made.seams = area.take_seams();
  for (int axis = 0; axis < 3; ++axis) made.faces[axis] = area.faces()[axis];
  return made;
}

struct GridParts : ::testing::TestWithParam<GridPartsCase> {
  void SetUp() override {
    mesh = make_torus_knot(2, 3, 0.4, 60, 12);
    if (GetParam().open) mesh.triangles.resize(mesh.triangles.size() - 40);
    grid = {{150, 170, 200}, {-3.3, -3.3, -1.6}, {0.043, 0.039, 0.0161}};
  }
  TriangleSoup mesh;
  VoxelGrid grid;
};

/// Adds the numbers of `parts` and holds them to those of the whole.
void expect_sum(const VoxelGrid& grid, Axis axis, const Made& whole, std::vector<Made> parts) {
  SetChecksum checksum(grid);
  BoundaryArea area(grid, axis);
  VoxelizeReport sum;
  std::map<int, std::vector<std::vector<std::uint32_t>>> rows;
  for (Made& part : parts) {
    checksum.add_sum(part.report.checksum_sum);
    area.add(part.faces, std::move(part.seams));
    sum.solid_voxels += part.report.solid_voxels;
    sum.intervals += part.report.intervals;
    sum.crossings += part.report.crossings;
    sum.filled_steps += part.report.filled_steps;
    sum.unbalanced_columns += part.report.unbalanced_columns;
    for (std::size_t i = 0; i < 65; ++i) sum.depth_histogram[i] += part.report.depth_histogram[i];
    for (auto& [v, row] : part.rows) EXPECT_TRUE(rows.emplace(v, row).second) << v;
  }
  EXPECT_EQ(rows == whole.rows, true);
  EXPECT_GT(whole.report.solid_voxels, 10000u);
  EXPECT_EQ(sum.solid_voxels, whole.report.solid_voxels);
  EXPECT_EQ(sum.intervals, whole.report.intervals);
  EXPECT_EQ(sum.crossings, whole.report.crossings);
  EXPECT_EQ(sum.filled_steps, whole.report.filled_steps);
  EXPECT_EQ(sum.unbalanced_columns, whole.report.unbalanced_columns);
  EXPECT_EQ(sum.depth_histogram, whole.report.depth_histogram);
  EXPECT_EQ(checksum.value(), whole.report.checksum);
  EXPECT_TRUE(area.take_seams().empty());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(area.faces()[i], whole.faces[i]) << i;
}

TEST_P(GridParts, AddUpToTheWhole) {
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    VoxelizeOptions options = GetParam().options;
    options.axis = axis;
    const int end = grid.dims[AxisFrame(axis).v];
    const Made whole = make_rows(mesh, grid, options);
    std::vector<Made> parts;
    for (const VoxelRows& rows : {VoxelRows{128, end}, {0, 64}, {64, 128}}) {
      options.rows = rows;
      parts.push_back(make_rows(mesh, grid, options));
      EXPECT_EQ(parts.back().rows.begin()->first, rows.begin);
      EXPECT_EQ(parts.back().rows.rbegin()->first, rows.end - 1);
    }
    expect_sum(grid, axis, whole, std::move(parts));
  }
}

TEST_P(GridParts, MayBeTakenInTurns) {
  VoxelizeOptions options = GetParam().options;
  options.axis = Axis::kX;
  const Made whole = make_rows(mesh, grid, options);
  std::vector<Made> parts;
  for (const std::vector<VoxelRows>& turns :
       {std::vector<VoxelRows>{{0, 64}, {128, 192}}, {{64, 128}, {192, 200}}, {}}) {
    std::size_t next = 0;
    options.next_rows = [&]() -> std::optional<VoxelRows> {
      return next < turns.size() ? std::optional(turns[next++]) : std::nullopt;
    };
    parts.push_back(make_rows(mesh, grid, options));
  }
  expect_sum(grid, Axis::kX, whole, std::move(parts));
}

INSTANTIATE_TEST_SUITE_P(Options, GridParts, ::testing::ValuesIn(grid_parts_cases()),
                         [](const auto& each) { return each.param.name; });

TEST(GridPartsRows, AreWholeTilesOfTheGrid) {
  const TriangleSoup box = make_box({0, 0, 0}, {1, 1, 1});
  const VoxelGrid grid{{100, 100, 100}, {0, 0, 0}, {0.01, 0.01, 0.01}};
  for (const VoxelRows& rows :
       {VoxelRows{1, 64}, {0, 63}, {64, 64}, {0, 128}, {-64, 64}, {128, 192}, {64, 0}}) {
    VoxelizeOptions options;
    options.rows = rows;
    const auto made = voxelize(box, grid, options);
    ASSERT_FALSE(made.has_value()) << rows.begin << " " << rows.end;
    EXPECT_EQ(made.error().code, ErrorCode::kUsage);
  }
}

}  // namespace
}  // namespace strata
