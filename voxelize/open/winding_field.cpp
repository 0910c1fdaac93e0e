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

/// Whether a triangle is at most `distance` from the origin.
bool meets_ball(const glm::dvec3 (&t)[3], const glm::dvec3& normal, double distance) {
  bool above = true;  // the origin lies above or below the triangle
  for (int i = 0; i < 3; ++i) {
    const glm::dvec3 &a = t[i], &b = t[(i + 1) % 3];
    if (distance_to_segment(glm::dvec3(0), a, b) <= distance) return true;
    above = above && glm::dot(glm::cross(b - a, -a), normal) >= 0;
  }
  return above && std::abs(glm::dot(t[0], normal)) / glm::length(normal) <= distance;
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
    : dims_(grid.dims) {
  all_.scale =
      grid.voxel_size / std::max({grid.voxel_size.x, grid.voxel_size.y, grid.voxel_size.z});
  all_.caps.reserve(caps.size());
  std::vector<std::uint32_t> vertices;
  for (const glm::uvec3& t : caps) vertices.insert(vertices.end(), {t.x, t.y, t.z});
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  all_.vertices = static_cast<std::uint32_t>(vertices.size());
  for (const glm::uvec3& t : caps) {
    WindingCap cap;
    for (int i = 0; i < 3; ++i) {
      cap.lattice[i] = mesh.vertices[t[i]];
      cap.corners[i] = cap.lattice[i];
      cap.vertices[i] = static_cast<std::uint32_t>(
          std::lower_bound(vertices.begin(), vertices.end(), t[i]) - vertices.begin());
    }
    const glm::dvec3 e = (cap.corners[1] - cap.corners[0]) * all_.scale,
                     f = (cap.corners[2] - cap.corners[0]) * all_.scale;
    cap.normal = glm::cross(e, f);
    // A dozen roundings of 2^-53, of differences of lattice positions, which are exact.
    cap.doubt = 4e-15 * glm::length(e) * glm::length(f);
    if (glm::dot(cap.normal, cap.normal) > 0) all_.caps.push_back(cap);
  }
  if (all_.caps.empty()) return;
  all_.nodes.reserve(2 * all_.caps.size());
  all_.nodes.emplace_back();
  split(0, 0, static_cast<std::uint32_t>(all_.caps.size()), stop);
}

/// Makes the node of caps [first, first + count), and those below it.
void WindingField::split(std::uint32_t node, std::uint32_t first, std::uint32_t count,
                         const std::stop_token& stop) {
  const std::span<WindingCap> caps = std::span(all_.caps).subspan(first, count);
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
      result.radius = std::max(result.radius, glm::length((corner - result.middle) * all_.scale));
    }
  }
  if (count == 1 || (count > 4096 && stop.stop_requested())) {
    result.first = first;
    result.count = count;
    all_.nodes[node] = result;
    return;
  }
  const glm::dvec3 extent = (high - low) * all_.scale;
  const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
  // A stable order, so that sums do not depend on how the library sorts.
  std::stable_sort(caps.begin(), caps.end(), [&](const WindingCap& a, const WindingCap& b) {
    return middle_of(a)[axis] < middle_of(b)[axis];
  });
  result.first = static_cast<std::uint32_t>(all_.nodes.size());
  all_.nodes[node] = result;
  all_.nodes.resize(all_.nodes.size() + 2);
  split(result.first, first, count / 2, stop);
  split(result.first + 1, first + count / 2, count - count / 2, stop);
}

