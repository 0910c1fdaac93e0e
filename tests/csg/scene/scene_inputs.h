#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "strata/csg/scene/scene.h"
#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"

namespace strata::csg {

/// A folder that goes with the test.
class SceneFiles : public testing::Test {
 protected:
  SceneFiles() {
    std::string name = (std::filesystem::temp_directory_path() / "strata-scene-XXXXXX").string();
    if (::mkdtemp(name.data())) folder_ = name;
  }
  ~SceneFiles() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  std::string write(const std::string& name, std::string_view text) {
    const std::filesystem::path path = folder_ / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << text;
    return path.string();
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
  std::filesystem::path folder_;
};

}  // namespace strata::csg
