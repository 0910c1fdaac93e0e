#include "apps/view/script.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iostream>
#include <iterator>
#include <optional>

#include "apps/commands/csg_options.h"
#include "apps/session/option_values.h"
#include "apps/view/scene/camera_control.h"
#include "apps/view/scene/document.h"
#include "apps/view/scene/exporter.h"
#include "apps/view/scene/part_numbers.h"
#include "core/did_you_mean.h"
#include "mesh/text/text_scanner.h"
#include "strata/core/grid.h"
#include "strata/csg/picture/picture.h"
#include "strata/transparency/techniques.h"

namespace strata::view {
namespace {

enum class Form {
  kNone,
  kTwoNumbers,
  kFourNumbers,
  kRange,
  kZoom,
  kDrag,
  kOnOff,
  kWord,
  kSection,
  kColour,
  kWait,
  kExport,
  kParameter,
  kParameters,
  kScroll,
  kText
};

struct Rule {
  std::string_view name;
  Action action;
  Form form;
  std::string_view usage, what;
};

constexpr Rule kRules[] = {
    {"orbit", Action::kOrbit, Form::kTwoNumbers, "DX DY",
     "turn, like a mouse drag of DX, DY pixels"},
    {"pan", Action::kPan, Form::kTwoNumbers, "DX DY", "move, like a mouse drag of DX, DY pixels"},
    {"zoom", Action::kZoom, Form::kZoom, "STEPS [X Y]", "zoom in by a tenth per step"},
    {"drag", Action::kDrag, Form::kDrag, "BUTTON X Y X Y [MOVES]",
     "drag the mouse with left, right or middle"},
    {"click", Action::kClick, Form::kTwoNumbers, "X Y", "click with the left button"},
    {"key", Action::kKey, Form::kWord, "KEY", "press a key, such as ctrl+4, p or escape"},
    {"view", Action::kView, Form::kWord, "NAME",
     "view from: top bottom left right front back diagonal; or centre, all, reset"},
    {"camera", Action::kCamera, Form::kWord, "NUMBERS", "set the camera, as --camera does"},
    {"save-camera", Action::kSaveCamera, Form::kWord, "FILE",
     "write the camera to a file for load-camera and strata csg --camera-file"},
    {"load-camera", Action::kLoadCamera, Form::kWord, "FILE",
     "set the camera to the first of a camera file"},
    {"projection", Action::kProjection, Form::kWord, "P",
     "set the projection, as --projection does"},
    {"section", Action::kSection, Form::kSection, "PLANE",
     "set the section: z=3.5 or z 3.5, y>0, nx,ny,nz,d; off; flip"},
    {"slice", Action::kSlice, Form::kWord, "PLANE",
     "show a slice of voxels: k=12 (a voxel), z=3.5 (a place) or off"},
    {"threshold", Action::kThreshold, Form::kWord, "T",
     "set the value that voxels must have to be solid, or file"},
    {"voxels", Action::kVoxels, Form::kWord, "STYLE",
     "draw voxels as auto, blocks, smooth or xray"},
    {"ghosts", Action::kGhosts, Form::kOnOff, "on|off", "show subtracted solids"},
    {"edges", Action::kEdges, Form::kOnOff, "on|off", "show dark lines along edges"},
    {"axes", Action::kAxes, Form::kOnOff, "on|off", "show the axes in the corner"},
    {"panels", Action::kPanels, Form::kOnOff, "on|off", "show the panels"},
    {"heat", Action::kHeat, Form::kWord, "MAP",
     "set the heat map: off, wall (along the normal), ray (also thickness) or depth"},
    {"heat-range", Action::kHeatRange, Form::kRange, "LOW HIGH|auto",
     "set the thicknesses of the first and the last colour"},
    {"distance", Action::kDistance, Form::kFourNumbers, "X Y X Y",
     "measure the distance of two picks"},
    {"angle", Action::kAngle, Form::kFourNumbers, "X Y X Y", "measure the angle of two faces"},
    {"radius", Action::kRadius, Form::kTwoNumbers, "X Y", "measure a cylinder, sphere or circle"},
    {"thickness", Action::kThickness, Form::kTwoNumbers, "X Y",
     "measure a wall along its normal and along the ray"},
    {"size", Action::kSize, Form::kTwoNumbers, "X Y", "measure size and volume of a solid"},
    {"clear", Action::kClear, Form::kNone, "", "clear all measurements"},
    {"box", Action::kBox, Form::kOnOff, "on|off", "show the box around the result"},
    {"grid", Action::kGrid, Form::kOnOff, "on|off", "show a grid of the plane z = 0"},
    {"scale-bar", Action::kScaleBar, Form::kOnOff, "on|off", "show a bar of a round length"},
    {"ticks", Action::kTicks, Form::kOnOff, "on|off", "show the axes with numbers"},
    {"opacity", Action::kOpacity, Form::kWord, "A", "see through everything: 0 to 1, or off"},
    {"media", Action::kMedia, Form::kOnOff, "on|off", "light through the media of --media"},
    {"technique", Action::kTechnique, Form::kWord, "NAME",
     "set the technique of transparent pictures at rest, as strata oit does"},
    {"scheme", Action::kScheme, Form::kWord, "NAME", "set the colour scheme"},
    {"hide", Action::kHide, Form::kWord, "SOLID",
     "hide a solid, given by a part of its name, @index or all"},
    {"show", Action::kShow, Form::kWord, "SOLID", "show a hidden solid again, named as for hide"},
    {"colour", Action::kColour, Form::kColour, "SOLID COLOUR",
     "colour a solid: red, #rgb, #rrggbb, #rrggbbaa ... or none"},
    {"pick", Action::kPick, Form::kTwoNumbers, "X Y", "print the solid, triangle and position"},
    {"reload", Action::kReload, Form::kNone, "", "load the files again, and wait"},
    {"cancel", Action::kCancel, Form::kNone, "", "stop loading"},
    {"resize", Action::kResize, Form::kTwoNumbers, "WIDTH HEIGHT", "set the size of the window"},
    {"wait", Action::kWait, Form::kWait, "[SECONDS|reload]",
     "wait until the picture is whole, or until a changed file is loaded (--watch)"},
    {"screenshot", Action::kScreenshot, Form::kWord, "FILE.png",
     "write a picture of the whole window"},
    {"picture", Action::kPicture, Form::kWord, "FILE.png",
     "write the picture without panels and overlays"},
    {"export", Action::kExport, Form::kExport, "FILE [N]",
     "write what is seen: a mesh, voxels (N along the longest side), folder/ of slices, a picture"},
    {"open", Action::kOpen, Form::kWord, "FILE", "open a file in a tab of its own, and wait"},
    {"tab", Action::kTab, Form::kWord, "WHICH", "show a tab: next, previous or 1, 2, ...; close"},
    {"undo", Action::kUndo, Form::kNone, "",
     "undo the last change of camera, section, slice or hiding"},
    {"redo", Action::kRedo, Form::kNone, "", "redo it"},
    {"parameter", Action::kParameter, Form::kParameter, "NAME VALUE",
     "set a parameter of a .scad, and wait"},
    {"parameters", Action::kParameters, Form::kParameters, "reset|load|save FILE SET",
     "reset all parameters, or load or save a set of them"},
    {"numbers", Action::kNumbers, Form::kNone, "", "print size, volume, area and weight as JSON"},
    {"material", Action::kMaterial, Form::kWord, "NAME", "choose the material of the weight"},
    {"edit", Action::kEdit, Form::kNone, "", "open the picked solid in the editor"},
    {"look", Action::kLook, Form::kWord, "dark|light", "set the colours of the panels"},
    {"console", Action::kConsole, Form::kOnOff, "on|off", "show warnings and what programs print"},
    {"keys", Action::kKeys, Form::kOnOff, "on|off", "show all keys"},
    {"dialog", Action::kDialog, Form::kWord, "FOLDER|off", "show the dialog that opens files"},
    {"messages", Action::kMessages, Form::kNone, "", "print what the console shows"},
    {"scroll", Action::kScroll, Form::kScroll, "DX DY [shift]",
     "turn the wheel in the middle of the picture by DX, DY steps"},
    {"print", Action::kPrint, Form::kText, "TEXT", "print to standard output"},
    {"stats", Action::kStats, Form::kNone, "", "print times and list statistics as JSON"},
    {"reset-stats", Action::kResetStats, Form::kNone, "", "forget the largest times"},
    {"quit", Action::kQuit, Form::kNone, "", "close the window"},
};

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/// The words of a line. Empty optional: a quote is not closed.
std::optional<std::vector<std::string>> words_of(std::string_view line) {
  std::vector<std::string> words;
  std::size_t i = 0;
  while (true) {
    while (i < line.size() && is_blank(line[i])) ++i;
    if (i == line.size()) return words;
    const bool alone = i + 1 == line.size() || is_blank(line[i + 1]);
    if (line[i] == '#' && (words.empty() || alone)) return words;
    std::string word;
    while (i < line.size() && !is_blank(line[i])) {
      if (line[i] != '"') {
        word += line[i++];
        continue;
      }
      const std::size_t end = line.find('"', i + 1);
      if (end == std::string_view::npos) return {};
      word += line.substr(i + 1, end - i - 1);
      i = end + 1;
    }
    words.push_back(std::move(word));
  }
}

std::optional<double> number_of(std::string_view word) {
  double value = 0;
  if (word.starts_with('+')) word.remove_prefix(1);
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (code != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) return {};
  return value;
}

/// Reads one line.
std::string meant_scheme(std::string_view word) {
  std::vector<std::string_view> names;
  for (const csg::ColourScheme& scheme : csg::colour_schemes()) names.push_back(scheme.name);
  return did_you_mean(word, names);
}

class Line {
 public:
  Line(const Rule& rule, const std::string& where, std::vector<std::string> words)
      : rule_(rule), where_(where), words_(std::move(words)) {}

