// The tables of the papers on order-independent transparency, measured again on the CPU: ratios,
// counts and shapes, since frames a second of other machines do not carry over. One CSV file a
// table; docs/papers.md says what they mean.
//
//   MLAB  Salvi, Vaidyanathan, "Multi-layer alpha blending", 2014
//   DFB   Maule, Comba, Torchelsen, Bastos, "Memory-optimized order-independent transparency with
//   Dynamic Fragment
//         Buffer", 2014; and "A survey of raster-based transparency techniques", 2011
//   HA    Lefebvre, Hornus, Lasram, "HA-Buffer: Coherent Hashing for single-pass A-buffer", 2013

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>

#include "bench/support.h"
#include "hashbuffer/random.h"
#include "strata/mesh/shapes.h"
#include "strata/transparency/techniques.h"

namespace strata::bench {
namespace {

using namespace transparency;

struct Plan {
  std::string folder;
  std::vector<std::string> tables;  ///< empty: all
  bool quick = false;
  int threads = 2;
};

/// What one technique did with a frame.
struct Outcome {
  Rendering rendering;
  double seconds = 0.0;  ///< of the technique, all threads; the least of the rounds
  std::string error;
};

class Papers {
 public:
  explicit Papers(const Plan& plan) : plan_(plan) { execution_.threads = plan.threads; }

  int run() {
    std::filesystem::create_directories(plan_.folder);
    const std::pair<const char*, void (Papers::*)()> tables[] = {
        {"culling", &Papers::culling},
        {"stacked", &Papers::stacked},
        {"speed", &Papers::speed},
        {"scenes", &Papers::scenes},
        {"quads", &Papers::quads},
        {"bunny", &Papers::bunny},
        {"walkthrough", &Papers::walkthrough},
        {"layers", &Papers::layers},
        {"model", &Papers::model},
        {"mlab_memory", &Papers::mlab_memory},
        {"artefacts", &Papers::artefacts}};
    for (const auto& [name, table] : tables) {
      if (!plan_.tables.empty() &&
          std::find(plan_.tables.begin(), plan_.tables.end(), name) == plan_.tables.end()) {
        continue;
      }
      name_ = name;
      std::fprintf(stderr, "== %s\n", name);
      (this->*table)();
      scenes_.clear();
    }
    return 0;
  }

 private:
  void write(const Table& table) const {
    std::ofstream(plan_.folder + "/" + name_ + ".csv") << table.csv();
    std::printf("\n%s\n\n%s", name_.c_str(), table.markdown().c_str());
    std::fflush(stdout);
  }

  Outcome render(const transparency::Frame& frame, const std::string& technique) const {
    Outcome outcome;
    const auto chosen = parse_technique(technique);
    if (!chosen) {
      outcome.error = chosen.error().message;
      return outcome;
    }
    const int rounds = plan_.quick ? 2 : 3;
    for (int i = 0; i < rounds; ++i) {
      auto rendering = frame.render(*chosen->technique, chosen->settings, execution_);
      if (!rendering) {
        outcome.error = rendering.error().message;
        return outcome;
      }
      if (i == 0 || rendering->technique_seconds < outcome.seconds) {
        outcome.seconds = rendering->technique_seconds;
      }
      if (i + 1 == rounds) outcome.rendering = std::move(*rendering);
    }
    return outcome;
  }

  static std::string mega(double count) { return fmt::format("{:.3f}", count * 1e-6); }
  static std::string mib(std::uint64_t bytes) {
    return fmt::format("{:.1f}", static_cast<double>(bytes) / 1048576.0);
  }
  static std::string ms(double seconds) { return fmt::format("{:.2f}", seconds * 1e3); }

  /// A frame of triangles seen along z, which fill the picture.
  transparency::Frame front_view(Scene given, glm::ivec2 size) {
    const Scene& scene = scenes_.emplace_back(std::move(given));  // frames borrow their scenes
    Camera camera;
    camera.projection = Projection::kOrthographic;
    camera.rotation = glm::dvec3(0.0);
    const Bounds box = bounds(scene.mesh);
    centre_camera(camera, box);
    const double across = (box.high.x - box.low.x) * size.y / size.x;
    camera.distance = 0.5 * std::max(box.high.y - box.low.y, across) /
                      std::tan(glm::radians(camera.field_of_view / 2));
    FrameOptions options;
    options.opaque_first = false;
    return *transparency::Frame::make(scene, *make_view(camera, size, box), options, execution_);
  }

