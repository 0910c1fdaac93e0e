#pragma once

#include <map>
#include <string>
#include <vector>

#include "apps/view/files/customizer.h"
#include "strata/core/result.h"

// Sets of parameters in a file of OpenSCAD's form: {"parameterSets": {"tall": {"height": "80"}},
// "fileFormatVersion": "1"}.

namespace strata::view {

/// Each set by its name: the text of each value by the parameter's name.
using ParameterSets = std::map<std::string, std::map<std::string, std::string>>;

/// Reads a file of sets. @return kInput naming the file and what is wrong; kUsage in a build
/// without nlohmann/json
Result<ParameterSets> read_parameter_sets(const std::string& path);

/// Adds a set to the file, or replaces the one of that name; other members of the file stay. Makes
/// the file where there is none. @return kInput: the file is there and is none; kOutput
Result<void> write_parameter_set(const std::string& path, const std::string& name,
                                 const std::vector<Parameter>& parameters,
                                 const ParameterValues& values);

/// The values of a set for these parameters; what the set does not have stays as the program sets
/// it. @return kInput naming the set and what it holds
Result<ParameterValues> values_of_set(const ParameterSets& sets, const std::string& name,
                                      const std::vector<Parameter>& parameters);

/// The file that OpenSCAD keeps the sets of a program in: `part.json` for `part.scad`.
[[nodiscard]] std::string parameter_file_of(const std::string& program);

}  // namespace strata::view
