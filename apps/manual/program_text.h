#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "apps/session/help.h"

// What a manual page and a completion say of a program, or of a command of `strata`.

namespace strata::manual {

struct Section {
  std::string heading;
  std::string text;  ///< lines as they are to be printed
};

struct ProgramText {
  std::string name;   ///< "strata csg"; the page is strata-csg.1
  std::string usage;  ///< "strata csg [OPTIONS] INPUT..."
  std::string what;   ///< one sentence without a full stop
  std::vector<std::string> paragraphs;
  std::string examples;
  std::vector<apps::OptionGroup> options;
  std::vector<Section> more;
};

/// What CLI11 knows of a program; its description begins with a sentence, indented blocks are
/// examples, and those of its footer below a heading are sections of their own.
[[nodiscard]] ProgramText program_text(const CLI::App& app);

/// The page, in the macros of man(7).
[[nodiscard]] std::string man_page(const ProgramText& program,
                                   const std::vector<std::string>& see_also);

/// Values that an option's placeholder stands for.
struct NamedValues {
  std::string_view placeholder;  ///< "FORMAT"
  std::vector<std::string> values;
};

struct Completion {
  const std::vector<ProgramText>& programs;  ///< the first is strata itself
  std::vector<NamedValues> values;
};

[[nodiscard]] std::string bash_completion(const Completion& completion);
[[nodiscard]] std::string zsh_completion(const Completion& completion);
[[nodiscard]] std::string fish_completion(const Completion& completion);

}  // namespace strata::manual
