#include "strata/mesh/writers/write_solid.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <limits>
#include <stop_token>
#include <string>
#include <vector>

#include "mesh/archives/read_3mf_amf.h"
#include "mesh/archives/zip_entry.h"
#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/read_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/mesh/formats/reading.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

namespace strata {
namespace {

using testkit::TemporaryFolder;

/// Positions that need all digits of a double.
SolidMesh as_solid(const TriangleSoup& soup) {
  return {soup.positions, soup.triangles, {}, {{"a part", {}}}};
}
SolidMesh ball(int subdivisions = 2) { return as_solid(make_icosphere(10.0 / 3.0, subdivisions)); }

void append(SolidMesh& mesh, const TriangleSoup& soup, std::uint32_t part) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), soup.positions.begin(), soup.positions.end());
  for (const glm::uvec3& t : soup.triangles) {
    mesh.triangles.push_back(t + first);
    mesh.part_of.push_back(part);
  }
}

/// Two closed parts, and a box whose triangles are of two more parts in turn. The closed ones are
/// written in turn as well.
SolidMesh four_parts() {
  SolidMesh mesh;
  mesh.parts = {{"red & <round>", glm::vec4(1, 0, 0, 1)},
                {"line\nbreak", glm::vec4(0, 0.5f, 0, 0.25f)},
                {"", {}},
                {"a very\tlong \xff name", glm::vec4(0, 0, 1, 1)}};
  append(mesh, make_box({0, 0, 0}, {1, 1, 1}), 2);
  for (std::size_t t = 0; t < mesh.part_of.size(); t += 2) mesh.part_of[t] = 3;
  append(mesh, make_icosphere(1.0 / 3.0, 1), 0);
  append(mesh, make_box({5, 5, 5}, {6.25, 6, 6}), 1);
  std::vector<std::size_t> order(mesh.triangles.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i * 37 % order.size();  // a prime
  SolidMesh mixed = mesh;
  for (std::size_t i = 0; i < order.size(); ++i) {
    mixed.triangles[i] = mesh.triangles[order[i]];
    mixed.part_of[i] = mesh.part_of[order[i]];
  }
  return mixed;
}

using Corners = std::array<double, 9>;
Corners corners_of(const std::vector<glm::dvec3>& positions, const glm::uvec3& t) {
  Corners corners;
  for (int c = 0; c < 3; ++c) {
    for (int k = 0; k < 3; ++k) {
      corners[static_cast<std::size_t>(3 * c + k)] = positions[t[c]][k];
    }
  }
  return corners;
}
template <class Mesh>
std::vector<Corners> sorted_corners(const Mesh& mesh) {
  std::vector<Corners> all;
  for (const glm::uvec3& t : mesh.triangles) all.push_back(corners_of(mesh.positions, t));
  std::sort(all.begin(), all.end());
  return all;
}

struct Case {
  const char* extension;
  SolidFormat format;
};
constexpr Case kCases[] = {{"3mf", SolidFormat::k3mf},
                           {"stl", SolidFormat::kStl},
                           {"obj", SolidFormat::kObj},
                           {"ply", SolidFormat::kPly},
                           {"off", SolidFormat::kOff}};

/// The soup of a file, by the readers of scenes for a 3MF.
Result<TriangleSoup> read_back(const std::string& path) {
  if (path.ends_with(".3mf")) return read_3mf(path);
  auto file = read_mesh(path);
  if (!file) return tl::unexpected(file.error());
  EXPECT_TRUE(file->stats.warnings.empty()) << path << ": " << file->stats.warnings.front();
  EXPECT_EQ(file->stats.dropped_faces(), 0u);
  return std::move(file->soup);
}

class SolidWriter : public testing::TestWithParam<Case> {
 protected:
  [[nodiscard]] std::string path(const std::string& name = "a") const {
    return folder_.file(name + "." + GetParam().extension);
  }
  /// True for a build that cannot read it.
  [[nodiscard]] bool unread() const {
    if (GetParam().format != SolidFormat::k3mf) return false;
    const auto read = read_3mf(folder_.write("no.3mf", "no archive"));
    return read.error().code == ErrorCode::kUsage;
  }
  TemporaryFolder folder_;
};

std::string name_of(const testing::TestParamInfo<Case>& info) { return info.param.extension; }
INSTANTIATE_TEST_SUITE_P(Formats, SolidWriter, testing::ValuesIn(kCases), name_of);

TEST_P(SolidWriter, ReadingGivesBackEachTriangle) {
  if (unread()) GTEST_SKIP() << "this build reads no 3MF";
  SolidMesh wide = ball();  // numbers of all sizes, and a zero with a sign
  for (glm::dvec3& p : wide.positions) p *= glm::dvec3(1e-9, 1.0, 12345678.9);
  wide.positions[0].x = -0.0;
  for (SolidMesh mesh : {ball(), four_parts(), wide}) {
    const auto written = write_solid(path(), mesh, {.materials = folder_.file("a.mtl")});
    ASSERT_TRUE(written) << written.error().message;
    const auto soup = read_back(path());
    ASSERT_TRUE(soup) << soup.error().message;
    if (GetParam().format == SolidFormat::kStl) {
      TriangleSoup floats{mesh.positions, {}, {}};
      testing_mesh::round_to_float(floats);
      mesh.positions = floats.positions;
    }
    const auto expected = sorted_corners(mesh);
    ASSERT_EQ(soup->triangles.size(), expected.size());
    EXPECT_EQ(sorted_corners(*soup), expected);
    EXPECT_TRUE(diagnose(*soup).closed);
  }
}

TEST_P(SolidWriter, BytesDoNotDependOnThreads) {
  SolidMesh mesh = ball(6);  // blocks for each of several threads
  mesh.parts.push_back({"b", glm::vec4(0.25f, 0.5f, 0.75f, 1)});
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    mesh.part_of.push_back(t % 7 == 3 ? 1 : 0);
  }
  std::string first;
  for (const int threads : {1, 2, 5}) {
    Execution execution;
    execution.threads = threads;
    std::vector<double> seen;
    execution.progress = [&](double fraction) { seen.push_back(fraction); };
    ASSERT_TRUE(write_solid(path(), mesh, {}, execution));
    const std::string bytes = testkit::bytes_of(path());
    if (threads == 1) first = bytes;
    EXPECT_TRUE(bytes == first) << threads;
    ASSERT_FALSE(seen.empty());
    EXPECT_EQ(seen.back(), 1.0);
  }
  EXPECT_GT(first.size(), mesh.triangles.size());
}

