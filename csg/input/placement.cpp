// Where meshes and scenes come to lie in the world: unit, turn, scale, translation.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <string>

#include <fmt/format.h>

#include "csg/input/input_parts.h"
#include "strata/csg/input/scene_input.h"
#include "strata/mesh/soup_tools.h"

namespace strata::csg {
namespace {

constexpr double kMillimetre = 1e-3, kMetre = 1.0;

// Parts that are made by printers and mills are 0.5 to 2000 mm long: a nozzle is 0.4 wide, and
// machines reach a metre or two. So are the units of models that are scaled to a length of 1 or 2,
// as research has them. A ring or a bolt in metres is below 0.1, a house or a car in millimetres
// above 2000, a small part in micrometres too.
constexpr double kLeastLength = 0.5, kMostLength = 2000.0;

/// What a format says of units by itself.
enum class FormatUnit { kNone, kMillimetres, kMetres };

FormatUnit unit_of_format(const std::string& path, const SceneInput& input) {
  const InputKind kind = kind_of(path, input);
  if (kind.is_scene) return FormatUnit::kNone;
  const MeshFormat format = kind.format;
  if (format == MeshFormat::k3mf || format == MeshFormat::kAmf) return FormatUnit::kMillimetres;
  return format == MeshFormat::kGltf ? FormatUnit::kMetres : FormatUnit::kNone;
}

/// What a length is called as a unit.
struct UnitName {
  double metres;
  std::string_view symbol, name;
};
/// Null when it has no name.
const UnitName* unit_named(double metres) {
  static constexpr UnitName kNames[] = {{1e-6, "um", "micrometre"}, {1e-3, "mm", "millimetre"},
                                        {1e-2, "cm", "centimetre"}, {1.0, "m", "metre"},
                                        {0.0254, "in", "inch"},     {0.3048, "ft", "foot"}};
  for (const UnitName& unit : kNames) {
    if (std::abs(unit.metres - metres) <= 1e-9 * unit.metres) return &unit;
  }
  return nullptr;
}

/// Factor and divisor, one of them 1: so that a division by 1000 is one, and rounded once.
struct UnitStep {
  double factor = 1.0, divisor = 1.0;
};
UnitStep unit_step(double from, double to) {
  if (from <= 0.0 || to <= 0.0 || from == to) return {};
  if (from > to) return {unit_ratio(from, to), 1.0};
  return {1.0, unit_ratio(to, from)};
}

bool turns(const MeshPlacement& placement, bool y_up) {
  using Up = MeshPlacement::Up;
  return placement.up == Up::kY || (placement.up == Up::kFile && y_up);
}

bool is_finite(const glm::dvec3& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

tl::unexpected<Error> too_far(const std::string& path) {
  return fail(ErrorCode::kGeometry,
              "{}: --scale, --translate or --unit moves it beyond the range of double", path);
}

}  // namespace

double unit_ratio(double from_metres, double to_metres) {
  // All units in use are whole multiples of 100 nm; their quotient is rounded once.
  constexpr double kSmall = 1e7;
  const double from = std::round(from_metres * kSmall), to = std::round(to_metres * kSmall);
  const bool whole = from >= 1.0 && to >= 1.0 && std::abs(from - from_metres * kSmall) < 1e-6 &&
                     std::abs(to - to_metres * kSmall) < 1e-6;
  return whole ? from / to : from_metres / to_metres;
}

double unit_factor(double file_metres, double world_metres) {
  return file_metres > 0.0 && world_metres > 0.0 ? unit_ratio(file_metres, world_metres) : 1.0;
}

std::string_view unit_symbol(double metres) {
  const UnitName* unit = unit_named(metres);
  return unit != nullptr ? unit->symbol : "";
}

double world_unit(const SceneInput& input) {
  if (input.placement.unit_metres > 0.0) return input.placement.unit_metres;
  double unit = 0.0;
  for (const std::string& path : input.files) {
    const FormatUnit says = unit_of_format(path, input);
    if (says == FormatUnit::kMillimetres) return kMillimetre;
    if (says == FormatUnit::kMetres) unit = kMetre;
  }
  return unit;
}

Result<void> place_mesh(const std::string& path, const MeshReadStats& stats,
                        const SceneInput& input, TriangleSoup& soup, const Execution& execution) {
  const MeshPlacement& placement = input.placement;
  const UnitStep unit = unit_step(stats.unit_metres, world_unit(input));
  const bool turned = turns(placement, stats.y_up);
  const bool scaled = placement.scale != glm::dvec3(1.0);
  const bool moved = placement.translate != glm::dvec3(0.0);
  if (unit.factor == 1.0 && unit.divisor == 1.0 && !turned && !scaled && !moved) return {};
  constexpr std::size_t kBlock = std::size_t{1} << 15;
  const std::size_t count = soup.positions.size();
  std::atomic<bool> beyond{false};
  parallel_for(execution, (count + kBlock - 1) / kBlock, [&](std::size_t block, int) {
    const std::size_t end = std::min(count, (block + 1) * kBlock);
    bool finite = true;
    for (std::size_t i = block * kBlock; i < end; ++i) {
      glm::dvec3 p = soup.positions[i];
      if (!is_finite(p)) continue;  // no triangle uses it
      if (unit.factor != 1.0) p *= unit.factor;
      if (unit.divisor != 1.0) p /= unit.divisor;
      if (turned) p = {p.x, -p.z, p.y};
      if (scaled) p *= placement.scale;
      if (moved) p += placement.translate;
      finite = finite && is_finite(p);
      soup.positions[i] = p;
    }
    if (!finite) beyond = true;
  });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  if (beyond) return too_far(path);
  const glm::dvec3 s = placement.scale;
  if ((s.x < 0.0) != ((s.y < 0.0) != (s.z < 0.0))) reverse_orientation(soup);
  return {};
}

void turn_mesh(const glm::dmat3& turn, TriangleSoup& soup, const Execution& execution) {
  if (turn == glm::dmat3(1.0)) return;
  constexpr std::size_t kBlock = std::size_t{1} << 15;
  const std::size_t count = soup.positions.size();
  parallel_for(execution, (count + kBlock - 1) / kBlock, [&](std::size_t block, int) {
    const std::size_t end = std::min(count, (block + 1) * kBlock);
    for (std::size_t i = block * kBlock; i < end; ++i) soup.positions[i] = turn * soup.positions[i];
  });
  if (glm::determinant(turn) < 0.0) reverse_orientation(soup);
}

Result<void> place_scene(const std::string& path, const SceneInput& input, Scene& scene) {
  const MeshPlacement& placement = input.placement;
  const bool turned = turns(placement, false);
  if (!turned && placement.scale == glm::dvec3(1.0) && placement.translate == glm::dvec3(0.0)) {
    return {};
  }
  glm::dmat4 place(1.0);
  if (turned) {
    place[1] = {0.0, 0.0, 1.0, 0.0};   // y becomes z
    place[2] = {0.0, -1.0, 0.0, 0.0};  // z becomes -y
  }
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) place[column][row] *= placement.scale[row];
  }
  place[3] = glm::dvec4(placement.translate, 1.0);
  for (Solid& solid : scene.tree.solids()) {
    solid.world_from_mesh = place * solid.world_from_mesh;
    const Bounds box = bounds(solid);
    if (!box.empty() && (!is_finite(box.low) || !is_finite(box.high))) return too_far(path);
  }
  if (scene.view && scene.view->target) {
    scene.view->target = glm::dvec3(place * glm::dvec4(*scene.view->target, 1.0));
  }
  if (scene.view && scene.view->distance) {
    const glm::dvec3 s = placement.scale;
    *scene.view->distance *= std::max({std::abs(s.x), std::abs(s.y), std::abs(s.z)});
  }
  return {};
}

