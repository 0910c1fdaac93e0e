// What readers tell while they read, and that they stop when asked to.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "strata/mesh/formats/read_mesh.h"

namespace strata {
namespace {

constexpr int kSide = 300;  // vertices a side: 178 802 triangles

glm::ivec3 corner(int n) {
  const int quad = n / 6, x = quad % (kSide - 1), y = quad / (kSide - 1);
  constexpr int kCorners[6][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}};
  return {x + kCorners[n % 6][0], y + kCorners[n % 6][1], 0};
}
int index_of(const glm::ivec3& p) { return p.y * kSide + p.x; }
constexpr int kTriangles = 2 * (kSide - 1) * (kSide - 1);

template <class T>
void put(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// A flat grid in each format.
std::string file_of(const std::string& format) {
  std::string text;
  const auto vertices = [&](const char* before) {
    for (int i = 0; i < kSide * kSide; ++i) {
      text += before + std::to_string(i % kSide) + " " + std::to_string(i / kSide) + " 0\n";
    }
  };
  const auto faces = [&](const char* before, int first) {
    for (int t = 0; t < kTriangles; ++t) {
      text += before;
      for (int c = 0; c < 3; ++c) {
        text += " " + std::to_string(index_of(corner(3 * t + c)) + first);
      }
      text += "\n";
    }
  };
  const std::string counts[2] = {std::to_string(kSide * kSide), std::to_string(kTriangles)};
  if (format == "obj") {
    vertices("v ");
    faces("f", 1);
  } else if (format == "off") {
    text = "OFF\n" + counts[0] + " " + counts[1] + " 0\n";
    vertices("");
    faces("3", 0);
  } else if (format == "ply") {
    text = "ply\nformat ascii 1.0\nelement vertex " + counts[0] +
           "\nproperty float x\nproperty float y\nproperty float z\nelement face " + counts[1] +
           "\nproperty list uchar int vertex_indices\nend_header\n";
    vertices("");
    faces("3", 0);
  } else if (format == "stl ascii") {
    text = "solid grid\n";
    for (int t = 0; t < kTriangles; ++t) {
      text += "facet normal 0 0 1\nouter loop\n";
      for (int c = 0; c < 3; ++c) {
        const glm::ivec3 p = corner(3 * t + c);
        text += "vertex " + std::to_string(p.x) + " " + std::to_string(p.y) + " 0\n";
      }
      text += "endloop\nendfacet\n";
    }
    text += "endsolid grid\n";
  } else {
    text.assign(80, ' ');
    put(text, static_cast<std::uint32_t>(kTriangles));
    for (int t = 0; t < kTriangles; ++t) {
      for (int i = 0; i < 3; ++i) put(text, i == 2 ? 1.0f : 0.0f);
      for (int c = 0; c < 3; ++c) {
        for (int i = 0; i < 3; ++i) put(text, static_cast<float>(corner(3 * t + c)[i]));
      }
      put(text, std::uint16_t{0});
    }
  }
  return text;
}

class ReadProgress : public testing::TestWithParam<std::string> {
 protected:
  Result<MeshFile> read(const Execution& execution) const {
    MeshReadOptions options;
    options.format = mesh_format_named(GetParam().substr(0, 3));
    return parse_mesh(text_, "grid", options, execution);
  }
  std::string text_ = file_of(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Formats, ReadProgress,
                         testing::Values("obj", "off", "ply", "stl ascii", "stl binary"),
                         [](const testing::TestParamInfo<std::string>& of) {
                           return of.param.size() > 3 ? "stl_" + of.param.substr(4) : of.param;
                         });

TEST_P(ReadProgress, GrowsAndStaysBelowOne) {
  for (const int threads : {1, 2}) {
    std::vector<double> told;
    Execution execution;
    execution.threads = threads;
    execution.progress = [&](double done) { told.push_back(done); };
    const auto file = read(execution);
    ASSERT_TRUE(file.has_value()) << file.error().message;
    EXPECT_EQ(file->soup.triangles.size(), static_cast<std::size_t>(kTriangles));
    ASSERT_FALSE(told.empty());
    EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
    EXPECT_GE(told.front(), 0.0);
    EXPECT_LE(told.back(), 1.0);
    if (threads > 1) continue;  // the other one may have done it all
    EXPECT_GT(told.size(), 3u);
    EXPECT_GT(told.back(), 0.8);
  }
}

TEST_P(ReadProgress, AStopOnTheWayEndsTheReading) {
  std::stop_source source;
  Execution execution;
  execution.threads = 1;
  execution.stop = source.get_token();
  int told = 0;
  execution.progress = [&](double) {
    ++told;
    source.request_stop();
  };
  const auto file = read(execution);
  ASSERT_FALSE(file.has_value());
  EXPECT_EQ(file.error().code, ErrorCode::kCancelled);
  EXPECT_LE(told, 2);
}

}  // namespace
}  // namespace strata
