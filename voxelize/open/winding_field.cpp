#include "voxelize/open/winding_field.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>
#include <utility>

#include "raster/tile_bins.h"

// This work is based on:
// A. Jacobson, L. Kavan, O. Sorkine-Hornung: Robust Inside-Outside Segmentation using Generalized
// Winding Numbers, 2013: the rule; a surface seen from outside its hull is as good as its caps.
// G. Barill, N. G. Dickson, R. Schmidt, D. I. W. Levin, A. Jacobson: Fast Winding Numbers for Soups
// and Clouds, 2018: far triangles as dipoles.
//
// We differ: the mesh itself is never summed up, only its caps are; cubes of voxels in which the
// sum keeps away from halves are done as a whole; and far dipoles are a series around a cube.

namespace strata {
namespace {

constexpr double kFull = 4 * std::numbers::pi;   // the solid angle of everything
constexpr int kLargest = kTileSide, kLeast = 4;  // sides of cubes, in voxels
constexpr std::size_t kLevels = 5;               // 64, 32, 16, 8, 4
static_assert(kLargest >> (kLevels - 1) == kLeast &&
              kLeast * kLeast * kLeast == WindingPoints::kMost);
/// Groups of caps farther than this many of their radii are seen as a dipole, single ones sooner.
/// What that neglects is about the square of radius / distance for a group, and a fifth of it for a
/// triangle: a sixteenth of an angle that is a fiftieth of the full one at most.
constexpr double kFar = 4, kFarCap = 2;
/// Far nodes farther from a cube's middle than this many of its radii are a series around it.
constexpr double kSeries = 8;
/// A winding number this close to a half is one: what sums of dipoles and series may be off by.
constexpr double kHalf = 1e-3;
/// Caps within this many radii of a cube's middle are close by.
constexpr double kClose = 2;
/// Between the corners of a cube that no cap meets the angle is between theirs, but for this share
/// of what they differ by.
constexpr double kBulge = 0.25;

/// The whole number next to -angle / 4 pi; halves go to 0.
int rounded(double angle) {
  const double w = -angle / kFull;
  return static_cast<int>(w < 0 ? w - (0.5 - kHalf) : w + (0.5 - kHalf));
}

/// Values at the voxels of a cube of side kLeast from those at its corners, x fastest.
void interpolate(const double (&corner)[8], double (&value)[WindingPoints::kMost]) {
  const auto between = [](double a, double b, int at) {
    const double share = static_cast<double>(at) / (kLeast - 1);
    return a + share * (b - a);
  };
  for (int x = 0; x < kLeast; ++x) {
    double along_x[4];
    for (int k = 0; k < 4; ++k) along_x[k] = between(corner[2 * k], corner[2 * k + 1], x);
    for (int y = 0; y < kLeast; ++y) {
      const double low = between(along_x[0], along_x[1], y),
                   high = between(along_x[2], along_x[3], y);
      for (int z = 0; z < kLeast; ++z) {
        value[x + kLeast * (y + kLeast * z)] = between(low, high, z);
      }
    }
  }
}

double distance_to_segment(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 along = b - a, to = p - a;
  const double length = glm::dot(along, along);
  const double t = length > 0 ? std::clamp(glm::dot(to, along) / length, 0.0, 1.0) : 0.0;
  return glm::length(to - t * along);
}

/// Distance of a triangle from the origin.
double distance_to(const glm::dvec3 (&t)[3], const glm::dvec3& normal) {
  double nearest = 1e300;
  bool above = true;  // the origin lies above or below the triangle
  for (int i = 0; i < 3; ++i) {
    const glm::dvec3 &a = t[i], &b = t[(i + 1) % 3];
    nearest = std::min(nearest, distance_to_segment(glm::dvec3(0), a, b));
    above = above && glm::dot(glm::cross(b - a, -a), normal) >= 0;
  }
  return above ? std::min(nearest, std::abs(glm::dot(t[0], normal)) / glm::length(normal))
               : nearest;
}

}  // namespace

void WindingField::Scratch::Level::add_far(std::uint32_t index, const WindingNode& node,
                                           const glm::dvec3& to, double distance) {
  if (distance > series) {
    farther.add(node.dipole, to);
  } else {
    far.push_back(index);
  }
}

WindingField::WindingField(const LatticeMesh& mesh, std::span<const glm::uvec3> caps,
                           const VoxelGrid& grid, const std::stop_token& stop)
    : dims_(grid.dims),
      scale_(grid.voxel_size /
             std::max({grid.voxel_size.x, grid.voxel_size.y, grid.voxel_size.z})) {
  caps_.reserve(caps.size());
  for (const glm::uvec3& t : caps) {
    WindingCap cap;
    for (int i = 0; i < 3; ++i) {
      cap.lattice[i] = mesh.vertices[t[i]];
      cap.corners[i] = cap.lattice[i];
    }
    const glm::dvec3 e = (cap.corners[1] - cap.corners[0]) * scale_,
                     f = (cap.corners[2] - cap.corners[0]) * scale_;
    cap.normal = glm::cross(e, f);
    // A dozen roundings of 2^-53, of differences of lattice positions, which are exact.
    cap.doubt = 4e-15 * glm::length(e) * glm::length(f);
    if (glm::dot(cap.normal, cap.normal) > 0) caps_.push_back(cap);
  }
  if (caps_.empty()) return;
  nodes_.reserve(2 * caps_.size());
  nodes_.emplace_back();
  split(0, 0, static_cast<std::uint32_t>(caps_.size()), stop);
}

/// Makes the node of caps [first, first + count), and those below it.
void WindingField::split(std::uint32_t node, std::uint32_t first, std::uint32_t count,
                         const std::stop_token& stop) {
  const std::span<WindingCap> caps = std::span(caps_).subspan(first, count);
  const auto middle_of = [](const WindingCap& cap) {
    return (cap.corners[0] + cap.corners[1] + cap.corners[2]) / 3.0;
  };
  WindingNode result;
  glm::dvec3 low(1e300), high(-1e300), sum(0.0);
  for (const WindingCap& cap : caps) {
    const glm::dvec3 middle = middle_of(cap);
    const double area = glm::length(cap.normal) / 2;
    low = glm::min(low, middle), high = glm::max(high, middle);
    sum += area * middle;
    result.area += area;
    result.dipole += cap.normal / 2.0;
  }
  result.middle = sum / result.area;
  for (const WindingCap& cap : caps) {
    for (const glm::dvec3& corner : cap.corners) {
      result.radius = std::max(result.radius, glm::length((corner - result.middle) * scale_));
    }
  }
  if (count == 1 || (count > 4096 && stop.stop_requested())) {
    result.first = first;
    result.count = count;
    nodes_[node] = result;
    return;
  }
  const glm::dvec3 extent = (high - low) * scale_;
  const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
  // A stable order, so that sums do not depend on how the library sorts.
  std::stable_sort(caps.begin(), caps.end(), [&](const WindingCap& a, const WindingCap& b) {
    return middle_of(a)[axis] < middle_of(b)[axis];
  });
  result.first = static_cast<std::uint32_t>(nodes_.size());
  nodes_[node] = result;
  nodes_.resize(nodes_.size() + 2);
  split(result.first, first, count / 2, stop);
  split(result.first + 1, first + count / 2, count - count / 2, stop);
}

/// Sorts what is near a cube from what is far, going on from the cube around it. Nothing: the angle
/// stays below a half. Met: a cap may meet the cube's ball. Otherwise the angle is smooth there.
WindingField::Sight WindingField::look(const Cube& cube, Scratch& scratch) const {
  Scratch::Level& here = scratch.levels[cube.level + 1];
  const Scratch::Level& around = scratch.levels[cube.level];
  const double half = cube.size * kLatticeSteps / 2.0;
  here.radius = half * glm::length(scale_);
  here.near.clear();
  here.far.clear();
  here.far_bound = around.far_bound;
  here.farther = around.farther;
  here.farther.move(glm::dvec3(cube.corner) * double{kLatticeSteps} + half, scale_);
  // The last cubes have too few voxels to be worth a series of their own.
  here.series = cube.size > kLeast ? kSeries * here.radius : 1e300;
  if (cube.size == kLeast) {
    here.far = around.far;
  } else {
    for (const std::uint32_t index : around.far) {
      const glm::dvec3 to = (nodes_[index].middle - here.farther.middle) * scale_;
      here.add_far(index, nodes_[index], to, glm::length(to));
    }
  }
  scratch.stack.assign(around.near.rbegin(), around.near.rend());
  // Small groups that meet the ball are left to the cubes within; those that do not, are looked at.
  Sight sight = sort(here, cube.size == kLeast, scratch);
  if (cube.size > kLeast && sight == Sight::kSmooth) {
    scratch.stack.assign(here.near.rbegin(), here.near.rend());
    here.near.clear();
    sight = sort(here, true, scratch);
  }
  return sight;
}

/// Sorts the nodes on the stack, down to single caps or to groups much smaller than the ball.
WindingField::Sight WindingField::sort(Scratch::Level& here, bool single, Scratch& scratch) const {
  bool met = false;
  double near_bound = 0;
  while (!scratch.stack.empty()) {
    const std::uint32_t index = scratch.stack.back();
    const WindingNode& node = nodes_[index];
    scratch.stack.pop_back();
    const glm::dvec3 to = (node.middle - here.farther.middle) * scale_;
    const double distance = glm::length(to), free = distance - here.radius - node.radius;
    if (distance - here.radius > (node.count == 0 ? kFar : kFarCap) * node.radius) {
      here.far_bound += node.area / (free * free);
      here.add_far(index, node, to, distance);
      continue;
    }
    if (node.count == 0 && (single || node.radius > here.radius / 2)) {
      scratch.stack.insert(scratch.stack.end(), {node.first + 1, node.first});
      continue;
    }
    here.near.push_back(index);
    near_bound += free > 0 ? std::min(kFull / 2, node.area / (free * free)) : kFull / 2;
    if (met || free > 0) continue;
    met = true;
    if (node.count > 0) {
      met = cap_distance(caps_[node.first], here.farther.middle) <= here.radius;
    }
  }
  if (met) return Sight::kMet;
  return near_bound + here.far_bound < 0.9 * kFull / 2 ? Sight::kNothing : Sight::kSmooth;
}

void WindingField::visit(const Cube& cube, Scratch& scratch) const {
  for (int axis = 0; axis < 3; ++axis) {
    if (cube.corner[axis] >= dims_[axis]) return;
  }
  const Sight sight = look(cube, scratch);
  if (sight == Sight::kMet || (sight == Sight::kSmooth && !fill(cube, scratch))) {
    if (cube.size == kLeast) {
      visit_voxels(cube, scratch);
    } else {
      const int size = cube.size / 2;
      for (int i = 0; i < 8; ++i) {
        const glm::ivec3 corner = cube.corner + size * glm::ivec3(i & 1, i >> 1 & 1, i >> 2);
        visit({cube.frame, cube.tile, corner, size, cube.level + 1}, scratch);
      }
    }
  }
}

/// Distance of a cap from a point.
double WindingField::cap_distance(const WindingCap& cap, const glm::dvec3& from) const {
  const glm::dvec3 t[3] = {(cap.corners[0] - from) * scale_, (cap.corners[1] - from) * scale_,
                           (cap.corners[2] - from) * scale_};
  return distance_to(t, cap.normal);
}

/// Whether the cap of a leaf is at most `distance` from a point. The ball around the cap, and the
/// corner of it that is the nearest, mostly tell.
bool WindingField::within(const WindingNode& leaf, const glm::dvec3& from, double distance) const {
  constexpr double kSure = 1e-9;  // far more than roundings, and no more than that is undecided
  const WindingCap& cap = caps_[leaf.first];
  const double middle = glm::length((leaf.middle - from) * scale_);
  if ((middle - leaf.radius) * (1 - kSure) > distance * (1 + kSure)) return false;
  double nearest = middle;
  for (const glm::dvec3& corner : cap.corners) {
    nearest = std::min(nearest, glm::length((corner - from) * scale_));
  }
  if (nearest * (1 + kSure) < distance * (1 - kSure)) return true;
  return cap_distance(cap, from) <= distance;
}

/// Every step-th voxel of the cube along all axes, x fastest.
void WindingField::place(const Cube& cube, int step, WindingPoints& points) {
  points.count = 0;
  for (int z = 0; z < cube.size; z += step) {
    for (int y = 0; y < cube.size; y += step) {
      for (int x = 0; x < cube.size; x += step) {
        const std::size_t i = points.count++;
        points.x[i] = (cube.corner.x + x) * kLatticeSteps + kLatticeSteps / 2;
        points.y[i] = (cube.corner.y + y) * kLatticeSteps + kLatticeSteps / 2;
        points.z[i] = (cube.corner.z + z) * kLatticeSteps + kLatticeSteps / 2;
      }
    }
  }
}

/// Gives all voxels of a cube the same number. False where its corners do not tell.
bool WindingField::fill(const Cube& cube, Scratch& scratch) const {
  const Scratch::Level& here = scratch.levels[cube.level + 1];
  WindingPoints& points = scratch.points;
  place(cube, cube.size - 1, points);
  solid_angles(caps_, nodes_, caps_of(here.near, scratch.near), here.far, here.farther, scale_,
               points);
  const auto [low, high] = std::minmax_element(points.angle, points.angle + points.count);
  const double bulge = kBulge * (*high - *low);
  const int number = rounded(*low - bulge);
  if (rounded(*high + bulge) != number) return false;
  if (number == 0) return true;
  const AxisFrame& frame = cube.frame;
  const glm::ivec3 end = glm::min(cube.corner + cube.size, dims_);
  for (int v = cube.corner[frame.v]; v < end[frame.v]; ++v) {
    for (int u = cube.corner[frame.u]; u < end[frame.u]; ++u) {
      const int pixel = (v - cube.tile[frame.v]) * kTileSide + u - cube.tile[frame.u];
      scratch.runs.push_back(
          {static_cast<std::uint32_t>(pixel), cube.corner[frame.w], end[frame.w], number});
    }
  }
  return true;
}

/// The caps of leaves.
std::span<const std::uint32_t> WindingField::caps_of(std::span<const std::uint32_t> leaves,
                                                     std::vector<std::uint32_t>& caps) const {
  caps.clear();
  for (const std::uint32_t leaf : leaves) caps.push_back(nodes_[leaf].first);
  return caps;
}

void WindingField::visit_voxels(const Cube& cube, Scratch& scratch) const {
  const Scratch::Level& here = scratch.levels[cube.level + 1];
  const auto all = caps_of(here.near, scratch.near);
  // The angle of all but the caps close by is smooth, so that its corners tell about it.
  scratch.close.clear();
  scratch.rest.clear();
  for (const std::uint32_t leaf : here.near) {
    const bool close = within(nodes_[leaf], here.farther.middle, kClose * here.radius);
    (close ? scratch.close : scratch.rest).push_back(nodes_[leaf].first);
  }
  WindingPoints& points = scratch.points;
  place(cube, kLeast - 1, points);
  solid_angles(caps_, nodes_, scratch.rest, here.far, here.farther, scale_, points);
  double corner[8];
  std::copy_n(points.angle, 8, corner);
  const auto [low, high] = std::minmax_element(corner, corner + 8);
  const double bulge = kBulge * (*high - *low);
  place(cube, 1, points);
  solid_angles(caps_, nodes_, scratch.close, {}, {}, scale_, points);
  int number[WindingPoints::kMost];
  std::uint8_t open[WindingPoints::kMost];
  std::size_t count = 0;
  double rest[WindingPoints::kMost];
  interpolate(corner, rest);
  for (std::size_t i = 0; i < points.count; ++i) {
    number[i] = rounded(points.angle[i] + rest[i] - bulge);
    if (rounded(points.angle[i] + rest[i] + bulge) == number[i]) continue;
    open[count] = static_cast<std::uint8_t>(i);
    points.x[count] = points.x[i], points.y[count] = points.y[i], points.z[count] = points.z[i];
    ++count;
  }
  if (count > 0) {
    points.count = (count + WindingPoints::kStep - 1) / WindingPoints::kStep * WindingPoints::kStep;
    solid_angles(caps_, nodes_, all, here.far, here.farther, scale_, points);
    for (std::size_t i = 0; i < count; ++i) number[open[i]] = rounded(points.angle[i]);
  }
  add_runs(cube, number, scratch);
}

/// Adds the numbers of the voxels of a cube of side kLeast, x fastest.
void WindingField::add_runs(const Cube& cube, const int (&number)[WindingPoints::kMost],
                            Scratch& scratch) const {
  constexpr int kSteps[] = {1, kLeast, kLeast * kLeast};
  const AxisFrame& frame = cube.frame;
  const glm::ivec3 size = glm::min(glm::ivec3(kLeast), dims_ - cube.corner);
  const int w0 = cube.corner[frame.w];
  for (int v = 0; v < size[frame.v]; ++v) {
    for (int u = 0; u < size[frame.u]; ++u) {
      const int* const column = number + u * kSteps[frame.u] + v * kSteps[frame.v];
      const int pixel = (cube.corner[frame.v] + v - cube.tile[frame.v]) * kTileSide +
                        cube.corner[frame.u] + u - cube.tile[frame.u];
      for (int w = 0; w < size[frame.w];) {
        const int first = w, here = column[w * kSteps[frame.w]];
        while (w < size[frame.w] && column[w * kSteps[frame.w]] == here) ++w;
        if (here == 0) continue;
        scratch.runs.push_back({static_cast<std::uint32_t>(pixel), w0 + first, w0 + w, here});
      }
    }
  }
}

/// The runs, sorted by pixel. Those of a pixel are there in order: cubes are visited like that.
const std::vector<WindingField::Scratch::Run>& WindingField::sorted_runs(Scratch& scratch) {
  auto& next = scratch.next;
  next.assign(kTilePixels, 0);
  for (const Scratch::Run& run : scratch.runs) ++next[run.pixel];
  std::uint32_t sum = 0;
  for (std::uint32_t& place : next) sum += std::exchange(place, sum);
  scratch.sorted.resize(scratch.runs.size());
  for (const Scratch::Run& run : scratch.runs) scratch.sorted[next[run.pixel]++] = run;
  return scratch.sorted;
}

std::span<const WindingStep> WindingField::steps(Axis axis, int tu, int tv,
                                                 const std::stop_token& stop,
                                                 Scratch& scratch) const {
  scratch.runs.clear();
  scratch.steps.clear();
  if (caps_.empty()) return {};
  const AxisFrame frame(axis);
  scratch.levels.resize(kLevels + 1);
  scratch.levels[0].near.assign(1, 0);
  glm::ivec3 tile{0};
  tile[frame.u] = tu * kTileSide, tile[frame.v] = tv * kTileSide;
  for (glm::ivec3 corner = tile; corner[frame.w] < dims_[frame.w]; corner[frame.w] += kLargest) {
    if (stop.stop_requested()) return {};
    visit({frame, tile, corner, kLargest, 0}, scratch);
  }
  const auto& runs = sorted_runs(scratch);
  for (std::size_t i = 0; i < runs.size();) {
    const Scratch::Run first = runs[i];
    std::int32_t end = first.end;
    for (++i; i < runs.size() && runs[i].pixel == first.pixel && runs[i].begin == end &&
              runs[i].number == first.number;
         ++i) {
      end = runs[i].end;
    }
    scratch.steps.push_back({first.pixel, first.begin, first.number});
    scratch.steps.push_back({first.pixel, end, -first.number});
  }
  return scratch.steps;
}

}  // namespace strata
