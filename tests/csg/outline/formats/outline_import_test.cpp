#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/common.hpp>
#include <numbers>
#include <random>

#include "csg/outline/formats/outline_import.h"
#include "csg/outline/outline.h"
#include "mesh/polygons/plane_predicates.h"
#include "tests/csg/outline/outline_checks.h"
#include "tests/support/temporary_folder.h"

namespace strata::csg {
namespace {

using testing::area;

std::string dxf(const std::string& entities, const std::string& blocks = "") {
  return "0\nSECTION\n2\nBLOCKS\n" + blocks + "0\nENDSEC\n0\nSECTION\n2\nENTITIES\n" + entities +
         "0\nENDSEC\n0\nEOF\n";
}

std::string line(double x1, double y1, double x2, double y2, const char* layer = "0") {
  return fmt::format("0\nLINE\n8\n{}\n10\n{}\n20\n{}\n11\n{}\n21\n{}\n", layer, x1, y1, x2, y2);
}

std::string square(double x, double y, double side, const char* layer = "0") {
  return line(x, y, x + side, y, layer) + line(x + side, y, x + side, y + side, layer) +
         line(x, y + side, x + side, y + side, layer) + line(x, y, x, y + side, layer);
}

/// What readers made of damaged bytes.
struct Outcomes {
  int read = 0, refused = 0;

