#include "apps/voxelize/voxelize_report.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "apps/commands/choice_words.h"
#include "apps/session/process_memory.h"
#include "apps/session/report.h"
#include "apps/voxelize/shard_report.h"
#include "core/printable.h"

namespace strata::apps {
namespace {

std::uint64_t column_count(const VoxelizeOutcome& outcome) {
  const AxisFrame frame(outcome.axis);
  return static_cast<std::uint64_t>(outcome.grid.dims[frame.u]) *
         static_cast<std::uint64_t>(outcome.grid.dims[frame.v]);
}

double voxel_volume(const VoxelGrid& grid) {
  return grid.voxel_size.x * grid.voxel_size.y * grid.voxel_size.z;
}

/// Columns with n crossings, n = 0 .. 64, the last one 64 and more; without trailing zeros.
std::vector<std::uint64_t> depth_histogram(const VoxelizeOutcome& outcome) {
  const auto& counts = outcome.report.depth_histogram;
  std::vector<std::uint64_t> result(counts.begin(), counts.end());
  const std::uint64_t covered = std::accumulate(result.begin() + 1, result.end(), std::uint64_t{0});
  const std::uint64_t columns = column_count(outcome);
  result[0] = columns > covered ? columns - covered : 0;
  while (result.size() > 1 && result.back() == 0) result.pop_back();
  return result;
}

/// 1234567 as 1 234 567.
std::string grouped(std::uint64_t number) {
  std::string text = std::to_string(number);
  for (std::size_t place = text.size(); place > 3;) {
    place -= 3;
    text.insert(place, " ");
  }
  return text;
}

/// Those of the result of a scene are not known; a report that was read says so by NaN.
bool knows_area(const csg::SolidInput& input) {
  return input.tree == nullptr && !std::isnan(input.area);
}

void write_input(JsonWriter& json, const csg::SolidInput& input) {
  json.key("input").begin_object();
  std::uint64_t triangles = 0, vertices = 0;
  for (const csg::InputFacts& file : input.files) {
    triangles += file.stats.triangles;
    vertices += file.stats.vertices;
  }
  json.member("triangles", triangles);
  json.member("vertices", vertices);
  json.member("closed", input.closed);
  if (knows_area(input)) {
    json.member("area", input.area);
    json.member("volume", input.volume);
  }
  json.key("bounds").begin_object();
  json.member("low", input.bounds.low);
  json.member("high", input.bounds.high);
  json.end_object();
  write_length(json, "unit_metres", input.unit_metres);
  json.key("files").begin_array();
  for (const csg::InputFacts& file : input.files) {
    json.begin_object();
    json.member("path", file.path);
    json.member("format", file.stats.format);
    json.member("bytes", file.stats.bytes);
    json.member("vertices", file.stats.vertices);
    json.member("triangles", file.stats.triangles);
    json.member("closed", file.closed);
    json.member("unbalanced_edges", file.unbalanced_edges);
    if (!file.is_scene) {
      json.member("faces", file.stats.faces);
      json.member("dropped_faces", file.stats.dropped_faces());
      json.member("zero_area_faces", file.zero_area_faces);
      json.member("turned_around", file.turned_around);
      json.member("turned_parts", file.orientation.turned_parts);
      json.member("turned_triangles", file.orientation.turned_triangles);
      json.member("double_faces", file.orientation.double_faces);
      json.member("rule", word_of(kRuleWords, file.rule));
      json.member("area", file.area);
      json.member("volume", file.volume);
      write_unit(json, file.stats.unit_metres, input.unit_metres,
                 csg::unit_factor(file.stats.unit_metres, input.unit_metres), file.unit_doubt);
    }
    json.end_object();
  }
  json.end_array();
  json.end_object();
}

void write_distances(JsonWriter& json, const VoxelizeOutcome& outcome) {
  const DistanceReport& found = *outcome.distances;
  json.key("distances").begin_object();
  json.member("band", found.band);
  json.member("surface", outcome.exact_boundary ? "boundary" : "mesh");
  json.member("band_voxels", found.band_voxels);
  json.member("inside_voxels", found.inside_voxels);
  json.member("least", double{found.least});
  json.member("greatest", double{found.greatest});
  json.end_object();
}

std::string hexadecimal(const glm::u8vec4& colour) {
  return fmt::format("#{:02x}{:02x}{:02x}", colour.x, colour.y, colour.z);
}

void write_colours(JsonWriter& json, const ColourReport& colours) {
  json.key("colours").begin_object();
  json.member("source", colours.of_solids ? "solids" : "mesh");
  json.member("count", colours.count());
  json.key("fill");
  colours.fill ? json.value(hexadecimal(*colours.fill)) : json.null();
  json.end_object();
}

void write_results(JsonWriter& json, const VoxelizeCommand& command,
                   const VoxelizeOutcome& outcome) {
  const VoxelizeReport& report = outcome.report;
  if (!outcome.measured) return;
  json.key("voxels").begin_object();
  json.member("solid", report.solid_voxels);
  json.member("volume", static_cast<double>(report.solid_voxels) * voxel_volume(outcome.grid));
  json.member("area_estimate", outcome.area_estimate);
  json.member("intervals", report.intervals);
  if (command.coverage != 0) {
    json.key("coverage").begin_object();
    json.member("rays", command.coverage);
    json.member("volume", outcome.filled_volume);
    json.end_object();
  }
  if (command.checksum) json.member("checksum", fmt::format("{:016x}", report.checksum));
  json.end_object();

  if (outcome.distances) write_distances(json, outcome);
  if (outcome.colours) write_colours(json, *outcome.colours);

  json.key("lost_walls").begin_object();
  json.member("count", outcome.lost_walls.count);
  json.key("largest").begin_array();
  for (const LostWall& wall : outcome.lost_walls.largest) {
    json.begin_object();
    json.member("axis", word_of(kAxisWords, wall.axis));
    json.member("thickness", wall.thickness);
    json.member("low", wall.low);
    json.member("high", wall.high);
    json.end_object();
  }
  json.end_array();
  json.end_object();

  json.key("lists").begin_object();
  json.member("crossings", report.crossings);
  json.member("columns", column_count(outcome));
  json.member("max_depth", report.max_depth_complexity);
  json.member("unbalanced_columns", report.unbalanced_columns);
  json.member("negative_columns", report.negative_columns);
  json.member("rebuilt_tiles", report.rebuilt_tiles);
  json.key("depth_histogram").begin_array();
  for (const std::uint64_t count : depth_histogram(outcome)) json.value(count);
  json.end_array();
  json.end_object();
}

/// The solids that have voxels.
void write_ids(JsonWriter& json, const VoxelizeOutcome& outcome) {
  json.key("ids").begin_array();
  for (std::size_t solid = 0; solid < outcome.id_voxels.size(); ++solid) {
    if (outcome.id_voxels[solid] == 0) continue;
    json.begin_object();
    json.member("id", solid + 1);
    json.member("solid", solid);
    json.member("name", outcome.input.scene->solids()[solid].name);
    json.member("voxels", outcome.id_voxels[solid]);
    json.end_object();
  }
  json.end_array();
}

/// Lines of a topic each.
class Lines {
 public:
  void operator()(std::string_view topic, const std::string& rest) {
    text_ += fmt::format("{:<9} {}\n", topic, rest);
  }
  [[nodiscard]] std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

/// "490 x 512 x 227 voxels of 0.0128"
std::string size_of(const VoxelGrid& grid, int digits) {
  const glm::dvec3 s = grid.voxel_size;
  const auto one = [&](double length) { return fmt::format("{:.{}g}", length, digits); };
  return fmt::format("{} x {} x {} voxels of {}", grid.dims.x, grid.dims.y, grid.dims.z,
                     s.x == s.y && s.y == s.z
                         ? one(s.x)
                         : fmt::format("({}, {}, {})", one(s.x), one(s.y), one(s.z)));
}

void tell_input(Lines& line, const VoxelizeCommand& command, const VoxelizeOutcome& outcome) {
  for (const csg::InputFacts& file : outcome.input.files) {
    line("input",
         fmt::format("{}: {} triangles, {} vertices, {}{}", printable(file.path),
                     grouped(file.stats.triangles), grouped(file.stats.vertices),
                     file.closed ? "closed" : "open", file.turned_around ? ", reversed" : ""));
    const std::string unit =
        csg::describe_unit(file.stats.unit_metres, outcome.input.unit_metres, file.unit_doubt);
    if (!unit.empty()) line("unit", unit);
  }
  const std::string bounds =
      fmt::format("{} to {}", triple(outcome.input.bounds.low), triple(outcome.input.bounds.high));
  if (knows_area(outcome.input)) {
    line("mesh", fmt::format("{}, area {:.6g}, volume {:.6g}", bounds, outcome.input.area,
                             outcome.input.volume));
  } else {
    line("scene", bounds);
  }
  line("grid",
       fmt::format("{}, origin {}, rays along {}", size_of(outcome.grid, 6),
                   triple(outcome.grid.origin), word_of(kAxisWords, outcome.axis)) +
           (command.default_size ? fmt::format("; -r {} by default", kDefaultResolution) : "") +
           (command.like.empty() ? "" : fmt::format("; as {}", printable(command.like))));
  if (outcome.frame.turned()) {
    const glm::dmat3& d = outcome.frame.direction;
    line("turned", fmt::format("x of the grid runs along {}, y along {}, z along {}", triple(d[0]),
                               triple(d[1]), triple(d[2])));
  }
}

void tell_results(Lines& line, const VoxelizeCommand& command, const VoxelizeOutcome& outcome,
                  const Session& session) {
  const VoxelizeReport& report = outcome.report;
  const double cells =
      static_cast<double>(column_count(outcome)) * outcome.grid.dims[AxisFrame(outcome.axis).w];
  const auto solid = static_cast<double>(report.solid_voxels);
  line(!command.surface ? "solid"
       : command.solid  ? "both"
                        : "surface",
       fmt::format("{} voxels ({:.4g} %), volume {:.6g}, area about {:.3g}, in {} intervals",
                   grouped(report.solid_voxels), 100 * solid / cells,
                   solid * voxel_volume(outcome.grid), outcome.area_estimate,
                   grouped(report.intervals)));
  if (outcome.distances) {
    const DistanceReport& found = *outcome.distances;
    const std::string within = found.band > 0 ? fmt::format(" within {:.6g}", found.band) : "";
    line("sdf",
         fmt::format("{} voxels{} of the {}, {:.6g} to {:.6g}", grouped(found.band_voxels), within,
                     outcome.exact_boundary ? "boundary" : "surface", found.least, found.greatest));
  }
  if (command.coverage != 0) {
    line("coverage", fmt::format("{0} x {0} rays a voxel, filled volume {1:.9g}", command.coverage,
                                 outcome.filled_volume));
  }
  if (outcome.colours) {
    line("colours",
         fmt::format("{} of the {}{}", grouped(outcome.colours->count()),
                     outcome.colours->of_solids ? "solids" : "mesh",
                     outcome.colours->fill ? ", " + hexadecimal(*outcome.colours->fill) + " inside"
                                           : std::string()));
  }
  if (command.checksum) line("checksum", fmt::format("{:016x}", report.checksum));
  line("lists", fmt::format("{} crossings, at most {} in a column", grouped(report.crossings),
                            report.max_depth_complexity));
  std::string depths;
  const auto histogram = depth_histogram(outcome);
  for (std::size_t n = 0; n < histogram.size(); ++n) {
    if (histogram[n] == 0) continue;
    depths += fmt::format("{}{}{}: {}", depths.empty() ? "" : ", ", n, n == 64 ? "+" : "",
                          grouped(histogram[n]));
  }
  line("depth", "columns by crossings " + depths);
  if (report.unbalanced_columns > 0) {
    line("holes", fmt::format("{} columns are entered and left unequally often",
                              grouped(report.unbalanced_columns)));
  }
  line("time", fmt::format("{:.1f} ms: read {:.1f}, check {:.1f}, lists {:.1f}, intervals {:.1f}, "
                           "write {:.1f}",
                           session.milliseconds(), outcome.input.read_ms, outcome.input.diagnose_ms,
                           report.lists_ms, report.intervals_ms, outcome.write_ms));
  line("memory", fmt::format("{} at most", readable_bytes(peak_memory_bytes())));
}

/// "knot.vox", or "knot_0_0_0.vox to knot_1_1_0.vox (4 files)".
std::string output_name(const VoxelizeCommand& command, const VoxelizeOutcome& outcome) {
  const std::vector<std::string>& files = outcome.output_files;
  if (files.empty()) return command.output;
  if (files.size() == 1) return files.front() + " (1 file)";
  return fmt::format("{} to {} ({} files)", files.front(), files.back(), files.size());
}

void write_options(JsonWriter& json, const VoxelizeCommand& command, const VoxelizeOutcome& outcome,
                   const Session& session) {
  json.key("options").begin_object();
  json.member("solid", command.solid);
  json.key("surface");
  if (command.surface) {
    json.value(word_of(kSurfaceKindWords, command.surface_kind));
  } else {
    json.null();
  }
  json.member("rule", word_of(kRuleWords, command.input.rule));
  json.member("open", word_of(kOpenModeWords, command.open));
  json.member("axis", word_of(kAxisWords, outcome.axis));
  json.member("store", word_of(kStoreWords, command.store));
  json.member("offsets", word_of(kOffsetWords, command.offsets));
  json.member("threads", session.threads());
  json.end_object();
}

void write_output(JsonWriter& json, const VoxelizeCommand& command,
                  const VoxelizeOutcome& outcome) {
  json.key("output");
  if (command.output.empty() || command.dry_run) {
    json.null();
  } else {
    json.begin_object();
    json.member("path", command.output);
    json.member("format", outcome.format->name);
    json.key("files").begin_array();
    for (const std::string& file : outcome.output_files) json.value(file);
    json.end_array();
    json.key("bytes");
    if (outcome.output_bytes) {
      json.value(*outcome.output_bytes);
    } else {
      json.null();
    }
    json.end_object();
  }
}

}  // namespace

void ColourReport::add(const VoxelIntervals& slab) {
  constexpr std::uint32_t kColours = 1u << 24;
  found.resize(kColours);
  for (int tv = 0; tv < slab.tiles_v(); ++tv) {
    for (int tu = 0; tu < slab.tiles_u(); ++tu) {
      for (const std::uint32_t label : slab.tile(tu, tv).labels) found[label % kColours] = true;
    }
  }
}

std::uint64_t ColourReport::count() const {
  return static_cast<std::uint64_t>(std::count(found.begin(), found.end(), true));
}

std::uint64_t expected_memory(const VoxelizeOutcome& outcome) {
  constexpr std::uint64_t kProgram = 4'000'000;  // of the program and the libraries it starts with
  return std::max(outcome.read_peak, outcome.estimate.total() + kProgram);
}

std::string voxelize_text(const VoxelizeCommand& command, const VoxelizeOutcome& outcome,
                          const Session& session) {
  Lines line;
  tell_input(line, command, outcome);
  if (outcome.measured) {
    tell_results(line, command, outcome, session);
  } else {
    line("memory", fmt::format("about {} would be needed; the limit is {}",
                               readable_bytes(expected_memory(outcome)),
                               readable_bytes(session.memory_limit())));
  }
  if (outcome.file_size) {
    line("output", fmt::format("{}: {}, {}{}", printable(command.output), outcome.format->name,
                               outcome.file_size->exact ? "" : "at most ",
                               readable_bytes(outcome.file_size->bytes)));
  }
  if (outcome.output_bytes) {
    line("output", fmt::format("{}: {}, {} bytes", output_name(command, outcome),
                               outcome.format->name, grouped(*outcome.output_bytes)));
  }
  return line.take();
}

std::string made_line(const VoxelizeCommand& command, const VoxelizeOutcome& outcome,
                      double seconds) {
  const std::string bytes =
      outcome.output_bytes ? ", " + readable_bytes(*outcome.output_bytes) : std::string();
  return fmt::format("{}: {}, {} solid{}, {:.2f} s", output_name(command, outcome),
                     size_of(outcome.grid, 3), grouped(outcome.report.solid_voxels), bytes,
                     seconds);
}

std::string voxelize_json(const VoxelizeCommand& command, const VoxelizeOutcome& outcome,
                          const Session& session, std::string_view name) {
  JsonWriter json;
  begin_report(json, name);
  write_input(json, outcome.input);

  json.key("grid").begin_object();
  json.member("dims", outcome.grid.dims);
  json.member("origin", outcome.grid.origin);
  json.member("voxel_size", outcome.grid.voxel_size);
  json.member("by_default", command.default_size);
  json.key("direction").begin_array();
  for (int row = 0; row < 3; ++row) {
    const glm::dmat3& d = outcome.frame.direction;
    json.value(glm::dvec3(d[0][row], d[1][row], d[2][row]));
  }
  json.end_array();
  json.key("like");
  command.like.empty() ? json.null() : json.value(command.like);
  json.end_object();

  write_options(json, command, outcome, session);
  write_results(json, command, outcome);
  if (command.ids && outcome.measured) write_ids(json, outcome);
  if (command.shard && outcome.measured) write_shard(json, command, outcome);

  write_output(json, command, outcome);
  write_timings(json, session,
                {{"read", outcome.input.read_ms},
                 {"check", outcome.input.diagnose_ms},
                 {"lists", outcome.report.lists_ms},
                 {"intervals", outcome.report.intervals_ms},
                 {"write", outcome.write_ms}});
  write_memory(json, {{"estimated_bytes", expected_memory(outcome)},
                      {"limit_bytes", session.memory_limit()}});
  if (outcome.file_size) {
    json.key("file_size").begin_object();
    json.member("bytes", outcome.file_size->bytes);
    json.member("exact", outcome.file_size->exact);
    json.end_object();
  }
  write_warnings(json, session);
  json.end_object();
  return json.take();
}

}  // namespace strata::apps
