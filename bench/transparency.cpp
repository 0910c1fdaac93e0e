// How fast transparent pictures are made: fragments a second of the techniques with whole lists,
// from streams in memory; the HA-buffer over the load of its table; and pictures of meshes, which
// --export writes for bench/vtk_peer.py.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <numbers>

#include "bench/support.h"
#include "hashbuffer/random.h"
#include "strata/mesh/shapes.h"
#include "strata/transparency/techniques.h"
#include "transparency/stream/fragment_source.h"

namespace strata::bench {
namespace {

using namespace transparency;

struct Plan {
  std::vector<std::string> tables{"rates", "loads", "meshes"};
  std::vector<std::string> techniques{"count-scan",  "ha64",   "ha64:random", "ha32",
                                      "ha64-culled", "linked", "paged",       "b3d"};
  std::vector<std::string> meshes{"69451:2", "69451:5", "328000:2", "328000:5"};
  std::vector<double> depths{1, 4, 10};
  std::vector<double> loads{0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95, 0.99};
  int side = 1024;
  int threads = 2;
  int rounds = 9;
  double budget_s = 4;
  std::string export_folder, csv;
};

/// Rectangles of 4 to 64 pixels a side at random depths, one after the other.
Frame random_quads(int side, double mean_depth) {
  Random random(7);
  std::vector<ListedFragment> fragments;
  std::vector<glm::vec4> colours;
  const auto below = [&](int n) {
    return static_cast<int>(random.below(static_cast<std::uint64_t>(n)));
  };
  const auto wanted = static_cast<std::size_t>(mean_depth * side * side);
  while (fragments.size() < wanted) {
    const int w = 4 + below(61), h = 4 + below(61), u = below(side - w + 1),
              v = below(side - h + 1);
    const auto face = static_cast<std::uint32_t>(colours.size());
    const auto depth = static_cast<std::uint32_t>(below(1 << 24));
    colours.emplace_back(0.01 * below(100), 0.01 * below(100), 0.01 * below(100), 0.4);
    for (int i = 0; i < w * h; ++i) {
      fragments.push_back({u + i % w, v + i / w, depth, face, face % 2 == 0});
    }
  }
  FrameOptions options;
  options.size = {side, side};
  return *Frame::make(fragments, colours, options);
}

/// `shells` nested spheres with many arms, about as many triangles together as asked for.
Scene armed_shells(int triangles, int shells) {
  Scene scene;
  const int segments = static_cast<int>(std::sqrt(triangles / shells)) & ~1;
  for (int shell = 0; shell < shells; ++shell) {
    TriangleSoup sphere = make_uv_sphere(1.0, segments, segments / 2 + 1);
    for (glm::dvec3& p : sphere.positions) {
      const double arms = std::cos(5 * std::atan2(p.y, p.x)) * std::cos(4 * std::asin(p.z));
      p *= (1.0 - 0.03 * shell) * (1.0 + 0.3 * arms * (1 - p.z * p.z));
    }
    const auto first = static_cast<std::uint32_t>(scene.mesh.positions.size());
    for (const glm::uvec3& t : sphere.triangles) scene.mesh.triangles.push_back(t + first);
    scene.mesh.positions.insert(scene.mesh.positions.end(), sphere.positions.begin(),
                                sphere.positions.end());
    scene.object_of.resize(scene.mesh.triangles.size(), static_cast<std::uint32_t>(shell));
    const double hue = 2.4 * shell;
    scene.objects.push_back(
        {"shell", glm::vec4(0.5 + 0.5 * std::cos(hue), 0.5 + 0.4 * std::sin(hue), 0.6, 0.4)});
  }
  return scene;
}

struct MeshView {
  Scene scene;
  View view;
  glm::dvec3 eye, centre;
  double field_of_view = 22.5;
};
MeshView mesh_view(int triangles, int shells, int side) {
  MeshView of{armed_shells(triangles, shells), {}, {3.0, -4.0, 2.5}, glm::dvec3(0.0)};
  Camera camera = look_at(of.eye, of.centre);
  camera.field_of_view = of.field_of_view = 26.0;
  of.view = *make_view(camera, {side, side}, bounds(of.scene.mesh));
  return of;
}

template <class T>
void write(std::ofstream& out, const std::vector<T>& values) {
  out.write(reinterpret_cast<const char*>(values.data()),
            static_cast<std::streamsize>(values.size() * sizeof(T)));
}

/// The mesh, the colour of each triangle as the eye sees it, the view, and Strata's picture.
void export_for_peers(const std::string& name, const MeshView& of, const Frame& frame,
                      const Image& image) {
  std::vector<glm::vec4> colours;
  for (std::size_t t = 0; t < of.scene.mesh.triangles.size(); ++t) {
    const glm::uvec3& corners = of.scene.mesh.triangles[t];
    const glm::dvec3& a = of.scene.mesh.positions[corners.x];
    const glm::dvec3 normal =
        glm::cross(of.scene.mesh.positions[corners.y] - a, of.scene.mesh.positions[corners.z] - a);
    const bool exit = glm::dot(normal, a - of.eye) > 0.0;
    const glm::vec4 c = frame.source().colours()[2 * t + (exit ? 1 : 0)];
    colours.emplace_back(glm::vec3(c) / c.a, c.a);
  }
  std::ofstream out(name + ".mesh", std::ios::binary);
  const auto& mesh = of.scene.mesh;
  out << fmt::format("{} {} {} {} {} {} {} {} {} {} {}\n", mesh.positions.size(),
                     mesh.triangles.size(), image.width, image.height, of.field_of_view, of.eye.x,
                     of.eye.y, of.eye.z, of.centre.x, of.centre.y, of.centre.z);
  write(out, mesh.positions);
  write(out, mesh.triangles);
  write(out, colours);
  write(out, image.pixels);
}

class Bench {
 public:
  explicit Bench(const Plan& settings) : settings_(settings) {
    execution_.threads = settings.threads;
  }