  void add(const Result<Outline>& outline, const std::string& file) {
    if (!outline) {
      ++refused;
      EXPECT_EQ(outline.error().code, ErrorCode::kInput) << outline.error().message;
      EXPECT_TRUE(outline.error().message.starts_with(file)) << outline.error().message;
      return;
    }
    ++read;
    for (const auto& contour : outline->contours) {
      EXPECT_GE(contour.size(), 3u);
      for (const glm::dvec2& p : contour) {
        EXPECT_TRUE(std::isfinite(p.x) && std::isfinite(p.y)) << p.x << ", " << p.y;
      }
    }
  }
};

Outline drawn(const std::string& text, const OutlineImport& options = {}) {
  const auto outline = read_dxf(text, "t.dxf", options);
  EXPECT_TRUE(outline) << (outline ? "" : outline.error().message);
  return outline ? *outline : Outline{};
}

std::string dxf_error(const std::string& text) {
  const auto outline = read_dxf(text, "t.dxf", {});
  EXPECT_FALSE(outline);
  if (outline) return "";
  EXPECT_EQ(outline.error().code, ErrorCode::kInput);
  return outline.error().message;
}

TEST(DxfReader, TextMayBeginWithAByteOrderMark) {
  const std::string text = dxf(square(0, 0, 10));
  EXPECT_EQ(drawn("\xef\xbb\xbf" + text).contours, drawn(text).contours);
  EXPECT_EQ(drawn(text).contours.size(), 1u);
  std::string wide = "\xff\xfe";
  for (const char c : text) wide += {c, '\0'};
  EXPECT_NE(dxf_error(wide).find("is UTF-16 text"), std::string::npos) << dxf_error(wide);
}

TEST(DxfReader, LinesInAnyOrderAndDirectionJoin) {
  EXPECT_DOUBLE_EQ(area(drawn(dxf(square(1, 2, 3)))), 9);
  // A hole is what lies in something else; ends may be off by rounding.
  EXPECT_NEAR(area(drawn(dxf(square(0, 0, 10) + line(2, 2, 4, 2.000001) + line(4, 2, 4, 4) +
                             line(4, 4, 2, 2)))),
              98, 1e-4);
}

TEST(DxfReader, OneLayerOriginAndScale) {
  const std::string text = dxf(square(0, 0, 2, "a") + square(10, 0, 3, "b"));
  EXPECT_DOUBLE_EQ(area(drawn(text)), 13);
  OutlineImport options;
  options.layer = "b";
  EXPECT_DOUBLE_EQ(area(drawn(text, options)), 9);
  options.origin = {10, 0};
  options.scale = 2;
  const Outline scaled = drawn(text, options);
  EXPECT_DOUBLE_EQ(area(scaled), 36);
  EXPECT_EQ(scaled.contours[0].size(), 4u);
  for (const glm::dvec2& p : scaled.contours[0]) EXPECT_TRUE(p.x == 0 || p.x == 6) << p.x;
}

TEST(DxfReader, CirclesArcsAndEllipsesHaveOpenScadsSegments) {
  const Outline circle = drawn(dxf("0\nCIRCLE\n8\n0\n10\n1\n20\n2\n40\n30\n"));
  ASSERT_EQ(circle.contours.size(), 1u);
  EXPECT_EQ(circle.contours[0].size(), 30u);
  EXPECT_NEAR(area(circle), 30 * 0.5 * 900 * std::sin(2 * std::numbers::pi / 30), 1e-6);
  const Outline half = drawn(dxf("0\nARC\n8\n0\n10\n0\n20\n0\n40\n30\n50\n270\n51\n90\n"));
  EXPECT_NEAR(area(half), 15 * 0.5 * 900 * std::sin(2 * std::numbers::pi / 30), 1e-6);
  const Outline ellipse = drawn(dxf(
      "0\nELLIPSE\n8\n0\n10\n0\n20\n0\n11\n0\n21\n30\n40\n0.5\n41\n0\n42\n6.283185307179586\n"));
  EXPECT_NEAR(area(ellipse), area(circle) / 2, 1e-6);
}

TEST(DxfReader, PolylinesOldAndNewWithBulges) {
  const std::string light =
      "0\nLWPOLYLINE\n8\n0\n90\n4\n70\n1\n10\n0\n20\n0\n10\n4\n20\n0\n10\n4\n20\n4\n10\n0\n20\n4\n";
  EXPECT_DOUBLE_EQ(area(drawn(dxf(light))), 16);
  // Two half circles: a bulge of 1 turns by 180 degrees.
  OutlineImport options;
  options.segments.fn = 400;
  const Outline round =
      drawn(dxf("0\nLWPOLYLINE\n70\n1\n10\n-1\n20\n0\n42\n1\n10\n1\n20\n0\n42\n1\n"), options);
  EXPECT_NEAR(area(round), std::numbers::pi, 1e-3);
  const std::string old =
      "0\nPOLYLINE\n8\n0\n66\n1\n70\n1\n0\nVERTEX\n10\n0\n20\n0\n0\nVERTEX\n10\n3\n20\n0\n"
      "0\nVERTEX\n10\n0\n20\n4\n0\nSEQEND\n";
  EXPECT_DOUBLE_EQ(area(drawn(dxf(old))), 6);
}

TEST(DxfReader, SplineIsEvaluated) {
  // A quarter circle as a rational curve, closed by two lines.
  const std::string spline =
      "0\nSPLINE\n8\n0\n70\n8\n71\n2\n40\n0\n40\n0\n40\n0\n40\n1\n40\n1\n40\n1\n"
      "41\n1\n41\n0.7071067811865476\n41\n1\n10\n1\n20\n0\n10\n1\n20\n1\n10\n0\n20\n1\n";
  OutlineImport options;
  options.segments.fn = 800;
  const Outline quarter = drawn(dxf(spline + line(0, 1, 0, 0) + line(0, 0, 1, 0)), options);
  EXPECT_NEAR(area(quarter), std::numbers::pi / 4, 1e-3);
}

TEST(DxfReader, BlocksAreInsertedTurnedAndScaled) {
  const std::string blocks =
      "0\nBLOCK\n8\n0\n2\nbox\n10\n0\n20\n0\n" + square(0, 0, 1) + "0\nENDBLK\n";
  const Outline outline =
      drawn(dxf("0\nINSERT\n8\n0\n2\nbox\n10\n5\n20\n5\n41\n2\n42\n3\n50\n90\n"
                "0\nINSERT\n8\n0\n2\nbox\n10\n20\n20\n0\n70\n3\n71\n2\n44\n2\n45\n2\n",
                blocks));
  EXPECT_NEAR(area(outline), 6 + 6, 1e-9);
  EXPECT_EQ(outline.contours.size(), 7u);
}

TEST(DxfReader, EndsWithinTheFilesPrecisionAreOnePointInAnyOrder) {
  std::mt19937 random(5);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<>(low, high)(random);
  };
  for (int round = 0; round < 300; ++round) {
    // A ring of 20 lines; every end is rounded by itself, on one side or the other.
    const int decimals = 3 + round % 4;
    const double unit = std::pow(10.0, -decimals);
    std::vector<glm::dvec2> ring;
    for (int i = 0; i < 20; ++i) {
      const double a = (i + between(0.1, 0.9)) * std::numbers::pi / 10, r = between(20, 50);
      // Odd multiples of half a unit among them, and of the grid that OpenSCAD has.
      const double step = round % 2 == 0 ? unit / 2 : 5e-6;
      ring.push_back(glm::round(r * glm::dvec2(std::cos(a), std::sin(a)) / step) * step);
    }
    const auto written = [&](const glm::dvec2& p) {
      return glm::dvec2(p.x + between(-0.499, 0.499) * unit, p.y + between(-0.499, 0.499) * unit);
    };
    std::vector<std::string> lines;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      glm::dvec2 from = written(ring[i]), to = written(ring[(i + 1) % ring.size()]);
      if (random() % 2) std::swap(from, to);
      lines.push_back(
          fmt::format("0\nLINE\n8\n0\n10\n{:.{}f}\n20\n{:.{}f}\n11\n{:.{}f}\n21\n{:.{}f}\n", from.x,
                      decimals, from.y, decimals, to.x, decimals, to.y, decimals));
    }
    double first = 0;
    for (int order = 0; order < 3; ++order) {
      std::shuffle(lines.begin(), lines.end(), random);
      std::string text;
      for (const std::string& line : lines) text += line;
      std::vector<std::string> warnings;
      const auto outline = read_dxf(dxf(text), "t.dxf", {}, {}, &warnings);
      ASSERT_TRUE(outline);
      ASSERT_TRUE(warnings.empty()) << warnings[0];
      EXPECT_NEAR(area(*outline), signed_area(ring), 500 * unit) << round;
      if (order == 0) first = area(*outline);
      EXPECT_NEAR(area(*outline), first, 1e-9) << round;
    }
  }
}

