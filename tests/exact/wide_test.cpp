#include "exact/wide.h"

#include <gtest/gtest.h>

#include "tests/exact/exact_oracle.h"

namespace strata::exact {
namespace {

// The value that wraps around into `words` words.
Whole wrapped(const Whole& value, int words) {
  const Whole size = Whole(1) << 64 * words;
  Whole low = value % size;
  if (low < 0) low += size;
  return low >= size / 2 ? Whole(low - size) : low;
}

// Numbers of all lengths, runs of equal bits, and neighbours of powers of two.
template <class T>
T draw(Draw& random) {
  constexpr int kBits = static_cast<int>(8 * sizeof(T));
  constexpr int kWords = kBits / 64;
  Wide<kWords> value;
  const auto kind = random.below(4);
  for (auto& word : value.word) {
    word = kind == 0   ? random.word()
           : kind == 1 ? (random.below(2) == 0 ? 0 : ~std::uint64_t{0})
                       : 0;
  }
  if (kind == 2) {
    value = (Wide<kWords>(1) << static_cast<int>(random.below(kBits))) +
            Wide<kWords>(random.below(3) - 1);
  }
  if (kind == 3) value = Wide<kWords>(random.below(5) - 2);
  value >>= static_cast<int>(random.below(kBits));
  if (random.below(2) == 0) value = -value;
  if constexpr (Narrow<T>) {
    return narrow<T>(value);
  } else {
    return value;
  }
}

template <class T>
class WideLaws : public testing::Test {};
using Types = testing::Types<Wide<1>, Wide<2>, Int192, Int256, Int320, Int640>;
TYPED_TEST_SUITE(WideLaws, Types);

TYPED_TEST(WideLaws, SumsOrderShiftsAndTextAreThoseOfWholeNumbers) {
  constexpr int kWords = TypeParam::kBits / 64;
  Draw random(Input::kTiny, 3);
  for (int i = 0; i < 20000; ++i) {
    const auto a = draw<TypeParam>(random), b = draw<TypeParam>(random);
    const Whole x = whole(a), y = whole(b);
    ASSERT_EQ(whole(a + b), wrapped(x + y, kWords)) << x << " " << y;
    ASSERT_EQ(whole(a - b), wrapped(x - y, kWords)) << x << " " << y;
    ASSERT_EQ(whole(-a), wrapped(-x, kWords)) << x;
    ASSERT_EQ(a < b, x < y) << x << " " << y;
    ASSERT_EQ(a == b, x == y) << x << " " << y;
    ASSERT_EQ(sign_of(a), x.sign()) << x;
    const int shift = static_cast<int>(random.below(TypeParam::kBits));
    ASSERT_EQ(whole(a << shift), wrapped(x * (Whole(1) << shift), kWords)) << x << " " << shift;
    ASSERT_EQ(whole(a >> shift), floor_of(Fraction(x, Whole(1) << shift))) << x << " " << shift;
    ASSERT_EQ(bit_length(a), x == 0 ? 0 : static_cast<int>(msb(abs(x))) + 1) << x;
    ASSERT_EQ(whole(Wide<kWords + 2>(a)), x);
    if (i % 16 == 0) {
      ASSERT_EQ(to_text(a), x.str());
    }
  }
}

TYPED_TEST(WideLaws, DoublesAreNearest) {
  Draw random(Input::kTiny, 4);
  for (int i = 0; i < 3000; ++i) {
    auto a = draw<TypeParam>(random);
    ASSERT_TRUE(is_nearest(to_double(a), Fraction(whole(a)))) << whole(a);
    // A tie of two doubles, and its neighbours.
    const int up = static_cast<int>(random.below(TypeParam::kBits - 60));
    a = TypeParam(random.below(std::int64_t{1} << 52) * 2 + (std::int64_t{1} << 53) + 1) << up;
    for (const int step : {-1, 0, 1}) {
      const TypeParam near = a + TypeParam(step);
      ASSERT_TRUE(is_nearest(to_double(near), Fraction(whole(near)))) << whole(near);
      ASSERT_TRUE(is_nearest(to_double(-near), Fraction(whole(-near)))) << whole(near);
    }
  }
}

TYPED_TEST(WideLaws, QuotientsAndRatiosAreThoseOfWholeNumbers) {
  Draw random(Input::kTiny, 5);
  const auto check = [&](auto n, auto d) {
    if (sign_of(d) < 0) d = -d;
    if (sign_of(d) <= 0) return;  // 0, or the most negative number
    const Fraction ratio(whole(n), whole(d));
    const auto [quotient, remainder] = divide_floor(n, d);
    ASSERT_EQ(whole(quotient), floor_of(ratio)) << whole(n) << " / " << whole(d);
    ASSERT_EQ(whole(remainder), whole(n) - whole(quotient) * whole(d));
    ASSERT_EQ(whole(divide_round(n, d)), floor_of(ratio + Fraction(1, 2)))
        << whole(n) << " / " << whole(d);
    ASSERT_TRUE(is_nearest(ratio_to_double(n, d), ratio)) << whole(n) << " / " << whole(d);
  };
  for (int i = 0; i < 3000; ++i) {
    const auto n = draw<TypeParam>(random);
    check(n, draw<Wide<1>>(random));
    check(n, draw<Int192>(random));
    check(n, draw<TypeParam>(random));
  }
}

TEST(Wide, HalvesAreRoundedUp) {
  EXPECT_EQ(to_text(divide_round(Int192(7), Int192(2))), "4");
  EXPECT_EQ(to_text(divide_round(Int192(-7), Int192(2))), "-3");
  EXPECT_EQ(to_text(divide_round(Int192(-8), Int192(3))), "-3");
  EXPECT_EQ(to_text(divide_floor(Int192(-7), Int192(2)).quotient), "-4");
}

// Digits of a quotient that are first taken too large, by one and by two.
TEST(Wide, QuotientsOfDividendsThatAreJustTooSmallAreRight) {
  Draw random(Input::kTiny, 6);
  for (int i = 0; i < 20000; ++i) {
    Int192 divisor = draw<Int192>(random);
    divisor = divisor.negative() ? -divisor : divisor;
    if (sign_of(divisor) <= 0) continue;
    const auto quotient = draw<Int128>(random);
    const Int320 n = product<Int320>(divisor, quotient) - Int320(random.below(2));
    ASSERT_EQ(whole(divide_floor(n, divisor).quotient),
              floor_of(Fraction(whole(n), whole(divisor))));
  }
}

template <class Result, class A, class B>
void check_products() {
  Draw random(Input::kTiny, 7);
  for (int i = 0; i < 5000; ++i) {
    const auto a = draw<A>(random);
    const auto b = draw<B>(random);
    ASSERT_EQ(whole(product<Result>(a, b)), wrapped(whole(a) * whole(b), Result::kBits / 64))
        << whole(a) << " * " << whole(b);
    ASSERT_EQ(product<Result>(a, b), product<Result>(b, a));
  }
}

TEST(Wide, ProductsOfMixedWidthsAreThoseOfWholeNumbers) {
  check_products<Wide<2>, std::int64_t, std::int64_t>();
  check_products<Int192, std::int64_t, Int128>();
  check_products<Int192, Int128, Int128>();
  check_products<Int256, Int128, Int128>();
  check_products<Int256, Int128, Int192>();
  check_products<Int320, Int128, Int192>();
  check_products<Int320, std::int64_t, Int256>();
  check_products<Int320, std::int64_t, std::int64_t>();
  check_products<Wide<7>, Int256, Int256>();
  check_products<Int640, Wide<7>, Int192>();
  check_products<Int640, Int320, Int320>();
}

TEST(Wide, IsAConstantExpression) {
  static_assert((Int320(1) << 300 >> 299) == Int320(2));
  static_assert(product<Int256>(Int128{-3} << 100, Int192(5)) < Int256(0));
  static_assert(sign_of(product<Int640>(Int320(-1), Int320(-1))) == 1);
  static_assert(sizeof(Int192) == 24 && sizeof(Int640) == 80);
}

}  // namespace
}  // namespace strata::exact
