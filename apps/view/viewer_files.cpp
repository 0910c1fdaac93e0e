#include <algorithm>
#include <filesystem>
#include <fstream>
#include <utility>

#include "apps/view/viewer.h"
#include "strata/core/file_identity.h"

// Files, tabs, parameters and numbers of the window.

namespace strata::view {
namespace {

/// Solids of more triangles are measured when asked: it takes seconds, and memory.
constexpr std::uint64_t kMeasuredAtOnce = 400'000;

std::string title_of(const csg::SceneInput& input) {
  std::string title = std::filesystem::path(input.files.front()).filename().string();
  if (input.files.size() > 1) title += " ...";
  return title;
}

/// A list that is short means that all others are shown.
bool same_hidden(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
    if ((i < a.size() ? a[i] : 0) != (i < b.size() ? b[i] : 0)) return false;
  }
  return true;
}

}  // namespace

// --- tabs ---------------------------------------------------------------------------------------

void Viewer::open_files(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored)) {
      dialog = path;
      continue;
    }
    to_open_.push_back(path);
    dialog.reset();
  }
}

void Viewer::open_next() {
  if (to_open_.empty() || loader_.busy()) return;
  const std::string path = std::move(to_open_.front());
  to_open_.pop_front();
  const FileIdentity file = identify_file(path);
  for (std::size_t i = 0; i < tabs_.size(); ++i) {
    const csg::SceneInput& input = i == tab_ ? options_.command.input : tabs_[i].input;
    if (input.files.size() != 1 || !identify_file(input.files.front()).is_same_file(file)) continue;
    show_tab(i);
    return reload();
  }
  csg::SceneInput input = options_.command.input;
  input.files = {path};
  input.format = MeshFormat::kAuto;
  input.scene_format = false;
  input.expression.clear();
  input.scene.asset_folder.clear();
  input.scene.openscad_options.clear();
  opening_ = input;
  start_load(input);
}

void Viewer::add_tab(csg::SceneInput input) {
  if (!tabs_.empty()) store_tab();
  // A tab that never showed anything gives way.
  if (!tabs_.empty() && !model_) tabs_.erase(tabs_.begin() + static_cast<std::ptrdiff_t>(tab_));
  const bool first = tabs_.empty() && !camera_set_;
  Tab tab;
  tab.title = title_of(input);
  tab.definitions = input.scene.openscad_options;
  tab.input = std::move(input);
  tab.camera = first ? camera_ : Camera{};
  tab.camera.projection = camera_.projection;
  tab.looks.ghosts = looks_.ghosts;
  tabs_.push_back(std::move(tab));
  if (!first) {
    options_.command.view_all = options_.command.auto_centre = true;
    options_.command.default_camera = true;
    options_.command.asked_view = false;
    options_.command.cuts.clear();
  }
  restore_tab(tabs_.size() - 1);
}

void Viewer::store_tab() {
  Tab& tab = tabs_[tab_];
  tab.input = options_.command.input;
  tab.model = model_;
  tab.looks = looks_;
  tab.last_section = last_section_;
  tab.camera = camera_;
  tab.start_camera = start_camera_;
  tab.camera_set = camera_set_;
  tab.history = history_;
  tab.values = values_;
  tab.definitions = definitions_;
  tab.watch = std::move(watch_);
}

void Viewer::restore_tab(std::size_t index) {
  tab_ = index;
  Tab& tab = tabs_[index];
  options_.command.input = tab.input;
  model_ = tab.model;
  looks_ = tab.looks;
  last_section_ = tab.last_section;
  camera_ = tab.camera;
  start_camera_ = tab.start_camera;
  camera_set_ = tab.camera_set;
  history_ = tab.history;
  values_ = tab.values;
  definitions_ = tab.definitions;
  watch_ = std::move(tab.watch);
  picked_.reset();
  board_.take_up(Tool::kNone);
  board_.clear();
  arrangement_.reset();
  measurer_.cancel();
  numbers_.reset();
  numbers_due_ = model_ != nullptr;
  change(true, false);
}

