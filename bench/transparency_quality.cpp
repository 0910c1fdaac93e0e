// Techniques with bounded memory on hair, as in M. Salvi, K. Vaidyanathan, "Multi-layer alpha
// blending" (2014): how near each comes to the sorted lists, and the bytes that it takes. The hair
// is generated: a ball of strands that hang down and curl, about an opaque head; each is a ribbon
// that faces the eye, a little more than a pixel wide, and shines as hair does (J. Kajiya, T. Kay
// 1989). Strands are submitted in a random order.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <glm/geometric.hpp>
#include <random>
#include <string>
#include <vector>

#include "bench/support.h"
#include "strata/csg/picture/picture.h"
#include "strata/mesh/shapes.h"
#include "strata/transparency/techniques.h"

namespace strata::bench {
namespace {

using namespace transparency;

struct Options {
  int strands = 28500;
  int width = 1280, height = 720;
  float opacity = 0.4f, tip_opacity = 0.1f;
  double shadow = 0.6;
  std::string order = "around";
  double strand_pixels = 1.3;
  unsigned seed = 1;
  int threads = 2;
  int rounds = 3;
  std::vector<std::string> techniques{"mlab:1",
                                      "mlab:2",
                                      "mlab:4",
                                      "mlab:8",
                                      "mlab-packed:4",
                                      "mlab-packed:8",
                                      "ht:4",
                                      "ht:8",
                                      "ht-packed:4",
                                      "ht-packed:8",
                                      "at:4",
                                      "at:8",
                                      "relaxed",
                                      "moments:6",
                                      "weighted-average",
                                      "weighted-blended"};
  std::string pictures, csv;
};

/// Tones of hair times brightnesses times opacities: objects 1 .. of the scene.
constexpr int kTones = 6, kShades = 48, kOpacities = 8;

class Hair {
 public:
  explicit Hair(const Options& options) : options_(options), random_(options.seed) {
    scene_.objects.push_back({"head", {0.75f, 0.55f, 0.45f, 1.0f}});
    for (int tone = 0; tone < kTones; ++tone) {
      const float t = static_cast<float>(tone) / (kTones - 1);
      const glm::vec3 dark(0.35f, 0.2f, 0.1f), light(0.95f, 0.7f, 0.35f);
      for (int shade = 0; shade < kShades; ++shade) {
        const float s = static_cast<float>(shade) / (kShades - 1);
        const glm::vec3 colour = glm::min(
            (dark + t * (light - dark)) * (0.15f + 0.95f * s) + glm::vec3(0.35f * s * s * s * s),
            1.0f);
        for (int i = 0; i < kOpacities; ++i) {
          const float along = static_cast<float>(i) / (kOpacities - 1);
          const float opacity = options.opacity + along * (options.tip_opacity - options.opacity);
          scene_.objects.push_back({"hair", glm::vec4(colour, opacity)});
        }
      }
    }
  }

  /// @param eye  what the ribbons face @param pixel  width of a pixel at distance 1
  Scene make(const glm::dvec3& eye, double pixel) {
    eye_ = eye;
    pixel_ = pixel;
    const TriangleSoup head = make_icosphere(0.93, 4);
    scene_.mesh = head;
    scene_.object_of.assign(head.triangles.size(), 0);
    for (const glm::dvec3& root : roots()) strand(root);
    return std::move(scene_);
  }

 private:
  static constexpr double kTurn = 6.283185307;

  double unit() { return std::uniform_real_distribution<double>(0.0, 1.0)(random_); }
  glm::dvec3 scatter() { return glm::dvec3(unit(), unit(), unit()) - 0.5; }