TEST(DxfReader, EndsAtOddMultiplesOfTheToleranceMeetThemselves) {
  // Whatever the size of a cell is, some of these lie in the middle or on the border of one.
  for (const double step : {1e-5, 1.5e-5, 5e-6, 1e-6, 7.5e-6, 3e-5, 0.001, 0.0015}) {
    std::string text;
    for (int i = 0; i < 40; ++i) {
      const double x = 1 + 3 * i + i * step, y = 2 + (2 * i + 1) * step;
      text += line(x, y, x + 2, y) + line(x + 2, y, x + 2, y + 2) + line(x + 2, y + 2, x, y);
    }
    const Outline outline = drawn(dxf(text));
    EXPECT_EQ(outline.contours.size(), 40u) << step;
    EXPECT_NEAR(area(outline), 80, 1e-6) << step;
  }
}

TEST(DxfReader, ArcsMeetLinesWithinThePrecisionOfTheirAngles) {
  // A quarter of a disc of radius 300 from 20.123456 degrees: 4 decimals of a degree are 0.0003.
  const double from = 20.123456, to = 110.123456, r = 300, degree = std::numbers::pi / 180;
  std::string text =
      fmt::format("0\nARC\n8\n0\n10\n5.0\n20\n7.0\n40\n{}\n50\n{:.4f}\n51\n{:.4f}\n", r, from, to);
  for (const double a : {from, to}) {
    text += fmt::format("0\nLINE\n8\n0\n10\n5.0\n20\n7.0\n11\n{:.6f}\n21\n{:.6f}\n",
                        5 + r * std::cos(a * degree), 7 + r * std::sin(a * degree));
  }
  std::vector<std::string> warnings;
  OutlineImport options;
  options.segments.fn = 3600;
  const auto outline = read_dxf(dxf(text), "t.dxf", options, {}, &warnings);
  ASSERT_TRUE(outline);
  EXPECT_TRUE(warnings.empty()) << warnings[0];
  EXPECT_NEAR(area(*outline), std::numbers::pi * r * r / 4, 1);
}

