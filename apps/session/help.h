#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

// What CLI11 knows of a command's options, as text: for --help and for the manual.

namespace strata::apps {

/// Heading of the options that openscad has as well.
inline constexpr const char* kOpenscadGroup = "OpenSCAD's options";
/// Heading of the options that --help leaves out and --help-all shows.
inline constexpr const char* kDeveloperGroup = "For developers (the result is the same)";

/// Text to print and an exit code: help, version, mistakes in the command line.
struct ParseOutcome {
  std::string text;
  bool to_stderr = false;
  int exit_code = 0;
};

struct OptionText {
  std::vector<std::string> names;  ///< "-j", "--threads"; of the inputs "INPUT"
  std::string value;               ///< "N", "cpu|gl|auto", "[=FILE]"; empty: the option is a flag
  std::string what;                ///< a sentence without a full stop
};

struct OptionGroup {
  std::string heading;
  std::vector<OptionText> options;
};

/// The options by heading, as they were defined; -h comes last. A second long name of an option is
/// an entry of its own among OpenSCAD's.
/// @param all false: without the developers' options
[[nodiscard]] std::vector<OptionGroup> option_groups(const CLI::App& app, bool all);

/// `-j, --threads N`
[[nodiscard]] std::string option_label(const OptionText& option);

/// `strata csg [OPTIONS] INPUT...`
[[nodiscard]] std::string usage_line(const CLI::App& app);

/// Description, usage, options and footer, in 80 columns where options allow it.
[[nodiscard]] std::string help_text(const CLI::App& app, bool all);

/// Defines -h, --help and --help-all in place of CLI11's.
void define_help(CLI::App& app);

/// A mistake that CLI11 found in the command line, as a sentence without a full stop.
[[nodiscard]] std::string parse_mistake(const CLI::App& app, const CLI::ParseError& error);

struct ExitCode {
  int code;
  const char* what;
};
inline constexpr ExitCode kExitCodes[] = {
    {0, "success"},
    {1, "internal error"},
    {2, "wrong or contradictory options"},
    {3, "input file unreadable or malformed"},
    {4, "output not writable"},
    {5, "geometry refused: --strict, --open fail, no extent, coordinates too large"},
    {6, "limit exceeded: memory, size of the grid, --time-limit"},
    {7, "two results that should agree differ"},
    {130, "interrupted"},
    {141, "the reader of standard output went away: nothing is said"}};

/// The values of a choice as they stand behind its option: `winding|nonzero|parity`.
template <class T, std::size_t n>
[[nodiscard]] std::string choices(const std::pair<std::string_view, T> (&words)[n]) {
  std::string text;
  for (const auto& [word, value] : words) text += (text.empty() ? "" : "|") + std::string(word);
  return text;
}

}  // namespace strata::apps
