#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <vector>

#include "raster/triangle_setup.h"
#include "transparency/slots/slot_techniques.h"
#include "transparency/stream/tile_stream.h"

// N. Jouppi, C.-F. Chang, "Z3: an economical hardware technique for high-quality antialiasing and
// transparency" (1999): k slots a pixel; each holds what one triangle covers of it: a colour, the
// depth in the middle with its slopes along u and v, and a mask of the samples. Each sample sorts
// the slots that cover it by their depths there, so that planes part along their true line. Where
// all slots are taken, the two that are nearest in depth are merged, rather such as cover few
// samples: one over the other where both are, areas weighed elsewhere.

namespace strata::transparency {
namespace {

/// What a slot keeps.
struct Part {
  glm::vec4 colour;  ///< premultiplied, and opacity
  double depth = 0, along_u = 0,
         along_v = 0;      ///< in the middle, and its steps from sample to sample
  std::uint64_t mask = 0;  ///< of samples
  DepthItem item;          ///< the triangle and side; for ties
  bool merged = false;     ///< its plane is that of no triangle
};

static_assert(sizeof(Part) == 64);
constexpr std::uint64_t kZ3PixelBytes = 4;

class Z3 {
 public:
  Z3(const FrameInfo& frame, unsigned k)
      : k_(k),
        across_(frame.across),
        down_(frame.down),
        pixels_across_(kTileSide / frame.across),
        // What the near plane cut has several planes a triangle.
        part_(frame.triangles != nullptr && !frame.triangles->part.cut ? &frame.triangles->part
                                                                       : nullptr) {
    const auto pixels = static_cast<std::size_t>(kTilePixels / (across_ * down_));
    slots_.resize(pixels * (k + 1));
    counts_.resize(pixels);
    masks_.resize(pixels);
  }

  void render(TileStream& stream, TileImage& image) {
    const auto samples = static_cast<std::uint64_t>(across_ * down_);
    Costs& costs = stream.costs();
    costs.formula_bytes = costs.allocated_bytes =
        (sizeof(Part) * k_ + kZ3PixelBytes) * (stream.pixel_count() / samples);
    std::fill(counts_.begin(), counts_.end(), 0u);
    std::uint32_t triangle = 0;
    stream.pass([&](std::uint32_t at, DepthItem item) {
      const std::uint32_t pixel = pixel_of(at);
      const std::uint64_t bit = std::uint64_t{1} << sample_of(at);
      if (part_ == nullptr) {
        put(stream, pixel, flat_part(stream, item, bit));
        return;
      }
      if (item.payload() != triangle) {
        put_all(stream, triangle);
        triangle = item.payload();
      }
      if (masks_[pixel] == 0) touched_.push_back(pixel);
      masks_[pixel] |= bit;
    });
    put_all(stream, triangle);
    for (std::uint32_t pixel = 0; pixel < counts_.size(); ++pixel) {
      if (counts_[pixel] > 0) resolve(stream, pixel, image);
    }
  }

 private:
  [[nodiscard]] std::uint32_t pixel_of(std::uint32_t at) const {
    const int u = static_cast<int>(at) % kTileSide, v = static_cast<int>(at) / kTileSide;
    return static_cast<std::uint32_t>(v / down_ * pixels_across_ + u / across_);
  }
  [[nodiscard]] int sample_of(std::uint32_t at) const {
    const int u = static_cast<int>(at) % kTileSide, v = static_cast<int>(at) / kTileSide;
    return v % down_ * across_ + u % across_;
  }
  /// The first sample of a pixel within the tile.
  [[nodiscard]] glm::ivec2 corner(std::uint32_t pixel) const {
    return {static_cast<int>(pixel) % pixels_across_ * across_,
            static_cast<int>(pixel) / pixels_across_ * down_};
  }
  [[nodiscard]] TriangleSetup plane(std::uint32_t triangle) const {
    const glm::uvec3& t = part_->mesh.triangles[triangle];
    TriangleSetup setup;
    setup_triangle(part_->mesh.vertices[t.x], part_->mesh.vertices[t.y], part_->mesh.vertices[t.z],
                   AxisFrame(Axis::kZ), setup);
    return setup;
  }
  /// A fragment without a plane.
  static Part flat_part(TileStream& stream, DepthItem item, std::uint64_t bit) {
    return {stream.shade(item), static_cast<double>(item.depth()), 0, 0, bit, item};
  }

