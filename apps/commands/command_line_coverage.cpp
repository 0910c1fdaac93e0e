// What `strata voxelize` takes for the filled fraction of voxels, and for layers as pictures.

#include <CLI/App.hpp>

#include <bit>
#include <cstdlib>
#include <limits>

#include "apps/commands/choice_words.h"
#include "apps/commands/command_words.h"
#include "apps/commands/commands.h"
#include "apps/session/option_values.h"
#include "strata/voxelize/formats/voxel_writer.h"

namespace strata::apps {
namespace {

constexpr std::int64_t kCoverageRays = 8, kMostCoverageRays = 16;
constexpr std::pair<std::string_view, int> kFlipWords[] = {{"x", 1}, {"y", 2}, {"xy", 3}};
constexpr std::pair<std::string_view, Axis> kSliceAxisWords[] = {
    {"x", Axis::kX}, {"y", Axis::kY}, {"z", Axis::kZ}};

/// "1440x2560"
Result<glm::ivec2> parse_pixels(std::string_view option, std::string_view text) {
  const std::size_t cross = text.find_first_of("xX");
  if (cross == std::string_view::npos) {
    return fail(ErrorCode::kUsage, "{} must be a size in pixels like 1440x2560, got '{}'", option,
                text);
  }
  glm::ivec2 size(0);
  for (int i = 0; i < 2; ++i) {
    const auto number =
        parse_integer(option, i == 0 ? text.substr(0, cross) : text.substr(cross + 1));
    if (!number) return tl::unexpected(number.error());
    if (*number < 1 || *number > kMaxGridSide) {
      return fail(ErrorCode::kUsage, "{} must be 1 to {} pixels a side, got {}", option,
                  kMaxGridSide, *number);
    }
    size[i] = static_cast<int>(*number);
  }
  return size;
}

/// One of the pictures' options that is given, or none.
std::string_view given_layer_option(const CoverageWords& words) {
  return !words.flip.empty()         ? "--flip"
         : !words.slice_axis.empty() ? "--slice-axis"
         : !words.gamma.empty()      ? "--gamma"
         : words.grey                ? "--grey"
         : !words.display.empty()    ? "--display"
         : !words.exposure.empty()   ? "--exposure"
                                     : "";
}

/// Refuses options that the format of the output has no use for.
void check_format(const CoverageWords& words, const VoxelizeCommand& command,
                  const std::optional<VoxelFormat>& format, Reader& reader) {
  const std::string_view option = given_layer_option(words);
  if (!option.empty() && (!format || !format->pictures)) {
    reader.fail_with(
        fmt::format("{} needs pictures of layers: --format png or an .sl1 file", option));
  }
  const bool archive = format && format->name == "sl1";
  if (archive && !words.slice_axis.empty() && command.layers.axis != Axis::kZ) {
    reader.fail_with("--slice-axis must be z for an .sl1, whose layers are printed upwards");
  }
  if (!archive && (!words.display.empty() || !words.exposure.empty())) {
    reader.fail_with(
        fmt::format("{} needs an .sl1 file", !words.display.empty() ? "--display" : "--exposure"));
  }
  if (words.floats && command.coverage == 0) reader.fail_with("--floats needs --coverage");
  if (words.floats && format && format->pictures) {
    reader.fail_with("--floats cannot be combined with pictures, which hold 8 bits");
  }
  if (!words.gamma.empty() && command.coverage == 0) reader.fail_with("--gamma needs --grey");
  if (command.coverage != 0 && format && !format->shares) {
    VoxelWriterOptions shares;
    shares.fog = 1;
    reader.take(check_values(*format, shares));
  }
}

void read_layers(const CoverageWords& words, LayerOptions& layers, Reader& reader) {
  if (!words.slice_axis.empty()) {
    reader.take(parse_choice("--slice-axis", words.slice_axis, kSliceAxisWords), layers.axis);
  }
  if (!words.flip.empty()) {
    int flip = 0;
    reader.take(parse_choice("--flip", words.flip, kFlipWords), flip);
    layers.mirror_left_right = (flip & 1) != 0;
    layers.mirror_up_down = (flip & 2) != 0;
  }
  if (!words.display.empty()) {
    reader.take(parse_pixels("--display", words.display), layers.display);
  }
  std::vector<double> numbers;
  if (!words.gamma.empty()) {
    numbers.assign(1, 1.0);
    reader.take(parse_numbers("--gamma", words.gamma, 1, 1), numbers);
    if (!(numbers[0] >= 0 && numbers[0] <= kMostGamma)) {
      reader.fail_with(fmt::format("--gamma must be 0 to {}, got {}", kMostGamma, numbers[0]));
    }
    layers.gamma = numbers[0];
  }
  if (!words.exposure.empty()) {
    numbers.assign(1, 1.0);
    reader.take(parse_numbers("--exposure", words.exposure, 1, 2), numbers);
    for (const double seconds : numbers) {
      if (!(seconds > 0 && seconds <= kMostExposure)) {
        reader.fail_with(fmt::format("--exposure must be above 0, to {} seconds, got {}",
                                     kMostExposure, seconds));
      }
    }
    layers.exposure = numbers.front();
    layers.first_exposure = numbers.back();
  }
  // Reproducible builds: the time that stands for now.
  if (const char* epoch = std::getenv("SOURCE_DATE_EPOCH"); epoch != nullptr && *epoch != '\0') {
    const auto time = parse_integer("SOURCE_DATE_EPOCH", epoch);
    constexpr std::int64_t kYear10000 = 253402300800;
    if (time && *time >= 0 && *time < kYear10000) layers.time = *time;
  }
}

}  // namespace

void add_coverage(CLI::App& app, Words& words, const char* group) {
  const auto flag = [&](const char* names, auto& target, const char* what, const char* value) {
    app.add_flag(names, target, what)->type_name(value)->group(group);
  };
  const auto option = [&](const char* names, std::string& word, const char* value,
                          const char* what) {
    app.add_option(names, word, what)->type_name(value)->group(group);
  };
  CoverageWords& w = words.coverage;
  flag("--coverage{auto}", w.coverage,
       "Write the filled fraction of each voxel, exact along NxN rays: 0 to 255, or 0 to 1 in a "
       ".vdb; N is 1, 2, 4, 8 or 16 (default: 8)",
       "[=N]");
  flag("--floats", w.floats, "Fractions of --coverage as floats from 0 to 1", "");
  flag("--grey", w.grey, "Grey PNG slices: --coverage=8 as pictures", "");
  option("--gamma", w.gamma, "G", "Grey is 255 * fraction^G; 0 makes black and white (default: 1)");
  option("--flip", w.flip, "x|y|xy", "Mirror slices left to right, upside down, or both");
  option("--slice-axis", w.slice_axis, "x|y|z", "Axis across PNG slices (default: z)");
  option("--display", w.display, "WxH",
         "Pixels of the printer's display, for an .sl1; the part lies in its middle (default: the "
         "grid)");
  option("--exposure", w.exposure, "S[,FIRST]",
         "Seconds of light a layer, and of the first ones, for an .sl1 (default: 10,15)");
}

void read_coverage(const Words& words, VoxelizeCommand& command, Reader& reader) {
  const CoverageWords& w = words.coverage;
  std::optional<VoxelFormat> format;
  if (!command.output.empty()) {
    if (auto found = voxel_format_for(command.output, command.format)) format = *std::move(found);
  }
  const bool archive = format && format->name == "sl1";
  if (!w.coverage.empty() || w.grey || archive) {
    std::int64_t rays = kCoverageRays;
    if (!w.coverage.empty() && w.coverage != "auto") {
      reader.take(parse_integer("--coverage", w.coverage), rays);
    }
    if (rays < 1 || rays > kMostCoverageRays ||
        !std::has_single_bit(static_cast<std::uint64_t>(rays))) {
      reader.fail_with(fmt::format("--coverage must be 1, 2, 4, 8 or 16, got {}", rays));
    }
    command.coverage = static_cast<int>(rays);
    const char* other = command.surface    ? "--surface: a surface has no filled fraction"
                        : command.ids      ? "--ids"
                        : command.fog != 0 ? "--fog"
                        : command.sdf      ? "--sdf"
                        : command.mask     ? "--mask"
                        : command.colours  ? "--colours"
                                           : nullptr;
    if (other != nullptr) {
      reader.fail_with(fmt::format("{} cannot be combined with {}",
                                   !w.coverage.empty() ? "--coverage"
                                   : w.grey            ? "--grey"
                                                       : "an .sl1 file",
                                   other));
    }
  }
  command.floats = w.floats;
  read_layers(w, command.layers, reader);
  check_format(w, command, format, reader);
}

}  // namespace strata::apps
