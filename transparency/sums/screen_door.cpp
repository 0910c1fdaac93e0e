#include <algorithm>
#include <array>
#include <vector>

#include "transparency/stream/tile_stream.h"
#include "transparency/sums/seeded_random.h"
#include "transparency/sums/sum_techniques.h"

// Screen-door transparency (H. Fuchs et al., "Fast spheres, shadows, textures, transparencies, and
// image enhancements in Pixel-Planes", 1985): a fragment is drawn, opaque, in the share of the
// pixels that its opacity says. The pattern is the ordered dither matrix of 8 x 8. Each triangle
// permutes its ranks in each block of 8 x 8 pixels by a random permutation of its own, else two
// layers of opacity one half would cover the same half. Shifts alone do not do: two shifted
// matrices cover a block wholly or by half.

namespace strata::transparency {
namespace {

constexpr unsigned kSide = 8;

/// The matrix of B. Bayer (1973): element v * 8 + u is 0 to 63.
constexpr auto kMatrix = [] {
  std::array<std::uint8_t, kSide * kSide> matrix{};
  for (unsigned v = 0; v < kSide; ++v) {
    for (unsigned u = 0; u < kSide; ++u) {
      unsigned rank = 0;
      for (unsigned bit = 0; bit < 3; ++bit) {
        rank = rank << 2 | ((u ^ v) >> bit & 1) << 1 | (v >> bit & 1);
      }
      matrix[v * kSide + u] = static_cast<std::uint8_t>(rank);
    }
  }
  return matrix;
}();

/// A permutation of 0 to 63, chosen by the bits of a key: each step can be undone.
unsigned permuted(unsigned rank, std::uint64_t key) {
  for (int round = 0; round < 3; ++round, key >>= 18) {
    rank = ((rank ^ (key & 63)) * ((key >> 6 & 63) | 1) + (key >> 12 & 63)) & 63;
    rank ^= rank >> 3;
  }
  return rank;
}

class ScreenDoor {
 public:
  explicit ScreenDoor(const Settings& settings)
      : seed_(settings.seed), permuted_(settings.variant == "permuted"), nearest_(kTilePixels) {}

  void render(TileStream& stream, TileImage& image) {
    for_each_pixel(stream, [&](std::uint32_t pixel) { nearest_[pixel] = TileFragments::kNothing; });
    std::uint64_t drawn = 0;
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      if (!covers(stream, pixel, item)) return;
      ++drawn;
      nearest_[pixel] = std::min(nearest_[pixel], item);
    });
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (nearest_[pixel] == TileFragments::kNothing) return;
      const glm::vec4& fragment = stream.shade(nearest_[pixel]);
      image.pixels[pixel] = glm::vec4(glm::vec3(fragment) / fragment.a, 0.0f);
    });
    Costs& costs = stream.costs();
    costs.stored = costs.comparisons = drawn;
    costs.lost = stream.size() - drawn;
    costs.formula_bytes = costs.allocated_bytes = sizeof(DepthItem) * stream.pixel_count();
  }

 private:
  [[nodiscard]] bool covers(TileStream& stream, std::uint32_t pixel, DepthItem item) const {
    const unsigned u = static_cast<unsigned>(stream.rect().u0) + pixel % kTileSide;
    const unsigned v = static_cast<unsigned>(stream.rect().v0) + pixel / kTileSide;
    unsigned rank = kMatrix[v % kSide * kSide + u % kSide];
    if (permuted_) {
      rank = permuted(rank, SeededRandom{seed_, item.payload(), u / kSide, v / kSide}.next());
    }
    return stream.opacity(item) * (kSide * kSide) > static_cast<float>(rank) + 0.5f ||
           stream.opacity(item) >= 1.0f;
  }

  std::uint64_t seed_;
  bool permuted_;
  std::vector<DepthItem> nearest_;
};

Result<TileRenderer> make_screen_door(const FrameInfo&, const Settings& settings,
                                      const std::shared_ptr<const void>&) {
  return renderer_of<ScreenDoor>(settings);
}

}  // namespace

const Technique kScreenDoor{
    .name = "screen-door",
    .title = "Screen-door transparency: a pattern of pixels",
    .paper = "Fuchs et al. 1985",
    .accuracy = Accuracy::kRandom,
    .variants = "permuted same-pattern",
    .memory = "8 bytes a pixel",
    .fails =
        "each pixel shows one layer: a pattern of pixels; with the same pattern for all, layers "
        "hide each other wholly or not at all",
    .make = make_screen_door,
};

}  // namespace strata::transparency
