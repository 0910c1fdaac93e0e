#include "apps/mpi/rank_part.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include "apps/session/file_conflicts.h"
#include "apps/session/json_writer.h"
#include "apps/session/session.h"
#include "strata/voxelize/area/boundary_area.h"
#include "strata/voxelize/checksum.h"
#include "voxelize/output/file_pair.h"

namespace strata::apps {
namespace {

constexpr const char* kPartsIndex = "index.json";

bool has_folder(std::string_view format) {
  return format == "zarr" || format == "ome.zarr" || format == "vdb";
}

std::string part_name(int rank) { return fmt::format("part-{:04}.vdb", rank); }

/// What only one process of a job knows, as bytes: the checksum's sum, and rows that meet others.
std::string pack(const VoxelizeOutcome& outcome) {
  std::string bytes;
  const auto put = [&](std::uint64_t number) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
  };
  put(outcome.report.checksum_sum);
  for (const BoundaryArea::Seam& seam : outcome.part.seams) {
    put(static_cast<std::uint64_t>(seam.v) * 2 + (seam.first ? 1 : 0));
    put(seam.runs.size());
    for (const BoundaryArea::Seam::Run& run : seam.runs) {
      put(std::uint64_t{run.u} << 32 | std::uint64_t{run.interval.first} << 16 | run.interval.last);
    }
  }
  return bytes;
}

/// Adds what pack() made of another rank.
void unpack(const std::string& bytes, SetChecksum& checksum, BoundaryArea& area) {
  std::size_t at = 0;
  const auto take = [&] {
    std::uint64_t number = 0;
    std::memcpy(&number, bytes.data() + at, sizeof number);
    at += sizeof number;
    return number;
  };
  checksum.add_sum(take());
  std::vector<BoundaryArea::Seam> seams;
  while (at < bytes.size()) {
    const std::uint64_t place = take();
    BoundaryArea::Seam seam{static_cast<int>(place / 2), place % 2 == 1, {}};
    seam.runs.resize(take());
    for (BoundaryArea::Seam::Run& run : seam.runs) {
      const std::uint64_t word = take();
      run = {static_cast<std::uint16_t>(word >> 32),
             {static_cast<std::uint16_t>(word >> 16), static_cast<std::uint16_t>(word)}};
    }
    seams.push_back(std::move(seam));
  }
  area.add({0, 0, 0}, std::move(seams));
}

}  // namespace

Result<void> RankPart::agree(const Result<void>& done) {
  // A rank that is to stop does not wait for others, one of which may be gone.
  if (session_->interrupted() && !session_->timed_out()) peers_->leave();
  if (failed_ && done) return fail(ErrorCode::kCancelled, "another rank failed");
  if (failed_) return done;
  constexpr std::uint64_t kNoMoreRows = std::uint64_t{1} << 40;
  if (!done && passes_ > 0) (void)peers_->take(passes_ - 1, kNoMoreRows);
  const std::uint64_t worst =
      peers_->largest(done ? 0 : static_cast<std::uint64_t>(done.error().code));
  if (worst == 0) return {};
  failed_ = true;
  const auto reasons = peers_->gather(done ? std::string() : done.error().message);
  const auto codes =
      peers_->gather(done ? std::string("0") : std::to_string(static_cast<int>(done.error().code)));
  if (!done) return done;
  for (std::size_t rank = 0; rank < reasons.size(); ++rank) {
    if (codes[rank] == "0") continue;
    return fail(static_cast<ErrorCode>(std::atoi(codes[rank].c_str())), "{} (rank {})",
                reasons[rank], rank);
  }
  return fail(static_cast<ErrorCode>(worst), "another rank failed");
}

Result<void> RankPart::check(const VoxelizeCommand& command, const VoxelizeOutcome& outcome) {
  const auto valid = [&]() -> Result<void> {
    if (command.output.empty()) return {};
    const std::string_view format = outcome.format->name;
    if (!has_folder(format) && format != "npy" && format != "raw") {
      return fail(ErrorCode::kUsage,
                  "-o {}: the ranks of a job write .zarr, .ome.zarr, .npy, .raw, .nhdr and .vdb "
                  "together, not format {}; strata voxelize --shard and strata merge write all",
                  command.output, format);
    }
    if (is_stream(command.output)) {
      return fail(ErrorCode::kUsage, "-o {}: the ranks of a job cannot write one stream together",
                  command.output);
    }
    return check_values(*outcome.format, [&] {
      VoxelWriterOptions options;
      options.fog = command.fog != 0 || command.coverage != 0 ? 1 : 0;
      return options;
    }());
  };
  return agree(valid());
}

/// What all write into, by rank 0.
Result<void> RankPart::create(const VoxelizeCommand& command) {
  if (!first()) return {};
  if (has_folder(format_)) {
    auto folder = AtomicFolder::create(command.output);
    if (!folder) return tl::unexpected(folder.error());
    folder_ = *std::move(folder);
    place_ = folder_->temporary_path();
    return {};
  }
  const bool raw = format_ == "raw";
  auto file =
      AtomicFile::create(raw ? FilePair(command.output, ".nhdr", ".raw").data : command.output);
  if (!file) return tl::unexpected(file.error());
  output_.emplace(*std::move(file));
  place_ = output_->temporary_path();
  return {};
}