TEST(DxfReader, FineCurvesStayWhole) {
  // Steps far below the tolerance: 20,000 lines around a circle of 1/100, and around one of 10.
  for (const double r : {0.01, 10.0}) {
    std::string text;
    constexpr int kSteps = 20000;
    const auto at = [&](int i) {
      const double a = 2 * std::numbers::pi * (i % kSteps) / kSteps;
      return r * glm::dvec2(std::cos(a), std::sin(a));
    };
    for (int i = 0; i < kSteps; ++i) text += line(at(i).x, at(i).y, at(i + 1).x, at(i + 1).y);
    EXPECT_NEAR(area(drawn(dxf(text))), std::numbers::pi * r * r, 1e-5 * r * r);
  }
}

TEST(DxfReader, OpenContoursAndStrayLinesAreNamedWithTheirPlace) {
  const auto warnings_of = [](const std::string& text, const OutlineImport& options = {}) {
    std::vector<std::string> warnings;
    EXPECT_TRUE(read_dxf(text, "t.dxf", options, {}, &warnings));
    return warnings;
  };
  EXPECT_TRUE(warnings_of(dxf(square(0, 0, 3) + square(5, 0, 3))).empty());
  const std::string open =
      line(10, 2, 20, 2, "cut") + line(20, 2, 20, 12, "cut") + line(20, 12, 10, 2.25, "cut");
  OutlineImport options;
  options.scale = 3;
  options.origin = {1, 1};
  auto warnings = warnings_of(dxf(square(0, 0, 3) + open), options);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0],
            "t.dxf:60: 1 contour does not close; it ends at (10, 2) and (10, 2.25) in layer "
            "'cut', 0.25 apart; a straight line closes it");
  EXPECT_NEAR(area(drawn(dxf(open))), (10 * 9.75) / 2 + 0, 5);
  warnings =
      warnings_of(dxf(square(0, 0, 3) + line(1, 2, 4, 6, "axis") + line(1, 9, 2, 9, "axis")));
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(
      warnings[0],
      "t.dxf:60: 2 lines are part of no contour and are left out; the first leads from (1, 2) "
      "to (4, 6) in layer 'axis', 5 apart");
}

TEST(DxfReader, BlocksThatHoldThemselvesEnd) {
  const std::string self = "0\nBLOCK\n2\na\n0\nINSERT\n2\na\n10\n0\n20\n0\n0\nENDBLK\n";
  EXPECT_NE(dxf_error(dxf("0\nINSERT\n2\na\n10\n0\n20\n0\n", self)).find("may contain itself"),
            std::string::npos);
  // Ten of each next one, twenty deep: stopped by a limit.
  std::string blocks;
  for (int i = 0; i < 20; ++i) {
    blocks += fmt::format("0\nBLOCK\n2\nb{}\n", i);
    for (int k = 0; k < 10; ++k)
      blocks += fmt::format("0\nINSERT\n2\nb{}\n10\n{}\n20\n0\n", i + 1, k);
    blocks += "0\nENDBLK\n";
  }
  blocks += "0\nBLOCK\n2\nb20\n0\nPOINT\n10\n0\n20\n0\n0\nENDBLK\n";
  const auto bomb = read_dxf(dxf("0\nINSERT\n2\nb0\n10\n0\n20\n0\n", blocks), "t.dxf", {});
  ASSERT_FALSE(bomb);
  EXPECT_EQ(bomb.error().code, ErrorCode::kLimit);
}

TEST(DxfReader, ErrorsNameTheLine) {
  EXPECT_EQ(dxf_error("0\nSECTION\nzwei\nENTITIES\n"), "t.dxf:3: 'zwei' is not a group code");
  EXPECT_EQ(dxf_error("0\nSECTION\n2\nENTITIES\n0\nLINE\n10\n0,5\n20\n0\n"),
            "t.dxf:8: '0,5' of group 10 is not a number");
  EXPECT_EQ(dxf_error(dxf("0\nCIRCLE\n10\n0\n20\n0\n")), "t.dxf:12: CIRCLE has no group 40");
  EXPECT_EQ(dxf_error("0\nSECTION\n2"), "t.dxf:3: group code 2 has no value");
  EXPECT_NE(dxf_error("AutoCAD Binary DXF\r\n").find("binary"), std::string::npos);
}

