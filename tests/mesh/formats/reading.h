#pragma once

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "strata/mesh/formats/read_mesh.h"

/// Helpers for the tests of the readers.
namespace strata::testing_mesh {

/// Triangles of a square.
inline const std::vector<glm::uvec3> kTwoTriangles = {{0, 1, 2}, {0, 2, 3}};

inline Result<MeshFile> parse(MeshFormat format, std::string_view text, bool strict = false,
                              int threads = 2) {
  MeshReadOptions options;
  options.format = format;
  options.strict = strict;
  Execution execution;
  execution.threads = threads;
  return parse_mesh(text, "file", options, execution);
}

/// The mesh, which must be there.
inline MeshFile parsed(MeshFormat format, std::string_view text) {
  auto result = parse(format, text);
  EXPECT_TRUE(result.has_value()) << (result ? "" : result.error().message);
  return result ? std::move(*result) : MeshFile{};
}

/// The message of the refusal, which must be there and be ErrorCode::kInput.
inline std::string refusal(MeshFormat format, std::string_view text, bool strict = false) {
  auto result = parse(format, text, strict);
  EXPECT_FALSE(result.has_value());
  if (result) return "";
  EXPECT_EQ(result.error().code, ErrorCode::kInput) << result.error().message;
  return result.error().message;
}

/// The one warning, which must be there.
inline std::string only_warning(const MeshFile& file) {
  EXPECT_EQ(file.stats.warnings.size(), 1u);
  return file.stats.warnings.empty() ? "" : file.stats.warnings.front();
}

/// 6 times the volume inside, which of whole coordinates is exact.
inline double six_volumes(const TriangleSoup& mesh) {
  double sum = 0.0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 &a = mesh.positions[t.x], &b = mesh.positions[t.y], &c = mesh.positions[t.z];
    sum += a.x * (b.y * c.z - b.z * c.y) + a.y * (b.z * c.x - b.x * c.z) +
           a.z * (b.x * c.y - b.y * c.x);
  }
  return sum;
}

inline bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

/// Rounds to float. Through a volatile, because g++ 12 -O2 folds vectors of double(float(x)) to x.
inline double through_float(double value) {
  const volatile float rounded = static_cast<float>(value);
  return rounded;
}
inline void round_to_float(TriangleSoup& mesh) {
  for (glm::dvec3& p : mesh.positions) {
    p = {through_float(p.x), through_float(p.y), through_float(p.z)};
  }
}

#define EXPECT_CONTAINS(text, part)                         \
  EXPECT_TRUE(::strata::testing_mesh::contains(text, part)) \
      << "'" << (text) << "' lacks '" << (part) << "'"

}  // namespace strata::testing_mesh
