#include "apps/commands/version_report.h"

#include "apps/commands/build_facts.h"
#include "apps/session/json_writer.h"

namespace strata::apps {
namespace {

/// A text that CMake may not have found.
void write_known(JsonWriter& json, std::string_view name, std::string_view text) {
  json.key(name);
  text.empty() ? json.null() : json.value(text);
}

}  // namespace

std::string version_report() {
  JsonWriter json;
  json.begin_object();
  json.member("strata", STRATA_VERSION);
  json.member("command", "version");
  write_known(json, "commit", kBuildFacts.commit);
  json.key("modified");
  kBuildFacts.commit.empty() ? json.null() : json.value(kBuildFacts.modified);
  write_known(json, "build_type", kBuildFacts.build_type);
  json.key("compiler").begin_object();
  json.member("name", kBuildFacts.compiler);
  json.member("version", kBuildFacts.compiler_version);
  json.end_object();
  json.key("target").begin_object();
  json.member("system", kBuildFacts.system);
  json.member("processor", kBuildFacts.processor);
  json.end_object();
  json.key("options").begin_object();
  for (const auto& [name, is_in] : kBuildFacts.options) json.member(name, is_in);
  json.end_object();
  json.key("libraries").begin_object();
  for (const auto& [name, version] : kBuildFacts.libraries) write_known(json, name, version);
  json.end_object();
  json.end_object();
  return json.take();
}

}  // namespace strata::apps