/// Sorts what is near a cube from what is far, going on from the cube around it. Nothing: the angle
/// stays below a half. Met: a cap may meet the cube's ball. Otherwise the angle is smooth there.
WindingField::Sight WindingField::look(const Cube& cube, Scratch& scratch) const {
  Scratch::Level& here = scratch.levels[cube.level + 1];
  const Scratch::Level& around = scratch.levels[cube.level];
  const double half = cube.size * kLatticeSteps / 2.0;
  here.radius = half * glm::length(all_.scale);
  here.near.clear();
  here.far.clear();
  here.far_bound = around.far_bound;
  here.farther = around.farther;
  here.farther.move(glm::dvec3(cube.corner) * double{kLatticeSteps} + half, all_.scale);
  // The last cubes have too few voxels to be worth a series of their own.
  here.series = cube.size > kLeast ? kSeries * here.radius : 1e300;
  if (cube.size == kLeast) {
    here.far = around.far;
  } else {
    for (const std::uint32_t index : around.far) {
      const glm::dvec3 to = (all_.nodes[index].middle - here.farther.middle) * all_.scale;
      here.add_far(index, all_.nodes[index], to, glm::length(to));
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
    const WindingNode& node = all_.nodes[index];
    scratch.stack.pop_back();
    const glm::dvec3 to = (node.middle - here.farther.middle) * all_.scale;
    const double distance = glm::length(to), free = distance - here.radius - node.radius;
    if (distance - here.radius > (node.count == 0 ? kFar : kFarCap) * node.radius) {
      here.far_bound += node.area / (free * free);
      here.add_far(index, node, to, distance);
      continue;
    }
    if (node.count == 0 && (single || node.radius > here.radius / 2)) {
      scratch.stack.push_back(node.first + 1);
      scratch.stack.push_back(node.first);
      continue;
    }
    here.near.push_back(index);
    if (met) continue;
    near_bound += free > 0 ? std::min(kFull / 2, node.area / (free * free)) : kFull / 2;
    met =
        free <= 0 && (node.count == 0 || within(node, here.farther.middle, distance, here.radius));
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

/// Whether the cap of a leaf is at most `distance` from a point, `middle` from which the leaf's is.
/// The ball around the cap, the corner of it that is the nearest, and its plane mostly tell.
bool WindingField::within(const WindingNode& leaf, const glm::dvec3& from, double middle,
                          double distance) const {
  constexpr double kSure = 1e-9;  // far more than roundings, and no more than that is undecided
  if ((middle - leaf.radius) * (1 - kSure) > distance * (1 + kSure)) return false;
  if (middle * (1 + kSure) < distance * (1 - kSure)) return true;
  const WindingCap& cap = all_.caps[leaf.first];
  glm::dvec3 t[3];
  double nearest = 1e300, farthest = 0;  // squares
  for (int i = 0; i < 3; ++i) {
    t[i] = (cap.corners[i] - from) * all_.scale;
    const double square = glm::dot(t[i], t[i]);
    nearest = std::min(nearest, square), farthest = std::max(farthest, square);
  }
  if (nearest * (1 + kSure) < distance * distance * (1 - kSure)) return true;
  const double height = std::abs(glm::dot(t[0], cap.normal)), length = 2 * leaf.area;
  if (height > (distance + kSure * (distance + std::sqrt(farthest))) * length) return false;
  return meets_ball(t, cap.normal, distance);
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

/// What is seen from a cube, but the near caps.
WindingView WindingField::view_of(const Cube& cube, const Scratch& scratch) {
  const Scratch::Level& here = scratch.levels[cube.level + 1];
  return {here.farther.middle, here.radius, {}, here.far, here.farther, here.far_bound};
}

/// Whether all voxels of a cube have the same number, by its corners. Empty where the angles are
/// not exact enough to tell.
std::optional<bool> WindingField::same_number(const Cube& cube, WindingSum::Way way,
                                              Scratch& scratch, int& number) const {
  WindingPoints& points = scratch.points;
  place(cube, cube.size - 1, points);
  WindingView view = view_of(cube, scratch);
  view.near = scratch.near;
  scratch.sum.write(way, all_, view, points);
  const double off = (1 + 2 * kBulge) * *std::max_element(points.off, points.off + points.count);
  if (!(off <= 1)) return std::nullopt;
  const auto [low, high] = std::minmax_element(points.angle, points.angle + points.count);
  const double bulge = kBulge * (*high - *low), least = *low - bulge, most = *high + bulge;
  number = rounded(least - off);
  if (rounded(most + off) == number) return true;
  if (rounded(least + off) != rounded(most - off)) return false;
  return std::nullopt;
}

/// Gives all voxels of a cube the same number. False where its corners do not tell.
bool WindingField::fill(const Cube& cube, Scratch& scratch) const {
  caps_of(scratch.levels[cube.level + 1].near, scratch.near);
  int number = 0;
  auto same = same_number(cube, WindingSum::Way::kQuick, scratch, number);
  if (!same) same = same_number(cube, WindingSum::Way::kExact, scratch, number);
  if (!*same) return false;
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
void WindingField::caps_of(std::span<const std::uint32_t> leaves,
                           std::vector<std::uint32_t>& caps) const {
  caps.clear();
  for (const std::uint32_t leaf : leaves) caps.push_back(all_.nodes[leaf].first);
}

void WindingField::visit_voxels(const Cube& cube, Scratch& scratch) const {
  const Scratch::Level& here = scratch.levels[cube.level + 1];
  caps_of(here.near, scratch.near);
  // The angle of all but the caps close by is smooth, so that its corners tell about it.
  scratch.close.clear();
  scratch.rest.clear();
  for (const std::uint32_t leaf : here.near) {
    const WindingNode& node = all_.nodes[leaf];
    const double middle = glm::length((node.middle - here.farther.middle) * all_.scale);
    const bool close = within(node, here.farther.middle, middle, kClose * here.radius);
    (close ? scratch.close : scratch.rest).push_back(node.first);
  }
  int number[WindingPoints::kMost];
  Voxels left, apart;
  for (; left.count < WindingPoints::kMost; ++left.count) {
    left.at[left.count] = static_cast<std::uint8_t>(left.count);
  }
  for (const auto way : {WindingSum::Way::kQuick, WindingSum::Way::kExact}) {
    if (left.count > 0) left = find_numbers(cube, way, left, apart, scratch, number);
  }
  for (const auto way : {WindingSum::Way::kQuick, WindingSum::Way::kExact}) {
    if (apart.count > 0) apart = find_numbers_apart(cube, way, apart, scratch, number);
  }
  add_runs(cube, number, scratch);
}

/// Some voxels of a cube of side kLeast, and some more to fill a vector.
void WindingField::place(const Cube& cube, const Voxels& voxels, WindingPoints& points) {
  constexpr std::size_t kStep = WindingPoints::kStep;
  points.count = (voxels.count + kStep - 1) / kStep * kStep;
  for (std::size_t k = 0; k < points.count; ++k) {
    const int i = voxels.at[std::min(k, voxels.count - 1)];
    const auto centre = [&](int axis, int at) {
      return (cube.corner[axis] + at) * kLatticeSteps + kLatticeSteps / 2;
    };
    points.x[k] = centre(0, i % kLeast);
    points.y[k] = centre(1, i / kLeast % kLeast);
    points.z[k] = centre(2, i / (kLeast * kLeast));
  }
}

/// The numbers of voxels of a cube of side kLeast, where the caps close by and the rest at the
/// cube's corners tell. Adds others to `apart`. @return those whose angles are not exact enough
WindingField::Voxels WindingField::find_numbers(const Cube& cube, WindingSum::Way way,
                                                const Voxels& voxels, Voxels& apart,
                                                Scratch& scratch,
                                                int (&number)[WindingPoints::kMost]) const {
  WindingPoints& points = scratch.points;
  place(cube, kLeast - 1, points);
  WindingView view = view_of(cube, scratch);
  view.near = scratch.rest;
  scratch.sum.write(way, all_, view, points);
  const double off = (1 + 2 * kBulge) * *std::max_element(points.off, points.off + 8);
  if (!(off <= 1)) return voxels;
  double corner[8];
  std::copy_n(points.angle, 8, corner);
  const auto [low, high] = std::minmax_element(corner, corner + 8);
  const double bulge = kBulge * (*high - *low);
  place(cube, voxels, points);
  scratch.sum.write(way, all_, {view.middle, view.radius, scratch.close}, points);
  double rest[WindingPoints::kMost];
  interpolate(corner, rest);
  Voxels left;
  for (std::size_t k = 0; k < voxels.count; ++k) {
    const std::uint8_t i = voxels.at[k];
    const double both = off + points.off[k];
    if (!(both <= 1)) {
      left.add(i);
      continue;
    }
    const double least = points.angle[k] + rest[i] - bulge,
                 most = points.angle[k] + rest[i] + bulge;
    number[i] = rounded(least - both);
    if (rounded(most + both) == number[i]) continue;
    (rounded(least + both) == rounded(most - both) ? left : apart).add(i);
  }
  return left;
}

/// The numbers of voxels, each by its own angle. @return those whose angles are not exact enough
WindingField::Voxels WindingField::find_numbers_apart(const Cube& cube, WindingSum::Way way,
                                                      const Voxels& voxels, Scratch& scratch,
                                                      int (&number)[WindingPoints::kMost]) const {
  WindingPoints& points = scratch.points;
  place(cube, voxels, points);
  WindingView view = view_of(cube, scratch);
  view.near = scratch.near;
  scratch.sum.write(way, all_, view, points);
  Voxels left;
  for (std::size_t k = 0; k < voxels.count; ++k) {
    const double angle = points.angle[k], off = points.off[k];
    const bool known = off <= 1 && rounded(angle - off) == rounded(angle + off);
    if (!known) left.add(voxels.at[k]);
    if (known) number[voxels.at[k]] = rounded(angle);
  }
  return left;
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
  if (all_.caps.empty()) return {};
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
