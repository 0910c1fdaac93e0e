// Pictures of media: many overlapping solids and many particles, mesh in memory to picture.

#include "strata/transparency/media/media.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <random>
#include <string>
#include <vector>

#include "strata/mesh/shapes.h"

namespace strata::bench {
namespace {

using namespace transparency;

struct Options {
  int solids = 100, particles = 0, side = 1024, threads = 2, rounds = 9, subdivisions = 3;
  double radius = 1.0;  // of the largest solid; the scene is 10 wide
  bool inside = false, shadows = false;
};

struct Case {
  Scene scene;
  MediaSettings settings;
  View view;
};

Case make_case(const Options& options) {
  Case made;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-4.0, 4.0), unit(0.0, 1.0);
  const auto colour = [&] { return glm::vec3(unit(random), unit(random), unit(random)); };
  const TriangleSoup ball = make_icosphere(1.0, options.subdivisions);
  for (int i = 0; i < options.solids; ++i) {
    glm::dmat4 m(options.radius * (0.5 + 0.5 * unit(random)));
    m[3] = glm::dvec4(place(random), place(random), place(random), 1.0);
    append(made.scene.mesh, transform(ball, m));
    made.scene.object_of.resize(made.scene.mesh.triangles.size(), static_cast<std::uint32_t>(i));
    made.scene.objects.push_back({fmt::format("ball{}", i), glm::vec4(0.5f)});
    NamedMedium& named = made.settings.media.emplace_back();
    named.object = made.scene.objects.back().name;
    named.medium.extinction = colour();
    named.medium.albedo = colour();
  }
  for (int i = 0; i < options.particles; ++i) {
    made.settings.particles.push_back({{place(random), place(random), place(random)},
                                       0.02 + 0.03 * unit(random),
                                       colour(),
                                       colour()});
  }
  made.settings.light.radiance = glm::vec3(5.0f);
  made.settings.light.shadows = options.shadows;
  Camera camera = look_at(options.inside ? glm::dvec3(0.5) : glm::dvec3(14, 9, 8), glm::dvec3(0));
  camera.field_of_view = 40.0;
  Bounds box = bounds(made.scene.mesh);
  box.include(glm::dvec3(-4)), box.include(glm::dvec3(4));
  const auto view = make_view(camera, glm::ivec2(options.side), box);
  if (view) made.view = *view;
  return made;
}

int run(const Options& options) {
  const Case made = make_case(options);
  Execution execution;
  execution.threads = options.threads;
  std::vector<double> seconds, processor;
  MediaRendering last;
  for (int round = 0; round < options.rounds; ++round) {
    const auto begin = std::chrono::steady_clock::now();
    const std::clock_t processor_begin = std::clock();
    auto rendering = render_media(made.scene, made.view, made.settings, {}, execution);
    if (!rendering) {
      fmt::print(stderr, "{}\n", rendering.error().message);
      return 1;
    }
    seconds.push_back(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    processor.push_back(static_cast<double>(std::clock() - processor_begin) / CLOCKS_PER_SEC);
    last = std::move(*rendering);
  }
  std::sort(seconds.begin(), seconds.end());
  std::sort(processor.begin(), processor.end());
  const Costs& costs = last.rendering.costs;
  const double pixels = static_cast<double>(options.side) * options.side;
  fmt::print(
      "{} solids of {} triangles, {} particles, {} x {}, {} threads: {} fragments, {:.1f} a pixel, "
      "at most {}; {:.1f} ms (median of {}, least {:.1f}); processor time {:.1f} ms; of all "
      "threads "
      "{:.1f} ms to rasterize, "
      "{:.1f} ms to walk\n",
      options.solids, made.scene.mesh.triangles.size() / std::max(1, options.solids),
      options.particles, options.side, options.side, options.threads, costs.stored,
      static_cast<double>(costs.stored) / pixels, costs.most_layers,
      1e3 * seconds[seconds.size() / 2], seconds.size(), 1e3 * seconds.front(),
      1e3 * processor[processor.size() / 2], 1e3 * last.rendering.raster_seconds,
      1e3 * last.rendering.technique_seconds);
  return 0;
}

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) {
  strata::bench::Options options;
  CLI::App app("Times pictures of media");
  app.add_option("--solids", options.solids, "overlapping balls")->capture_default_str();
  app.add_option("--radius", options.radius, "of the largest; the scene is 10 wide")
      ->capture_default_str();
  app.add_option("--subdivisions", options.subdivisions, "of their icosahedra")
      ->capture_default_str();
  app.add_option("--particles", options.particles)->capture_default_str();
  app.add_option("--side", options.side, "pixels")->capture_default_str();
  app.add_option("--threads", options.threads)->capture_default_str();
  app.add_option("--rounds", options.rounds)->capture_default_str();
  app.add_flag("--inside", options.inside, "the eye is among the balls");
  app.add_flag("--shadows", options.shadows, "the light casts shadows");
  CLI11_PARSE(app, argc, argv);
  return strata::bench::run(options);
}