  static Scene of_mesh(TriangleSoup mesh, float opacity) {
    Scene scene;
    scene.mesh = std::move(mesh);
    scene.objects.push_back({"mesh", {0.3f, 0.6f, 0.9f, opacity}});
    return scene;
  }

  /// Rectangles of the picture, [u0, u1) x [v0, v1), one depth each.
  static transparency::Frame rectangles(const std::vector<std::array<int, 4>>& boxes,
                                        glm::ivec2 size, float opacity) {
    std::vector<ListedFragment> fragments;
    std::vector<glm::vec4> colours;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const auto& [u0, v0, u1, v1] = boxes[i];
      const auto face = static_cast<std::uint32_t>(i);
      colours.emplace_back(0.2f + 0.1f * static_cast<float>(i % 8), 0.5f, 0.3f, opacity);
      // Depths in another order than that of submission.
      const auto depth = static_cast<std::uint32_t>((i * 40503u + 7u) % 65536u * 256u);
      for (int v = v0; v < v1; ++v) {
        for (int u = u0; u < u1; ++u) fragments.push_back({u, v, depth, face, false});
      }
    }
    FrameOptions options;
    options.size = size;
    return *transparency::Frame::make(fragments, colours, options);
  }

  /// A ball of hair: bands that wind from the middle outward.
  static Scene hairball(int strands, int pieces, float opacity) {
    Random random(11);
    const auto unit = [&random] { return static_cast<double>(random.below(1 << 20)) / (1 << 20); };
    Scene scene = of_mesh({}, opacity);
    for (int strand = 0; strand < strands; ++strand) {
      const double z = 2 * unit() - 1, turn = 2 * std::numbers::pi * unit();
      const double around = std::sqrt(1 - z * z);
      glm::dvec3 at(0.0), along(around * std::cos(turn), around * std::sin(turn), z);
      const double thick = 0.0025;
      for (int piece = 0; piece <= pieces; ++piece) {
        const glm::dvec3 side = glm::normalize(glm::cross(along, glm::dvec3(0, 0, 1.0001))) * thick;
        const auto first = static_cast<std::uint32_t>(scene.mesh.positions.size());
        scene.mesh.positions.push_back(at - side);
        scene.mesh.positions.push_back(at + side);
        if (piece > 0) {
          scene.mesh.triangles.emplace_back(first - 2, first - 1, first);
          scene.mesh.triangles.emplace_back(first, first - 1, first + 1);
        }
        at += along * (1.0 / pieces);
        const glm::dvec3 bend(unit() - 0.5, unit() - 0.5, unit() - 0.5);
        along = glm::normalize(along + 0.8 * bend);
      }
    }
    return scene;
  }

  // --- HA: early culling of a hairball
  // ------------------------------------------------------------
  void culling() {
    Table table(
        {"opacity", "fragments", "stored", "part", "published part", "Mfragments/s stored", "ms"});
    const double published[] = {0.760, 0.491, 0.248, 0.041};
    const float opacities[] = {0.125f, 0.25f, 0.5f, 1.0f};
    for (int i = 0; i < 4; ++i) {
      const auto frame =
          front_view(hairball(plan_.quick ? 4000 : 13000, 40, opacities[i]), {1024, 1024});
      const Outcome out = render(frame, "ha64-culled");
      const Costs& costs = out.rendering.costs;
      table.add({fmt::format("{}", opacities[i]), mega(static_cast<double>(costs.fragments)),
                 mega(static_cast<double>(costs.kept)),
                 fmt::format("{:.3f}",
                             static_cast<double>(costs.kept) /
                                 static_cast<double>(std::max<std::uint64_t>(1, costs.fragments))),
                 fmt::format("{:.3f}", published[i]),
                 fmt::format("{:.1f}", static_cast<double>(costs.kept) / out.seconds * 1e-6),
                 ms(out.seconds)});
    }
    write(table);
  }

