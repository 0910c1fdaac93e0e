#include "apps/session/report.h"

#include "apps/session/process_memory.h"

namespace strata::apps {

std::string triple(const glm::dvec3& v) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x + 0.0, v.y + 0.0, v.z + 0.0);  // no -0
}

void begin_report(JsonWriter& json, std::string_view command) {
  json.begin_object();
  json.member("strata", STRATA_VERSION);
  json.member("command", command);
}

void write_timings(JsonWriter& json, const Session& session,
                   std::initializer_list<std::pair<std::string_view, double>> phases) {
  json.key("timings_ms").begin_object();
  for (const auto& [phase, milliseconds] : phases) json.member(phase, milliseconds);
  json.member("total", session.milliseconds());
  json.end_object();
}

void write_memory(JsonWriter& json,
                  std::initializer_list<std::pair<std::string_view, std::uint64_t>> more) {
  json.key("memory").begin_object();
  json.member("peak_bytes", peak_memory_bytes());
  for (const auto& [name, bytes] : more) json.member(name, bytes);
  json.end_object();
}

void write_length(JsonWriter& json, std::string_view name, double metres) {
  json.key(name);
  metres > 0.0 ? json.value(metres) : json.null();
}

void write_unit(JsonWriter& json, double file_metres, double world_metres, double factor,
                const std::string& doubt) {
  json.key("unit").begin_object();
  write_length(json, "file_metres", file_metres);
  write_length(json, "world_metres", world_metres);
  json.member("factor", factor);
  json.key("doubt");
  doubt.empty() ? json.null() : json.value(doubt);
  json.end_object();
}

void write_warnings(JsonWriter& json, const Session& session) {
  json.key("warnings").begin_array();
  for (const Warning& warning : session.warnings()) {
    json.begin_object();
    json.member("code", warning.code);
    json.member("message", warning.message);
    json.end_object();
  }
  json.end_array();
}

}  // namespace strata::apps
