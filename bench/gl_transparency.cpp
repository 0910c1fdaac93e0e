// Techniques of transparency on the GPU: table 2 of Lefebvre, Hornus, Lasram, "HA-Buffer", INRIA
// RR-8282, 2013 (a mesh of 871 k triangles), and the quads of Maule, Comba, Torchelsen, Bastos,
// "Memory-optimized order-independent transparency with Dynamic Fragment Buffer", 2014. Pictures
// are compared with the CPU's before they are timed.

#include "bench/gl_transparency.h"
#include "bench/support.h"

#include <fmt/format.h>
#include <algorithm>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "strata/mesh/shapes.h"
#include "strata/transparency/techniques.h"
#include "transparency/gl/gl_frame.h"

namespace strata::bench {
namespace {

namespace oit = strata::transparency;
using Clock = std::chrono::steady_clock;
constexpr int kSide = 1024;

/// Frames a second that were published for a technique, for the mesh; 0: none.
double published(std::string_view name) {
  if (name == "dual-peeling") return 140;
  if (name == "depth-peeling") return 82;
  if (name == "stencil-routed") return 226;
  if (name == "paged") return 157;
  if (name == "ha64") return 187;
  return 0;
}

struct Measured {
  double seconds = 0.0;  ///< median of the frames
  oit::Costs costs;
  std::string note;  ///< against the CPU, or why there is no time
};

Measured measure(const gl::Context& context, const oit::GlTechnique& technique, oit::GlFrame& frame,
                 const oit::Image& reference, double budget) {
  Measured result;
  auto renderer = technique.make(context, {});
  if (!renderer) {
    result.note = renderer.error().message;
    return result;
  }
  std::vector<double> seconds;
  const auto start = Clock::now();
  for (int i = -1; i < 3 || (seconds_since(start) < budget && i < 200); ++i) {
    const auto rendering = frame.render(**renderer);
    if (!rendering) {
      result.note = rendering.error().message;
      return result;
    }
    if (i >= 0) {
      seconds.push_back(rendering->technique_seconds);
      continue;
    }
    result.costs = rendering->costs;
    const oit::Difference by = oit::difference(rendering->image, reference);
    result.note = fmt::format("{} pixels differ, {:.0f} dB", by.pixels, std::min(by.psnr, 99.0));
  }
  std::nth_element(seconds.begin(),
                   seconds.begin() + static_cast<std::ptrdiff_t>(seconds.size() / 2),
                   seconds.end());
  result.seconds = seconds[seconds.size() / 2];
  return result;
}

std::optional<oit::Frame> frame_of(const oit::Scene& scene) {
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.rotation = glm::dvec3(0.0);
  const Bounds box = bounds(scene.mesh);
  centre_camera(camera, box);
  camera.distance = 0.5 * std::max(box.high.y - box.low.y, box.high.x - box.low.x) /
                    std::tan(0.5 * camera.field_of_view * 3.14159265358979 / 180.0);
  const auto view = make_view(camera, {kSide, kSide}, box);
  oit::FrameOptions options;
  options.opaque_first = false;
  auto frame = view ? oit::Frame::make(scene, *view, options) : tl::unexpected(view.error());
  if (frame) return std::move(*frame);
  std::printf("\n%s\n", frame.error().message.c_str());
  return {};
}

void mesh_table(const gl::Context& context, const oit::Scene& scene, double budget) {
  const auto frame = frame_of(scene);
  const auto reference = frame ? frame->render(**oit::find_technique("count-scan"))
                               : Result<oit::Rendering>(fail(ErrorCode::kInternal, "no frame"));
  if (!reference) return;
  std::printf("\n### Transparency: %zu triangles, %llu fragments on %d x %d, lists up to %llu\n\n",
              scene.mesh.triangles.size(),
              static_cast<unsigned long long>(reference->costs.fragments), kSide, kSide,
              static_cast<unsigned long long>(reference->costs.most_layers));
  std::printf(
      "| rasterizer | technique | frames/s | passes | MiB | of peeling | published | against the "
      "CPU's picture |\n|---|---|---|---|---|---|---|---|\n");
  for (const bool hardware : {true, false}) {
    auto on_gpu =
        oit::GlFrame::make(context, frame->source(),
                           hardware ? oit::GlRasterizer::kHardware : oit::GlRasterizer::kCompute);
    if (!on_gpu) {
      std::printf("| %s | %s |\n", hardware ? "hardware" : "compute",
                  on_gpu.error().message.c_str());
      continue;
    }
    double peeling = 0.0;
    std::vector<std::pair<const oit::GlTechnique*, Measured>> rows;
    for (const oit::GlTechnique& technique : oit::gl_techniques()) {
      if (technique.ordered && !hardware) continue;
      rows.emplace_back(&technique,
                        measure(context, technique, **on_gpu, reference->image, budget));
      if (technique.name == "depth-peeling") peeling = rows.back().second.seconds;
    }
    for (const auto& [technique, row] : rows) {
      std::printf("| %s | %s |", hardware ? "hardware" : "compute", technique->name.data());
      if (row.seconds > 0) {
        std::printf(" %.1f | %llu | %.1f |", 1 / row.seconds,
                    static_cast<unsigned long long>(row.costs.geometry_passes),
                    static_cast<double>(row.costs.allocated_bytes) / 1048576.0);
        if (peeling > 0)
          std::printf(" %.2f |", peeling / row.seconds);
        else
          std::printf(" |");
        const double before = published(technique->name);
        if (before > 0)
          std::printf(" %.0f fps, %.2f |", before, before / published("depth-peeling"));
        else
          std::printf(" |");
      } else {
        std::printf(" | | | | |");
      }
      std::printf(" %s |\n", row.note.c_str());
      std::fflush(stdout);
    }
  }
}

/// `layers` quads, each of the given part of the picture's area.
oit::Scene quads(int layers, double coverage) {
  oit::Scene scene;
  const double half = 0.5 * std::sqrt(coverage);
  for (int i = 0; i < layers; ++i) {
    const auto first = static_cast<std::uint32_t>(scene.mesh.positions.size());
    for (const glm::dvec2 corner : {glm::dvec2(-half, -half), glm::dvec2(half, -half),
                                    glm::dvec2(half, half), glm::dvec2(-half, half)}) {
      scene.mesh.positions.emplace_back(corner, i * 0.01);
    }
    scene.mesh.triangles.emplace_back(first, first + 1, first + 2);
    scene.mesh.triangles.emplace_back(first, first + 2, first + 3);
    scene.object_of.insert(scene.object_of.end(), 2, static_cast<std::uint32_t>(i));
    scene.objects.push_back({"quad", {0.1f * static_cast<float>(i), 0.5f, 0.2f, 0.3f}});
  }
  // Two corners that set the size of the picture.
  scene.mesh.positions.emplace_back(-0.5, -0.5, 0.0);
  scene.mesh.positions.emplace_back(0.5, 0.5, 0.0);
  const auto last = static_cast<std::uint32_t>(scene.mesh.positions.size() - 1);
  scene.mesh.triangles.emplace_back(last - 1, last, last);
  scene.object_of.push_back(0);
  return scene;
}

void quads_table(const gl::Context& context, double budget) {
  constexpr std::string_view kNames[] = {"b3d",    "count-scan", "paged",
                                         "linked", "ha64",       "depth-peeling"};
  std::printf(
      "\n### Quads on %d x %d: frames a second, hardware rasterizer\n\n| layers | coverage |",
      kSide, kSide);
  for (const std::string_view name : kNames) std::printf(" %s |", name.data());
  std::printf("\n|---|---|---|---|---|---|---|---|\n");
  for (const int layers : {1, 5, 10}) {
    for (const double coverage : {0.05, 0.25, 0.5, 1.0}) {
      const oit::Scene scene = quads(layers, coverage);
      const auto frame = frame_of(scene);
      if (!frame) return;
      const auto reference = frame->render(**oit::find_technique("count-scan"));
      auto on_gpu = oit::GlFrame::make(context, frame->source(), oit::GlRasterizer::kHardware);
      if (!on_gpu || !reference) return;
      std::printf("| %d | %.0f %% |", layers, 100 * coverage);
      for (const std::string_view name : kNames) {
        for (const oit::GlTechnique& technique : oit::gl_techniques()) {
          if (technique.name != name) continue;
          const Measured row = measure(context, technique, **on_gpu, reference->image, budget);
          if (row.seconds > 0)
            std::printf(" %.0f |", 1 / row.seconds);
          else
            std::printf(" %s |", row.note.c_str());
        }
      }
      std::printf("\n");
      std::fflush(stdout);
    }
  }
}

}  // namespace

void transparency_tables(const gl::Context& context, double budget, bool small_only) {
  oit::Scene scene;
  TriangleSoup knot = make_torus_knot(5, 12, 0.14, 605, 45);
  if (!small_only) knot = subdivide(subdivide(knot));
  scene.mesh = std::move(knot);
  scene.objects.push_back({"knot", {0.3f, 0.6f, 0.9f, 0.4f}});
  mesh_table(context, scene, budget);
  quads_table(context, budget / 4);
}

}  // namespace strata::bench
