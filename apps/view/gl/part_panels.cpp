#include <fmt/core.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>
#include <variant>

#include "apps/view/gl/panel_items.h"
#include "apps/view/gl/panels.h"

// Numbers of the part, and the parameters of the program that makes it.

namespace strata::view {
namespace {

/// `18328.3`, with blanks between thousands where there are many.
std::string grouped(double value) {
  std::string digits = fmt::format("{:.{}f}", value, value < 10 ? 4 : value < 1000 ? 3 : 1);
  const std::size_t point = std::min(digits.find('.'), digits.size());
  if (point < 5) return digits;
  for (std::size_t i = point; i > 3; i -= 3) digits.insert(i - 3, i == 3 ? "" : " ");
  return digits;
}

/// A size without digits that say nothing.
std::string plain(double value) {
  return fmt::format("{:.6g}", std::abs(value) < 1e-12 ? 0 : value);
}

}  // namespace

void Panels::numbers(Viewer& viewer) {
  const Model* model = viewer.model();
  if (model == nullptr) return faint("nothing is open");
  const auto& measured = viewer.numbers();
  const bool known = measured && *measured;
  if (ImGui::BeginTable("numbers", 2)) {
    ImGui::TableSetupColumn("what", ImGuiTableColumnFlags_WidthStretch, 0.3f);
    ImGui::TableSetupColumn("value", ImGuiTableColumnFlags_WidthStretch, 0.7f);
    const glm::dvec3 size = known && !(*measured)->empty ? (*measured)->size
                            : model->box.empty()         ? glm::dvec3(0)
                                                         : model->box.high - model->box.low;
    row("size", fmt::format("{} x {} x {}", plain(size.x), plain(size.y), plain(size.z)));
    if (known) {
      const PartNumbers& n = **measured;
      row("volume", grouped(n.volume));
      row("area", grouped(n.area));
      row("weight", fmt::format("{} g", grouped(weight_of(n, viewer.material()))));
      row("closed", n.open_holes == 0
                        ? "yes"
                        : fmt::format("no: {} closed to measure", counted(n.open_holes, "hole")));
    }
    row("triangles", fmt::format("{}", model->triangles));
    ImGui::EndTable();
  }
  if (measured && !*measured) {
    ImGui::PushTextWrapPos(0.0f);
    faint(measured->error().message);
    ImGui::PopTextWrapPos();
  } else if (viewer.measuring_waits()) {
    if (ImGui::Button("Measure volume and area", {-1, 0})) viewer.measure_now();
    hint("the exact measures of a scene of this size take some seconds");
  } else if (!known) {
    faint("measuring ...");
  }
  ImGui::SetNextItemWidth(-1);
  const Material& chosen = viewer.material();
  const auto label = [](const Material& one) {
    return fmt::format("{}, {:.2f} g/cm3", one.name, one.density);
  };
  if (ImGui::BeginCombo("##material", label(chosen).c_str())) {
    for (const Material& one : materials()) {
      if (ImGui::Selectable(label(one).c_str(), &one == &chosen)) viewer.set_material(one);
    }
    ImGui::EndCombo();
  }
  hint("material of the weight, if the scene's unit is the millimetre");
}

namespace {

/// A number's slider or box. @return whether it was changed
bool edit_number(const char* id, double& number, const Parameter& parameter) {
  // Without a step that says it, digits as the program writes them.
  const double step = parameter.step.value_or(0);
  if (parameter.least && parameter.most) {
    const double least = *parameter.least, most = *parameter.most;
    const bool whole = parameter.step ? std::floor(step) == step && std::floor(least) == least
                                      : std::floor(least) == least && std::floor(most) == most &&
                                            std::floor(number) == number;
    if (!ImGui::SliderScalar(id, ImGuiDataType_Double, &number, &least, &most,
                             whole ? "%.0f" : "%.6g")) {
      return false;
    }
    const double by = parameter.step ? step : whole ? 1.0 : 0.0;
    if (by > 0) number = std::clamp(least + std::round((number - least) / by) * by, least, most);
    return true;
  }
  return ImGui::InputDouble(id, &number, step > 0 ? step : 1.0, 0.0, "%.6g");
}

bool edit_value(ParameterValue& value, const Parameter& parameter) {
  ImGui::SetNextItemWidth(-1);
  if (!parameter.choices.empty()) {
    std::string now = text_of(value);
    for (const auto& choice : parameter.choices) {
      if (choice.value == value) now = choice.label;
    }
    bool changed = false;
    if (ImGui::BeginCombo("##value", now.c_str())) {
      for (const auto& choice : parameter.choices) {
        if (!ImGui::Selectable((choice.label + "##" + text_of(choice.value)).c_str(),
                               choice.value == value)) {
          continue;
        }
        value = choice.value;
        changed = true;
      }
      ImGui::EndCombo();
    }
    return changed;
  }
  if (auto* on = std::get_if<bool>(&value)) return ImGui::Checkbox("##value", on);
  if (auto* number = std::get_if<double>(&value)) return edit_number("##value", *number, parameter);
  if (auto* vector = std::get_if<std::vector<double>>(&value)) {
    bool changed = false;
    const float width = share(static_cast<int>(vector->size()));
    for (std::size_t i = 0; i < vector->size(); ++i) {
      if (i > 0) ImGui::SameLine();
      ImGui::PushID(static_cast<int>(i));
      ImGui::SetNextItemWidth(width);
      if (parameter.least) {
        changed |= edit_number("##value", (*vector)[i], parameter);
      } else {
        changed |= ImGui::InputDouble("##value", &(*vector)[i], 0, 0, "%.6g");
      }
      ImGui::PopID();
    }
    return changed;
  }
  auto& words = std::get<std::string>(value);
  // What is longer than its comment allows can still be seen, and made shorter.
  constexpr std::size_t kLongest = 1000;
  const std::size_t longest = parameter.longest == 0 ? kLongest : parameter.longest;
  std::vector<char> buffer(std::max(std::min(longest, kLongest), words.size()) + 1);
  std::memcpy(buffer.data(), words.data(), words.size());
  if (!ImGui::InputText("##value", buffer.data(), buffer.size())) return false;
  words = buffer.data();
  return true;
}

}  // namespace

void Panels::parameters(Viewer& viewer) {
  // A change makes the model go; what is drawn here stays until the next one.
  const std::vector<Parameter> all = viewer.parameters();
  std::string tab;
  for (const Parameter& parameter : all) {
    if (parameter.tab != tab) {
      tab = parameter.tab;
      if (tab != "Parameters") faint(tab);
    }
    ImGui::PushID(parameter.name.c_str());
    ImGui::AlignTextToFramePadding();
    text(parameter.name);
    hint(parameter.description.empty() ? parameter.name.c_str() : parameter.description.c_str());
    const auto& values = viewer.parameter_values();
    const auto changed = values.find(parameter.name);
    ParameterValue value = changed == values.end() ? parameter.value : changed->second;
    ImGui::SameLine(ImGui::GetContentRegionAvail().x * 0.38f);
    if (edit_value(value, parameter)) viewer.set_parameter(parameter, std::move(value));
    if (!parameter.description.empty()) hint(parameter.description.c_str());
    ImGui::PopID();
  }
  parameter_files(viewer);
}

/// Sets of parameters in the file that OpenSCAD keeps them in.
void Panels::parameter_files(Viewer& viewer) {
  const std::string file = parameter_file_of(viewer.options().command.input.files.front());
  const float third = share(3);
  ImGui::BeginDisabled(viewer.parameter_values().empty());
  if (ImGui::Button("Reset", {third, 0})) viewer.reset_parameters();
  ImGui::EndDisabled();
  ImGui::SameLine();
  if (ImGui::Button("Load ...", {third, 0})) ImGui::OpenPopup("sets");
  hint(("a set of " + file).c_str());
  if (ImGui::BeginPopup("sets")) {
    const auto sets = read_parameter_sets(file);
    if (!sets) faint(sets.error().message);
    if (sets) {
      for (const auto& [name, set] : *sets) {
        if (!ImGui::Selectable(name.c_str())) continue;
        if (auto loaded = viewer.load_parameters(file, name); !loaded) tell(loaded.error().message);
      }
    }
    ImGui::EndPopup();
  }
  ImGui::SameLine();
  if (ImGui::Button("Save ...", {third, 0})) ImGui::OpenPopup("save");
  hint(("as a set in " + file).c_str());
  if (!ImGui::BeginPopup("save")) return;
  ImGui::SetNextItemWidth(200 * scale_);
  const bool entered =
      ImGui::InputTextWithHint("##set", "name of the set", set_name_.data(), set_name_.size(),
                               ImGuiInputTextFlags_EnterReturnsTrue);
  ImGui::SameLine();
  if ((ImGui::Button("Save") || entered) && set_name_[0] != '\0') {
    const auto saved = viewer.save_parameters(file, set_name_.data());
    tell(saved ? fmt::format("written: the set {} in {}", set_name_.data(), file)
               : saved.error().message);
    ImGui::CloseCurrentPopup();
  }
  ImGui::EndPopup();
}

}  // namespace strata::view
