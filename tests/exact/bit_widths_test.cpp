// The corners of a cube of side 2^b, and points near its middle, need the bits that the comments in
// exact/ say, and come within a few bits of them.

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "exact/directions.h"
#include "exact/flat_predicates.h"
#include "tests/exact/exact_oracle.h"

namespace strata::exact {
namespace {

class BitWidths : public testing::TestWithParam<int> {
 protected:
  int b = GetParam();
  std::map<std::string, std::pair<int, int>> seen;  // bits, and the bound

  void see(const std::string& name, int bits, int bound) {
    auto& [most, limit] = seen[name];
    most = std::max(most, bits);
    limit = bound;
  }

  // @param slack  how far the largest may stay below its bound
  void check(int slack) {
    for (const auto& [name, bits] : seen) {
      EXPECT_LE(bits.first, bits.second) << name;
      EXPECT_GE(bits.first, bits.second - slack) << name;
    }
  }
};
INSTANTIATE_TEST_SUITE_P(Exact, BitWidths, testing::Values(26, 29));

TEST_P(BitWidths, OfSignsAreThoseOfTheTable) {
  Draw random(b == 26 ? Input::kCorners26 : Input::kCorners29, 61);
  for (int i = 0; i < 100000; ++i) {
    const Plane p = random.triangle().plane(), q = random.triangle().plane(),
                r = random.triangle().plane(), s = random.triangle().plane();
    const LatticePoint x = random.point(), y = random.point(), corner = random.point();
    for (int k = 0; k < 3; ++k) see("normal", bit_length(p.normal[k]), 2 * b + 1);
    see("offset", bit_length(p.offset(x)), 3 * b + 2);
    see("n . (p - q)", bit_length(dot(p.normal, x - corner)), 3 * b + 3);
    const EdgePoint e = edge_plane_point(x, y, p);
    see("s_p - s_q", bit_length(e.weight()), 3 * b + 3);
    see("(q - p) s_p", bit_length(e.s_p * (y.x - x.x)), 4 * b + 2);
    see("det2", bit_length(det2(e.s_p, e.s_q, height(q, x), height(q, y))), 6 * b + 4);
    const Cross line = cross(p.normal, q.normal);
    see("cross", bit_length(line[0]), 4 * b + 2);
    see("dot", bit_length(dot(p.normal, q.normal)), 4 * b + 2);
    const PlaneView view(p);
    const PlanarDirection d = view.of(q), f = view.of(r);
    see("turn", bit_length(product<Int256>(d.u, f.v) - product<Int256>(d.v, f.u)), 8 * b + 4);
    const PlaneQuad quad = det4(p, q, r, s);
    see("det3", bit_length(quad.weight), 6 * b + 3);
    see("det4", bit_length(quad.height), 9 * b + 6);
    if (quad.weight == Int192(0)) continue;
    const RationalPoint point = rational(p, q, r);
    see("numerator", bit_length(point.x), 7 * b + 4);
    see("numerator, fine", bit_length(Int320(point.x) << kFineBits), 7 * b + 68);
    const auto side = product<Int320>(s.normal.x, point.x) + product<Int320>(s.normal.y, point.y) +
                      product<Int320>(s.normal.z, point.z) - product<Int320>(s.offset(), point.w);
    see("side", bit_length(side), 9 * b + 6);
  }
  check(6);
}

TEST_P(BitWidths, OfFlatSignsAreThoseOfTheTable) {
  Draw random(b == 26 ? Input::kCorners26 : Input::kCorners29, 62);
  const int t = b + kFileBits;
  for (int i = 0; i < 50000; ++i) {
    FilePoint p[4];
    for (FilePoint& x : p) x = file_point(random.point());
    const auto flat = [&](int k) { return FlatPoint(p[k].x, p[k].y); };
    see("twice_area", bit_length(twice_area(flat(0), flat(1), flat(2))), 2 * t + 1);
    see("orient3d", bit_length(orient3d_value(p[0], p[1], p[2], p[3])), 3 * t + 2);
    // Inside of the square, where incircle is not 0.
    FlatPoint inside = flat(3);
    inside.x /= 2;
    see("incircle", bit_length(incircle_value(flat(0), flat(1), flat(2), inside)), 4 * t + 3);
    see("file", bit_length(p[0].x), b + 24);
    see("fine", bit_length(fine_point(random.point())[0]), b + 64);
  }
  check(5);
}

TEST_P(BitWidths, OfExactAreasAreThoseOfTheTable) {
  Draw random(b == 26 ? Input::kCorners26 : Input::kCorners29, 63);
  for (int i = 0; i < 20000; ++i) {
    RationalPoint p[3];
    for (RationalPoint& x : p) {
      const Plane a = random.triangle().plane(), c = random.triangle().plane(),
                  d = random.triangle().plane();
      x = det3(a.normal, c.normal, d.normal) == Int192(0) ? rational(random.point())
                                                          : rational(a, c, d);
    }
    see("orient2d", bit_length(orient2d_value(p[0], p[1], p[2], 0, 1)), 20 * b + 12);
  }
  check(40);  // points of three planes far outside of the cube would need them all
}

}  // namespace
}  // namespace strata::exact
