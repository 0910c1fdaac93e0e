#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "strata/core/result.h"

// The parameters of a .scad program as OpenSCAD's customizer finds them: from its text alone.

namespace strata::view {

using ParameterValue = std::variant<bool, double, std::string, std::vector<double>>;

/// One variable that a user may set.
struct Parameter {
  struct Choice {
    ParameterValue value;
    std::string label;
  };
  std::string name;         ///< of the variable
  std::string tab;          ///< from `/* [Tab] */`; "Parameters" before the first one
  std::string description;  ///< the comment in the line above
  int line = 0;
  ParameterValue value;               ///< as the program sets it; also says the type
  std::optional<double> least, most;  ///< of a number, or of each number of a vector
  std::optional<double> step;         ///< between numbers
  std::size_t longest = 0;            ///< bytes of a text; 0: any
  std::vector<Choice> choices;        ///< not empty: one of these
};

/// Finds the parameters: assignments of literals (numbers, booleans, text, vectors of up to four
/// numbers) at the top level, before the line of the first `{`, without those of the tab Hidden. A
/// name that is set twice has its last value.
[[nodiscard]] std::vector<Parameter> parse_parameters(std::string_view program);

/// Reads the value of a parameter from text as parameter sets have it: `12.5`, `true`, `[1, 2]`,
/// or text without quotes. @return kUsage naming the parameter and the text
Result<ParameterValue> parse_value(const Parameter& parameter, std::string_view text);

/// Reads a literal of OpenSCAD's language, as -D has it. Empty: it is none that a parameter has.
[[nodiscard]] std::optional<ParameterValue> parse_literal(std::string_view text);

/// The value as parameter sets have it.
[[nodiscard]] std::string text_of(const ParameterValue& value);

/// The value as a literal of OpenSCAD's language, for -D.
[[nodiscard]] std::string literal_of(const ParameterValue& value);

/// Values by the parameter's name.
using ParameterValues = std::map<std::string, ParameterValue>;

/// Options of openscad that set the values.
[[nodiscard]] std::vector<std::string> definitions_of(const ParameterValues& values);

}  // namespace strata::view
