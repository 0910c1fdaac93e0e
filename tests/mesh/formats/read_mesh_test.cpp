#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <stop_token>
#include <thread>

#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/mesh/formats/reading.h"
#include "tests/support/temporary_folder.h"

namespace strata {
namespace {
using namespace testing_mesh;
namespace fs = std::filesystem;

/// A folder of its own for each test.
class ReadMesh : public ::testing::Test {
 protected:
  std::string write(const std::string& name, std::string_view bytes) {
    return place_.write(name, bytes);
  }

  const testkit::TemporaryFolder place_;
  const fs::path folder_ = place_.path();
};

const TriangleSoup& ball() {
  static const TriangleSoup mesh = [] {
    TriangleSoup sphere = make_icosphere(1.0, 2);
    round_to_float(sphere);  // so that STL holds it too
    return sphere;
  }();
  return mesh;
}

TEST_F(ReadMesh, FormatFollowsTheExtensionInAnyLetterCase) {
  for (const char* name : {"a.obj", "a.OBJ", "a.b.stl", "a.Ply", "a.off"}) {
    const std::string path = write(name, mesh_to_bytes(ball(), mesh_format_of(name)));
    const auto file = read_mesh(path);
    ASSERT_TRUE(file.has_value()) << file.error().message;
    EXPECT_EQ(file->soup.triangles.size(), ball().triangles.size());
    EXPECT_EQ(file->soup.positions.size(), ball().positions.size());
    EXPECT_EQ(file->stats.bytes, fs::file_size(path));
  }
}

TEST_F(ReadMesh, TextMayBeginWithAByteOrderMark) {
  const std::string mark = "\xef\xbb\xbf";
  const std::string facet =
      "facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 "
      "endloop endfacet\n";
  const std::pair<const char*, std::string> kFiles[] = {
      {"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
      {"a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"},
      {"a.ply", mesh_to_bytes(ball(), MeshFormat::kPly)},
      {"a.stl", "solid\n" + facet + "endsolid\n"},
      {"b.ply",
       "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
       "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
       "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"}};
  for (const auto& [name, text] : kFiles) {
    const auto plain = read_mesh(write(name, text)), marked = read_mesh(write(name, mark + text));
    ASSERT_TRUE(plain.has_value() && marked.has_value()) << name;
    EXPECT_EQ(plain->soup.positions, marked->soup.positions) << name;
    EXPECT_EQ(plain->soup.triangles, marked->soup.triangles) << name;
    EXPECT_TRUE(marked->stats.warnings.empty()) << name;
    EXPECT_EQ(marked->stats.bytes, text.size() + 3);
  }
}

TEST_F(ReadMesh, ConcavePolygonsAreCutInEveryFormat) {
  // A U of 9 x 6 with a slot of 3 x 4, 4 high. Fans would overlap outside of it.
  const std::vector<glm::dvec2> u = {{0, 0}, {9, 0}, {9, 6}, {6, 6},
                                     {6, 2}, {3, 2}, {3, 6}, {0, 6}};
  std::vector<glm::dvec3> vertices;
  for (const double z : {0.0, 4.0}) {
    for (const glm::dvec2& p : u) vertices.emplace_back(p, z);
  }
  std::vector<std::vector<int>> faces = {{7, 6, 5, 4, 3, 2, 1, 0}, {8, 9, 10, 11, 12, 13, 14, 15}};
  for (int i = 0; i < 8; ++i) faces.push_back({i, (i + 1) % 8, (i + 1) % 8 + 8, i + 8});
  std::string obj, off = fmt::format("OFF\n16 {} 0\n", faces.size()), stl = "solid\n";
  std::string ply = fmt::format(
      "ply\nformat ascii 1.0\nelement vertex 16\nproperty float x\nproperty float y\n"
      "property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      faces.size());
  for (const glm::dvec3& p : vertices) {
    const std::string line = fmt::format("{} {} {}\n", p.x, p.y, p.z);
    obj += "v " + line, off += line, ply += line;
  }
  for (const std::vector<int>& face : faces) {
    std::string numbers;
    obj += "f", stl += "facet normal 0 0 0 outer loop\n";
    for (const int i : face) {
      const glm::dvec3& p = vertices[static_cast<std::size_t>(i)];
      obj += fmt::format(" {}", i + 1), numbers += fmt::format(" {}", i);
      stl += fmt::format("vertex {} {} {}\n", p.x, p.y, p.z);
    }
    obj += "\n", stl += "endloop endfacet\n";
    off += fmt::format("{}{}\n", face.size(), numbers),
        ply += fmt::format("{}{}\n", face.size(), numbers);
  }
  const std::pair<const char*, std::string> kFiles[] = {
      {"u.obj", obj}, {"u.off", off}, {"u.ply", ply}, {"u.stl", stl + "endsolid\n"}};
  for (const auto& [name, text] : kFiles) {
    const auto file = read_mesh(write(name, text));
    ASSERT_TRUE(file.has_value()) << file.error().message;
    EXPECT_EQ(file->soup.triangles.size(), 28u) << name;
    EXPECT_EQ(six_volumes(file->soup), 6 * 168.0) << name;
    double area = 0.0;
    for (const glm::uvec3& t : file->soup.triangles) {
      const glm::dvec3 a = file->soup.positions[t.x];
      area +=
          glm::length(glm::cross(file->soup.positions[t.y] - a, file->soup.positions[t.z] - a)) / 2;
    }
    EXPECT_NEAR(area, 236.0, 1e-12) << name;
    EXPECT_TRUE(file->stats.warnings.empty()) << name;
  }
}

TEST_F(ReadMesh, WideTextIsNamed) {
  const std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  for (const std::string mark : {"\xff\xfe", "\xfe\xff", ""}) {
    for (const bool big : {false, true}) {
      if (!mark.empty() && big != (mark[0] == '\xfe')) continue;
      std::string wide = mark;
      for (const char c : text) wide += big ? std::string{'\0', c} : std::string{c, '\0'};
      for (const char* name : {"a.obj", "a.off", "a.ply", "a.stl"}) {
        const auto file = read_mesh(write(name, wide));
        ASSERT_FALSE(file.has_value()) << name;
        EXPECT_CONTAINS(file.error().message, "is UTF-16 text");
      }
    }
  }
  // The header of a binary STL file may be anything.
  std::string bytes = mesh_to_bytes(ball(), MeshFormat::kStl);
  for (std::size_t i = 0; i < 80; ++i) bytes[i] = i % 2 == 0 ? 's' : '\0';
  EXPECT_TRUE(read_mesh(write("wide.stl", bytes)).has_value());
}

TEST_F(ReadMesh, ANameThatSaysNothingLeavesItToTheContent) {
  for (const MeshFormat format :
       {MeshFormat::kObj, MeshFormat::kStl, MeshFormat::kPly, MeshFormat::kOff}) {
    for (const char* name : {"plain", "mesh.dat"}) {
      const auto file = read_mesh(write(name, mesh_to_bytes(ball(), format)));
      ASSERT_TRUE(file.has_value()) << file.error().message;
      EXPECT_TRUE(file->stats.format.starts_with(mesh_format_name(format))) << file->stats.format;
      EXPECT_EQ(file->soup.triangles.size(), ball().triangles.size());
    }
  }
  struct Case {
    std::string_view bytes;
    MeshFormat format;
  };
  const Case cases[] = {{"# by hand\n\nmtllib a.mtl\no part\n  v -1 0 0\n", MeshFormat::kObj},
                        {"\xef\xbb\xbfv .5 0 0\r\n", MeshFormat::kObj},
                        {"v = 3\n", MeshFormat::kAuto},
                        {"a poem\nv 1 2 3\n", MeshFormat::kAuto},
                        {"# nothing but talk\n", MeshFormat::kAuto},
                        {"solid part\nfacet normal 0 0 1\n", MeshFormat::kStl},
                        {"solidly built", MeshFormat::kAuto},
                        {"COFF\n3 1 0\n", MeshFormat::kOff},
                        {"OFFICE", MeshFormat::kAuto},
                        {"{ \"asset\": {\"version\": \"2.0\"} }", MeshFormat::kGltf},
                        {"{ \"name\": 1 }", MeshFormat::kAuto},
                        {"<?xml version=\"1.0\"?>\n<amf unit=\"mm\">", MeshFormat::kAmf},
                        {"<html>", MeshFormat::kAuto},
                        {std::string_view("PK\3\4 3D/3dmodel.model"), MeshFormat::k3mf},
                        {std::string_view("PK\3\4 part.AMF"), MeshFormat::kAmf},
                        {std::string_view("PK\3\4 letter.xml"), MeshFormat::kAuto},
                        {"", MeshFormat::kAuto}};
  for (const Case& one : cases) {
    EXPECT_EQ(mesh_format_of_file(write("plain", one.bytes)), one.format) << one.bytes;
  }
  EXPECT_EQ(mesh_format_of_file(folder_.string()), MeshFormat::kAuto);
  EXPECT_EQ(mesh_format_of_file("no/such/file"), MeshFormat::kAuto);
  EXPECT_EQ(mesh_format_of_file("no/such/file.ply"), MeshFormat::kPly);
  const auto none = read_mesh(write("plain", "a poem\n"));
  ASSERT_FALSE(none.has_value());
  EXPECT_CONTAINS(none.error().message, "the content looks like none of them");
}

TEST_F(ReadMesh, FormatMayBeNamed) {
  const std::string path = write("mesh.dat", mesh_to_bytes(ball(), MeshFormat::kOff));
  MeshReadOptions options;
  options.format = MeshFormat::kOff;
  EXPECT_TRUE(read_mesh(path, options).has_value());
  EXPECT_EQ(mesh_format_named("PLY"), MeshFormat::kPly);
  EXPECT_EQ(mesh_format_named("3mf"), MeshFormat::k3mf);
  EXPECT_EQ(mesh_format_named("step"), MeshFormat::kAuto);
  EXPECT_EQ(mesh_format_of("folder.obj/file"), MeshFormat::kAuto);
}

TEST_F(ReadMesh, FilesThatFillTheirLastPageAreReadToTheEnd) {
  // The scanners rely on a zero byte past the end, which such a file does not have by itself.
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  for (const std::size_t pages : {1u, 3u}) {
    std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    const std::string last = "f 1 2 3\nv 0 0 12345.5";
    text += "#" + std::string(pages * page - text.size() - last.size() - 2, '-') + "\n" + last;
    ASSERT_EQ(text.size(), pages * page);
    const auto file = read_mesh(write("page.obj", text));
    ASSERT_TRUE(file.has_value()) << file.error().message;
    EXPECT_EQ(file->soup.positions.back().z, 12345.5);
  }
}

TEST_F(ReadMesh, WhatCannotBeReadSaysWhy) {
  const auto message = [](const std::string& path) {
    const auto file = read_mesh(path);
    EXPECT_FALSE(file.has_value());
    if (file) return std::string();
    EXPECT_EQ(file.error().code, ErrorCode::kInput);
    return file.error().message;
  };
  EXPECT_CONTAINS(message(folder_ / "none.obj"), "none.obj: No such file or directory");
  fs::create_directory(folder_ / "folder.obj");
  EXPECT_CONTAINS(message(folder_ / "folder.obj"), "folder.obj: Is a directory");
  EXPECT_CONTAINS(message(write("empty.stl", "")), "empty.stl: the file is empty");
  EXPECT_CONTAINS(message(write("wrong.obj", mesh_to_bytes(ball(), MeshFormat::kPly))),
                  "(read as obj, but it looks like ply)");
}

TEST_F(ReadMesh, PipesAreRead) {
  const std::string path = folder_ / "pipe.obj";
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  const std::string bytes = mesh_to_bytes(make_icosphere(1.0, 5), MeshFormat::kObj);
  ASSERT_GT(bytes.size(), std::size_t{1} << 16);
  std::thread writer([&] { std::ofstream(path, std::ios::binary) << bytes; });
  const auto file = read_mesh(path);
  writer.join();
  ASSERT_TRUE(file.has_value()) << file.error().message;
  EXPECT_EQ(file->stats.triangles, 20480u);
}

TEST_F(ReadMesh, StandardInputNeedsAFormat) {
  EXPECT_EQ(read_mesh("-").error().code, ErrorCode::kUsage);
  const std::string path = write("in", mesh_to_bytes(ball(), MeshFormat::kStl));
  const int saved = ::dup(STDIN_FILENO);
  const int in = ::open(path.c_str(), O_RDONLY);
  ASSERT_GE(::dup2(in, STDIN_FILENO), 0);
  MeshReadOptions options;
  options.format = MeshFormat::kStl;
  const auto file = read_mesh("-", options);
  ::dup2(saved, STDIN_FILENO);
  ::close(saved);
  ::close(in);
  ASSERT_TRUE(file.has_value()) << file.error().message;
  EXPECT_EQ(file->stats.triangles, 320u);
}

TEST_F(ReadMesh, MemoryLimitIsKept) {
  Execution execution;
  execution.memory_limit = 5000;
  for (const MeshFormat format :
       {MeshFormat::kObj, MeshFormat::kStl, MeshFormat::kPly, MeshFormat::kOff}) {
    const std::string path =
        write(std::string("a.") + mesh_format_name(format), mesh_to_bytes(ball(), format));
    const auto file = read_mesh(path, {}, execution);
    ASSERT_FALSE(file.has_value()) << mesh_format_name(format);
    EXPECT_EQ(file.error().code, ErrorCode::kLimit);
  }
}

TEST_F(ReadMesh, StopsOnRequest) {
  std::stop_source source;
  source.request_stop();
  Execution execution;
  execution.stop = source.get_token();
  for (const MeshFormat format : {MeshFormat::kObj, MeshFormat::kPly, MeshFormat::kOff}) {
    const std::string path =
        write(std::string("a.") + mesh_format_name(format), mesh_to_bytes(ball(), format));
    const auto file = read_mesh(path, {}, execution);
    ASSERT_FALSE(file.has_value()) << mesh_format_name(format);
    EXPECT_EQ(file.error().code, ErrorCode::kCancelled);
  }
}

TEST_F(ReadMesh, WriteThenReadGivesTheSameMesh) {
  for (const char* name : {"a.obj", "a.stl", "a.ply", "a.off"}) {
    const std::string path = folder_ / name;
    const auto written = write_mesh(path, ball());
    ASSERT_TRUE(written.has_value()) << written.error().message;
    const auto file = read_mesh(path);
    ASSERT_TRUE(file.has_value()) << file.error().message;
    ASSERT_EQ(file->soup.triangles.size(), ball().triangles.size());
    for (std::size_t t = 0; t < ball().triangles.size(); ++t) {
      for (int k = 0; k < 3; ++k) {
        ASSERT_EQ(file->soup.positions[file->soup.triangles[t][k]],
                  ball().positions[ball().triangles[t][k]])
            << name;
      }
    }
  }
}

TEST_F(ReadMesh, ArchivesAreReadFromFilesOnly) {
  const std::string path =
      write("a.amf",
            "<?xml version=\"1.0\"?>\n<amf><object id=\"1\"><mesh><vertices>"
            "<vertex><coordinates><x>0</x><y>0</y><z>0</z></coordinates></vertex>"
            "<vertex><coordinates><x>1</x><y>0</y><z>0</z></coordinates></vertex>"
            "<vertex><coordinates><x>0</x><y>1</y><z>0</z></coordinates></vertex>"
            "</vertices><volume><triangle><v1>0</v1><v2>1</v2><v3>2</v3>"
            "</triangle></volume></mesh></object></amf>");
  const auto file = read_mesh(path);
  if (!file && file.error().code == ErrorCode::kUsage) GTEST_SKIP() << file.error().message;
  ASSERT_TRUE(file.has_value()) << file.error().message;
  EXPECT_EQ(file->soup.triangles.size(), 1u);
  EXPECT_EQ(file->stats.format, "amf");
  EXPECT_EQ(file->stats.triangles, 1u);
  EXPECT_EQ(file->stats.bytes, std::filesystem::file_size(path));
  EXPECT_EQ(read_mesh(write("b.3mf", "no archive")).error().code, ErrorCode::kInput);
  MeshReadOptions options;
  options.format = MeshFormat::k3mf;
  EXPECT_EQ(read_mesh("-", options).error().message, "standard input: 3mf is read from files only");
  EXPECT_EQ(parse_mesh("PK", "bytes", options).error().message,
            "bytes: 3mf is read from files only");
}

TEST_F(ReadMesh, WritingSaysWhyItCannot) {
  EXPECT_EQ(write_mesh(folder_ / "a.xyz", ball()).error().code, ErrorCode::kUsage);
  EXPECT_EQ(write_mesh(folder_ / "a.3mf", ball()).error().code, ErrorCode::kUsage);
  EXPECT_EQ(write_mesh(folder_ / "none" / "a.obj", ball()).error().code, ErrorCode::kOutput);
}

// Every length of a small file: an error, or fewer faces than the whole, or a warning that it may
// be cut. Exceptions are what follows the last face.
TEST_F(ReadMesh, EveryTruncationIsNoticed) {
  TriangleSoup mesh = make_box({-0.5, 0.25, 0}, {1, 2.5, 3});
  std::string ply =
      "ply\nformat binary_little_endian 1.0\nelement vertex 8\nproperty float x\n"
      "property float y\nproperty float z\nelement face 12\n"
      "property list uchar int vertex_indices\nend_header\n";
  std::string big = ply;
  big.replace(big.find("little"), 6, "big");
  const auto add = [&](std::uint32_t bits) {
    for (int shift = 0; shift < 32; shift += 8) ply += static_cast<char>(bits >> shift & 0xff);
    for (int shift = 24; shift >= 0; shift -= 8) big += static_cast<char>(bits >> shift & 0xff);
  };
  for (const glm::dvec3& p : mesh.positions) {
    for (int k = 0; k < 3; ++k) add(std::bit_cast<std::uint32_t>(static_cast<float>(p[k])));
  }
  for (const glm::uvec3& t : mesh.triangles) {
    ply += '\3';
    big += '\3';
    for (int k = 0; k < 3; ++k) add(t[k]);
  }
  std::string stl = "solid box\n";
  for (const glm::uvec3& t : mesh.triangles) {
    stl += "facet normal 0 0 1\nouter loop\n";
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 p = mesh.positions[t[k]];
      stl += fmt::format("vertex {} {} {}\n", p.x, p.y, p.z);
    }
    stl += "endloop\nendfacet\n";
  }
  stl += "endsolid box\n";
  const struct {
    MeshFormat format;
    std::string bytes;
    std::size_t spare;  ///< bytes at the end that carry nothing
  } files[] = {{MeshFormat::kObj, mesh_to_bytes(mesh, MeshFormat::kObj), 1},
               {MeshFormat::kOff, mesh_to_bytes(mesh, MeshFormat::kOff), 1},
               {MeshFormat::kPly, mesh_to_bytes(mesh, MeshFormat::kPly), 1},
               {MeshFormat::kStl, mesh_to_bytes(mesh, MeshFormat::kStl), 0},
               {MeshFormat::kPly, ply, 0},
               {MeshFormat::kPly, big, 0},
               {MeshFormat::kStl, stl, 5}};
  for (const auto& file : files) {
    const auto whole = parse(file.format, file.bytes);
    ASSERT_TRUE(whole.has_value()) << whole.error().message;
    ASSERT_EQ(whole->stats.triangles, 12u);
    for (std::size_t size = 0; size + file.spare < file.bytes.size(); ++size) {
      const auto part = parse(file.format, std::string_view(file.bytes).substr(0, size));
      if (!part) {
        EXPECT_EQ(part.error().code, ErrorCode::kInput);
        EXPECT_TRUE(part.error().message.starts_with("file")) << part.error().message;
      } else {
        EXPECT_TRUE(part->stats.triangles < 12 || !part->stats.warnings.empty())
            << mesh_format_name(file.format) << " cut to " << size << " of " << file.bytes.size();
        for (const glm::uvec3& t : part->soup.triangles) {
          for (int k = 0; k < 3; ++k) ASSERT_LT(t[k], part->soup.positions.size());
        }
      }
    }
  }
}

TEST_F(ReadMesh, AGltfTellsOnceOfAFaceThatIsDropped) {
  // Four vertices, three good triangles, and one whose last vertex is 9.
  const std::string text =
      R"({"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":
      [{"attributes":{"POSITION":0},"indices":1}]}],"accessors":[
      {"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
      {"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}],
      "bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}],
      "buffers":[{"byteLength":72,"uri":"data:application/octet-stream;base64,)"
      "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/"
      "AAACAAEAAAABAAMAAAADAAIAAQACAAkA\"}]}";
  MeshReadOptions options;
  options.format = MeshFormat::kGltf;
  const auto file = parse_mesh(text, "bad.gltf", options);
  ASSERT_TRUE(file.has_value()) << file.error().message;
  EXPECT_EQ(file->soup.triangles.size(), 3u);
  EXPECT_EQ(file->stats.faces, 4u);
  EXPECT_EQ(file->stats.out_of_range, 1u);
  ASSERT_EQ(file->stats.warnings.size(), 1u) << file->stats.warnings.back();
  EXPECT_EQ(
      file->stats.warnings.front(),
      "bad.gltf: meshes[0].primitives[0]: an index is 9, but there are 4 vertices; 1 face was "
      "dropped");
}

}  // namespace
}  // namespace strata