  /// What one triangle covers, in all its pixels.
  void put_all(TileStream& stream, std::uint32_t payload) {
    if (touched_.empty()) return;
    const DepthItem item(payload);
    const TriangleSetup setup = plane(item.triangle());
    const double area = static_cast<double>(setup.area);
    const double slope_u = static_cast<double>(setup.slope_u) / area;
    const double slope_v = static_cast<double>(setup.slope_v) / area;
    for (const std::uint32_t pixel : touched_) {
      const glm::ivec2 first = corner(pixel);
      const double u = (stream.rect().u0 + first.x + across_ / 2.0) * kLatticeSteps;
      const double v = (stream.rect().v0 + first.y + down_ / 2.0) * kLatticeSteps;
      const double depth = static_cast<double>(setup.w0) +
                           slope_u * (u - static_cast<double>(setup.u[0])) +
                           slope_v * (v - static_cast<double>(setup.v[0]));
      put(stream, pixel,
          {stream.shade(item), depth, slope_u * kLatticeSteps, slope_v * kLatticeSteps,
           masks_[pixel], item});
      masks_[pixel] = 0;
    }
    touched_.clear();
  }
  /// Sorted by the depth in the middle.
  void put(TileStream& stream, std::uint32_t pixel, const Part& part) {
    Part* const slots = slots_.data() + std::size_t{pixel} * (k_ + 1);
    std::uint32_t& count = counts_[pixel];
    std::uint32_t at = count++;
    for (; at > 0 && before(part, slots[at - 1]); --at) slots[at] = slots[at - 1];
    slots[at] = part;
    ++stream.costs().stored;
    stream.costs().comparisons += count - at;
    if (count > k_) merge_two(stream, slots, count);
  }
  static bool before(const Part& a, const Part& b) {
    return a.depth != b.depth ? a.depth < b.depth : a.item < b.item;
  }
  /// Merges the two neighbours that it harms least: distance in depth times samples.
  static void merge_two(TileStream& stream, Part* slots, std::uint32_t& count) {
    std::uint32_t best = 0;
    double least = 0;
    for (std::uint32_t i = 0; i + 1 < count; ++i) {
      const int covered = std::popcount(slots[i].mask) + std::popcount(slots[i + 1].mask);
      const double harm = (slots[i + 1].depth - slots[i].depth) * covered;
      if (i == 0 || harm < least) best = i, least = harm;
    }
    slots[best] = merge(slots[best], slots[best + 1]);
    std::move(slots + best + 2, slots + count, slots + best + 1);
    --count;
    ++stream.costs().merged;
    stream.costs().comparisons += count;
  }
  /// @param front, back  by their depths in the middle
  static Part merge(const Part& front, const Part& back) {
    const auto samples = [](std::uint64_t mask) { return static_cast<float>(std::popcount(mask)); };
    const float of_front = samples(front.mask), of_back = samples(back.mask);
    const float common = samples(front.mask & back.mask), all = samples(front.mask | back.mask);
    Part both = front;
    const glm::vec4 over = front.colour + (1.0f - front.colour.a) * back.colour;
    both.colour =
        (common * over + (of_front - common) * front.colour + (of_back - common) * back.colour) /
        all;
    const double part = of_front / (of_front + of_back);
    both.depth += (back.depth - front.depth) * (1 - part);
    both.along_u += (back.along_u - front.along_u) * (1 - part);
    both.along_v += (back.along_v - front.along_v) * (1 - part);
    both.mask |= back.mask;
    both.merged = true;
    return both;
  }

  /// Whether the order in the middle is that of all samples: the depths of a slot lie before those
  /// of the next, and none is clamped.
  [[nodiscard]] bool in_order(const Part* slots, std::uint32_t count) const {
    constexpr double kRounding = 2.0;
    double end = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      const Part& part = slots[i];
      const double reach = kRounding + std::abs(part.along_u) * (across_ - 1) / 2.0 +
                           std::abs(part.along_v) * (down_ - 1) / 2.0;
      if (part.depth - reach < end) return false;
      end = part.depth + reach;
    }
    return end < kPictureDepthLimit;
  }
  void blend_in_order(const Part* slots, std::uint32_t count, glm::ivec2 first,
                      TileImage& image) const {
    for (int sample = 0; sample < across_ * down_; ++sample) {
      FrontToBack sum;
      bool any = false;
      for (std::uint32_t i = 0; i < count; ++i) {
        if ((slots[i].mask >> sample & 1) == 0) continue;
        sum.add(slots[i].colour);
        any = true;
      }
      const int u = first.x + sample % across_, v = first.y + sample / across_;
      if (any) image.pixels[static_cast<std::size_t>(v * kTileSide + u)] = sum.result();
    }
  }

