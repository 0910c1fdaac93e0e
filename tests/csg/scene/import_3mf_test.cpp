#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "mesh/archives/read_3mf_amf.h"
#include "strata/mesh/diagnose.h"
#include "tests/csg/scene/scene_checks.h"
#include "tests/csg/scene/scene_inputs.h"
#include "tests/csg/scene/zip_files.h"

namespace strata::csg {
namespace {

using Parts = std::vector<std::pair<std::string, std::string>>;

/// A tetrahedron with a volume of 1/6 whose corner is the origin.
const std::string kTetraMesh =
    "<mesh><vertices><vertex x='0' y='0' z='0'/><vertex x='1' y='0' z='0'/>"
    "<vertex x='0' y='1' z='0'/><vertex x='0' y='0' z='1'/></vertices><triangles>"
    "<triangle v1='0' v2='2' v3='1'/><triangle v1='0' v2='1' v3='3'/>"
    "<triangle v1='0' v2='3' v3='2'/><triangle v1='1' v2='2' v3='3'/></triangles></mesh>";

std::string object_of(const std::string& id, const std::string& content) {
  return "<object id='" + id + "'>" + content + "</object>\n";
}
std::string moved_by(double x, double y, double z) {
  return fmt::format(" transform='1 0 0 0 1 0 0 0 1 {} {} {}'", x, y, z);
}
/// What a component or a build item says: the object, and more attributes.
std::string use_of(const std::string& what, const std::string& id, const std::string& more = "") {
  return "<" + what + " objectid='" + id + "'" + more + "/>";
}
std::string model(const std::string& resources, const std::string& items,
                  const std::string& more = "unit='millimeter'") {
  return "<?xml version='1.0'?>\n<model " + more + " xmlns:p='production'>\n<resources>\n" +
         resources + "</resources>\n<build>\n" + items + "</build></model>\n";
}
std::string relations(const std::string& target) {
  return "<Relationships><Relationship Target='" + target +
         "' Type='http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel'/></Relationships>";
}

class ThreeMf : public SceneFiles {
 protected:
  void SetUp() override {
    const auto any = read_3mf(write("any.3mf", zip_of({})));
    if (any.error().code == ErrorCode::kUsage) GTEST_SKIP() << any.error().message;
  }
  TriangleSoup soup(const Parts& parts) {
    auto mesh = read_3mf(write("a.3mf", zip_of(parts)));
    EXPECT_TRUE(mesh.has_value()) << mesh.error().message;
    return mesh ? *std::move(mesh) : TriangleSoup();
  }
  Error error_of(const Parts& parts) {
    const auto mesh = read_3mf(write("a.3mf", zip_of(parts)));
    EXPECT_FALSE(mesh.has_value());
    return mesh ? Error() : mesh.error();
  }
};

TEST_F(ThreeMf, ComponentsLieInOtherPartsOfTheArchive) {
  // As Bambu Studio writes: the meshes first, an empty build in their parts, paths from the root.
  const std::string part = model(object_of("1", kTetraMesh) + object_of("2", kTetraMesh), "");
  const std::string root = model(
      object_of("8", "<components>" + use_of("component", "1", " p:path='/3D/Objects/part.model'") +
                         use_of("component", "2",
                                " p:path='/3d/objects/PART.model'" + moved_by(0, 0, 5)) +
                         "</components>"),
      use_of("item", "8", moved_by(100, 50, 0)));
  const TriangleSoup mesh = soup({{"3D/Objects/part.model", part},
                                  {"3D/3dmodel.model", root},
                                  {"_rels/.rels", relations("/3D/3dmodel.model")}});
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_NEAR(signed_volume(mesh), 2.0 / 6, 1e-12);
  expect_box(bounds(mesh), {100, 50, 0}, {101, 51, 6});
  // A build item may name a part as well.
  const TriangleSoup item =
      soup({{"a.model", part},
            {"3D/3dmodel.model", model("", use_of("item", "2", " p:path='/a.model'"))}});
  EXPECT_NEAR(signed_volume(item), 1.0 / 6, 1e-12);
}

TEST_F(ThreeMf, NamesOfPartsMayBeEncoded) {
  const std::string part = model(object_of("1", kTetraMesh), "");
  for (const char* name : {"3D/my part.model", "3D/my%20part.model"}) {
    const TriangleSoup mesh =
        soup({{"3D/3dmodel.model", model("", use_of("item", "1", " p:path='/3D/my%20part.model'"))},
              {name, part}});
    EXPECT_NEAR(signed_volume(mesh), 1.0 / 6, 1e-12) << name;
  }
}

TEST_F(ThreeMf, ModelsWithoutTrianglesAreErrors) {
  for (const std::string& text :
       {model("", ""), model(object_of("1", kTetraMesh), ""),
        model(object_of("1", "<mesh><vertices/><triangles/></mesh>"), use_of("item", "1"))}) {
    const Error error = error_of({{"3D/3dmodel.model", text}});
    EXPECT_EQ(error.code, ErrorCode::kInput);
    EXPECT_NE(error.message.find("no build item has a triangle"), std::string::npos);
  }
}

TEST_F(ThreeMf, TheRootIsWhatTheRelationshipsName) {
  const auto only = [](double x) {
    return model(object_of("1", kTetraMesh), use_of("item", "1", moved_by(x, 0, 0)));
  };
  const Parts parts = {
      {"first.model", only(1)}, {"Other/x.model", only(2)}, {"3D/3dmodel.model", only(3)}};
  EXPECT_EQ(bounds(soup(parts)).low.x, 3);
  Parts related = parts;
  related.emplace_back("_rels/.rels", relations("/Other/x.model"));
  EXPECT_EQ(bounds(soup(related)).low.x, 2);
  EXPECT_EQ(bounds(soup({parts[0]})).low.x, 1);
}

TEST_F(ThreeMf, TransformsOfComponentsWithinComponentsAreNested) {
  // Turned by 90 degrees about z inside, moved outside; mirrored instances stay outward.
  const std::string resources =
      object_of("1", kTetraMesh) +
      object_of("2", "<components>" +
                         use_of("component", "1", " transform='0 1 0 -1 0 0 0 0 1 5 0 0'") +
                         "</components>") +
      object_of("3", "<components>" + use_of("component", "2", moved_by(0, 0, 1)) +
                         use_of("component", "2", " transform='1 0 0\n0 1 0\t0 0 -1   0 0 0'") +
                         "</components>");
  const TriangleSoup mesh =
      soup({{"3D/3dmodel.model", model(resources, use_of("item", "3", moved_by(10, 20, 30)))}});
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_NEAR(signed_volume(mesh), 2.0 / 6, 1e-12);
  // x, y of the tetrahedron become -y + 5, x; then the move of the item.
  expect_box(bounds(mesh), {14, 20, 29}, {15, 21, 32});
}

TEST_F(ThreeMf, WhatStandsAtOnePlaceIsTakenOnce) {
  // Ten of each next object, four deep, all at one place: 10,000 tetrahedra, or one.
  std::string resources = object_of("0", kTetraMesh);
  for (int level = 1; level <= 30; ++level) {
    std::string components;
    for (int i = 0; i < 10; ++i) components += use_of("component", std::to_string(level - 1));
    resources += object_of(std::to_string(level), "<components>" + components + "</components>");
  }
  EXPECT_EQ(soup({{"3D/3dmodel.model", model(resources, use_of("item", "4"))}}).triangles.size(),
            4u);
  EXPECT_EQ(soup({{"3D/3dmodel.model", model(resources, use_of("item", "30"))}}).triangles.size(),
            4u);
}

TEST_F(ThreeMf, BombsAndCyclesAreErrors) {
  // Ten of each next object at ten places, thirty deep.
  std::string resources = object_of("0", kTetraMesh);
  for (int level = 1; level <= 30; ++level) {
    std::string components;
    for (int i = 0; i < 10; ++i) {
      components +=
          use_of("component", std::to_string(level - 1), moved_by(i * std::pow(10.0, level), 0, 0));
    }
    resources += object_of(std::to_string(level), "<components>" + components + "</components>");
  }
  const Error bomb = error_of({{"3D/3dmodel.model", model(resources, use_of("item", "30"))}});
  EXPECT_EQ(bomb.code, ErrorCode::kLimit);
  EXPECT_NE(bomb.message.find("more than 1000000 objects"), std::string::npos) << bomb.message;
  const auto loop = [](const std::string& id, const std::string& path) {
    return object_of("1", "<components>" + use_of("component", id, path) + "</components>");
  };
  const Error self = error_of({{"3D/3dmodel.model", model(loop("1", ""), use_of("item", "1"))}});
  EXPECT_EQ(self.code, ErrorCode::kInput);
  EXPECT_NE(self.message.find("a.3mf/3D/3dmodel.model:4: object '1' is a component of itself"),
            std::string::npos)
      << self.message;
  const Error two =
      error_of({{"3D/3dmodel.model", model(loop("1", " p:path='/b.model'"), use_of("item", "1"))},
                {"b.model", model(loop("1", " p:path='/3D/3dmodel.model'"), "")}});
  EXPECT_NE(two.message.find("a.3mf/b.model:4: object '1' is a component of itself"),
            std::string::npos)
      << two.message;
}

TEST_F(ThreeMf, MissingPartsObjectsAndNumbersAreNamed) {
  const auto message = [&](const std::string& item, const std::string& more = "") {
    return error_of(
               {{"3D/3dmodel.model", model(object_of("1", kTetraMesh), use_of("item", item, more))},
                {"b.model", "<model><resources/></model>"},
                {"c.model", "<model>"}})
        .message;
  };
  const auto expect = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  expect(message("2"), "a.3mf/3D/3dmodel.model:7: there is no object '2'");
  expect(message("1", " p:path='/x.model'"), ":7: there is no part '/x.model'");
  expect(message("1", " p:path='/b.model'"), ":7: there is no object '1' in part '/b.model'");
  expect(message("1", " p:path='/c.model'"), "a.3mf/c.model:1: ");
  expect(message("1", " transform='1 2 3'"), ":7: a transform must have 12 numbers");
  expect(message("1", " transform='1e300 0 0 0 1 0 0 0 1e300 1e308 0 0 7'"),
         "12 numbers, got more");
  expect(error_of({{"readme", ""}}).message, "a.3mf: the archive has no model");
  expect(error_of({{"_rels/.rels", relations("/x.model")}}).message, "there is no part '/x.model'");
  EXPECT_EQ(read_3mf(write("b.3mf", "no archive")).error().code, ErrorCode::kInput);
}

TEST_F(ThreeMf, UnitsAreNamedAndNumbersStay) {
  // OpenSCAD 2021.01 and 2025 take the numbers as they are.
  const std::string scene = write("s.csg", "import(file = \"a.3mf\");");
  const auto write_with = [&](const std::string& more) {
    write("a.3mf",
          zip_of({{"a.model", model(object_of("1", kTetraMesh), use_of("item", "1"), more)}}));
  };
  for (const auto& [unit, factor] :
       {std::pair("inch", "25.4"), {"meter", "1000"}, {"micron", "0.001"}}) {
    write_with(fmt::format("unit='{}'", unit));
    const Scene read_back = read(scene);
    ASSERT_EQ(read_back.warnings.size(), 1u) << unit;
    const std::string& text = read_back.warnings[0].message;
    EXPECT_NE(text.find(fmt::format("its unit is the {};", unit)), std::string::npos) << text;
    EXPECT_NE(text.find(fmt::format("scale({})", factor)), std::string::npos) << text;
  }
  for (const char* more : {"unit='millimeter'", ""}) {
    write_with(more);
    EXPECT_TRUE(read(scene).warnings.empty());
  }
}

TEST_F(ThreeMf, EveryTruncationIsRefusedOrRead) {
  const std::string whole =
      zip_of({{"3D/3dmodel.model", model(object_of("1", kTetraMesh), use_of("item", "1"))}});
  for (std::size_t length = 0; length < whole.size(); length += 7) {
    const auto mesh = read_3mf(write("a.3mf", whole.substr(0, length)));
    ASSERT_FALSE(mesh.has_value()) << length;
    EXPECT_EQ(mesh.error().code, ErrorCode::kInput);
  }
}

}  // namespace
}  // namespace strata::csg
