#include "apps/strata/mesh_input.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <utility>

#include "apps/session/session.h"
#include "apps/strata/csg_scene.h"
#include "mesh/block_sum.h"
#include "strata/mesh/soup_tools.h"
#include "strata/raster/lattice_mesh.h"

namespace strata::apps {
namespace {

/// Sums over the triangles of a mesh.
struct Measures {
  double area = 0.0;
  double volume = 0.0;  // about the point given
  std::uint64_t zero_area = 0;
  double longest_square = 0.0;  // of an edge
};

Measures measure(const TriangleSoup& soup, const glm::dvec3& about, const Execution& execution) {
  Measures total = detail::fold_blocks<Measures>(
      execution, soup.triangles.size(),
      [&](Measures& sum, std::size_t i) {
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
      [](Measures& sum, const Measures& part) {
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
void check_closed(const TriangleSoup& soup, const MeshInputRules& rules, const Execution& execution,
                  InputFacts& facts, Session& session) {
  facts.rule = rules.rule;
  facts.closed = facts.orientation.closed;
  if (facts.closed) return;
  std::string text;
  const bool even = describe_open(soup, execution, facts, text);
  if (even && rules.rule == InsideRule::kParity) {
    facts.closed = true;  // wrongly oriented, perhaps, but parity does not look at that
    return;
  }
  if (even && rules.rule == InsideRule::kWinding && !rules.keep_orientation) {
    facts.closed = true;
    facts.rule = InsideRule::kParity;
    session.warn("not-orientable",
                 fmt::format("{}: the mesh has no outside ({} of its parts cannot be "
                             "oriented), but every edge has an even number of faces; parity "
                             "decides what is inside",
                             facts.path, facts.orientation.not_orientable));
    return;
  }
  if (even) text += "; --rule parity treats it as closed";
  session.warn("open", text);
  facts.open = std::move(text);
}

/// Says what was turned.
void tell_orientation(const MeshInputRules& rules, InputFacts& facts, double volume_before,
                      Session& session) {
  const Orientation& found = facts.orientation;
  const bool kept = rules.keep_orientation;
  const bool by_parity = !found.closed && facts.rule == InsideRule::kParity;
  const bool all = found.all_turned && found.turned_parts > 0;
  const std::string done = kept ? "kept as it is" : "it was reversed";
  if (all || (facts.orientation.closed && found.turned_open_volume != 0.0)) {
    session.warn("inverted", fmt::format("{}: the mesh is inside out (its volume is {:.6g}); {}",
                                         facts.path, volume_before, done));
  } else if (found.turned_open_volume != 0.0 && !by_parity) {
    session.warn("inverted", fmt::format("{}: the open mesh seems to be inside out (its volume, "
                                         "with holes closed towards the middle, is {:.6g}); {}",
                                         facts.path, found.turned_open_volume, done));
  }
  facts.turned_around = !kept && !by_parity && (all || found.turned_open_volume != 0.0);
  for (const std::string& text : sentences(found, !kept)) {
    session.warn("inverted",
                 fmt::format("{}: {}{}", facts.path, text, kept ? "; kept as it is" : ""));
  }
}

Result<InputFacts> inspect(TriangleSoup& soup, MeshReadStats stats, const std::string& path,
                           const MeshInputRules& rules, Session& session) {
  InputFacts facts;
  facts.path = path;
  facts.stats = std::move(stats);
  warn_of_reading(path, facts.stats, session);
  Execution execution = session.execution("checking");
  execution.progress = {};
  facts.bounds = bounds(soup, execution);
  const auto take_measures = [&] {
    const Measures measures =
        measure(soup, 0.5 * facts.bounds.low + 0.5 * facts.bounds.high, execution);
    facts.area = measures.area;
    facts.volume = measures.volume;
    facts.zero_area_faces = measures.zero_area;
    facts.longest_edge = std::sqrt(measures.longest_square);
  };
  take_measures();
  const double volume_before = facts.volume;
  facts.orientation = orient_parts(
      soup, execution,
      {.change = !rules.keep_orientation,
       .positive =
           facts.volume > 1e-8 * facts.area * glm::length(facts.bounds.high - facts.bounds.low)});
  if (facts.orientation.changed() && !rules.keep_orientation) take_measures();
  check_closed(soup, rules, execution, facts, session);
  tell_orientation(rules, facts, volume_before, session);
  if (session.interrupted()) return fail(ErrorCode::kCancelled, "stopped");
  return facts;
}

}  // namespace

std::string describe(const UnbalancedEdge& edge) {
  return fmt::format(
      "the edge from ({:.9g}, {:.9g}, {:.9g}) to ({:.9g}, {:.9g}, {:.9g}) of face {} "
      "is used {} times in this direction and {} times in the other",
      edge.from.x, edge.from.y, edge.from.z, edge.to.x, edge.to.y, edge.to.z, edge.element,
      edge.forward, edge.backward);
}

void warn_of_reading(const std::string& path, const MeshReadStats& stats, Session& session) {
  if (stats.dropped_faces() > 0) {
    std::string causes;
    const auto add = [&](std::uint64_t count, const char* cause) {
      if (count > 0) causes += fmt::format("{}{} {}", causes.empty() ? "" : ", ", count, cause);
    };
    add(stats.out_of_range, "with an invalid vertex index");
    add(stats.non_finite, "with a coordinate that is not finite");
    add(stats.too_few_vertices, "with fewer than three vertices");
    session.warn("dropped-faces", fmt::format("{}: {} of {} faces dropped: {}", path,
                                              stats.dropped_faces(), stats.faces, causes));
  }
  if (stats.non_planar > 0) {
    session.warn("non-planar",
                 fmt::format("{}: {} not flat", path, counted(stats.non_planar, "polygon")));
  }
  for (const std::string& text : stats.warnings) session.warn("reader", text);
}

bool reads_standard_input(const InputOptions& input) {
  return std::find(input.files.begin(), input.files.end(), "-") != input.files.end();
}

MeshFormat format_of(const std::string& path, const InputOptions& input) {
  const bool told = mesh_format_of(path) != MeshFormat::kAuto || is_scene_name(path);
  return told && reads_standard_input(input) ? MeshFormat::kAuto : input.format;
}

Result<void> check_input_name(const std::string& path, const InputOptions& input, bool scenes) {
  if (format_of(path, input) != MeshFormat::kAuto || path == "-") return {};
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    return fail(ErrorCode::kInput, "{}: it is a folder, not a file", path);
  }
  if (mesh_format_of(path) != MeshFormat::kAuto) return {};
  if (scenes) {
    return fail(ErrorCode::kInput,
                "{}: the file name must end in .csg, .scad, .obj, .stl, .ply or .off, or "
                "--input-format must be given",
                path);
  }
  return fail(
      ErrorCode::kInput,
      "{}: the file name must end in .obj, .stl, .ply or .off, or --input-format must be given",
      path);
}

Result<MeshFile> read_input(const std::string& path, const InputOptions& input, Session& session) {
  if (auto named = check_input_name(path, input, false); !named) {
    return tl::unexpected(named.error());
  }
  MeshReadOptions options;
  options.format = format_of(path, input);
  options.reader = input.reader;
  const double share = 0.5 / static_cast<double>(std::max<std::size_t>(input.files.size(), 1));
  const Execution execution = session.execution("reading", share);
  return read_mesh(path, options, execution);
}

Result<InputFacts> load_mesh(const std::string& path, const InputOptions& input,
                             const MeshInputRules& rules, Session& session, TriangleSoup& soup,
                             double* read_ms) {
  const double start = session.milliseconds();
  auto file = read_input(path, input, session);
  if (!file) return tl::unexpected(file.error());
  if (read_ms != nullptr) *read_ms += session.milliseconds() - start;
  soup = std::move(file->soup);
  auto facts = inspect(soup, std::move(file->stats), path, rules, session);
  if (!facts) return facts;
  session.note(fmt::format("{}: {}, {}", path, counted(facts->stats.triangles, "triangle"),
                           facts->closed ? "closed" : "open"));
  return facts;
}

void MeshInput::add(InputFacts facts) {
  closed = closed && facts.closed;
  area += facts.area;
  volume += facts.volume;
  longest_edge = std::max(longest_edge, facts.longest_edge);
  bounds.include(facts.bounds);
  files.push_back(std::move(facts));
}

void MeshInput::set_tree(csg::Tree made) {
  tree = std::make_shared<csg::SolidLists>(made, made.root());
  soup = tree->take_soup();
  // The soup has all triangles that are needed from here on.
  for (csg::Solid& solid : made.solids()) solid.mesh.reset();
  scene = std::make_shared<csg::Tree>(std::move(made));
}

Result<void> MeshInput::fit(const VoxelGrid& grid, const Execution& execution) {
  if (tree) return tree->fit(grid, &soup, execution);
  const auto done = fit_lattice(soup, bounds, grid, execution);
  if (!done) return tl::unexpected(done.error());
  return {};
}

bool MeshInput::has_scene() const {
  return std::any_of(files.begin(), files.end(), [](const auto& file) { return file.is_scene; });
}

Result<MeshInput> load_meshes(const InputOptions& input, const MeshInputRules& rules,
                              Session& session) {
  MeshInput all;
  all.rule = rules.rule;
  std::vector<csg::Solid> apart;  // those with a rule of their own
  for (const std::string& path : input.files) {
    const double start = session.milliseconds();
    TriangleSoup soup;
    double read_ms = 0;
    auto facts = load_mesh(path, input, rules, session, soup, &read_ms);
    if (!facts) return tl::unexpected(facts.error());
    all.read_ms += read_ms;
    const InsideRule rule = facts->rule;
    all.add(*std::move(facts));
    if (input.files.size() == 1) {
      all.soup = std::move(soup);
      all.rule = rule;
    } else if (rule != rules.rule) {
      csg::Solid& solid = apart.emplace_back();
      solid.mesh = std::make_shared<const TriangleSoup>(std::move(soup));
      solid.rule = rule;
      solid.name = path;
    } else if (all.soup.triangles.empty()) {
      all.soup = std::move(soup);
    } else {
      if (all.soup.positions.size() + soup.positions.size() > 0xfffffffeu) {
        return fail(ErrorCode::kLimit,
                    "{}: the inputs up to this one have more than 2^32 - 2 vertices", path);
      }
      append(all.soup, soup);
    }
    all.diagnose_ms += session.milliseconds() - start - read_ms;
  }
  if (apart.empty()) return all;
  csg::Tree tree;
  std::vector<csg::Tree::NodeId> solids;
  if (!all.soup.triangles.empty()) {
    csg::Solid& solid = apart.emplace_back();
    solid.mesh = std::make_shared<const TriangleSoup>(std::move(all.soup));
    solid.rule = rules.rule;
    solid.name = input.files.front();
  }
  for (csg::Solid& solid : apart) solids.push_back(tree.add_solid(std::move(solid)));
  tree.set_root(tree.add(csg::Operation::kUnion, solids));
  all.set_tree(std::move(tree));
  return all;
}

}  // namespace strata::apps
