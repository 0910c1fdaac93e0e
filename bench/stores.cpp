// Fragments per second of the fragment stores: HA-buffer with 32-bit and 64-bit records, each kind
// of offsets, against count/scan. Prints markdown tables to stdout.
//
//   bench_stores [--quick] [--seconds S] [--cpu-time]
//
// Scenes: random axis-aligned quads of side 4 to 64 at random depths, quad by quad in random depth
// order, as a mesh would come. A measurement is a whole frame: clear, insert, (count/scan: two
// passes, sort,) and one walk over every list. Each number is the median of the frames that fit in
// S seconds (0.5), at least one. --cpu-time counts the process's CPU time over the threads, for
// machines that are shared; it hides waiting, so prefer the wall clock on a quiet one. --quick
// takes a 256 x 256 screen. All stores of a row are hashed and compared first.

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "hashbuffer/random.h"
#include "strata/hashbuffer/count_scan_store.h"
#include "strata/hashbuffer/hash_buffer.h"

namespace strata {
namespace {

struct Quad {
  int x0, y0, x1, y1;  // pixels [x0, x1) x [y0, y1)
  std::uint32_t depth;
};

struct Scene {
  int width = 0, height = 0;
  std::vector<Quad> quads;
  std::uint64_t fragments = 0;

  template <class Sink>
  void submit(Sink& sink, std::size_t part, std::size_t parts) const {
    for (std::size_t i = part; i < quads.size(); i += parts) {
      const Quad& quad = quads[i];
      for (int y = quad.y0; y < quad.y1; ++y) {
        for (int x = quad.x0; x < quad.x1; ++x) {
          if constexpr (requires { sink.insert(x, y, quad.depth); }) {
            sink.insert(x, y, quad.depth);
          } else {
            sink.insert(x, y, quad.depth, static_cast<std::uint32_t>(i));
          }
        }
      }
    }
  }
};

Scene random_quads(int side, double mean_depth, std::uint64_t seed) {
  Scene scene{side, side, {}, 0};
  Random random(seed);
  const auto wanted = static_cast<std::uint64_t>(mean_depth * side * side);
  while (scene.fragments < wanted) {
    const int w = 4 + static_cast<int>(random.below(61));
    const int h = 4 + static_cast<int>(random.below(61));
    const int x = static_cast<int>(random.below(static_cast<std::uint64_t>(side - w + 1)));
    const int y = static_cast<int>(random.below(static_cast<std::uint64_t>(side - h + 1)));
    scene.quads.push_back({x, y, x + w, y + h, static_cast<std::uint32_t>(random.below(1 << 24))});
    scene.fragments += static_cast<std::uint64_t>(w * h);
  }
  return scene;
}

/// 64 quads of a side of an eighth of the screen, drawn together from a grid (spread 1) to one
/// stack (spread 0): the published stress test.
Scene stacked_quads(int side, double spread) {
  Scene scene{side, side, {}, 0};
  const int edge = side / 8;
  for (int i = 0; i < 64; ++i) {
    const int x = static_cast<int>(spread * (i % 8) * edge);
    const int y = static_cast<int>(spread * (i / 8) * edge);
    const auto depth = static_cast<std::uint32_t>(i * 37 % 64 * 1000);
    scene.quads.push_back({x, y, x + edge, y + edge, depth});
    scene.fragments += static_cast<std::uint64_t>(edge) * static_cast<std::uint64_t>(edge);
  }
  return scene;
}

double g_seconds = 0.5;

bool g_cpu_time = false;

double seconds_now(int threads) {
  if (g_cpu_time) {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return (static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec)) / threads;
  }
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Median of the seconds that frame() takes.
template <class Frame>
double median_seconds(int threads, Frame&& frame) {
  frame();  // touches the memory
  std::vector<double> times;
  const double begin = seconds_now(threads);
  do {
    const double start = seconds_now(threads);
    frame();
    times.push_back(seconds_now(threads) - start);
  } while (seconds_now(threads) - begin < g_seconds);
  std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2),
                   times.end());
  return times[times.size() / 2];
}

