#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/session/json_writer.h"
#include "apps/voxelize/voxelize_report.h"

namespace strata::apps {

/// "shard": what merging needs beyond the report's other members. @pre command.shard
void write_shard(JsonWriter& json, const VoxelizeCommand& command, const VoxelizeOutcome& outcome);

/// A shard as its report tells of it. The outcome has no triangles, and no solids.
struct ShardReport {
  struct SolidVoxels {
    std::uint32_t solid;
    std::string name;
    std::uint64_t voxels;
  };
  std::string path;  ///< as it was given
  VoxelizeCommand command;
  VoxelizeOutcome outcome;
  std::vector<SolidVoxels> ids;  ///< ascending; solids without voxels are left out
  std::vector<Warning> warnings;
  std::string format;  ///< name of the format of the whole; empty: there are no voxels
};

/// Reads it. @param path  of a shard's folder, or of a report
/// @return kInput naming the file, and what is missing in it
Result<ShardReport> read_shard_report(const std::string& path);

/// Adds what other shards of the same job found to `sum`.
void add_shard(const VoxelizeOutcome& part, VoxelizeOutcome& sum);
/// Makes of the sums what a report tells: checksum, area, solids.
/// @return kLimit if the solids take more bytes than `memory_limit`
Result<void> finish_sum(const std::vector<ShardReport>& shards, std::uint64_t memory_limit,
                        VoxelizeOutcome& sum);

/// How two shards of different jobs differ, as a clause: "it is of another mesh". Empty: they are
/// of one job.
[[nodiscard]] std::string difference(const ShardReport& a, const ShardReport& b);

}  // namespace strata::apps