  Result<void> run() {
    for (const std::string& table : settings_.tables) {
      if (table == "rates") {
        for (const double depth : settings_.depths) {
          auto done = rates(fmt::format("depth {}", depth), random_quads(settings_.side, depth));
          if (!done) return done;
        }
      } else if (table == "loads") {
        if (auto done = loads(); !done) return done;
      } else if (table == "meshes") {
        if (auto done = meshes(); !done) return done;
      }
    }
    return {};
  }
  [[nodiscard]] const Table& table() const { return table_; }

 private:
  struct Job {
    std::string name;
    ChosenTechnique chosen;
  };
  Result<void> add_job(const std::string& text, std::vector<Job>& jobs) {
    auto chosen = parse_technique(text);
    if (!chosen) return tl::unexpected(chosen.error());
    jobs.push_back({text, *chosen});
    return {};
  }

  Result<void> rates(const std::string& stream, const Frame& frame) {
    std::vector<Job> jobs;
    for (const std::string& text : settings_.techniques) {
      if (auto added = add_job(text, jobs); !added) return added;
    }
    return measure(stream, frame, jobs);
  }
  Result<void> loads() {
    const Frame frame = random_quads(settings_.side, 4);
    for (const char* text : {"ha64", "ha64:random", "ha64:farthest-point", "ha32:random"}) {
      std::vector<Job> jobs;
      for (const double load : settings_.loads) {
        if (auto added = add_job(text, jobs); !added) return added;
        jobs.back().chosen.settings.load = load;
        jobs.back().name = fmt::format("{} {}", text, load);
      }
      if (auto done = measure("depth 4", frame, jobs); !done) return done;
    }
    return {};
  }

  /// One row a job; ratios to the first.
  Result<void> measure(const std::string& stream, const Frame& frame, std::vector<Job>& jobs) {
    std::vector<Participant> participants;
    Costs costs;
    Result<void> status;
    for (const Job& job : jobs) {
      participants.push_back({job.name, [&, this]() -> std::shared_ptr<void> {
                                auto made = frame.render(*job.chosen.technique, job.chosen.settings,
                                                         execution_);
                                if (!made) {
                                  status = tl::unexpected(made.error());
                                  return nullptr;
                                }
                                costs = made->costs;
                                return std::make_shared<Rendering>(std::move(*made));
                              }});
    }
    run_interleaved(participants, settings_.rounds, settings_.budget_s * 1e3);
    if (!status) return status;
    double first = 0;
    for (const Participant& participant : participants) {
      const Sample sample = median(participant.samples);
      if (first == 0) first = sample.cpu_ms;
      const auto fragments = static_cast<double>(costs.fragments) * 1e-3;
      table_.add({stream, participant.name, short_number(fragments * 1e-3),
                  short_number(sample.wall_ms), short_number(sample.cpu_ms),
                  short_number(fragments / sample.wall_ms),
                  short_number(fragments / sample.cpu_ms * settings_.threads),
                  short_number(sample.cpu_ms / first)});
    }
    return {};
  }

