// --cubic and --like: grids of a file, turned and mirrored ones too.

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/matrix.hpp>

#include "strata/voxelize/readers/read_voxel_grid.h"
#include "strata/voxelize/readers/read_voxels.h"
#include "tests/apps/strata/voxelize_fixture.h"

namespace strata {
namespace {

using nlohmann::json;
using testkit::RunResult;

/// An L of 4 x 2 x 1 with its foot to the right.
class Like : public testkit::VoxelizeFixture {
 protected:
  void SetUp() override {
    place.write("l.off",
                "OFF\n12 8 0\n0 0 0\n4 0 0\n4 1 0\n1 1 0\n1 2 0\n0 2 0\n0 0 1\n4 0 1\n4 1 1\n1 1 "
                "1\n1 2 1\n0 2 1\n6 5 4 3 2 1 0\n6 6 7 8 9 10 11\n4 0 1 7 6\n4 1 2 8 7\n4 2 3 9 "
                "8\n4 3 4 10 9\n4 4 5 11 10\n4 5 0 6 11\n");
  }
  /// The sides of the L, by coordinates: how far inside a point is, along the nearest axis.
  static double depth(const glm::dvec3& p) {
    const auto box = [&](const glm::dvec3& high) {
      return std::min({p.x, p.y, p.z, high.x - p.x, high.y - p.y, high.z - p.z});
    };
    return std::max(box({4, 1, 1}), box({1, 2, 1}));
  }
  /// A head of a NRRD file without data. @param steps  columns
  void write_head(const std::string& name, const glm::ivec3& dims, const glm::dmat3& steps,
                  const glm::dvec3& first, const std::string& more = "") const {
    std::string text =
        fmt::format("NRRD0004\ntype: uchar\ndimension: 3\n{}sizes: {} {} {}\nspace directions:",
                    more.empty() ? "space dimension: 3\n" : more, dims.x, dims.y, dims.z);
    for (int a = 0; a < 3; ++a) {
      text += fmt::format(" ({},{},{})", steps[a].x, steps[a].y, steps[a].z);
    }
    text += fmt::format("\nspace origin: ({},{},{})\nencoding: raw\ndata file: none.raw\n", first.x,
                        first.y, first.z);
    place.write(name, text);
  }
  static glm::dmat3 turn() {
    const glm::dmat4 one = glm::rotate(glm::dmat4(1), 0.7, glm::normalize(glm::dvec3(1, 2, 3)));
    return glm::dmat3(one);
  }
  /// Voxels that differ from the L at their centres, where that is not on its surface.
  static int wrong(const VoxelVolume& volume, const glm::dmat3& steps, const glm::dvec3& first) {
    int count = 0;
    const glm::ivec3 dims = volume.grid().dims;
    for (int k = 0; k < dims.z; ++k) {
      for (int j = 0; j < dims.y; ++j) {
        for (int i = 0; i < dims.x; ++i) {
          const double inside = depth(first + steps * glm::dvec3(i, j, k));
          if (std::abs(inside) < 1e-3) continue;
          count += volume.set.contains(i, j, k) != (inside > 0);
        }
      }
    }
    return count;
  }

