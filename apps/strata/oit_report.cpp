#include "apps/strata/oit_report.h"

#include "apps/session/report.h"
#include "apps/strata/csg_report.h"

namespace strata::apps {
namespace {

using transparency::Technique;

/// "slots, 1 to 64 (default: 8)"; empty: the technique takes no number.
std::string number_of(const Technique& technique) {
  if (technique.k_means.empty()) return {};
  return fmt::format("{}, {} to {} (default: {})", technique.k_means, technique.least_k,
                     technique.most_k,
                     technique.default_k == 0 ? "no limit" : std::to_string(technique.default_k));
}

void write_technique(JsonWriter& json, const Technique& technique) {
  json.member("title", technique.title);
  json.member("paper", technique.paper);
  json.member("accuracy", accuracy_word(technique.accuracy));
  json.member("memory", technique.memory);
  json.member("fails", technique.fails);
}

void write_costs(JsonWriter& json, const transparency::Costs& costs) {
  json.key("costs").begin_object();
  json.member("geometry_passes", costs.geometry_passes);
  json.member("fragments", costs.fragments);
  json.member("rasterized", costs.rasterized);
  json.member("shaded", costs.shaded);
  json.member("stored", costs.stored);
  json.member("kept", costs.kept);
  json.member("lost", costs.lost);
  json.member("merged", costs.merged);
  json.member("comparisons", costs.comparisons);
  json.member("queries", costs.queries);
  json.member("most_layers", costs.most_layers);
  json.member("formula_bytes", costs.formula_bytes);
  json.member("allocated_bytes", costs.allocated_bytes);
  json.end_object();
}

void write_result(JsonWriter& json, const OitResult& result) {
  const auto& [technique, settings] = result.choice->chosen;
  json.begin_object();
  json.member("name", technique->name);
  json.key("k");
  settings.k == 0 || technique->k_means.empty() ? json.null() : json.value(settings.k);
  json.key("variant");
  settings.variant.empty() ? json.null() : json.value(settings.variant);
  write_technique(json, *technique);
  json.key("left_out");
  result.left_out.empty() ? json.null() : json.value(result.left_out);
  if (result.left_out.empty()) {
    json.key("path");
    result.path.empty() ? json.null() : json.value(result.path);
    write_costs(json, result.costs);
    json.key("difference").begin_object();
    json.member("psnr", result.difference.psnr);
    json.member("largest", result.difference.largest);
    json.member("pixels", result.difference.pixels);
    json.end_object();
    json.member("milliseconds", 1000 * result.seconds);
    json.member("technique_milliseconds", 1000 * result.technique_seconds);
  }
  json.end_object();
}

void write_media(JsonWriter& json, const OitOutcome& outcome) {
  json.key("media").begin_array();
  for (const transparency::SolidReport& solid : outcome.media) {
    json.begin_object();
    json.member("object", solid.object);
    json.member("pixels", solid.pixels);
    json.member("unbalanced_pixels", solid.unbalanced_pixels);
    json.end_object();
  }
  json.end_array();
}

}  // namespace

std::string_view accuracy_word(transparency::Accuracy accuracy) {
  switch (accuracy) {
    case transparency::Accuracy::kExact:
      return "exact";
    case transparency::Accuracy::kBounded:
      return "bounded";
    case transparency::Accuracy::kRandom:
      break;
  }
  return "random";
}

std::string list_text() {
  constexpr std::size_t kIndent = 22;
  std::string text;
  for (const Technique* technique : transparency::techniques()) {
    text += fmt::format("{:<{}}{:<10}{}\n", technique->name, kIndent,
                        accuracy_word(technique->accuracy), technique->title);
    const auto line = [&](std::string_view topic, std::string_view rest) {
      if (!rest.empty()) text += fmt::format("{:{}}{:<10}{}\n", "", kIndent, topic, rest);
    };
    line("number", number_of(*technique));
    line("variants", technique->variants);
    if (technique->needs_triangles) line("needs", "triangles: meshes without --expr and --cut");
    line("memory", technique->memory);
    line("fails", technique->fails);
    line("paper", technique->paper);
  }
  return text;
}

std::string list_json() {
  JsonWriter json;
  begin_report(json, "oit");
  json.key("list").begin_array();
  for (const Technique* technique : transparency::techniques()) {
    json.begin_object();
    json.member("name", technique->name);
    write_technique(json, *technique);
    json.key("number");
    technique->k_means.empty() ? json.null() : json.value(technique->k_means);
    json.member("least", technique->least_k);
    json.member("most", technique->most_k);
    json.member("default", technique->default_k);
    json.member("variants", technique->variants);
    json.member("needs_triangles", technique->needs_triangles);
    json.end_object();
  }
  json.end_array();
  json.end_object();
  return json.take();
}

std::string oit_json(const OitCommand& command, const OitOutcome& outcome, const Session& session) {
  JsonWriter json;
  begin_report(json, "oit");
  json.key("scene").begin_object();
  json.member("objects", outcome.objects);
  json.member("triangles", outcome.triangles);
  json.member("opacity", static_cast<double>(outcome.opacity));
  json.end_object();
  write_camera(json, outcome.camera);
  json.key("picture").begin_object();
  json.member("width", command.size.x);
  json.member("height", command.size.y);
  json.member("samples", command.picture.samples);
  json.end_object();
  if (!command.media.empty()) write_media(json, outcome);
  json.key("reference");
  outcome.reference == nullptr ? json.null() : json.value(outcome.reference->name);
  json.member("runs", outcome.runs);
  json.key("techniques").begin_array();
  for (const OitResult& result : outcome.results) write_result(json, result);
  json.end_array();
  write_timings(json, session,
                {{"read", outcome.read_ms},
                 {"prepare", outcome.prepare_ms},
                 {"draw", outcome.draw_ms},
                 {"write", outcome.write_ms}});
  write_memory(json);
  write_warnings(json, session);
  json.end_object();
  return json.take();
}

}  // namespace strata::apps
