#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/commands/commands.h"
#include "apps/session/json_writer.h"
#include "apps/session/session.h"
#include "strata/csg/boundary/boundary_mesh.h"
#include "strata/csg/measure/measure.h"
#include "strata/csg/picture/picture.h"

namespace strata::apps {

/// All that `strata csg` can tell of a run.
struct CsgOutcome {
  std::uint64_t solids = 0, nodes = 0, triangles = 0;
  bool flat = false;
  Camera camera;
  csg::DrawReport drawn;
  /// With --json or --summary one of the two.
  std::optional<csg::ExactMeasures> exact;
  std::optional<csg::Measures> measures;
  std::string why_not_exact;        ///< a sentence, with `measures`
  std::vector<std::uint32_t> seen;  ///< solids in the picture of --ids, increasing
  std::vector<std::string> names;   ///< of those
  double read_ms = 0, prepare_ms = 0, draw_ms = 0, write_ms = 0, measure_ms = 0;
};

/// The colour that stands for a solid in the picture of --ids: never black, no two alike.
[[nodiscard]] csg::Rgba colour_of_solid(std::uint32_t solid);

/// The member "camera" of a report.
void write_camera(JsonWriter& json, const Camera& camera);

/// For people: a line a topic.
[[nodiscard]] std::string csg_text(const CsgCommand& command, const CsgOutcome& outcome);

/// What else can be done with a file, as commands: for a person who gave nothing but its name.
[[nodiscard]] std::string next_steps(const std::string& file);

/// For programs, as docs/json.md says.
[[nodiscard]] std::string csg_json(const CsgCommand& command, const CsgOutcome& outcome,
                                   const Session& session);

}  // namespace strata::apps