  // --- HA: quads that are drawn together until they stack
  // -------------------------------------------
  void stacked() {
    constexpr int kSide = 1024, kQuads = 64,
                  kQuad = 128;  // 64 quads of 128 x 128: 1,048,576 fragments
    Table table({"spread", "most layers", "ha64 ms", "ha64 comparisons a fragment", "culled ms",
                 "culled stored"});
    for (const double spread : {1.0, 0.75, 0.5, 0.25, 0.1, 0.0}) {
      std::vector<std::array<int, 4>> boxes;
      for (int i = 0; i < kQuads; ++i) {
        const int u =
            static_cast<int>(spread * (i % 8) * kQuad + (1 - spread) * (kSide - kQuad) / 2);
        const int v =
            static_cast<int>(spread * (i / 8) * kQuad + (1 - spread) * (kSide - kQuad) / 2);
        boxes.push_back({u, v, u + kQuad, v + kQuad});
      }
      const auto frame = rectangles(boxes, {kSide, kSide}, 0.5f);
      const Outcome all = render(frame, "ha64"), culled = render(frame, "ha64-culled");
      const Costs& costs = all.rendering.costs;
      table.add({fmt::format("{}", spread), std::to_string(costs.most_layers), ms(all.seconds),
                 fmt::format("{:.1f}", static_cast<double>(costs.comparisons) /
                                           static_cast<double>(costs.fragments)),
                 ms(culled.seconds), mega(static_cast<double>(culled.rendering.costs.kept))});
    }
    write(table);
  }

  // --- HA: table 2, a dragon of 871 k triangles
  // ------------------------------------------------------
  void speed() {
    TriangleSoup knot = make_torus_knot(5, 12, 0.14, 605, 45);
    if (!plan_.quick) knot = subdivide(subdivide(knot));
    const auto frame = front_view(of_mesh(std::move(knot), 0.4f), {1024, 1024});
    const std::pair<const char*, double> rows[] = {{"depth-peeling", 82},
                                                   {"dual-peeling", 140},
                                                   {"stencil-routed:16", 226},
                                                   {"paged", 157},
                                                   {"ha64:random", 187},
                                                   {"ha64", 0},
                                                   {"ha32", 298},
                                                   {"count-scan", 0},
                                                   {"linked", 0},
                                                   {"b3d", 0}};
    Table table({"technique", "ms", "of peeling", "published", "passes", "Mfragments/s", "MiB"});
    double peeling = 0.0;
    for (const auto& [name, published] : rows) {
      const Outcome out = render(frame, name);
      if (!out.error.empty()) {
        std::fprintf(stderr, "%s\n", out.error.c_str());
        continue;
      }
      if (peeling == 0.0) peeling = out.seconds;
      const Costs& costs = out.rendering.costs;
      table.add({name, ms(out.seconds), fmt::format("{:.2f}", peeling / out.seconds),
                 published > 0 ? fmt::format("{:.2f}", published / 82) : "",
                 std::to_string(costs.geometry_passes),
                 fmt::format("{:.1f}", static_cast<double>(costs.fragments) / out.seconds * 1e-6),
                 mib(costs.allocated_bytes)});
    }
    write(table);
  }

