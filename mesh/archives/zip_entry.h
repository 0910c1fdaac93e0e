#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"

namespace strata {

/// A zip archive opened for reading.
class ZipArchive {
 public:
  /// @return kInput: not a zip archive; kUsage: a build without libzip
  static Result<ZipArchive> open(const std::string& path);

  [[nodiscard]] const std::string& path() const { return path_; }
  /// The names of all files and folders, in the order of the archive. Names of folders end in '/'.
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  /// The name of a file as the archive spells it. The look-up ignores ASCII case and a leading '/',
  /// and takes "%20" for a blank, as packages do (ISO/IEC 29500-2).
  [[nodiscard]] std::optional<std::string> find(std::string_view name) const;
  /// Unpacks a file of `names()`. @return kInput: damaged; kLimit: more than 2 GiB unpacked, or
  /// more than the memory limit; kCancelled
  [[nodiscard]] Result<std::string> read(const std::string& name, const Execution& execution) const;

 private:
  std::string path_;
  std::vector<std::string> names_;
  std::shared_ptr<void> archive_;
};

}  // namespace strata