void Viewer::show_tab(std::size_t index) {
  if (index >= tabs_.size() || index == tab_) return;
  if (!opening_) drop_load();
  load_due_.reset();
  store_tab();
  restore_tab(index);
  load_error_.clear();
  say_all();
  if (!model_) reload();
}

void Viewer::next_tab(int by) {
  const auto count = static_cast<int>(tabs_.size());
  if (count < 2) return;
  show_tab(static_cast<std::size_t>((static_cast<int>(tab_) + by + count) % count));
}

void Viewer::close_tab(std::size_t index) {
  if (index >= tabs_.size()) return;
  if (index != tab_) {
    tabs_.erase(tabs_.begin() + static_cast<std::ptrdiff_t>(index));
    if (index < tab_) --tab_;
    return;
  }
  to_open_.clear();
  opening_.reset();
  load_due_.reset();
  drop_load();
  load_error_.clear();
  if (tabs_.size() > 1) show_tab(index + 1 < tabs_.size() ? index + 1 : index - 1);
  tabs_.erase(tabs_.begin() + static_cast<std::ptrdiff_t>(index));
  if (tab_ > index) --tab_;
  if (!tabs_.empty()) return;
  options_.command.input.files.clear();
  model_.reset();
  arrangement_.reset();
  frame_.reset();
  ++frame_serial_;
  picked_.reset();
  watch_.reset();
  history_ = {};
  values_.clear();
  definitions_.clear();
  measurer_.cancel();
  numbers_.reset();
  numbers_due_ = false;
  asked_.clear();
  whole_asked_.reset();
  due_ = false;
  say_all();
}

std::string Viewer::loading_name() const {
  const auto& files = opening_ ? opening_->files : options_.command.input.files;
  return files.empty() ? std::string() : files.front();
}

std::string Viewer::title() const { return tabs_.empty() ? std::string() : tabs_[tab_].title; }

void Viewer::say_all() {
  console_.clear();
  if (!load_error_.empty()) add_error(console_, load_error_);
  if (model_) add_model(console_, *model_);
}

// --- undo ---------------------------------------------------------------------------------------

void Viewer::take_state(const ViewState& state) {
  camera_ = state.camera;
  const bool rearranged =
      !(Viewer::state() == ViewState{camera_, state.section, state.hidden, state.voxels});
  looks_.section = state.section;
  looks_.hidden = state.hidden;
  looks_.voxels = state.voxels;
  change(rearranged);
}

bool Viewer::undo() {
  if (!camera_set_) return false;
  const auto before = history_.undo(state());
  if (before) take_state(*before);
  return before.has_value();
}

bool Viewer::redo() {
  if (!camera_set_) return false;
  const auto after = history_.redo(state());
  if (after) take_state(*after);
  return after.has_value();
}

// --- parameters ---------------------------------------------------------------------------------

const std::vector<Parameter>& Viewer::parameters() const {
  static const std::vector<Parameter> kNone;
  return model_ ? model_->parameters : kNone;
}

/// Takes over what the command line says of the parameters, and forgets values of parameters that
/// are gone.
void Viewer::first_parameters() {
  std::erase_if(values_, [this](const auto& one) {
    const auto known = std::find_if(parameters().begin(), parameters().end(), [&](const auto& p) {
      return p.name == one.first && p.value.index() == one.second.index();
    });
    return known == parameters().end();
  });
  const auto set = std::find(definitions_.begin(), definitions_.end(), "-p");
  if (!parameters().empty() && definitions_.end() - set > 3) {
    const auto sets = read_parameter_sets(*(set + 1));
    auto values = sets ? values_of_set(*sets, *(set + 3), parameters()) : ParameterValues();
    if (values) {
      values_ = *std::move(values);
      definitions_.erase(set, set + 4);
    }
  }
  for (std::size_t i = 0; i + 1 < definitions_.size(); ++i) {
    if (definitions_[i] != "-D") continue;
    const std::string& word = definitions_[i + 1];
    const std::string name = word.substr(0, word.find('='));
    const auto value = parse_literal(std::string_view(word).substr(name.size() + 1));
    for (const Parameter& parameter : parameters()) {
      if (parameter.name != name || !value || value->index() != parameter.value.index()) continue;
      if (!values_.contains(name)) values_[name] = *value;
    }
  }
}

