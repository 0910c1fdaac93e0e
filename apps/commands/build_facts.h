#pragma once

#include <span>
#include <string_view>
#include <utility>

namespace strata::apps {

/// What CMake knew when it was run last.
struct BuildFacts {
  std::string_view commit;      ///< empty: the sources are no git checkout
  bool modified;                ///< files differ from the commit
  std::string_view build_type;  ///< empty: none was chosen
  std::string_view compiler, compiler_version, system, processor;
  std::span<const std::pair<std::string_view, bool>>
      options;  ///< optional parts: whether each is in
  std::span<const std::pair<std::string_view, std::string_view>> libraries;  ///< with versions
};

extern const BuildFacts kBuildFacts;

}  // namespace strata::apps
