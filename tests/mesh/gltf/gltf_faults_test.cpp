#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include <string>
#include <vector>

#include "mesh/gltf/read_gltf.h"
#include "tests/mesh/gltf/glb_files.h"

namespace strata {
namespace {

using namespace testing_gltf;

const std::string kMesh =
    "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
    "\"nodes\":[{\"mesh\":0}]";

/// Two accessors, as they are written.
std::string with_accessors(const std::string& positions, const std::string& indices) {
  GltfText text;
  text.view(bytes_of(cube_corners()));
  text.view(bytes_of(cube_indices<std::uint16_t>()));
  std::string json = text.json(kMesh);
  const std::string empty = "\"accessors\":[]";
  json.replace(json.find(empty), empty.size(),
               "\"accessors\":[{" + positions + "},{" + indices + "}]");
  return glb_of(json, text.binary());
}
const std::string kPositions =
    "\"bufferView\":0,\"componentType\":5126,\"count\":24,\"type\":\"VEC3\"";
const std::string kIndices =
    "\"bufferView\":1,\"componentType\":5123,\"count\":36,\"type\":\"SCALAR\"";

TEST(GltfFaults, EveryTruncatedLengthIsRefused) {
  const std::string whole = cube_glb("{\"mesh\":0}");
  for (std::size_t length = 0; length < whole.size(); ++length) {
    EXPECT_EQ(refused(whole.substr(0, length)).code, ErrorCode::kInput) << length;
  }
  // and where the header gives the new length
  for (std::size_t length = 12; length < whole.size(); ++length) {
    std::string cut = whole.substr(0, length);
    cut.replace(8, 4, little_endian(length));
    EXPECT_EQ(refused(cut).code, ErrorCode::kInput) << length;
  }
  EXPECT_EQ(volume_of(read(whole + "more").soup), 1.0);
}

TEST(GltfFaults, AnyByteOfAFileMayBeWrong) {
  const std::string whole = cube_glb("{\"mesh\":0}");
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const int bit : {1, 16, 128}) {
      std::string damaged = whole;
      damaged[at] = static_cast<char>(damaged[at] ^ bit);
      const auto model = read_gltf(damaged, "file.glb", {.attributes = true});
      if (!model) {
        EXPECT_EQ(model.error().code, ErrorCode::kInput) << model.error().message;
        continue;
      }
      for (const glm::uvec3& t : model->soup.triangles) {
        ASSERT_LT(std::max({t.x, t.y, t.z}), model->soup.positions.size());
      }
    }
  }
}

TEST(GltfFaults, HeadersAndChunks) {
  const std::string whole = cube_glb("{\"mesh\":0}");
  std::string other = whole;
  other[4] = 1;
  expect_refused(other, "version 1 of GLB is not read; version 2 is");
  other = whole;
  other[16] = 'X';
  expect_refused(other, "the first chunk is not JSON");
  expect_refused("{\"asset\":{\"version\":\"1.0\"}}", "glTF 1.0 is not read; glTF 2.0 is");
  expect_refused("{}", "no asset.version");
  expect_refused("[1]", "the JSON is not an object");
  expect_refused("{\"asset\":", "malformed JSON");
  expect_refused("{\"asset\":1e999}", "a number of the JSON is too large");
}

