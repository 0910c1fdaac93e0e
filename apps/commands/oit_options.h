#pragma once

#include <string>
#include <vector>

#include "apps/commands/commands.h"
#include "strata/core/result.h"

namespace strata::apps {

/// The options of `strata oit` alone as words. Empty: not given.
struct OitWords {
  std::vector<std::string> techniques;
  std::string opacity, seed, load, threshold, report, media, light;
  bool fxaa = false, list = false;
};

/// Reads the words into `command`, whose common part, inputs, output, report and picture are set.
/// @return kUsage
Result<void> read_oit_options(const OitWords& words, OitCommand& command);

/// Where the picture of a technique goes: -o of a single one; out-NAME.png for -o out.png, NAME.png
/// in the folder of -o folder/. Empty: nowhere.
[[nodiscard]] std::string picture_of(const OitCommand& command, const OitChoice& choice);

/// Whether -o is a folder, by the slash at its end.
[[nodiscard]] bool writes_folder(const OitCommand& command);

}  // namespace strata::apps
