#include "strata/csg/input/scene_input.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <utility>

#include "core/printable.h"
#include "csg/input/input_parts.h"
#include "mesh/block_sum.h"
#include "mesh/split_parts.h"
#include "strata/mesh/soup_tools.h"

namespace strata::csg {
namespace {

/// Sums over the triangles of a mesh.
struct SoupSums {
  double area = 0.0;
  double volume = 0.0;  // about the point given
  std::uint64_t zero_area = 0;
  double longest_square = 0.0;  // of an edge
};

SoupSums sums_of(const TriangleSoup& soup, const glm::dvec3& about, const Execution& execution) {
  SoupSums total = strata::detail::fold_blocks<SoupSums>(
      execution, soup.triangles.size(),
      [&](SoupSums& sum, std::size_t i) {
        const glm::uvec3 t = soup.triangles[i];
        const glm::dvec3 a = soup.positions[t.x] - about, b = soup.positions[t.y] - about,
                         c = soup.positions[t.z] - about;
        const double twice = glm::length(glm::cross(b - a, c - a));
        sum.area += twice;
        sum.volume += glm::dot(a, glm::cross(b, c));
        if (!(twice > 0.0)) ++sum.zero_area;
        sum.longest_square = std::max({sum.longest_square, glm::dot(b - a, b - a),
                                       glm::dot(c - a, c - a), glm::dot(c - b, c - b)});
      },
      [](SoupSums& sum, const SoupSums& part) {
        sum.area += part.area;
        sum.volume += part.volume;
        sum.zero_area += part.zero_area;
        sum.longest_square = std::max(sum.longest_square, part.longest_square);
      });
  total.area /= 2;
  total.volume /= 6;
  return total;
}

/// Says what of a mesh that is not closed is open. @return whether parity takes it as closed
bool describe_open(const TriangleSoup& soup, const Execution& execution, InputFacts& facts,
                   std::string& text) {
  const MeshDiagnosis found = diagnose(soup, execution);
  facts.unbalanced_edges = found.unbalanced_edges;
  text = fmt::format("{}: the mesh is not closed: {} of {} edges are unbalanced", facts.path,
                     found.unbalanced_edges, found.edges);
  if (found.boundary_edges > 0) text += fmt::format(", {} border a hole", found.boundary_edges);
  if (found.misoriented_edges > 0) {
    text += fmt::format(", {} join faces of opposite orientation", found.misoriented_edges);
  }
  if (!found.examples.empty()) text += fmt::format("; {}", describe(found.examples.front()));
  return found.even;
}

/// Whether the mesh is closed in the sense of the rule, with numbers when it is not.
void check_closed(const TriangleSoup& soup, const SceneInput& input, const Execution& execution,
                  InputFacts& facts, const InputMessages& messages) {
  facts.rule = input.rule;
  facts.closed = facts.orientation.closed;
  if (facts.closed) return;
  std::string text;
  const bool even = describe_open(soup, execution, facts, text);
  if (even && input.rule == InsideRule::kParity) {
    facts.closed = true;  // wrongly oriented, perhaps, but parity does not look at that
    return;
  }
  if (even && input.rule == InsideRule::kWinding && !input.keep_orientation) {
    facts.closed = true;
    facts.rule = InsideRule::kParity;
    detail::warn(messages, "not-orientable",
                 fmt::format("{}: the mesh has no outside ({} of its parts cannot be "
                             "oriented), but every edge has an even number of faces; parity "
                             "decides what is inside",
                             facts.path, facts.orientation.not_orientable));
    return;
  }
  if (even) text += "; the parity rule treats it as closed";
  detail::warn(messages, "open", text);
  facts.open = std::move(text);
}

/// Says what was turned.
void tell_orientation(const SceneInput& input, InputFacts& facts, double volume_before,
                      const InputMessages& messages) {
  const Orientation& found = facts.orientation;
  const bool kept = input.keep_orientation;
  const bool by_parity = !found.closed && facts.rule == InsideRule::kParity;
  const bool all = found.all_turned && found.turned_parts > 0;
  const std::string done = kept ? "kept as it is" : "it was reversed";
  if (all || (facts.orientation.closed && found.turned_open_volume != 0.0)) {
    detail::warn(messages, "inverted",
                 fmt::format("{}: the mesh is inside out (its volume is {:.6g}); {}", facts.path,
                             volume_before, done));
  } else if (found.turned_open_volume != 0.0 && !by_parity) {
    detail::warn(messages, "inverted",
                 fmt::format("{}: the open mesh seems to be inside out (its volume, "
                             "with holes closed towards the middle, is {:.6g}); {}",
                             facts.path, found.turned_open_volume, done));
  }
  facts.turned_around = !kept && !by_parity && (all || found.turned_open_volume != 0.0);
  for (const std::string& text : sentences(found, !kept)) {
    detail::warn(messages, "inverted",
                 fmt::format("{}: {}{}", facts.path, text, kept ? "; kept as it is" : ""));
  }
}

}  // namespace

std::string describe(const UnbalancedEdge& edge) {
  const auto times = [](std::uint32_t count) {
    return count == 1 ? std::string("once") : fmt::format("{} times", count);
  };
  return fmt::format(
      "the edge from ({:.9g}, {:.9g}, {:.9g}) to ({:.9g}, {:.9g}, {:.9g}) of face {} "
      "is used {} in this direction and {} in the other",
      edge.from.x, edge.from.y, edge.from.z, edge.to.x, edge.to.y, edge.to.z, edge.element,
      times(edge.forward), times(edge.backward));
}

void warn_of_reading(const std::string& path, const MeshReadStats& stats,
                     const InputMessages& messages) {
  if (stats.dropped_faces() > 0) {
    std::string causes;
    const auto add = [&](std::uint64_t count, const char* cause) {
      if (count > 0) causes += fmt::format("{}{} {}", causes.empty() ? "" : ", ", count, cause);
    };
    add(stats.out_of_range, "with an invalid vertex index");
    add(stats.non_finite, "with a coordinate that is not finite");
    add(stats.too_few_vertices, "with fewer than three vertices");
    detail::warn(messages, "dropped-faces",
                 fmt::format("{}: {} of {} faces dropped: {}", path, stats.dropped_faces(),
                             stats.faces, causes));
  }
  if (stats.non_planar > 0) {
    detail::warn(messages, "non-planar",
                 fmt::format("{}: {} not flat", path, counted(stats.non_planar, "polygon")));
  }
  for (const std::string& text : stats.missing) detail::warn(messages, "missing-file", text);
  for (const std::string& text : stats.warnings) detail::warn(messages, "reader", text);
}

bool reads_standard_input(const SceneInput& input) {
  return std::find(input.files.begin(), input.files.end(), "-") != input.files.end();
}

InputKind kind_of(const std::string& path, const SceneInput& input) {
  const bool mesh_name = mesh_format_of(path) != MeshFormat::kAuto;
  const bool beside_stream = reads_standard_input(input);
  InputKind kind;
  // Beside standard input, files are known by their names.
  if (!beside_stream || (!mesh_name && !is_scene_name(path))) kind.format = input.format;
  kind.is_scene = input.scene_format ? !beside_stream || !mesh_name
                                     : kind.format == MeshFormat::kAuto && is_scene_name(path);
  // A name that says nothing: the content does.
  if (kind.format == MeshFormat::kAuto && !kind.is_scene && path != "-") {
    kind.format = mesh_format_of_file(path);
  }
  return kind;
}

Result<void> check_input_name(const std::string& path, const InputKind& kind, bool scenes) {
  std::error_code ignored;
  if (path != "-" && std::filesystem::is_directory(path, ignored)) {
    return fail(ErrorCode::kInput, "{}: it is a folder, not a file", path);
  }
  if (kind.format != MeshFormat::kAuto || path == "-") return {};
  if (std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored)) {
    return fail(ErrorCode::kInput, "{}: it is no regular file, so the input format must be given",
                path);
  }
  if (scenes) {
    return fail(
        ErrorCode::kInput,
        "{}: the file name must end in .csg, .scad, .obj, .stl, .ply, .off, .3mf, .amf, .gltf or "
        ".glb, or the input format must be given; the content looks like no mesh",
        path);
  }
  return fail(ErrorCode::kInput,
              "{}: the file name must end in .obj, .stl, .ply, .off, .3mf, .amf, .gltf or .glb, or "
              "the input format must be given; the content looks like no mesh",
              path);
}