TEST(GltfFaults, AccessorsBeyondTheirBytes) {
  EXPECT_EQ(volume_of(read(with_accessors(kPositions, kIndices)).soup), 1.0);
  const auto with = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  expect_refused(with_accessors(with(kPositions, ":24", ":25"), kIndices),
                 "accessors[0]: its 25 elements reach beyond the 288 bytes of bufferViews[0]");
  for (const char* count : {"4294967296", "4294967295", "9007199254740992", "768614336404564651"}) {
    expect_refused(with_accessors(with(kPositions, "24", count), kIndices), "accessors[0]");
    expect_refused(with_accessors(kPositions, with(kIndices, "36", count)), "accessors[1]");
  }
  for (const char* count : {"-1", "1.5", "\"3\"", "null", "1e300"}) {
    expect_refused(with_accessors(with(kPositions, "24", count), kIndices),
                   "accessors[0].count must be a whole number of 0 to");
  }
  expect_refused(with_accessors(kPositions + ",\"byteOffset\":9007199254740991", kIndices),
                 "accessors[0]");
  expect_refused(with_accessors(kPositions, kIndices + ",\"byteOffset\":2"), "accessors[1]");
  expect_refused(with_accessors(with(kPositions, "5126", "5130"), kIndices),
                 "accessors[0].componentType must be 5120 to 5126, got 5130");
  expect_refused(with_accessors(with(kPositions, "VEC3", "VEC9"), kIndices), "got 'VEC9'");
  expect_refused(with_accessors(with(kPositions, "VEC3", "VEC2"), kIndices),
                 "accessors[0] has 2 numbers an element, where 3 are needed");
  expect_refused(with_accessors(kPositions, with(kIndices, "5123", "5122")),
                 "it must have scalars");
  expect_refused(
      with_accessors(with(kPositions, "\"bufferView\":0", "\"bufferView\":7"), kIndices),
      "accessors[0].bufferView must be an index of bufferViews, which has 2 elements, got 7");
}

TEST(GltfFaults, AccessorsWithoutBytesAreSmall) {
  const std::string zeros = "\"componentType\":5126,\"count\":4000000000,\"type\":\"VEC3\"";
  EXPECT_EQ(refused(with_accessors(zeros, kIndices)).code, ErrorCode::kLimit);
  Execution execution;
  execution.memory_limit = 2000;  // 36 indices fit, 24 vertices and 12 triangles do
  const auto good = read_gltf(with_accessors(kPositions, kIndices), "file.glb", {}, execution);
  EXPECT_TRUE(good.has_value()) << good.error().message;
  execution.memory_limit = 600;
  EXPECT_EQ(refused(with_accessors(kPositions, kIndices), {}, execution).code, ErrorCode::kLimit);
}

TEST(GltfFaults, InstancesKeepToTheMemoryLimit) {
  std::string nodes = "{\"mesh\":0}";
  for (int i = 0; i < 1000; ++i) nodes += ",{\"mesh\":0}";
  Execution execution;
  execution.memory_limit = 100'000;
  EXPECT_EQ(refused(cube_glb(nodes), {}, execution).code, ErrorCode::kLimit);
}

TEST(GltfFaults, CirclesAndSharedChildren) {
  expect_refused(cube_glb("{\"mesh\":0,\"children\":[0]}"),
                 "nodes[0] lies within a circle of children");
  expect_refused(cube_glb("{\"mesh\":0},{\"children\":[2]},{\"children\":[1]}",
                          ",\"scenes\":[{\"nodes\":[1]}]"),
                 "nodes[1] lies within a circle of children");
  expect_refused(cube_glb("{\"mesh\":0},{\"children\":[0]},{\"children\":[0]}"),
                 "nodes[0] is a child of nodes[1] and of nodes[2]");
  expect_refused(cube_glb("{\"mesh\":0,\"children\":[9]}"),
                 "nodes[0].children must be an index of nodes, which has 1 element, got 9");
  EXPECT_EQ(volume_of(read(cube_glb("{\"children\":[1,1]},{\"mesh\":0}")).soup), 1.0);
}

