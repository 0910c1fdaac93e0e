#include <algorithm>
#include <array>
#include <vector>

#include "transparency/bounded/bounded_techniques.h"
#include "transparency/bounded/two_passes.h"

// M. Salvi, J. Montgomery, A. Lefohn, "Adaptive transparency" (2011): a visibility function of n
// nodes a pixel, then the sum of all fragments by it. Where pixels cannot be locked, the paper
// stores all fragments in linked lists first, and takes as much memory as an A-buffer.

namespace strata::transparency {
namespace {

constexpr std::string_view kPaper = "Salvi, Montgomery, Lefohn 2011";
constexpr std::string_view kVariants = "sum normalized";

bool normalized(const Settings& settings) { return settings.variant == "normalized"; }

Result<TileRenderer> make_adaptive(const FrameInfo&, const Settings& settings,
                                   const std::shared_ptr<const void>&) {
  return two_pass_renderer(AdaptiveNodes(settings.k), normalized(settings));
}

/// All fragments in lists; the nodes are those of one pixel at a time.
class ListedNodes {
 public:
  explicit ListedNodes(const Settings& settings)
      : nodes_(settings.k), normalized_(normalized(settings)), heads_(kTilePixels) {}

  void render(TileStream& stream, TileImage& image) {
    std::fill(heads_.begin(), heads_.end(), kNone);
    items_.clear();
    next_.clear();
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      next_.push_back(heads_[pixel]);
      heads_[pixel] = static_cast<std::uint32_t>(items_.size());
      items_.push_back(item);
    });
    merged_ = comparisons_ = most_layers_ = 0;
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (heads_[pixel] != kNone) resolve(stream, heads_[pixel], image.pixels[pixel]);
    });
    Costs& costs = stream.costs();
    costs.stored = costs.kept = items_.size();
    costs.merged = merged_;
    costs.comparisons = comparisons_;
    costs.most_layers = most_layers_;
    costs.formula_bytes = 12 * stream.size() + 4 * stream.pixel_count();
    costs.allocated_bytes = items_.size() * sizeof(DepthItem) +
                            next_.size() * sizeof(std::uint32_t) + 4 * stream.pixel_count();
  }

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  void resolve(TileStream& stream, std::uint32_t head, glm::vec4& out) {
    pixel_.clear();
    for (std::uint32_t i = head; i != kNone; i = next_[i]) pixel_.push_back(items_[i]);
    std::reverse(pixel_.begin(), pixel_.end());  // to the submission order
    most_layers_ = std::max<std::uint64_t>(most_layers_, pixel_.size());
    std::array<AdaptiveNodes::Word, AdaptiveNodes::kMostNodes> words;
    nodes_.clear(words.data());
    for (const DepthItem item : pixel_) {
      const Added added =
          nodes_.add(words.data(), static_cast<float>(item.depth()), stream.opacity(item));
      merged_ += added.merged ? 1 : 0;
      comparisons_ += added.comparisons;
    }
    VisibleSum sum{&out};
    for (const DepthItem item : pixel_) {
      const float visible = nodes_.transmittance(words.data(), static_cast<float>(item.depth()));
      sum.add(stream.shade(item), normalized_ ? std::max(visible, kLeastVisible) : visible);
    }
    if (normalized_) sum.normalize();
  }

  AdaptiveNodes nodes_;
  bool normalized_;
  std::vector<std::uint32_t> heads_, next_;
  std::vector<DepthItem> items_, pixel_;
  std::uint64_t merged_ = 0, comparisons_ = 0, most_layers_ = 0;
};

Result<TileRenderer> make_listed(const FrameInfo&, const Settings& settings,
                                 const std::shared_ptr<const void>&) {
  return renderer_of<ListedNodes>(settings);
}

}  // namespace

const Technique kAdaptive{
    .name = "at",
    .title = "Adaptive transparency: a visibility function of nodes",
    .paper = kPaper,
    .accuracy = Accuracy::kBounded,
    .k_means = "nodes",
    .default_k = 8,
    .least_k = 1,
    .most_k = AdaptiveNodes::kMostNodes,
    .variants = kVariants,
    .memory = "8 bytes a node and pixel; 4 more a pixel if normalized",
    .fails =
        "too dark where a pixel has more fragments than nodes; fragments of equal depth do not "
        "attenuate one another",
    .make = make_adaptive,
};

const Technique kAdaptiveLists{
    .name = "at-lists",
    .title = "Adaptive transparency from linked lists",
    .paper = kPaper,
    .accuracy = Accuracy::kBounded,
    .k_means = "nodes",
    .default_k = 8,
    .least_k = 1,
    .most_k = AdaptiveNodes::kMostNodes,
    .variants = kVariants,
    .memory = "12 bytes a fragment, 4 a pixel",
    .fails = "as at; the memory of an A-buffer",
    .make = make_listed,
};

}  // namespace strata::transparency
