#include "apps/commands/placement_options.h"

#include <CLI/App.hpp>
#include <cmath>
#include <glm/vector_relational.hpp>

#include "apps/commands/choice_words.h"
#include "apps/session/option_values.h"

namespace strata::apps {
namespace {

constexpr std::pair<std::string_view, csg::MeshPlacement::Up> kUpWords[] = {
    {"y", csg::MeshPlacement::Up::kY}, {"z", csg::MeshPlacement::Up::kZ}};

/// Beyond, volumes and pictures leave what doubles hold; 10^15 micrometres are a million
/// kilometres.
constexpr double kMostScale = 1e15, kMostTranslation = 1e15;

/// --scale S or sx,sy,sz
Result<void> read_scale(const std::string& text, glm::dvec3& scale) {
  auto numbers = parse_numbers("--scale", text, 1, 3);
  if (!numbers) return tl::unexpected(numbers.error());
  numbers->resize(3, numbers->front());
  scale = {(*numbers)[0], (*numbers)[1], (*numbers)[2]};
  if (glm::any(glm::equal(scale, glm::dvec3(0.0)))) {
    return fail(ErrorCode::kUsage, "--scale must not be 0, got {}", text);
  }
  for (const double factor : *numbers) {
    if (std::abs(factor) <= kMostScale && std::abs(factor) >= 1 / kMostScale) continue;
    return fail(ErrorCode::kUsage, "--scale must be {:g} to {:g}, or negative, got {}",
                1 / kMostScale, kMostScale, text);
  }
  return {};
}

}  // namespace

std::string_view PlacementWords::given() const {
  return !unit.empty()        ? "--unit"
         : !scale.empty()     ? "--scale"
         : !up.empty()        ? "--up"
         : !translate.empty() ? "--translate"
                              : "";
}

void define_placement_options(CLI::App& app, PlacementWords& words) {
  const auto option = [&app](const char* names, std::string& word, const char* value,
                             const char* what) {
    app.add_option(names, word, what)->type_name(value)->group("Input");
  };
  option("--unit", words.unit, "um|mm|cm|m|in|ft",
         "Unit of the world: meshes that say theirs are converted to it, the numbers of others are "
         "in it (default: mm with .3mf and .amf, m with glTF alone, else not known)");
  option("--up", words.up, "y|z",
         "Axis that is up in the input; y is turned to z (default: y for glTF, else z)");
  option("--scale", words.scale, "S|SX,SY,SZ",
         "Scale the input, after --unit and --up; a negative factor mirrors it");
  option("--translate", words.translate, "X,Y,Z", "Move the input, after --scale");
}

Result<void> read_placement_options(const PlacementWords& words, csg::MeshPlacement& placement) {
  if (!words.unit.empty()) {
    const auto unit = parse_choice("--unit", words.unit, kLengthWords);
    if (!unit) return tl::unexpected(unit.error());
    placement.unit_metres = metres_of(*unit);
  }
  if (!words.up.empty()) {
    const auto up = parse_choice("--up", words.up, kUpWords);
    if (!up) return tl::unexpected(up.error());
    placement.up = *up;
  }
  if (!words.scale.empty()) {
    if (auto read = read_scale(words.scale, placement.scale); !read) return read;
  }
  if (!words.translate.empty()) {
    const auto numbers = parse_numbers("--translate", words.translate, 3, 3);
    if (!numbers) return tl::unexpected(numbers.error());
    placement.translate = {(*numbers)[0], (*numbers)[1], (*numbers)[2]};
    for (const double length : *numbers) {
      if (std::abs(length) <= kMostTranslation) continue;
      return fail(ErrorCode::kUsage, "--translate must be {:g} to {:g}, got {}", -kMostTranslation,
                  kMostTranslation, words.translate);
    }
  }
  return {};
}

}  // namespace strata::apps
