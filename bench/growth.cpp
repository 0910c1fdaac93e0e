// How Strata's mesh to intervals grows with the side of the grid, what the second thread gives, and
// what memory it takes. Work should grow with the surface: fourfold a doubling. Beyond 8192 only
// statistics are made, slab by slab, as `strata voxelize --stats` does.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "bench/support.h"
#include "strata/voxelize/voxelize.h"

namespace strata::bench {
namespace {

struct Settings {
  std::vector<std::string> meshes{"bumps-82k"};
  std::vector<int> resolutions{512, 1024, 2048, 4096, 8192, 16384};
  int statistics_from = 16384;
  int threads = 2;
  int rounds = 7;
  double budget_s = 6;
  std::string csv;
  int only_threads = 0;  // measure memory in this process and print it
};

Execution with_threads(int threads) {
  Execution execution;
  execution.threads = threads;
  return execution;
}

/// What a job leaves: the intervals, or with statistics only their number.
struct Outcome {
  VoxelIntervals intervals;
  VoxelizeReport report;
};

Result<std::shared_ptr<Outcome>> run_job(const BenchMesh& mesh, const VoxelGrid& grid, int threads,
                                         bool statistics) {
  VoxelizeOptions options;
  options.closedness = mesh.closed ? Closedness::kAssumeClosed : Closedness::kAssumeOpen;
  options.statistics = statistics;
  auto outcome = std::make_shared<Outcome>();
  if (statistics) {
    const auto report = voxelize_slabs(mesh.soup, grid, options, with_threads(threads),
                                       [](const VoxelIntervals&) -> Result<void> { return {}; });
    if (!report) return tl::unexpected(report.error());
    outcome->report = *report;
  } else {
    auto intervals = voxelize(mesh.soup, grid, options, with_threads(threads), &outcome->report);
    if (!intervals) return tl::unexpected(intervals.error());
    outcome->intervals = std::move(*intervals);
  }
  return outcome;
}

/// The most memory beyond the mesh, in a process that does nothing else.
int measure_memory(const Settings& settings) {
  const auto mesh = bench_mesh(settings.meshes.front());
  if (!mesh) return 1;
  const int side = settings.resolutions.front();
  const auto grid = bench_grid(mesh->soup, side);
  if (!grid) return 1;
  bool good = true;
  const std::uint64_t peak = added_peak_bytes([&]() -> std::shared_ptr<void> {
    auto outcome = run_job(*mesh, *grid, settings.only_threads, side >= settings.statistics_from);
    good = outcome.has_value();
    return good ? *outcome : nullptr;
  });
  fmt::print("{}\n", peak);
  return good ? 0 : 1;
}

Result<std::uint64_t> memory_of(const Settings& settings, const std::string& mesh, int side,
                                int threads) {
  const auto text = run_self({"--mesh", mesh, "-r", std::to_string(side), "--statistics-from",
                              std::to_string(settings.statistics_from), "--only-threads",
                              std::to_string(threads)});
  if (!text) return tl::unexpected(text.error());
  return std::stoull(*text);
}

class Growth {
 public:
  explicit Growth(const Settings& settings) : settings_(settings) {}

  Result<void> run(const std::string& name) {
    const auto mesh = bench_mesh(name);
    if (!mesh) return tl::unexpected(mesh.error());
    // All sides take turns, so that what disturbs the machine disturbs every ratio alike.
    std::vector<Participant> participants;
    std::vector<VoxelizeReport> reports(settings_.resolutions.size() * 2);
    Result<void> status;
    for (std::size_t i = 0; i < reports.size(); ++i) {
      const int side = settings_.resolutions[i / 2];
      const int threads = i % 2 == 0 ? 1 : settings_.threads;
      const auto grid = bench_grid(mesh->soup, side);
      if (!grid) return tl::unexpected(grid.error());
      const bool statistics = side >= settings_.statistics_from;
      participants.push_back({fmt::format("{}/{}", side, threads),
                              [&mesh, &reports, &status, grid = *grid, i, threads,
                               statistics]() -> std::shared_ptr<void> {
                                auto outcome = run_job(*mesh, grid, threads, statistics);
                                if (!outcome) {
                                  status = tl::unexpected(outcome.error());
                                  return nullptr;
                                }
                                reports[i] = (*outcome)->report;
                                return *outcome;
                              }});
    }
    run_interleaved(participants, settings_.rounds, settings_.budget_s * 1e3);
    if (!status) return status;
    return report(name, *mesh, participants, reports);
  }
  [[nodiscard]] const Table& table() const { return table_; }

 private:
  Result<void> report(const std::string& name, const BenchMesh& mesh,
                      const std::vector<Participant>& participants,
                      const std::vector<VoxelizeReport>& reports) {
    std::array<double, 2> former{};
    for (std::size_t i = 0; i < participants.size(); ++i) {
      const int side = settings_.resolutions[i / 2];
      const int threads = i % 2 == 0 ? 1 : settings_.threads;
      const Sample sample = median(participants[i].samples);
      const auto peak = memory_of(settings_, name, side, threads);
      if (!peak) return tl::unexpected(peak.error());
      const double growth = former[i % 2] > 0 ? sample.wall_ms / former[i % 2] : 0;
      former[i % 2] = sample.wall_ms;
      const double speedup =
          i % 2 == 1 ? median(participants[i - 1].samples).wall_ms / sample.wall_ms : 1;
      table_.add({mesh.name, std::to_string(mesh.soup.triangles.size()), std::to_string(side),
                  side >= settings_.statistics_from ? "statistics" : "intervals",
                  std::to_string(threads), short_number(sample.wall_ms),
                  short_number(sample.cpu_ms), growth > 0 ? short_number(growth) : "-",
                  short_number(speedup),
                  short_number(static_cast<double>(reports[i].crossings) * 1e-3 / sample.wall_ms),
                  megabytes(*peak), std::to_string(participants[i].samples.size())});
    }
    return {};
  }

  const Settings& settings_;
  Table table_{{"mesh", "triangles", "side", "result", "threads", "wall ms", "cpu ms",
                "wall / former side", "speed-up", "Mcrossings / s", "peak MiB", "rounds"}};
};

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) {
  using namespace strata::bench;
  Settings settings;
  CLI::App app{"How mesh to intervals grows with the side of the grid"};
  app.add_option("--mesh", settings.meshes, "bumps-82k, bumps-328k, knot-200k, or a file")
      ->delimiter(',');
  app.add_option("-r,--resolution", settings.resolutions, "voxels along the longest side")
      ->delimiter(',');
  app.add_option("--statistics-from", settings.statistics_from,
                 "sides from here on make statistics only");
  app.add_option("--threads", settings.threads, "of the second measurement of each side");
  app.add_option("--rounds", settings.rounds, "interleaved rounds");
  app.add_option("--budget", settings.budget_s, "seconds for each side and thread count");
  app.add_option("--csv", settings.csv, "write the table to this file");
  app.add_option("--only-threads", settings.only_threads)->group("");
  CLI11_PARSE(app, argc, argv);
  if (settings.only_threads > 0) return measure_memory(settings);

  Growth growth(settings);
  for (const std::string& mesh : settings.meshes) {
    if (const auto done = growth.run(mesh); !done) {
      fmt::print(stderr, "bench_growth: {}\n", done.error().message);
      return static_cast<int>(done.error().code);
    }
  }
  return publish(growth.table(), settings.csv) ? 0 : 4;
}
