// `strata merge`: the shards of a job become the file, or the report, that one process would have
// made. Chunks of Zarr are linked into the new folder; all else is written anew from the runs that
// shards hold, slab by slab, by the writer that one process uses.

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <system_error>
#include <utility>

#include "apps/session/session.h"
#include "apps/strata/run_commands.h"
#include "apps/voxelize/shard_part.h"
#include "apps/voxelize/shard_report.h"
#include "apps/voxelize/voxelize_run.h"
#include "core/atomic_file.h"
#include "voxelize/output/run_file.h"

namespace strata::apps {
namespace {

namespace fs = std::filesystem;

/// Checks that the shards are all those of one job, and sorts them.
Result<void> check_shards(std::vector<ShardReport>& shards) {
  const ShardReport& first = shards.front();
  for (const ShardReport& shard : shards) {
    if (const std::string how = difference(shard, first); !how.empty()) {
      return fail(ErrorCode::kInput, "{} is no shard of the job of {}: {}", shard.path, first.path,
                  how);
    }
  }
  const int count = first.command.shard->count;
  std::stable_sort(shards.begin(), shards.end(), [](const ShardReport& a, const ShardReport& b) {
    return a.command.shard->index < b.command.shard->index;
  });
  std::vector<int> missing;
  int next = 1;
  for (std::size_t i = 0; i < shards.size(); ++i) {
    const int index = shards[i].command.shard->index;
    if (i > 0 && index == shards[i - 1].command.shard->index) {
      return fail(ErrorCode::kInput, "{} and {} are both shard {} of {}", shards[i - 1].path,
                  shards[i].path, index, count);
    }
    for (; next < index; ++next) missing.push_back(next);
    next = index + 1;
  }
  for (; next <= count; ++next) missing.push_back(next);
  if (missing.empty()) return {};
  constexpr std::size_t kMostNamed = 10;
  const std::size_t named = std::min(missing.size(), kMostNamed);
  std::string list;
  for (std::size_t i = 0; i < named; ++i)
    list += fmt::format("{}{}", i == 0 ? "" : ", ", missing[i]);
  if (missing.size() > named) list += fmt::format(" and {} more", missing.size() - named);
  const bool several = missing.size() > 1;
  return fail(ErrorCode::kInput, "shard{} {} of {} {} missing", several ? "s" : "", list, count,
              several ? "are" : "is");
}

/// Puts a file into the new folder as well; a copy where the file systems differ.
Result<void> put_file(const fs::path& from, const fs::path& to) {
  std::error_code reason;
  fs::create_hard_link(from, to, reason);
  if (reason == std::errc::file_exists) {
    return fail(ErrorCode::kInput, "{}: another shard has this chunk, too", from.string());
  }
  if (reason) fs::copy_file(from, to, reason);
  if (!reason) return {};
  return fail(ErrorCode::kOutput, "{}: cannot write: {}", to.string(), reason.message());
}

/// All chunks of a shard. @param to  the folder of the store
Result<void> put_chunks(const ShardReport& report, const std::string& to,
                        const Execution& execution) {
  const std::string& shard = report.path;
  const fs::path from = fs::path(shard) / kShardChunks;
  std::error_code reason;
  std::uint64_t bytes = 0;
  fs::recursive_directory_iterator entry(from, reason), end;
  for (; !reason && entry != end; entry.increment(reason)) {
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    const fs::path place = fs::path(to) / entry->path().lexically_relative(from);
    const fs::file_type type = entry->symlink_status(reason).type();
    if (type == fs::file_type::directory) {
      fs::create_directory(place, reason);  // of several shards it may be there
      if (reason) break;
      continue;
    }
    if (type != fs::file_type::regular) {
      return fail(ErrorCode::kInput, "{}: it is no regular file", entry->path().string());
    }
    bytes += entry->file_size(reason);
    if (reason) break;
    if (auto put = put_file(entry->path(), place); !put) return put;
  }
  const std::uint64_t expected = report.outcome.output_bytes.value_or(0);
  if (!reason && bytes != expected) {
    return fail(ErrorCode::kInput, "{}: the chunks must have {} bytes in all, got {}", shard,
                expected, bytes);
  }
  if (!reason) return {};
  return fail(ErrorCode::kInput, "{}: cannot read the chunks: {}", shard, reason.message());
}

/// The largest label of runs that are written so; 0: runs have none.
std::uint32_t largest_label(const VoxelWriterOptions& file) {
  if (file.rgba) return std::numeric_limits<std::uint32_t>::max();
  return std::max({file.ids, file.fog, static_cast<std::uint32_t>(file.colours.size())});
}

class Merge {
 public:
  Merge(const MergeCommand& command, std::vector<ShardReport> shards, Session& session)
      : command_(command), shards_(std::move(shards)), session_(session) {}

  Result<void> run() {
    if (auto added = add_up(); !added) return added;
    if (auto told = tell(); !told) return told;
    if (!command_.output.empty()) {
      if (auto written = write(); !written) return written;
    }
    session_.end_progress();
    return report();
  }

 private:
  Result<void> add_up();
  Result<void> tell();
  Result<void> check_format();
  Result<void> write();
  Result<void> write_chunks(const VoxelWriterOptions& file, const Execution& execution);
  Result<void> write_runs(const VoxelWriterOptions& file, const Execution& execution);
  Result<void> report();

