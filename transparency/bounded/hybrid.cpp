#include <algorithm>
#include <cmath>
#include <vector>

#include "transparency/bounded/bounded_techniques.h"
#include "transparency/bounded/rows.h"

// M. Maule, J. Comba, R. Torchelsen, R. Bastos, "Hybrid transparency" (2013): the nearest m - 1
// fragments of a pixel are kept, all others become a weighted average.

namespace strata::transparency {
namespace {

/// The average of all fragments behind the rows, as if it lay there `count` times.
glm::vec4 average_of(const glm::vec3& average, float opacities, std::uint32_t count) {
  const auto n = static_cast<float>(count);
  const float through = std::pow(std::max(0.0f, 1.0f - opacities / n), n);
  return {average * (1.0f - through), through};
}

/// Sums in floats: 20 bytes.
struct FloatTail {
  glm::vec3 colour{0.0f};
  float opacity = 0.0f;
  std::uint32_t count = 0;

  static constexpr std::string_view kMemory = "24 bytes a row and pixel, the last one 20";

  void add(const glm::vec4& row) {
    colour += glm::vec3(row);
    opacity += 1.0f - row.a;
    ++count;
  }
  [[nodiscard]] glm::vec4 value() const { return average_of(colour / opacity, opacity, count); }
};
static_assert(sizeof(FloatTail) == 20);

/// [average red:10 | green:10 | blue:10 | unused:2 | opacities in 1/255:16 | count:16]. The paper
/// gives the widths; a sum of colours would not fit 10 bits, so the average is kept. The sums stay
/// at their largest values.
struct PackedTail {
  std::uint32_t colour = 0;
  std::uint16_t opacity = 0, count = 0;

  static constexpr std::string_view kMemory = "8 bytes a row and pixel";

  void add(const glm::vec4& row) {
    const float added = 1.0f - row.a;
    const float before = static_cast<float>(opacity) / 255.0f;
    const glm::uvec3 channels((average() * before + glm::vec3(row)) / (before + added) * 1023.0f +
                              0.5f);
    colour = std::min(channels.r, 1023u) << 20 | std::min(channels.g, 1023u) << 10 |
             std::min(channels.b, 1023u);
    const auto steps = static_cast<unsigned>(added * 255.0f + 0.5f);
    opacity = static_cast<std::uint16_t>(std::min(65535u, opacity + steps));
    count = static_cast<std::uint16_t>(std::min(65535u, count + 1u));
  }
  [[nodiscard]] glm::vec4 value() const {
    return average_of(average(), static_cast<float>(opacity) / 255.0f, count);
  }

 private:
  [[nodiscard]] glm::vec3 average() const {
    return glm::vec3(colour >> 20, colour >> 10 & 1023, colour & 1023) / 1023.0f;
  }
};
static_assert(sizeof(PackedTail) == 8);

template <class Row, class Tail>
class Hybrid {
 public:
  explicit Hybrid(unsigned rows)
      : head_(rows - 1), rows_(kTilePixels * std::size_t{head_}), tails_(kTilePixels) {}

  void render(TileStream& stream, TileImage& image) {
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      clear_rows(rows_of(pixel), head_);
      tails_[pixel] = Tail();
    });
    std::uint64_t stored = 0, averaged = 0, comparisons = 0;
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const glm::vec4& fragment = stream.shade(item);
      if (fragment.a == 0.0f) return;
      ++stored;
      const Row fallen = insert_row(rows_of(pixel), head_, Row::of(fragment, item), comparisons);
      if (fallen.empty()) return;
      const glm::vec4 value = fallen.value();
      if (value.a == 1.0f) return;
      ++averaged;
      tails_[pixel].add(value);
    });
    for_each_pixel(stream, [&](std::uint32_t pixel) { resolve(pixel, image.pixels[pixel]); });
    Costs& costs = stream.costs();
    costs.stored = stored;
    costs.merged = averaged;
    costs.kept = stored - averaged;
    costs.comparisons = comparisons;
    costs.formula_bytes = costs.allocated_bytes =
        (sizeof(Row) * head_ + sizeof(Tail)) * stream.pixel_count();
  }

 private:
  Row* rows_of(std::uint32_t pixel) { return rows_.data() + std::size_t{pixel} * head_; }

  void resolve(std::uint32_t pixel, glm::vec4& out) {
    const auto under = [&out](const glm::vec4& behind) {
      out = {glm::vec3(out) + out.a * glm::vec3(behind), out.a * behind.a};
    };
    const Row* rows = rows_of(pixel);
    for (unsigned i = 0; i < head_ && !rows[i].empty(); ++i) under(rows[i].value());
    if (tails_[pixel].count > 0) under(tails_[pixel].value());
  }

  unsigned head_;
  std::vector<Row> rows_;
  std::vector<Tail> tails_;
};

template <class Row, class Tail>
Result<TileRenderer> make_hybrid(const FrameInfo&, const Settings& settings,
                                 const std::shared_ptr<const void>&) {
  return renderer_of<Hybrid<Row, Tail>>(settings.k);
}

constexpr std::string_view kHybridPaper = "Maule, Comba, Torchelsen, Bastos 2013";

}  // namespace

const Technique kHybrid{
    .name = "ht",
    .title = "Hybrid transparency: nearest fragments and an average",
    .paper = kHybridPaper,
    .accuracy = Accuracy::kBounded,
    .k_means = "rows",
    .default_k = 4,
    .least_k = 1,
    .most_k = 64,
    .memory = FloatTail::kMemory,
    .fails =
        "where more is seen than the nearest rows - 1: all others share one colour and opacity",
    .make = make_hybrid<FloatRow, FloatTail>,
};

const Technique kHybridPacked{
    .name = "ht-packed",
    .title = "Hybrid transparency, 8 bits a channel",
    .paper = kHybridPaper,
    .accuracy = Accuracy::kBounded,
    .k_means = "rows",
    .default_k = 4,
    .least_k = 1,
    .most_k = 64,
    .memory = PackedTail::kMemory,
    .fails =
        "as ht; colours are rounded, and the average of very many fragments keeps the colour of "
        "the first ones",
    .make = make_hybrid<PackedRow, PackedTail>,
};

}  // namespace strata::transparency
