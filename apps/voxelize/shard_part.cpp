#include "apps/voxelize/shard_part.h"

#include <sys/stat.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <span>
#include <system_error>
#include <utility>

#include "apps/session/session.h"
#include "core/split_mix.h"
#include "strata/csg/tree.h"
#include "voxelize/output/run_file.h"

namespace strata::apps {
namespace {

/// Sum of words in their order.
class WordHash {
 public:
  void add(std::uint64_t word) { hash_ = split_mix(hash_ ^ word); }
  void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
  [[nodiscard]] std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0;
};

std::uint64_t bytes_in(const std::string& folder) {
  std::uint64_t bytes = 0;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder, ignored)) {
    if (entry.is_regular_file(ignored)) bytes += entry.file_size(ignored);
  }
  return bytes;
}

}  // namespace

bool has_chunks(std::string_view format) { return format == "zarr" || format == "ome.zarr"; }

Result<VoxelRows> shard_rows(const VoxelGrid& grid, Axis axis, const Shard& shard) {
  constexpr int kSide = VoxelIntervals::kTileSide;
  const int rows = grid.dims[AxisFrame(axis).v];
  const int tiles = (rows + kSide - 1) / kSide;
  if (shard.count > tiles) {
    return fail(
        ErrorCode::kUsage,
        "--shard {}/{}: a shard has {} rows of voxels or more, and the grid of {} x {} x {} "
        "has {} along {}: it makes {}; {} shards need {} rows, by a "
        "higher -r or smaller voxels",
        shard.index, shard.count, kSide, grid.dims.x, grid.dims.y, grid.dims.z, rows,
        "xyz"[AxisFrame(axis).v],
        tiles == 1 ? std::string("1 shard, which needs no --shard")
                   : fmt::format("at most {} shards", tiles),
        shard.count, (shard.count - 1) * kSide + 1);
  }
  const int begin = tiles * (shard.index - 1) / shard.count,
            end = tiles * shard.index / shard.count;
  return VoxelRows{begin * kSide, std::min(end * kSide, rows)};
}

std::uint64_t input_hash(const csg::SolidInput& input) {
  WordHash hash;
  for (const glm::dvec3& p : input.soup.positions) hash.add(p.x), hash.add(p.y), hash.add(p.z);
  for (const glm::uvec3& t : input.soup.triangles) {
    hash.add((std::uint64_t{t.x} << 32) ^ t.y), hash.add(std::uint64_t{t.z});
  }
  if (!input.scene) return hash.value();
  const csg::Tree& tree = *input.scene;
  hash.add(std::uint64_t{tree.root()});
  for (csg::Tree::NodeId node = 0; node < tree.nodes().size(); ++node) {
    hash.add(static_cast<std::uint64_t>(tree.nodes()[node].operation));
    if (tree.nodes()[node].operation == csg::Operation::kSolid) {
      hash.add(std::uint64_t{tree.nodes()[node].first});
      continue;
    }
    for (const csg::Tree::NodeId operand : tree.operands(node)) hash.add(std::uint64_t{operand});
  }
  for (const csg::Solid& solid : tree.solids()) {
    hash.add(static_cast<std::uint64_t>(solid.rule));
    for (int i = 0; solid.colour && i < 4; ++i) hash.add(double{(*solid.colour)[i]});
  }
  return hash.value();
}

Result<void> ShardPart::check(const VoxelizeCommand&, const VoxelizeOutcome& outcome) {
  auto rows = shard_rows(outcome.grid, outcome.axis, shard_);
  if (!rows) return tl::unexpected(rows.error());
  rows_ = *rows;
  return {};
}

Result<std::unique_ptr<VoxelWriter>> ShardPart::open_writer(const VoxelizeCommand& command,
                                                            const VoxelizeOutcome& outcome,
                                                            const VoxelWriterOptions& file) {
  if (auto held = check_values(*outcome.format, file); !held) return tl::unexpected(held.error());
  auto folder = AtomicFolder::create(shard_path(command.output, shard_));
  if (!folder) return tl::unexpected(folder.error());
  folder_ = *std::move(folder);
  const std::string inside = folder_->temporary_path() + "/";
  if (!has_chunks(outcome.format->name)) {
    return open_run_writer(inside + kShardRuns, outcome.grid, outcome.axis);
  }
  VoxelWriterOptions part = file;
  part.part = VoxelPart{inside + kShardChunks, {}, false};
  if (mkdir(part.part->folder.c_str(), 0777) != 0) {
    return fail(ErrorCode::kOutput, "{}: cannot write: {}", folder_->path(), std::strerror(errno));
  }
  return open_voxel_writer(command.output, outcome.format->name, outcome.grid, part);
}

Result<void> ShardPart::begin_pass(const VoxelizeOutcome&, VoxelizeOptions& options) {
  options.rows = rows_;
  return {};
}

Result<void> ShardPart::end_pass(VoxelizeOutcome&, const Result<void>& done) { return done; }

Result<void> ShardPart::finish(const VoxelizeCommand& command, VoxelizeOutcome& outcome,
                               Session& session, const Result<void>& done) {
  if (!done) return done;
  outcome.part.input_hash = input_hash(outcome.input);
  if (!folder_) return {};
  const std::string place = folder_->temporary_path();
  // Those of the outputs that are not committed yet lie under temporary names.
  if (auto there = session.commit_outputs(); !there) return there;
  outcome.output_bytes = bytes_in(place);
  outcome.output_files = {folder_->path()};
  auto told =
      print_report(voxelize_json(command, outcome, session), place + "/" + kShardReport, false);
  if (!told) return told;
  if (auto there = session.commit_outputs(); !there) return there;
  return folder_->commit();
}

}  // namespace strata::apps
