#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "mesh/archives/read_3mf_amf.h"
#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/read_mesh.h"
#include "strata/mesh/soup_tools.h"
#include "tests/csg/scene/zip_files.h"
#include "tests/mesh/textures/picture_bytes.h"
#include "tests/support/temporary_folder.h"

namespace strata {
namespace {

using namespace std::string_literals;
using Files = std::vector<std::pair<std::string, std::string>>;

const std::string kVertices =
    "<vertices><vertex x='0' y='0' z='0'/><vertex x='1' y='0' z='0'/><vertex x='0' y='1' z='0'/>"
    "<vertex x='0' y='0' z='1'/></vertices>";

/// A tetrahedron. @param looks  attributes of each of its triangles
std::string tetra(const std::vector<std::string>& looks = {"", "", "", ""}) {
  const char* const corners[] = {"v1='0' v2='2' v3='1'", "v1='0' v2='1' v3='3'",
                                 "v1='0' v2='3' v3='2'", "v1='1' v2='2' v3='3'"};
  std::string text = "<mesh>" + kVertices + "<triangles>";
  for (std::size_t i = 0; i < 4; ++i) {
    text += fmt::format("<triangle {} {}/>", corners[i], looks[i]);
  }
  return text + "</triangles></mesh>";
}

std::string model(const std::string& resources, const std::string& items,
                  const std::string& unit = "") {
  return "<?xml version='1.0'?><model " + unit + " xmlns:m='materials'><resources>" + resources +
         "</resources><build>" + items + "</build></model>";
}

class ArchiveLooks : public testing::Test {
 protected:
  ArchiveModel read(const Files& files, const ArchiveOptions& options = {.attributes = true}) {
    auto result = read_3mf_model(place_.write("a.3mf", csg::zip_of(files)), options);
    EXPECT_TRUE(result.has_value()) << result.error().message;
    return result ? *std::move(result) : ArchiveModel();
  }
  ArchiveModel read(const std::string& text, const ArchiveOptions& options = {.attributes = true}) {
    return read(Files{{"3D/3dmodel.model", text}}, options);
  }
  ArchiveModel read_amf(const std::string& content, const std::string& unit = "") {
    auto result = read_amf_model(
        place_.write("a.amf", "<?xml version='1.0'?><amf " + unit + ">" + content + "</amf>"),
        {.attributes = true});
    EXPECT_TRUE(result.has_value()) << result.error().message;
    return result ? *std::move(result) : ArchiveModel();
  }
  const testkit::TemporaryFolder place_;
};

std::vector<std::string> names_of(const MeshAttributes& attributes) {
  std::vector<std::string> names;
  for (const MeshPart& part : attributes.parts) names.push_back(part.name);
  return names;
}

TEST_F(ArchiveLooks, PartsAreMeshesAtTheirPlaces) {
  const std::string text = model(
      "<object id='1' name='bolt'>" + tetra() + "</object><object id='2'>" + tetra() +
          "</object><object id='3' name='pair'><components><component objectid='1'/>"
          "<component objectid='2' transform='1 0 0 0 1 0 0 0 1 5 0 0'/></components></object>",
      "<item objectid='3'/><item objectid='2' transform='1 0 0 0 1 0 0 0 1 9 0 0'/>"
      "<item objectid='1' transform='1 0 0 0 1 0 0 0 1 0 9 0'/>");
  const std::vector<std::string> wanted = {"bolt", "pair", "object 2", "bolt (2)"};
  for (const ArchiveOptions& options :
       {ArchiveOptions{.attributes = true}, ArchiveOptions{.parts = true}}) {
    const ArchiveModel found = read(text, options);
    EXPECT_EQ(names_of(found.attributes), wanted);
    for (std::uint32_t face = 0; face < 16; ++face) {
      EXPECT_EQ(found.attributes.part_of(face), face / 4) << face;
    }
    EXPECT_NEAR(signed_volume(found.soup), 4.0 / 6, 1e-12);
  }
  EXPECT_TRUE(read(text, {}).attributes.parts.empty());
}

TEST_F(ArchiveLooks, BaseMaterialsOfObjectsAndTriangles) {
  const ArchiveModel found =
      read(model("<basematerials id='5'><base name='red' displaycolor='#FF0000'/>"
                 "<base name='glass' displaycolor='#00FF0080'/><base name='none'/></basematerials>"
                 "<object id='1' pid='5' pindex='1'>" +
                     tetra({"", "pid='5' p1='0'", "p1='2'", "pid='9' p1='0'"}) + "</object>",
                 "<item objectid='1'/>"));
  const MeshAttributes& look = found.attributes;
  ASSERT_EQ(look.materials.size(), 3u);
  EXPECT_EQ(look.materials[0].name, "red");
  EXPECT_EQ(look.materials[0].colour, glm::vec4(1, 0, 0, 1));
  EXPECT_NEAR(look.materials[1].colour.w, 128 / 255.0, 1e-6);
  EXPECT_FALSE(look.materials[2].coloured);
  EXPECT_EQ(look.material_of(0), 1u);
  EXPECT_EQ(look.material_of(1), 0u);
  EXPECT_EQ(look.material_of(2), 2u);
  EXPECT_EQ(look.material_of(3), MeshAttributes::kNone);
  EXPECT_TRUE(look.coloured());
}

TEST_F(ArchiveLooks, ColourGroupsGiveFacesOrCornersTheirColours) {
  const ArchiveModel found = read(
      model("<m:colorgroup id='7'><m:color color='#FF0000FF'/><m:color color='#0000FF'/>"
            "<m:color color='red'/></m:colorgroup><object id='1'>" +
                tetra({"pid='7' p1='1'", "pid='7' p1='0' p2='1' p3='1'", "", "pid='7' p1='8'"}) +
                "</object>",
            "<item objectid='1' transform='-1 0 0 0 1 0 0 0 1 0 0 0'/>"));
  const MeshAttributes& look = found.attributes;
  const glm::u8vec4 red(255, 0, 0, 255), blue(0, 0, 255, 255), white(255);
  EXPECT_EQ(look.element_colours, (std::vector<glm::u8vec4>{blue, white, white, white}));
  EXPECT_TRUE(look.corner_colours);
  EXPECT_TRUE(look.corners_of(0).empty());
  const auto corners = look.corners_of(1);
  ASSERT_EQ(corners.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    // vertex 0 is red, the others are blue, also where the object is mirrored
    EXPECT_EQ(corners[i].vertex, found.soup.triangles[1][static_cast<int>(i)]);
    EXPECT_EQ(corners[i].colour, corners[i].vertex == 0 ? red : blue);
  }
  EXPECT_NEAR(signed_volume(found.soup), 1.0 / 6, 1e-12);
  ASSERT_EQ(found.warnings.size(), 2u);
  EXPECT_NE(found.warnings[0].find("a colour is not #RRGGBB or #RRGGBBAA"), std::string::npos);
  EXPECT_NE(found.warnings[1].find("no property 8 in the group '7'"), std::string::npos);
}

TEST_F(ArchiveLooks, TexturesOfTheArchive) {
  const std::string picture = testing_textures::rgba_png(1, 2, "\xff\0\0\xff\0\0\xff\xff"s);
  const std::string text = model(
      "<m:texture2d id='3' path='/3D/Textures/a.png' contenttype='image/png' "
      "tilestyleu='mirror' tilestylev='clamp'/>"
      "<m:texture2dgroup id='4' texid='3'><m:tex2coord u='0' v='0'/>"
      "<m:tex2coord u='1' v='0.25'/><m:tex2coord u='0.5' v='2'/></m:texture2dgroup>"
      "<object id='1'>" +
          tetra({"pid='4' p1='0' p2='1' p3='2'", "", "", ""}) + "</object>",
      "<item objectid='1'/>");
  const ArchiveModel found = read({{"3D/3dmodel.model", text}, {"3D/Textures/a.png", picture}});
  const MeshAttributes& look = found.attributes;
  ASSERT_EQ(look.textures.size(), 1u);
  EXPECT_EQ(look.textures[0].height, 2);
  EXPECT_EQ(look.textures[0].wrap_u, TextureWrap::kMirror);
  EXPECT_EQ(look.textures[0].wrap_v, TextureWrap::kClamp);
  const auto corners = look.corners_of(0);
  ASSERT_EQ(corners.size(), 3u);
  EXPECT_EQ(corners[1].texture_at, glm::vec2(1, 0.25));
  EXPECT_EQ(corners[2].texture_at, glm::vec2(0.5, 2));
  const std::uint32_t material = look.material_of(0);
  ASSERT_LT(material, look.materials.size());
  EXPECT_EQ(look.materials[material].texture, 0u);
  EXPECT_EQ(look.material_of(1), MeshAttributes::kNone);
  // a picture that is missing is a warning, and none is looked for unless asked
  const ArchiveModel missing = read(text);
  EXPECT_TRUE(missing.attributes.textures.empty());
  ASSERT_EQ(missing.warnings.size(), 1u);
  EXPECT_NE(missing.warnings[0].find("there is no picture '/3D/Textures/a.png'"),
            std::string::npos);
  EXPECT_TRUE(read(text, {.attributes = true, .textures = false}).warnings.empty());
}

std::string moved(double x) { return fmt::format(" transform='1 0 0 0 1 0 0 0 1 {} 0 0'", x); }

TEST_F(ArchiveLooks, BambuStudioNamesPartsAndMarksWhatIsNoSolid) {
  const std::string settings =
      "<?xml version='1.0'?><config><object id='8'><metadata key='name' value='bracket'/>"
      "<metadata key='extruder' value='1'/>"
      "<part id='1' subtype='normal_part'><metadata key='name' value='arm &amp; hand'/></part>"
      "<part id='2' subtype='normal_part'/>"
      "<part id='3' subtype='modifier_part'><metadata key='name' value='infill'/></part>"
      "<part id='4' subtype='negative_part'><metadata key='name' value='hole'/></part></object>"
      "<object id='9'><metadata key='name' value='alone'/><part id='1' subtype='normal_part'>"
      "<metadata key='name' value='mesh_1'/></part></object>"
      "<plate><metadata key='plater_id' value='1'/></plate></config>";
  std::string parts, components;
  for (int id = 1; id <= 4; ++id) {
    parts += fmt::format("<object id='{}' type='{}'>{}</object>", id, id == 3 ? "other" : "model",
                         tetra());
    components += fmt::format("<component objectid='{}' p:path='/3D/Objects/o.model'{}/>", id,
                              moved(2.0 * id));
  }
  const std::string root =
      model("<object id='8' type='model'><components>" + components +
                "</components></object><object id='9' type='model'><components>"
                "<component objectid='1' p:path='/3D/Objects/o.model'/></components></object>",
            "<item objectid='8'/><item objectid='9'" + moved(20) + "/>");
  for (const bool looks : {true, false}) {
    const ArchiveModel found = read(Files{{"3D/Objects/o.model", model(parts, "")},
                                          {"3D/3dmodel.model", root},
                                          {"Metadata/model_settings.config", settings}},
                                    {.attributes = looks, .parts = true});
    EXPECT_EQ(names_of(found.attributes),
              (std::vector<std::string>{"bracket/arm & hand", "bracket", "alone"}));
    EXPECT_NEAR(signed_volume(found.soup), 3.0 / 6, 1e-12);
    ASSERT_EQ(found.warnings.size(), 1u);
    EXPECT_NE(found.warnings[0].find("2 objects are left out, which are no solids: "
                                     "'bracket/infill' (modifier), 'bracket/hole' (negative "
                                     "volume)"),
              std::string::npos)
        << found.warnings[0];
  }
  // A file of settings that is damaged is told, and the model is read.
  const ArchiveModel damaged =
      read(Files{{"3D/Objects/o.model", model(parts, "")},
                 {"3D/3dmodel.model", root},
                 {"Metadata/model_settings.config", settings.substr(0, 300)}});
  ASSERT_EQ(damaged.warnings.size(), 2u);
  EXPECT_NE(damaged.warnings[0].find("model_settings.config:1: "), std::string::npos);
  EXPECT_NE(damaged.warnings[0].find("names of parts are not read"), std::string::npos);
}

TEST_F(ArchiveLooks, PrusaSlicerDividesMeshesIntoVolumes) {
  std::string vertices, triangles;
  for (int k = 0; k < 4; ++k) {
    for (const char* at : {"x='{}' y='0' z='0'", "x='{}' y='1' z='0'", "x='{}' y='0' z='1'"}) {
      vertices += "<vertex " + fmt::format(fmt::runtime(at), 2 * k) + "/>";
    }
    vertices += fmt::format("<vertex x='{}' y='0' z='0'/>", 2 * k + 1);
    const auto triangle = [&](int a, int b, int c) {
      triangles +=
          fmt::format("<triangle v1='{}' v2='{}' v3='{}'/>", 4 * k + a, 4 * k + b, 4 * k + c);
    };
    triangle(0, 1, 3), triangle(0, 3, 2), triangle(0, 2, 1), triangle(1, 2, 3);
    if (k == 0) triangle(1, 1, 2);  // a face that is dropped counts
  }
  const std::string object = "<object id='1'><mesh><vertices>" + vertices +
                             "</vertices><triangles>" + triangles + "</triangles></mesh></object>";
  const auto volume = [](int first, int last, const std::string& name, const std::string& more) {
    return fmt::format(
        "<volume firstid='{}' lastid='{}'><metadata type='volume' key='name' value='{}'/>{}"
        "</volume>",
        first, last, name, more);
  };
  const std::string settings =
      "<config><object id='1' instances_count='2'><metadata type='object' key='name' "
      "value='plate'/>" +
      volume(0, 4, "left", "<metadata type='volume' key='volume_type' value='ModelPart'/>") +
      volume(5, 8, "less",
             "<metadata type='volume' key='volume_type' value='ParameterModifier'/>") +
      volume(9, 12, "right", "") +
      volume(13, 16, "old", "<metadata type='volume' key='modifier' value='1'/>") +
      "</object></config>";
  const Files files = {{"3D/3dmodel.model",
                        model(object, "<item objectid='1'/><item objectid='1'" + moved(10) + "/>")},
                       {"Metadata/Slic3r_PE_model.config", settings}};
  const ArchiveModel found = read(files);
  EXPECT_EQ(
      names_of(found.attributes),
      (std::vector<std::string>{"plate/left", "plate/right", "plate/left (2)", "plate/right (2)"}));
  ASSERT_EQ(found.soup.triangles.size(), 16u);
  for (std::uint32_t t = 0; t < 16; ++t) {
    EXPECT_EQ(found.attributes.part_of(t), t / 4) << t;
    const double x = found.soup.positions[found.soup.triangles[t].x].x;
    const double low[] = {0, 4, 10, 14};
    EXPECT_GE(x, low[t / 4]) << t;
    EXPECT_LE(x, low[t / 4] + 1) << t;
  }
  EXPECT_NEAR(signed_volume(read(files, {}).soup), 4.0 / 6, 1e-12);
  ASSERT_EQ(found.warnings.size(), 1u);
  EXPECT_NE(found.warnings[0].find("'plate/less' (modifier), 'plate/old' (modifier)"),
            std::string::npos)
      << found.warnings[0];
}

TEST_F(ArchiveLooks, WhatIsNoSolidIsLeftOutAndTold) {
  for (const char* type : {"support", "solidsupport", "other"}) {
    const std::string aside =
        fmt::format("<object id='2' name='brim' type='{}'>{}</object>", type, tetra());
    const ArchiveModel found =
        read(model("<object id='1' type='model'>" + tetra() + "</object>" + aside,
                   "<item objectid='1'/><item objectid='2'" + moved(5) + "/>"));
    EXPECT_NEAR(signed_volume(found.soup), 1.0 / 6, 1e-12);
    ASSERT_EQ(found.warnings.size(), 1u);
    EXPECT_NE(found.warnings[0].find(
                  fmt::format("a.3mf: 1 object is left out, which is no solid: 'brim' ({})", type)),
              std::string::npos)
        << found.warnings[0];
    const auto none = read_3mf_model(
        place_.write("b.3mf",
                     csg::zip_of({{"3D/3dmodel.model", model(aside, "<item objectid='2'/>")}})),
        {});
    ASSERT_FALSE(none.has_value());
    EXPECT_NE(none.error().message.find("no build item is a solid"), std::string::npos);
  }
  EXPECT_TRUE(
      read(model("<object id='1' type='surface'>" + tetra() + "</object>", "<item objectid='1'/>"))
          .warnings.empty());
}

TEST_F(ArchiveLooks, PropertiesThatDoNotExistAreTold) {
  const std::string groups =
      "<basematerials id='5'><base name='red' displaycolor='#FF0000'/></basematerials>"
      "<m:colorgroup id='7'><m:color color='#FF0000FF'/></m:colorgroup>";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {" pid='9' pindex='0'", "object '1': there is no property group '9' (pid); 4 triangles have"},
      {" pid='5' pindex='1'",
       "object '1': there is no property 1 in the group '5', which has 1; 4"},
      {" pid='7'", "object '1': it names the property group '7' (pid), but no property of it"}};
  for (const auto& [attributes, text] : cases) {
    const ArchiveModel found =
        read(model(groups + "<object id='1'" + attributes + ">" + tetra() + "</object>",
                   "<item objectid='1'/>"));
    ASSERT_EQ(found.warnings.size(), 1u) << attributes;
    EXPECT_NE(found.warnings[0].find(text), std::string::npos) << found.warnings[0];
    EXPECT_EQ(found.soup.triangles.size(), 4u);
  }
  const ArchiveModel one =
      read(model(groups + "<object id='1' pid='5' pindex='0'>" +
                     tetra({"", "pid='7' p1='0' p2='3'", "pid='7' p1='0'", ""}) + "</object>",
                 "<item objectid='1'/>"));
  ASSERT_EQ(one.warnings.size(), 1u);
  EXPECT_NE(one.warnings[0].find("there is no property 3 in the group '7', which has 1; this "
                                 "triangle has no colour"),
            std::string::npos)
      << one.warnings[0];
}

TEST_F(ArchiveLooks, SingularTransformsNameTheObject) {
  for (const char* matrix : {"0 0 0 0 0 0 0 0 0 0 0 0", "1 0 0 0 1 0 0 0 0 5 5 5",
                             "1 2 3 2 4 6 0 0 1 0 0 0", "0.1 0.2 0.3 0.3 0.6 0.9 1 0 0 0 0 0"}) {
    const auto refused = read_3mf_model(
        place_.write(
            "b.3mf",
            csg::zip_of({{"3D/3dmodel.model",
                          model("<object id='12'>" + tetra() + "</object>",
                                fmt::format("<item objectid='12' transform='{}'/>", matrix))}})),
        {});
    ASSERT_FALSE(refused.has_value()) << matrix;
    EXPECT_EQ(refused.error().code, ErrorCode::kInput);
    EXPECT_NE(refused.error().message.find("the transform of object '12' is singular"),
              std::string::npos)
        << refused.error().message;
  }
  // Small, and long and thin, are not singular.
  for (const char* matrix : {"1e-6 0 0 0 1e-6 0 0 0 1e-6 0 0 0", "1e6 0 0 0 1 0 0 0 1e-6 0 0 0",
                             "1e200 0 0 0 1e200 0 0 0 1e-200 0 0 0"}) {
    EXPECT_EQ(read(model("<object id='1'>" + tetra() + "</object>",
                         fmt::format("<item objectid='1' transform='{}'/>", matrix)))
                  .soup.triangles.size(),
              4u);
  }
}

TEST_F(ArchiveLooks, EveryTruncatedLengthSaysWhatItIs) {
  const std::string whole =
      csg::zip_of({{"3D/3dmodel.model",
                    model("<object id='1'>" + tetra() + "</object>", "<item objectid='1'/>")}});
  ASSERT_TRUE(read_3mf_model(place_.write("b.3mf", whole), {}).has_value());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto refused = read_3mf_model(place_.write("b.3mf", whole.substr(0, size)), {});
    ASSERT_FALSE(refused.has_value()) << size;
    EXPECT_NE(refused.error().message.find(
                  size == 0 ? "b.3mf: the file is empty"
                            : fmt::format("b.3mf: the file ends in the middle: {} bytes", size)),
              std::string::npos)
        << size << refused.error().message;
  }
  const auto text = read_3mf_model(place_.write("b.3mf", "solid\nfacet\n"), {});
  EXPECT_NE(text.error().message.find("not a zip archive"), std::string::npos);
  const auto none = read_3mf_model(place_.file("none.3mf"), {});
  EXPECT_NE(none.error().message.find("none.3mf: No such file"), std::string::npos)
      << none.error().message;
}

