#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "apps/session/json_writer.h"
#include "apps/session/session.h"

// What the reports of all commands have in common, as docs/json.md says.

namespace strata::apps {

/// "(1, 2.5, 3)"
[[nodiscard]] std::string triple(const glm::dvec3& v);

/// Begins the report's object: version and command.
void begin_report(JsonWriter& json, std::string_view command);

/// "timings_ms": the phases of a command, and the total since the program began.
void write_timings(JsonWriter& json, const Session& session,
                   std::initializer_list<std::pair<std::string_view, double>> phases = {});

/// "memory": the peak of this process, and what else a command knows of its memory.
void write_memory(JsonWriter& json,
                  std::initializer_list<std::pair<std::string_view, std::uint64_t>> more = {});

/// A length in metres; null where it is 0, not known.
void write_length(JsonWriter& json, std::string_view name, double metres);

/// "unit": of a mesh file, of the world, and what its numbers were multiplied by. @param doubt  of
/// its size, or empty
void write_unit(JsonWriter& json, double file_metres, double world_metres, double factor,
                const std::string& doubt);

/// "warnings": those of the session, in their order.
void write_warnings(JsonWriter& json, const Session& session);

}  // namespace strata::apps
