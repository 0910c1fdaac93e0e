// Mesh in memory to solid voxels: Strata, OpenVDB, Embree and the classical bit grid, on the same
// mesh and grid. Times are medians of interleaved rounds in one process; peak memory and the time
// of a first run come from a process of their own for each contender.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "bench/contenders.h"
#include "bench/support.h"
#include "strata/mesh/formats/write_mesh.h"

namespace strata::bench {
namespace {

struct Settings {
  std::vector<std::string> meshes{"bumps-82k"};
  std::vector<int> resolutions{256, 1024};
  std::vector<std::string> contenders;
  std::vector<int> threads{1, 2};
  int rounds = 9;
  double budget_s = 10;
  bool memory = true;
  std::vector<std::string> skip;  // NAME/THREADS
  std::string csv;
  std::string write;
  std::string only;  // measure this one in this process and print what it took
};

struct Entry {
  std::string id;
  std::unique_ptr<Contender> contender;
};

std::vector<Entry> make_contenders(const Settings& settings, bool closed) {
  std::vector<Entry> all;
  const auto add = [&](std::unique_ptr<Contender> contender) {
    std::string id = fmt::format("{}/{}", contender->name(), contender->threads());
    const bool named = settings.contenders.empty() ||
                       std::find(settings.contenders.begin(), settings.contenders.end(),
                                 contender->name()) != settings.contenders.end();
    const bool skipped =
        std::find(settings.skip.begin(), settings.skip.end(), id) != settings.skip.end();
    if (named && !skipped && (settings.only.empty() || id == settings.only)) {
      all.push_back({std::move(id), std::move(contender)});
    }
  };
  for (const int threads : settings.threads) {
    add(make_strata(StoreKind::kAuto, threads, closed));
    add(make_strata(StoreKind::kHaBuffer, threads, closed));
    add(make_strata(StoreKind::kCountScan, threads, closed));
#ifdef STRATA_HAVE_EMBREE
    add(make_embree(threads));
#endif
#ifdef STRATA_HAVE_OPENVDB
    add(make_openvdb(threads));
#endif
  }
  add(make_bit_grid(0));
  add(make_bit_grid(std::size_t{1} << 20));
  return all;
}

/// What a process of its own found out about a contender's first run.
struct FirstRun {
  std::uint64_t peak_bytes = 0;
  Sample sample;
  std::uint64_t voxels = 0;
};

int measure_first_run(const Settings& settings) {
  auto mesh = bench_mesh(settings.meshes.front());
  if (!mesh) return 1;
  const auto grid = bench_grid(mesh->soup, settings.resolutions.front());
  if (!grid) return 1;
  auto entries = make_contenders(settings, mesh->closed);
  if (entries.size() != 1) return 1;
  Contender& contender = *entries.front().contender;
  contender.prepare();
  FirstRun first;
  std::shared_ptr<VoxelSet> result;
  first.peak_bytes = added_peak_bytes([&] {
    first.sample = time_once(
        [&]() -> std::shared_ptr<void> { return result = contender.voxelize(mesh->soup, *grid); });
    return result;
  });
  if (!result) return 1;
  fmt::print("{} {} {} {}\n", first.peak_bytes, first.sample.wall_ms, first.sample.cpu_ms,
             result->solid_voxels());
  return 0;
}

Result<FirstRun> first_run(const std::string& mesh, int resolution, const std::string& id) {
  const auto text =
      run_self({"--only", id, "--mesh", mesh, "--resolution", std::to_string(resolution)});
  if (!text) return tl::unexpected(text.error());
  FirstRun first;
  std::istringstream in(*text);
  in >> first.peak_bytes >> first.sample.wall_ms >> first.sample.cpu_ms >> first.voxels;
  if (!in) return fail(ErrorCode::kInternal, "{}: no numbers came back", id);
  return first;
}

class Comparison {
 public:
  explicit Comparison(const Settings& settings) : settings_(settings) {}

  Result<void> run(const std::string& mesh_name) {
    const auto mesh = bench_mesh(mesh_name);
    if (!mesh) return tl::unexpected(mesh.error());
    for (const int resolution : settings_.resolutions) {
      if (auto done = run(mesh_name, *mesh, resolution); !done) return done;
    }
    return {};
  }
  [[nodiscard]] const Table& table() const { return table_; }

 private:
  Result<void> run(const std::string& mesh_name, const BenchMesh& mesh, int resolution) {
    const auto grid = bench_grid(mesh.soup, resolution);
    if (!grid) return tl::unexpected(grid.error());
    const auto entries = make_contenders(settings_, mesh.closed);
    std::vector<FirstRun> first(entries.size());
    if (settings_.memory) {
      for (std::size_t i = 0; i < entries.size(); ++i) {
        const auto found = first_run(mesh_name, resolution, entries[i].id);
        if (!found) return tl::unexpected(found.error());
        first[i] = *found;
      }
    }
    std::vector<std::uint64_t> voxels(entries.size());
    std::vector<Participant> participants;
    for (std::size_t i = 0; i < entries.size(); ++i) {
      Contender* const contender = entries[i].contender.get();
      contender->prepare();
      const auto voxelize = [contender, &mesh, &grid]() -> std::shared_ptr<VoxelSet> {
        return contender->voxelize(mesh.soup, *grid);
      };
      voxels[i] = first[i].voxels;
      if (!settings_.memory) {  // also the run that warms up
        const auto set = voxelize();
        if (!set) return fail(ErrorCode::kInternal, "{} failed", entries[i].id);
        voxels[i] = set->solid_voxels();
      }
      participants.push_back({entries[i].id, voxelize});
    }
    run_interleaved(participants, settings_.rounds, settings_.budget_s * 1e3);
    report(mesh, resolution, entries, participants, first, voxels);
    return {};
  }