std::string unit_doubt(const MeshReadStats& stats, const SceneInput& input, const Bounds& bounds) {
  const MeshPlacement& placement = input.placement;
  if (stats.unit_metres > 0.0 || world_unit(input) > 0.0) return {};
  if (placement.scale != glm::dvec3(1.0) || bounds.empty()) return {};
  const double longest = bounds.longest_side();
  if (!(longest > 0.0) || (longest >= kLeastLength && longest <= kMostLength)) return {};
  return fmt::format("{:.3g} long; the file says nothing about units; if it is in {}", longest,
                     longest < kLeastLength
                         ? "metres, give --unit m, or --scale 1000 for millimetres"
                         : "micrometres, give --unit um, or --scale 0.001 for millimetres");
}

std::string describe_unit(double file_metres, double world_metres, const std::string& doubt) {
  if (!doubt.empty()) return "not known: " + doubt;
  const auto name = [](double metres) {
    const UnitName* unit = unit_named(metres);
    return unit != nullptr ? fmt::format("the {}", unit->name) : fmt::format("{} m", metres);
  };
  if (world_metres <= 0.0) return {};
  if (file_metres <= 0.0) return name(world_metres) + "; the file says nothing about units";
  if (file_metres == world_metres) return name(world_metres) + ", as the file says";
  return fmt::format("{}; that of the file is {}, so numbers were multiplied by {:.9g}",
                     name(world_metres), name(file_metres), unit_ratio(file_metres, world_metres));
}

}  // namespace strata::csg
