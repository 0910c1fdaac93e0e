#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <glm/common.hpp>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "mesh/gltf/read_gltf.h"
#include "tests/mesh/gltf/glb_bytes.h"

/// Small glTF files, for tests.
namespace strata::testing_gltf {

template <class T>
std::string bytes_of(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

/// Collects buffer views and accessors; the rest of the document is text.
class GltfText {
 public:
  int view(std::string_view bytes, const std::string& more = "") {
    views_ += fmt::format("{}{{\"buffer\":0,\"byteOffset\":{},\"byteLength\":{}{}}}",
                          view_count_ == 0 ? "" : ",", binary_.size(), bytes.size(), more);
    binary_ += bytes;
    binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
    return view_count_++;
  }
  /// @param where  '"bufferView":0' or the like, with more after it
  int accessor(const std::string& where, int component_type, std::size_t count,
               const std::string& type) {
    accessors_ += fmt::format("{}{{{}{}\"componentType\":{},\"count\":{},\"type\":\"{}\"}}",
                              accessor_count_ == 0 ? "" : ",", where, where.empty() ? "" : ",",
                              component_type, count, type);
    return accessor_count_++;
  }
  /// An accessor with a view of its own. @param components  1 to 4, 16
  template <class T>
  int list(const std::vector<T>& values, int components, const std::string& more = "") {
    const int type = std::is_same_v<T, float>           ? 5126
                     : std::is_same_v<T, std::int8_t>   ? 5120
                     : std::is_same_v<T, std::uint8_t>  ? 5121
                     : std::is_same_v<T, std::int16_t>  ? 5122
                     : std::is_same_v<T, std::uint16_t> ? 5123
                                                        : 5125;
    const char* const names[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    return accessor(fmt::format("\"bufferView\":{}{}", view(bytes_of(values)), more), type,
                    values.size() / static_cast<std::size_t>(components),
                    components == 16 ? "MAT4" : names[components - 1]);
  }
  /// @param rest  '"nodes":[...],...'  @param buffer  more of the buffer: its uri
  [[nodiscard]] std::string json(const std::string& rest, const std::string& buffer = "") const {
    return fmt::format(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"buffers\":[{{\"byteLength\":{}{}}}],"
        "\"bufferViews\":[{}],\"accessors\":[{}]{}{}}}",
        binary_.size(), buffer, views_, accessors_, rest.empty() ? "" : ",", rest);
  }
  [[nodiscard]] std::string glb(const std::string& rest) const {
    return glb_of(json(rest), binary_);
  }
  [[nodiscard]] const std::string& binary() const { return binary_; }

 private:
  std::string views_, accessors_, binary_;
  int view_count_ = 0, accessor_count_ = 0;
};

/// The corners of a cube of side 1 from the origin, 4 for each face as exporters write them, and
/// its triangles.
inline std::vector<float> cube_corners() {
  std::vector<float> all;
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      for (int corner = 0; corner < 4; ++corner) {
        float at[3];
        at[axis] = static_cast<float>(side);
        at[(axis + 1) % 3] = static_cast<float>(corner == 1 || corner == 2);
        at[(axis + 2) % 3] = static_cast<float>(corner >= 2);
        all.insert(all.end(), at, at + 3);
      }
    }
  }
  return all;
}
template <class T>
std::vector<T> cube_indices() {
  std::vector<T> all;
  for (int face = 0; face < 6; ++face) {
    const bool far = face % 2 == 1;
    for (const int corner : {0, far ? 1 : 2, far ? 2 : 1, 0, far ? 2 : 3, far ? 3 : 2}) {
      all.push_back(static_cast<T>(4 * face + corner));
    }
  }
  return all;
}

/// A document whose accessors 0 and 1 are the cube. @param rest  nodes and scenes
inline std::string cube_glb(const std::string& nodes, const std::string& more = "") {
  GltfText text;
  text.list(cube_corners(), 3);
  text.list(cube_indices<std::uint16_t>(), 1);
  return text.glb(
      "\"meshes\":[{\"name\":\"cube\",\"primitives\":[{\"attributes\":{\"POSITION\":0},"
      "\"indices\":1}]}],\"nodes\":[" +
      nodes + "]" + more);
}

inline GltfModel read(std::string_view bytes, const GltfOptions& options = {.attributes = true}) {
  auto model = read_gltf(bytes, "file.glb", options);
  EXPECT_TRUE(model.has_value()) << (model ? "" : model.error().message);
  return model ? *std::move(model) : GltfModel();
}

inline Error refused(std::string_view bytes, const GltfOptions& options = {.attributes = true},
                     const Execution& execution = {}) {
  const auto model = read_gltf(bytes, "file.glb", options, execution);
  EXPECT_FALSE(model.has_value());
  return model ? Error() : model.error();
}

/// Expects a refusal of the input that says `text`.
inline void expect_refused(std::string_view bytes, const std::string& text) {
  const Error error = refused(bytes);
  EXPECT_EQ(error.code, ErrorCode::kInput) << error.message;
  EXPECT_NE(error.message.find(text), std::string::npos) << error.message << " lacks " << text;
  EXPECT_TRUE(error.message.starts_with("file.glb:")) << error.message;
}

/// The volume inside, summed over triangles.
inline double volume_of(const TriangleSoup& soup) {
  double sum = 0.0;
  for (const glm::uvec3& t : soup.triangles) {
    const glm::dvec3 &a = soup.positions[t.x], &b = soup.positions[t.y], &c = soup.positions[t.z];
    sum += a.x * (b.y * c.z - b.z * c.y) + a.y * (b.z * c.x - b.x * c.z) +
           a.z * (b.x * c.y - b.y * c.x);
  }
  return sum / 6;
}

inline void expect_box(const TriangleSoup& soup, const glm::dvec3& low, const glm::dvec3& high) {
  ASSERT_FALSE(soup.triangles.empty());
  glm::dvec3 least = soup.positions[soup.triangles[0].x], most = least;
  for (const glm::uvec3& t : soup.triangles) {
    for (int i = 0; i < 3; ++i) {
      least = glm::min(least, soup.positions[t[i]]);
      most = glm::max(most, soup.positions[t[i]]);
    }
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(least[i], low[i], 1e-7) << i;
    EXPECT_NEAR(most[i], high[i], 1e-7) << i;
  }
}

}  // namespace strata::testing_gltf