TEST_F(ArchiveLooks, UnitsAreKept) {
  const auto of = [](const std::string& unit) {
    return model("<object id='1'>" + tetra() + "</object>", "<item objectid='1'/>", unit);
  };
  for (const auto& [unit, metres] :
       std::vector<std::pair<std::string, double>>{{"", 1e-3},
                                                   {"millimeter", 1e-3},
                                                   {"micron", 1e-6},
                                                   {"centimeter", 1e-2},
                                                   {"inch", 0.0254},
                                                   {"foot", 0.3048},
                                                   {"meter", 1.0}}) {
    const std::string text = unit.empty() ? "" : "unit='" + unit + "'";
    EXPECT_EQ(read(of(text)).unit_metres, metres) << unit;
    EXPECT_TRUE(read(of(text)).warnings.empty()) << unit;
    const auto file =
        read_mesh(place_.write("b.3mf", csg::zip_of({{"3D/3dmodel.model", of(text)}})), {}, {});
    ASSERT_TRUE(file.has_value());
    EXPECT_EQ(file->stats.unit_metres, metres);
    EXPECT_TRUE(file->attributes.parts.empty());
  }
}

std::string amf_vertex(double x, double y, double z, const std::string& more = "") {
  return fmt::format("<vertex><coordinates><x>{}</x><y>{}</y><z>{}</z></coordinates>{}</vertex>", x,
                     y, z, more);
}
std::string amf_triangle(int a, int b, int c, const std::string& more = "") {
  return fmt::format("<triangle>{}<v1>{}</v1><v2>{}</v2><v3>{}</v3></triangle>", more, a, b, c);
}
std::string amf_colour(double r, double g, double b) {
  return fmt::format("<color><r>{}</r><g>{}</g><b>{}</b></color>", r, g, b);
}

