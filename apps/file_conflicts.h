#pragma once

#include <string>
#include <vector>

#include "apps/commands.h"
#include "core/result.h"

namespace strata::apps {

/// A file that is to be read or written, and how the user asked for that: "--ids".
struct FileUse {
  std::string asked_by;
  std::string path;
};

/// Whether bytes for this name go to a pipe, a device or an open file: "-", /dev/stdout, /dev/null.
[[nodiscard]] bool is_stream(const std::string& path);

/// What a command reads: its inputs.
[[nodiscard]] std::vector<FileUse> inputs_of(const InputOptions& input);

/// The files that scenes among the inputs name; none where no output exists yet, for then nothing
/// can be lost.
[[nodiscard]] std::vector<FileUse> scene_files_of(const CsgCommand& command,
                                                  const std::vector<FileUse>& written);

/// Looks, before any work is done, whether a file would be written that is read too, or that is
/// written twice: by whatever names, links followed. Streams may carry several things.
/// @return kUsage naming the two and the file
Result<void> check_files(const std::vector<FileUse>& read, const std::vector<FileUse>& written);

/// The same of a command.
Result<void> check_files(const VoxelizeCommand& command);
Result<void> check_files(const InfoCommand& command);
Result<void> check_files(const LdiCommand& command);
Result<void> check_files(const CsgCommand& command);

}  // namespace strata::apps
