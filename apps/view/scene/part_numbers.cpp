#include "apps/view/scene/part_numbers.h"

#include <sys/resource.h>

#include <algorithm>
#include <utility>

#include "core/letters.h"
#include "strata/csg/boundary/boundary_mesh.h"

namespace strata::view {
namespace {

/// Usual values; plastics as printed solid.
constexpr Material kMaterials[] = {
    {"PLA", 1.24},       {"PETG", 1.27},  {"ABS", 1.04},    {"ASA", 1.07},       {"TPU", 1.21},
    {"nylon", 1.14},     {"PC", 1.20},    {"resin", 1.15},  {"aluminium", 2.70}, {"steel", 7.85},
    {"stainless", 8.00}, {"brass", 8.50}, {"copper", 8.96}, {"titanium", 4.43},  {"concrete", 2.40},
    {"wood", 0.70},      {"glass", 2.50}, {"water", 1.00}};

}  // namespace

std::span<const Material> materials() { return kMaterials; }

const Material* find_material(std::string_view name) {
  const auto* found = std::find_if(std::begin(kMaterials), std::end(kMaterials),
                                   [&](const Material& one) { return same_word(one.name, name); });
  return found == std::end(kMaterials) ? nullptr : found;
}

double weight_of(const PartNumbers& numbers, const Material& material) {
  return numbers.volume * material.density / 1000.0;  // mm3 to cm3
}

Result<PartNumbers> measure_part(const Arrangement& what, const Execution& execution) {
  if (what.voxels) {
    const auto set = what.voxels->solid(what.voxel_looks.threshold, execution);
    const glm::dvec3 side = set->grid().voxel_size;
    PartNumbers numbers;
    numbers.voxels = set->solid_voxels();
    numbers.empty = numbers.voxels == 0;
    numbers.volume = static_cast<double>(numbers.voxels) * side.x * side.y * side.z;
    const Bounds box = solid_box(*set);
    if (!numbers.empty) numbers.size = box.high - box.low;
    return numbers;
  }
  const auto measured = csg::exact_measures(what.tree, what.tree.root(), {}, execution);
  if (!measured) return tl::unexpected(measured.error());
  PartNumbers numbers;
  numbers.empty = measured->empty;
  if (!measured->empty) numbers.size = measured->high - measured->low;
  numbers.volume = measured->volume;
  numbers.area = measured->area;
  numbers.centre = measured->centre;
  numbers.open_holes = measured->report.caps.size();
  return numbers;
}

void PartMeasurer::start(std::shared_ptr<const Arrangement> what) {
  job_.start("measuring", [what = std::move(what)](const std::stop_token& stop) {
    constexpr int kLow = 10;
    ::setpriority(PRIO_PROCESS, 0, kLow);  // on Linux, of this thread
    Execution execution;
    execution.threads = 1;
    execution.stop = stop;
    return measure_part(*what, execution);
  });
}

}  // namespace strata::view