TEST_P(SolidWriter, TimeGrowsWithTheNumberOfParts) {
  if (testkit::kSanitized) GTEST_SKIP() << "sanitizers make it slow";
  const auto seconds = [&](std::uint32_t count) {
    SolidMesh mesh;
    for (std::uint32_t i = 0; i < count; ++i) {
      append(mesh, make_box({2.0 * i, 0, 0}, {2.0 * i + 1, 1, 1}), i);
      mesh.parts.push_back({"box", glm::vec4(i % 256, i / 256 % 256, i / 65536, 255) / 255.0f});
    }
    double least = 1e9;
    for (int round = 0; round < 3; ++round) {
      const std::clock_t begin = std::clock();
      Execution execution;
      execution.threads = 1;
      SolidWriteOptions options;
      options.materials = folder_.file("a.mtl");
      EXPECT_TRUE(write_solid(path(), mesh, options, execution));
      least = std::min(least, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
    }
    return least;
  };
  const double few = seconds(2000), many = seconds(16000);
  EXPECT_LT(many, 8 * 4 * few + 0.02) << few << " s for an eighth of the parts";
}

TEST_P(SolidWriter, SaysWhatNoFileMayHave) {
  const SolidMesh good = ball(0);
  const auto refusal = [&](const SolidMesh& mesh) {
    const auto written = write_solid(path(), mesh);
    EXPECT_FALSE(written);
    if (written) return std::string();
    EXPECT_EQ(written.error().code, ErrorCode::kGeometry);
    EXPECT_TRUE(folder_.is_empty());
    return written.error().message;
  };
  EXPECT_EQ(refusal({}), path() + ": the mesh has no triangle");
  SolidMesh bad = good;
  bad.triangles[3].y = 99;
  EXPECT_EQ(refusal(bad), path() + ": triangle 3 refers to vertex 99, the mesh has 12");
  bad = good;
  bad.parts.clear();
  EXPECT_EQ(refusal(bad), path() + ": the mesh has no part");
  bad = good;
  bad.part_of.assign(19, 0);
  EXPECT_EQ(refusal(bad), path() + ": the mesh has 20 triangles, but names the parts of 19");
  bad.part_of = std::vector<std::uint32_t>(20, 1);
  EXPECT_EQ(refusal(bad), path() + ": triangle 0 belongs to part 1, the mesh has 1");
  bad = good;
  bad.positions[7].z = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal(bad).find("coordinate nan of vertex 7 is not a finite "), std::string::npos);
  bad.positions[7].z = 1e39;
  if (GetParam().format == SolidFormat::kStl) {
    EXPECT_EQ(refusal(bad), path() + ": coordinate 1e+39 of vertex 7 is not a finite float");
  } else {
    EXPECT_TRUE(write_solid(path(), bad));
  }
}

