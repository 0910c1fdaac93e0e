// Frames of Boolean trees: Strata's preview against OpenCSG on Mesa's software OpenGL, in turn, in
// one process, with the same meshes, view, size and number of threads. A frame begins with the tree
// in memory (OpenCSG: products expanded, vertex buffers filled) and ends with shaded pixels.
//
// Then what Strata promises for itself: one solid moved, deep nesting, many small solids.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/ext/matrix_transform.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bench/csg_products.h"
#include "bench/csg_scenes.h"
#include "bench/support.h"
#include "csg/geometry.h"
#include "strata/csg/picture/picture.h"
#ifdef STRATA_HAVE_OPENCSG
#include "bench/opencsg_peer.h"
#endif

namespace strata::bench {
namespace {

constexpr std::size_t kMostProducts = 100000;

struct Settings {
  std::string folder = STRATA_SOURCE_DIR "/build/bench/scenes";
  std::vector<std::string> scenes = csg_scene_names();
  int side = 1024;
  int threads = 2;
  int rounds = 9;
  double budget_s = 8;
  bool without_boxes = false;
  bool without_peers = false, without_laws = false;
  std::string csv, laws_csv;
};

Execution with_threads(int threads) {
  Execution execution;
  execution.threads = threads;
  return execution;
}

/// Strata's side: a preview, and its last frame's error.
class Ours {
 public:
  Ours(const CsgScene& scene, const Settings& settings)
      : camera_(scene.camera),
        size_(settings.side),
        execution_(with_threads(settings.threads)),
        preview_(scene.tree, {}, scene.relative_precision, execution_) {}

  [[nodiscard]] std::shared_ptr<void> frame() {
    csg::PictureOptions options;
    options.scheme = csg::find_colour_scheme("Cornfield");  // plain light, as the peer has it
    auto picture = preview_.picture(camera_, size_, options, execution_);
    if (!picture) {
      status_ = tl::unexpected(picture.error());
      return nullptr;
    }
    return std::make_shared<csg::Picture>(std::move(*picture));
  }
  [[nodiscard]] Result<View> view() const { return make_view(camera_, size_, preview_.box()); }
  csg::Preview& preview() { return preview_; }
  [[nodiscard]] const Execution& execution() const { return execution_; }
  [[nodiscard]] const Result<void>& status() const { return status_; }

 private:
  Camera camera_;
  glm::ivec2 size_;
  Execution execution_;
  csg::Preview preview_;
  Result<void> status_;
};

/// Pixels of two pictures of one scene that differ.
struct Difference {
  std::uint64_t covered = 0;     ///< in ours
  std::uint64_t silhouette = 0;  ///< something in one of them only
  std::uint64_t depth = 0;       ///< something in both, further apart than 1/5000 of the range
};

#ifdef STRATA_HAVE_OPENCSG
Difference compare(const csg::SurfaceImage& ours, const std::vector<float>& theirs) {
  Difference difference;
  for (std::size_t i = 0; i < theirs.size(); ++i) {
    const bool here = ours.depth[i] != csg::SurfaceImage::kNone, there = theirs[i] < 1.0f;
    difference.covered += here ? 1 : 0;
    if (here != there) {
      ++difference.silhouette;
    } else if (here) {
      const double depth = ours.depth[i] / static_cast<double>(kPictureDepthLimit);
      if (std::abs(depth - static_cast<double>(theirs[i])) > 2e-4) ++difference.depth;
    }
  }
  return difference;
}

/// Gives a scene to OpenCSG.
Result<std::size_t> load_peer(OpenCsgPeer& peer, const CsgScene& scene, const View& view,
                              bool with_boxes) {
  const auto products = sum_of_products(scene.tree, kMostProducts);
  if (!products) return tl::unexpected(products.error());
  const csg::Geometry geometry(scene.tree);
  std::vector<PeerSolid> solids;
  for (const auto& part : geometry.parts()) {
    solids.push_back(
        {part.positions, part.triangles, part.box, part.convex ? 1u : scene.concave_convexity});
  }
  peer.load(solids, *products, view, with_boxes);
  std::size_t terms = 0;
  for (const Product& product : *products) {
    terms += product.intersected.size() + product.subtracted.size();
  }
  return terms;
}
#endif

/// Rows of frames, and the geometric mean of their ratios.
class Frames {
 public:
  explicit Frames(const Settings& settings) : settings_(settings) {}

  Result<void> start() {
#ifdef STRATA_HAVE_OPENCSG
    auto peer = OpenCsgPeer::make(glm::ivec2(settings_.side), settings_.threads);
    if (!peer) return tl::unexpected(peer.error());
    peer_ = std::move(*peer);
    fmt::print("{}\n\n", peer_->renderer());
#else
    fmt::print(stderr, "bench: without OpenCSG; libopencsg-dev or libglew-dev was missing\n");
#endif
    return {};
  }