  void report(const BenchMesh& mesh, int resolution, const std::vector<Entry>& entries,
              const std::vector<Participant>& participants, const std::vector<FirstRun>& first,
              const std::vector<std::uint64_t>& voxels) {
    const auto strata_with = [&](int threads) {
      std::size_t found = entries.size();
      for (std::size_t i = entries.size(); i-- > 0;) {
        if (entries[i].contender->name().starts_with("strata") &&
            entries[i].contender->threads() == threads) {
          found = i;
        }
      }
      return found;
    };
    for (std::size_t i = 0; i < entries.size(); ++i) {
      const Contender& contender = *entries[i].contender;
      const Sample sample = median(participants[i].samples);
      const std::size_t base = strata_with(contender.threads());
      std::string wall_ratio = "-", cpu_ratio = "-", memory_ratio = "-", difference = "-";
      if (base < entries.size()) {
        const Sample ours = median(participants[base].samples);
        wall_ratio = short_number(sample.wall_ms / ours.wall_ms);
        cpu_ratio = short_number(sample.cpu_ms / ours.cpu_ms);
        memory_ratio = short_number(static_cast<double>(first[i].peak_bytes) /
                                    static_cast<double>(first[base].peak_bytes));
        difference = std::to_string(static_cast<std::int64_t>(voxels[i]) -
                                    static_cast<std::int64_t>(voxels[base]));
      }
      table_.add({mesh.name, std::to_string(mesh.soup.triangles.size()), std::to_string(resolution),
                  contender.name(), std::to_string(contender.threads()),
                  short_number(sample.wall_ms), short_number(sample.cpu_ms), wall_ratio, cpu_ratio,
                  settings_.memory ? short_number(first[i].sample.wall_ms) : "-",
                  settings_.memory ? megabytes(first[i].peak_bytes) : "-",
                  settings_.memory ? memory_ratio : "-", std::to_string(voxels[i]), difference,
                  std::to_string(participants[i].samples.size())});
    }
    fmt::print(stderr, "{} at {}: done\n", mesh.name, resolution);
  }

  const Settings& settings_;
  Table table_{{"mesh", "triangles", "side", "contender", "threads", "wall ms", "cpu ms",
                "wall / strata", "cpu / strata", "first run ms", "peak MiB", "peak / strata",
                "voxels", "voxels - strata", "rounds"}};
};

int write_first_mesh(const Settings& settings) {
  const auto mesh = bench_mesh(settings.meshes.front());
  if (!mesh) return 1;
  const auto done = write_mesh(settings.write, mesh->soup);
  if (!done) fmt::print(stderr, "bench_voxelizers: {}\n", done.error().message);
  return done ? 0 : 4;
}

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) {
  using namespace strata::bench;
  Settings settings;
  CLI::App app{"Mesh in memory to solid voxels: Strata against OpenVDB, Embree and a bit grid"};
  app.add_option("--mesh", settings.meshes, "bumps-82k, bumps-328k, knot-200k, or a file")
      ->delimiter(',');
  app.add_option("-r,--resolution", settings.resolutions, "voxels along the longest side")
      ->delimiter(',');
  app.add_option("--contenders", settings.contenders, "names as in the table; all by default")
      ->delimiter(';');
  app.add_option("--skip", settings.skip, "leave out, as NAME/THREADS: OpenVDB/1");
  app.add_option("--threads", settings.threads, "thread counts")->delimiter(',');
  app.add_option("--rounds", settings.rounds, "interleaved rounds");
  app.add_option("--budget", settings.budget_s, "seconds that a contender may use per grid");
  app.add_flag("--memory,!--no-memory", settings.memory, "measure peak memory and first runs");
  app.add_option("--csv", settings.csv, "write the table to this file");
  app.add_option("--write", settings.write, "write the first mesh to this file, and end");
  app.add_option("--only", settings.only)->group("");
  CLI11_PARSE(app, argc, argv);
  if (!settings.only.empty()) return measure_first_run(settings);
  if (!settings.write.empty()) return write_first_mesh(settings);

  Comparison comparison(settings);
  for (const std::string& mesh : settings.meshes) {
    if (const auto done = comparison.run(mesh); !done) {
      fmt::print(stderr, "bench_voxelizers: {}\n", done.error().message);
      return static_cast<int>(done.error().code);
    }
  }
  return publish(comparison.table(), settings.csv) ? 0 : 4;
}