  /// A mirrored, turned grid of unequal voxels that cuts the L off.
  glm::ivec3 dims_{41, 38, 23};
  glm::dmat3 steps_{turn()[0] * -0.11, turn()[1] * 0.09, turn()[2] * 0.1};
  glm::dvec3 first_{3.4, -0.8, 0.1};
};

TEST_F(Like, VoxelsOfATurnedGridAreThoseOfTheFile) {
  write_head("ref.nhdr", dims_, steps_, first_);
  for (const char* name : {"a.npy", "a.npz", "a.nrrd", "a.vti"}) {
    const json found = report({"l.off", "--like", "ref.nhdr", "-o", name});
    EXPECT_EQ(found["grid"]["dims"], (json{41, 38, 23}));
    EXPECT_EQ(found["grid"]["like"], "ref.nhdr");
    EXPECT_EQ(found["input"]["bounds"]["high"], (json{4.0, 2.0, 1.0}));  // of the world
    EXPECT_EQ(found["input"]["volume"], 5.0);
    const auto voxels = read_voxels(place.path(name));
    ASSERT_TRUE(voxels.has_value()) << voxels.error().message;
    EXPECT_EQ(wrong(*voxels, steps_, first_), 0) << name;
    EXPECT_GT(voxels->set.solid_voxels(), 300u);
    const auto grid = read_voxel_grid(place.path(name));
    ASSERT_TRUE(grid.has_value()) << grid.error().message;
    const glm::dmat3 made = grid->frame.steps(grid->grid.voxel_size);
    const glm::dvec3 centre = grid->frame.world(grid->grid.origin + 0.5 * grid->grid.voxel_size);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_LT(glm::distance(made[axis], steps_[axis]), 1e-12) << name;
    }
    EXPECT_LT(glm::distance(centre, first_), 1e-12) << name;
  }
  // A .vdb is the box of its voxels.
  report({"l.off", "--like", "ref.nhdr", "-o", "a.vdb"});
  const auto box = read_voxel_grid(place.path("a.vdb"));
  ASSERT_TRUE(box.has_value()) << box.error().message;
  const auto voxels = read_voxels(place.path("a.vdb"));
  EXPECT_EQ(wrong(*voxels, box->frame.steps(box->grid.voxel_size),
                  box->frame.world(box->grid.origin + 0.5 * box->grid.voxel_size)),
            0);
  EXPECT_LT(glm::distance(box->frame.direction[0], -turn()[0]), 1e-12);
}

TEST_F(Like, AMirroredGridIsExact) {
  // LPS beside RAS: x and y run the other way.
  const glm::dmat3 steps(glm::dvec3(-0.25, 0, 0), glm::dvec3(0, -0.25, 0), glm::dvec3(0, 0, 0.5));
  write_head("ref.nhdr", {20, 12, 4}, steps, {4.875, 2.875, -0.25}, "space: RAS\n");
  const json found = report({"l.off", "--like", "ref.nhdr", "-o", "a.nrrd"});
  EXPECT_EQ(found["voxels"]["volume"], 5.0);
  const auto grid = read_voxel_grid(place.path("a.nrrd"));
  ASSERT_TRUE(grid.has_value());
  EXPECT_EQ(grid->frame.space, "RAS");
  EXPECT_EQ(grid->frame.steps(grid->grid.voxel_size), steps);
  EXPECT_EQ(found["grid"]["direction"],
            (json{{-1.0, 0.0, 0.0}, {0.0, -1.0, 0.0}, {0.0, 0.0, 1.0}}));
}

TEST_F(Like, ScenesExpressionsAndIdsGoAlong) {
  write_head("ref.nhdr", dims_, steps_, first_);
  place.write("l.csg",
              "union() { cube(size = [4, 1, 1], center = false); "
              "cube(size = [1, 2, 1], center = false); }\n");
  report({"l.csg", "--like", "ref.nhdr", "-o", "s.npy"});
  EXPECT_EQ(wrong(*read_voxels(place.path("s.npy")), steps_, first_), 0);
  report({"l.off", "--like", "ref.nhdr", "--ids", "-o", "i.npy"});
  EXPECT_EQ(wrong(*read_voxels(place.path("i.npy")), steps_, first_), 0);
  // Placed before it is turned: twice as large and moved is the L on a grid of half the size.
  write_head("big.nhdr", dims_, steps_ * 2.0, first_ * 2.0 + glm::dvec3(1, 0, 0));
  report({"l.off", "--scale", "2", "--translate", "1,0,0", "--like", "big.nhdr", "-o", "b.npy"});
  EXPECT_EQ(wrong(*read_voxels(place.path("b.npy")), steps_, first_), 0);
}

TEST_F(Like, DistancesToAnExactBoundaryAreOfTheTurnedGrid) {
  place.write("bar.csg", "cube([4, 2, 1]);\n");
  write_head("ref.nhdr", dims_, steps_, first_);
  const json found =
      report({"bar.csg", "--like", "ref.nhdr", "--sdf", "--band", "all", "-o", "a.npy"});
  EXPECT_EQ(found["distances"]["surface"], "boundary");
  const auto values = read_voxels(place.path("a.npy"));
  ASSERT_TRUE(values.has_value()) << values.error().message;
  double worst = 0;
  for (int k = 0; k < dims_.z; ++k) {
    for (int j = 0; j < dims_.y; ++j) {
      for (int i = 0; i < dims_.x; ++i) {
        const glm::dvec3 p = first_ + steps_ * glm::dvec3(i, j, k);
        const glm::dvec3 out = glm::max(-p, p - glm::dvec3(4, 2, 1));
        const double right =
            glm::length(glm::max(out, 0.0)) + std::min(0.0, std::max({out.x, out.y, out.z}));
        worst = std::max(worst, std::abs(values->values.value(i, j, k) - right));
      }
    }
  }
  EXPECT_LT(worst, 0.11 / 256);  // corners are rounded to the lattice
}

TEST_F(Like, APlainGridGivesTheBytesOfTheSameGrid) {
  report({"l.off", "-r", "50", "--padding", "2", "-o", "a.nrrd"});
  report({"l.off", "--like", "a.nrrd", "-o", "b.nrrd"});
  EXPECT_EQ(place.read("a.nrrd"), place.read("b.nrrd"));
  report({"l.off", "--like", "a.nrrd", "-o", "c.npy"});
  const auto grid = read_voxel_grid(place.path("c.npy"));
  ASSERT_TRUE(grid.has_value()) << grid.error().message;
  EXPECT_EQ(grid->grid, read_voxel_grid(place.path("a.nrrd"))->grid);
  report({"l.off", "-r", "8", "-o", "d.npy"});
  EXPECT_FALSE(std::filesystem::exists(place.path("d.npy.json")));  // only where it was asked for
}

TEST_F(Like, AFileWrittenLikeItselfIsTheSame) {
  const std::vector<std::string> plain = {"a.mha",      "a.mhd", "a.nii", "a.nii.gz", "a.nrrd",
                                          "a.nhdr",     "a.vti", "a.vdb", "a.npz",    "a.zarr",
                                          "a.ome.zarr", "a.h5",  "a.tif", "a.raw"};
  const auto expect_same = [&](const std::string& first) {
    const std::string second = "b" + first.substr(1);
    SCOPED_TRACE(first);
    const RunResult run = place.run({"voxelize", "l.off", "--like", first, "-o", second});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const auto before = read_voxel_grid(place.path(first));
    const auto after = read_voxel_grid(place.path(second));
    ASSERT_TRUE(before.has_value() && after.has_value());
    // Turned grids are rounded again: those of a NIfTI to floats.
    const bool rounded = before->frame.turned();
    EXPECT_EQ(before->grid.dims, after->grid.dims);
    for (int axis = 0; axis < 3; ++axis) {
      const double most = !rounded ? 0.0 : first == "a.nii" ? 1e-6 : 1e-14;
      EXPECT_NEAR(before->grid.voxel_size[axis], after->grid.voxel_size[axis], most);
      EXPECT_NEAR(before->grid.origin[axis], after->grid.origin[axis], 10 * most);
      EXPECT_LE(glm::distance(before->frame.direction[axis], after->frame.direction[axis]), most);
    }
    EXPECT_EQ(before->frame.unit_metres, after->frame.unit_metres);
    const auto one = read_voxels(place.path(first)), other = read_voxels(place.path(second));
    ASSERT_TRUE(one.has_value() && other.has_value());
    EXPECT_GT(one->set.solid_voxels(), 100u);
    EXPECT_EQ(one->set.solid_voxels(), other->set.solid_voxels());
    // Heads that name another file, and a .vdb, which is the box of its voxels, have other bytes.
    const bool others =
        rounded || first.ends_with(".mhd") || first.ends_with(".nhdr") || first.ends_with(".vdb");
    if (!others && !std::filesystem::is_directory(place.path(first))) {
      EXPECT_TRUE(place.read(first) == place.read(second));
    }
  };
  const auto made = [&](const std::string& name, std::vector<std::string> how) {
    how.insert(how.begin(), {"voxelize", "l.off", "-o", name});
    const RunResult run = place.run(how);
    const bool missing = run.exit_code == 2 && run.err.find("h5") != std::string::npos;
    EXPECT_TRUE(run.exit_code == 0 || missing) << name << run.err;
    return run.exit_code == 0;
  };
  const std::vector<std::string> sized = {"--voxel-size",   "0.21,0.13,0.17", "--origin",
                                          "-0.3,-0.1,-0.7", "--unit",         "cm"};
  for (const std::string& name : plain) {
    if (made(name, sized)) expect_same(name);
  }
  // Turned and mirrored, as programs of medicine have it: in LPS, in RAS, in no named space.
  for (const char* space : {"space: LPS\n", "space: RAS\n", ""}) {
    write_head("ref.nhdr", dims_, steps_, first_, space);
    for (const char* name : {"a.mha", "a.nii", "a.nrrd", "a.vti", "a.npz", "a.h5", "a.tif"}) {
      // A NIfTI is in RAS, a MetaImage in LPS, and the mesh is not flipped.
      const std::string other = std::string(name) == "a.nii"   ? "space: LPS\n"
                                : std::string(name) == "a.mha" ? "space: RAS\n"
                                                               : "none";
      if (space == other) continue;
      if (made(name, {"--like", "ref.nhdr"})) expect_same(name);
    }
  }
}

TEST_F(Like, FormatsThatCannotHoldATurnAreRefusedBeforeTheWork) {
  write_head("ref.nhdr", dims_, steps_, first_);
  for (const char* name : {"a.binvox", "a.vox", "slices/"}) {
    const RunResult run = place.run({"voxelize", "l.off", "--like", "ref.nhdr", "-o", name});
    EXPECT_EQ(run.exit_code, 2) << name;
    EXPECT_NE(run.err.find("cannot store a grid that is turned in the world; vdb, npy, npz, nrrd"),
              std::string::npos)
        << run.err;
  }
}

TEST_F(Like, MistakesAreNamed) {
  write_head("ref.nhdr", dims_, steps_, first_,
             "space dimension: 3\nspace units: \"mm\" \"mm\" \"mm\"\n");
  const auto refuses = [&](const std::vector<std::string>& options, int code,
                           const std::string& text) {
    std::vector<std::string> arguments = {"voxelize", "l.off"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, code) << run.err;
    EXPECT_NE(run.err.find(text), std::string::npos) << run.err;
  };
  refuses({"--like", "ref.nhdr", "-r", "8"}, 2,
          "only one of -r, --voxel-size, --grid, --cubic and --like can be given, got -r, --like");
  refuses({"--like", "ref.nhdr", "--padding", "1"}, 2, "--padding cannot be combined with it");
  refuses({"--like", "ref.nhdr", "--unit", "in"}, 2,
          "--unit in contradicts --like ref.nhdr, whose numbers are in mm");
  refuses({"--like", "none.nhdr"}, 3, "--like none.nhdr");
  refuses({"--like", "x.ply"}, 2,
          "--like x.ply: a grid is read from .nrrd, .nhdr, .mha, .mhd, .nii, .nii.gz, .h5, .vdb");
  refuses({"--like", "ref.nhdr", "-o", "ref.nhdr", "--format", "nrrd"}, 2, "ref.nhdr");
  refuses({"--cubic", "0"}, 2, "a cubic grid must have at least 1 voxel a side, got 0");
  refuses({"--cubic", "70000"}, 6, "at most 65536 voxels a side, got 70000");
  refuses({"--cubic", "8", "--origin", "0,0,0"}, 2, "an origin cannot be combined with it");
  refuses({"--cubic", "4", "--padding", "2"}, 2, "are all padding");
  refuses({"--cubic", "x"}, 2, "--cubic");
}

TEST_F(Like, ACubeHasTheMeshInItsMiddle) {
  const json found = report({"l.off", "--cubic", "16"});
  EXPECT_EQ(found["grid"]["dims"], (json{16, 16, 16}));
  EXPECT_EQ(found["grid"]["voxel_size"], (json{0.25, 0.25, 0.25}));
  EXPECT_EQ(found["grid"]["origin"], (json{0.0, -1.0, -1.5}));
  EXPECT_EQ(found["voxels"]["volume"], 5.0);
  const json padded = report({"l.off", "--cubic", "20", "--padding", "2"});
  EXPECT_EQ(padded["grid"]["voxel_size"], (json{0.25, 0.25, 0.25}));
  EXPECT_EQ(padded["grid"]["origin"], (json{-0.5, -1.5, -2.0}));
  const json boxed = report({"l.off", "--cubic", "8", "--bounds", "0,0,0,8,8,1"});
  EXPECT_EQ(boxed["grid"]["origin"], (json{0.0, 0.0, -3.5}));
}

}  // namespace
}  // namespace strata