/// Makes every file that grows beyond a few bytes fail, as a full disk does.
class SmallDisk {
 public:
  explicit SmallDisk(rlim_t bytes) {
    before_ = signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &limit_);
    rlimit small = limit_;
    small.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~SmallDisk() {
    setrlimit(RLIMIT_FSIZE, &limit_);
    signal(SIGXFSZ, before_);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

 private:
  rlimit limit_{};
  void (*before_)(int) = nullptr;
};

TEST_P(SolidWriter, AFullDiskIsAnErrorAndLeavesNothing) {
  for (const rlim_t room : {rlim_t{0}, rlim_t{50}, rlim_t{1500}}) {
    Result<void> written;
    {
      const SmallDisk disk(room);
      written = write_solid(path(), ball());
    }
    ASSERT_FALSE(written) << room;
    EXPECT_EQ(written.error().code, ErrorCode::kOutput);
    EXPECT_NE(written.error().message.find(path()), std::string::npos) << written.error().message;
    EXPECT_TRUE(folder_.is_empty());
  }
  EXPECT_EQ(write_solid(folder_.file("none/a.") + GetParam().extension, ball()).error().code,
            ErrorCode::kOutput);
}

TEST_P(SolidWriter, AStoppedJobLeavesNothing) {
  for (const bool at_once : {true, false}) {
    std::stop_source source;
    if (at_once) source.request_stop();
    Execution execution;
    execution.threads = 1;
    execution.stop = source.get_token();
    execution.progress = [&](double) { source.request_stop(); };
    const auto written = write_solid(path(), ball(6), {}, execution);
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().code, ErrorCode::kCancelled);
    EXPECT_TRUE(folder_.is_empty());
  }
}

TEST_P(SolidWriter, AnExistingFileIsReplacedOnlyByAWholeOne) {
  testkit::TemporaryFolder other;
  const std::string file = other.write(std::string("a.") + GetParam().extension, "before");
  EXPECT_FALSE(write_solid(file, {}));
  EXPECT_EQ(testkit::bytes_of(file), "before");
  EXPECT_TRUE(write_solid(file, ball()));
  EXPECT_NE(testkit::bytes_of(file), "before");
}

TEST(SolidFormats, AreNamedByExtensions) {
  EXPECT_EQ(solid_format_of("a/b.3MF"), SolidFormat::k3mf);
  EXPECT_EQ(solid_format_of("b.Ply"), SolidFormat::kPly);
  EXPECT_EQ(solid_format_of("3mf"), SolidFormat::kAuto);
  EXPECT_EQ(solid_format_of("stl/file"), SolidFormat::kAuto);
  for (const Case& one : kCases) EXPECT_STREQ(solid_format_name(one.format), one.extension);
  const auto written = write_solid("a.amf", ball());
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::kUsage);
  EXPECT_EQ(written.error().message, "a.amf: the format must be 3mf, stl, obj, ply or off");
}