std::string svg(const std::string& body, const std::string& page =
                                             "viewBox='0 0 100 100' "
                                             "width='100mm' height='100mm'") {
  return "<svg xmlns='http://www.w3.org/2000/svg' xmlns:xlink='http://www.w3.org/1999/xlink' " +
         page + ">\n" + body + "\n</svg>\n";
}

Outline pictured(const std::string& text, const OutlineImport& options = {}) {
  const auto outline = read_svg(text, "t.svg", options);
  EXPECT_TRUE(outline) << (outline ? "" : outline.error().message);
  return outline ? *outline : Outline{};
}

#ifdef STRATA_HAVE_PUGIXML

TEST(SvgReader, ShapesWithYUp) {
  const Outline rect = pictured(svg("<rect x='10' y='20' width='5' height='2'/>"));
  ASSERT_EQ(rect.contours.size(), 1u);
  EXPECT_NEAR(area(rect), 10, 1e-12);
  for (const glm::dvec2& p : rect.contours[0]) {
    EXPECT_TRUE(p.y == 80 || p.y == 78) << p.y;
  }
  EXPECT_NEAR(area(pictured(svg("<circle cx='5' cy='5' r='2'/>"))),
              40 * 0.5 * 4 * std::sin(2 * std::numbers::pi / 40), 1e-9);
  EXPECT_NEAR(area(pictured(svg("<polygon points='0,0 4,0,4,3'/>"))), 6, 1e-9);
  const double rounded = area(pictured(svg("<rect width='10' height='8' rx='2' ry='1'/>")));
  EXPECT_NEAR(rounded, 80 - (4 - std::numbers::pi) * 2, 0.1);
}

OutlineImport fine() {
  OutlineImport options;
  options.segments.fn = 400;
  return options;
}

TEST(SvgReader, LinesAreBandsOfTheirStroke) {
  const auto width = [](const std::string& more) {
    return area(pictured(
        svg("<line x1='10' y1='10' x2='30' y2='10' stroke-width='4' " + more + "/>"), fine()));
  };
  EXPECT_NEAR(width(""), 80, 1e-6);
  EXPECT_NEAR(width("style='stroke-linecap: square'"), 96, 1e-6);
  EXPECT_NEAR(width("stroke-linecap='round'"), 80 + std::numbers::pi * 4, 0.01);
  EXPECT_NEAR(area(pictured(svg("<g style='stroke-width:2'><path d='M0,0H10V10'/></g>"))), 40,
              1e-6);
}

TEST(SvgReader, PathCommandsAbsoluteAndRelative) {
  const auto size = [](const std::string& d) {
    return area(pictured(svg("<path d='" + d + "'/>"), fine()));
  };
  EXPECT_NEAR(size("M10 10H20V20H10z"), 100, 1e-9);
  EXPECT_NEAR(size("m10,10h10v10h-10z"), 100, 1e-9);
  EXPECT_NEAR(size("M10-10 20-10 20-20l-10 0Z"), 100, 1e-9);
  EXPECT_NEAR(size("M.5.5 1.5.5 1.5 1.5.5 1.5z"), 1, 1e-9);
  EXPECT_NEAR(size("M1e1,1E1h1e+1v10H10z m20 0h5v5h-5z"), 125, 1e-9);
  EXPECT_NEAR(size("M0 0 A5 5 0 0 1 10 0z"), std::numbers::pi * 12.5, 0.01);
  EXPECT_NEAR(size("M0 0a5 5 0 0110 0z"), std::numbers::pi * 12.5, 0.01);  // flags run together
  EXPECT_NEAR(size("M0 0A5 5 0 1 0 5 5z"), std::numbers::pi * 25 * 0.75 + 12.5, 0.01);
  // A parabola has two thirds of its triangle; the same curve as a cubic.
  EXPECT_NEAR(size("M0 0Q5 10 10 0z"), 100 / 3.0, 0.01);
  EXPECT_NEAR(size("M0 0C3.333333 6.666667 6.666667 6.666667 10 0z"), 100 / 3.0, 0.01);
  EXPECT_NEAR(size("M0 0Q5 10 10 0T20 0z"), 2 * 100 / 3.0, 0.01);
}