Result<std::unique_ptr<VoxelWriter>> RankPart::open_writer(const VoxelizeCommand& command,
                                                           const VoxelizeOutcome& outcome,
                                                           const VoxelWriterOptions& file) {
  format_ = outcome.format->name;
  file_ = file;
  if (auto made = agree(create(command)); !made) return tl::unexpected(made.error());
  place_ = peers_->broadcast(place_);
  VoxelWriterOptions part = file;
  part.part = VoxelPart{place_, {}, false};
  if (format_ == "vdb") {
    return open_voxel_writer(place_ + "/" + part_name(peers_->rank()), format_, outcome.grid, part);
  }
  if (!has_folder(format_)) {
    auto shared = peers_->open(place_);
    if (shared) shared_ = *shared;
    const Result<void> opened = shared ? Result<void>() : tl::unexpected(shared.error());
    if (auto all = agree(opened); !all) return tl::unexpected(all.error());
    part.part =
        VoxelPart{{},
                  [shared = shared_](std::uint64_t offset, const void* data, std::size_t bytes) {
                    return shared.write_at(offset, data, bytes);
                  },
                  first()};
  }
  return open_voxel_writer(command.output, format_, outcome.grid, part);
}

Result<void> RankPart::begin_pass(const VoxelizeOutcome& outcome, VoxelizeOptions& options) {
  // Hours of work are not begun if one of the ranks cannot.
  if (auto all = agree({}); !all) return all;
  constexpr int kSide = VoxelIntervals::kTileSide;
  const int rows = outcome.grid.dims[AxisFrame(outcome.axis).v];
  const int tiles = (rows + kSide - 1) / kSide;
  // Small enough that all end at about the same time, and few enough to keep counters and seams
  // cheap.
  constexpr int kTurnsARank = 16;
  const int turn = std::max(1, tiles / (kTurnsARank * peers_->size()));
  const int pass = passes_++;
  options.next_rows = [=, this]() -> std::optional<VoxelRows> {
    const std::uint64_t begin = peers_->take(pass, static_cast<std::uint64_t>(turn));
    if (begin >= static_cast<std::uint64_t>(tiles)) return std::nullopt;
    turns_ += static_cast<std::uint64_t>(turn);
    const int first_tile = static_cast<int>(begin);
    return VoxelRows{first_tile * kSide, std::min(rows, (first_tile + turn) * kSide)};
  };
  return {};
}

Result<void> RankPart::end_pass(VoxelizeOutcome& outcome, const Result<void>& done) {
  if (auto all = agree(done); !all) return all;
  if (passes_ == 1) return add_up(outcome);
  const auto steps = peers_->sum({outcome.part.filled_steps});
  if (first()) outcome.part.filled_steps = steps[0];
  return {};
}

Result<void> RankPart::add_up(VoxelizeOutcome& outcome) {
  std::vector<std::uint64_t> numbers;
  visit_sums(outcome, [&](std::uint64_t& number) { numbers.push_back(number); });
  const auto sums = peers_->sum(numbers);
  outcome.report.max_depth_complexity = peers_->largest(outcome.report.max_depth_complexity);
  const auto parts = peers_->gather(pack(outcome));
  if (!first()) return {};
  std::size_t next = 0;
  visit_sums(outcome, [&](std::uint64_t& number) { number = sums[next++]; });
  SetChecksum checksum(outcome.grid);
  BoundaryArea area(outcome.grid, outcome.axis);
  for (const std::string& part : parts) unpack(part, checksum, area);
  area.add(outcome.part.faces, {});
  outcome.report.checksum = checksum.value();
  outcome.area_estimate = area.estimate();
  return {};
}

/// What is written once, and the name; by rank 0.
Result<void> RankPart::complete(const VoxelizeCommand& command, VoxelizeOutcome& outcome) {
  if (output_) {
    outcome.output_bytes = std::filesystem::file_size(output_->temporary_path());
    return output_->commit();
  }
  if (!folder_) return {};
  if (format_ != "vdb") {
    VoxelWriterOptions head = file_;
    head.part = VoxelPart{place_, {}, true};
    auto writer = open_voxel_writer(command.output, format_, outcome.grid, head);
    if (!writer) return tl::unexpected(writer.error());
    if (auto done = (*writer)->finish({}); !done) return done;
    return folder_->commit();
  }
  JsonWriter json;
  json.begin_object();
  json.member("dims", outcome.grid.dims);
  json.member("origin", outcome.grid.origin);
  json.member("voxel_size", outcome.grid.voxel_size);
  json.member("solid", outcome.report.solid_voxels);
  json.member("checksum", fmt::format("{:016x}", outcome.report.checksum));
  json.key("files").begin_array();
  for (int rank = 0; rank < peers_->size(); ++rank) json.value(part_name(rank));
  json.end_array();
  json.end_object();
  if (auto told = print_report(json.take(), place_ + "/" + kPartsIndex, false); !told) return told;
  return folder_->commit();
}

Result<void> RankPart::finish(const VoxelizeCommand& command, VoxelizeOutcome& outcome,
                              Session& session, const Result<void>& done) {
  // The parts of a .vdb get their names in the folder before it gets its own.
  const bool own_file = format_ == "vdb" && !command.output.empty();
  const Result<void> there = done && own_file && !first() ? session.commit_outputs() : done;
  if (auto all = agree(there); !all) return all;
  if (auto all = agree(shared_.close()); !all) return all;
  return first() ? complete(command, outcome) : Result<void>();
}

}  // namespace strata::apps
