#include "voxelize/output/grid_text.h"

#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "core/letters.h"

namespace strata {
namespace {

/// Of an axis of a named space: 1 for right, anterior, superior; -1 for left, posterior, inferior.
/// The axes are in this order in all spaces that are known here.
std::optional<std::array<double, 3>> signs_of(std::string_view space) {
  constexpr std::string_view kNames[3][2] = {
      {"left", "right"}, {"posterior", "anterior"}, {"inferior", "superior"}};
  const std::string text = lower_case(std::string(space));
  std::array<double, 3> signs{};
  if (text.size() == 3) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t side = 0; side < 2; ++side) {
        if (text[axis] == kNames[axis][side][0]) signs[axis] = side == 0 ? -1.0 : 1.0;
      }
    }
  } else {
    std::size_t at = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string_view name = std::string_view(text).substr(at, text.find('-', at) - at);
      for (std::size_t side = 0; side < 2; ++side) {
        if (name == kNames[axis][side]) signs[axis] = side == 0 ? -1.0 : 1.0;
      }
      at += name.size() + 1;
      if (at > text.size() && axis < 2) return std::nullopt;
    }
  }
  if (signs[0] == 0.0 || signs[1] == 0.0 || signs[2] == 0.0) return std::nullopt;
  return signs;
}

}  // namespace

WorldAxes world_axes(const VoxelGrid& grid, const GridFrame& frame, std::string_view space) {
  WorldAxes axes;
  axes.direction = frame.direction;
  const auto from = signs_of(frame.space), to = signs_of(space);
  if (from && to) {
    for (std::size_t row = 0; row < 3; ++row) {
      if ((*from)[row] == (*to)[row]) continue;
      for (int column = 0; column < 3; ++column) {
        double& number = axes.direction[column][static_cast<int>(row)];
        number = 0.0 - number;
      }
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    axes.steps[axis] = axes.direction[axis] * grid.voxel_size[axis] + 0.0;  // no -0
  }
  axes.centre = axes.direction * (grid.origin + 0.5 * grid.voxel_size);
  return axes;
}

std::string_view unit_name(double metres) {
  constexpr std::pair<double, std::string_view> kUnits[] = {
      {1e-3, "mm"},   {1.0, "m"},     {1e-2, "cm"}, {1e-6, "um"},
      {0.0254, "in"}, {0.3048, "ft"}, {1e-9, "nm"}};
  for (const auto& [length, name] : kUnits) {
    if (std::abs(metres - length) <= 1e-9 * length) return name;
  }
  return {};
}

std::string one_line(std::string text) {
  for (char& letter : text) {
    if (static_cast<unsigned char>(letter) < ' ') letter = ' ';
  }
  return text;
}

}  // namespace strata