  Result<void> read(ScriptCommand& command) {
    switch (rule_.form) {
      case Form::kNone:
        return expect(1, 1);
      case Form::kTwoNumbers:
        return numbers(1, 2, 2, command);
      case Form::kFourNumbers:
        return numbers(1, 4, 4, command);
      case Form::kRange:
        if (words_.size() == 2 && words_[1] == "auto") return {};
        if (auto read = numbers(1, 2, 2, command); !read) return read;
        if (command.numbers[0] >= 0 && command.numbers[0] < command.numbers[1]) return {};
        return fail(ErrorCode::kUsage, "{}: the range must begin at 0 or more and rise, got {} {}",
                    where_, words_[1], words_[2]);
      case Form::kZoom:
        if (words_.size() == 3) return usage();
        return numbers(1, 1, 3, command);
      case Form::kDrag:
        return drag(command);
      case Form::kOnOff: {
        if (auto counted = expect(2, 2); !counted) return counted;
        if (words_[1] != "on" && words_[1] != "off") return usage();
        command.on = words_[1] == "on";
        return {};
      }
      case Form::kWord:
        if (auto counted = expect(2, 2); !counted) return counted;
        command.word = words_[1];
        return check_word(command);
      case Form::kSection:
        return section(command);
      case Form::kColour:
        if (auto counted = expect(3, 3); !counted) return counted;
        command.word = words_[1];
        command.value = words_[2];
        return check_colour(command.value);
      case Form::kWait:
        if (auto counted = expect(1, 2); !counted) return counted;
        if (words_.size() == 1) return {};
        if (words_[1] == "reload") {
          command.word = words_[1];
          return {};
        }
        return numbers(1, 1, 1, command);
      case Form::kExport:
        return exported(command);
      case Form::kParameter:
        if (auto counted = expect(3, 3); !counted) return counted;
        command.word = words_[1];
        command.value = words_[2];
        return {};
      case Form::kParameters:
        return parameters(command);
      case Form::kScroll:
        if (words_.size() == 4 && words_.back() == "shift") {
          command.word = words_.back();
          words_.pop_back();
        }
        return numbers(1, 2, 2, command);
      case Form::kText:
        for (std::size_t i = 1; i < words_.size(); ++i) {
          command.word += (i > 1 ? " " : "") + words_[i];
        }
        return {};
    }
    return {};
  }

