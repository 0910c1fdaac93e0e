#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "strata/mesh/formats/write_mesh.h"
#include "tests/apps/strata/run_tool.h"

namespace strata::testkit {

/// A folder in which `strata voxelize --json` runs.
class VoxelizeFixture : public testing::Test {
 protected:
  void put(const std::string& name, const TriangleSoup& mesh) const {
    const auto written = write_mesh(place.path(name), mesh);
    ASSERT_TRUE(written.has_value()) << written.error().message;
  }

  /// The report of a run that is expected to succeed.
  nlohmann::json report(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "voxelize");
    arguments.push_back("--json");
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    last_error = run.err;
    return nlohmann::json::parse(run.out, nullptr, false);
  }

  static std::vector<std::string> codes(const nlohmann::json& report) {
    std::vector<std::string> result;
    for (const nlohmann::json& warning : report["warnings"]) result.push_back(warning["code"]);
    return result;
  }

  Workplace place;
  mutable std::string last_error;
};

}  // namespace strata::testkit
