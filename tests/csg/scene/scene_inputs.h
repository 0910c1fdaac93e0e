#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <string_view>

#include "strata/csg/scene/scene.h"
#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/support/temporary_folder.h"

namespace strata::csg {

/// A folder that goes with the test.
class SceneFiles : public testing::Test {
 protected:
  std::string write(const std::string& name, std::string_view text) {
    return place_.write(name, text);
  }
  std::string write_box(const std::string& name, double size = 2.0) {
    const std::string path = write(name, "");
    EXPECT_TRUE(write_mesh(path, make_box(glm::dvec3(0), glm::dvec3(size))).has_value());
    return path;
  }
  Scene read(const std::string& path, const ReadSceneOptions& options = {}) {
    auto scene = read_scene(path, options);
    EXPECT_TRUE(scene.has_value()) << scene.error().message;
    return scene ? *std::move(scene) : Scene{};
  }
  const testkit::TemporaryFolder place_;
  const std::filesystem::path folder_ = place_.path();
};

}  // namespace strata::csg