TEST_F(ArchiveLooks, AmfVolumesAreParts) {
  const std::string corners = amf_vertex(0, 0, 0) + amf_vertex(1, 0, 0) + amf_vertex(0, 1, 0);
  const ArchiveModel found =
      read_amf("<object id='1'><metadata type='name'>gear</metadata><mesh><vertices>" + corners +
                   "</vertices><volume>" + amf_triangle(0, 1, 2) + "</volume><volume>" +
                   amf_triangle(2, 1, 0) + "</volume><volume><metadata type='name'>rim</metadata>" +
                   amf_triangle(0, 1, 2) +
                   "</volume><volume/></mesh></object><object id='4'><mesh><vertices>" + corners +
                   "</vertices><volume>" + amf_triangle(0, 1, 2) + "</volume></mesh></object>",
               "unit='inch'");
  EXPECT_EQ(names_of(found.attributes),
            (std::vector<std::string>{"gear", "gear (2)", "rim", "object 4"}));
  EXPECT_EQ(found.attributes.part_of(3), 3u);
  EXPECT_EQ(found.unit_metres, 0.0254);
}

TEST_F(ArchiveLooks, AmfColoursOfTheSmallestThingCount) {
  const std::string corners = amf_vertex(0, 0, 0) + amf_vertex(1, 0, 0, amf_colour(0, 1, 0)) +
                              amf_vertex(0, 1, 0) + amf_vertex(0, 0, 1);
  const ArchiveModel found =
      read_amf("<material id='2'><metadata type='name'>steel</metadata>" +
               amf_colour(0.5, 0.5, 0.5) + "</material><object id='1'><mesh><vertices>" + corners +
               "</vertices><volume materialid='2'>" + amf_triangle(0, 2, 3) +
               amf_triangle(0, 2, 3, amf_colour(1, 0, 0)) + amf_triangle(0, 1, 2) +
               "</volume><volume materialid='2'>" + amf_colour(0, 0, 1) + amf_triangle(0, 2, 3) +
               "</volume></mesh></object>");
  const MeshAttributes& look = found.attributes;
  const glm::u8vec4 grey(128, 128, 128, 255), green(0, 255, 0, 255), white(255);
  ASSERT_EQ(look.materials.size(), 1u);
  EXPECT_EQ(look.materials[0].name, "steel");
  EXPECT_EQ(look.material_of(0), 0u);
  EXPECT_EQ(look.material_of(1), MeshAttributes::kNone);
  EXPECT_EQ(look.element_colours,
            (std::vector<glm::u8vec4>{white, {255, 0, 0, 255}, white, {0, 0, 255, 255}}));
  const auto mixed = look.corners_of(2);
  ASSERT_EQ(mixed.size(), 3u);
  EXPECT_EQ(mixed[0].colour, grey);
  EXPECT_EQ(mixed[1].colour, green);
  EXPECT_EQ(mixed[2].colour, grey);
}

}  // namespace
}  // namespace strata
