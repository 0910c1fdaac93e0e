// Reading a mesh of a million triangles: Strata's readers, OpenMesh and tinyobjloader. The files
// are made here and stay in the page cache.

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bench/other_readers.h"
#include "bench/support.h"
#include "strata/mesh/formats/read_mesh.h"
#include "strata/mesh/formats/write_mesh.h"

namespace strata::bench {
namespace {

struct Settings {
  std::string mesh = "knot-1m";
  int rounds = 7;
  double budget_s = 10;
  std::string csv;
};

/// Removes its files when it goes.
class TemporaryFolder {
 public:
  TemporaryFolder()
      : path_(std::filesystem::temp_directory_path() / fmt::format("strata_bench_{}", getpid())) {
    std::filesystem::create_directories(path_);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] std::string file(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// Binary little-endian PLY as scanners write it: float positions, faces of three ints.
void write_binary_ply(const std::string& path, const TriangleSoup& mesh) {
  static_assert(std::endian::native == std::endian::little);
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float "
      "y\nproperty float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.positions.size(), mesh.triangles.size());
  const auto append = [&bytes](const auto& value) {
    const std::size_t at = bytes.size();
    bytes.resize(at + sizeof value);
    std::memcpy(bytes.data() + at, &value, sizeof value);
  };
  for (const glm::dvec3& p : mesh.positions) {
    for (int i = 0; i < 3; ++i) append(static_cast<float>(p[i]));
  }
  for (const glm::uvec3& t : mesh.triangles) {
    append(std::uint8_t{3});
    for (int i = 0; i < 3; ++i) append(t[i]);
  }
  std::ofstream(path, std::ios::binary) << bytes;
}

/// Six decimals, as exporters write them; seventeen digits would be nobody's file.
void round_to_six_decimals(TriangleSoup& mesh) {
  for (glm::dvec3& p : mesh.positions) {
    for (int i = 0; i < 3; ++i) p[i] = std::round(p[i] * 1e6) / 1e6;
  }
}

OtherMesh read_by_strata(const std::string& path, int threads) {
  Execution execution;
  execution.threads = threads;
  auto file = read_mesh(path, {}, execution);
  if (!file) {
    fmt::print(stderr, "bench_reading: {}\n", file.error().message);
    return {};
  }
  const std::size_t vertices = file->soup.positions.size();
  const std::size_t triangles = file->soup.triangles.size();
  return {vertices, triangles, std::make_shared<MeshFile>(std::move(*file))};
}

/// Nothing but reading the bytes, in pieces of a cache's size.
OtherMesh touch_bytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::vector<char> buffer(std::size_t{1} << 20);
  std::uint64_t sum = 0;
  while (in.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || in.gcount() > 0) {
    const auto got = static_cast<std::size_t>(in.gcount());
    for (std::size_t i = 0; i < got; ++i) sum += static_cast<unsigned char>(buffer[i]);
  }
  return {0, 0, std::make_shared<std::uint64_t>(sum)};
}

class Reading {
 public:
  explicit Reading(const Settings& settings) : settings_(settings) {}

  void compare(const std::string& label, const std::string& path, bool obj) {
    std::vector<OtherMesh> meshes;
    std::vector<Participant> participants;
    const auto add = [&](const std::string& name, auto read) {
      const std::size_t index = participants.size();
      participants.push_back({name, [&meshes, index, read, path]() -> std::shared_ptr<void> {
                                OtherMesh mesh = read(path);
                                std::shared_ptr<void> data = std::move(mesh.data);
                                meshes[index] = mesh;
                                return data;
                              }});
    };
    add("touching the bytes", touch_bytes);
    add("strata, 1 thread", [](const std::string& p) { return read_by_strata(p, 1); });
    add("strata, 2 threads", [](const std::string& p) { return read_by_strata(p, 2); });
#ifdef STRATA_HAVE_OPENMESH
    add("OpenMesh", read_by_openmesh);
#endif
#ifdef STRATA_HAVE_TINYOBJ
    if (obj) add("tinyobjloader", read_by_tinyobj);
#endif
    static_cast<void>(obj);
    meshes.resize(participants.size());
    run_interleaved(participants, settings_.rounds, settings_.budget_s * 1e3);

    const auto bytes = static_cast<double>(std::filesystem::file_size(path));
    const Sample one = median(participants[1].samples), two = median(participants[2].samples);
    for (std::size_t i = 0; i < participants.size(); ++i) {
      const Sample sample = median(participants[i].samples);
      table_.add({label, short_number(bytes / (1 << 20)), participants[i].name,
                  short_number(sample.wall_ms), short_number(sample.cpu_ms),
                  short_number(bytes / (1 << 20) / sample.wall_ms * 1e3),
                  short_number(sample.cpu_ms / one.cpu_ms),
                  short_number(sample.wall_ms / two.wall_ms), std::to_string(meshes[i].triangles),
                  std::to_string(meshes[i].vertices)});
    }
  }
  [[nodiscard]] const Table& table() const { return table_; }

 private:
  const Settings& settings_;
  Table table_{{"file", "MiB", "reader", "wall ms", "cpu ms", "MiB / s",
                "cpu / strata with 1 thread", "wall / strata with 2 threads", "triangles",
                "vertices"}};
};

int run(const Settings& settings) {
  auto mesh = bench_mesh(settings.mesh);
  if (!mesh) {
    fmt::print(stderr, "bench_reading: {}\n", mesh.error().message);
    return static_cast<int>(mesh.error().code);
  }
  round_to_six_decimals(mesh->soup);
  const TemporaryFolder folder;
  const std::vector<std::pair<std::string, std::string>> files = {{"OBJ", "mesh.obj"},
                                                                  {"binary STL", "mesh.stl"},
                                                                  {"ascii PLY", "ascii.ply"},
                                                                  {"binary PLY", "binary.ply"},
                                                                  {"OFF", "mesh.off"}};
  Reading reading(settings);
  for (const auto& [label, name] : files) {
    const std::string path = folder.file(name);
    if (name == "binary.ply") {
      write_binary_ply(path, mesh->soup);
    } else if (const auto written = write_mesh(path, mesh->soup); !written) {
      fmt::print(stderr, "bench_reading: {}\n", written.error().message);
      return static_cast<int>(written.error().code);
    }
    reading.compare(label, path, label == "OBJ");
    std::filesystem::remove(path);
  }
  return publish(reading.table(), settings.csv) ? 0 : 4;
}

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) {
  strata::bench::Settings settings;
  CLI::App app{"Reading a million triangles"};
  app.add_option("--mesh", settings.mesh, "a mesh as for bench_voxelizers");
  app.add_option("--rounds", settings.rounds, "interleaved rounds");
  app.add_option("--budget", settings.budget_s, "seconds for each reader and file");
  app.add_option("--csv", settings.csv, "write the table to this file");
  CLI11_PARSE(app, argc, argv);
  return strata::bench::run(settings);
}