  void resolve(TileStream& stream, std::uint32_t pixel, TileImage& image) {
    const Part* const slots = slots_.data() + std::size_t{pixel} * (k_ + 1);
    const std::uint32_t count = counts_[pixel];
    stream.costs().kept += count;
    stream.costs().most_layers = std::max<std::uint64_t>(stream.costs().most_layers, count);
    const glm::ivec2 first = corner(pixel);
    if (in_order(slots, count)) {
      blend_in_order(slots, count, first, image);
      return;
    }
    planes_.clear();
    for (std::uint32_t i = 0; i < count; ++i) {
      const bool exact = part_ != nullptr && !slots[i].merged;
      planes_.push_back(exact ? plane(slots[i].item.triangle()) : TriangleSetup{});
    }
    for (int sample = 0; sample < across_ * down_; ++sample) {
      const glm::ivec2 at(sample % across_, sample / across_);
      layers_.clear();
      for (std::uint32_t i = 0; i < count; ++i) {
        if ((slots[i].mask >> sample & 1) == 0) continue;
        const std::uint32_t depth = depth_at(stream, slots[i], planes_[i], first, at);
        const Layer layer{DepthItem(depth, slots[i].item.exit(), slots[i].item.triangle()), i};
        auto place = layers_.end();
        while (place != layers_.begin() && layer.item < place[-1].item) --place;
        layers_.insert(place, layer);
      }
      if (layers_.empty()) continue;
      FrontToBack sum;
      for (const Layer& layer : layers_) sum.add(slots[layer.slot].colour);
      image.pixels[static_cast<std::size_t>((first.y + at.y) * kTileSide + first.x + at.x)] =
          sum.result();
    }
  }
  [[nodiscard]] std::uint32_t depth_at(const TileStream& stream, const Part& part,
                                       const TriangleSetup& setup, glm::ivec2 first,
                                       glm::ivec2 at) const {
    if (part_ != nullptr && !part.merged) {  // as the rasterizer has it
      const glm::ivec2 place(stream.rect().u0 + first.x + at.x, stream.rect().v0 + first.y + at.y);
      return clamp_depth(exact_depth(setup, place.x, place.y), kPictureDepthLimit);
    }
    const double depth = part.depth + part.along_u * (at.x + 0.5 - across_ / 2.0) +
                         part.along_v * (at.y + 0.5 - down_ / 2.0);
    return static_cast<std::uint32_t>(
        std::clamp(std::floor(depth), 0.0, static_cast<double>(kPictureDepthLimit - 1)));
  }

  struct Layer {
    DepthItem item;
    std::uint32_t slot;
  };

  unsigned k_;
  int across_, down_, pixels_across_;
  const ViewPart* part_;
  std::vector<Part> slots_;  ///< k a pixel, and one for a newcomer
  std::vector<std::uint32_t> counts_;
  std::vector<std::uint64_t> masks_;    ///< of the triangle that is being drawn
  std::vector<std::uint32_t> touched_;  ///< its pixels
  std::vector<TriangleSetup> planes_;   ///< of the pixel that is being resolved
  std::vector<Layer> layers_;
};

Result<TileRenderer> make_z3(const FrameInfo& frame, const Settings& settings,
                             const std::shared_ptr<const void>&) {
  return renderer_of<Z3>(frame, settings.k);
}

}  // namespace

const Technique kZ3{
    .name = "z3",
    .title = "Z3: sample masks and depth slopes in k slots",
    .paper = "Jouppi, Chang 1999",
    .accuracy = Accuracy::kBounded,
    .k_means = "slots",
    .default_k = 4,
    .least_k = 1,
    .most_k = 256,
    .memory = "64 bytes a slot, 4 a pixel, whatever its samples",
    .fails = "pixels with more triangles than slots: the two nearest in depth become one",
    .make = make_z3,
};

}  // namespace strata::transparency