/// The model text of a 3MF, unpacked by libzip, which checks sizes and sums.
class ThreeMfWriter : public testing::Test {
 protected:
  std::string model(const SolidMesh& mesh, const SolidWriteOptions& options = {}) {
    const auto written = write_solid(folder_.file("a.3mf"), mesh, options);
    EXPECT_TRUE(written);
    const auto archive = ZipArchive::open(folder_.file("a.3mf"));
    if (!archive) return "";  // a build without libzip
    EXPECT_EQ(archive->names().size(), 3u);
    EXPECT_EQ(archive->names()[0], "[Content_Types].xml");
    const auto text = archive->read("3D/3dmodel.model", {});
    EXPECT_TRUE(text) << text.error().message;
    return text ? *text : "";
  }
  static std::size_t count(const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (auto at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++found;
    return found;
  }
  TemporaryFolder folder_;
};

TEST_F(ThreeMfWriter, ColoursOfOneNameThatAreClosedTogetherAreOneObject) {
  SolidMesh mesh;
  mesh.parts = {{"cup", glm::vec4(1, 0, 0, 1)},
                {"cup", glm::vec4(0, 1, 0, 1)},
                {"lid", glm::vec4(0, 0, 1, 1)},
                {"lid", glm::vec4(0, 0, 1, 1)}};
  append(mesh, make_box({0, 0, 0}, {1, 1, 1}), 0);
  for (std::size_t t = 0; t < 12; t += 3) mesh.part_of[t] = 1;
  append(mesh, make_box({2, 0, 0}, {3, 1, 1}), 2);
  append(mesh, make_box({4, 0, 0}, {5, 1, 1}), 3);
  const std::string text = model(mesh);
  if (text.empty()) GTEST_SKIP() << "this build unpacks no 3MF";
  EXPECT_EQ(count(text, "<mesh>"), 3u);
  EXPECT_EQ(count(text, "name=\"cup\""), 1u);
  EXPECT_EQ(count(text, "name=\"lid\""), 2u) << "closed by themselves";
  EXPECT_EQ(count(text, " p1=\"0\""), 8u);
  EXPECT_EQ(count(text, " p1=\"1\""), 4u);
}

TEST_F(ThreeMfWriter, AnObjectIsAClosedPartAndTheOtherPartsAreOne) {
  const std::string text = model(four_parts());
  if (text.empty()) GTEST_SKIP() << "this build unpacks no 3MF";
  EXPECT_EQ(count(text, "<mesh>"), 3u);
  EXPECT_EQ(count(text, "<component "), 3u);
  EXPECT_EQ(count(text, "<item "), 1u);
  EXPECT_NE(text.find("name=\"red &amp; &lt;round&gt;\" pid=\"1\""), std::string::npos);
  EXPECT_NE(text.find("name=\"line break\" pid=\"1\""), std::string::npos);
  EXPECT_NE(text.find("<m:color color=\"#FF0000FF\"/>"), std::string::npos);
  EXPECT_NE(text.find("<m:color color=\"#00800040\"/>"), std::string::npos);
  EXPECT_NE(text.find("<m:color color=\"#F9D72CFF\"/>"), std::string::npos) << "no colour given";
  EXPECT_EQ(count(text, " p1=\"2\" "), 6u);
  EXPECT_EQ(count(text, " p1=\"3\" "), 6u);
  EXPECT_EQ(count(text, "slic3rpe:mmu_segmentation=\"4\"/>"), 80u) << "the first colour";
  EXPECT_EQ(count(text, "slic3rpe:mmu_segmentation=\"8\"/>"), 12u) << "the second";
  EXPECT_EQ(count(text, "slic3rpe:mmu_segmentation=\"0C\"/>"), 6u) << "the third";
  EXPECT_EQ(count(text, "slic3rpe:mmu_segmentation=\"1C\"/>"), 6u) << "the fourth";
  EXPECT_EQ(count(text, "<vertex "), 42u + 8u + 8u) << "an object has its own vertices only";
}

TEST_F(ThreeMfWriter, APartThatIsNotClosedByItselfStaysWithItsNeighbours) {
  SolidMesh cut = ball();
  cut.parts = {{"low", {}}, {"high", glm::vec4(1)}};
  for (const glm::uvec3& t : cut.triangles) {
    cut.part_of.push_back(cut.positions[t.x].z > 0.0 ? 1 : 0);
  }
  const std::string text = model(cut);
  if (text.empty()) GTEST_SKIP() << "this build unpacks no 3MF";
  EXPECT_EQ(count(text, "<mesh>"), 1u);
  EXPECT_EQ(count(text, "<components>"), 0u);
  EXPECT_EQ(count(text, " p1=\""), cut.triangles.size());
}

TEST_F(ThreeMfWriter, OnePartWithoutAColourHasNone) {
  const std::string text = model(ball());
  if (text.empty()) GTEST_SKIP() << "this build unpacks no 3MF";
  EXPECT_NE(text.find("unit=\"millimeter\""), std::string::npos);
  EXPECT_NE(text.find("name=\"a part\""), std::string::npos);
  EXPECT_EQ(count(text, "color"), 0u);
  EXPECT_EQ(count(text, "xmlns:m"), 0u);
  EXPECT_NE(model(ball(), {.unit = LengthUnit::kInch, .materials = ""}).find("unit=\"inch\""),
            std::string::npos);
}

TEST_F(ThreeMfWriter, TheMemoryLimitIsKept) {
  Execution execution;
  execution.memory_limit = 10'000;
  const auto written = write_solid(folder_.file("a.3mf"), ball(6), {}, execution);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::kLimit);
  EXPECT_TRUE(folder_.is_empty());
}

