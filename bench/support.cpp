#include "bench/support.h"

#include <fmt/format.h>
#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <string_view>
#include <thread>
#include <utility>

#include "apps/session/process_memory.h"
#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/read_mesh.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "strata/voxelize/grid_fit.h"

namespace strata::bench {
namespace {

double cpu_now_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

/// A solid without symmetry, curved everywhere, two to four crossings deep.
TriangleSoup bumpy_sphere(int subdivisions) {
  TriangleSoup mesh = make_icosphere(1.0, subdivisions);
  for (glm::dvec3& p : mesh.positions) {
    const double bumps =
        std::sin(9.0 * p.x + 1.0) * std::sin(8.0 * p.y + 2.0) * std::sin(7.0 * p.z + 3.0);
    p *= 1.0 + 0.25 * bumps;
  }
  return mesh;
}

}  // namespace

Result<BenchMesh> bench_mesh(const std::string& name) {
  BenchMesh mesh{name, {}, true};
  if (name == "bumps-20k") {
    mesh.soup = bumpy_sphere(5);
  } else if (name == "bumps-82k") {
    mesh.soup = bumpy_sphere(6);
  } else if (name == "bumps-328k") {
    mesh.soup = bumpy_sphere(7);
  } else if (name == "knot-200k") {
    mesh.soup = make_torus_knot(2, 3, 0.5, 1000, 100);
  } else if (name == "knot-1m") {
    mesh.soup = make_torus_knot(2, 3, 0.5, 1000, 500);
  } else {
    auto file = read_mesh(name);
    if (!file) return tl::unexpected(file.error());
    const std::size_t slash = name.find_last_of('/');
    const std::string base = slash == std::string::npos ? name : name.substr(slash + 1);
    mesh.name = base.substr(0, base.find_last_of('.'));
    mesh.soup = std::move(file->soup);
    mesh.closed = is_closed(mesh.soup);
  }
  return mesh;
}

Result<VoxelGrid> bench_grid(const TriangleSoup& mesh, int resolution) {
  GridRequest request;
  request.resolution = resolution;
  return fit_grid(bounds(mesh), request);
}

Sample time_once(const std::function<std::shared_ptr<void>()>& run) {
  // Threads that a former run left spinning go to sleep; they would be counted here.
  std::this_thread::sleep_for(std::chrono::milliseconds(4));
  const double cpu = cpu_now_ms();
  const auto start = std::chrono::steady_clock::now();
  const std::shared_ptr<void> result = run();
  const std::chrono::duration<double, std::milli> wall = std::chrono::steady_clock::now() - start;
  return {wall.count(), cpu_now_ms() - cpu};
}

void run_interleaved(std::vector<Participant>& participants, int rounds, double budget_ms) {
  std::vector<double> used(participants.size(), 0.0);
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < participants.size(); ++i) {
      if (round > 0 && used[i] > budget_ms) continue;
      const Sample sample = time_once(participants[i].run);
      participants[i].samples.push_back(sample);
      used[i] += sample.wall_ms;
    }
  }
}

double median(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

Sample median(const std::vector<Sample>& samples) {
  std::vector<double> wall, cpu;
  for (const Sample& sample : samples) {
    wall.push_back(sample.wall_ms);
    cpu.push_back(sample.cpu_ms);
  }
  return {median(std::move(wall)), median(std::move(cpu))};
}

std::uint64_t resident_bytes() {
  std::ifstream in("/proc/self/statm");
  std::uint64_t total = 0, resident = 0;
  in >> total >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

std::uint64_t added_peak_bytes(const std::function<std::shared_ptr<void>()>& run) {
  malloc_trim(0);
  const std::uint64_t before = resident_bytes();
  // Where the mark cannot be reset, what came before may hide small runs, never enlarge them much.
  if (!reset_peak_memory()) std::fputs("bench: cannot reset the peak of memory\n", stderr);
  const std::shared_ptr<void> result = run();
  const std::uint64_t peak = peak_memory_bytes();
  return peak > before ? peak - before : 0;
}

Result<std::string> run_self(const std::vector<std::string>& arguments) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) return fail(ErrorCode::kInternal, "no pipe");
  std::vector<std::string> words = arguments;
  words.insert(words.begin(), "bench");
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t child = fork();
  if (child < 0) return fail(ErrorCode::kInternal, "cannot start a process");
  if (child == 0) {
    dup2(ends[1], STDOUT_FILENO);
    close(ends[0]);
    close(ends[1]);
    execv("/proc/self/exe", argv.data());
    _exit(127);
  }
  close(ends[1]);
  std::string out;
  std::array<char, 4096> buffer{};
  for (ssize_t got = 0; (got = read(ends[0], buffer.data(), buffer.size())) > 0;) {
    out.append(buffer.data(), static_cast<std::size_t>(got));
  }
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (status != 0) return fail(ErrorCode::kInternal, "a measured process ended with {}", status);
  return out;
}

std::string Table::markdown() const {
  std::vector<std::size_t> widths;
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    widths.push_back(std::max<std::size_t>(3, columns_[c].size()));
    for (const auto& row : rows_) widths[c] = std::max(widths[c], row[c].size());
  }
  const auto line = [&](const std::vector<std::string>& cells) {
    std::string text = "|";
    for (std::size_t c = 0; c < cells.size(); ++c) {
      text += fmt::format(" {:<{}} |", cells[c], widths[c]);
    }
    return text + "\n";
  };
  std::string text = line(columns_) + "|";
  for (const std::size_t width : widths) text += std::string(width + 2, '-') + "|";
  text += "\n";
  for (const auto& row : rows_) text += line(row);
  return text;
}

std::string Table::csv() const {
  const auto line = [](const std::vector<std::string>& cells) {
    std::string text;
    for (const std::string& cell : cells) {
      const bool quote = cell.find(',') != std::string::npos;
      text += (text.empty() ? "" : ",") + (quote ? '"' + cell + '"' : cell);
    }
    return text + "\n";
  };
  std::string text = line(columns_);
  for (const auto& row : rows_) text += line(row);
  return text;
}

std::string short_number(double value) {
  if (!std::isfinite(value)) return "-";
  const double size = std::abs(value);
  const int decimals = size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 3;
  return fmt::format("{:.{}f}", value, decimals);
}

std::string megabytes(std::uint64_t bytes) {
  return short_number(static_cast<double>(bytes) / (1 << 20));
}

bool publish(const Table& table, const std::string& csv_path) {
  fmt::print("{}\n", table.markdown());
  std::fflush(stdout);
  if (csv_path.empty()) return true;
  std::ofstream out(csv_path);
  out << table.csv() << std::flush;
  if (!out) fmt::print(stderr, "bench: cannot write {}\n", csv_path);
  return out.good();
}

}  // namespace strata::bench
