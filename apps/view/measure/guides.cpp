#include "apps/view/measure/guides.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "apps/view/measure/measurements.h"

namespace strata::view {
namespace {

/// Pixels between two looks at the depth.
constexpr double kStep = 2.0;

glm::dvec3 in_eye(const View& view, const glm::dvec3& world) {
  return glm::dvec3(view.eye_from_world * glm::dvec4(world, 1.0));
}

/// Cuts [low, high] down to where a + t d >= 0.
void keep(double a, double d, double& low, double& high) {
  if (d == 0.0) {
    if (a < 0.0) high = low - 1.0;
  } else if (d > 0.0) {
    low = std::max(low, -a / d);
  } else {
    high = std::min(high, -a / d);
  }
}

class HiddenTest {
 public:
  HiddenTest(const View& view, const DepthImage& depth) : depth_(depth) {
    if (depth.width < 1) return;
    scale_ = glm::dvec2(depth.width, depth.height) / glm::dvec2(view.size);
    // How wide a pixel of the depths is, at the distance 1 or everywhere.
    const glm::dmat4 image_from_eye = view.image_from_world * glm::inverse(view.eye_from_world);
    const double pixel = 1.0 / std::max(std::abs(image_from_eye[0][0]), 1e-300) / scale_.x;
    (view.perspective ? per_distance_ : constant_) = 2.0 * pixel;
  }
  [[nodiscard]] bool operator()(const glm::dvec2& pixel, double distance) const {
    if (depth_.width < 1) return false;
    const glm::ivec2 at(glm::floor(pixel * scale_));
    double farthest = 0.0;
    for (int v = at.y - 1; v <= at.y + 1; ++v) {
      for (int u = at.x - 1; u <= at.x + 1; ++u) {
        const int x = std::clamp(u, 0, depth_.width - 1), y = std::clamp(v, 0, depth_.height - 1);
        const float there = depth_.distance[static_cast<std::size_t>(y * depth_.width + x)];
        farthest = std::max(farthest, static_cast<double>(there));
      }
    }
    return distance > farthest + constant_ + per_distance_ * farthest;
  }

