#include "apps/strata/csg_report.h"

#include "apps/session/json_writer.h"
#include "apps/session/process_memory.h"
#include "core/printable.h"

namespace strata::apps {

csg::Rgba colour_of_solid(std::uint32_t solid) {
  // An odd factor takes the numbers below 2^24 to each other, and neighbours far apart.
  const std::uint32_t code = ((solid + 1) * 0x9e3779u) & 0xffffffu;
  return {code >> 16, code >> 8 & 0xff, code & 0xff, 255};
}

std::string csg_text(const CsgCommand& command, const CsgOutcome& outcome) {
  std::string text;
  for (const std::string& path : command.input.files) text += printable(path) + '\n';
  const auto line = [&](std::string_view topic, const std::string& rest) {
    text += fmt::format("  {:<16} {}\n", topic, rest);
  };
  const auto triple = [](const glm::dvec3& v) {
    return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x, v.y, v.z);
  };
  line("scene", fmt::format("{} in {}, {}{}", counted(outcome.solids, "solid"),
                            counted(outcome.nodes, "node"), counted(outcome.triangles, "triangle"),
                            outcome.flat ? "; flat, as slabs of thickness 1" : ""));
  if (!outcome.measures || outcome.measures->empty) {
    line("result", "empty, or smaller than a voxel of the grid that is measured on");
    return text;
  }
  const csg::Measures& m = *outcome.measures;
  line("bounds",
       fmt::format("{} to {}, within {:.2g}", triple(m.low), triple(m.high), m.bounds_error));
  line("volume", fmt::format("{:.6g}, within {:.2g}", m.volume, m.volume_error));
  line("area", fmt::format("{:.6g}, about within {:.2g}", m.area, m.area_error));
  line("centre of mass", triple(m.centre));
  return text;
}

std::string csg_json(const CsgCommand& command, const CsgOutcome& outcome, const Session& session) {
  JsonWriter json;
  json.begin_object();
  json.member("strata", STRATA_VERSION);
  json.member("command", "csg");
  json.key("scene").begin_object();
  json.member("solids", outcome.solids);
  json.member("nodes", outcome.nodes);
  json.member("triangles", outcome.triangles);
  json.member("flat", outcome.flat);
  json.end_object();
  json.key("camera").begin_object();
  json.member("projection", outcome.camera.projection == csg::Projection::kPerspective
                                ? "perspective"
                                : "orthographic");
  json.member("target", outcome.camera.target);
  json.member("rotation", outcome.camera.rotation);
  json.member("distance", outcome.camera.distance);
  json.member("field_of_view", outcome.camera.field_of_view);
  json.end_object();
  json.key("picture").begin_object();
  json.member("width", command.size.x);
  json.member("height", command.size.y);
  json.member("samples", command.picture.samples);
  json.member("covered_pixels", outcome.drawn.covered);
  json.member("fragments", outcome.drawn.fragments);
  json.member("resolved", outcome.drawn.resolved);
  json.end_object();
  if (outcome.measures) {
    const csg::Measures& m = *outcome.measures;
    json.key("result").begin_object();
    json.member("empty", m.empty);
    json.member("resolution", m.resolution);
    json.member("volume", m.volume);
    json.member("volume_error", m.volume_error);
    json.member("area", m.area);
    json.member("area_error", m.area_error);
    json.member("centre_of_mass", m.centre);
    json.member("low", m.low);
    json.member("high", m.high);
    json.member("bounds_error", m.bounds_error);
    json.member("crossings", m.result_crossings);
    json.member("max_depth_complexity", m.max_depth_complexity);
    json.end_object();
  }
  if (!command.ids.empty()) {
    json.key("ids").begin_array();
    for (std::size_t i = 0; i < outcome.seen.size(); ++i) {
      const csg::Rgba colour = colour_of_solid(outcome.seen[i]);
      json.begin_object();
      json.member("solid", outcome.seen[i]);
      json.member("colour", fmt::format("#{:02x}{:02x}{:02x}", colour.r, colour.g, colour.b));
      json.member("name", outcome.names[i]);
      json.end_object();
    }
    json.end_array();
  }
  json.key("timings_ms").begin_object();
  json.member("read", outcome.read_ms);
  json.member("prepare", outcome.prepare_ms);
  json.member("draw", outcome.draw_ms);
  json.member("measure", outcome.measure_ms);
  json.member("write", outcome.write_ms);
  json.member("total", session.milliseconds());
  json.end_object();
  json.key("memory").begin_object();
  json.member("peak_bytes", peak_memory_bytes());
  json.end_object();
  json.key("warnings").begin_array();
  for (const Warning& warning : session.warnings()) {
    json.begin_object();
    json.member("code", warning.code);
    json.member("message", warning.message);
    json.end_object();
  }
  json.end_array();
  json.end_object();
  return json.take();
}

}  // namespace strata::apps
