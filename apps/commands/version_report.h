#pragma once

#include <string>

namespace strata::apps {

/// The report of `strata --version --json`: commit, compiler, optional parts, libraries.
[[nodiscard]] std::string version_report();

}  // namespace strata::apps
