#include "csg/picture/curved_colours.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "csg/picture/curved_colours.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace strata::csg {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, 8>;
using Floats = hn::CappedTag<float, 16>;

/// std::max(0, value)
template <class D>
HWY_INLINE hn::Vec<D> positive_part(D d, hn::Vec<D> value) {
  return hn::IfThenElseZero(hn::Gt(value, hn::Zero(d)), value);
}

/// Three numbers a lane. Sums have the order of glm's, so that they have its bits.
template <class D>
struct Vec3 {
  hn::Vec<D> x, y, z;
  [[nodiscard]] HWY_INLINE hn::Vec<D> dot(const Vec3& other) const {
    return hn::Add(hn::Add(hn::Mul(x, other.x), hn::Mul(y, other.y)), hn::Mul(z, other.z));
  }
};
template <class D, class Numbers>
HWY_INLINE Vec3<D> set_all(D d, const Numbers& v) {
  return {hn::Set(d, v.x), hn::Set(d, v.y), hn::Set(d, v.z)};
}

/// Normals of length 1 at pixels of a row.
struct PixelNormals {
  HWY_ALIGN float x[kCurvedPixels], y[kCurvedPixels], z[kCurvedPixels];

  /// @return false: one has no length
  bool find(const CurvedFace& face, int u, int v, std::size_t count) {
    const Doubles d;
    const hn::Rebind<float, Doubles> to;
    for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
      const Vec3<Doubles> at{hn::Iota(d, u + static_cast<double>(i) + 0.5), hn::Set(d, v + 0.5),
                             hn::Set(d, 1.0)};
      Vec3<Doubles> normal{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
      for (std::size_t c = 0; c < 3; ++c) {
        const auto share = positive_part(d, set_all(d, face.shares[c]).dot(at));
        const auto corner = set_all(d, face.normals[c]);
        normal.x = hn::Add(normal.x, hn::Mul(share, corner.x));
        normal.y = hn::Add(normal.y, hn::Mul(share, corner.y));
        normal.z = hn::Add(normal.z, hn::Mul(share, corner.z));
      }
      const auto length = hn::Sqrt(normal.dot(normal));
      if (!hn::AllTrue(d, hn::Gt(length, hn::Zero(d)))) return false;
      hn::Store(hn::DemoteTo(to, hn::Div(normal.x, length)), to, x + i);
      hn::Store(hn::DemoteTo(to, hn::Div(normal.y, length)), to, y + i);
      hn::Store(hn::DemoteTo(to, hn::Div(normal.z, length)), to, z + i);
    }
    return true;
  }
};

bool CurvedColours(const CurvedFace& face, const glm::vec3& base, const glm::vec3& up, int u, int v,
                   const float* open, std::span<Rgba> pixels) {
  PixelNormals normals;
  if (!normals.find(face, u, v, pixels.size())) return false;
  const Floats d;
  const hn::RebindToSigned<Floats> di;
  const auto one = hn::Set(d, 1.0f);
  for (std::size_t i = 0; i < pixels.size(); i += hn::Lanes(d)) {
    const Vec3<Floats> normal{hn::Load(d, normals.x + i), hn::Load(d, normals.y + i),
                              hn::Load(d, normals.z + i)};
    const auto toward = [&](const studio::Light& light) {
      return hn::Mul(hn::Set(d, light.power),
                     positive_part(d, normal.dot(set_all(d, light.towards))));
    };
    const auto direct =
        hn::Add(hn::Add(toward(studio::kKey), toward(studio::kFill)), toward(studio::kRim));
    const auto ambient = hn::Add(hn::Set(d, studio::kSky),
                                 hn::Mul(hn::Set(d, studio::kFromUp), normal.dot(set_all(d, up))));
    auto mirrored = positive_part(d, normal.dot(set_all(d, studio::kMirror)));
    for (int k = 0; k < studio::kGlossDoublings; ++k) mirrored = hn::Mul(mirrored, mirrored);
    const auto part = hn::LoadU(d, open + i);
    const auto shade = hn::Sub(one, hn::Mul(hn::Set(d, studio::kDirectShade), hn::Sub(one, part)));
    const auto light = hn::Sqrt(hn::Add(hn::Mul(direct, shade), hn::Mul(ambient, part)));
    const auto gloss = hn::Mul(hn::Mul(hn::Set(d, studio::kGloss), mirrored), shade);
    const auto to_byte = [&](float channel) {
      const auto colour = hn::Add(hn::Mul(hn::Set(d, channel), light), gloss);
      const auto clamped = hn::Min(hn::Max(colour, hn::Zero(d)), one);
      return hn::ConvertTo(di, hn::Add(hn::Mul(clamped, hn::Set(d, 255.0f)), hn::Set(d, 0.5f)));
    };
    HWY_ALIGN std::int32_t red[16], green[16], blue[16];
    hn::Store(to_byte(base.x), di, red);
    hn::Store(to_byte(base.y), di, green);
    hn::Store(to_byte(base.z), di, blue);
    const std::size_t some = std::min(hn::Lanes(d), pixels.size() - i);
    for (std::size_t k = 0; k < some; ++k) pixels[i + k] = Rgba(red[k], green[k], blue[k], 255);
  }
  return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace strata::csg
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata::csg {

HWY_EXPORT(CurvedColours);

bool curved_colours(const CurvedFace& face, const glm::vec3& base, const StudioLights& lights,
                    int u, int v, const std::array<float, kCurvedPixels>& open,
                    std::span<Rgba> pixels) {
  return HWY_DYNAMIC_DISPATCH(CurvedColours)(face, base, lights.up(), u, v, open.data(), pixels);
}

}  // namespace strata::csg
#endif  // HWY_ONCE
