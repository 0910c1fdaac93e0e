#include "exact/directions.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <numbers>

#include "tests/exact/exact_oracle.h"

namespace strata::exact {
namespace {

using Real = glm::dvec3;

// The angle from `from` to `to` about `axis`, in [0, 2 pi). On a tiny lattice angles that differ do
// so by far more than a double loses, so those below 1e-9 are equal.
double angle(const Real& axis, const Real& from, const Real& to) {
  const double side = glm::dot(glm::normalize(axis), glm::cross(from, to));
  const double result = std::atan2(side, glm::dot(from, to));
  if (std::abs(result) < 1e-9) return 0;
  return result < 0 ? result + 2 * std::numbers::pi : result;
}

int compare(double a, double b) { return std::abs(a - b) < 1e-9 ? 0 : a < b ? -1 : 1; }

TEST(SheetOrder, IsTheOrderOfAnglesAroundAnEdge) {
  Draw random(Input::kTiny, 41);
  int equal = 0;
  for (int i = 0; i < 20000; ++i) {
    const LatticePoint p = random.point(), q = random.point();
    std::array<LatticePoint, 3> r;
    std::array<Normal, 3> n;
    for (std::size_t k = 0; k < 3; ++k) {
      r[k] = random.point();
      n[k] = normal_of(p, q, r[k]);
    }
    if (n[0] == Normal(0) || n[1] == Normal(0) || n[2] == Normal(0)) continue;
    // Half-planes by the triangles' third corners, taken perpendicular to the edge.
    const Real axis(q - p);
    const auto inward = [&](std::size_t k) {
      const Real v(r[k] - p);
      return v - axis * (glm::dot(v, axis) / glm::dot(axis, axis));
    };
    const double a = angle(axis, inward(0), inward(1)), b = angle(axis, inward(0), inward(2));
    const SheetOrder order(turning_axis(q - p), n[0]);
    ASSERT_EQ(order(n[1], n[2]), compare(a, b));
    equal += compare(a, b) == 0;
    // The edge backwards turns all normals round and the order with them.
    const SheetOrder back(turning_axis(p - q), -n[0]);
    if (a != 0 && b != 0) {
      ASSERT_EQ(back(-n[1], -n[2]), -compare(a, b));
    }
    // The line of two of the planes is the same axis.
    const Cross line = cross(n[0], n[1]);
    if (line != Cross{0, 0, 0}) {
      const bool same_way =
          glm::dot(Real(static_cast<double>(line[0]), static_cast<double>(line[1]),
                        static_cast<double>(line[2])),
                   axis) > 0;
      const SheetOrder by_line(turning_axis(line), n[0]);
      if (same_way) {
        ASSERT_EQ(by_line(n[1], n[2]), order(n[1], n[2]));
      }
    }
  }
  EXPECT_GT(equal, 100);
}

TEST(OrderInPlane, IsTheOrderOfAnglesAroundAPoint) {
  Draw random(Input::kTiny, 42);
  int equal = 0, checked = 0;
  for (int i = 0; i < 20000; ++i) {
    const Triangle t = random.triangle();
    const Plane plane = t.plane();
    const PlaneView view(plane);
    std::array<PlanarDirection, 3> d;
    std::array<Real, 3> real;
    bool all = true;
    for (std::size_t k = 0; k < 3 && all; ++k) {
      if (random.below(2) == 0) {
        const LatticePoint corners[3] = {t.a, t.b, t.c};
        const auto from = static_cast<std::size_t>(random.below(3));
        const LatticePoint along =
            corners[(from + 1 + static_cast<std::size_t>(random.below(2))) % 3] - corners[from];
        d[k] = view.of(along);
        real[k] = Real(along);
      } else {
        const Plane other = random.triangle().plane();
        const bool turned = random.below(2) == 0;
        d[k] = view.of(turned ? Plane{-other.normal, other.base} : other);
        real[k] = glm::cross(Real(plane.normal), Real(other.normal)) * (turned ? -1.0 : 1.0);
        all = real[k] != Real(0);
      }
    }
    if (!all) continue;
    const Real axis(plane.normal);
    const double a = angle(axis, real[0], real[1]), b = angle(axis, real[0], real[2]);
    ASSERT_EQ(order_in_plane(d[0], d[1], d[2]), compare(a, b));
    ASSERT_EQ(order_in_plane(d[0], d[2], d[1]), -compare(a, b));
    equal += compare(a, b) == 0;
    ++checked;
  }
  EXPECT_GT(equal, 500);
  EXPECT_GT(checked, 10000);
}

template <class Order, class Directions>
void check_preorder(const Order& order, const Directions& all) {
  for (const auto& a : all) {
    ASSERT_EQ(order(a, a), 0);
    for (const auto& b : all) {
      ASSERT_EQ(order(a, b), -order(b, a));
      for (const auto& c : all) {
        if (order(a, b) <= 0 && order(b, c) <= 0) {
          ASSERT_EQ(order(a, c), std::min(order(a, b), order(b, c)));
        }
      }
    }
  }
}

class OrdersByAngle : public testing::TestWithParam<Input> {};
INSTANTIATE_TEST_SUITE_P(Exact, OrdersByAngle, testing::ValuesIn(kInputs));

TEST_P(OrdersByAngle, AreTransitiveAndTurnWithTheirStart) {
  Draw random(GetParam(), 43);
  for (int i = 0; i < 100; ++i) {
    const LatticePoint p = random.point(), q = random.point();
    std::vector<Normal> normals;
    for (int k = 0; k < 40 && normals.size() < 12; ++k) {
      const Normal n = normal_of(p, q, random.point());
      if (n != Normal(0)) normals.insert(normals.end(), {n, -n});
    }
    if (normals.empty()) continue;
    const SheetOrder order(turning_axis(q - p), normals[0]);
    check_preorder(order, normals);
    for (const Normal& n : normals) ASSERT_LE(order(normals[0], n), 0);

    const Triangle t = random.triangle();
    const Plane plane = t.plane();
    const PlaneView view(plane);
    std::vector<PlanarDirection> directions{view.of(t.b - t.a), view.of(t.a - t.b)};
    while (directions.size() < 12) {
      const Plane other = random.triangle().plane();
      if (cross(plane.normal, other.normal) == Cross{0, 0, 0}) {
        directions.push_back(view.of(t.c - t.a));
        continue;
      }
      directions.push_back(view.of(other));
      directions.push_back(view.of(Plane{-other.normal, other.base}));
    }
    const auto in_plane = [&](const PlanarDirection& a, const PlanarDirection& b) {
      return order_in_plane(directions[0], a, b);
    };
    check_preorder(in_plane, directions);
  }
}

TEST_P(OrdersByAngle, TurnsInAPlaneAreTheSignsOfDet3) {
  Draw random(GetParam(), 44);
  for (int i = 0; i < 20000; ++i) {
    const Plane a = random.triangle().plane(), b = random.triangle().plane(),
                c = random.triangle().plane();
    const PlaneView view(a);
    const PlanarDirection x = view.of(b), y = view.of(c);
    ASSERT_EQ(turn_in_plane(x, y), sign_of(det3(a.normal, b.normal, c.normal)));
    ASSERT_EQ(turn_in_plane(x, y),
              sign_of_whole(whole(x.u) * whole(y.v) - whole(x.v) * whole(y.u)));
  }
}

}  // namespace
}  // namespace strata::exact
