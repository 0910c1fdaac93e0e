#include "mesh/gltf/read_gltf.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "strata/mesh/diagnose.h"
#include "tests/mesh/gltf/glb_files.h"

namespace strata {
namespace {

using namespace testing_gltf;

const std::vector<float> kTetraCorners = {0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1};

TEST(Gltf, ACubeWhoseCornersAreSplitAtItsEdgesIsClosed) {
  const GltfModel model = read(cube_glb("{\"mesh\":0}"));
  EXPECT_EQ(model.soup.positions.size(), 24u);
  EXPECT_EQ(model.soup.triangles.size(), 12u);
  EXPECT_TRUE(is_closed(model.soup));
  EXPECT_EQ(volume_of(model.soup), 1.0);
  expect_box(model.soup, {0, 0, 0}, {1, 1, 1});
}

TEST(Gltf, NodesTurnScaleAndMoveInThisOrder) {
  const GltfModel model =
      read(cube_glb("{\"mesh\":0,\"translation\":[1,2,3],\"rotation\":[0,0,0.70710678,0.70710678],"
                    "\"scale\":[2,3,4]}"));
  EXPECT_TRUE(is_closed(model.soup));
  EXPECT_NEAR(volume_of(model.soup), 24, 1e-9);
  expect_box(model.soup, {-2, 2, 3}, {1, 4, 7});
}

TEST(Gltf, MatricesAreByColumnsAndThoseOfParentsComeAfter) {
  const GltfModel model =
      read(cube_glb("{\"children\":[1],\"matrix\":[0,2,0,0,-2,0,0,0,0,0,2,0,10,0,0,1]},"
                    "{\"mesh\":0,\"translation\":[1,0,0]}"));
  // x of the child goes to y: 1 to 2, doubled
  expect_box(model.soup, {8, 2, 0}, {10, 4, 2});
  EXPECT_NEAR(volume_of(model.soup), 8, 1e-12);
}

TEST(Gltf, MirroredNodesStayOutward) {
  for (const char* node : {"{\"mesh\":0,\"scale\":[-1,1,1]}",
                           "{\"mesh\":0,\"matrix\":[0,1,0,0,1,0,0,0,0,0,1,0,0,0,0,1]}"}) {
    const GltfModel model = read(cube_glb(node));
    EXPECT_TRUE(is_closed(model.soup));
    EXPECT_EQ(volume_of(model.soup), 1.0) << node;
  }
}

TEST(Gltf, TheSceneOfTheFileIsReadElseTheFirstElseAllRoots) {
  const std::string nodes =
      "{\"mesh\":0},{\"mesh\":0,\"translation\":[5,0,0]},{\"mesh\":0,\"translation\":[0,7,0]}";
  const std::string scenes = ",\"scenes\":[{\"nodes\":[0]},{\"nodes\":[1,2]}]";
  const GltfModel second = read(cube_glb(nodes, scenes + ",\"scene\":1"));
  expect_box(second.soup, {0, 0, 0}, {6, 8, 1});
  EXPECT_EQ(second.soup.triangles.size(), 24u);
  ASSERT_EQ(second.warnings.size(), 1u);
  EXPECT_EQ(second.warnings[0], "file.glb: it has 2 scenes; scene 1 is read");
  expect_box(read(cube_glb(nodes, scenes)).soup, {0, 0, 0}, {1, 1, 1});
  EXPECT_EQ(read(cube_glb(nodes)).soup.triangles.size(), 36u);
  // a scene that names a child too has it once
  EXPECT_EQ(read(cube_glb("{\"children\":[1]},{\"mesh\":0}", ",\"scenes\":[{\"nodes\":[1,0]}]"))
                .soup.triangles.size(),
            12u);
}

TEST(Gltf, NodesAreNestedWithoutALimit) {
  constexpr int kDepth = 100000;
  std::string nodes;
  for (int i = 0; i < kDepth; ++i) {
    nodes += fmt::format("{{\"children\":[{}],\"translation\":[0,0,1]}},", i + 1);
  }
  expect_box(read(cube_glb(nodes + "{\"mesh\":0}")).soup, {0, 0, kDepth}, {1, 1, kDepth + 1});
}

TEST(Gltf, PartsAreNodesNamedByTheNodeElseTheMesh) {
  const GltfModel model = read(cube_glb("{\"mesh\":0,\"name\":\"a\"},{\"name\":\"empty\"},"
                                        "{\"mesh\":0,\"name\":\"a\",\"translation\":[3,0,0]},"
                                        "{\"mesh\":0,\"translation\":[6,0,0]}"),
                               {.parts = true});
  const MeshAttributes& attributes = model.attributes;
  ASSERT_EQ(attributes.parts.size(), 3u);
  EXPECT_EQ(attributes.parts[0].name, "a");
  EXPECT_EQ(attributes.parts[1].name, "a (2)");
  EXPECT_EQ(attributes.parts[2].name, "cube");
  EXPECT_EQ(attributes.part_of(11), 0u);
  EXPECT_EQ(attributes.part_of(12), 1u);
  EXPECT_EQ(attributes.part_of(35), 2u);
  EXPECT_TRUE(is_closed(model.soup));
}

TEST(Gltf, NodesWithoutANameAreNumbered) {
  GltfText text;
  text.list(cube_corners(), 3);
  text.list(cube_indices<std::uint8_t>(), 1);
  const GltfModel model = read(
      text.glb("\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
               "\"nodes\":[{},{\"mesh\":0}]"));
  ASSERT_EQ(model.attributes.parts.size(), 1u);
  EXPECT_EQ(model.attributes.parts[0].name, "node 1");
  EXPECT_EQ(volume_of(model.soup), 1.0);
}

TEST(Gltf, InstancesOfTheGpuAreOnePart) {
  GltfText text;
  text.list(cube_corners(), 3);
  text.list(cube_indices<std::uint32_t>(), 1);
  text.list(std::vector<float>{0, 0, 0, 10, 0, 0}, 3);
  text.list(std::vector<float>{1, 1, 1, 1, 2, -3}, 3);
  text.list(std::vector<std::int8_t>{0, 0, 0, 127, 127, 0, 0, 0}, 4, ",\"normalized\":true");
  const GltfModel model = read(
      text.glb("\"extensionsRequired\":[\"EXT_mesh_gpu_instancing\"],"
               "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
               "\"nodes\":[{\"mesh\":0,\"translation\":[0,100,0],\"extensions\":{\"EXT_mesh_gpu_"
               "instancing\":"
               "{\"attributes\":{\"TRANSLATION\":2,\"SCALE\":3,\"ROTATION\":4}}}}]"));
  EXPECT_EQ(model.attributes.parts.size(), 1u);
  EXPECT_NEAR(volume_of(model.soup), 7, 1e-12);
  // the second is turned by half a turn about x: y and z change their signs
  expect_box(model.soup, {0, 98, 0}, {11, 101, 3});
}

TEST(Gltf, StripsFansAndTrianglesWithoutIndices) {
  GltfText text;
  text.list(kTetraCorners, 3);
  text.list(std::vector<std::uint8_t>{0, 1, 2, 3, 0, 1}, 1);
  const std::string strip = text.glb(
      "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1,\"mode\":5}]}],"
      "\"nodes\":[{\"mesh\":0}]");
  EXPECT_EQ(read(strip).soup.triangles.size(), 4u);
  EXPECT_TRUE(is_closed(read(strip).soup));
  EXPECT_NEAR(volume_of(read(strip).soup), 1.0 / 6, 1e-12);

  text.list(std::vector<std::uint16_t>{3, 0, 2, 1, 0}, 1);
  text.list(std::vector<float>{0, 0, 0, 0, 1, 0, 1, 0, 0}, 3);
  text.list(std::vector<std::uint32_t>{0, 1, 2}, 1);
  const GltfModel fan = read(text.glb(
      "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":2,\"mode\":6},"
      "{\"attributes\":{\"POSITION\":3}},"
      "{\"attributes\":{\"POSITION\":0},\"mode\":0},{\"attributes\":{\"POSITION\":0},\"mode\":1},"
      "{\"attributes\":{\"POSITION\":0},\"mode\":3,\"indices\":4}]}],\"nodes\":[{\"mesh\":0}]"));
  EXPECT_EQ(fan.soup.triangles.size(), 4u);
  EXPECT_TRUE(is_closed(fan.soup));
  EXPECT_NEAR(volume_of(fan.soup), 1.0 / 6, 1e-12);
  EXPECT_EQ(fan.ignored, 4u + 2u + 2u);  // points, lines, a strip of lines
}

TEST(Gltf, PrimitivesThatShareVerticesHaveThemOnceAndOthersAreLeftOut) {
  GltfText text;
  std::vector<float> corners(3000, 7.5f);  // not used
  const std::vector<float> cube = cube_corners();
  corners.insert(corners.end(), cube.begin(), cube.end());
  text.list(corners, 3);
  std::vector<std::uint16_t> indices = cube_indices<std::uint16_t>();
  for (std::uint16_t& index : indices) index = static_cast<std::uint16_t>(index + 1000);
  text.list(std::vector<std::uint16_t>(indices.begin(), indices.begin() + 18), 1);
  text.list(std::vector<std::uint16_t>(indices.begin() + 18, indices.end()), 1);
  const GltfModel model =
      read(text.glb("\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1},"
                    "{\"attributes\":{\"POSITION\":0},\"indices\":2}]}],\"nodes\":[{\"mesh\":0}]"));
  EXPECT_EQ(model.soup.positions.size(), 24u);
  EXPECT_EQ(volume_of(model.soup), 1.0);
}

TEST(Gltf, AFewVerticesOfManyAreFoundToo) {
  GltfText text;
  std::vector<float> corners = {0, 0, 0};
  corners.resize(30000, 7.5f);
  corners.insert(corners.end(), {0, 1, 0, 1, 0, 0, 0, 0, 1});
  text.list(corners, 3);
  text.list(std::vector<std::uint32_t>{0, 10000, 10001, 0, 10002, 10000, 0, 10001, 10002, 10000,
                                       10002, 10001},
            1);
  const GltfModel model = read(
      text.glb("\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
               "\"nodes\":[{\"mesh\":0}]"));
  EXPECT_EQ(model.soup.positions.size(), 4u);
  EXPECT_NEAR(volume_of(model.soup), 1.0 / 6, 1e-12);
}

TEST(Gltf, QuantizedPositions) {
  // numbers as they are, and as shares of 32767; 8 bytes from vertex to vertex
  for (const bool normalized : {false, true}) {
    GltfText text;
    std::vector<std::int16_t> corners;
    const std::vector<float> cube = cube_corners();
    for (std::size_t i = 0; i < cube.size(); ++i) {
      corners.push_back(static_cast<std::int16_t>(cube[i] * 32767));
      if (i % 3 == 2) corners.push_back(99);
    }
    const int view = text.view(bytes_of(corners), ",\"byteStride\":8");
    text.accessor(fmt::format("\"bufferView\":{},\"normalized\":{}", view, normalized), 5122, 24,
                  "VEC3");
    text.list(cube_indices<std::uint16_t>(), 1);
    const double side = normalized ? 1 : 32767;
    const GltfModel model = read(
        text.glb("\"extensionsRequired\":[\"KHR_mesh_quantization\"],"
                 "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
                 "\"nodes\":[{\"mesh\":0}]"));
    EXPECT_TRUE(is_closed(model.soup));
    EXPECT_EQ(volume_of(model.soup), side * side * side);
  }
  GltfText text;
  text.list(std::vector<std::int8_t>{-128, 0, 0, 127, 0, 0, 0, -127, 127}, 3,
            ",\"normalized\":true");
  const GltfModel model =
      read(text.glb("\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
                    "\"nodes\":[{\"mesh\":0}]"));
  EXPECT_EQ(model.soup.positions, (std::vector<glm::dvec3>{{-1, 0, 0}, {1, 0, 0}, {0, -1, 1}}));
}

TEST(Gltf, SparseValuesReplaceOthersOrZeros) {
  for (const bool base : {true, false}) {
    GltfText text;
    std::vector<float> corners = base ? kTetraCorners : std::vector<float>(12, 0.0f);
    const int positions = text.view(bytes_of(corners));
    const int places = text.view(bytes_of(std::vector<std::uint8_t>{1, 2, 3}));
    const int values = text.view(bytes_of(std::vector<float>{0, 2, 0, 2, 0, 0, 0, 0, 2}));
    text.accessor((base ? fmt::format("\"bufferView\":{},", positions) : "") +
                      fmt::format("\"sparse\":{{\"count\":3,\"indices\":{{\"bufferView\":{},"
                                  "\"componentType\":5121}},\"values\":{{\"bufferView\":{}}}}}",
                                  places, values),
                  5126, 4, "VEC3");
    text.list(std::vector<std::uint8_t>{0, 1, 2, 3, 0, 1}, 1);
    const GltfModel model =
        read(text.glb("\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1,"
                      "\"mode\":5}]}],\"nodes\":[{\"mesh\":0}]"));
    EXPECT_NEAR(volume_of(model.soup), 8.0 / 6, 1e-12);
  }
}

TEST(Gltf, MorphTargetsCountByTheWeightsOfTheNodeElseOfTheMesh) {
  GltfText text;
  text.list(kTetraCorners, 3);
  text.list(std::vector<std::uint8_t>{0, 1, 2, 3, 0, 1}, 1);
  text.list(std::vector<float>{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4}, 3);
  const GltfModel model = read(
      text.glb("\"meshes\":[{\"weights\":[0.5],\"primitives\":[{\"attributes\":{\"POSITION\":0},"
               "\"indices\":1,\"mode\":5,\"targets\":[{\"POSITION\":2}]}]}],"
               "\"nodes\":[{\"mesh\":0},{\"mesh\":0,\"weights\":[1],\"translation\":[10,0,0]}]"));
  // heights 1 + 2 and 1 + 4
  EXPECT_NEAR(volume_of(model.soup), (3.0 + 5.0) / 6, 1e-12);
}

TEST(Gltf, SkinsPlaceVerticesByJointsAndNotByTheNode) {
  GltfText text;
  text.list(kTetraCorners, 3);
  text.list(std::vector<std::uint8_t>{0, 1, 2, 3, 0, 1}, 1);
  text.list(std::vector<std::uint8_t>{0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0}, 4);
  text.list(std::vector<float>{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0.5f, 0.5f, 0, 0}, 4);
  const std::vector<float> unit = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  std::vector<float> binds = unit;
  binds.insert(binds.end(), unit.begin(), unit.end());
  text.list(binds, 16);
  const GltfModel model =
      read(text.glb("\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"JOINTS_0\":2,"
                    "\"WEIGHTS_0\":3},\"indices\":1,\"mode\":5}]}],"
                    "\"skins\":[{\"joints\":[1,2],\"inverseBindMatrices\":4}],"
                    "\"nodes\":[{\"mesh\":0,\"skin\":0,\"translation\":[1000,0,0]},"
                    "{\"translation\":[0,0,50]},{\"translation\":[0,0,54]}]"));
  // three vertices follow joint 0, the top lies between both
  expect_box(model.soup, {0, 0, 50}, {1, 1, 53});
  EXPECT_NEAR(volume_of(model.soup), 3.0 / 6, 1e-12);
}

class GltfFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::path(testing::TempDir()) /
        (std::string("gltf_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_ / "inside");
    text_.list(cube_corners(), 3);
    text_.list(cube_indices<std::uint16_t>(), 1);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] std::string document(const std::string& uri) const {
    return text_.json(
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
        "\"nodes\":[{\"mesh\":0}]",
        ",\"uri\":\"" + uri + "\"");
  }
  void write(const std::string& name) const {
    std::ofstream(folder_ / name, std::ios::binary) << text_.binary();
  }
  [[nodiscard]] Result<GltfModel> read_here(const std::string& uri, GltfOptions options = {}) {
    return read_gltf(document(uri), (folder_ / "inside" / "a.gltf").string(), options);
  }
  std::filesystem::path folder_;
  GltfText text_;
};

TEST_F(GltfFiles, BuffersLieInFilesBesideIt) {
  write("inside/my data.bin");
  for (const char* uri : {"my%20data.bin", "my data.bin", "../inside/my data.bin"}) {
    const auto model = read_here(uri);
    ASSERT_TRUE(model.has_value()) << model.error().message;
    EXPECT_EQ(volume_of(model->soup), 1.0);
    ASSERT_EQ(model->opened.size(), 1u);
    EXPECT_TRUE(model->opened[0].is_same_file(
        identify_file((folder_ / "inside" / "my data.bin").string())));
  }
}

TEST_F(GltfFiles, FilesOutsideOfTheRootAndWebAddressesAreRefused) {
  write("outside.bin");
  GltfOptions options;
  options.root = (folder_ / "inside").string();
  EXPECT_TRUE(read_here("../outside.bin").has_value());
  const auto outside = read_here("../outside.bin", options);
  ASSERT_FALSE(outside.has_value());
  EXPECT_NE(outside.error().message.find("buffers[0]: '../outside.bin' lies outside of"),
            std::string::npos)
      << outside.error().message;
  for (const char* uri : {"none.bin", "https://example.org/a.bin", "a%00.bin"}) {
    EXPECT_EQ(read_here(uri).error().code, ErrorCode::kInput) << uri;
  }
  write("inside/a.bin");
  const auto from_pipe = read_here("a.bin", {.standard_input = true});
  ASSERT_FALSE(from_pipe.has_value());
  EXPECT_NE(from_pipe.error().message.find("standard input can name none"), std::string::npos);
}

TEST_F(GltfFiles, BuffersMayBeText) {
  constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const std::string& bytes = text_.binary();
  ASSERT_EQ(bytes.size() % 3, 0u);
  std::string uri = "data:application/octet-stream;base64,";
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | static_cast<unsigned char>(bytes[i + k]);
    for (int shift = 18; shift >= 0; shift -= 6) uri += kLetters[(bits >> shift) & 63u];
  }
  const auto model = read_here(uri, {.standard_input = true});
  ASSERT_TRUE(model.has_value()) << model.error().message;
  EXPECT_EQ(volume_of(model->soup), 1.0);
  for (const std::string& bad :
       {uri.substr(0, uri.size() - 3), uri.substr(0, uri.size() - 4),
        std::string(uri).replace(60, 1, "*"), std::string("data:,abc"), std::string("data:")}) {
    EXPECT_EQ(read_here(bad).error().code, ErrorCode::kInput);
  }
}

}  // namespace
}  // namespace strata
