#include "contour/cell_vertex.h"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>

// After: T. Ju, F. Losasso, S. Schaefer, J. Warren: Dual contouring of Hermite data, 2002. We
// differ: planes are those of triangles, without the error of samples, so that small angles between
// them count; a best place outside the cell is replaced by one that small angles count less for.

namespace strata::contouring {
namespace {

/// Weight of the distance from the mean beside that of one plane. The first moves a corner of
/// planes 1 degree apart by 1/30 of a cell's side times 1e-3, far below half a step; with the
/// second, planes less than about 8 degrees apart are nearly one.
constexpr double kSharp = 1e-7, kBlunt = 0.02;
/// Normals this close are one plane: doubles of coordinates below 2^24 steps know them to 2^-48.
constexpr double kSameNormal = 1e-9;

glm::dvec3 mean_of(std::span<const CellCut> cuts) {
  glm::dvec3 sum(0.0);
  for (const CellCut& cut : cuts) sum += cut.point;
  return sum / static_cast<double>(cuts.size());
}

/// The nearest step to a coordinate, within bounds.
int rounded(double place, int low, int high, bool& clamped) {
  const double step = place + 0.5;
  if (step >= low && step < high + 1) return static_cast<int>(step);
  clamped = true;
  return step < low ? low : high;
}
CellVertex rounded(const glm::dvec3& place, const CellBounds& bounds) {
  CellVertex result;
  result.at = {rounded(place.x, bounds.low.x, bounds.high.x, result.clamped),
               rounded(place.y, bounds.low.y, bounds.high.y, result.clamped),
               rounded(place.z, bounds.low.z, bounds.high.z, result.clamped)};
  return result;
}

/// The different planes of a cell.
struct Planes {
  std::array<Plane, 12> at;
  std::size_t count = 0;

  void add(const Plane& plane) {
    if (plane.normal == glm::dvec3(0.0)) return;
    for (std::size_t i = 0; i < count; ++i) {
      const glm::dvec3 apart = glm::cross(at[i].normal, plane.normal);
      if (glm::dot(apart, apart) < kSameNormal * kSameNormal) return;
    }
    at[count++] = plane;
  }
};

/// Solves (sum of n n^T + weight) x = sum of n (d - n . mean), by L D L^T, for the step from the
/// mean.
glm::dvec3 least_squares(const Planes& planes, const glm::dvec3& mean, double weight) {
  double xx = weight, yy = weight, zz = weight, xy = 0, xz = 0, yz = 0;
  glm::dvec3 right(0.0);
  for (std::size_t i = 0; i < planes.count; ++i) {
    const glm::dvec3& n = planes.at[i].normal;
    xx += n.x * n.x, yy += n.y * n.y, zz += n.z * n.z;
    xy += n.x * n.y, xz += n.x * n.z, yz += n.y * n.z;
    right += n * (planes.at[i].offset - glm::dot(n, mean));
  }
  const double l21 = xy / xx, l31 = xz / xx;
  const double d2 = yy - l21 * xy;
  const double l32 = (yz - l31 * xy) / d2;
  const double d3 = zz - l31 * xz - l32 * l32 * d2;
  const double y1 = right.x, y2 = right.y - l21 * y1, y3 = right.z - l31 * y1 - l32 * y2;
  const double z = y3 / d3, y = y2 / d2 - l32 * z;
  return {y1 / xx - l21 * y - l31 * z, y, z};
}

}  // namespace

CellVertex mean_vertex(std::span<const CellCut> cuts, const CellBounds& bounds) {
  CellVertex result = rounded(mean_of(cuts), bounds);
  result.clamped = false;
  return result;
}

CellVertex feature_vertex(std::span<const CellCut> cuts, const CellBounds& bounds) {
  const glm::dvec3 mean = mean_of(cuts);
  Planes planes;
  for (const CellCut& cut : cuts) planes.add(cut.plane);
  if (planes.count == 0) return mean_vertex(cuts, bounds);
  if (planes.count == 1) {
    const glm::dvec3& n = planes.at[0].normal;
    return rounded(mean + n * (planes.at[0].offset - glm::dot(n, mean)), bounds);
  }
  const CellVertex sharp = rounded(mean + least_squares(planes, mean, kSharp), bounds);
  if (!sharp.clamped) return sharp;
  CellVertex blunt = rounded(mean + least_squares(planes, mean, kBlunt), bounds);
  blunt.clamped = true;
  return blunt;
}

}  // namespace strata::contouring