  // --- HA: scenes by their number of fragments
  // --------------------------------------------------------
  void scenes() {
    Table table({"like", "published fragments", "fragments", "most layers", "ms", "published load",
                 "MiB at load .5"});
    struct Like {
      const char* name;
      double fragments, load;
    };
    for (const Like& like : {Like{"horses", 891929, 0.544}, Like{"hand", 1487942, 0.581},
                             Like{"joystick", 539236, 0.514}, Like{"dendrite", 855296, 0.522},
                             Like{"sculpture", 1021046, 0.486}, Like{"egg", 744208, 0.71}}) {
      // Nested tubes: the fragments grow with the square of the scale.
      const TriangleSoup knot = make_torus_knot(3, 7, 0.25, 900, 40);
      auto size = glm::ivec2(1024);
      auto frame = front_view(of_mesh(knot, 0.3f), size);
      for (int round = 0; round < 3; ++round) {
        const Outcome now = render(frame, "count-scan");
        const double ratio = like.fragments / static_cast<double>(now.rendering.costs.fragments);
        size = glm::ivec2(static_cast<int>(std::lround(size.x * std::sqrt(ratio))));
        frame = front_view(of_mesh(knot, 0.3f), size);
      }
      const Outcome out = render(frame, "ha64");
      const Costs& costs = out.rendering.costs;
      table.add({like.name, mega(like.fragments), mega(static_cast<double>(costs.fragments)),
                 std::to_string(costs.most_layers), ms(out.seconds), fmt::format("{}", like.load),
                 mib(costs.allocated_bytes)});
    }
    write(table);
  }

  // --- DFB: 1, 5, 10 quads over their coverage
  // --------------------------------------------------------
  void quads() {
    constexpr int kSide = 1024;
    const char* names[] = {"b3d", "count-scan", "paged", "linked", "ha64"};
    std::vector<std::string> columns{"layers", "coverage"};
    for (const char* name : names) columns.push_back(std::string(name) + " ms");
    Table table(columns);
    for (const int layers : {1, 5, 10}) {
      for (const double coverage : {0.05, 0.25, 0.5, 1.0}) {
        const int half = static_cast<int>(0.5 * kSide * std::sqrt(coverage));
        const auto frame = rectangles(
            std::vector<std::array<int, 4>>(
                static_cast<std::size_t>(layers),
                {kSide / 2 - half, kSide / 2 - half, kSide / 2 + half, kSide / 2 + half}),
            {kSide, kSide}, 0.3f);
        std::vector<std::string> row{std::to_string(layers), fmt::format("{:.2f}", coverage)};
        for (const char* name : names) row.push_back(ms(render(frame, name).seconds));
        table.add(row);
      }
    }
    write(table);
  }

  // --- DFB: the bunny at three sizes
  // ------------------------------------------------------------------
  void bunny() {
    const auto mesh = bench_mesh("bumps-82k");
    if (!mesh) return;
    const int sides[] = {500, 800, 1100};
    struct Row {
      const char* name;
      double published[3];  ///< frames a second
    };
    const Row rows[] = {{"count-scan", {500, 294, 170}},
                        {"b3d", {1250, 625, 345}},
                        {"paged:4", {500, 213, 114}},
                        {"linked", {333, 141, 74}},
                        {"ha64", {0, 0, 0}}};
    Table table({"technique", "side", "ms", "count-scan over it", "published"});
    double scan[3] = {};
    for (const Row& row : rows) {
      for (int i = 0; i < 3; ++i) {
        const auto frame = front_view(of_mesh(mesh->soup, 0.4f), {sides[i], sides[i]});
        const Outcome out = render(frame, row.name);
        if (scan[i] == 0.0) scan[i] = out.seconds;
        table.add({row.name, std::to_string(sides[i]), ms(out.seconds),
                   fmt::format("{:.2f}", scan[i] / out.seconds),
                   row.published[i] > 0
                       ? fmt::format("{:.2f}", row.published[i] / rows[0].published[i])
                       : ""});
      }
    }
    write(table);
  }

