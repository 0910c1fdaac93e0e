#include "apps/strata/csg_report.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "apps/session/report.h"
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
  line("scene", fmt::format("{} in {}, {}{}", counted(outcome.solids, "solid"),
                            counted(outcome.nodes, "node"), counted(outcome.triangles, "triangle"),
                            outcome.flat ? "; flat, as slabs of thickness 1" : ""));
  const bool empty =
      outcome.exact ? outcome.exact->empty : !outcome.measures || outcome.measures->empty;
  if (empty) {
    line("result",
         outcome.exact ? "empty" : "empty, or smaller than a voxel of the measuring grid");
    return text;
  }
  if (outcome.exact) {
    const csg::ExactMeasures& m = *outcome.exact;
    line("bounds", fmt::format("{} to {}", triple(m.low), triple(m.high)));
    line("volume",
         fmt::format("{:.12g}, exact after moving vertices to a lattice, which changes it "
                     "by at most {:.2g}",
                     m.volume, m.volume_snap_error));
    line("area", fmt::format("{:.12g}", m.area));
    line("centre of mass", triple(m.centre));
    return text;
  }
  const csg::Measures& m = *outcome.measures;
  line("bounds", fmt::format("{} to {}, error at most {:.2g}", triple(m.low), triple(m.high),
                             m.bounds_error));
  line("volume", fmt::format("{:.6g}, error at most {:.2g}", m.volume, m.volume_error));
  line("area", fmt::format("{:.6g}, error about {:.2g}", m.area, m.area_error));
  line("centre of mass", triple(m.centre));
  line("measured", fmt::format("by rays, not exactly: {}", printable(outcome.why_not_exact)));
  return text;
}

namespace {

void write_scene(JsonWriter& json, const CsgOutcome& outcome) {
  json.key("scene").begin_object();
  json.member("solids", outcome.solids);
  json.member("nodes", outcome.nodes);
  json.member("triangles", outcome.triangles);
  json.member("flat", outcome.flat);
  json.end_object();
}

}  // namespace

void write_camera(JsonWriter& json, const Camera& camera) {
  json.key("camera").begin_object();
  json.member("projection",
              camera.projection == Projection::kPerspective ? "perspective" : "orthographic");
  json.member("target", camera.target);
  json.member("rotation", camera.rotation);
  json.member("distance", camera.distance);
  json.member("field_of_view", camera.field_of_view);
  json.end_object();
}

namespace {

void write_picture(JsonWriter& json, const CsgCommand& command, const csg::DrawReport& drawn) {
  json.key("picture").begin_object();
  json.member("width", command.size.x);
  json.member("height", command.size.y);
  json.member("samples", command.picture.samples);
  json.member("covered_pixels", drawn.covered);
  json.member("fragments", drawn.fragments);
  json.member("resolved", drawn.resolved);
  json.end_object();
}

void write_measures(JsonWriter& json, const csg::Measures& m, const std::string& why_not_exact) {
  json.key("result").begin_object();
  json.member("exact", false);
  json.member("why_not_exact", why_not_exact);
  json.member("empty", m.empty);
  json.member("resolution", m.resolution);
  json.key("lattice_step").null();
  json.member("volume", m.volume);
  json.member("volume_error", m.volume_error);
  json.member("area", m.area);
  json.member("area_error", m.area_error);
  json.member("centre_of_mass", m.centre);
  json.key("inertia").null();
  json.member("low", m.low);
  json.member("high", m.high);
  json.member("bounds_error", m.bounds_error);
  json.member("crossings", m.result_crossings);
  json.member("max_depth_complexity", m.max_depth_complexity);
  json.end_object();
}

void write_exact(JsonWriter& json, const csg::ExactMeasures& m) {
  json.key("result").begin_object();
  json.member("exact", true);
  json.key("why_not_exact").null();
  json.member("empty", m.empty);
  json.key("resolution").null();
  json.member("lattice_step", m.report.step);
  json.member("volume", m.volume);
  json.member("volume_error", m.volume_snap_error);
  json.member("area", m.area);
  json.member("area_error", m.area_error);
  json.member("centre_of_mass", m.centre);
  json.key("inertia").begin_array();
  for (const double moment : m.inertia) json.value(moment);
  json.end_array();
  json.member("low", m.low);
  json.member("high", m.high);
  json.member("bounds_error", m.empty ? 0.0 : 0.5 * m.report.step);
  json.key("crossings").null();
  json.key("max_depth_complexity").null();
  json.end_object();
}

void write_seen_ids(JsonWriter& json, const CsgOutcome& outcome) {
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

}  // namespace

std::string next_steps(const std::string& file) {
  const bool plain = std::all_of(file.begin(), file.end(), [](unsigned char letter) {
    return std::isalnum(letter) != 0 ||
           std::string_view("._-/+").find(static_cast<char>(letter)) != std::string_view::npos;
  });
  // A quote within quotes ends them, is escaped, and begins them again.
  std::string word = plain ? file : "'";
  if (!plain) {
    for (const char letter : printable(file))
      word += letter == '\'' ? "'\\''" : std::string(1, letter);
    word += '\'';
  }
  const std::string stem = plain ? std::filesystem::path(file).stem().string() : "out";
  return fmt::format(
      "next\n"
      "  strata view {0}\n"
      "  strata {0} -o {1}.png\n"
      "  strata voxelize {0} -o {1}.vdb\n"
      "  strata mesh {0} -o {1}.3mf\n",
      word, stem);
}

std::string csg_json(const CsgCommand& command, const CsgOutcome& outcome, const Session& session) {
  JsonWriter json;
  begin_report(json, "csg");
  write_scene(json, outcome);
  write_camera(json, outcome.camera);
  write_picture(json, command, outcome.drawn);
  if (outcome.exact) write_exact(json, *outcome.exact);
  if (outcome.measures) write_measures(json, *outcome.measures, outcome.why_not_exact);
  if (!command.ids.empty()) write_seen_ids(json, outcome);
  write_timings(json, session,
                {{"read", outcome.read_ms},
                 {"prepare", outcome.prepare_ms},
                 {"draw", outcome.draw_ms},
                 {"measure", outcome.measure_ms},
                 {"write", outcome.write_ms}});
  write_memory(json);
  write_warnings(json, session);
  json.end_object();
  return json.take();
}

}  // namespace strata::apps
