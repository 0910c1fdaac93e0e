// The exact geometry of a triangle, for the compute rasterizer: the arithmetic of
// raster/triangle_setup.h in what C++ and GLSL have in common. Compiled as both, so that a test
// without a GPU holds it to the reference.
//
// Depth is floor(n / area) for a plane numerator n that may need 96 bits. A pixel's quotient is
// wanted where it is covered, and there w0 + quotient lies between the depths of the vertices: it
// is kept modulo 2^32 and may wrap on the way. The remainder is exact in 64 bits. Both are stepped
// together; k steps from a known pixel the carry is the floor of a sum of fractions, guessed in
// single precision and put right by comparing the remainder.
#ifndef STRATA_RASTER_GL_TRIANGLE_GLSL_H
#define STRATA_RASTER_GL_TRIANGLE_GLSL_H

#ifdef __cplusplus
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>

namespace strata::glsl {
using glm::ivec3;
using std::abs;
using std::floor;
using std::int64_t;
using std::max;
using std::min;
using std::uint64_t;
using uint = std::uint32_t;
#define STRATA_OUT(type) type&
#define STRATA_INOUT(type) type&
#define STRATA_FN inline
#else
#define STRATA_OUT(type) out type
#define STRATA_INOUT(type) inout type
#define STRATA_FN
#endif

/// A triangle in the frame of a target (u, v, w), turned counter-clockwise: strata::TriangleSetup.
struct RasterTriangle {
  ivec3 p0, p1, p2;  // lattice steps
  int64_t area;      // twice the area, > 0
  int64_t slope_u;   // depth = w0 + (slope_u (pu - u0) + slope_v (pv - v0)) / area
  int64_t slope_v;
  int tie_down;    // 1: a depth that is a whole number counts as just below it
  uint exit_flag;  // 1: the outward normal looks along the ray
};

/// quotient (modulo 2^32) + remainder / area, 0 <= remainder < area.
struct RasterFraction {
  uint quotient;
  uint64_t remainder;
};

/// a pixel's edge value, and its steps by a pixel: covered where it is >= 0 for all three.
struct RasterEdge {
  int64_t at;
  int along_u, along_v;
};

/// First and one past the last pixel whose centre lies in [low, high] (256 lattice steps a pixel).
STRATA_FN int raster_first_pixel(int low) { return (low + 127) >> 8; }
STRATA_FN int raster_end_pixel(int high) { return ((high - 128) >> 8) + 1; }

/// False for a triangle seen edge-on. `w_axis`: the axis (0, 1, 2) of the rays.
STRATA_FN bool raster_setup(ivec3 p0, ivec3 p1, ivec3 p2, int w_axis,
                            STRATA_OUT(RasterTriangle) t) {
  t.p0 = p0;
  t.p1 = p1;
  t.p2 = p2;
  t.area =
      int64_t(p1.x - p0.x) * int64_t(p2.y - p0.y) - int64_t(p2.x - p0.x) * int64_t(p1.y - p0.y);
  // The frame of the y axis is left-handed: there the area is minus the normal's component.
  t.exit_flag = ((t.area > 0) != (w_axis == 1)) ? 1u : 0u;
  if (t.area < 0) {
    t.p1 = p2;
    t.p2 = p1;
    t.area = -t.area;
  }
  int64_t u1 = int64_t(t.p1.x - p0.x), v1 = int64_t(t.p1.y - p0.y), w1 = int64_t(t.p1.z - p0.z);
  int64_t u2 = int64_t(t.p2.x - p0.x), v2 = int64_t(t.p2.y - p0.y), w2 = int64_t(t.p2.z - p0.z);
  t.slope_u = w1 * v2 - w2 * v1;
  t.slope_v = u1 * w2 - u2 * w1;
  bool down = true;
  if (w_axis != 0) {
    down = t.slope_u < 0 || (t.slope_u == 0 && (w_axis == 1 || t.slope_v <= 0));
  }
  t.tie_down = down ? 1 : 0;
  return t.area != 0;
}

/// The edge from `from` to `to` at the centre of pixel (u, v). Values at centres differ by
/// multiples of 256: the low bits decide nothing.
STRATA_FN RasterEdge raster_edge(ivec3 from, ivec3 to, int u, int v) {
  RasterEdge e;
  e.along_u = from.y - to.y;
  e.along_v = to.x - from.x;
  bool tie_inside = e.along_u > 0 || (e.along_u == 0 && e.along_v > 0);
  int64_t value = int64_t(e.along_u) * int64_t(u * 256 + 128 - from.x) +
                  int64_t(e.along_v) * int64_t(v * 256 + 128 - from.y);
  e.at = (value - int64_t(tie_inside ? 0 : 1)) >> 8;
  return e;
}

/// Adds slope * step, |slope| < 2^60 and |step| < 2^31, to the 128 bits high:low.
STRATA_FN void raster_add_product(int64_t slope, int step, STRATA_INOUT(uint64_t) high,
                                  STRATA_INOUT(uint64_t) low) {
  uint64_t size = uint64_t(slope < 0 ? -slope : slope);
  uint64_t count = uint64_t(uint(step < 0 ? -step : step));
  uint64_t upper = (size >> 32) * count;
  uint64_t product_low = (size & uint64_t(0xffffffffu)) * count;
  uint64_t product_high = upper >> 32;
  upper = upper << 32;
  product_low += upper;
  if (product_low < upper) product_high += uint64_t(1u);
  if ((slope < 0) != (step < 0)) {
    product_low = ~product_low + uint64_t(1u);
    product_high = ~product_high + uint64_t(product_low == uint64_t(0u) ? 1u : 0u);
  }
  low += product_low;
  high += product_high + uint64_t(low < product_low ? 1u : 0u);
}

/// floor((slope_u du + slope_v dv - tie) / area) and what remains.
STRATA_FN RasterFraction raster_divide(int64_t slope_u, int du, int64_t slope_v, int dv, int tie,
                                       int64_t area) {
  RasterFraction result;
  uint64_t divisor = uint64_t(area);
  float size = abs(float(slope_u)) * abs(float(du)) + abs(float(slope_v)) * abs(float(dv));
  // floor of a negative number: its complement is not negative and divides alike.
  bool negative;
  if (size < 4.0e18f) {  // 2^62 is 4.6e18
    int64_t numerator = slope_u * int64_t(du) + slope_v * int64_t(dv) - int64_t(tie);
    negative = numerator < 0;
    uint64_t dividend = uint64_t(negative ? ~numerator : numerator);
    uint64_t quotient = dividend / divisor;
    result.remainder = dividend - quotient * divisor;
    result.quotient = uint(quotient & uint64_t(0xffffffffu));
  } else {
    uint64_t high = uint64_t(0u), low = uint64_t(0u);
    raster_add_product(slope_u, du, high, low);
    raster_add_product(slope_v, dv, high, low);
    if (tie != 0) {
      high -= uint64_t(low == uint64_t(0u) ? 1u : 0u);
      low -= uint64_t(1u);
    }
    negative = int64_t(high) < 0;
    if (negative) {
      high = ~high;
      low = ~low;
    }
    uint64_t remainder = high % divisor;
    uint quotient = 0u;
    for (int i = 0; i < 64; ++i) {
      remainder = (remainder << 1) | (low >> 63);
      low = low << 1;
      quotient = quotient << 1;
      if (remainder >= divisor) {
        remainder -= divisor;
        quotient |= 1u;
      }
    }
    result.remainder = remainder;
    result.quotient = quotient;
  }
  if (negative) {
    result.quotient = ~result.quotient;
    result.remainder = divisor - uint64_t(1u) - result.remainder;
  }
  return result;
}

/// A triangle's depth at the centre of pixel (u, v), less w0.
STRATA_FN RasterFraction raster_depth_at(RasterTriangle t, int u, int v) {
  return raster_divide(t.slope_u, u * 256 + 128 - t.p0.x, t.slope_v, v * 256 + 128 - t.p0.y,
                       t.tie_down, t.area);
}
/// What a pixel along u and one along v add to it.
STRATA_FN RasterFraction raster_depth_along_u(RasterTriangle t) {
  return raster_divide(t.slope_u, 256, int64_t(0), 0, 0, t.area);
}
STRATA_FN RasterFraction raster_depth_along_v(RasterTriangle t) {
  return raster_divide(int64_t(0), 0, t.slope_v, 256, 0, t.area);
}

/// One step: quotient and remainder advance together, with one carry.
STRATA_FN void raster_step(STRATA_INOUT(RasterFraction) at, RasterFraction by, uint64_t area) {
  at.quotient += by.quotient;
  at.remainder += by.remainder;
  if (at.remainder >= area) {
    at.remainder -= area;
    at.quotient += 1u;
  }
}

/// Many steps at once: at + u by_u + v by_v for 0 <= u, v <= 2^16.
STRATA_FN RasterFraction raster_stride(RasterFraction at, RasterFraction by_u, int u,
                                       RasterFraction by_v, int v, uint64_t area) {
  RasterFraction result;
  float inverse = 1.0f / float(area);
  float carries =
      (float(at.remainder) + float(u) * float(by_u.remainder) + float(v) * float(by_v.remainder)) *
      inverse;
  uint64_t carry = uint64_t(uint(floor(carries)));  // off by one at most
  // Modulo 2^64: the true value lies within [-area, 2 area).
  int64_t remainder = int64_t(at.remainder + uint64_t(uint(u)) * by_u.remainder +
                              uint64_t(uint(v)) * by_v.remainder - carry * area);
  uint carried = uint(carry & uint64_t(0xffffffffu));
  if (remainder < 0) {
    remainder += int64_t(area);
    carried -= 1u;
  } else if (remainder >= int64_t(area)) {
    remainder -= int64_t(area);
    carried += 1u;
  }
  result.remainder = uint64_t(remainder);
  result.quotient = at.quotient + uint(u) * by_u.quotient + uint(v) * by_v.quotient + carried;
  return result;
}

/// The depth that is stored: near and far clamp it, they never remove a crossing.
STRATA_FN uint raster_depth(int w0, uint quotient, uint depth_limit) {
  return uint(min(max(int(uint(w0) + quotient), 0), int(depth_limit) - 1));
}

#ifdef __cplusplus
}  // namespace strata::glsl
#endif
#undef STRATA_FN

#endif
