// The memory that is expected, against that which was taken.

#include <gtest/gtest.h>

#include "strata/mesh/shapes.h"
#include "tests/apps/strata/voxelize_fixture.h"
#include "tests/support/sanitized.h"

namespace strata {
namespace {

class MemoryEstimates : public testkit::VoxelizeFixture {};

TEST_F(MemoryEstimates, ThePeakIsWithinAFactorOfTwo) {
  if (testkit::kSanitized) GTEST_SKIP() << "sanitizers hold memory that was given back";
  put("knot.obj", make_torus_knot(2, 3, 0.4, 96, 16));
  put("fine.stl", make_torus_knot(2, 3, 0.4, 2048, 128));  // half a million triangles
  for (const char* mesh : {"knot.obj", "fine.stl"}) {
    for (const char* side : {"64", "512", "1500"}) {
      for (const std::vector<std::string>& way :
           std::vector<std::vector<std::string>>{{"-o", "a.vdb"},
                                                 {"-o", "a.npz"},
                                                 {"--surface", "-o", "a.vdb"},
                                                 {"--surface", "--colours", "-o", "a.vdb"},
                                                 {"--surface", "--colours", "-o", "a.vox"},
                                                 {"--stats"}}) {
        std::vector<std::string> arguments = {mesh, "-r", side, "-j", "2"};
        arguments.insert(arguments.end(), way.begin(), way.end());
        const nlohmann::json memory = report(arguments)["memory"];
        const double ratio =
            memory["peak_bytes"].get<double>() / memory["estimated_bytes"].get<double>();
        EXPECT_GT(ratio, 0.5) << mesh << " -r " << side << " " << way.back() << memory;
        EXPECT_LT(ratio, 2.0) << mesh << " -r " << side << " " << way.back() << memory;
      }
    }
  }
}

}  // namespace
}  // namespace strata