  /// On the upper part of the head, in the order in which the strands are submitted.
  std::vector<glm::dvec3> roots() {
    std::vector<glm::dvec3> all;
    for (int i = 0; i < options_.strands; ++i) {
      const double z = -0.25 + 1.25 * unit(), turn = kTurn * unit(), r = std::sqrt(1 - z * z);
      all.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
    }
    if (options_.order == "random") return all;
    const auto place = [&](const glm::dvec3& root) {
      if (options_.order == "around") return std::atan2(root.y, root.x);
      if (options_.order == "up") return root.z;
      if (options_.order == "down") return -root.z;
      const double away = glm::length(root - eye_);
      return options_.order == "front-to-back" ? away : -away;
    };
    std::sort(all.begin(), all.end(),
              [&](const auto& a, const auto& b) { return place(a) < place(b); });
    return all;
  }
  void strand(glm::dvec3 p) {
    constexpr int kSegments = 24;
    glm::dvec3 direction = glm::normalize(p + 0.3 * scatter());
    const double step = (1.1 + 0.9 * unit()) / kSegments;
    const double curl = 0.05 + 0.2 * unit(), phase = kTurn * unit();
    const int tone = static_cast<int>(unit() * kTones);
    std::vector<glm::dvec3> points{p};
    for (int i = 0; i < kSegments; ++i) {
      direction = glm::normalize(direction + glm::dvec3(0, 0, -0.14));
      const double angle = phase + 9.0 * i / kSegments;
      const glm::dvec3 wave(std::cos(angle), std::sin(angle), 0.3 * std::sin(2.0 * angle));
      p += step * glm::normalize(direction + curl * wave);
      // Out of the head.
      if (glm::length(p) < 0.98) p = glm::normalize(p) * 0.98;
      points.push_back(p);
    }
    ribbon(points, tone);
  }
  void ribbon(const std::vector<glm::dvec3>& points, int tone) {
    const auto first = static_cast<std::uint32_t>(scene_.mesh.positions.size());
    const glm::dvec3 light = glm::normalize(glm::dvec3(0.5, -1.0, 0.9));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const glm::dvec3 tangent =
          glm::normalize(points[std::min(i + 1, points.size() - 1)] - points[i == 0 ? 0 : i - 1]);
      const glm::dvec3 to_eye = eye_ - points[i];
      const glm::dvec3 side = glm::normalize(glm::cross(tangent, to_eye)) *
                              (0.5 * options_.strand_pixels * pixel_ * glm::length(to_eye));
      scene_.mesh.positions.push_back(points[i] - side);
      scene_.mesh.positions.push_back(points[i] + side);
      if (i == 0) continue;
      const std::uint32_t at = first + static_cast<std::uint32_t>(2 * i);
      scene_.mesh.triangles.emplace_back(at - 2, at - 1, at + 1);
      scene_.mesh.triangles.emplace_back(at - 2, at + 1, at);
      const double along = glm::dot(tangent, light);
      const double shine = std::sqrt(std::max(0.0, 1.0 - along * along));
      // Light falls off within the ball of hair, whose outer radius is about 1.25.
      const double depth = std::max(0.0, 1.25 - glm::length(points[i]));
      const double lit = shine * std::exp(-options_.shadow * 4.0 * depth);
      const auto shade = static_cast<int>(std::clamp(lit, 0.0, 1.0) * (kShades - 1));
      const auto opacity = static_cast<int>(i * (kOpacities - 1) / (points.size() - 1));
      const int object = 1 + (tone * kShades + shade) * kOpacities + opacity;
      scene_.object_of.insert(scene_.object_of.end(), 2, static_cast<std::uint32_t>(object));
    }
  }

