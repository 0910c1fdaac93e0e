#include "picture/occlusion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "core/reserve_large.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "picture/occlusion.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/lanes-inl.h"

// Horizons in a depth image, as J. Jimenez, X. Wu, A. Pesce and A. Jarabo, "Practical real-time
// strategies for accurate indirect occlusion" (2016): planes through the ray of the eye, and in
// each of them the cosine-weighted light between two horizons, in closed form. We differ:
// neighbours look in other directions, in squares of 4 x 4 pixels, and the mean over such a square,
// of points that lie in one plane, has 16 times as many directions and shows no pattern.
//
// A vector of neighbours at a time. First all of their samples: most points have none that rises
// above the face, and see all. Light is summed for vectors with one that does.

HWY_BEFORE_NAMESPACE();
namespace strata {
namespace HWY_NAMESPACE {
namespace {
namespace hn = hwy::HWY_NAMESPACE;

// Products and sums are kept apart: fused ones round otherwise.
using Lane = hn::CappedTag<float, 8>;
using LaneInt = hn::RebindToSigned<Lane>;
using LaneByte = hn::Rebind<std::uint8_t, Lane>;
using Vec = hn::Vec<Lane>;
using VecInt = hn::Vec<LaneInt>;
using Mask = hn::Mask<Lane>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Lane()));

constexpr int kPlanes = 2;  ///< of one pixel
constexpr int kSteps = 5;   ///< to each side
constexpr int kTurns = 16;  ///< of the planes, in a square of 4 x 4 pixels
/// Sines of points above a face: up to the first nothing is hidden, from the second on all.
constexpr float kFlat = 0.08f, kSteep = 0.20f;
constexpr float kMostPixels = 160.0f;  ///< that a plane is followed to each side
constexpr float kPi = 3.14159265f;

/// Pixel (x, y) of a square: an order in which neighbours are far apart.
constexpr std::array<std::uint8_t, 16> kOrder{0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5};

HWY_INLINE Vec set(float value) { return hn::Set(Lane(), value); }

struct Vec3 {
  Vec x, y, z;
};
HWY_INLINE Vec3 operator-(const Vec3& a, const Vec3& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE Vec3 operator*(const Vec3& a, Vec b) {
  return {hn::Mul(a.x, b), hn::Mul(a.y, b), hn::Mul(a.z, b)};
}
HWY_INLINE Vec dot(const Vec3& a, const Vec3& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE Vec3 normalized(const Vec3& a) { return a * hn::Div(set(1.0f), hn::Sqrt(dot(a, a))); }
/// -1 where below 0, else 1.
HWY_INLINE Vec sign_of(Vec a) {
  return hn::IfThenElse(hn::Lt(a, hn::Zero(Lane())), set(-1.0f), set(1.0f));
}

/// The pixels of a vector, each by its place in the picture.
struct Places {
  HWY_ALIGN std::int32_t at[kLanes];
};

/// Points at some places: the four floats from each on, turned around.
HWY_INLINE Vec3 points_at(const std::vector<glm::vec3>& points, const Places& places) {
  static_assert(sizeof(glm::vec3) == 3 * sizeof(float));
  const Lane d;
  const auto point = [&](int lane) -> const glm::vec3& {
    return points[static_cast<std::size_t>(places.at[lane])];
  };
#if HWY_TARGET == HWY_SCALAR
  return {hn::Set(d, point(0).x), hn::Set(d, point(0).y), hn::Set(d, point(0).z)};
#else
  const auto four = [&](auto d4, int lane) {
    const auto low = hn::LoadU(d4, &point(lane).x);
    if constexpr (kLanes == 4) {
      return low;
    } else {
      return hn::Combine(d, hn::LoadU(d4, &point(lane + 4).x), low);
    }
  };
  const hn::Repartition<double, Lane> pairs;
  const hn::CappedTag<float, 4> d4;
  const Vec a = four(d4, 0), b = four(d4, 1), c = four(d4, 2), e = four(d4, 3);
  const auto xy = hn::BitCast(pairs, hn::InterleaveLower(d, a, b));
  const auto xy_of_others = hn::BitCast(pairs, hn::InterleaveLower(d, c, e));
  const auto z = hn::BitCast(pairs, hn::InterleaveUpper(d, a, b));
  const auto z_of_others = hn::BitCast(pairs, hn::InterleaveUpper(d, c, e));
  return {hn::BitCast(d, hn::InterleaveLower(pairs, xy, xy_of_others)),
          hn::BitCast(d, hn::InterleaveUpper(pairs, xy, xy_of_others)),
          hn::BitCast(d, hn::InterleaveLower(pairs, z, z_of_others))};
#endif
}

/// Bytes at some places, as floats.
HWY_INLINE Vec bytes_at(const std::uint8_t* from, const Places& places) {
  HWY_ALIGN std::uint8_t bytes[kLanes];
  for (int lane = 0; lane < kLanes; ++lane) bytes[lane] = from[places.at[lane]];
  return hn::ConvertTo(Lane(), hn::PromoteTo(LaneInt(), hn::Load(LaneByte(), bytes)));
}

/// `count` pixels from x on of a row that begins at `begin`, the last one again for further lanes.
HWY_INLINE Places row_places(int begin, int x, int count) {
  Places places;
  for (int lane = 0; lane < kLanes; ++lane) places.at[lane] = begin + x + std::min(lane, count - 1);
  return places;
}

/// The first `count` of a vector of values in [0, 256).
HWY_INLINE void store_bytes(Vec values, int count, std::uint8_t* to) {
  const LaneByte d;
  HWY_ALIGN std::uint8_t bytes[kLanes];
  hn::Store(hn::DemoteTo(d, hn::ConvertTo(LaneInt(), values)), d, bytes);
  std::memcpy(to, bytes, static_cast<std::size_t>(count));
}

HWY_INLINE Mask is_somewhere(const Vec3& point) {
  return hn::Gt(point.z, set(EyeSurfaces::kNowhere.z));
}

/// What a function of doubles gives for distances from the eye along the view axis.
template <class Function>
HWY_INLINE Vec of_distances(const EyeSurfaces& seen, const Vec3& points, Function&& function) {
  HWY_ALIGN float z[kLanes];
  hn::Store(points.z, Lane(), z);
  for (float& one : z) {
    one = static_cast<float>(function(seen.origin_distance - static_cast<double>(one)));
  }
  return hn::Load(Lane(), z);
}

/// The angle of a cosine, off by less than 1e-4 (M. Abramowitz and I. Stegun, 4.4.45), from
/// arithmetic that is the same on every machine.
HWY_INLINE Vec angle_of(Vec cosine) {
  const Vec x = hn::Min(set(1.0f), hn::Abs(cosine));
  Vec sum = hn::Add(set(0.0742610f), hn::Mul(x, set(-0.0187293f)));
  sum = hn::Add(set(-0.2121144f), hn::Mul(x, sum));
  sum = hn::Add(set(1.5707288f), hn::Mul(x, sum));
  const Vec angle = hn::Mul(hn::Sqrt(hn::Sub(set(1.0f), x)), sum);
  return hn::IfThenElse(hn::Lt(cosine, hn::Zero(Lane())), hn::Sub(set(kPi), angle), angle);
}

/// Where the plane of an eye's ray and a direction cuts a face, and what light comes in it.
struct Cut {
  Vec length, cosine, sine;  ///< of the face's normal in the plane; to the eye's ray

  Cut(Vec direction_x, Vec direction_y, const Vec3& normal, const Vec3& to_eye) {
    const Lane d;
    const Vec3 axis = normalized(
        {hn::Mul(direction_y, to_eye.z), hn::Sub(hn::Zero(d), hn::Mul(to_eye.z, direction_x)),
         hn::Sub(hn::Mul(direction_x, to_eye.y), hn::Mul(to_eye.x, direction_y))});
    const Vec3 projected = normal - axis * dot(normal, axis);
    length = hn::Sqrt(dot(projected, projected));
    cosine = hn::Div(dot(projected, to_eye), length);
    cosine = hn::Min(hn::Max(cosine, set(-1.0f)), set(1.0f));
    const Vec along = hn::Add(hn::Mul(direction_x, to_eye.x), hn::Mul(direction_y, to_eye.y));
    const Vec3 across = Vec3{direction_x, direction_y, hn::Zero(d)} - to_eye * along;
    sine = hn::Mul(sign_of(dot(across, projected)),
                   hn::Sqrt(hn::Sub(set(1.0f), hn::Mul(cosine, cosine))));
  }

  /// Whether there is any light to speak of.
  [[nodiscard]] HWY_INLINE Mask lit() const { return hn::Gt(length, set(1e-4f)); }

  /// Of an arc from the horizon behind to the one ahead, whose cosines to the eye's ray are given.
  [[nodiscard]] HWY_INLINE Vec light(Vec ahead, Vec behind) const {
    return hn::Mul(length,
                   hn::Add(part(angle_of(ahead), ahead), part(hn::Neg(angle_of(behind)), behind)));
  }

 private:
  [[nodiscard]] HWY_INLINE Vec part(Vec to, Vec cos_to) const {
    const Vec two = set(2.0f), one = set(1.0f);
    const Vec sin_to = hn::Mul(sign_of(to), hn::Sqrt(hn::Sub(one, hn::Mul(cos_to, cos_to))));
    const Vec cos_twice = hn::Sub(hn::Mul(hn::Mul(two, cos_to), cos_to), one);
    const Vec twice =
        hn::Add(hn::Mul(cos_twice, cosine), hn::Mul(hn::Mul(hn::Mul(two, sin_to), cos_to), sine));
    return hn::Sub(hn::Add(cosine, hn::Mul(hn::Mul(two, to), sine)), twice);
  }
};

/// Looks around from the pixels of a row.
class Horizons {
 public:
  Horizons(const EyeSurfaces& seen, float radius, std::span<const glm::vec2> directions, int y)
      : seen_(&seen),
        radius_(radius),
        y_(y),
        last_u_(std::nextafter(static_cast<float>(seen.width), 0.0f)),
        last_v_(std::nextafter(static_cast<float>(seen.height), 0.0f)) {
    // From any pixel on, as many as a vector has.
    for (unsigned x = 0; x < kSquares; ++x) {
      const unsigned turn = kOrder[(static_cast<unsigned>(y) & 3) * 4 + (x & 3)];
      const unsigned shift = kOrder[(x & 3) * 4 + (static_cast<unsigned>(y) & 3)];
      for (unsigned plane = 0; plane < kPlanes; ++plane) {
        direction_x_[plane][x] = directions[plane * kTurns + turn].x;
        direction_y_[plane][x] = directions[plane * kTurns + turn].y;
      }
      for (unsigned k = 0; k < kSteps; ++k) {
        part_[k][x] = (static_cast<float>(k) + 0.2f + 0.05f * static_cast<float>(shift)) / kSteps;
      }
    }
  }

  void find(std::uint8_t* open) const {
    const int begin = y_ * seen_->width;
    for (int x = 0; x < seen_->width; x += kLanes) {
      const int count = std::min(kLanes, seen_->width - x);
      const Places places = row_places(begin, x, count);
      const Vec3 here = points_at(seen_->positions, places);
      const Mask somewhere = is_somewhere(here);
      Vec value = set(255.0f);
      if (!hn::AllFalse(Lane(), somewhere)) {
        value = hn::IfThenElse(somewhere, openness(x, here, somewhere, places), value);
      }
      store_bytes(value, count, open + begin + x);
    }
  }

 private:
  static constexpr unsigned kSquares = kLanes + 3;  ///< columns

  /// A sample that rises above the face.
  struct Rise {
    Vec weight, cosine;  ///< how much it counts; to the eye's ray
  };
  /// Those ahead and behind in a plane.
  struct Rises {
    std::array<Rise, kSteps> at[2];
    int count[2] = {0, 0};
  };
  /// Points that look around.
  struct Points {
    Mask somewhere;
    Vec3 here, normal, to_eye;
    Vec within;         ///< 1 / radius squared
    Vec columns, rows;  ///< of their middles
  };

  [[nodiscard]] HWY_INLINE Vec column(const float* of, int x) const {
    return hn::LoadU(Lane(), of + (x & 3));
  }

  /// Times 255, rounded when it is cut to a whole number.
  [[nodiscard]] Vec openness(int x, const Vec3& here, Mask somewhere, const Places& places) const {
    const Lane d;
    Points points{somewhere, here, points_at(seen_->normals, places), {}, {}, {}, {}};
    points.columns = hn::Add(count_from(d, static_cast<float>(x)), set(0.5f));
    points.rows = hn::Add(set(static_cast<float>(y_)), set(0.5f));
    Vec scale = set(static_cast<float>(seen_->scale));  // pixels a world unit
    points.to_eye = {hn::Zero(d), hn::Zero(d), set(1.0f)};
    if (seen_->perspective) {
      scale = of_distances(*seen_, here, [&](double away) { return seen_->scale / away; });
      points.to_eye = to_eye(x);
    }
    const Vec pixels = hn::Min(hn::Mul(set(radius_), scale), set(kMostPixels));
    points.within = hn::Div(hn::Mul(scale, scale), hn::Mul(pixels, pixels));
    Rises rises[kPlanes];
    int count = 0;
    for (int k = 0; k < kSteps; ++k) {
      const Vec part = column(part_[k], x);
      const Vec step = hn::Add(set(1.0f), hn::Mul(hn::Mul(pixels, part), part));
      for (int plane = 0; plane < kPlanes; ++plane) {
        const Vec along_x = hn::Mul(column(direction_x_[plane], x), step);
        const Vec along_y = hn::Mul(column(direction_y_[plane], x), step);
        // Rows go down.
        count += sample(points, hn::Add(points.columns, along_x), hn::Sub(points.rows, along_y),
                        rises[plane], 0);
        count += sample(points, hn::Sub(points.columns, along_x), hn::Add(points.rows, along_y),
                        rises[plane], 1);
      }
    }
    if (count == 0) return set(255.0f);
    Vec open = hn::Zero(d), all = hn::Zero(d);
    for (int plane = 0; plane < kPlanes; ++plane) {
      const Cut cut(column(direction_x_[plane], x), column(direction_y_[plane], x), points.normal,
                    points.to_eye);
      const Vec behind = cut.sine, ahead = hn::Neg(cut.sine);
      const Mask lit = cut.lit();
      const Vec flat = hn::IfThenElseZero(lit, cut.light(ahead, behind));
      all = hn::Add(all, flat);
      if (rises[plane].count[0] + rises[plane].count[1] == 0) {
        open = hn::Add(open, flat);
      } else {
        const Vec light =
            cut.light(highest(rises[plane], 0, ahead), highest(rises[plane], 1, behind));
        open = hn::Add(open, hn::IfThenElseZero(lit, light));
      }
    }
    const Vec part =
        hn::IfThenElse(hn::Gt(all, hn::Zero(d)), hn::Min(set(1.0f), hn::Div(open, all)), set(1.0f));
    return hn::Add(hn::Mul(set(255.0f), part), set(0.5f));
  }

  [[nodiscard]] Vec3 to_eye(int x) const {
    HWY_ALIGN float across[kLanes];
    for (int lane = 0; lane < kLanes; ++lane) {
      across[lane] = static_cast<float>((seen_->centre.x - (x + lane) - 0.5) / seen_->scale);
    }
    const auto down = static_cast<float>((y_ + 0.5 - seen_->centre.y) / seen_->scale);
    return normalized({hn::Load(Lane(), across), set(down), set(1.0f)});
  }

  /// Looks at what is seen at (u, v), and keeps it if it rises. Gives how many it has kept.
  HWY_INLINE int sample(const Points& points, Vec u, Vec v, Rises& rises, int side) const {
    const Lane d;
    const LaneInt di;
    const Vec near_u = hn::Min(hn::Max(u, hn::Zero(d)), set(last_u_));
    const Vec near_v = hn::Min(hn::Max(v, hn::Zero(d)), set(last_v_));
    const VecInt row_at = hn::Mul(hn::ConvertTo(di, near_v), hn::Set(di, seen_->width));
    Places places;
    hn::Store(hn::Add(row_at, hn::ConvertTo(di, near_u)), di, places.at);
    const Vec3 to = points_at(seen_->positions, places) - points.here;
    const Vec above = dot(points.normal, to), far = dot(to, to);
    const Vec part = hn::Mul(far, points.within);
    const Vec near = hn::Sub(set(1.0f), hn::Mul(part, part));
    // Cheaper than to divide by the distance, and lets all through that counts.
    constexpr float kFlatSquared = kFlat * kFlat * 0.999f;
    Mask rise = hn::And(hn::Eq(u, near_u), hn::Eq(v, near_v));
    rise = hn::And(rise, points.somewhere);
    rise = hn::And(rise, hn::Gt(above, hn::Zero(d)));
    rise = hn::And(rise, hn::Gt(hn::Mul(above, above), hn::Mul(far, set(kFlatSquared))));
    rise = hn::And(rise, hn::Gt(near, hn::Zero(d)));
    if (hn::AllFalse(d, rise)) return 0;
    // Not infinite: a sample outside of the picture may have become the point itself.
    const Vec over = hn::IfThenElseZero(rise, hn::Div(set(1.0f), hn::Sqrt(far)));
    const Vec steepness =
        hn::Mul(hn::Sub(hn::Mul(above, over), set(kFlat)), set(1.0f / (kSteep - kFlat)));
    const Vec shown = hn::Min(hn::Max(steepness, hn::Zero(d)), set(1.0f));
    rises.at[side][static_cast<std::size_t>(rises.count[side]++)] = {
        hn::IfThenElseZero(rise, hn::Mul(near, shown)),
        hn::Min(set(1.0f), hn::Mul(dot(to, points.to_eye), over))};
    return 1;
  }

  /// The cosine to the eye's ray of the highest point on a side. @param flat  of the face
  [[nodiscard]] HWY_INLINE Vec highest(const Rises& rises, int side, Vec flat) const {
    Vec highest = flat;
    for (int i = 0; i < rises.count[side]; ++i) {
      const auto& [weight, cosine] = rises.at[side][static_cast<std::size_t>(i)];
      highest = hn::Max(highest, hn::Add(flat, hn::Mul(hn::Sub(cosine, flat), weight)));
    }
    return highest;
  }

  const EyeSurfaces* seen_;
  float radius_;
  int y_;
  float last_u_, last_v_;  ///< the largest that lie in the picture
  float direction_x_[kPlanes][kSquares], direction_y_[kPlanes][kSquares];
  float part_[kSteps][kSquares];  ///< of the reach, for each step
};

void find_horizons(const EyeSurfaces& seen, float radius, std::span<const glm::vec2> directions,
                   int y, std::uint8_t* open) {
  Horizons(seen, radius, directions, y).find(open);
}

/// Means over 5 pixels along rows or columns, of which the ends count half, so that all of the
/// 4 x 4 turns count alike; only of points near the plane of the middle one.
class Means {
 public:
  /// @param stride  pixels from one to the next; above 1 of curved surfaces alone
  Means(const EyeSurfaces& seen, int step_x, int step_y, int stride)
      : seen_(&seen), step_x_(step_x * stride), step_y_(step_y * stride), stride_(stride) {}

  void find(int y, const std::uint8_t* from, std::uint8_t* to) const {
    const int begin = y * seen_->width;
    for (int x = 0; x < seen_->width; x += kLanes) {
      const int count = std::min(kLanes, seen_->width - x);
      if (stays(x, y, from)) {
        std::memcpy(to + begin + x, from + begin + x, kLanes);
      } else {
        store_bytes(means(x, y, count, from), count, to + begin + x);
      }
    }
  }

 private:
  static constexpr int kReach = 2;

  /// Whether a vector of pixels keeps its values: all that counts is the same.
  [[nodiscard]] HWY_INLINE bool stays(int x, int y, const std::uint8_t* from) const {
    const int across = kReach * step_x_, down = kReach * step_y_;
    if (x < across || x + kLanes + across > seen_->width) return false;
    if (y < down || y + down >= seen_->height) return false;
    const std::uint8_t* const middle = from + y * seen_->width + x;
    for (int k = -kReach; k <= kReach; ++k) {
      const std::uint8_t* const other = middle + k * (step_y_ * seen_->width + step_x_);
      if (std::memcmp(other, middle, kLanes) != 0) return false;
    }
    return true;
  }

  [[nodiscard]] Vec means(int x, int y, int count, const std::uint8_t* from) const {
    const Lane d;
    const Places middle = row_places(y * seen_->width, x, count);
    const Vec value = bytes_at(from, middle);
    const Vec3 here = points_at(seen_->positions, middle);
    const Vec3 normal = points_at(seen_->normals, middle);
    Mask counts = is_somewhere(here);
    if (stride_ > 1) {
      counts = hn::And(counts, hn::Ne(bytes_at(seen_->curved.data(), middle), hn::Zero(d)));
      if (hn::AllFalse(d, counts)) return value;
    }
    const auto pixel = [&](double away) { return away / seen_->scale; };
    Vec most = set(1.5f * static_cast<float>(stride_));
    most = hn::Mul(most, seen_->perspective ? of_distances(*seen_, here, pixel)
                                            : set(static_cast<float>(pixel(1.0))));
    Vec sum = hn::Zero(d), weights = hn::Zero(d);
    for (int k = -kReach; k <= kReach; ++k) {
      const int row = y + k * step_y_;
      if (row < 0 || row >= seen_->height) continue;
      Places places;
      HWY_ALIGN float shares[kLanes];
      for (int lane = 0; lane < kLanes; ++lane) {
        const int column = x + std::min(lane, count - 1) + k * step_x_;
        const int inside = std::clamp(column, 0, seen_->width - 1);
        places.at[lane] = row * seen_->width + inside;
        shares[lane] = column != inside ? 0.0f : k == -kReach || k == kReach ? 0.5f : 1.0f;
      }
      const Vec3 to = points_at(seen_->positions, places) - here;
      const Vec away = hn::Div(hn::Abs(dot(normal, to)), most);
      const Vec same = dot(normal, points_at(seen_->normals, places));
      Vec weight = hn::Mul(hn::Load(d, shares), hn::Max(hn::Zero(d), hn::Sub(set(1.0f), away)));
      weight = hn::Mul(weight, hn::Max(hn::Zero(d), hn::Sub(hn::Mul(set(4.0f), same), set(3.0f))));
      if (stride_ > 1) {
        const Vec curved = bytes_at(seen_->curved.data(), places);
        weight = hn::IfThenZeroElse(hn::Eq(curved, hn::Zero(d)), weight);
      }
      sum = hn::Add(sum, hn::Mul(weight, bytes_at(from, places)));
      weights = hn::Add(weights, weight);
    }
    return hn::IfThenElse(counts, hn::Add(hn::Div(sum, weights), set(0.5f)), value);
  }

  const EyeSurfaces* seen_;
  int step_x_, step_y_;  ///< pixels from one to the next
  int stride_;
};

void smooth(const EyeSurfaces& seen, int y, int step_x, int step_y, int stride,
            const std::uint8_t* from, std::uint8_t* to) {
  Means(seen, step_x, step_y, stride).find(y, from, to);
}

/// Means of the four pixels around places in a row.
class Between {
 public:
  Between(const EyeSurfaces& seen, const std::uint8_t* open, const PixelRow& row,
          const SeenPlane& plane)
      : seen_(&seen), open_(open), offset_(set(plane.offset)) {
    normal_ = {set(plane.normal.x), set(plane.normal.y), set(plane.normal.z)};
    first_ = static_cast<float>(row.u);
    step_ = row.step;
    const float y = (static_cast<float>(row.v) + 0.5f) * row.step - 0.5f;
    top_ = std::clamp(static_cast<int>(y), 0, seen.height - 1);
    bottom_ = std::min(top_ + 1, seen.height - 1);
    down_ = set(std::clamp(y - static_cast<float>(top_), 0.0f, 1.0f));
  }

  /// Of `count` pixels from the `from`th of the row on.
  [[nodiscard]] Vec find(int from, int count) const {
    const Lane d;
    const LaneInt di;
    const Vec one = set(1.0f);
    const Vec iota = hn::Min(hn::Iota(d, 0.0f), set(static_cast<float>(count - 1)));
    const Vec u = hn::Add(iota, set(first_ + static_cast<float>(from)));
    const Vec x = hn::Sub(hn::Mul(hn::Add(u, set(0.5f)), set(step_)), set(0.5f));
    const VecInt last = hn::Set(di, seen_->width - 1);
    const VecInt left = hn::Min(hn::Max(hn::ConvertTo(di, x), hn::Zero(di)), last);
    const VecInt right = hn::Min(hn::Add(left, hn::Set(di, 1)), last);
    const Vec to_right = hn::Min(hn::Max(hn::Sub(x, hn::ConvertTo(d, left)), hn::Zero(d)), one);
    const Vec to_left = hn::Sub(one, to_right), up = hn::Sub(one, down_);
    Corner corners[] = {corner(left, top_, hn::Mul(to_left, up)),
                        corner(right, top_, hn::Mul(to_right, up)),
                        corner(left, bottom_, hn::Mul(to_left, down_)),
                        corner(right, bottom_, hn::Mul(to_right, down_))};
    Mask all_open = hn::Eq(one, one);
    for (const Corner& one_of_four : corners) {
      all_open = hn::And(all_open, hn::Eq(one_of_four.open, set(255.0f)));
    }
    if (hn::AllTrue(d, all_open)) return one;
    Vec open = hn::Zero(d), weights = hn::Zero(d);
    for (const Corner& one_of_four : corners) {
      const Vec weight = weight_of(one_of_four);
      open = hn::Add(open, hn::Mul(weight, one_of_four.open));
      weights = hn::Add(weights, weight);
    }
    const Mask known = hn::AndNot(all_open, hn::Gt(weights, hn::Zero(d)));
    return hn::IfThenElse(known, hn::Div(open, hn::Mul(set(255.0f), weights)), one);
  }

 private:
  /// One of the four pixels around each place.
  struct Corner {
    Places places;
    Vec open, share;
  };

  [[nodiscard]] HWY_INLINE Corner corner(VecInt column, int row, Vec share) const {
    Corner result;
    const LaneInt di;
    hn::Store(hn::Add(column, hn::Set(di, row * seen_->width)), di, result.places.at);
    result.open = bytes_at(open_, result.places);
    result.share = share;
    return result;
  }

  [[nodiscard]] HWY_INLINE Vec weight_of(const Corner& corner) const {
    const Lane d;
    const Vec3 there = points_at(seen_->positions, corner.places);
    Vec pixel = set(1.0f);
    if (seen_->perspective) pixel = of_distances(*seen_, there, [](double away) { return away; });
    pixel = hn::Div(pixel, set(static_cast<float>(seen_->scale)));
    const Vec away =
        hn::Div(hn::Abs(hn::Sub(dot(normal_, there), offset_)), hn::Mul(set(2.0f), pixel));
    const Vec same = dot(normal_, points_at(seen_->normals, corner.places));
    const Vec like = hn::Mul(hn::Max(hn::Zero(d), hn::Sub(set(1.0f), away)),
                             hn::Max(hn::Zero(d), hn::Sub(hn::Mul(set(4.0f), same), set(3.0f))));
    // Others count a little, for where there is no point of the face.
    const Vec weight = hn::Mul(hn::Add(corner.share, set(0.02f)), hn::Add(like, set(0.002f)));
    return hn::IfThenElseZero(is_somewhere(there), weight);
  }

  const EyeSurfaces* seen_;
  const std::uint8_t* open_;
  Vec3 normal_;
  Vec offset_, down_;
  float first_ = 0.0f, step_ = 1.0f;
  int top_ = 0, bottom_ = 0;
};

void find_between(const EyeSurfaces& seen, const std::uint8_t* open, const PixelRow& row,
                  const SeenPlane& plane, std::span<float> values) {
  const Between between(seen, open, row, plane);
  const int count = static_cast<int>(values.size());
  for (int i = 0; i < count; i += kLanes) {
    const int some = std::min(kLanes, count - i);
    HWY_ALIGN float found[kLanes];
    hn::Store(between.find(i, some), Lane(), found);
    std::copy_n(found, some, values.begin() + i);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace strata
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata {
namespace {

HWY_EXPORT(find_horizons);
HWY_EXPORT(smooth);
HWY_EXPORT(find_between);

/// The directions of all planes of a square: half a circle, by pi / 32.
std::array<glm::vec2, 32> make_directions() {
  return turned_directions<32>(0.99518472667219688624, 0.09801714032956060199);
}

}  // namespace

void EyeSurfaces::resize(int columns, int rows) {
  width = columns, height = rows;
  // Vectors read four floats from each point on.
  const std::size_t count = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) + 1;
  for (auto* values : {&positions, &normals}) {
    detail::reserve_large(*values, count);
    values->resize(count);
  }
}

std::vector<std::uint8_t> openness(const EyeSurfaces& surfaces, double radius,
                                   const Execution& execution) {
  const auto rows = static_cast<std::size_t>(surfaces.height);
  std::vector<std::uint8_t> open(static_cast<std::size_t>(surfaces.width) * rows, 255);
  std::vector<std::uint8_t> other(open.size());
  const auto directions = make_directions();
  parallel_for(execution, rows, [&](std::size_t y, int) {
    HWY_DYNAMIC_DISPATCH(find_horizons)
    (surfaces, static_cast<float>(radius), directions, static_cast<int>(y), open.data());
  });
  // Facets of curved surfaces are often as small as a square of turns, and each has a plane of its
  // own: means over ever more of them leave no grain (H. Dammertz, D. Sewtz, J. Hanika and H.
  // Lensch, "Edge-avoiding a-trous wavelet transform", 2010).
  for (const int stride : {1, 2, 4}) {
    if (stride > 1 && surfaces.curved.empty()) break;
    parallel_for(execution, rows, [&](std::size_t y, int) {
      HWY_DYNAMIC_DISPATCH(smooth)
      (surfaces, static_cast<int>(y), 1, 0, stride, open.data(), other.data());
    });
    parallel_for(execution, rows, [&](std::size_t y, int) {
      HWY_DYNAMIC_DISPATCH(smooth)
      (surfaces, static_cast<int>(y), 0, 1, stride, other.data(), open.data());
    });
  }
  return open;
}

void openness_along(const EyeSurfaces& surfaces, std::span<const std::uint8_t> open,
                    const PixelRow& row, const SeenPlane& plane, std::span<float> values) {
  HWY_DYNAMIC_DISPATCH(find_between)(surfaces, open.data(), row, plane, values);
}

}  // namespace strata
#endif  // HWY_ONCE