TEST(GltfFaults, NumbersThatAreNotFinite) {
  expect_refused(cube_glb("{\"mesh\":0,\"scale\":[1e308,1e308,1e308]},"
                          "{\"mesh\":0,\"scale\":[1e308,1,1],\"children\":[2]},"
                          "{\"mesh\":0,\"scale\":[1e308,1,1]}"),
                 "nodes[2] places a vertex at");
  expect_refused(cube_glb("{\"mesh\":0,\"rotation\":[0,0,0,0]}"), "nodes[0].rotation has length 0");
  expect_refused(cube_glb("{\"mesh\":0,\"matrix\":[1,0]}"), "nodes[0].matrix must have 16 numbers");
  expect_refused(cube_glb("{\"mesh\":0,\"scale\":[\"a\",1,1]}"),
                 "nodes[0].scale must be a number, got \"a\"");
  GltfText text;
  std::vector<float> corners = cube_corners();
  corners[4] = std::numeric_limits<float>::quiet_NaN();
  text.list(corners, 3);
  text.list(cube_indices<std::uint16_t>(), 1);
  const GltfModel model = read(text.glb(kMesh));
  EXPECT_EQ(model.soup.triangles.size(), 11u);  // one triangle has corner 1
  EXPECT_EQ(model.losses.non_finite, 1u);
  EXPECT_EQ(model.losses.first,
            "file.glb: meshes[0] has a vertex at (0, nan, 0), which is not finite");
  for (const glm::dvec3& p : model.soup.positions) EXPECT_EQ(p.y - p.y, 0.0);
}

TEST(GltfFaults, TrianglesWithIndicesOutOfRangeAreDropped) {
  GltfText text;
  text.list(cube_corners(), 3);
  std::vector<std::uint16_t> indices = cube_indices<std::uint16_t>();
  indices[4] = 24;
  indices[35] = 65535;
  text.list(indices, 1);
  const GltfModel model = read(text.glb(kMesh));
  EXPECT_EQ(model.soup.triangles.size(), 10u);
  EXPECT_EQ(model.losses.out_of_range, 2u);
  EXPECT_EQ(model.losses.first,
            "file.glb: meshes[0].primitives[0]: an index is 65535, but there are 24 vertices");
  GltfText none;
  none.list(cube_corners(), 3);
  none.list(std::vector<std::uint16_t>{24, 25, 26}, 1);
  expect_refused(none.glb(kMesh), "an index is 26, but there are 24 vertices; no triangle can be");
}

TEST(GltfFaults, StridesAreMultiplesOf4ThatHoldAnElement) {
  const auto with_stride = [](const std::string& stride) {
    GltfText text;
    std::vector<float> corners;
    const std::vector<float> cube = cube_corners();
    for (std::size_t i = 0; i < cube.size(); ++i) {
      corners.push_back(cube[i]);
      if (i % 3 == 2) corners.push_back(99);
    }
    const int view = text.view(bytes_of(corners), ",\"byteStride\":" + stride);
    text.accessor(fmt::format("\"bufferView\":{}", view), 5126, 24, "VEC3");
    text.list(cube_indices<std::uint16_t>(), 1);
    return text.glb(kMesh);
  };
  EXPECT_EQ(volume_of(read(with_stride("16")).soup), 1.0);
  for (const char* stride : {"0", "2", "6", "15", "17"}) {
    expect_refused(with_stride(stride),
                   std::string("bufferViews[0].byteStride must be a multiple of 4, and not 0, "
                               "got ") +
                       stride);
  }
  for (const char* stride : {"4", "8"}) {
    expect_refused(with_stride(stride), std::string("accessors[0]: its elements have 12 bytes, but "
                                                    "bufferViews[0].byteStride is ") +
                                            stride);
  }
}

TEST(GltfFaults, CornersThatMakeNoTriangleAreTold) {
  for (const int rest : {1, 2}) {
    GltfText text;
    text.list(cube_corners(), 3);
    std::vector<std::uint16_t> indices = cube_indices<std::uint16_t>();
    indices.resize(indices.size() - 3 + static_cast<std::size_t>(rest));
    text.list(indices, 1);
    const GltfModel model = read(text.glb(kMesh));
    EXPECT_EQ(model.soup.triangles.size(), 11u);
    EXPECT_EQ(model.losses.too_few, 1u);
    EXPECT_EQ(model.losses.first,
              fmt::format("file.glb: meshes[0].primitives[0]: its triangles have {} corners, which "
                          "is no multiple of 3",
                          33 + rest));
  }
  for (const int mode : {4, 5, 6}) {
    GltfText text;
    text.list(cube_corners(), 3);
    text.list(std::vector<std::uint16_t>{0, 1}, 1);
    std::string mesh = kMesh;
    mesh.insert(mesh.find("\"indices\""), fmt::format("\"mode\":{},", mode));
    expect_refused(text.glb(mesh), "meshes[0].primitives[0]");
  }
}

