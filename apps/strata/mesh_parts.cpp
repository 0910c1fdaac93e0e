#include "apps/strata/mesh_parts.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <utility>

#include "apps/commands/choice_words.h"
#include "mesh/split_parts.h"
#include "strata/mesh/colours/surface_colours.h"

namespace strata::apps {
namespace {

using csg::BoundaryParts;
using csg::InputFacts;

/// The colour in the middle of each triangle; empty where the file gives no colours.
Result<std::vector<glm::u8vec4>> triangle_colours(const InputFacts& facts, const TriangleSoup& mesh,
                                                  const Execution& execution) {
  std::vector<glm::u8vec4> colours;
  if (!facts.attributes.coloured()) return colours;
  SurfaceColourOptions options;
  const double each =
      facts.area / static_cast<double>(std::max<std::size_t>(1, mesh.triangles.size()));
  options.footprint = glm::dvec3(std::sqrt(std::max(each, 1e-300)));
  const auto surface = SurfaceColours::make(mesh, facts.attributes, options, execution);
  if (!surface) {
    return fail(surface.error().code, "{}: {}", facts.path, surface.error().message);
  }
  colours.resize(mesh.triangles.size());
  constexpr std::size_t kRange = 1 << 12;
  parallel_for(execution, (colours.size() + kRange - 1) / kRange, [&](std::size_t r, int) {
    auto probe = surface->probe();
    const std::size_t end = std::min(colours.size(), (r + 1) * kRange);
    for (std::size_t t = r * kRange; t < end; ++t) {
      colours[t] = probe.colour(static_cast<std::uint32_t>(t), glm::dvec3(1.0 / 3));
    }
  });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return colours;
}

void tell_colours(const InputFacts& facts, BoundaryParts parts, Session& session) {
  const MeshAttributes& all = facts.attributes;
  if (!all.coloured()) {
    if (parts != BoundaryParts::kColours) return;
    session.warn("no-colours", fmt::format("{}: no colours are given", facts.path));
  } else if (!all.vertex_colours.empty() || all.corner_colours || !all.textures.empty()) {
    session.warn(
        "face-colours",
        fmt::format("{}: each face gets one colour, of its middle, in place of {}", facts.path,
                    all.textures.empty() ? "colours of vertices" : "textures"));
  }
}

/// The parts of one mesh among all.
class FileParts {
 public:
  FileParts(csg::FaceParts& all, BoundaryParts parts, bool many_files)
      : all_(all), named_(parts == BoundaryParts::kSolids), many_(many_files) {}

  /// @return the part of each triangle; empty: the mesh is one part, without a colour
  Result<std::vector<std::uint32_t>> add(const InputFacts& facts, const TriangleSoup& mesh,
                                         const Execution& execution) {
    auto colours = triangle_colours(facts, mesh, execution);
    if (!colours) return tl::unexpected(colours.error());
    const MeshAttributes& all = facts.attributes;
    std::vector<std::uint32_t> result;
    if (colours->empty() && (!named_ || all.parts.size() < 2)) return result;
    std::vector<std::uint32_t> parts(mesh.triangles.size(), MeshAttributes::kNone);
    if (named_) parts = detail::parts_of_triangles(mesh, all);
    // By part and colour, which the order of triangles has no say in.
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> places;
    const auto key = [&](std::size_t t) {
      return std::pair(parts[t], colours->empty() ? 0 : packed((*colours)[t]));
    };
    for (std::size_t t = 0; t < parts.size(); ++t) places.try_emplace(key(t), 0);
    for (auto& [part_and_colour, place] : places) {
      place = static_cast<std::uint32_t>(all_.parts.size());
      all_.parts.push_back({named_ ? name_of(facts, part_and_colour.first) : std::string(), {}});
      if (!colours->empty()) {
        all_.parts.back().colour = unpacked(part_and_colour.second);
      }
    }
    result.reserve(parts.size());
    for (std::size_t t = 0; t < parts.size(); ++t) result.push_back(places.at(key(t)));
    return result;
  }

 private:
  static std::uint32_t packed(const glm::u8vec4& c) {
    return std::uint32_t{c.r} << 24 | std::uint32_t{c.g} << 16 | std::uint32_t{c.b} << 8 | c.a;
  }
  static glm::vec4 unpacked(std::uint32_t c) {
    return glm::vec4(c >> 24, c >> 16 & 255, c >> 8 & 255, c & 255) / 255.0f;
  }
  [[nodiscard]] std::string name_of(const InputFacts& facts, std::uint32_t part) const {
    if (part == MeshAttributes::kNone) return facts.path;
    const std::string& name = facts.attributes.parts[part].name;
    return many_ ? facts.path + ":" + name : name;
  }

  csg::FaceParts& all_;
  bool named_, many_;
};

}  // namespace

Result<csg::FaceParts> face_parts(const csg::Tree& tree, std::span<const InputFacts> facts,
                                  BoundaryParts parts, Session& session,
                                  const Execution& execution) {
  csg::FaceParts result;
  if (parts == BoundaryParts::kOne) return result;
  result.of_triangles.resize(tree.solids().size());
  FileParts files(result, parts, facts.size() > 1);
  for (const InputFacts& file : facts) {
    if (file.is_scene) continue;
    const auto of_file = [&](const csg::Solid& solid) {
      return solid.mesh && solid.name == file.path;
    };
    const auto first = std::find_if(tree.solids().begin(), tree.solids().end(), of_file);
    if (first == tree.solids().end()) continue;  // the expression does not use it
    tell_colours(file, parts, session);
    auto made = files.add(file, *first->mesh, execution);
    if (!made) return tl::unexpected(made.error());
    for (std::size_t s = 0; s < tree.solids().size(); ++s) {
      if (of_file(tree.solids()[s])) result.of_triangles[s] = *made;
    }
  }
  return result;
}

LengthUnit unit_of_output(const csg::SceneInput& input) {
  const double metres = csg::world_unit(input);
  for (const auto& [word, unit] : kLengthWords) {
    if (metres_of(unit) == metres) return unit;
  }
  return LengthUnit::kMillimetre;
}

}  // namespace strata::apps