/// Walks all lists; the sum keeps the walk from being optimized away and compares stores.
template <class Store>
std::uint64_t walk(const Store& store) {
  std::uint64_t hash = 0;
  for (int y = 0; y < store.height(); ++y) {
    for (int x = 0; x < store.width(); ++x) {
      store.for_each(x, y, [&](DepthItem item) { hash = hash * 31 + item.bits; });
    }
  }
  return hash;
}

struct Measured {
  double rate = 0.0;  ///< million fragments a second
  std::uint64_t hash = 0;
  double probes = 0.0;  ///< a fragment; 0 where that has no meaning
  unsigned max_age = 0;
  std::uint64_t failures = 0;
};

class InParallel {
 public:
  InParallel(const Scene& scene, int threads) : scene_(&scene), threads_(threads) {}
  template <class Sink>
  void operator()(Sink& sink) const {
    const auto parts = static_cast<std::size_t>(threads_);
    std::vector<std::jthread> pool;
    for (std::size_t part = 1; part < parts; ++part) {
      pool.emplace_back([&sink, part, parts, this] { scene_->submit(sink, part, parts); });
    }
    scene_->submit(sink, 0, parts);
  }

 private:
  const Scene* scene_;
  int threads_;
};

template <class Record, class Form>
Measured measure_scan(const Scene& scene, int threads = 1) {
  auto store = CountScanStore<Record, Form>::create(scene.width, scene.height).value();
  Measured measured;
  const double seconds = median_seconds(threads, [&] {
    build(store, InParallel(scene, threads), Execution{.threads = threads}).value();
    measured.hash = walk(store);
  });
  measured.rate = static_cast<double>(scene.fragments) / seconds * 1e-6;
  return measured;
}

template <class Record, class Form>
Measured measure_ha(const Scene& scene, OffsetKind kind, double load, int threads = 1) {
  using Buffer = HashBuffer<Record, Form>;
  const auto cells = static_cast<std::uint64_t>(static_cast<double>(scene.fragments) / load);
  auto buffer =
      Buffer::create(scene.width, scene.height, {.cells = cells, .offsets = kind}).value();
  Measured measured;
  const double seconds = median_seconds(threads, [&] {
    buffer.clear();
    InParallel(scene, threads)(buffer);
    measured.hash = walk(buffer);
  });
  std::uint64_t probes = 0;
  for (const auto word : buffer.cells()) {
    probes += Record::age(word);
    measured.max_age = std::max(measured.max_age, Record::age(word));
  }
  measured.rate = static_cast<double>(scene.fragments) / seconds * 1e-6;
  measured.probes = static_cast<double>(probes) / static_cast<double>(scene.fragments);
  measured.failures = buffer.failures();
  return measured;
}

std::string cell(const Measured& measured, std::uint64_t expected_hash) {
  if (measured.failures > 0) return fmt::format("{} lost", measured.failures);
  if (measured.hash != expected_hash) return "WRONG LISTS";
  return fmt::format("{:.1f} ({:.1f})", measured.rate, measured.probes);
}

constexpr struct {
  OffsetKind kind;
  std::string_view name;
} kKinds[] = {{OffsetKind::kRandom, "random"},
              {OffsetKind::kFarthestPoint, "farthest"},
              {OffsetKind::kPlaneFirst, "planes"}};

void print_header(std::string_view first) {
  fmt::print("| {} | count/scan |", first);
  for (const char* record : {"HA32", "HA64"}) {
    for (const auto& kind : kKinds) fmt::print(" {} {} |", record, kind.name);
  }
  fmt::print("\n|---|---|---|---|---|---|---|---|\n");
}