  const Options& options_;
  std::mt19937 random_;
  Scene scene_;
  glm::dvec3 eye_{0.0};
  double pixel_ = 0.0;
};

Result<Frame> hair_frame(const Options& options, Scene& scene) {
  const glm::dvec3 eye(1.5, -5.5, 0.5), centre(0.0, 0.0, -0.25);
  Camera camera = look_at(eye, centre);
  camera.field_of_view = 28.0;
  const double pixel =
      2.0 * std::tan(0.5 * camera.field_of_view * 3.14159265358979 / 180.0) / options.height;
  scene = Hair(options).make(eye, pixel);
  auto view = make_view(camera, {options.width, options.height}, bounds(scene.mesh));
  if (!view) return tl::unexpected(view.error());
  FrameOptions frame;
  frame.background = glm::vec4(1.0f);
  return Frame::make(scene, *view, frame);
}

Result<void> write_picture(const Image& image, const std::string& path) {
  csg::Picture picture;
  picture.width = image.width;
  picture.height = image.height;
  for (const glm::u8vec4& p : to_bytes(image)) picture.pixels.push_back({p.r, p.g, p.b, p.a});
  return csg::write_png(picture, path);
}

/// The difference to the reference, four times, on grey.
Image differences(const Image& image, const Image& reference) {
  Image result = image;
  for (std::size_t i = 0; i < result.pixels.size(); ++i) {
    const glm::vec4 by = 0.5f + 4.0f * (image.pixels[i] - reference.pixels[i]);
    result.pixels[i] = glm::vec4(glm::clamp(glm::vec3(by), 0.0f, 1.0f), 1.0f);
  }
  return result;
}

Result<void> run(const Options& options) {
  Scene scene;
  const auto frame = hair_frame(options, scene);
  if (!frame) return tl::unexpected(frame.error());
  Execution execution;
  execution.threads = options.threads;
  std::vector<ChosenTechnique> chosen{{*find_technique("count-scan"), {}}};
  for (const std::string& text : options.techniques) {
    auto one = parse_technique(text);
    if (!one) return tl::unexpected(one.error());
    chosen.push_back(*one);
  }
  std::vector<Rendering> renderings(chosen.size());
  std::vector<std::vector<double>> seconds(chosen.size());
  for (int round = 0; round < options.rounds; ++round) {
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      auto rendering = frame->render(*chosen[i].technique, chosen[i].settings, execution);
      if (!rendering) return tl::unexpected(rendering.error());
      seconds[i].push_back(rendering->technique_seconds);
      renderings[i] = std::move(*rendering);
    }
  }
  const Rendering& exact = renderings.front();
  // The A-buffer of the paper: 12 bytes a fragment and 4 a pixel.
  const std::uint64_t a_buffer =
      12 * exact.costs.fragments + 4 * static_cast<std::uint64_t>(options.width * options.height);
  fmt::print("{} triangles, {} fragments, {} layers at most; the A-buffer takes {} MiB\n",
             scene.mesh.triangles.size(), exact.costs.fragments, exact.costs.most_layers,
             megabytes(a_buffer));
  Table table({"technique", "PSNR dB", "largest", "MiB", "of A-buffer", "time of lists"});
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const std::string name = i == 0 ? "count-scan" : options.techniques[i - 1];
    const Difference by = difference(renderings[i].image, exact.image);
    const std::uint64_t bytes = renderings[i].costs.formula_bytes;
    table.add({name, i == 0 ? "exact" : fmt::format("{:.1f}", by.psnr),
               fmt::format("{:.3f}", by.largest), megabytes(bytes),
               fmt::format("{:.2f}", static_cast<double>(bytes) / static_cast<double>(a_buffer)),
               fmt::format("{:.2f}", median(seconds[i]) / median(seconds[0]))});
    if (options.pictures.empty()) continue;
    std::string file = options.pictures + "/" + name;
    std::replace(file.begin() + static_cast<std::ptrdiff_t>(options.pictures.size()), file.end(),
                 ':', '-');
    if (auto done = write_picture(renderings[i].image, file + ".png"); !done) return done;
    if (i == 0) continue;
    auto done = write_picture(differences(renderings[i].image, exact.image), file + "-error.png");
    if (!done) return done;
  }
  std::fputs(table.markdown().c_str(), stdout);
  if (!options.csv.empty()) std::ofstream(options.csv) << table.csv();
  return {};
}

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) {
  strata::bench::Options options;
  CLI::App app("Techniques with bounded memory on hair, against the sorted lists");
  app.add_option("--strands", options.strands, "strands of hair")->capture_default_str();
  app.add_option("--order", options.order, "in which strands are submitted, by their roots")
      ->check(CLI::IsMember({"around", "up", "down", "front-to-back", "back-to-front", "random"}))
      ->capture_default_str();
  app.add_option("--opacity", options.opacity, "opacity of a strand")->capture_default_str();
  app.add_option("--tip-opacity", options.tip_opacity, "opacity of its tip")->capture_default_str();
  app.add_option("--shadow", options.shadow, "how dark inner strands are; 0: not at all")
      ->capture_default_str();
  app.add_option("--strand-pixels", options.strand_pixels, "width of a strand in pixels")
      ->capture_default_str();
  app.add_option("--width", options.width, "pixels")->capture_default_str();
  app.add_option("--height", options.height, "pixels")->capture_default_str();
  app.add_option("--technique", options.techniques, "techniques with their numbers")
      ->delimiter(',');
  app.add_option("--threads", options.threads, "threads")->capture_default_str();
  app.add_option("--rounds", options.rounds, "rounds; times are medians")->capture_default_str();
  app.add_option("--pictures", options.pictures, "a folder for pictures");
  app.add_option("--csv", options.csv, "a file for the table");
  CLI11_PARSE(app, argc, argv);
  if (const auto done = strata::bench::run(options); !done) {
    fmt::print(stderr, "{}\n", done.error().message);
    return 1;
  }
  return 0;
}
