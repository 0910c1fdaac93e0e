#pragma once

#include "apps/voxelize/job_part.h"
#include "core/atomic_file.h"

namespace strata::apps {

/// The rows of shard i of N: as many tiles as those of any other, or one more.
/// @return kUsage if there are more shards than rows of tiles
Result<VoxelRows> shard_rows(const VoxelGrid& grid, Axis axis, const Shard& shard);

/// A number that tells inputs apart: of the triangles, and of the tree.
[[nodiscard]] std::uint64_t input_hash(const csg::SolidInput& input);

/// Names in the folder of a shard, besides kShardReport.
inline constexpr const char* kShardRuns = "runs";      ///< its voxels, as RunFileReader
inline constexpr const char* kShardChunks = "chunks";  ///< or its chunks, as they will lie
/// Whether shards of this format hold chunks.
[[nodiscard]] bool has_chunks(std::string_view format);

/// `--shard i/N`: some rows of the grid, in a folder of their own or in a report alone.
class ShardPart final : public JobPart {
 public:
  explicit ShardPart(const Shard& shard) : shard_(shard) {}

  Result<void> check(const VoxelizeCommand& command, const VoxelizeOutcome& outcome) override;
  Result<std::unique_ptr<VoxelWriter>> open_writer(const VoxelizeCommand& command,
                                                   const VoxelizeOutcome& outcome,
                                                   const VoxelWriterOptions& file) override;
  Result<void> begin_pass(const VoxelizeOutcome& outcome, VoxelizeOptions& options) override;
  Result<void> end_pass(VoxelizeOutcome& outcome, const Result<void>& done) override;
  Result<void> finish(const VoxelizeCommand& command, VoxelizeOutcome& outcome, Session& session,
                      const Result<void>& done) override;
  [[nodiscard]] bool finds_walls() const override { return shard_.index == 1; }
  [[nodiscard]] bool tells_all() const override { return false; }
  [[nodiscard]] bool reports() const override { return true; }

 private:
  Shard shard_;
  VoxelRows rows_;
  std::optional<AtomicFolder> folder_;
};

}  // namespace strata::apps
