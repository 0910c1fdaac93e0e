// The stores on the GPU, with both producers: frames per second and fragments per second, as in
// table 2 of Lefebvre, Hornus, Lasram, "HA-Buffer", INRIA RR-8282, 2013: a mesh of 871 k triangles,
// 940 k fragments on 1024 x 1024 pixels, lists about 10 deep. Every row's lists are compared with
// the CPU's before they are timed.
//
// Needs: libEGL and an OpenGL 4.5 driver on the machine, nothing else of it (bench/gl_bundle makes
// a folder of the rest). No files are read. Ends in less than five minutes.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bench/gl_transparency.h"
#include "bench/support.h"
#include "hashbuffer/gl/hash_store.h"
#include "hashbuffer/gl/scan_store.h"
#include "raster/gl/compute.h"
#include "raster/gl/hardware.h"
#include "strata/gl/buffer.h"
#include "strata/gl/context.h"
#include "strata/gl/shader_program.h"
#include "strata/hashbuffer/build_ldi.h"
#include "strata/hashbuffer/record.h"
#include "strata/mesh/shapes.h"

namespace strata::bench {
namespace {

using Clock = std::chrono::steady_clock;

[[noreturn]] void give_up(const Error& error) {
  std::fprintf(stderr, "bench_gl_stores: %s\n", error.message.c_str());
  std::exit(error.code == ErrorCode::kInternal ? 1 : 2);
}

template <class T>
T need(Result<T> result) {
  if (!result) give_up(result.error());
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

// --- the scene ----------------------------------------------------------------------------------

struct Scene {
  std::string name;
  TriangleSoup soup;  ///< the triangles that `mesh` borrows
  LatticeMesh mesh;
  RasterTarget target;
  LayeredDepthImage lists;  ///< the CPU's
  std::size_t deepest = 0;
};

/// The mesh in a box of `side` voxels, scaled so that about `fragments` fragments come out.
std::unique_ptr<Scene> make_scene(std::string name, TriangleSoup soup, int side,
                                  std::uint64_t fragments) {
  auto scene = std::make_unique<Scene>();
  scene->name = std::move(name);
  scene->soup = std::move(soup);
  double extent = 0;
  for (const glm::dvec3& p : scene->soup.positions) {
    extent = std::max({extent, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  }
  VoxelGrid grid;
  grid.dims = glm::ivec3(side);
  double size = 2.0 * extent / side;
  for (int round = 0; round < 4; ++round) {
    grid.voxel_size = glm::dvec3(size);
    grid.origin = glm::dvec3(-0.5 * size * side);
    scene->mesh = need(snap_to_lattice(scene->soup, grid));
    scene->target = raster_target(grid, Axis::kZ);
    scene->lists = need(build_ldi(scene->mesh, scene->target));
    // The fragments are as many as pixels are covered: the square of the scale.
    const double ratio = static_cast<double>(scene->lists.items.size()) /
                         static_cast<double>(std::max<std::uint64_t>(fragments, 1));
    if (std::abs(ratio - 1) < 0.001) break;
    size *= std::sqrt(ratio);
  }
  for (std::size_t i = 0; i + 1 < scene->lists.offsets.size(); ++i) {
    scene->deepest = std::max<std::size_t>(scene->deepest,
                                           scene->lists.offsets[i + 1] - scene->lists.offsets[i]);
  }
  return scene;
}

/// A knot of thin tubes, tilted; 54 450 triangles, twice subdivided.
TriangleSoup dragon_like() {
  TriangleSoup knot = make_torus_knot(5, 12, 0.14, 605, 45);
  const double c = std::cos(0.6), s = std::sin(0.6);
  knot = transform(knot, glm::dmat4(1, 0, 0, 0, 0, c, s, 0, 0, -s, c, 0, 0, 0, 0, 1));
  return subdivide(subdivide(knot));
}

// --- what is timed ------------------------------------------------------------------------------

/// Keeps nothing: what the geometry alone costs.
class NoStore final : public gl::Store {
 public:
  explicit NoStore(const gl::Limits& limits) : Store(limits) {}
  Result<void> begin(std::uint32_t width, std::uint32_t height) override {
    width_ = width;
    height_ = height;
    return sink_.reserve(4);
  }
  int passes() const override { return 1; }
  gl::StoreGlsl glsl(int) const override {
    return {"no store",
            {},
            "layout(std430, binding = 8) buffer store_sink_block { uint store_sink; };\n"
            "void strata_insert(uint pixel, uint depth, uint payload) {\n"
            "  if ((pixel ^ depth ^ payload) == 0x12345678u) store_sink = payload;\n"
            "}\n"};
  }
  gl::PixelRows rows_of(int) const override { return {0, height_}; }
  Result<bool> begin_pass(int) override {
    sink_.bind(8);
    return true;
  }
  Result<bool> end() override { return true; }
  std::uint64_t memory_bytes() const override { return 4; }
  std::uint32_t payload_mask() const override { return 0; }
  int bands() const override { return 0; }
  gl::PixelRows band_rows(int) const override { return {}; }
  gl::StoreGlsl glsl_read() const override { return {}; }
  void bind_for_reading(int) const override {}

 private:
  gl::Buffer sink_;
};

/// Walks every list front to back into one number a pixel: the second half of a frame.
class Walk {
 public:
  Result<void> run(const gl::Store& store) {
    if (store.bands() == 0) return {};
    if (!program_) {
      const gl::StoreGlsl read = store.glsl_read();
      const gl::GlslPiece pieces[] = {
          read.piece(),
          {"walk",
           "layout(local_size_x = 8, local_size_y = 8) in;\n"
           "layout(std430, binding = 0) writeonly buffer picture_block { uint picture[]; };\n"
           "uniform uint width, row, end;\n"
           "void main() {\n"
           "  uvec2 p = gl_GlobalInvocationID.xy + uvec2(0u, row);\n"
           "  if (p.x >= width || p.y >= end) return;\n"
           "  uint pixel = p.y * width + p.x;\n"
           "  StrataCursor cursor = strata_list(pixel);\n"
           "  uint depth, payload, sum = 0u;\n"
           "  while (strata_next(cursor, depth, payload)) sum = sum * 3u + (depth ^ payload);\n"
           "  picture[pixel] = sum;\n"
           "}\n"}};
      auto program = gl::Program::compute(pieces, read.settings);
      if (!program) return tl::unexpected(program.error());
      program_ = std::move(*program);
    }
    const std::uint64_t pixels = std::uint64_t{store.width()} * store.height();
    if (auto room = picture_.reserve(pixels * 4); !room) return room;
    for (int band = 0; band < store.bands(); ++band) {
      const gl::PixelRows rows = store.band_rows(band);
      store.bind_for_reading(band);
      picture_.bind(0);
      program_.set("width", store.width());
      program_.set("row", rows.begin);
      program_.set("end", rows.end);
      program_.dispatch((store.width() + 7) / 8, (rows.end - rows.begin + 7) / 8);
    }
    gl::storage_barrier();
    return {};
  }

 private:
  gl::Program program_;
  gl::Buffer picture_;
};

struct Times {
  double frame = 0, build = 0, walk = 0;  ///< medians, seconds
  int frames = 0;
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

Times time_frames(gl::Store& store, gl::Producer& producer, double budget) {
  Walk walk;
  std::vector<double> frame, build_time, walk_time;
  const auto start = Clock::now();
  for (int i = -2; i < 3 || (seconds_since(start) < budget && i < 400); ++i) {
    const auto begin = Clock::now();
    need(gl::build(store, producer));
    gl::finish();
    const double built = seconds_since(begin);
    need(walk.run(store));
    gl::finish();
    const double all = seconds_since(begin);
    if (i < 0) continue;  // programs are compiled, buffers made
    frame.push_back(all);
    build_time.push_back(built);
    walk_time.push_back(all - built);
  }
  return {median(frame), median(build_time), median(walk_time), static_cast<int>(frame.size())};
}

/// Pixels whose lists are not the CPU's; with depth only, as far as a store keeps them.
std::string check_lists(gl::Store& store, const Scene& scene) {
  const auto lists = need(store.download());
  std::uint64_t differing = 0;
  for (std::size_t pixel = 0; pixel + 1 < scene.lists.offsets.size(); ++pixel) {
    const auto a = std::span(scene.lists.items)
                       .subspan(scene.lists.offsets[pixel],
                                scene.lists.offsets[pixel + 1] - scene.lists.offsets[pixel]);
    const auto b =
        std::span(lists.items)
            .subspan(lists.offsets[pixel], lists.offsets[pixel + 1] - lists.offsets[pixel]);
    differing += !std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](DepthItem x, DepthItem y) {
      return x.depth() == y.depth() && (x.payload() & store.payload_mask()) == y.payload();
    });
  }
  return differing == 0 ? "equal" : std::to_string(differing) + " pixels differ";
}

// --- the floor ----------------------------------------------------------------------------------

struct Machine {
  double write_rate = 0;   ///< bytes a second, a buffer set to a value
  double atomic_rate = 0;  ///< 32-bit maxima a second, one to each of many cells in random order
};

Machine measure_machine(double budget) {
  Machine machine;
  const std::uint32_t cells = 1u << 22;
  auto buffer = need(gl::Buffer::allocate(std::uint64_t{cells} * 4 * 8));
  auto table = need(gl::Buffer::allocate(std::uint64_t{cells} * 4));
  const gl::GlslPiece piece{
      "atomics",
      "layout(local_size_x = 64) in;\n"
      "layout(std430, binding = 0) buffer table_block { uint table[]; };\n"
      "uniform uint cells, turn;\n"
      "void main() {\n"
      "  uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + "
      "gl_LocalInvocationID.x;\n"
      "  atomicMax(table[(i * 2654435761u) & (cells - 1u)], i + turn);\n"
      "}\n"};
  const auto program = need(gl::Program::compute({&piece, 1}));
  const gl::Groups groups = gl::groups_for(cells, 64);
  const auto rate = [&](double amount, auto&& work) {
    work(0u);
    gl::finish();
    std::vector<double> times;
    const auto start = Clock::now();
    for (std::uint32_t i = 1; i < 4 || (seconds_since(start) < budget && i < 200); ++i) {
      const auto begin = Clock::now();
      work(i);
      gl::finish();
      times.push_back(seconds_since(begin));
    }
    return amount / *std::min_element(times.begin(), times.end());
  };
  machine.write_rate =
      rate(static_cast<double>(buffer.bytes()), [&](std::uint32_t i) { buffer.clear(i); });
  machine.atomic_rate = rate(static_cast<double>(cells), [&](std::uint32_t i) {
    table.bind(0);
    program.set("cells", cells);
    program.set("turn", i);
    program.dispatch(groups.x, groups.y);
    gl::storage_barrier();
  });
  return machine;
}

// --- the table ----------------------------------------------------------------------------------

struct Row {
  std::string name;
  std::function<Result<std::unique_ptr<gl::Store>>()> create;
  double published = 0;       ///< frames a second on a GTX 680; 0: none
  std::uint64_t bytes = 0;    ///< that must be written and read once each
  std::uint64_t atomics = 0;  ///< at least
};

/// What the command line says.
struct Settings {
  double budget = 2.0;  ///< seconds a row
  bool small_only = false;
  OffsetKind offsets = OffsetKind::kRandom;
  bool read_first = true;
};

Row hash_row(const gl::Info& info, const Scene& scene, const Settings& settings, int bits,
             gl::WordPath path, double load, double published) {
  const std::uint64_t fragments = scene.lists.items.size();
  gl::HashStoreOptions options;
  options.record_bits = bits;
  options.path = path;
  options.cells = static_cast<std::uint64_t>(static_cast<double>(fragments) / load);
  options.resize = false;
  options.offsets = settings.offsets;
  options.read_first = settings.read_first;
  Row row;
  row.name = fmt::format("HA {}{}, load {:.1f}", bits,
                         bits == 32                      ? ""
                         : path == gl::WordPath::kAtomic ? " atomic"
                                                         : " two-pass",
                         load);
  row.create = [&info, options]() -> Result<std::unique_ptr<gl::Store>> {
    auto store = gl::HashStore::create(info, options);
    if (!store) return tl::unexpected(store.error());
    return std::unique_ptr<gl::Store>(std::move(*store));
  };
  row.published = published;
  // Each cell is cleared and read; each fragment written once, by an atomic.
  row.bytes = std::max<std::uint64_t>(options.cells, scene.lists.offsets.size()) *
                  static_cast<std::uint64_t>(bits / 8) * 2 +
              fragments * static_cast<std::uint64_t>(bits / 8);
  row.atomics = fragments * (bits == 64 && path == gl::WordPath::kTwoPass ? 2 : 1);
  return row;
}

Row scan_row(const gl::Info& info, const Scene& scene, bool payload) {
  Row row;
  row.name = payload ? "count/scan 64" : "count/scan 32";
  row.create = [&info, payload]() -> Result<std::unique_ptr<gl::Store>> {
    auto store = gl::ScanStore::create(info, {.payload = payload, .binding_bytes = 0});
    if (!store) return tl::unexpected(store.error());
    return std::unique_ptr<gl::Store>(std::move(*store));
  };
  const std::uint64_t item = payload ? 8 : 4;
  row.bytes = scene.lists.offsets.size() * 4 * 3 + scene.lists.items.size() * item * 2;
  row.atomics = scene.lists.items.size() * 2;
  return row;
}

Row no_row(const gl::Info& info) {
  Row row;
  row.name = "geometry alone";
  row.create = [&info]() -> Result<std::unique_ptr<gl::Store>> {
    return std::unique_ptr<gl::Store>(std::make_unique<NoStore>(info.limits));
  };
  return row;
}

void run_table(const gl::Context& context, const Scene& scene, const std::vector<Row>& rows,
               const Machine& machine, double budget) {
  const auto fragments = static_cast<double>(scene.lists.items.size());
  std::printf("\n### %s: %zu triangles, %zu fragments on %d x %d, lists up to %zu\n\n",
              scene.name.c_str(), scene.mesh.triangles.size(), scene.lists.items.size(),
              scene.target.width, scene.target.height, scene.deepest);
  std::printf(
      "| producer | store | frames/s | Mfragments/s | build ms | walk ms | MiB | of the first "
      "row's "
      "time | published | floor ms | times the floor | lists |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  auto hardware = gl::HardwareRasterizer::create(context);
  auto compute = gl::ComputeRasterizer::create(context);
  const auto each = [&](const char* name, gl::Producer& producer) {
    double first = 0, first_published = 0;
    for (const Row& row : rows) {
      auto store = row.create();
      if (!store) {
        std::printf("| %s | %s | %s |\n", name, row.name.c_str(), store.error().message.c_str());
        continue;
      }
      const auto built = gl::build(**store, producer);
      if (!built) {
        std::printf("| %s | %s | %s |\n", name, row.name.c_str(), built.error().message.c_str());
        continue;
      }
      const std::string same = (*store)->bands() > 0 ? check_lists(**store, scene) : "";
      const Times times = time_frames(**store, producer, budget);
      if (first == 0 && row.published > 0) first = times.frame, first_published = row.published;
      const double floor = static_cast<double>(row.bytes) / machine.write_rate +
                           static_cast<double>(row.atomics) / machine.atomic_rate;
      std::printf("| %s | %s | %.1f | %.1f | %.2f | %.2f | %.1f |", name, row.name.c_str(),
                  1 / times.frame, fragments / times.frame * 1e-6, times.build * 1e3,
                  times.walk * 1e3, static_cast<double>((*store)->memory_bytes()) / 1048576.0);
      if (first > 0)
        std::printf(" %.2f |", times.frame / first);
      else
        std::printf(" |");
      if (row.published > 0) {
        std::printf(" %.0f fps, %.2f |", row.published, first_published / row.published);
      } else {
        std::printf(" |");
      }
      if (row.atomics > 0)
        std::printf(" %.3f | %.1f |", floor * 1e3, times.frame / floor);
      else
        std::printf(" | |");
      std::printf(" %s |\n", same.c_str());
      std::fflush(stdout);
    }
  };
  if (hardware) {
    need((*hardware)->set_mesh(scene.mesh));
    (*hardware)->set_target(scene.target);
    each("hardware", **hardware);
  } else {
    std::printf("| hardware | %s |\n", hardware.error().message.c_str());
  }
  if (compute) {
    need((*compute)->set_mesh(scene.mesh));
    (*compute)->set_target(scene.target, 0, scene.target.height);
    each("compute", **compute);
  } else {
    std::printf("| compute | %s |\n", compute.error().message.c_str());
  }
}

int run(const Settings& settings) {
  const double budget = settings.budget;
  auto context = need(gl::Context::headless());
  const gl::Info& info = context->info();
  std::printf("%s, OpenGL %s, %s; %s\n", info.renderer.c_str(), info.version.c_str(),
              info.window_system.c_str(), info.int64_atomics_reason.c_str());
  const Machine machine = measure_machine(budget / 4);
  std::printf(
      "\nWrites %.1f GB/s; 32-bit atomic maxima, one a cell in random order: %.0f M/s. The "
      "floor of a row is its bytes (cells cleared, fragments written, cells read) and its "
      "atomics (one a fragment and pass) at these rates.\n",
      machine.write_rate * 1e-9, machine.atomic_rate * 1e-6);
  using gl::WordPath;
  {
    const auto scene =
        make_scene("half a million", make_torus_knot(2, 7, 0.25, 1200, 40), 1024, 500000);
    run_table(*context, *scene,
              {no_row(info), hash_row(info, *scene, settings, 32, WordPath::kAuto, 0.5, 0),
               scan_row(info, *scene, false),
               hash_row(info, *scene, settings, 64, WordPath::kTwoPass, 0.5, 0),
               scan_row(info, *scene, true)},
              machine, budget);
  }
  if (!settings.small_only) {
    const auto scene = make_scene("dragon-like", dragon_like(), 1024, 938174);
    std::vector<Row> rows{no_row(info),
                          hash_row(info, *scene, settings, 32, WordPath::kAuto, 0.5, 298),
                          hash_row(info, *scene, settings, 32, WordPath::kAuto, 0.8, 181)};
    // 64-bit maxima were emulated for the published figures.
    if (info.has_int64_atomics) {
      rows.push_back(hash_row(info, *scene, settings, 64, WordPath::kAtomic, 0.5, 187));
      rows.push_back(hash_row(info, *scene, settings, 64, WordPath::kAtomic, 0.8, 83));
    }
    rows.push_back(hash_row(info, *scene, settings, 64, WordPath::kTwoPass, 0.5, 187));
    rows.push_back(hash_row(info, *scene, settings, 64, WordPath::kTwoPass, 0.8, 83));
    rows.push_back(scan_row(info, *scene, false));
    rows.push_back(scan_row(info, *scene, true));
    run_table(*context, *scene, rows, machine, budget);
  }
  transparency_tables(*context, budget / 2, settings.small_only);
  if (auto checked = context->check(); !checked) give_up(checked.error());
  return 0;
}

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) {
  strata::bench::Settings settings;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--quick") {
      settings.budget = 0.3;
    } else if (word == "--small") {
      settings.small_only = true;
    } else if (word == "--planes") {
      settings.offsets = strata::OffsetKind::kPlaneFirst;
    } else if (word == "--always-atomic") {
      settings.read_first = false;
    } else {
      const bool asked = word == "--help";
      std::fprintf(asked ? stdout : stderr,
                   "usage: bench_gl_stores [--quick] [--small] [--planes] [--always-atomic]\n"
                   "  --quick          0.3 instead of 2 seconds a row\n"
                   "  --small          only the scene of half a million fragments\n"
                   "  --planes         plane-first offsets instead of random ones\n"
                   "  --always-atomic  no plain load before an atomic maximum\n");
      return asked ? 0 : 2;
    }
  }
  return strata::bench::run(settings);
}