template <class Form>
void print_row(std::string_view label, const Scene& scene, double load, int threads) {
  const Measured scan64 = measure_scan<Record64, Form>(scene, threads);
  const auto scan32_hash = measure_scan<Record32, Form>(scene, threads).hash;
  fmt::print("| {} | {:.1f} |", label, scan64.rate);
  for (const auto& kind : kKinds) {
    fmt::print(" {} |",
               cell(measure_ha<Record32, Form>(scene, kind.kind, load, threads), scan32_hash));
  }
  for (const auto& kind : kKinds) {
    fmt::print(" {} |",
               cell(measure_ha<Record64, Form>(scene, kind.kind, load, threads), scan64.hash));
  }
  fmt::print("\n");
  std::fflush(stdout);
}

void print_tables(int side) {
  fmt::print("Screen {} x {}; million fragments a second (probes a fragment).\n\n", side, side);

  for (const int threads : {1, 2}) {
    fmt::print("## Mean depth, {} thread{}, {}\n\n", threads, threads == 1 ? "" : "s",
               threads == 1 ? "plain stores" : "atomics");
    print_header("depth, load");
    for (const double depth : {1.0, 4.0, 10.0, 20.0}) {
      const Scene scene = random_quads(side, depth, 7);
      for (const double load : {0.5, 0.8}) {
        if (depth > 10 && load > 0.5) continue;  // minutes a frame, and nothing new
        const std::string label = fmt::format("{}, {}", depth, load);
        if (threads == 1) {
          print_row<Exclusive>(label, scene, load, threads);
        } else {
          print_row<Concurrent>(label, scene, load, threads);
        }
      }
    }
    fmt::print("\n");
  }

  fmt::print("## Load, mean depth 4, 1 thread, atomics\n\n");
  print_header("load");
  const Scene scene = random_quads(side, 4.0, 7);
  for (const double load : {0.25, 0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95, 0.98}) {
    print_row<Concurrent>(fmt::format("{}", load), scene, load, 1);
  }

  fmt::print("\n## Stacked quads: 64 of {0} x {0}, load 0.64, 1 thread, atomics\n\n", side / 8);
  fmt::print("| spread | count/scan | HA64 random (largest age) | HA64 planes (largest age) |\n");
  fmt::print("|---|---|---|---|\n");
  for (const double spread : {1.0, 0.75, 0.5, 0.25, 0.1, 0.0}) {
    const Scene stack = stacked_quads(side, spread);
    const Measured scan = measure_scan<Record64, Concurrent>(stack);
    fmt::print("| {} | {:.1f} |", spread, scan.rate);
    for (const OffsetKind kind : {OffsetKind::kRandom, OffsetKind::kPlaneFirst}) {
      const Measured ha = measure_ha<Record64, Concurrent>(stack, kind, 0.64);
      if (ha.hash != scan.hash) {
        fmt::print(" WRONG LISTS |");
      } else {
        fmt::print(" {:.1f} ({}) |", ha.rate, ha.max_age);
      }
    }
    fmt::print("\n");
  }

  fmt::print(
      "\n## Bytes a fragment\n\n| depth | count/scan | HA64 .5 | HA64 .8 | HA32 .5 | HA32 .8 |\n");
  fmt::print("|---|---|---|---|---|---|\n");
  for (const double depth : {1.0, 4.0, 10.0, 20.0}) {
    fmt::print("| {} | {:.1f} |", depth, 8 + 8 / depth);
    for (const double bytes : {8.0, 4.0}) {
      for (const double load : {0.5, 0.8}) {
        // The max-age table and, at load 1, one cell a pixel are all that is added.
        fmt::print(" {:.1f} |", std::max(bytes / load, bytes / depth) + 1 / (64 * depth));
      }
    }
    fmt::print("\n");
  }
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) {
  int side = 1024;
  for (int i = 1; i < argc; ++i) {
    if (std::string_view(argv[i]) == "--quick") side = 256;
    if (std::string_view(argv[i]) == "--cpu-time") strata::g_cpu_time = true;
    if (std::string_view(argv[i]) == "--seconds" && i + 1 < argc) {
      strata::g_seconds = std::atof(argv[++i]);
    }
  }
  strata::print_tables(side);
}
