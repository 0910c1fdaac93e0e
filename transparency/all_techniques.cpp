#include <array>

#include "strata/transparency/techniques.h"
#include "transparency/bounded/bounded_techniques.h"
#include "transparency/lists/list_techniques.h"
#include "transparency/objects/object_techniques.h"
#include "transparency/peeling/peeling_techniques.h"
#include "transparency/slots/slot_techniques.h"
#include "transparency/sums/sum_techniques.h"

namespace strata::transparency {
namespace {

constexpr std::array kAll{
    &kCountScan,
    // lists
    &kHash64,
    &kHash64Cas,
    &kHash64Grown,
    &kHash64Fixed,
    &kHash64Culled,
    &kHash64Nearest,
    &kHash32,
    &kFixedArray,
    &kFixedArrayBounded,
    &kLinkedLists,
    &kLinkedListsGrow,
    &kMlabABuffer,
    &kPagedLists,
    &kPagedListsGrow,
    &kTransmittanceForm,
    &kDeepFrameBuffer,
    &kSBuffer,
    &kCoverageMasks,
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
    // slots
    &kStencilRouted,
    &kFreePipeSorted,
    &kFreePipeCounter,
    &kBucketSort,
    &kAdaptiveBucketSort,
    &kKBuffer,
    &kZ3,
    // objects
    &kObjectSort,
    &kPrimitiveSort,
    &kVisibilityQueries,
    // sums
    &kWeightedSum,
    &kWeightedAverage,
    &kWeightedBlended,
    &kMoments,
    &kStochastic,
    &kScreenDoor,
    &kSilhouetteOpaque,
};

}  // namespace

std::span<const Technique* const> techniques() { return kAll; }

}  // namespace strata::transparency
