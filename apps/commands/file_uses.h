#pragma once

#include <vector>

#include "apps/commands/commands.h"
#include "apps/session/file_conflicts.h"

namespace strata::apps {

/// What a command reads: its inputs, and the parameters of programs.
[[nodiscard]] std::vector<FileUse> inputs_of(const csg::SceneInput& input);
template <class AnyCommand>
[[nodiscard]] std::vector<FileUse> inputs_of(const AnyCommand& command) {
  return inputs_of(command.input);
}
[[nodiscard]] std::vector<FileUse> inputs_of(const CsgCommand& command);
[[nodiscard]] std::vector<FileUse> inputs_of(const OitCommand& command);
[[nodiscard]] std::vector<FileUse> inputs_of(const VoxelizeCommand& command);
[[nodiscard]] std::vector<FileUse> inputs_of(const MergeCommand& command);

/// Holds what a command reads against the folders of shards, which strata merge alone reads.
/// @return kInput naming the folder
Result<void> check_no_shard(const std::vector<FileUse>& read);

/// What a command writes.
[[nodiscard]] std::vector<FileUse> outputs_of(const VoxelizeCommand& command);
[[nodiscard]] std::vector<FileUse> outputs_of(const MergeCommand& command);
[[nodiscard]] std::vector<FileUse> outputs_of(const MeshCommand& command);
[[nodiscard]] std::vector<FileUse> outputs_of(const InfoCommand& command);
[[nodiscard]] std::vector<FileUse> outputs_of(const LdiCommand& command);
[[nodiscard]] std::vector<FileUse> outputs_of(const CsgCommand& command);
[[nodiscard]] std::vector<FileUse> outputs_of(const OitCommand& command);

}  // namespace strata::apps
