// Faces of a result that have the parts of the triangles they come from.

#include "strata/csg/boundary/face_parts.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/shapes.h"

namespace strata::csg {
namespace {

/// A solid whose triangles are all parts of their own, named "a0", "a1", ...
Solid add_solid(FaceParts& faces, TriangleSoup mesh, const std::string& name) {
  std::vector<std::uint32_t>& parts = faces.of_triangles.emplace_back();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    parts.push_back(static_cast<std::uint32_t>(faces.parts.size()));
    faces.parts.push_back({name + std::to_string(t), {}});
  }
  Solid solid;
  solid.mesh = std::make_shared<const TriangleSoup>(std::move(mesh));
  solid.name = name;
  return solid;
}

glm::dvec3 across(const std::vector<glm::dvec3>& positions, const glm::uvec3& t) {
  return glm::cross(positions[t.y] - positions[t.x], positions[t.z] - positions[t.x]);
}

/// The area of the parts by their names.
std::map<std::string, double> areas(const SolidMesh& mesh) {
  std::map<std::string, double> all;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t part = mesh.part_of.empty() ? 0 : mesh.part_of[t];
    all[mesh.parts[part].name] += glm::length(across(mesh.positions, mesh.triangles[t])) / 2;
  }
  return all;
}

BoundaryOptions in_solids(BoundaryFaceKind faces = BoundaryFaceKind::kCanonical) {
  BoundaryOptions options;
  options.parts = BoundaryParts::kSolids;
  options.faces = faces;
  return options;
}

BoundaryMesh made(const Tree& tree, const FaceParts& faces, const BoundaryOptions& options) {
  auto mesh = boundary_mesh(tree, tree.root(), options, faces);
  EXPECT_TRUE(mesh.has_value()) << mesh.error().message;
  if (!mesh) return {};
  const MeshDiagnosis found =
      diagnose(TriangleSoup{mesh->mesh.positions, mesh->mesh.triangles, {}});
  EXPECT_TRUE(found.closed);
  return *std::move(mesh);
}

TEST(FaceParts, NothingIsCutFromASolidThatNothingMeets) {
  for (const auto kind : {BoundaryFaceKind::kCanonical, BoundaryFaceKind::kInput}) {
    for (const TriangleSoup& mesh : {make_box({0, 0, 0}, {4, 2, 1}), make_icosphere(3, 2)}) {
      FaceParts faces;
      const Tree tree(add_solid(faces, mesh, "a"));
      const auto found = areas(made(tree, faces, in_solids(kind)).mesh);
      ASSERT_EQ(found.size(), mesh.triangles.size());
      for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const double area = glm::length(across(mesh.positions, mesh.triangles[t])) / 2;
        EXPECT_NEAR(found.at("a" + std::to_string(t)), area, 1e-6 * area) << t;
      }
    }
  }
}

/// Expects that each face lies in the plane of the triangle that its part is, and faces as it does,
/// or against it where the solid is subtracted.
void expect_planes(const SolidMesh& mesh, const Tree& tree, const std::string& subtracted) {
  std::map<std::string, std::pair<glm::dvec3, glm::dvec3>> planes;  // point and normal
  for (const Solid& solid : tree.solids()) {
    for (std::size_t t = 0; t < solid.mesh->triangles.size(); ++t) {
      const glm::uvec3& corners = solid.mesh->triangles[t];
      glm::dvec3 normal = glm::normalize(across(solid.mesh->positions, corners));
      if (solid.name == subtracted) normal = -normal;
      planes[solid.name + std::to_string(t)] = {solid.mesh->positions[corners.x], normal};
    }
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [point, normal] = planes.at(mesh.parts[mesh.part_of[t]].name);
    EXPECT_GT(glm::dot(normal, glm::normalize(across(mesh.positions, mesh.triangles[t]))), 0.999);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(glm::dot(normal, mesh.positions[mesh.triangles[t][k]] - point), 0, 1e-5);
    }
  }
}

double sum_of(const std::map<std::string, double>& areas, char solid) {
  double sum = 0;
  for (const auto& [name, area] : areas) sum += name[0] == solid ? area : 0;
  return sum;
}

TEST(FaceParts, AHoleHasThePartsOfWhatWasTakenAway) {
  for (const auto kind : {BoundaryFaceKind::kCanonical, BoundaryFaceKind::kInput}) {
    FaceParts faces;
    Tree tree;
    const auto a = tree.add_solid(add_solid(faces, make_box({0, 0, 0}, {10, 10, 10}), "a"));
    const auto b = tree.add_solid(add_solid(faces, make_box({3, 3, -1}, {7, 7, 11}), "b"));
    tree.set_root(tree.add(Operation::kDifference, {a, b}));
    const SolidMesh mesh = made(tree, faces, in_solids(kind)).mesh;
    expect_planes(mesh, tree, "b");
    EXPECT_NEAR(sum_of(areas(mesh), 'a'), 600 - 32, 1e-4);
    EXPECT_NEAR(sum_of(areas(mesh), 'b'), 160, 1e-4);
  }
}