  const MergeCommand& command_;
  std::vector<ShardReport> shards_;
  Session& session_;
  VoxelizeCommand whole_;  ///< the command that one process would have been given
  VoxelizeOutcome sum_;
};

Result<void> Merge::add_up() {
  whole_ = shards_.front().command;
  whole_.shard.reset();
  whole_.output = command_.output;
  whole_.stats = command_.stats;
  whole_.checksum = command_.checksum;
  whole_.json = command_.json;
  sum_ = shards_.front().outcome;
  sum_.output_bytes.reset();
  for (std::size_t i = 1; i < shards_.size(); ++i) add_shard(shards_[i].outcome, sum_);
  return finish_sum(shards_, session_.memory_limit(), sum_);
}

/// What the shards warned of, once, and what only all voxels tell.
Result<void> Merge::tell() {
  for (const ShardReport& shard : shards_) {
    for (const Warning& warning : shard.warnings) session_.warn(warning.code, warning.message);
  }
  tell_voxels(whole_, sum_, session_);
  if (whole_.coverage != 0) tell_filled(whole_, sum_, session_);
  return session_.check_strict();
}

Result<void> Merge::check_format() {
  const ShardReport& first = shards_.front();
  if (first.format.empty()) {
    return fail(ErrorCode::kUsage, "-o {}: {} holds no voxels; it was made without -o",
                command_.output, first.path);
  }
  if (command_.output == "-" && isatty(STDOUT_FILENO) != 0) {
    return fail(ErrorCode::kUsage, "standard output is a terminal, but voxel files are binary");
  }
  auto format = voxel_format_for(command_.output, command_.format);
  if (!format) return tl::unexpected(format.error());
  if (format->name != first.format && (has_chunks(format->name) || has_chunks(first.format))) {
    return fail(ErrorCode::kUsage, "-o {}: the shards are of format {}, not {}", command_.output,
                first.format, format->name);
  }
  sum_.format = *std::move(format);
  return {};
}

Result<void> Merge::write() {
  if (auto valid = check_format(); !valid) return valid;
  const double start = session_.milliseconds();
  const Execution execution = session_.execution("merging", 1.0);
  const VoxelWriterOptions& file = *shards_.front().outcome.part.file;
  auto written =
      has_chunks(sum_.format->name) ? write_chunks(file, execution) : write_runs(file, execution);
  sum_.write_ms = session_.milliseconds() - start;
  return written;
}

Result<void> Merge::write_chunks(const VoxelWriterOptions& file, const Execution& execution) {
  auto folder = AtomicFolder::create(command_.output);
  if (!folder) return tl::unexpected(folder.error());
  for (std::size_t i = 0; i < shards_.size(); ++i) {
    auto put = put_chunks(shards_[i], folder->temporary_path(), execution);
    if (!put) return put;
    if (execution.progress) {
      execution.progress(static_cast<double>(i + 1) / static_cast<double>(shards_.size()));
    }
  }
  VoxelWriterOptions head = file;
  head.part = VoxelPart{folder->temporary_path(), {}, true};
  auto writer = open_voxel_writer(command_.output, sum_.format->name, sum_.grid, head);
  if (!writer) return tl::unexpected(writer.error());
  if (auto finished = (*writer)->finish(execution); !finished) return finished;
  return folder->commit();
}

Result<void> Merge::write_runs(const VoxelWriterOptions& file, const Execution& execution) {
  constexpr int kRows = 4 * VoxelIntervals::kTileSide;
  Execution quiet = execution;
  quiet.progress = {};
  auto writer = open_voxel_writer(command_.output, sum_.format->name, sum_.grid, file);
  if (!writer) return tl::unexpected(writer.error());
  const int all = sum_.grid.dims[AxisFrame(sum_.axis).v];
  for (const ShardReport& shard : shards_) {
    const auto rows = shard_rows(sum_.grid, sum_.axis, *shard.command.shard);
    if (!rows) return tl::unexpected(rows.error());
    auto runs = RunFileReader::open(shard.path + "/" + kShardRuns, sum_.grid, sum_.axis, *rows,
                                    largest_label(file));
    if (!runs) return tl::unexpected(runs.error());
    std::uint64_t solid = 0;
    for (int v = rows->begin; v < rows->end; v += kRows) {
      const int end = std::min(rows->end, v + kRows);
      const auto slab = runs->read(end);
      if (!slab) return tl::unexpected(slab.error());
      solid += slab->solid_voxels();
      if (auto added = (*writer)->add(*slab, quiet); !added) return added;
      if (execution.progress) execution.progress(static_cast<double>(end) / all);
    }
    if (auto done = runs->finish(); !done) return done;
    // Of filled fractions the report counts those of a half and more.
    if (file.fog == 0 && solid != shard.outcome.report.solid_voxels) {
      return fail(ErrorCode::kInput, "{}: its runs must have {} solid voxels, got {}", shard.path,
                  shard.outcome.report.solid_voxels, solid);
    }
  }
  if (auto finished = (*writer)->finish(quiet); !finished) return finished;
  sum_.output_files = (*writer)->pieces();
  const auto size = [this](const std::string& path) -> std::uint64_t {
    std::error_code ignored;
    const auto bytes = fs::file_size(session_.place_of(path), ignored);
    return ignored ? 0 : bytes;
  };
  if (command_.output == "-") return {};
  std::uint64_t bytes = sum_.output_files.empty() ? size(command_.output) : 0;
  for (const std::string& path : sum_.output_files) bytes += size(path);
  if (bytes > 0) sum_.output_bytes = bytes;
  return {};
}

Result<void> Merge::report() { return print_reports(whole_, sum_, session_, "merge"); }

}  // namespace

Result<void> run_merge(const MergeCommand& command, Session& session) {
  std::vector<ShardReport> shards;
  for (const std::string& path : command.shards) {
    auto shard = read_shard_report(path);
    if (!shard) return tl::unexpected(shard.error());
    shards.push_back(*std::move(shard));
    if (session.interrupted()) return fail(ErrorCode::kCancelled, "stopped");
  }
  if (auto valid = check_shards(shards); !valid) return valid;
  return Merge(command, std::move(shards), session).run();
}

}  // namespace strata::apps
