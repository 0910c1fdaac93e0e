#pragma once

#include <string>
#include <vector>

#include "strata/core/file_identity.h"
#include "strata/core/result.h"

namespace strata::apps {

/// A file that is to be read or written, and how the user asked for that: "--ids".
struct FileUse {
  std::string asked_by;
  std::string path;
};

/// Whether bytes for this name go to a pipe, a device or an open file: "-", /dev/stdout, /dev/null.
[[nodiscard]] bool is_stream(const std::string& path);

/// Looks, before any work is done, whether a file would be written that is read too, that lies in a
/// folder that is read, or that is written twice: by whatever names, links followed. Streams may
/// carry several things.
/// @return kUsage naming the two and the file
Result<void> check_files(const std::vector<FileUse>& read, const std::vector<FileUse>& written);

/// The same of a file of a scene that has been opened, whatever name it was asked for by.
Result<void> check_opened(const FileIdentity& opened, const std::vector<FileUse>& written);

}  // namespace strata::apps