TEST(FaceParts, FacesThatCoincideHaveTheParts) {
  // b ends in the planes of a, above and below, and within a; c is a again.
  for (const bool twice : {false, true}) {
    FaceParts faces;
    Tree tree;
    std::vector<Tree::NodeId> nodes = {
        tree.add_solid(add_solid(faces, make_box({0, 0, 0}, {10, 10, 10}), "a")),
        tree.add_solid(add_solid(faces, make_box({4, 2, 0}, {14, 8, 10}), "b"))};
    if (twice) {
      nodes.push_back(tree.add_solid(add_solid(faces, make_box({0, 0, 0}, {10, 10, 10}), "c")));
    }
    tree.set_root(tree.add(Operation::kUnion, nodes));
    const SolidMesh mesh = made(tree, faces, in_solids()).mesh;
    expect_planes(mesh, tree, "");
    const auto found = areas(mesh);
    const double all = sum_of(found, 'a') + sum_of(found, 'b') + sum_of(found, 'c');
    EXPECT_NEAR(all, 600 + 2 * 24 + 2 * 40, 1e-4);
    EXPECT_GE(sum_of(found, 'b'), 2 * 24 + 2 * 40 + 60 - 1e-4) << "what only b has";
  }
}

TEST(FaceParts, CapsHaveThePartOfTheirRim) {
  TriangleSoup open = make_box({0, 0, 0}, {4, 4, 4});
  const glm::uvec3 gone = open.triangles.back();
  open.triangles.pop_back();
  FaceParts faces;
  const Tree tree(add_solid(faces, open, "a"));
  const SolidMesh mesh = made(tree, faces, in_solids()).mesh;
  const auto found = areas(mesh);
  double sum = 0;
  for (const auto& [name, area] : found) sum += area;
  EXPECT_NEAR(sum, 96, 1e-5);
  std::size_t wider = 0;
  for (std::size_t t = 0; t < open.triangles.size(); ++t) {
    if (found.at("a" + std::to_string(t)) < 8 + 1e-5) continue;
    ++wider;
    bool touches = false;
    for (int i = 0; i < 9; ++i) touches = touches || open.triangles[t][i / 3] == gone[i % 3];
    EXPECT_TRUE(touches) << t;
  }
  EXPECT_GE(wider, 1u);
}

TEST(FaceParts, EqualColoursAreOnePartWhateverHasThem) {
  FaceParts faces;
  Tree tree;
  Solid plain;
  plain.mesh = std::make_shared<const TriangleSoup>(make_box({20, 0, 0}, {21, 1, 1}));
  plain.colour = glm::vec4(1, 0, 0, 1);
  const auto a = tree.add_solid(add_solid(faces, make_box({0, 0, 0}, {10, 10, 10}), "a"));
  const auto b = tree.add_solid(plain);
  faces.of_triangles.emplace_back();
  for (std::size_t p = 0; p < faces.parts.size(); ++p) {
    faces.parts[p].colour = p % 2 == 0 ? glm::vec4(1, 0, 0, 1) : glm::vec4(0, 0, 1, 1);
  }
  tree.set_root(tree.add(Operation::kUnion, {a, b}));
  BoundaryOptions options = in_solids();
  options.parts = BoundaryParts::kColours;
  const SolidMesh mesh = made(tree, faces, options).mesh;
  ASSERT_EQ(mesh.parts.size(), 2u);
  std::map<float, double> area;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    area[mesh.parts[mesh.part_of[t]].colour->r] +=
        glm::length(across(mesh.positions, mesh.triangles[t])) / 2;
  }
  EXPECT_NEAR(area[1.0f], 300 + 6, 1e-4);
  EXPECT_NEAR(area[0.0f], 300, 1e-4);
}

TEST(FaceParts, PartsOfAnotherTreeAreRefused) {
  FaceParts faces;
  const Tree tree(add_solid(faces, make_box({0, 0, 0}, {1, 1, 1}), "a"));
  FaceParts wrong = faces;
  wrong.of_triangles[0].pop_back();
  EXPECT_EQ(boundary_mesh(tree, tree.root(), in_solids(), wrong).error().code, ErrorCode::kUsage);
  wrong = faces;
  wrong.of_triangles[0][3] = 99;
  EXPECT_EQ(boundary_mesh(tree, tree.root(), in_solids(), wrong).error().code, ErrorCode::kUsage);
  wrong = faces;
  wrong.of_triangles.emplace_back();
  EXPECT_EQ(boundary_mesh(tree, tree.root(), in_solids(), wrong).error().code, ErrorCode::kUsage);
  EXPECT_TRUE(boundary_mesh(tree, tree.root(), {}, wrong).has_value()) << "no parts are asked";
}

}  // namespace
}  // namespace strata::csg