  /// From the mesh in memory to the picture.
  Result<void> meshes() {
    const Technique* technique = *find_technique("count-scan");
    for (const std::string& text : settings_.meshes) {
      const std::size_t colon = std::min(text.find(':'), text.size() - 1);
      const int triangles = std::stoi(text), shells = std::stoi(text.substr(colon + 1));
      const MeshView of = mesh_view(triangles, shells, settings_.side);
      Result<void> status;
      Rendering rendering;
      const auto render = [&]() -> std::shared_ptr<void> {
        auto frame = Frame::make(of.scene, of.view, {}, execution_);
        if (frame) {
          if (auto made = frame->render(*technique, {}, execution_)) {
            rendering = std::move(*made);
            return nullptr;
          }
        }
        status = fail(ErrorCode::kLimit, "no picture");
        return nullptr;
      };
      std::vector<Participant> one{{"mesh", render}};
      run_interleaved(one, settings_.rounds, settings_.budget_s * 1e3);
      if (!status) return status;
      report_mesh(of, shells, rendering, median(one.front().samples));
    }
    return {};
  }
  void report_mesh(const MeshView& of, int shells, const Rendering& rendering,
                   const Sample& sample) {
    std::size_t covered = 0;
    for (const glm::vec4& pixel : rendering.image.pixels) covered += pixel.a > 0 ? 1 : 0;
    const auto fragments = static_cast<double>(rendering.costs.fragments);
    const std::string name =
        fmt::format("{}k triangles, mean depth {:.1f}", of.scene.mesh.triangles.size() / 1000,
                    fragments / static_cast<double>(std::max<std::size_t>(1, covered)));
    table_.add({name, "count-scan", short_number(fragments * 1e-6), short_number(sample.wall_ms),
                short_number(sample.cpu_ms), short_number(fragments * 1e-3 / sample.wall_ms),
                short_number(fragments * 1e-3 / sample.cpu_ms * settings_.threads), "-"});
    if (settings_.export_folder.empty()) return;
    export_for_peers(fmt::format("{}/mesh-{}k-{}", settings_.export_folder,
                                 of.scene.mesh.triangles.size() / 1000, shells),
                     of, *Frame::make(of.scene, of.view, {}, execution_), rendering.image);
  }

  const Plan& settings_;
  Execution execution_;
  Table table_{{"stream", "technique", "Mfragments", "wall ms", "cpu ms", "Mfragments / s",
                "of cpu time", "cpu / first"}};
};

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) {
  using namespace strata::bench;
  Plan settings;
  CLI::App app{"How fast transparent pictures are made"};
  app.add_option("--tables", settings.tables, "rates, loads, meshes")->delimiter(',');
  app.add_option("--techniques", settings.techniques,
                 "of rates; the first is what others are "
                 "compared with")
      ->delimiter(',');
  app.add_option("--meshes", settings.meshes, "TRIANGLES:SHELLS")->delimiter(',');
  app.add_option("--depths", settings.depths, "mean layers of the streams")->delimiter(',');
  app.add_option("--loads", settings.loads, "of hash tables")->delimiter(',');
  app.add_option("--side", settings.side, "of the picture, pixels");
  app.add_option("--threads", settings.threads, "of each picture");
  app.add_option("--rounds", settings.rounds, "interleaved rounds");
  app.add_option("--budget", settings.budget_s, "seconds for each row");
  app.add_option("--export", settings.export_folder, "write meshes and pictures for vtk_peer.py");
  app.add_option("--csv", settings.csv, "write the table to this file");
  CLI11_PARSE(app, argc, argv);
  Bench bench(settings);
  if (const auto done = bench.run(); !done) {
    fmt::print(stderr, "bench_transparency: {}\n", done.error().message);
    return static_cast<int>(done.error().code);
  }
  return publish(bench.table(), settings.csv) ? 0 : 4;
}