 private:
  [[nodiscard]] tl::unexpected<Error> usage() const {
    return fail(ErrorCode::kUsage, "{}: usage: {} {}", where_, rule_.name, rule_.usage);
  }
  [[nodiscard]] Result<void> expect(std::size_t least, std::size_t most) const {
    if (words_.size() >= least && words_.size() <= most) return {};
    return usage();
  }
  Result<void> numbers(std::size_t first, std::size_t least, std::size_t most,
                       ScriptCommand& command) const {
    if (auto counted = expect(first + least, first + most); !counted) return counted;
    for (std::size_t i = first; i < words_.size(); ++i) {
      const auto value = number_of(words_[i]);
      if (!value) {
        return fail(ErrorCode::kUsage, "{}: '{}' is not a number; usage: {} {}", where_, words_[i],
                    rule_.name, rule_.usage);
      }
      command.numbers.push_back(*value);
    }
    if (command.action == Action::kResize &&
        (command.numbers[0] < 1 || command.numbers[1] < 1 || command.numbers[0] > 16384 ||
         command.numbers[1] > 16384)) {
      return fail(ErrorCode::kUsage,
                  "{}: the window must be 1 to 16384 pixels wide and high, got {} x {}", where_,
                  command.numbers[0], command.numbers[1]);
    }
    return {};
  }
  Result<void> drag(ScriptCommand& command) const {
    if (words_.size() < 2) return usage();
    if (words_[1] != "left" && words_[1] != "right" && words_[1] != "middle") return usage();
    command.word = words_[1];
    return numbers(2, 4, 5, command);
  }
  Result<void> section(ScriptCommand& command) const {
    if (auto counted = expect(2, 3); !counted) return counted;
    command.word = words_.size() == 3 ? words_[1] + "=" + words_[2] : words_[1];
    if (command.word == "off" || command.word == "flip") return {};
    const auto plane = apps::parse_section(command.word);
    if (!plane) return fail(ErrorCode::kUsage, "{}: {}", where_, plane.error().message);
    return {};
  }
  Result<void> parameters(ScriptCommand& command) const {
    if (words_.size() < 2) return usage();
    command.word = words_[1];
    if (command.word == "reset") return expect(2, 2);
    if (command.word != "load" && command.word != "save") return usage();
    if (auto counted = expect(4, 4); !counted) return counted;
    command.value = words_[2];
    command.more = words_[3];
    return {};
  }
  Result<void> exported(ScriptCommand& command) const {
    if (auto counted = expect(2, 3); !counted) return counted;
    command.word = words_[1];
    const auto kind = export_kind(command.word);
    if (!kind) return fail(ErrorCode::kUsage, "{}: {}", where_, kind.error().message);
    if (words_.size() == 2) return {};
    if (*kind != ExportKind::kVoxels) return usage();
    if (auto read = numbers(2, 1, 1, command); !read) return read;
    const double voxels = command.numbers[0];
    if (voxels >= 1 && voxels <= kMaxGridSide && voxels == std::floor(voxels)) return {};
    return fail(ErrorCode::kUsage, "{}: the voxels must be 1 to {}, got {}", where_, kMaxGridSide,
                words_[2]);
  }
  Result<void> check_word(ScriptCommand& command) const {
    const auto one_of = [&](std::initializer_list<std::string_view> names) -> Result<void> {
      if (std::find(names.begin(), names.end(), command.word) != names.end()) return {};
      return fail(ErrorCode::kUsage, "{}: unknown {} '{}'; it must be one of {}{}", where_,
                  rule_.name, command.word, fmt::join(names, ", "),
                  did_you_mean(command.word, {names.begin(), names.size()}));
    };
    switch (command.action) {
      case Action::kView:
        return one_of({"top", "bottom", "left", "right", "front", "back", "diagonal", "centre",
                       "all", "reset"});
      case Action::kProjection: {
        const auto projection = apps::parse_projection(command.word);
        if (projection) return {};
        return fail(ErrorCode::kUsage, "{}: {}", where_, projection.error().message);
      }
      case Action::kScreenshot:
      case Action::kPicture:
        return apps::check_picture_name(fmt::format("{}: ", where_), command.word);
      case Action::kHeat:
        return one_of({"off", "wall", "ray", "thickness", "depth"});
      case Action::kLook:
        return one_of({"dark", "light"});
      case Action::kVoxels:
        return one_of({"auto", "blocks", "smooth", "xray"});
      case Action::kThreshold: {
        if (command.word == "file") return {};
        const auto number = number_of(command.word);
        if (!number) return usage();
        command.numbers = {*number};
        return {};
      }
      case Action::kTab: {
        const auto number = number_of(command.word);
        if (!number) return one_of({"next", "previous", "close"});
        if (!(*number >= 1 && *number <= 10'000 && *number == std::floor(*number))) return usage();
        command.numbers = {*number};
        return {};
      }
      case Action::kMaterial:
        if (find_material(command.word) != nullptr) return {};
        return fail(ErrorCode::kUsage, "{}: unknown material '{}'", where_, command.word);
      case Action::kCamera: {
        const auto camera = apps::parse_camera(command.word);
        if (!camera) return fail(ErrorCode::kUsage, "{}: {}", where_, camera.error().message);
        return {};
      }
      case Action::kOpacity: {
        if (command.word == "off") return {};
        const auto opacity = number_of(command.word);
        if (!opacity || !(*opacity >= 0.0 && *opacity <= 1.0)) {
          return fail(ErrorCode::kUsage, "{}: the opacity must be 0 to 1 or off, got '{}'", where_,
                      command.word);
        }
        command.numbers = {*opacity};
        return {};
      }
      case Action::kTechnique: {
        const auto technique = transparency::parse_technique(command.word);
        if (!technique) return fail(ErrorCode::kUsage, "{}: {}", where_, technique.error().message);
        return {};
      }
      case Action::kScheme:
        if (csg::find_colour_scheme(command.word) != nullptr) return {};
        return fail(ErrorCode::kUsage, "{}: unknown colour scheme '{}'{}", where_, command.word,
                    meant_scheme(command.word));
      default:
        return {};
    }
  }
  Result<void> check_colour(const std::string& word) const {
    if (word == "none" || parse_colour(word)) return {};
    const auto colour = apps::parse_colour(
        fmt::format("{}: the colour must be none, #rgb, #rrggbbaa or", where_), word);
    return tl::unexpected(colour.error());
  }

  const Rule& rule_;
  const std::string& where_;
  std::vector<std::string> words_;
};

}  // namespace

Result<std::vector<ScriptCommand>> parse_script(std::string_view text, const std::string& name) {
  std::vector<ScriptCommand> commands;
  text = strata::detail::without_byte_order_mark(text);
  int number = 0;
  while (!text.empty()) {
    ++number;
    const std::size_t end = std::min(text.find('\n'), text.size());
    const auto words = words_of(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::string where = fmt::format("{}:{}", name, number);
    if (!words) return fail(ErrorCode::kUsage, "{}: a quote is not closed", where);
    if (words->empty()) continue;
    const auto* rule = std::find_if(std::begin(kRules), std::end(kRules),
                                    [&](const Rule& one) { return one.name == words->front(); });
    if (rule == std::end(kRules)) {
      std::vector<std::string_view> names;
      for (const Rule& one : kRules) names.push_back(one.name);
      return fail(ErrorCode::kUsage, "{}: unknown command '{}'{}", where, words->front(),
                  did_you_mean(words->front(), names));
    }
    ScriptCommand command;
    command.line = number;
    command.name = rule->name;
    command.action = rule->action;
    if (auto read = Line(*rule, where, *words).read(command); !read) {
      return tl::unexpected(read.error());
    }
    commands.push_back(std::move(command));
  }
  return commands;
}

Result<std::vector<ScriptCommand>> read_script(const std::string& path) {
  std::string text;
  if (path == "-") {
    text.assign(std::istreambuf_iterator<char>(std::cin), {});
    return parse_script(text, "standard input");
  }
  std::ifstream in(path, std::ios::binary);
  if (!in) return fail(ErrorCode::kInput, "{}: the script cannot be read", path);
  text.assign(std::istreambuf_iterator<char>(in), {});
  return parse_script(text, path);
}

std::string script_help() {
  std::string text;
  for (const Rule& rule : kRules) {
    text += fmt::format("  {:<36}{}\n", fmt::format("{} {}", rule.name, rule.usage), rule.what);
  }
  return text;
}

}  // namespace strata::view
