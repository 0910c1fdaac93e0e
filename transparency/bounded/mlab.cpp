#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <vector>

#include "transparency/bounded/bounded_techniques.h"
#include "transparency/bounded/rows.h"

// M. Salvi, K. Vaidyanathan, "Multi-layer alpha blending" (2014): m rows a pixel, sorted by depth.
// A fragment is inserted; with a row too many, two neighbours are blended. Their paper chooses the
// pair with the smallest transmittance, always the last; the other choices that it tried are
// variants. We differ: fragments of opacity 0 are left out, and ties are settled by the total
// order (float rows).

namespace strata::transparency {
namespace {

/// What makes a pair of rows worth keeping apart; the pair with the smallest product is merged.
struct MergeMetric {
  bool transmittance = true, colour = false, depth = false;

  explicit MergeMetric(std::string_view variant) {
    const auto has = [&](std::string_view word) {
      return variant.find(word) != std::string_view::npos;
    };
    transmittance = has("transmittance");
    colour = has("colour");
    depth = has("depth");
  }
  [[nodiscard]] bool is_last_pair() const { return transmittance && !colour && !depth; }

  /// @param rows  all full, sorted @return the first row of the pair
  template <class Row>
  [[nodiscard]] unsigned pair(const Row* rows, unsigned count) const {
    unsigned best = 0;
    double least = 0.0;
    float through = 1.0f;
    for (unsigned i = 0; i + 1 < count; ++i) {
      const glm::vec4 a = rows[i].value(), b = rows[i + 1].value();
      through *= a.a;
      double weight = transmittance ? static_cast<double>(through * b.a) : 1.0;
      if (colour) weight *= static_cast<double>(glm::distance(glm::vec3(a), glm::vec3(b)));
      if (depth) weight *= static_cast<double>(rows[i + 1].depth() - rows[i].depth());
      // Of equal pairs the last one goes.
      if (i > 0 && weight > least) continue;
      least = weight;
      best = i;
    }
    return best;
  }
};

/// The most rows of a pixel.
constexpr unsigned kMostRows = 64;

template <class Row>
class Mlab {
 public:
  explicit Mlab(const Settings& settings)
      : count_(settings.k), metric_(settings.variant), rows_(kTilePixels * std::size_t{count_}) {}

  void render(TileStream& stream, TileImage& image) {
    for_each_pixel(stream, [&](std::uint32_t pixel) { clear_rows(rows_of(pixel), count_); });
    if (metric_.is_last_pair()) {
      insert(stream, [this](Row* rows, const Row& fallen) { rows[count_ - 1].merge(fallen); });
    } else {
      insert(stream, [this](Row* rows, const Row& fallen) { merge_chosen(rows, fallen); });
    }
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      const Row* rows = rows_of(pixel);
      if (rows[0].empty()) return;
      glm::vec4 sum = rows[0].value();
      for (unsigned i = 1; i < count_ && !rows[i].empty(); ++i) {
        const glm::vec4 row = rows[i].value();
        sum = {glm::vec3(sum) + sum.a * glm::vec3(row), sum.a * row.a};
      }
      image.pixels[pixel] = sum;
    });
  }

 private:
  Row* rows_of(std::uint32_t pixel) { return rows_.data() + std::size_t{pixel} * count_; }

  template <class Merge>
  void insert(TileStream& stream, Merge&& merge) {
    std::uint64_t stored = 0, merged = 0, comparisons = 0;
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const glm::vec4& fragment = stream.shade(item);
      if (fragment.a == 0.0f) return;
      ++stored;
      Row* rows = rows_of(pixel);
      const Row fallen = insert_row(rows, count_, Row::of(fragment, item), comparisons);
      if (fallen.empty()) return;
      ++merged;
      merge(rows, fallen);
    });
    Costs& costs = stream.costs();
    costs.stored = stored;
    costs.merged = merged;
    costs.kept = stored - merged;
    costs.comparisons = comparisons;
    costs.formula_bytes = costs.allocated_bytes = sizeof(Row) * count_ * stream.pixel_count();
  }
  void merge_chosen(Row* rows, const Row& fallen) const {
    std::array<Row, kMostRows + 1> all;
    std::copy_n(rows, count_, all.begin());
    all[count_] = fallen;
    const unsigned first = metric_.pair(all.data(), count_ + 1);
    all[first].merge(all[first + 1]);
    std::copy_n(all.begin(), first + 1, rows);
    std::copy_n(all.begin() + first + 2, count_ - first - 1, rows + first + 1);
  }

  unsigned count_;
  MergeMetric metric_;
  std::vector<Row> rows_;
};

template <class Row>
Result<TileRenderer> make_mlab(const FrameInfo&, const Settings& settings,
                               const std::shared_ptr<const void>&) {
  return renderer_of<Mlab<Row>>(settings);
}

constexpr std::string_view kMlabPaper = "Salvi, Vaidyanathan 2014";
constexpr std::string_view kMetrics =
    "transmittance colour depth transmittance-colour transmittance-depth colour-depth "
    "transmittance-colour-depth";

}  // namespace

const Technique kMlab{
    .name = "mlab",
    .title = "Multi-layer alpha blending",
    .paper = kMlabPaper,
    .accuracy = Accuracy::kBounded,
    .k_means = "rows",
    .default_k = 4,
    .least_k = 1,
    .most_k = kMostRows,
    .variants = kMetrics,
    .memory = FloatRow::kMemory,
    .fails =
        "where a fragment falls between others that are merged already; the submission order "
        "shows",
    .make = make_mlab<FloatRow>,
};

const Technique kMlabPacked{
    .name = "mlab-packed",
    .title = "Multi-layer alpha blending, 8 bits a channel",
    .paper = kMlabPaper,
    .accuracy = Accuracy::kBounded,
    .k_means = "rows",
    .default_k = 4,
    .least_k = 1,
    .most_k = kMostRows,
    .variants = kMetrics,
    .memory = PackedRow::kMemory,
    .fails =
        "as mlab; colours and transmittance are rounded at each merge, and fragments at one "
        "depth keep the order of their arrival",
    .make = make_mlab<PackedRow>,
};

}  // namespace strata::transparency
