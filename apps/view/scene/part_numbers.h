#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "apps/view/scene/document.h"
#include "apps/view/scene/latest_job.h"
#include "strata/core/result.h"

// What a user wants to know of a part: size, volume, area, weight, and whether it is closed.

namespace strata::view {

/// A material by its usual name.
struct Material {
  std::string_view name;
  double density;  ///< g/cm3
};
[[nodiscard]] std::span<const Material> materials();
/// Null when there is none of that name (case does not matter).
[[nodiscard]] const Material* find_material(std::string_view name);

/// The numbers of a part, exact on the lattice of csg::exact_measures(), or of voxels. World units
/// are millimetres where weights are given.
struct PartNumbers {
  bool empty = true;
  glm::dvec3 size{0};
  double volume = 0, area = 0;   ///< of the result
  glm::dvec3 centre{0};          ///< of mass
  std::uint64_t open_holes = 0;  ///< of the solids: closed to measure
  std::uint64_t voxels = 0;  ///< solid ones of a file of voxels, which has no area and no centre
};
/// In grams.
[[nodiscard]] double weight_of(const PartNumbers& numbers, const Material& material);

/// Measures the result of an arrangement's tree. @return as csg::exact_measures()
Result<PartNumbers> measure_part(const Arrangement& what, const Execution& execution);

/// Measures on a thread of low priority, so that the picture keeps the processors.
class PartMeasurer {
 public:
  /// @param wake called from the measuring thread when there is something to take()
  explicit PartMeasurer(std::function<void()> wake) : job_(std::move(wake)) {}

  /// Begins; what is under way is cancelled and its result forgotten.
  void start(std::shared_ptr<const Arrangement> what);
  void cancel() { job_.forget(); }
  [[nodiscard]] bool busy() const { return job_.busy(); }
  /// The result of a measurement that has ended; once.
  std::optional<Result<PartNumbers>> take() { return job_.take(); }

 private:
  LatestJob<PartNumbers> job_;
};

}  // namespace strata::view
