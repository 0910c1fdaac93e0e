#include "transparency/bounded/bounded_techniques.h"
#include "transparency/bounded/two_passes.h"

// Visibility functions that were made for shadows, seen from the eye: transparency/stream/
// visibility.h names their papers. Coarse functions let many fragments see one another unshaded, or
// shade a fragment by itself: so the sum is normalized to the exact opacity, as in C. Muenstermann
// et al., "Moment-based order-independent transparency" (2018). The variant `sum` does not.

namespace strata::transparency {
namespace {

constexpr std::string_view kVisibilityMapsVariants = "normalized sum";

template <class Kind>
Result<TileRenderer> make_visibility_maps(const FrameInfo&, const Settings& settings,
                                          const std::shared_ptr<const void>&) {
  return two_pass_renderer(Kind(settings.k), settings.variant == "normalized");
}

}  // namespace

const Technique kOpacityMap{
    .name = "opacity-map",
    .title = "Opacity shadow map: slices of depth",
    .paper = "Kim, Neumann 2001",
    .accuracy = Accuracy::kBounded,
    .k_means = "slices",
    .default_k = 16,
    .least_k = 1,
    .most_k = 1024,
    .variants = kVisibilityMapsVariants,
    .memory = "4 bytes a slice and pixel; 4 more a pixel if normalized",
    .fails = "fragments within a slice do not attenuate one another",
    .make = make_visibility_maps<OpacityShadowMap>,
};

const Technique kOccupancyMap{
    .name = "occupancy-map",
    .title = "Occupancy map: a bit a slice of depth",
    .paper = "Sintorn, Assarsson 2009",
    .accuracy = Accuracy::kBounded,
    .k_means = "slices",
    .default_k = 128,
    .least_k = 32,
    .most_k = 1024,
    .variants = kVisibilityMapsVariants,
    .memory = "4 bytes for 32 slices and 4 more, a pixel; 4 more if normalized",
    .fails =
        "where the fragments of a pixel differ in opacity: all slices with fragments count alike",
    .make = make_visibility_maps<OccupancyMap>,
};

const Technique kFourierMap{
    .name = "fourier-map",
    .title = "Fourier opacity map",
    .paper = "Jansen, Bavoil 2010",
    .accuracy = Accuracy::kBounded,
    .k_means = "terms",
    .default_k = 7,
    .least_k = 1,
    .most_k = 64,
    .variants = kVisibilityMapsVariants,
    .memory = "8 bytes a term and 4 more, a pixel; 4 more if normalized",
    .fails = "visibility rings about surfaces of high opacity",
    .make = make_visibility_maps<FourierOpacityMap>,
};

}  // namespace strata::transparency