  Result<void> add(const std::string& name) {
    const auto scene = csg_scene(settings_.folder, name, with_threads(settings_.threads));
    if (!scene) return tl::unexpected(scene.error());
    Ours ours(*scene, settings_);
    std::vector<Participant> participants;
    participants.push_back({"Strata", [&ours] { return ours.frame(); }});
    std::string terms = "-";
    Difference difference;
#ifdef STRATA_HAVE_OPENCSG
    const auto view = ours.view();
    if (!view) return tl::unexpected(view.error());
    const auto loaded = load_peer(*peer_, *scene, *view, !settings_.without_boxes);
    if (!loaded) return tl::unexpected(loaded.error());
    terms = std::to_string(*loaded);
    const auto image = ours.preview().draw(*view, ours.execution());
    if (!image) return tl::unexpected(image.error());
    peer_->draw();
    difference = compare(**image, peer_->depths());
    participants.push_back({"OpenCSG", [this]() -> std::shared_ptr<void> {
                              peer_->draw();
                              return nullptr;
                            }});
#endif
    if (auto first = ours.frame(); !first) return ours.status();  // warm
    difference.covered = ours.preview().report().covered;
    run_interleaved(participants, settings_.rounds, settings_.budget_s * 1e3);
    if (!ours.status()) return ours.status();
    const Sample mine = median(participants[0].samples);
    std::vector<std::string> row{name,
                                 std::to_string(scene->tree.solids().size()),
                                 terms,
                                 std::to_string(scene->triangles),
                                 std::to_string(difference.covered),
                                 short_number(mine.wall_ms),
                                 short_number(mine.cpu_ms)};
    if (participants.size() > 1) {
      const Sample theirs = median(participants[1].samples);
      const double ratio = theirs.wall_ms / mine.wall_ms;
      const double cpu_ratio = theirs.cpu_ms / mine.cpu_ms;
      logarithms_ += std::log(ratio);
      cpu_logarithms_ += std::log(cpu_ratio);
      ++rows_;
      row.insert(row.end(),
                 {short_number(theirs.wall_ms), short_number(theirs.cpu_ms), short_number(ratio),
                  short_number(cpu_ratio), std::to_string(difference.silhouette),
                  std::to_string(difference.depth)});
    } else {
      row.insert(row.end(), 6, "-");
    }
    fmt::print(stderr, "{}: {} ms, {} ms, {}\n", name, row[5], row[7], row[9]);
    table_.add(std::move(row));
    return {};
  }

  bool publish_table() {
    if (rows_ > 0) {
      std::vector<std::string> row(13, "-");
      row[0] = "geometric mean";
      row[9] = short_number(std::exp(logarithms_ / rows_));
      row[10] = short_number(std::exp(cpu_logarithms_ / rows_));
      table_.add(std::move(row));
    }
    return publish(table_, settings_.csv);
  }

 private:
  const Settings& settings_;
  Table table_{{"scene", "solids", "terms", "triangles", "covered", "ms", "cpu ms", "OpenCSG ms",
                "OpenCSG cpu ms", "ratio", "cpu ratio", "silhouette pixels", "depth pixels"}};
  double logarithms_ = 0, cpu_logarithms_ = 0;
  int rows_ = 0;
#ifdef STRATA_HAVE_OPENCSG
  std::unique_ptr<OpenCsgPeer> peer_;
#endif
};

/// What Strata promises for itself.
class Laws {
 public:
  explicit Laws(const Settings& settings) : settings_(settings) {}

  Result<void> run() {
    if (auto done = moved(); !done) return done;
    if (auto done = nested(); !done) return done;
    return small();
  }
  bool publish_table() { return publish(table_, settings_.laws_csv); }

 private:
  /// A surface image after one cylinder of plate400 moved, against all of it.
  Result<void> moved() {
    const auto scene = csg_scene(settings_.folder, "plate400", with_threads(settings_.threads));
    if (!scene) return tl::unexpected(scene.error());
    Ours ours(*scene, settings_);
    const auto view = ours.view();
    if (!view) return tl::unexpected(view.error());
    const auto solid = static_cast<std::uint32_t>(scene->tree.solids().size() / 2);
    const glm::dmat4 place = scene->tree.solids()[solid].world_from_mesh;
    Result<void> status;
    int step = 0;
    const auto note = [&status](const Result<const csg::SurfaceImage*>& image) {
      if (!image) status = tl::unexpected(image.error());
      return nullptr;
    };
    std::vector<Participant> participants{
        {"full",
         [&]() -> std::shared_ptr<void> {
           return note(ours.preview().draw(*view, ours.execution()));
         }},
        {"moved", [&]() -> std::shared_ptr<void> {
           const glm::dvec3 by(0.5 * (++step % 2), 0.0, 0.0);
           return note(ours.preview().move_solid(solid, glm::translate(glm::dmat4(1.0), by) * place,
                                                 ours.execution()));
         }}};
    run_interleaved(participants, 3 * settings_.rounds, settings_.budget_s * 1e3);
    if (!status) return status;
    const double full = median(participants[0].samples).wall_ms;
    const double part = median(participants[1].samples).wall_ms;
    table_.add({"plate400", "one cylinder moved", short_number(part), "all drawn",
                short_number(full), short_number(part / full)});
    return {};
  }