Result<InputFacts> inspect_mesh(TriangleSoup& soup, MeshReadStats stats, const std::string& path,
                                const SceneInput& input, const InputMessages& messages,
                                const Execution& execution) {
  InputFacts facts;
  facts.path = path;
  facts.stats = std::move(stats);
  warn_of_reading(path, facts.stats, messages);
  facts.bounds = strata::bounds(soup, execution);
  facts.unit_doubt = unit_doubt(facts.stats, input, facts.bounds);
  const auto take_measures = [&] {
    const SoupSums measures =
        sums_of(soup, 0.5 * facts.bounds.low + 0.5 * facts.bounds.high, execution);
    facts.area = measures.area;
    facts.volume = measures.volume;
    facts.zero_area_faces = measures.zero_area;
    facts.longest_edge = std::sqrt(measures.longest_square);
  };
  take_measures();
  const double volume_before = facts.volume;
  facts.orientation = orient_parts(
      soup, execution,
      {.change = !input.keep_orientation,
       .positive =
           facts.volume > 1e-8 * facts.area * glm::length(facts.bounds.high - facts.bounds.low)});
  if (facts.orientation.changed() && !input.keep_orientation) take_measures();
  check_closed(soup, input, execution, facts, messages);
  tell_orientation(input, facts, volume_before, messages);
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return facts;
}