void Viewer::set_parameter(const Parameter& parameter, ParameterValue value) {
  const auto old = values_.find(parameter.name);
  if ((old == values_.end() ? parameter.value : old->second) == value) return;
  const bool given = std::find_if(definitions_.begin(), definitions_.end(), [&](const auto& word) {
                       return word.starts_with(parameter.name + "=");
                     }) != definitions_.end();
  if (value == parameter.value && !given) {
    values_.erase(parameter.name);
  } else {
    values_[parameter.name] = std::move(value);
  }
  load_due_ = Clock::now();
  drop_load();
}

void Viewer::reset_parameters() {
  if (values_.empty()) return;
  values_.clear();
  // What the command line set is the program's again, too.
  for (auto at = definitions_.begin(); at + 1 < definitions_.end();) {
    at = *at == "-D" ? definitions_.erase(at, at + 2) : at + 1;
  }
  load_due_ = Clock::now();
  drop_load();
}

Result<void> Viewer::load_parameters(const std::string& file, const std::string& set) {
  if (parameters().empty()) return fail(ErrorCode::kUsage, "there are no parameters");
  const auto sets = read_parameter_sets(file);
  if (!sets) return tl::unexpected(sets.error());
  auto values = values_of_set(*sets, set, parameters());
  if (!values) {
    return fail(values.error().code, "{}: {}", file, values.error().message);
  }
  reset_parameters();
  values_ = *std::move(values);
  load_due_ = Clock::now();
  return {};
}

Result<void> Viewer::save_parameters(const std::string& file, const std::string& set) const {
  if (parameters().empty()) return fail(ErrorCode::kUsage, "there are no parameters");
  if (set.empty()) return fail(ErrorCode::kUsage, "the parameter set needs a name");
  return write_parameter_set(file, set, parameters(), values_);
}

// --- numbers and the editor
// -----------------------------------------------------------------------

/// Hidden solids do not count; a section only looks inside. Of voxels the threshold decides.
void Viewer::measure_now() {
  if (!model_) return;
  Looks looks;
  looks.hidden = measured_hidden_ = looks_.hidden;
  looks.voxels.threshold = measured_threshold_ = looks_.voxels.threshold;
  numbers_due_ = numbers_wait_ = false;
  numbers_.reset();
  measurer_.start(arrange(*model_, looks));
}

void Viewer::tick_numbers() {
  if (auto done = measurer_.take()) numbers_ = *std::move(done);
  const bool same = same_hidden(looks_.hidden, measured_hidden_) &&
                    looks_.voxels.threshold == measured_threshold_;
  if (model_ && !numbers_due_ && !same) {
    measurer_.cancel();
    numbers_.reset();
    numbers_due_ = true;
  }
  if (!numbers_due_ || !model_ || !settled()) return;
  numbers_due_ = false;
  measured_hidden_ = looks_.hidden;
  measured_threshold_ = looks_.voxels.threshold;
  numbers_wait_ = model_->triangles > kMeasuredAtOnce;
  if (!numbers_wait_) measure_now();
}

std::optional<TextPlace> Viewer::picked_place() const {
  if (!picked_ || !picked_->hit) return {};
  auto place = place_in(solid_name(picked_->solid));
  std::error_code ignored;
  if (place && !std::filesystem::is_regular_file(place->file, ignored)) place.reset();
  return place;
}

Result<void> Viewer::edit(const TextPlace& place) const {
  if (editor_.empty()) {
    return fail(ErrorCode::kUsage,
                "no editor is known: give --editor COMMAND, such as --editor 'gedit +%l %f'");
  }
  const auto words = editor_words(editor_, place);
  if (!words) return tl::unexpected(words.error());
  return start_program(*words);
}

}  // namespace strata::view