  // --- DFB: walkthroughs of deep scenes
  // ---------------------------------------------------------------
  void walkthrough() {
    Table table({"scene", "fragments", "most layers", "technique", "ms", "MiB"});
    const auto each = [&](const std::string& name, const transparency::Frame& frame) {
      for (const char* technique : {"count-scan", "paged", "linked", "b3d", "ha64"}) {
        const Outcome out = render(frame, technique);
        const Costs& costs = out.rendering.costs;
        table.add({name, mega(static_cast<double>(costs.fragments)),
                   std::to_string(costs.most_layers), technique,
                   out.error.empty() ? ms(out.seconds) : out.error, mib(costs.allocated_bytes)});
      }
    };
    for (const int copies : {1, 5, 10}) {
      Scene scene = of_mesh({}, 0.3f);
      for (int i = 0; i < copies; ++i) {
        TriangleSoup knot = make_torus_knot(5, 12, 0.14, plan_.quick ? 300 : 605, 45);
        for (glm::dvec3& p : knot.positions) p += glm::dvec3(0.3 * i, 0.2 * i, 3.0 * i);
        append(scene.mesh, knot);
      }
      each(fmt::format("knot x{}", copies), front_view(scene, {800, 600}));
    }
    // As deep as the power plant of the paper: 590 layers in the middle.
    std::vector<std::array<int, 4>> boxes;
    for (int i = 0; i < 590; ++i) {
      const int half = 4 + i * 56 / 590;
      boxes.push_back({400 - half, 300 - half, 400 + half, 300 + half});
    }
    each("590 layers", rectangles(boxes, {800, 600}, 0.05f));
    write(table);
  }

  // --- volumetric lists: full-screen layers
  // -----------------------------------------------------------
  void layers() {
    Table table({"layers", "800x600 ms", "of 2 layers", "published", "1024x768 ms", "over 800x600",
                 "published "});
    const double small[] = {11.1, 20.4, 31.3, 43.5, 55.6, 71.4, 83.3, 100};
    const double large[] = {1000 / 51.0, 1000 / 27.0, 1000 / 18.0, 1000 / 13.0,
                            1000 / 10.0, 1000 / 8.0,  1000 / 6.0,  1000 / 5.0};
    double first = 0.0;
    for (int i = 0; i < 8; ++i) {
      const auto count = static_cast<std::size_t>(2 * (i + 1));
      const auto at = [&](int w, int h) {
        return render(
                   rectangles(std::vector<std::array<int, 4>>(count, {0, 0, w, h}), {w, h}, 0.2f),
                   "linked")
            .seconds;
      };
      const double a = at(800, 600), b = at(1024, 768);
      if (first == 0.0) first = a;
      table.add({std::to_string(count), ms(a), fmt::format("{:.2f}", a / first),
                 fmt::format("{:.2f}", small[i] / small[0]), ms(b), fmt::format("{:.2f}", b / a),
                 fmt::format("{:.2f}", large[i] / small[i])});
    }
    write(table);
  }

  // --- survey: the model of complexity beside counted operations
  // --------------------------------------
  void model() {
    // Real-time context: 1920 x 1080, n = 5M triangles, l = 20 layers at most, d = 20, k = 3, s
    // = 16.
    const double P = 1920.0 * 1080, n = 5e6, l = 20, d = 20, k = 3, s = 16;
    const auto log2 = [](double x) { return std::log2(x); };
    struct Method {
      const char* name;
      const char* technique;
      double operations;
    };
    const double a_buffer = n + P + P * d * log2(d) + P * d;
    const Method methods[] = {
        {"A-buffer", "a-buffer", a_buffer},
        {"F-buffer", "f-buffer", n + P + P * d * d + P * d},
        {"stencil-routed", "stencil-routed", std::ceil(l / k) * (n + P + P * d * log2(k)) + P * d},
        {"virtual pixel maps", "virtual-pixel-maps", l * (n + P) + P * d},
        {"depth peeling", "depth-peeling", l * (n + P) + P * d},
        {"k-buffer", "k-buffer", n + P + P * d * log2(k) + P * k},
        {"weighted average", "weighted-average", n + P + P * d},
        {"stochastic", "stochastic", 3 * (n + P * s) + P * s}};
    const auto frame = random_stream({512, 512}, 20.0);
    std::vector<double> counted;
    for (const Method& method : methods) {
      const Outcome out = render(frame, method.technique);
      const Costs& costs = out.rendering.costs;
      counted.push_back(
          static_cast<double>(costs.rasterized + costs.shaded + costs.stored + costs.comparisons));
    }
    Table table({"method", "model, of the A-buffer", "counted, of the A-buffer"});
    for (std::size_t i = 0; i < std::size(methods); ++i) {
      table.add({methods[i].name, fmt::format("{:.2f}", methods[i].operations / a_buffer),
                 fmt::format("{:.2f}", counted[i] / counted[0])});
    }
    write(table);
  }