TEST(SvgReader, FillRuleTransformsAndUse) {
  const std::string nested = "d='M0 0h10v10h-10zM2 2h6v6h-6z'";
  EXPECT_NEAR(area(pictured(svg("<path " + nested + "/>"))), 64, 1e-9);
  EXPECT_NEAR(area(pictured(svg("<path style='fill-rule:nonzero' " + nested + "/>"))), 100, 1e-9);
  EXPECT_NEAR(area(pictured(svg("<g transform='translate(5) scale(2,3)'><rect width='1' height='1' "
                                "transform='rotate(30 1 2) skewX(20)'/></g>"))),
              6, 1e-9);
  EXPECT_NEAR(area(pictured(svg("<defs><g id='a'><rect width='2' height='2'/></g></defs>"
                                "<use xlink:href='#a' x='10'/><use href='#a' y='10'/>"))),
              8, 1e-9);
}

TEST(SvgReader, LayersIdsAndWhatIsNotDisplayed) {
  const std::string text =
      svg("<g id='one' xmlns:inkscape='i' inkscape:groupmode='layer' inkscape:label='First'>"
          "<rect width='2' height='2'/></g><g id='two' style='display: none'>"
          "<rect id='three' x='5' width='3' height='3'/></g>");
  EXPECT_NEAR(area(pictured(text)), 4, 1e-9);
  OutlineImport options;
  for (const auto& [layer, size] : {std::pair("First", 4.0), {"one", 4.0}, {"two", 9.0}}) {
    options.layer = layer;
    EXPECT_NEAR(area(pictured(text, options)), size, 1e-9) << layer;
  }
  options.layer = "nobody";
  EXPECT_FALSE(read_svg(text, "t.svg", options));
}

TEST(SvgReader, UnitsOfThePage) {
  const std::string unit = "<rect width='1' height='1'/>";
  EXPECT_NEAR(area(pictured(svg(unit, "width='2in' height='2in' viewBox='0 0 2 2'"))), 25.4 * 25.4,
              1e-9);
  EXPECT_NEAR(area(pictured(svg(unit, "width='96px' height='96px' viewBox='0 0 1 1'"))),
              25.4 * 25.4, 1e-9);
  EXPECT_NEAR(area(pictured(svg(unit, "viewBox='0 0 72 72'"))), 25.4 / 72 * 25.4 / 72, 1e-9);
  EXPECT_NEAR(area(pictured(svg(unit, "width='10' height='10'"))), 1, 1e-12);
}

TEST(SvgReader, BadFilesAreErrorsThatNameTheLine) {
  const auto message = [](const std::string& text) {
    const auto outline = read_svg(text, "t.svg", {});
    EXPECT_FALSE(outline);
    return outline ? std::string() : outline.error().message;
  };
  EXPECT_EQ(message(svg("<path d='M0 0 L oops'/>")),
            "t.svg:2: path data is malformed at character 6");
  EXPECT_EQ(message(svg("<g>")).substr(0, 8), "t.svg:3:");
  EXPECT_NE(message("<html/>").find("not <svg>"), std::string::npos);
  EXPECT_NE(message(svg("<g id='a'><use href='#a'/></g>")).find("use themselves"),
            std::string::npos);
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "<g>";
  EXPECT_FALSE(read_svg(svg(deep), "t.svg", {}));
  for (int i = 0; i < 100000; ++i) deep += "</g>";
  EXPECT_NE(message(svg(deep)).find("nested more than"), std::string::npos);
}

TEST(SvgReader, DamagedBytesGiveFiniteOutlinesOrErrorsThatNameThePlace) {
  const std::string good = svg(
      "<g transform='rotate(10)'><path d='M0 0C1 2 3 4 5 6A1 2 3 0 1 9 9z'/><circle r='4'/></g>");
  std::mt19937 random(1);
  Outcomes outcomes;
  for (int round = 0; round < 3000; ++round) {
    std::string bad = good;
    for (int k = 0; k < 4; ++k) bad[random() % bad.size()] = static_cast<char>(random() % 256);
    bad.resize(random() % 4 ? bad.size() : random() % bad.size());
    outcomes.add(read_svg(bad, "t.svg", {}), "t.svg:");
  }
  EXPECT_GT(outcomes.read, 30);
  EXPECT_GT(outcomes.refused, 300);
}