  /// All scenes take turns. @return medians of a frame
  Result<std::vector<double>> frames(const std::vector<CsgScene>& scenes,
                                     std::vector<std::uint64_t>& covered) {
    std::vector<std::unique_ptr<Ours>> previews;
    std::vector<Participant> participants;
    for (const CsgScene& scene : scenes) {
      previews.push_back(std::make_unique<Ours>(scene, settings_));
      Ours* ours = previews.back().get();
      if (!ours->frame()) return tl::unexpected(ours->status().error());
      covered.push_back(ours->preview().report().covered);
      participants.push_back({scene.name, [ours] { return ours->frame(); }});
    }
    run_interleaved(participants, settings_.rounds, settings_.budget_s * 1e3);
    std::vector<double> times;
    for (const Participant& participant : participants) {
      times.push_back(median(participant.samples).wall_ms);
    }
    return times;
  }

  /// Crossings of all solids at the pixels of the view: two a pixel that a box covers.
  Result<std::uint64_t> crossings(const CsgScene& scene) {
    std::uint64_t sum = 0;
    for (const csg::Solid& solid : scene.tree.solids()) {
      CsgScene alone;
      alone.camera = scene.camera;
      alone.tree.set_root(alone.tree.add_solid(solid));
      Ours ours(alone, settings_);
      if (!ours.frame()) return tl::unexpected(ours.status().error());
      sum += 2 * ours.preview().report().covered;
    }
    return sum;
  }

  Result<void> nested() {
    std::vector<CsgScene> scenes;
    for (const int depth : {10, 20, 50, 100, 200}) scenes.push_back(nested_differences(depth));
    std::vector<std::uint64_t> covered;
    const auto times = frames(scenes, covered);
    if (!times) return tl::unexpected(times.error());
    double first = 0;
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      const auto all = crossings(scenes[i]);
      if (!all) return tl::unexpected(all.error());
      const double each = (*times)[i] * 1e6 / static_cast<double>(*all);
      if (i == 0) first = each;
      table_.add({scenes[i].name, "a frame", short_number((*times)[i]),
                  fmt::format("ns a crossing, of {:.1f} million", static_cast<double>(*all) * 1e-6),
                  short_number(each), short_number(each / first)});
    }
    return {};
  }

  Result<void> small() {
    const std::vector<CsgScene> scenes{small_boxes(100), small_boxes(10000)};
    std::vector<std::uint64_t> covered;
    const auto times = frames(scenes, covered);
    if (!times) return tl::unexpected(times.error());
    table_.add({scenes[1].name, fmt::format("a frame, {} pixels", covered[1]),
                short_number((*times)[1]), fmt::format("{}, {} pixels", scenes[0].name, covered[0]),
                short_number((*times)[0]), short_number((*times)[1] / (*times)[0])});
    return {};
  }

  const Settings& settings_;
  Table table_{{"scene", "what", "ms", "against", "value", "ratio"}};
};

int run(const Settings& settings) {
  const auto check = [](const Result<void>& done) {
    if (!done) fmt::print(stderr, "bench: {}\n", done.error().message);
    return done.has_value();
  };
  bool good = true;
  if (!settings.without_peers) {
    Frames frames(settings);
    if (!check(frames.start())) return 1;
    for (const std::string& name : settings.scenes) good = check(frames.add(name)) && good;
    good = frames.publish_table() && good;
  }
  if (!settings.without_laws) {
    Laws laws(settings);
    good = check(laws.run()) && good;
    good = laws.publish_table() && good;
  }
  return good ? 0 : 1;
}

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) {
  strata::bench::Settings settings;
  CLI::App app("Frames of Boolean trees, against OpenCSG");
  app.add_option("--folder", settings.folder, "where bench/csg_make_scenes.py has made the scenes");
  app.add_option("--scene", settings.scenes, "scenes, instead of all");
  app.add_option("--side", settings.side, "pixels a side")->check(CLI::Range(16, 16384));
  app.add_option("--threads", settings.threads)->check(CLI::Range(1, 256));
  app.add_option("--rounds", settings.rounds)->check(CLI::Range(1, 1000));
  app.add_option("--budget", settings.budget_s, "seconds for one of a scene's participants");
  app.add_flag("--no-boxes", settings.without_boxes, "do not tell OpenCSG the solids' boxes");
  app.add_flag("--no-frames", settings.without_peers, "skip the frames of the scenes");
  app.add_flag("--no-laws", settings.without_laws, "skip what compares Strata with itself");
  app.add_option("--csv", settings.csv, "write the table of frames there");
  app.add_option("--laws-csv", settings.laws_csv, "write the other table there");
  CLI11_PARSE(app, argc, argv);
  return strata::bench::run(settings);
}
