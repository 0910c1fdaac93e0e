// Boundary meshes of trees: boundary_mesh() against Manifold, whose npm package runs in node beside
// it (WebAssembly, one thread; bench/manifold_peer.mjs). Both begin with the solids' triangles in
// memory and end with the triangles of the result; Strata's checks of the result are included.
//
// Then what Strata promises for itself: growth with holes, volumes equal to formulas.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "bench/csg_scenes.h"
#include "bench/support.h"
#include "csg/geometry.h"
#include "strata/csg/boundary/boundary_mesh.h"
#include "strata/mesh/shapes.h"

namespace strata::bench {
namespace {

using csg::Operation;
using csg::Solid;
using csg::Tree;

struct Settings {
  std::string folder = STRATA_SOURCE_DIR "/build/bench/scenes";
  std::vector<std::string> scenes{
      "plate400",          "diff_u30_u30",       "diff_u50_u50", "menger3",
      "union_mixed200",    "inter_spheres50",    "bunny-1m",     "boxes-10000",
      "spheres-nested-50", "spheres-nested-200", "holes-100",    "holes-10000"};
  int threads = 2;
  int rounds = 7;
  double budget_s = 10;
  double peer_budget_s = 30;
  std::string manifold;  // manifold.js
  std::string csv, laws_csv;
  std::string alone;  // measure one scene in this process and print time and memory
};

Execution with_threads(int threads) {
  Execution execution;
  execution.threads = threads;
  return execution;
}

// --- scenes
// -----------------------------------------------------------------------------------------

/// Unit cubes anywhere in a cube that they fill to 44 %.
Tree random_boxes(int count) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place(0.0, std::cbrt(count / 0.58));
  const auto box = std::make_shared<const TriangleSoup>(make_box(glm::dvec3(0), glm::dvec3(1)));
  Tree tree;
  std::vector<Tree::NodeId> boxes;
  for (int i = 0; i < count; ++i) {
    const glm::dvec3 at(place(random), place(random), place(random));
    boxes.push_back(
        tree.add_solid({.mesh = box, .world_from_mesh = glm::translate(glm::dmat4(1.0), at)}));
  }
  tree.set_root(tree.add(Operation::kUnion, boxes));
  return tree;
}

/// s1 - (s2 - (s3 - ...)) for one mesh, smaller each time.
Tree nested(const TriangleSoup& mesh, int depth) {
  const auto shared = std::make_shared<const TriangleSoup>(mesh);
  Tree tree;
  std::vector<Tree::NodeId> solids;
  for (int i = depth; i > 0; --i) {
    solids.push_back(tree.add_solid(
        {.mesh = shared, .world_from_mesh = glm::scale(glm::dmat4(1.0), glm::dvec3(i))}));
  }
  Tree::NodeId root = solids.back();
  for (std::size_t i = solids.size() - 1; i-- > 0;) {
    root = tree.add(Operation::kDifference, {solids[i], root});
  }
  tree.set_root(root);
  return tree;
}

/// A plate minus cylinders of 32 sides in a square pattern.
Tree plate_with_holes(int count) {
  const int side = static_cast<int>(std::lround(std::sqrt(count)));
  const auto hole = std::make_shared<const TriangleSoup>(make_cylinder(0.35, 2, 32));
  Tree tree;
  std::vector<Tree::NodeId> nodes{tree.add_solid(
      {.mesh = std::make_shared<const TriangleSoup>(make_box({0, 0, 0}, {side, side, 1}))})};
  for (int i = 0; i < count; ++i) {
    const glm::dvec3 at(i % side + 0.5, i / side + 0.5, -0.5);
    nodes.push_back(
        tree.add_solid({.mesh = hole, .world_from_mesh = glm::translate(glm::dmat4(1.0), at)}));
  }
  tree.set_root(tree.add(Operation::kDifference, nodes));
  return tree;
}

int number_after(const std::string& name, const char* word) {
  return std::atoi(name.c_str() + std::string(word).size());
}

Result<Tree> tree_of(const Settings& settings, const std::string& name) {
  if (name.starts_with("boxes-")) return random_boxes(number_after(name, "boxes-"));
  if (name.starts_with("holes-")) return plate_with_holes(number_after(name, "holes-"));
  if (name.starts_with("spheres-nested-")) {
    return nested(make_icosphere(1, 3), number_after(name, "spheres-nested-"));
  }
  if (name.starts_with("boxes_nested-")) {
    return nested(make_box(glm::dvec3(-1), glm::dvec3(1)), number_after(name, "boxes_nested-"));
  }
  auto scene = csg_scene(settings.folder, name, with_threads(settings.threads));
  if (!scene) return tl::unexpected(scene.error());
  return std::move(scene->tree);
}

std::uint64_t triangles_of(const Tree& tree) {
  std::uint64_t sum = 0;
  for (const Solid& solid : tree.solids()) sum += solid.mesh ? solid.mesh->triangles.size() : 0;
  return sum;
}

/// Bytes of all solids in world space.
std::uint64_t bytes_of(const Tree& tree) {
  std::uint64_t sum = 0;
  for (const Solid& solid : tree.solids()) {
    if (!solid.mesh) continue;
    sum += solid.mesh->positions.size() * sizeof(glm::dvec3) +
           solid.mesh->triangles.size() * sizeof(glm::uvec3);
  }
  return sum;
}

std::uint64_t bytes_of(const SolidMesh& mesh) {
  return mesh.positions.size() * sizeof(glm::dvec3) + mesh.triangles.size() * sizeof(glm::uvec3) +
         mesh.part_of.size() * sizeof(std::uint32_t);
}

double volume_of(const SolidMesh& mesh) {
  double six = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    six += glm::dot(mesh.positions[t.x], glm::cross(mesh.positions[t.y], mesh.positions[t.z]));
  }
  return six / 6;
}

