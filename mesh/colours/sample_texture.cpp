#include "mesh/colours/sample_texture.h"

#include <algorithm>
#include <cstddef>
#include <type_traits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/colours/sample_texture.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "mesh/colours/light_tables.h"

HWY_BEFORE_NAMESPACE();
namespace strata {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Products and sums are kept apart: fused ones round otherwise.
using Lane = hn::CappedTag<double, 8>;
using LaneFloat = hn::Rebind<float, Lane>;
using LaneInt = hn::Rebind<std::int32_t, Lane>;
using Vec = hn::Vec<Lane>;

constexpr std::size_t kPlaces = TextureSampling::kPlaces;

/// Places along one side of a level: between which two texels each lies.
struct Between {
  HWY_ALIGN std::int32_t first[kPlaces], second[kPlaces];
  HWY_ALIGN float part[kPlaces];  // of the second
};

/// Coordinates of places, 0 to 1 after wrapping.
struct Places {
  HWY_ALIGN double u[kPlaces], v[kPlaces];
};

HWY_INLINE Vec wrapped(Vec at, TextureWrap wrap) {
  const Lane d;
  const Vec one = hn::Set(d, 1.0), two = hn::Set(d, 2.0);
  if (wrap == TextureWrap::kRepeat) return hn::Sub(at, hn::Floor(at));
  if (wrap == TextureWrap::kClamp) return hn::Min(hn::Max(at, hn::Zero(d)), one);
  at = hn::Sub(at, hn::Mul(two, hn::Floor(hn::Div(at, two))));
  return hn::IfThenElse(hn::Gt(at, one), hn::Sub(two, at), at);
}

void wrap_places(const TextureSampling& how, std::span<const glm::dvec2> middles, int probe,
                 Places& places) {
  const Lane d;
  const double steps = probe + 0.5 - 0.5 * how.probes;
  for (std::size_t i = 0; i < middles.size(); ++i) {
    places.u[i] = middles[i].x + how.step.x * steps;
    places.v[i] = middles[i].y + how.step.y * steps;
  }
  for (std::size_t i = 0; i < middles.size(); i += hn::Lanes(d)) {
    hn::Store(wrapped(hn::Load(d, places.u + i), how.wrap_u), d, places.u + i);
    hn::Store(wrapped(hn::Load(d, places.v + i), how.wrap_v), d, places.v + i);
  }
}

void find_texels(const double* places, std::size_t count, int size, bool repeats,
                 Between& between) {
  const Lane d;
  const LaneInt di;
  const LaneFloat df;
  const auto one = hn::Set(di, 1), end = hn::Set(di, size), last = hn::Set(di, size - 1);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    // Texel i has its middle at i + 1.
    const Vec x = hn::Add(hn::Mul(hn::Load(d, places + i), hn::Set(d, size)), hn::Set(d, 0.5));
    auto second = hn::DemoteTo(di, x);
    const auto part = hn::DemoteTo(df, hn::Sub(x, hn::PromoteTo(d, second)));
    auto first = hn::Sub(second, one);
    if (repeats) {
      first = hn::Add(first, hn::IfThenElseZero(hn::Lt(first, hn::Zero(di)), end));
      second = hn::Sub(second, hn::IfThenElseZero(hn::Gt(second, last), end));
    } else {  // the mirror's border texel is its own neighbour
      first = hn::Max(first, hn::Zero(di));
      second = hn::Min(second, last);
    }
    hn::Store(first, di, between.first + i);
    hn::Store(second, di, between.second + i);
    hn::Store(part, df, between.part + i);
  }
}

/// The mean of four texels at each place, by how near they are. @param light of the texel at a
/// place
template <class Light>
HWY_INLINE void blend_texels(const Between& x, const Between& y, std::size_t count, int width,
                             Light&& light, Float4* blends) {
  const auto row = [width](std::int32_t number) {
    return static_cast<std::size_t>(number) * static_cast<std::size_t>(width);
  };
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t upper_row = row(y.first[i]), lower_row = row(y.second[i]);
    const auto left = static_cast<std::size_t>(x.first[i]);
    const auto right = static_cast<std::size_t>(x.second[i]);
    const float of_right = x.part[i], of_left = 1.0f - of_right;
    const Float4 upper = light(upper_row + left) * of_left + light(upper_row + right) * of_right;
    const Float4 lower = light(lower_row + left) * of_left + light(lower_row + right) * of_right;
    const float of_lower = y.part[i];
    blends[i] = upper * (1.0f - of_lower) + lower * of_lower;
  }
}

void sample_level(const TextureSampling& how, const TextureLevel& level, const Places& places,
                  std::size_t count, Float4* blends) {
  Between x, y;
  find_texels(places.u, count, level.width, how.wrap_u == TextureWrap::kRepeat, x);
  find_texels(places.v, count, level.height, how.wrap_v == TextureWrap::kRepeat, y);
  if (level.texture == nullptr) {
    blend_texels(
        x, y, count, level.width, [&](std::size_t at) { return light_of(level.half[at]); }, blends);
    return;
  }
  const LightTables& tables = LightTables::get(how.opaque);
  const auto blend = [&]<bool kOpaque>(std::bool_constant<kOpaque>) {
    blend_texels(
        x, y, count, level.width,
        [&](std::size_t at) { return tables.light_of<kOpaque>(level.texture[at]); }, blends);
  };
  how.opaque ? blend(std::true_type()) : blend(std::false_type());
}

void sample_places(const TextureSampling& how, std::span<const glm::dvec2> middles, Float4* sums) {
  Places places = {};
  Float4 near[kPlaces], far[kPlaces];
  const std::size_t count = middles.size();
  std::fill_n(sums, count, Float4{});
  for (int probe = 0; probe < how.probes; ++probe) {
    wrap_places(how, middles, probe, places);
    sample_level(how, how.level, places, count, near);
    if (how.part != 0.0f) sample_level(how, how.next, places, count, far);
    for (std::size_t i = 0; i < count; ++i) {
      Float4 light = near[i];
      if (how.part != 0.0f) light = light * (1.0f - how.part) + far[i] * how.part;
      sums[i] += light * (1.0f / kLightOne);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace strata
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata {

HWY_EXPORT(sample_places);

void sample_texture(const TextureSampling& how, std::span<const glm::dvec2> places,
                    std::span<Float4> sums) {
  for (std::size_t begin = 0; begin < places.size(); begin += TextureSampling::kPlaces) {
    const std::size_t count = std::min(TextureSampling::kPlaces, places.size() - begin);
    HWY_DYNAMIC_DISPATCH(sample_places)(how, places.subspan(begin, count), sums.data() + begin);
  }
}

}  // namespace strata
#endif  // HWY_ONCE
