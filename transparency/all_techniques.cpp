#include <array>

#include "strata/transparency/techniques.h"
#include "transparency/bounded/bounded_techniques.h"
#include "transparency/lists/list_techniques.h"
#include "transparency/peeling/peeling_techniques.h"

namespace strata::transparency {
namespace {

constexpr std::array kAll{
    &kCountScan,
    // peeling
    &kFBuffer,
    &kRBuffer,
    &kVirtualPixelMaps,
    &kDepthPeeling,
    &kDualPeeling,
    &kReversePeeling,
    // bounded
    &kRelaxed,
    &kMlab,
    &kMlabPacked,
    &kHybrid,
    &kHybridPacked,
    &kAdaptive,
    &kAdaptiveLists,
    &kOpacityMap,
    &kOccupancyMap,
    &kFourierMap,
};

}  // namespace

std::span<const Technique* const> techniques() { return kAll; }

}  // namespace strata::transparency