// --- the peer
// ---------------------------------------------------------------------------------------

/// Writes a tree for bench/manifold_peer.mjs.
Result<void> write_for_peer(const Tree& tree, const std::string& path) {
  const csg::Geometry geometry(tree);
  std::string text = R"({"solids":[)";
  const char* comma = "";
  for (const auto& part : geometry.parts()) {
    text += fmt::format(R"({}{{"vertices":{},"triangles":{}}})", std::exchange(comma, ","),
                        part.positions.size(), part.triangles.size());
  }
  text += R"(],"nodes":[)";
  comma = "";
  for (Tree::NodeId node = 0; node < tree.nodes().size(); ++node) {
    const Tree::Node& what = tree.nodes()[node];
    text += std::exchange(comma, ",");
    if (what.operation == Operation::kSolid) {
      text += fmt::format(R"(["solid",{}])", what.first);
      continue;
    }
    const char* const word = what.operation == Operation::kUnion          ? "union"
                             : what.operation == Operation::kIntersection ? "intersection"
                                                                          : "difference";
    std::string operands;
    for (const Tree::NodeId operand : tree.operands(node)) {
      operands += (operands.empty() ? "" : ",") + std::to_string(operand);
    }
    text += fmt::format(R"(["{}",[{}]])", word, operands);
  }
  text += fmt::format("],\"root\":{}}}\n", tree.root());
  std::ofstream out(path, std::ios::binary);
  const auto put = [&out](const void* data, std::size_t size) {
    out.write(static_cast<const char*>(data), static_cast<std::streamsize>(size));
    const std::array<char, 16> padding{};
    out.write(padding.data(), static_cast<std::streamsize>((16 - size % 16) % 16));
  };
  put(text.data(), text.size());
  for (const auto& part : geometry.parts()) {
    put(part.positions.data(), part.positions.size() * sizeof(glm::dvec3));
    put(part.triangles.data(), part.triangles.size_bytes());
  }
  if (!out.flush()) return fail(ErrorCode::kOutput, "cannot write {}", path);
  return {};
}

struct PeerTimes {
  double wall_ms = std::nan(""), cpu_ms = std::nan("");
  double triangles = std::nan(""), volume = std::nan("");
};

/// The number behind `"name":` in a line of JSON, or no number.
double number_of(const std::string& json, const std::string& name) {
  const auto at = json.find('"' + name + "\":");
  return at == std::string::npos ? std::nan("") : std::atof(json.c_str() + at + name.size() + 3);
}

PeerTimes run_peer(const Settings& settings, const std::string& scene) {
  const std::string command =
      fmt::format("timeout 60 node --max-old-space-size=8192 '{}' '{}' '{}' {} {} 2>/dev/null",
                  STRATA_SOURCE_DIR "/bench/manifold_peer.mjs", settings.manifold, scene,
                  settings.rounds, settings.peer_budget_s * 1e3);
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::string line;
  if (pipe) {
    std::array<char, 1024> buffer{};
    while (std::fgets(buffer.data(), buffer.size(), pipe.get()) != nullptr) line += buffer.data();
  }
  return {number_of(line, "wall"), number_of(line, "cpu"), number_of(line, "triangles"),
          number_of(line, "volume")};
}

// --- ours
// -------------------------------------------------------------------------------------------

using Made = std::shared_ptr<csg::BoundaryMesh>;

Result<Made> make(const Tree& tree, int threads) {
  auto made = csg::boundary_mesh(tree, tree.root(), {}, with_threads(threads));
  if (!made) return tl::unexpected(made.error());
  return std::make_shared<csg::BoundaryMesh>(std::move(*made));
}