TEST(ObjWriter, NamesGroupsAndKeepsColoursInAFileOfMaterials) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_solid(folder.file("a.obj"), four_parts()));
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.obj"});
  EXPECT_EQ(folder.read("a.obj").find("usemtl"), std::string::npos);
  ASSERT_TRUE(write_solid(folder.file("a.obj"), four_parts(), {.materials = folder.file("a.mtl")}));
  const std::string text = folder.read("a.obj"), materials = folder.read("a.mtl");
  EXPECT_NE(text.find("\nmtllib a.mtl\n"), std::string::npos);
  EXPECT_NE(text.find("\ng red_&_<round>\nusemtl rgba_ff0000ff\nf "), std::string::npos);
  EXPECT_NE(text.find("\ng line_break\nusemtl rgba_00800040\nf "), std::string::npos);
  EXPECT_NE(text.find("\ng part_2\nusemtl rgba_f9d72cff\nf "), std::string::npos);
  EXPECT_NE(text.find("\ng a_very_long_?_name\n"), std::string::npos);
  EXPECT_NE(materials.find("newmtl rgba_00800040\nKd 0 0.502 0\nd 0.251\n"), std::string::npos)
      << materials;
  std::filesystem::remove(folder.file("a.mtl"));
  ASSERT_TRUE(write_solid(folder.file("b.obj"), ball(), {.materials = folder.file("b.mtl")}));
  EXPECT_FALSE(folder.has("b.mtl")) << "no part has a colour";
}

TEST(PlyAndOffWriters, KeepAColourForEachFace) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_solid(folder.file("a.off"), four_parts()));
  const std::string off = folder.read("a.off");
  EXPECT_EQ(static_cast<std::size_t>(std::count(off.begin(), off.end(), '\n')),
            2 + four_parts().positions.size() + four_parts().triangles.size());
  EXPECT_NE(off.find(" 255 0 0\n"), std::string::npos);
  EXPECT_NE(off.find(" 0 128 0 64\n"), std::string::npos);
  ASSERT_TRUE(write_solid(folder.file("a.ply"), four_parts()));
  const std::string ply = folder.read("a.ply");
  EXPECT_NE(ply.find("comment part 1: line break\n"), std::string::npos);
  const std::size_t body = ply.find("end_header\n") + 11;
  EXPECT_EQ(ply.size(), body + 24 * four_parts().positions.size() +
                            (13 + 4 + 4) * four_parts().triangles.size());
}

}  // namespace
}  // namespace strata
