#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "strata/core/grid.h"
#include "strata/core/result.h"
#include "strata/mesh/triangle_soup.h"

/// What the benchmark programs share: meshes, clocks, interleaved rounds, tables.
namespace strata::bench {

/// A mesh and what the tables call it.
struct BenchMesh {
  std::string name;
  TriangleSoup soup;
  bool closed = true;
};

/// `bumps-20k`, `bumps-82k`, `bumps-328k`: a sphere with bumps, an icosphere whose vertices were
/// moved along their rays; `knot-200k`, `knot-1m`: a torus knot; any other name is a file.
Result<BenchMesh> bench_mesh(const std::string& name);

/// The grid of `-r resolution`: cubic voxels, `resolution` of them along the longest side.
Result<VoxelGrid> bench_grid(const TriangleSoup& mesh, int resolution);

/// What one run took.
struct Sample {
  double wall_ms = 0;
  double cpu_ms = 0;  ///< of all threads of the process
};

/// One of several that do the same work in turn.
struct Participant {
  std::string name;
  /// Does the work; what it returns is destroyed when the clock has stopped.
  std::function<std::shared_ptr<void>()> run;
  std::vector<Sample> samples = {};
};

/// Runs A B C A B C ..., `rounds` times. Who has used up `budget_ms` of wall time sits out the
/// remaining rounds, after at least one.
void run_interleaved(std::vector<Participant>& participants, int rounds, double budget_ms);

/// The times of a single run.
Sample time_once(const std::function<std::shared_ptr<void>()>& run);

/// Wall time.
[[nodiscard]] inline double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

[[nodiscard]] double median(std::vector<double> values);
[[nodiscard]] Sample median(const std::vector<Sample>& samples);

/// Bytes this process holds now (VmRSS).
[[nodiscard]] std::uint64_t resident_bytes();

/// The most memory that `run` held at once beyond what was resident before, in bytes. Meant for a
/// process that has done nothing else, since freed memory is used again.
std::uint64_t added_peak_bytes(const std::function<std::shared_ptr<void>()>& run);

/// Runs this program again with other arguments and returns what it prints.
Result<std::string> run_self(const std::vector<std::string>& arguments);

/// Rows of text under column names.
class Table {
 public:
  explicit Table(std::vector<std::string> columns) : columns_(std::move(columns)) {}
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  [[nodiscard]] std::string markdown() const;
  [[nodiscard]] std::string csv() const;

 private:
  std::vector<std::string> columns_;
  std::vector<std::vector<std::string>> rows_;
};

/// Three significant digits, no exponent: `0.123`, `4.56`, `78.9`, `1234`.
[[nodiscard]] std::string short_number(double value);
[[nodiscard]] std::string megabytes(std::uint64_t bytes);  ///< MiB, like short_number

/// Prints a table to standard output and, where `csv_path` is not empty, writes it there.
/// @return whether the file could be written
bool publish(const Table& table, const std::string& csv_path);

}  // namespace strata::bench