/// In a process that has done nothing else: prints milliseconds, and bytes at the peak.
int measure_alone(const Settings& settings) {
  const auto tree = tree_of(settings, settings.alone);
  if (!tree) return 1;
  bool good = true;
  Sample sample;
  const std::uint64_t peak = added_peak_bytes([&]() -> std::shared_ptr<void> {
    Made made;
    sample = time_once([&]() -> std::shared_ptr<void> {
      auto result = make(*tree, settings.threads);
      good = result.has_value();
      if (good) made = *result;
      return nullptr;
    });
    return made;
  });
  fmt::print("{} {}\n", sample.wall_ms, peak);
  return good ? 0 : 1;
}

/// Rows of meshes, and the geometric mean of their ratios.
class Meshes {
 public:
  explicit Meshes(const Settings& settings) : settings_(settings) {}

  Result<void> add(const std::string& name) {
    const auto tree = tree_of(settings_, name);
    if (!tree) return tl::unexpected(tree.error());
    Result<void> status;
    Made last;
    std::vector<Participant> ours{{"Strata", [&]() -> std::shared_ptr<void> {
                                     auto made = make(*tree, settings_.threads);
                                     if (!made) {
                                       status = tl::unexpected(made.error());
                                       return nullptr;
                                     }
                                     last = *made;
                                     return nullptr;
                                   }}};
    // Half of the rounds before the peer and half after it.
    run_interleaved(ours, (settings_.rounds + 1) / 2, settings_.budget_s * 500);
    if (!status) return fail(status.error().code, "{}: {}", name, status.error().message);
    PeerTimes peer;
    if (!settings_.manifold.empty()) {
      const std::string file = settings_.folder + "/" + name + ".tree";
      if (auto written = write_for_peer(*tree, file); !written) return written;
      peer = run_peer(settings_, file);
      std::remove(file.c_str());
    }
    run_interleaved(ours, settings_.rounds / 2, settings_.budget_s * 500);
    const auto alone = run_self({"--alone", name, "--folder", settings_.folder, "--threads",
                                 std::to_string(settings_.threads)});
    if (!alone) return tl::unexpected(alone.error());
    std::istringstream numbers(*alone);
    double cold_ms = 0, peak = 0;
    numbers >> cold_ms >> peak;
    put(name, *tree, *last, median(ours[0].samples), peer, {cold_ms, peak});
    return {};
  }

  bool publish_table() {
    if (count_ > 0) {
      std::vector<std::string> row(columns_, "-");
      row[0] = "geometric mean";
      row[columns_ - 5] = short_number(std::exp(logarithms_ / count_));
      row[columns_ - 4] = short_number(std::exp(cpu_logarithms_ / count_));
      table_.add(std::move(row));
    }
    return publish(table_, settings_.csv);
  }

 private:
  struct Alone {
    double cold_ms, peak;
  };

  void put(const std::string& name, const Tree& tree, const csg::BoundaryMesh& made,
           const Sample& mine, const PeerTimes& peer, const Alone& alone) {
    const double ratio = peer.wall_ms / mine.wall_ms;
    if (std::isfinite(ratio)) {
      logarithms_ += std::log(ratio);
      cpu_logarithms_ += std::log(peer.cpu_ms / mine.cpu_ms);
      ++count_;
    }
    const double bytes = static_cast<double>(bytes_of(tree) + bytes_of(made.mesh));
    table_.add({name, std::to_string(tree.solids().size()), std::to_string(triangles_of(tree)),
                std::to_string(made.mesh.triangles.size()), short_number(mine.wall_ms),
                short_number(mine.cpu_ms), short_number(alone.cold_ms), short_number(peer.wall_ms),
                short_number(peer.cpu_ms),
                std::isfinite(peer.triangles) ? fmt::format("{:.0f}", peer.triangles) : "-",
                short_number(ratio), short_number(peer.cpu_ms / mine.cpu_ms),
                std::isfinite(peer.volume)
                    ? fmt::format("{:.0e}", std::abs(peer.volume / volume_of(made.mesh) - 1))
                    : "-",
                megabytes(static_cast<std::uint64_t>(alone.peak)),
                short_number(alone.peak / bytes)});
    fmt::print(stderr, "{}: {} ms, Manifold {} ms, {}\n", name, short_number(mine.wall_ms),
               short_number(peer.wall_ms), short_number(ratio));
  }

  static constexpr std::size_t columns_ = 15;
  const Settings& settings_;
  Table table_{{"scene", "solids", "triangles", "triangles of the result", "ms", "cpu ms",
                "first run ms", "Manifold ms", "Manifold cpu ms", "Manifold's triangles", "ratio",
                "cpu ratio", "volumes differ by", "peak MiB", "peak / (input + output)"}};
  double logarithms_ = 0, cpu_logarithms_ = 0;
  int count_ = 0;
};

