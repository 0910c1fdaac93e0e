// What an exact sign costs: integers of 128 to 320 bits, and the filters in double before them.

#include <benchmark/benchmark.h>

#include <random>
#include <vector>

#include "exact/directions.h"
#include "exact/flat_predicates.h"

namespace {

using namespace strata::exact;

constexpr std::size_t kCount = 1024;  // the input stays in the cache

struct Input {
  std::vector<LatticePoint> points;
  std::vector<Plane> planes;
  std::vector<RationalPoint> cuts;
  std::vector<FilePoint> rounded;
};

// Random points of a cube of side 2^26 or less.
Input make_input(int bits) {
  std::mt19937_64 random(1);
  const auto coordinate = [&] {
    const std::uint64_t side = std::uint64_t{1} << bits;
    return static_cast<std::int32_t>(random() % side) - static_cast<std::int32_t>(side / 2);
  };
  const auto point = [&] { return LatticePoint(coordinate(), coordinate(), coordinate()); };
  Input input;
  for (std::size_t i = 0; i < kCount + 4; ++i) {
    input.points.push_back(point());
    input.planes.push_back(plane_through(point(), point(), point()));
    input.rounded.push_back(file_point(point()) + FilePoint(static_cast<std::int64_t>(i)));
  }
  for (std::size_t i = 0; i < kCount; ++i) {
    input.cuts.push_back(rational(input.planes[i], input.planes[i + 1], input.planes[i + 2]));
  }
  return input;
}

// Runs `work(input, i)` for all i; the report is the time of one.
template <class Work>
void each(benchmark::State& state, const Work& work, int bits = 26) {
  const Input input = make_input(bits);
  for (auto _ : state) {
    for (std::size_t i = 0; i < kCount; ++i) benchmark::DoNotOptimize(work(input, i));
  }
  state.counters["each"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * kCount,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

const auto det4_exact = [](const Input& in, std::size_t i) {
  return sign_of(det4(in.planes[i], in.planes[i + 1], in.planes[i + 2], in.planes[i + 3]).height);
};
const auto det4_filter = [](const Input& in, std::size_t i) {
  return filters::det4(in.planes[i], in.planes[i + 1], in.planes[i + 2], in.planes[i + 3]).height;
};
const auto det3_exact = [](const Input& in, std::size_t i) {
  return sign_of(det3(in.planes[i].normal, in.planes[i + 1].normal, in.planes[i + 2].normal));
};
const auto det3_filter = [](const Input& in, std::size_t i) {
  return filters::det3_sign(in.planes[i].normal, in.planes[i + 1].normal, in.planes[i + 2].normal);
};
const auto lattice_orient3d = [](const Input& in, std::size_t i) {
  return orient3d(in.points[i], in.points[i + 1], in.points[i + 2], in.points[i + 3]);
};
const auto lattice_orient3d_double = [](const Input& in, std::size_t i) {
  return orient3d_in_double(in.points[i], in.points[i + 1], in.points[i + 2], in.points[i + 3]);
};
const auto edge_point_side = [](const Input& in, std::size_t i) {
  return side_of_plane(edge_plane_point(in.points[i], in.points[i + 1], in.planes[i]),
                       in.planes[i + 1]);
};
const auto make_cut = [](const Input& in, std::size_t i) {
  return rational(in.planes[i], in.planes[i + 1], in.planes[i + 2]);
};
const auto cut_side = [](const Input& in, std::size_t i) {
  return side_of_plane(in.cuts[i], in.planes[i + 3]);
};
const auto cut_rounded = [](const Input& in, std::size_t i) { return round_for_file(in.cuts[i]); };
const auto sheets = [](const Input& in, std::size_t i) {
  const SheetOrder order(TurningAxis{2, 1}, in.planes[i].normal);
  return order(in.planes[i + 1].normal, in.planes[i + 2].normal);
};
const auto incircle_exact = [](const Input& in, std::size_t i) {
  const auto flat = [&](std::size_t k) { return FlatPoint(in.rounded[k].x, in.rounded[k].y); };
  return sign_of(incircle_value(flat(i), flat(i + 1), flat(i + 2), flat(i + 3)));
};
const auto incircle_filter = [](const Input& in, std::size_t i) {
  const auto flat = [&](std::size_t k) { return FlatPoint(in.rounded[k].x, in.rounded[k].y); };
  const FlatPoint d = flat(i + 3);
  return filters::incircle(filters::RealFlat(flat(i) - d), filters::RealFlat(flat(i + 1) - d),
                           filters::RealFlat(flat(i + 2) - d));
};
const auto rounded_exact = [](const Input& in, std::size_t i) {
  return sign_of(
      orient3d_value(in.rounded[i], in.rounded[i + 1], in.rounded[i + 2], in.rounded[i + 3]));
};
const auto rounded_filter = [](const Input& in, std::size_t i) {
  return filters::orient3d(in.rounded[i], in.rounded[i + 1], in.rounded[i + 2], in.rounded[i + 3]);
};

BENCHMARK_CAPTURE(each, det4_320_bits, det4_exact);
BENCHMARK_CAPTURE(each, det4_filter, det4_filter);
BENCHMARK_CAPTURE(each, det3_192_bits, det3_exact);
BENCHMARK_CAPTURE(each, det3_filter, det3_filter);
BENCHMARK_CAPTURE(each, orient3d_128_bits, lattice_orient3d);
BENCHMARK_CAPTURE(each, orient3d_double, lattice_orient3d_double, 17);
BENCHMARK_CAPTURE(each, edge_point_side_192_bits, edge_point_side);
BENCHMARK_CAPTURE(each, sheet_order_128_bits, sheets);
BENCHMARK_CAPTURE(each, make_three_plane_point, make_cut);
BENCHMARK_CAPTURE(each, three_plane_point_side, cut_side);
BENCHMARK_CAPTURE(each, three_plane_point_rounded, cut_rounded);
BENCHMARK_CAPTURE(each, incircle_256_bits, incircle_exact);
BENCHMARK_CAPTURE(each, incircle_filter, incircle_filter);
BENCHMARK_CAPTURE(each, rounded_orient3d_192_bits, rounded_exact);
BENCHMARK_CAPTURE(each, rounded_orient3d_filter, rounded_filter);

}  // namespace

BENCHMARK_MAIN();