TEST(GltfFaults, ANodeHasAMatrixOrAPlace) {
  const std::string unit = "\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]";
  for (const auto& [name, value] : std::vector<std::pair<std::string, std::string>>{
           {"translation", "[1,0,0]"}, {"rotation", "[0,0,0,1]"}, {"scale", "[1,1,1]"}}) {
    expect_refused(cube_glb("{\"mesh\":0," + unit + ",\"" + name + "\":" + value + "}"),
                   "nodes[0] has both a matrix and a " + name);
  }
  expect_refused(
      cube_glb("{\"mesh\":0,\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0.5,0,0,0,1]}"),
      "nodes[0].matrix must be affine: its last row must be 0, 0, 0, 1, got 0, 0, 0.5, 1");
  EXPECT_EQ(volume_of(read(cube_glb("{\"mesh\":0," + unit + "}")).soup), 1.0);
}

TEST(GltfFaults, MistakesOfTheWholeFileNameTheFile) {
  expect_refused(cube_glb("{\"mesh\":0}", ",\"scene\":3"),
                 "file.glb: scene must be an index of scenes, which has 0 elements, got 3");
}

TEST(GltfFaults, ExtensionsThatAreRequiredAreNamed) {
  const std::string cube = "{\"mesh\":0}";
  for (const char* name : {"KHR_draco_mesh_compression", "EXT_meshopt_compression"}) {
    expect_refused(cube_glb(cube, fmt::format(",\"extensionsRequired\":[\"{}\"]", name)),
                   fmt::format("it requires the extension {}, which is not read; write the file "
                               "without compression",
                               name));
  }
  expect_refused(cube_glb(cube, ",\"extensionsRequired\":[\"ACME_shapes\"]"),
                 "it requires the extension ACME_shapes, which is not read");
  EXPECT_EQ(volume_of(read(cube_glb(cube,
                                    ",\"extensionsRequired\":[\"KHR_materials_unlit\"],"
                                    "\"extensionsUsed\":[\"ACME_shapes\"]"))
                          .soup),
            1.0);
  // packed by an extension that is not required, without other bytes
  GltfText text;
  text.accessor("", 5126, 24, "VEC3");
  expect_refused(
      text.glb("\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},"
               "\"extensions\":{\"KHR_draco_mesh_compression\":{}}}]}],\"nodes\":[{\"mesh\":0}]"),
      "packed by KHR_draco_mesh_compression");
}

TEST(GltfFaults, ListsThatAreNested) {
  const std::string deep = std::string(200'000, '[') + std::string(200'000, ']');
  EXPECT_EQ(volume_of(read(cube_glb("{\"mesh\":0,\"extras\":" + deep + "}")).soup), 1.0);
}

TEST(GltfFaults, ScenesWithoutTriangles) {
  expect_refused(cube_glb("{}"), "the scene has no triangles");
  GltfText text;
  text.list(cube_corners(), 3);
  expect_refused(text.glb("\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},"
                          "\"mode\":0}]}],\"nodes\":[{\"mesh\":0}]"),
                 "the scene has no triangles; points and lines are not read");
  Execution execution;
  std::stop_source stop;
  stop.request_stop();
  execution.stop = stop.get_token();
  EXPECT_EQ(refused(cube_glb("{\"mesh\":0}"), {}, execution).code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace strata