/// What Strata promises for itself.
class Laws {
 public:
  explicit Laws(const Settings& settings) : settings_(settings) {}

  Result<void> run() {
    if (auto done = holes(); !done) return done;
    // 400^3 - 398^3 + ... = 8 n^2 (2 n + 3) / 4 for n = 200.
    if (auto done = volume("boxes_nested-200", glm::dmat4(1.0), 2.0 * 200 * 200 * 403); !done) {
      return done;
    }
    // A side of 54 puts all corners of the sponge on the lattice: 20^3 of 27^3 cubes of 2^3.
    return volume("menger3", glm::scale(glm::dmat4(1.0), glm::dvec3(54.0 / 50.0)), 64000);
  }
  bool publish_table() { return publish(table_, settings_.laws_csv); }

 private:
  Result<void> holes() {
    const Tree few = plate_with_holes(100), many = plate_with_holes(10000);
    Result<void> status;
    const auto job = [&](const Tree& tree) {
      return [&]() -> std::shared_ptr<void> {
        const auto made = make(tree, settings_.threads);
        if (!made) status = tl::unexpected(made.error());
        return nullptr;
      };
    };
    std::vector<Participant> participants{{"100", job(few)}, {"10000", job(many)}};
    run_interleaved(participants, settings_.rounds, settings_.budget_s * 1e3);
    if (!status) return status;
    // Processor time: other jobs would disturb the small one more.
    const double each_of_few = median(participants[0].samples).cpu_ms / 100;
    const double each_of_many = median(participants[1].samples).cpu_ms / 10000;
    table_.add({"holes-10000", "us of processor time a hole", short_number(1e3 * each_of_many),
                "of 100", short_number(1e3 * each_of_few),
                short_number(each_of_many / each_of_few)});
    return {};
  }

  Result<void> volume(const std::string& name, const glm::dmat4& place, double formula) {
    auto tree = tree_of(settings_, name);
    if (!tree) return tl::unexpected(tree.error());
    *tree = transform(place, *std::move(tree));
    Result<csg::ExactMeasures> measures = csg::ExactMeasures{};
    std::vector<Participant> participants{
        {"measures", [&]() -> std::shared_ptr<void> {
           measures = csg::exact_measures(*tree, tree->root(), {}, with_threads(settings_.threads));
           return nullptr;
         }}};
    run_interleaved(participants, settings_.rounds, settings_.budget_s * 1e3);
    if (!measures) return tl::unexpected(measures.error());
    table_.add({name,
                fmt::format("volume, {} ms", short_number(median(participants[0].samples).wall_ms)),
                fmt::format("{}", measures->volume), "formula", fmt::format("{}", formula),
                fmt::format("{}", measures->volume / formula)});
    return {};
  }

  const Settings& settings_;
  Table table_{{"scene", "what", "value", "against", "that value", "ratio"}};
};

int run(const Settings& settings) {
  if (!settings.alone.empty()) return measure_alone(settings);
  bool good = true;
  const auto check = [&good](const Result<void>& done) {
    if (!done) fmt::print(stderr, "bench: {}\n", done.error().message);
    good = good && done.has_value();
  };
  if (settings.manifold.empty()) {
    fmt::print(stderr, "bench_boundary: without Manifold; see --manifold\n");
  }
  Meshes meshes(settings);
  for (const std::string& name : settings.scenes) check(meshes.add(name));
  good = meshes.publish_table() && good;
  Laws laws(settings);
  check(laws.run());
  return laws.publish_table() && good ? 0 : 1;
}

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) {
  strata::bench::Settings settings;
  CLI::App app("Boundary meshes of trees, against Manifold");
  app.add_option("--folder", settings.folder, "where bench/csg_make_scenes.py has made the scenes");
  app.add_option("--scene", settings.scenes, "scenes, instead of all");
  app.add_option("--manifold", settings.manifold, "manifold.js of the npm package manifold-3d");
  app.add_option("--threads", settings.threads, "of Strata")->check(CLI::Range(1, 256));
  app.add_option("--rounds", settings.rounds)->check(CLI::Range(1, 1000));
  app.add_option("--budget", settings.budget_s, "seconds for Strata and a scene");
  app.add_option("--peer-budget", settings.peer_budget_s, "seconds for Manifold and a scene");
  app.add_option("--csv", settings.csv, "write the table of meshes there");
  app.add_option("--laws-csv", settings.laws_csv, "write the other table there");
  app.add_option("--alone", settings.alone, "print what a scene takes in a fresh process");
  CLI11_PARSE(app, argc, argv);
  return strata::bench::run(settings);
}
