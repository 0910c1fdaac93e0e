#pragma once

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

namespace strata::testkit {

/// The names of all plain values in a report, as docs/json.md writes them.
inline void collect(const nlohmann::json& value, const std::string& name,
                    std::set<std::string>& names) {
  if (value.is_object()) {
    for (const auto& [key, member] : value.items()) {
      collect(member, name.empty() ? key : name + "." + key, names);
    }
  } else if (value.is_array() && !value.empty() && value[0].is_object()) {
    for (const nlohmann::json& element : value) collect(element, name + "[]", names);
  } else {
    names.insert(name);
  }
}

/// The names in the table under a heading of docs/json.md.
inline std::set<std::string> documented(const std::string& heading) {
  std::ifstream in(STRATA_SOURCE_DIR "/docs/json.md");
  std::set<std::string> names;
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("## ")) inside = line == "## " + heading;
    if (!inside || !line.starts_with("| `")) continue;
    names.insert(line.substr(3, line.find('`', 3) - 3));
  }
  return names;
}

}  // namespace strata::testkit