  static transparency::Frame random_stream(glm::ivec2 size, double layers) {
    Random random(3);
    std::vector<ListedFragment> fragments;
    std::vector<glm::vec4> colours;
    for (int i = 0; i < 64; ++i) {
      colours.emplace_back(0.015f * static_cast<float>(i), 0.5f, 0.2f,
                           0.1f + 0.01f * static_cast<float>(i % 40));
    }
    const auto count = static_cast<std::size_t>(layers * size.x * size.y);
    for (std::size_t i = 0; i < count; ++i) {
      fragments.push_back({static_cast<int>(random.below(static_cast<std::uint64_t>(size.x))),
                           static_cast<int>(random.below(static_cast<std::uint64_t>(size.y))),
                           static_cast<std::uint32_t>(random.below(1 << 24)),
                           static_cast<std::uint32_t>(random.below(64)), false});
    }
    FrameOptions options;
    options.size = size;
    return *transparency::Frame::make(fragments, colours, options);
  }

  // --- MLAB: memory of five scenes
  // --------------------------------------------------------------------
  void mlab_memory() {
    Table table({"fragments M", "rows", "A-buffer MiB", "published", "MLAB MiB", "published "});
    struct Row {
      double fragments;
      int rows;
      double a_buffer, mlab;
    };
    for (const Row& row : {Row{10.6, 4, 124.8, 28.2}, Row{6.1, 2, 73.3, 14.1},
                           Row{6.0, 2, 72.2, 14.1}, Row{2.3, 2, 29.8, 14.1}}) {
      const auto frame = random_stream({1280, 720}, row.fragments * 1e6 / (1280.0 * 720));
      const Outcome a = render(frame, "a-buffer");
      const Outcome m = render(frame, fmt::format("mlab-packed:{}", row.rows));
      table.add({fmt::format("{}", row.fragments), std::to_string(row.rows),
                 mib(a.rendering.costs.formula_bytes), fmt::format("{}", row.a_buffer),
                 mib(m.rendering.costs.formula_bytes), fmt::format("{}", row.mlab)});
    }
    write(table);
  }

  // --- survey: what each technique does wrong, near and far
  // -------------------------------------------
  void artefacts() {
    Table table({"technique", "accuracy", "3 layers dB", "20 layers dB", "lost", "merged"});
    const auto shallow = random_stream({256, 256}, 3.0), deep = random_stream({256, 256}, 20.0);
    const Image a = render(shallow, "count-scan").rendering.image;
    const Image b = render(deep, "count-scan").rendering.image;
    for (const Technique* technique : techniques()) {
      if (technique->needs_triangles) continue;
      const std::string name(technique->name);
      const Outcome first = render(shallow, name), second = render(deep, name);
      if (!first.error.empty() || !second.error.empty()) continue;
      const auto decibels = [](const Image& image, const Image& reference) {
        const double psnr = difference(image, reference).psnr;
        return std::isinf(psnr) || psnr > 120 ? std::string("same") : fmt::format("{:.1f}", psnr);
      };
      const char* words[] = {"exact", "bounded", "random"};
      table.add({name, words[static_cast<int>(technique->accuracy)],
                 decibels(first.rendering.image, a), decibels(second.rendering.image, b),
                 std::to_string(second.rendering.costs.lost),
                 std::to_string(second.rendering.costs.merged)});
    }
    write(table);
  }

  Plan plan_;
  Execution execution_;
  std::deque<Scene> scenes_;  ///< of the table in work
  std::string name_;
};

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) {
  strata::bench::Plan plan;
  CLI::App app("The tables of the papers on transparency, one CSV file each");
  app.add_option("folder", plan.folder, "for the CSV files")->required();
  app.add_option("--tables", plan.tables, "those alone")->delimiter(',');
  app.add_flag("--quick", plan.quick, "smaller scenes, fewer rounds");
  app.add_option("--threads", plan.threads, "of each picture");
  CLI11_PARSE(app, argc, argv);
  return strata::bench::Papers(plan).run();
}
