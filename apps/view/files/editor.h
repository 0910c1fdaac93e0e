#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/result.h"

// A person's editor, which opens a scene at a line.

namespace strata::view {

/// A place in a file.
struct TextPlace {
  std::string file;
  int line = 0;  ///< from 1
  friend bool operator==(const TextPlace&, const TextPlace&) = default;
};

/// The place that a message begins with, `plate.csg:12:3: text`, or that a solid's name ends with,
/// `cube at plate.csg:12:3`. In what openscad has evaluated, lines are not those of the program:
/// the line is 1.
[[nodiscard]] std::optional<TextPlace> place_in(std::string_view text);

/// The words of a command: separated by blanks, in single or double quotes where they hold some.
/// @return kUsage: a quote is not closed, or there is no word
Result<std::vector<std::string>> split_command(std::string_view command);

/// The command of --editor; else $VISUAL or $EDITOR, whichever opens a window of its own. Empty:
/// none.
[[nodiscard]] std::string editor_command(const std::string& given, const char* visual,
                                         const char* editor);

/// The words that open a place: %f becomes the file, %l the line, %% a percent sign. A command
/// without %f gets the words that its editor takes for a line, else the file alone.
/// @return as split_command()
Result<std::vector<std::string>> editor_words(const std::string& command, const TextPlace& place);

/// Starts a program in a session of its own, without a shell, and does not wait for it.
/// @return kUsage naming the program and the system's reason
Result<void> start_program(const std::vector<std::string>& words);

}  // namespace strata::view