#endif

TEST(DxfReader, DamagedBytesGiveFiniteOutlinesOrErrorsThatNameThePlace) {
  const std::string good =
      dxf(square(0, 0, 3) +
              "0\nCIRCLE\n10\n0\n20\n0\n40\n3\n0\nSPLINE\n71\n2\n40\n0\n10\n1\n20\n3\n"
              "0\nINSERT\n2\nb\n10\n1\n20\n1\n70\n3\n",
          "0\nBLOCK\n2\nb\n" + square(1, 1, 1) + "0\nENDBLK\n");
  std::mt19937 random(2);
  Outcomes outcomes;
  for (int round = 0; round < 5000; ++round) {
    std::string bad = good;
    const char letters[] = "0123456789-.eE\n\n\nLINESPCRB";
    for (int k = 0; k < 3; ++k)
      bad[random() % bad.size()] = letters[random() % (sizeof letters - 1)];
    bad.resize(random() % 4 ? bad.size() : random() % bad.size());
    outcomes.add(read_dxf(bad, "t.dxf", {}), "t.dxf:");
  }
  EXPECT_GT(outcomes.read, 50);
  EXPECT_GT(outcomes.refused, 500);
}

TEST(ReadOutline, ChoosesByExtensionAndCentres) {
  const testkit::TemporaryFolder folder;
  const std::string path = folder.write("square.DXF", dxf(square(10, 20, 4)));
  OutlineImport options;
  options.centre = true;
  const auto outline = read_outline(path, options);
  ASSERT_TRUE(outline) << outline.error().message;
  EXPECT_DOUBLE_EQ(area(*outline), 16);
  for (const glm::dvec2& p : outline->contours[0]) EXPECT_EQ(std::abs(p.x), 2);
  std::filesystem::remove(path);
  EXPECT_EQ(read_outline(path, options).error().code, ErrorCode::kInput);
  EXPECT_EQ(read_outline("picture.pdf", {}).error().code, ErrorCode::kInput);
}

/// The areas that OpenSCAD 2021.01 gives the DXF files of its own tests.
TEST(ReadOutline, OpenScadsTestFiles) {
  const std::filesystem::path folder = "/usr/share/openscad/testdata/dxf";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "needs Debian's openscad-testing-data";
  const std::pair<const char*, double> expected[] = {{"arc", 7803.57},
                                                     {"circle-advanced", 15329.1},
                                                     {"circle-double", 3600},
                                                     {"circle-small", 599.269},
                                                     {"circle", 31186.7},
                                                     {"ellipse-arc-rot", 7742.83},
                                                     {"ellipse-arc", 1401.79},
                                                     {"ellipse-reverse", 15600.5},
                                                     {"ellipse-rot", 21206.8},
                                                     {"ellipse", 15593.4},
                                                     {"lwpolyline-closed", 1250},
                                                     {"lwpolyline", 1250},
                                                     {"lwpolyline2", 2950},
                                                     {"multiple-layers", 16787.4},
                                                     {"open-polyline", 10000},
                                                     {"polygon-concave-hole", 6450},
                                                     {"polygon-concave-simple", 7000.04},
                                                     {"polygon-concave", 20400},
                                                     {"polygon-holes-touch", 1650.6},
                                                     {"polygon-intersect", 15000},
                                                     {"polygon-many-holes", 4949.37},
                                                     {"polygon-overlap", 10000},
                                                     {"polygon-riser", 4727.22},
                                                     {"polygon-self-intersect", 5000},
                                                     {"polygon8", 20825.6},
                                                     {"polygons", 9100},
                                                     {"transform-insert", 972.003},
                                                     {"triangle-with-duplicate-vertex", 5000}};
  for (const auto& [name, size] : expected) {
    const auto outline = read_outline((folder / (std::string(name) + ".dxf")).string(), {});
    ASSERT_TRUE(outline) << name << ": " << outline.error().message;
    EXPECT_NEAR(area(*outline), size, 1e-4 * size) << name;
  }
}

}  // namespace
}  // namespace strata::csg