Result<MeshFile> read_mesh_input(const std::string& path, const InputKind& kind,
                                 const SceneInput& input, const Execution& execution) {
  if (auto named = check_input_name(path, kind, false); !named) {
    return tl::unexpected(named.error());
  }
  MeshReadOptions options;
  options.format = kind.format;
  options.reader = input.reader;
  options.attributes = input.attributes;
  options.textures = input.textures;
  options.list_parts = input.split_parts;
  options.parts = input.parts;
  options.root = input.scene.root_folder;
  auto file = read_mesh(path, options, execution);
  if (!file) return file;
  if (auto placed = place_mesh(path, file->stats, input, file->soup, execution); !placed) {
    return tl::unexpected(placed.error());
  }
  return file;
}

namespace {

/// Reads a mesh file, and hands on the files that it names.
Result<MeshFile> read_for(const std::string& path, const InputKind& kind, const SceneInput& input,
                          const InputMessages& messages, const Execution& execution,
                          double* read_ms) {
  const detail::Stopwatch watch;
  auto file = read_mesh_input(path, kind, input, execution);
  if (!file) return file;
  if (read_ms != nullptr) *read_ms += watch.milliseconds();
  if (messages.opened && !file->opened.empty()) {
    if (auto kept = messages.opened(file->opened); !kept) return tl::unexpected(kept.error());
  }
  return file;
}

void note_mesh(const InputFacts& facts, const InputMessages& messages) {
  detail::note(messages,
               fmt::format("{}: {}, {}", facts.path, counted(facts.stats.triangles, "triangle"),
                           facts.closed ? "closed" : "open"));
}

/// Adds what is known of a part to what is known of its file.
void add_part(InputFacts& all, const InputFacts& part, const std::string& name) {
  all.closed = all.closed && part.closed;
  all.turned_around = all.turned_around || part.turned_around;
  all.orientation.closed = all.orientation.closed && part.orientation.closed;
  all.orientation.parts += part.orientation.parts;
  all.orientation.turned_parts += part.orientation.turned_parts;
  all.orientation.turned_triangles += part.orientation.turned_triangles;
  all.orientation.mixed_parts += part.orientation.mixed_parts;
  all.orientation.not_orientable += part.orientation.not_orientable;
  all.orientation.double_faces += part.orientation.double_faces;
  all.area += part.area;
  all.volume += part.volume;
  all.longest_edge = std::max(all.longest_edge, part.longest_edge);
  all.bounds.include(part.bounds);
  all.zero_area_faces += part.zero_area_faces;
  all.unbalanced_edges += part.unbalanced_edges;
  if (!all.open.empty() || part.open.empty()) return;
  all.open = part.open;
  all.open_part = name;
}

}  // namespace

Result<InputFacts> load_mesh(const std::string& path, const InputKind& kind,
                             const SceneInput& input, const InputMessages& messages,
                             const Execution& execution, TriangleSoup& soup, double* read_ms) {
  std::vector<MeshSolid> one;
  SceneInput whole = input;
  whole.split_parts = false;
  auto facts = load_mesh_solids(path, kind, whole, messages, execution, one, read_ms);
  if (facts) soup = std::move(one.front().soup);
  return facts;
}

Result<InputFacts> load_mesh_solids(const std::string& path, const InputKind& kind,
                                    const SceneInput& input, const InputMessages& messages,
                                    const Execution& execution, std::vector<MeshSolid>& solids,
                                    double* read_ms) {
  auto file = read_for(path, kind, input, messages, execution, read_ms);
  if (!file) return tl::unexpected(file.error());
  Execution quiet = execution;
  quiet.progress = {};
  const std::vector<MeshPart>& parts = file->attributes.parts;
  if (!input.split_parts || parts.size() < 2) {
    auto facts = inspect_mesh(file->soup, std::move(file->stats), path, input, messages, quiet);
    if (!facts) return facts;
    facts->attributes = std::move(file->attributes);
    solids.push_back({std::move(file->soup), facts->rule, path, false});
    note_mesh(*facts, messages);
    return facts;
  }
  InputFacts all;
  all.path = path;
  all.rule = input.rule;
  all.closed = all.orientation.closed = true;
  warn_of_reading(path, file->stats, messages);
  all.stats = std::move(file->stats);
  std::vector<TriangleSoup> split = strata::detail::split_parts(file->soup, file->attributes);
  file->soup = {};
  for (std::size_t i = 0; i < split.size(); ++i) {
    if (split[i].triangles.empty()) continue;  // all its faces were dropped
    const bool named = i < parts.size();
    const std::string name = named ? parts[i].name : path;
    auto facts = inspect_mesh(
        split[i], {}, named ? fmt::format("{}: part '{}'", path, printable(name, 200)) : path,
        input, messages, quiet);
    if (!facts) return facts;
    add_part(all, *facts, named ? name : std::string());
    solids.push_back({std::move(split[i]), facts->rule, name, named});
  }
  all.unit_doubt = unit_doubt(all.stats, input, all.bounds);
  all.attributes = std::move(file->attributes);
  note_mesh(all, messages);
  return all;
}

}  // namespace strata::csg
