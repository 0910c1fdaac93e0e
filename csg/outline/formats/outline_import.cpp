#include "csg/outline/formats/outline_import.h"

#include <algorithm>
#include <filesystem>
#include <glm/common.hpp>
#include <limits>

#include "core/letters.h"
#include "mesh/text/input_bytes.h"

namespace strata::csg {

Result<Outline> read_outline(const std::string& path, const OutlineImport& options,
                             const Execution& execution, std::vector<std::string>* warnings) {
  const std::string extension = lower_case(std::filesystem::path(path).extension().string());
  if (extension != ".svg" && extension != ".dxf") {
    return fail(ErrorCode::kInput, "{}: outlines are read from .svg and .dxf files, not '{}'", path,
                extension);
  }
  constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 31;
  auto bytes = detail::InputBytes::open(path, kMostBytes);
  if (!bytes) return tl::unexpected(bytes.error());
  auto outline = extension == ".svg" ? read_svg(bytes->view(), path, options, execution)
                                     : read_dxf(bytes->view(), path, options, execution, warnings);
  if (!outline || !options.centre || outline->empty()) return outline;
  glm::dvec2 low(std::numeric_limits<double>::infinity()), high = -low;
  for (const auto& contour : outline->contours) {
    for (const glm::dvec2& p : contour) low = glm::min(low, p), high = glm::max(high, p);
  }
  const glm::dvec2 middle = (low + high) / 2.0;
  return transform(*outline, glm::dmat3({1, 0, 0}, {0, 1, 0}, {-middle, 1}));
}

}  // namespace strata::csg