 private:
  const DepthImage& depth_;
  glm::dvec2 scale_{1.0};
  double constant_ = 0.0, per_distance_ = 0.0;
};

}  // namespace

double round_step(double least) {
  const double power = std::pow(10.0, std::floor(std::log10(least)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (step * power >= least * (1 - 1e-9)) return step * power;
  }
  return 10.0 * power;
}

DepthImage depth_image(const View& view, const csg::SurfaceImage& image) {
  DepthImage result{image.width, image.height, {}};
  result.distance.reserve(image.depth.size());
  for (const std::uint32_t depth : image.depth) {
    result.distance.push_back(depth == csg::SurfaceImage::kNone
                                  ? std::numeric_limits<float>::infinity()
                                  : static_cast<float>(view.distance(depth + 0.5)));
  }
  return result;
}

std::optional<glm::dvec2> pixel_of(const View& view, const glm::dvec3& world) {
  if (view.perspective && !(-in_eye(view, world).z > 1e-6 * view.far)) return {};
  const glm::dvec4 image = view.image_from_world * glm::dvec4(world, 1.0);
  return glm::dvec2(image) / image.w;
}

bool is_hidden(const View& view, const DepthImage& depth, const glm::dvec3& world) {
  const auto pixel = pixel_of(view, world);
  return pixel && HiddenTest(view, depth)(*pixel, -in_eye(view, world).z);
}

std::vector<Stretch> stretches(const View& view, const DepthImage& depth, const glm::dvec3& from,
                               const glm::dvec3& to) {
  glm::dvec3 a = from, b = to;
  if (view.perspective) {  // what lies behind the eye
    const double least = 1e-4 * view.far;
    const double da = -in_eye(view, a).z - least, db = -in_eye(view, b).z - least;
    if (da < 0.0 && db < 0.0) return {};
    if (da < 0.0) a = from + (to - from) * (da / (da - db));
    if (db < 0.0) b = from + (to - from) * (da / (da - db));
  }
  const auto pa = pixel_of(view, a), pb = pixel_of(view, b);
  if (!pa || !pb) return {};
  const glm::dvec2 along = *pb - *pa;
  double low = 0.0, high = 1.0;
  for (int k = 0; k < 2; ++k) {
    keep((*pa)[k], along[k], low, high);
    keep(view.size[k] - (*pa)[k], -along[k], low, high);
  }
  if (!(low < high)) return {};
  // In a picture the reciprocal of the distance is linear, or the distance is.
  const double da = -in_eye(view, a).z, db = -in_eye(view, b).z;
  const auto distance = [&](double t) {
    return view.perspective ? 1.0 / ((1.0 - t) / da + t / db) : da + t * (db - da);
  };
  const HiddenTest hidden(view, depth);
  const double pixels = glm::length(along) * (high - low);
  const int steps = std::clamp(static_cast<int>(pixels / kStep), 1, 4000);
  std::vector<Stretch> result;
  for (int i = 0; i < steps; ++i) {
    const double t0 = low + (high - low) * i / steps, t1 = low + (high - low) * (i + 1) / steps;
    const double middle = 0.5 * (t0 + t1);
    const bool behind = hidden(*pa + along * middle, distance(middle));
    if (!result.empty() && result.back().hidden == behind) {
      result.back().to = *pa + along * t1;
    } else {
      result.push_back({*pa + along * t0, *pa + along * t1, behind});
    }
  }
  return result;
}

BoxGuide box_guide(const View& view, const Bounds& box) {
  BoxGuide guide;
  const glm::dvec3 size = box.high - box.low;
  const auto centre = pixel_of(view, 0.5 * (box.low + box.high));
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    double farthest = -1e300;
    guide.sizes[axis].text = number(tidy(size[axis], box.longest_side()));
    for (int corner = 0; corner < 4; ++corner) {
      glm::dvec3 from = box.low, to = box.low;
      from[u] = to[u] = (corner & 1) != 0 ? box.high[u] : box.low[u];
      from[v] = to[v] = (corner & 2) != 0 ? box.high[v] : box.low[v];
      to[axis] = box.high[axis];
      guide.edges.push_back({from, to});
      const glm::dvec3 middle = 0.5 * (from + to);
      const auto pixel = pixel_of(view, middle);
      if (!pixel || !centre) continue;
      // Outside, and rather below than above.
      const double out = glm::distance(*pixel, *centre) + 0.3 * (pixel->y - centre->y);
      if (out > farthest) farthest = out, guide.sizes[axis].at = middle;
    }
  }
  return guide;
}

GridGuide grid_guide(const Bounds& box, double pixel) {
  GridGuide grid;
  Bounds all = box;
  if (all.empty()) all = {glm::dvec3(-1), glm::dvec3(1)};
  const double longest = std::max(all.high.x - all.low.x, all.high.y - all.low.y);
  grid.spacing = round_step(std::max({24.0 * pixel, 1.2 * longest / 80.0, 1e-12}));
  const auto first = [&](double low) { return std::floor(low / grid.spacing - 1.0); };
  const auto last = [&](double high) { return std::ceil(high / grid.spacing + 1.0); };
  const glm::dvec2 low(first(all.low.x), first(all.low.y));
  const glm::dvec2 high(last(all.high.x), last(all.high.y));
  for (int axis = 0; axis < 2; ++axis) {
    for (double i = low[axis]; i <= high[axis]; i += 1.0) {
      Guide line;
      line.from[axis] = line.to[axis] = i * grid.spacing;
      line.from[1 - axis] = low[1 - axis] * grid.spacing;
      line.to[1 - axis] = high[1 - axis] * grid.spacing;
      (std::fmod(i, 5.0) == 0.0 ? grid.strong : grid.lines).push_back(line);
    }
  }
  grid.corner = glm::dvec3(high.x, low.y, 0.0) * grid.spacing;
  return grid;
}

TicksGuide ticks_guide(const Bounds& box, double pixel) {
  TicksGuide ticks;
  Bounds all = box;
  all.include(glm::dvec3(0.0));
  ticks.spacing = round_step(std::max({56.0 * pixel, all.longest_side() / 200.0, 1e-12}));
  for (int axis = 0; axis < 3; ++axis) {
    const double low = std::floor(all.low[axis] / ticks.spacing - 0.5);
    const double high = std::ceil(all.high[axis] / ticks.spacing + 0.5);
    ticks.axes[axis].from[axis] = low * ticks.spacing;
    ticks.axes[axis].to[axis] = high * ticks.spacing;
    for (double i = low; i <= high; i += 1.0) {
      if (i == 0.0) continue;
      GuideLabel mark;
      mark.at[axis] = i * ticks.spacing;
      mark.text = number(i * ticks.spacing);
      ticks.marks[axis].push_back(std::move(mark));
    }
  }
  return ticks;
}

ScaleBar scale_bar(double pixel, double most_pixels) {
  const double most = pixel * most_pixels;
  // The largest round length that fits: half of the step above it, or two fifths.
  const double above = round_step(most * (1 + 1e-9));
  double length = above / 2;
  if (length > most || round_step(length) > length * (1 + 1e-9)) length = above / 2.5;
  return {length, length / pixel};
}

}  // namespace strata::view
