#include "apps/view/viewer.h"

#include <algorithm>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <utility>

#include "apps/commands/file_uses.h"
#include "apps/session/file_conflicts.h"
#include "apps/session/session.h"
#include "csg/input/frame_scene.h"

namespace strata::view {
namespace {

/// How often files are looked at.
constexpr std::chrono::milliseconds kLookAtFiles{200};

double ms_between(Viewer::Clock::time_point begin, Viewer::Clock::time_point end) {
  return std::chrono::duration<double, std::milli>(end - begin).count();
}

}  // namespace

Viewer::Viewer(const ViewOptions& options, std::unique_ptr<Renderer> renderer,
               const std::function<void()>& wake)
    : show_panels(options.panels),
      options_(options),
      camera_(options.command.camera),
      picture_(options.command.picture),
      heat_(options.heat),
      exporter_(wake),
      measurer_(wake),
      loader_(wake),
      thread_(std::move(renderer), options.command.common.threads, wake) {
  looks_.ghosts = options.ghosts;
  light_look =
      options.look == "light" || (options.look.empty() && remembered_look(folders_) == "light");
  editor_ = editor_command(options.editor, std::getenv("VISUAL"), std::getenv("EDITOR"));
  definitions_ = options.command.input.scene.openscad_options;
  if (options.command.input.files.empty()) return;
  add_tab(options.command.input);
  reload();
}

// --- what is under way --------------------------------------------------------------------------

void Viewer::start_load(const csg::SceneInput& input) {
  apps::CsgCommand command = options_.command;
  command.input = input;
  quiet_cancel_ = false;
  loader_.start(command, options_.command.common.threads);
}

void Viewer::reload() {
  if (tabs_.empty()) return;
  load_due_.reset();
  opening_.reset();
  csg::SceneInput& input = options_.command.input;
  input.scene.openscad_options = definitions_;
  const auto more = definitions_of(values_);
  auto& words = input.scene.openscad_options;
  words.insert(words.end(), more.begin(), more.end());
  start_load(input);
}

void Viewer::cancel_load() {
  to_open_.clear();
  loader_.cancel();
}

Result<void> Viewer::start_export(const std::string& path, int resolution) {
  if (!model_) return fail(ErrorCode::kUsage, "nothing is loaded");
  if (exporting_) return fail(ErrorCode::kUsage, "{}: another export is under way", path);
  const auto kind = export_kind(path);
  if (!kind) return tl::unexpected(kind.error());
  std::vector<apps::FileUse> written;
  for (const std::string& file : export_files(path)) written.push_back({"export", file});
  const auto keeps = [&written](const csg::SceneInput& input, const Model* model) -> Result<void> {
    if (auto kept = apps::check_files(apps::inputs_of(input), written); !kept) return kept;
    if (model == nullptr) return {};
    for (const FileIdentity& file : model->scene.files) {
      if (auto opened = apps::check_opened(file, written); !opened) return opened;
    }
    return {};
  };
  if (auto kept = keeps(options_.command.input, model_.get()); !kept) return kept;
  for (std::size_t i = 0; i < tabs_.size(); ++i) {
    if (i == tab_) continue;
    if (auto kept = keeps(tabs_[i].input, tabs_[i].model.get()); !kept) return kept;
  }
  if (*kind == ExportKind::kPicture) {
    wants_picture = path;
    return {};
  }
  Looks looks = looks_;
  looks.selected.reset();  // its tint is no colour of the scene
  looks.ghosts = false;
  exporter_.start({arrange(*model_, looks), path, resolution, options_.command.input},
                  options_.command.common.threads);
  exporting_ = true;
  return {};
}

void Viewer::change(bool looks, bool input) {
  due_ = true;
  arrange_due_ = arrange_due_ || looks;
  changed_by_input_ = changed_by_input_ || input;
  const auto now = Clock::now();
  if (!changed_at_) changed_at_ = now;
  last_change_ = now;
}

void Viewer::set_viewport(const glm::ivec2& size) {
  if (size == viewport_) return;
  viewport_ = size;
  change(false, false);
}

void Viewer::first_camera() {
  const apps::CsgCommand& command = options_.command;
  const double aspect = static_cast<double>(viewport_.x) / viewport_.y;
  const bool framed = command.default_camera && !command.asked_view;
  if (command.auto_centre) centre_camera(camera_, model_->box);
  if (framed) {
    // Without a stop it does not fail.
    (void)csg::frame_scene(model_->scene, model_->box, command.cuts, {}, aspect, camera_);
  } else if (command.view_all) {
    fit_camera(camera_, model_->box, aspect);
    if (!(camera_.distance > 0)) camera_.distance = Camera{}.distance;  // nothing to fit
  }
  start_camera_ = camera_;
  camera_set_ = true;
  if (!command.cuts.empty() && tab_ == 0) {
    looks_.section = csg::facing(command.cuts.front(), camera_);
  }
  history_.rest(state());
}

void Viewer::take_model(std::shared_ptr<const Model> model) {
  if (model_) {
    looks_ = carry_over(looks_, *model_, *model);
  }
  model_ = std::move(model);
  tabs_[tab_].model = model_;
  picked_.reset();
  first_parameters();
  numbers_.reset();
  numbers_due_ = true;
  board_.clear();
  change(true, false);
}

void Viewer::take_frame(Frame frame) {
  ++statistics_.frames;
  if (frame.prepare_ms > 0) statistics_.prepare_ms = frame.prepare_ms;
  if (frame.divisor > 1) {
    statistics_.coarse_ms = frame.draw_ms;
    statistics_.divisor = frame.divisor;
  } else if (frame.samples > 1) {
    statistics_.smooth_ms = frame.draw_ms;
    statistics_.samples = frame.samples;
  } else {
    statistics_.whole_ms = frame.draw_ms;
    statistics_.report = frame.report;
    statistics_.longest_list = frame.longest_list;
  }
  draw_error_.clear();
  drawn_by_ = frame.drawn_by;
  frame_ = std::move(frame);
  ++frame_serial_;
  frame_presented_ = false;
}

/// Another load follows the one that is under way, or nobody waits for it.
void Viewer::drop_load() {
  quiet_cancel_ = loader_.busy();
  loader_.cancel();
}

void Viewer::take_load(Result<std::shared_ptr<const Model>> loaded) {
  const bool cancelled = !loaded && loaded.error().code == ErrorCode::kCancelled;
  if (std::exchange(quiet_cancel_, false) && cancelled) return;
  ++loads_;
  if (loaded) {
    load_error_.clear();
    if (opening_) add_tab(*std::exchange(opening_, {}));
    if (tabs_.empty()) return;  // it was closed in the meantime
    if (!model_ && options_.screenshot.empty()) {
      for (const std::string& file : options_.command.input.files) remember_file(folders_, file);
    }
    take_model(*std::move(loaded));
  } else {
    opening_.reset();
    load_error_code_ = loaded.error().code;
    load_error_ = load_error_code_ == ErrorCode::kCancelled ? "loading was cancelled"
                                                            : loaded.error().message;
  }
  if (watch_) watch_->refresh(model_ ? model_->scene.files : std::vector<FileIdentity>());
  say_all();
}

void Viewer::take_pick(Result<Picked> picked) {
  picking_ = false;
  if (!picked) {
    draw_error_ = picked.error().message;
    return;
  }
  if (picked->probe) {
    board_.take(*std::move(picked->probe));
    return;
  }
  picked_ = *picked;
  if (picked_->hit && std::exchange(centre_on_pick_, false)) {
    camera_.target = picked_->where;
    change(false);
  }
  const bool own = picked_->hit && model_ && picked_->solid < model_->scene.tree.solids().size();
  select(own ? std::optional(picked_->solid) : std::nullopt, true);
}

void Viewer::tick() {
  if (auto loaded = loader_.take()) take_load(*std::move(loaded));
  open_next();
  constexpr std::chrono::milliseconds kStill{250};
  const auto now = Clock::now();
  if (load_due_ && now - *load_due_ > kStill) reload();
  if (now - last_change_ > 2 * kStill && !dragging() && camera_set_) history_.rest(state());
  if (auto done = exporter_.take()) {
    exporting_ = false;
    ++exports_;
    exported_ = *std::move(done);
  }
  if (options_.watch && !tabs_.empty()) {
    if (!watch_) {
      watch_ = std::make_unique<FileWatch>(options_.command.input.files,
                                           options_.command.input.scene.asset_folder);
    }
    if (now - looked_ >= kLookAtFiles) {
      looked_ = now;
      if (watch_->changed()) reload();
    }
  }
  // One that comes when all tabs are closed is of no use.
  if (auto frame = thread_.take_frame(); frame && model_) take_frame(*std::move(frame));
  if (auto error = thread_.take_error()) {
    draw_error_ = error->message;
    asked_.clear();
    whole_asked_.reset();
  }
  if (auto picked = thread_.take_pick()) take_pick(*std::move(picked));
  tick_numbers();
  if (board_.shows() && !guides_asked_) change(false, false);
  if (!due_ || !model_ || viewport_.x < 1 || viewport_.y < 1) return;
  if (!camera_set_) first_camera();
  if (arrange_due_ || !arrangement_) arrangement_ = arrange(*model_, looks_);
  arrange_due_ = due_ = false;
  FrameRequest request;
  request.what = arrangement_;
  request.camera = camera_;
  request.size = viewport_;
  request.look = picture_;
  request.heat = heat_;
  request.heat_range = heat_range_;
  request.guides = guides_asked_ = board_.shows();
  request.see_through = see_through_;
  last_asked_ = thread_.submit(std::move(request));
  asked_.push_back(
      {last_asked_, *std::exchange(changed_at_, {}), std::exchange(changed_by_input_, false)});
  whole_asked_ = asked_.back();
}

void Viewer::presented(double present_ms) {
  statistics_.present_ms = present_ms;
  if (frame_presented_ || !frame_) return;
  frame_presented_ = true;
  const auto now = Clock::now();
  std::optional<Clock::time_point> oldest;
  while (!asked_.empty() && asked_.front().number <= frame_->number) {
    if (!oldest && asked_.front().input) oldest = asked_.front().at;
    asked_.pop_front();
  }
  if (oldest) {
    statistics_.reaction_ms = ms_between(*oldest, now);
    statistics_.largest_reaction_ms =
        std::max(statistics_.largest_reaction_ms, statistics_.reaction_ms);
    ++statistics_.reactions;
  }
  if (frame_->divisor == 1 && whole_asked_ && whole_asked_->number == frame_->number) {
    statistics_.whole_latency_ms = ms_between(whole_asked_->at, now);
    whole_asked_.reset();
  }
}

bool Viewer::settled() const {
  if (!loaded() || picking_ || !thread_.resting()) return false;
  if (!model_) return true;  // there is nothing to show
  if (viewport_.x < 1 || viewport_.y < 1) return true;
  return !due_ && frame_presented_ &&
         (!draw_error_.empty() || (frame_ && frame_->number == last_asked_ && frame_->last));
}

void Viewer::reset_statistics() {
  statistics_.frames = statistics_.reactions = 0;
  statistics_.largest_reaction_ms = 0;
}

// --- what is shown ------------------------------------------------------------------------------

void Viewer::set_camera(const Camera& camera) {
  camera_ = camera;
  change(false);
}

void Viewer::look(std::string_view name) {
  if (camera_set_) history_.rest(state());
  if (const auto named = find_named_view(name)) {
    look_from(camera_, *named);
  } else if (name == "centre") {
    camera_.target = glm::dvec3(0.0);
  } else if (name == "all" && model_) {
    view_all(camera_, model_->box, glm::max(viewport_, glm::ivec2(1)));
  } else if (name == "reset" && camera_set_) {
    const Projection projection = camera_.projection;
    camera_ = start_camera_;
    camera_.projection = projection;
  }
  change(false);
}

void Viewer::orbit_by(const glm::dvec2& pixels) {
  orbit(camera_, pixels);
  change(false);
}

void Viewer::pan_by(const glm::dvec2& pixels) {
  pan(camera_, pixels, viewport_);
  change(false);
}

void Viewer::zoom_by(double steps, std::optional<glm::dvec2> at) {
  zoom(camera_, steps, at ? *at : glm::dvec2(viewport_) * 0.5, viewport_);
  change(false);
}

void Viewer::set_looks(Looks looks) {
  if (looks == looks_) return;
  // A slider's changes are one: the hand rests before and after it.
  const VoxelLooks &to = looks.voxels, &from = looks_.voxels;
  const bool other_voxels = to.style != from.style ||
                            to.slice.has_value() != from.slice.has_value() ||
                            (to.slice && to.slice->axis != from.slice->axis);
  if ((looks.hidden != looks_.hidden || other_voxels) && camera_set_) history_.rest(state());
  looks_ = std::move(looks);
  change(true);
}

void Viewer::set_hidden(std::uint32_t solid, bool hidden) {
  if (!model_ || solid >= model_->scene.tree.solids().size()) return;
  looks_.hidden.resize(model_->scene.tree.solids().size(), 0);
  history_.rest(state());
  looks_.hidden[solid] = hidden ? 1 : 0;
  change(true);
}

void Viewer::set_section(std::optional<csg::SectionPlane> plane) {
  if (camera_set_) history_.rest(state());
  if (looks_.section) last_section_ = looks_.section;
  if (plane) plane = csg::facing(*plane, camera_);
  looks_.section = plane;
  change(true);
}

void Viewer::flip_section() {
  if (!looks_.section) return;
  history_.rest(state());
  looks_.section->normal = -looks_.section->normal;
  looks_.section->offset = -looks_.section->offset;
  change(true);
}

void Viewer::toggle_section() {
  if (looks_.section) return set_section({});
  if (last_section_) return set_section(last_section_);
  if (!model_ || model_->box.empty()) return;
  const glm::dvec3 middle = (model_->box.low + model_->box.high) * 0.5;
  set_section(csg::SectionPlane{{0, 1, 0}, middle.y, true});
}

glm::dvec2 Viewer::section_range() const {
  if (!model_ || model_->box.empty() || !looks_.section) return {-1, 1};
  const glm::dvec3& n = looks_.section->normal;
  const glm::dvec3 centre = (model_->box.low + model_->box.high) * 0.5;
  const glm::dvec3 half = (model_->box.high - model_->box.low) * 0.5;
  const double reach = glm::dot(glm::abs(n), half), middle = glm::dot(n, centre);
  return {middle - reach, middle + reach};
}

std::optional<Viewer::Handle> Viewer::section_handle() const {
  const bool heated = heat_ != Heat::kOff && !shows_voxels();
  if (!looks_.section || !model_ || model_->box.empty() || heated) return {};
  const glm::dvec3& n = looks_.section->normal;
  const glm::dvec3 centre = (model_->box.low + model_->box.high) * 0.5;
  const glm::dvec3 foot = centre + n * (looks_.section->offset - glm::dot(n, centre));
  const double length = 60 * world_per_pixel(camera_, viewport_);
  const auto at = project(camera_, viewport_, foot);
  const auto tip = project(camera_, viewport_, foot + n * length);
  if (!at || !tip) return {};
  return Handle{*at, *tip};
}

void Viewer::set_edges(bool on) {
  picture_.edges = on;
  change(false);
}

void Viewer::set_scheme(const csg::ColourScheme* scheme) {
  picture_.scheme = scheme;
  change(false);
}

void Viewer::set_heat(Heat heat) {
  heat_ = heat;
  change(false);
}

void Viewer::set_media(std::shared_ptr<const transparency::MediaSettings> media) {
  media_ = std::move(media);
  SeenThrough how;
  how.opacity = 1.0f;  // what has no medium stays as it is
  how.media = media_;
  set_see_through(std::move(how));
}

void Viewer::set_see_through(std::optional<SeenThrough> how) {
  if (see_through_ == how) return;
  see_through_ = std::move(how);
  change(false);
}

void Viewer::pick(const glm::ivec2& pixel) {
  if (!arrangement_ || pixel.x < 0 || pixel.y < 0 || pixel.x >= viewport_.x ||
      pixel.y >= viewport_.y) {
    picked_ = Picked{};
    picked_->pixel = pixel;
    return;
  }
  picked_.reset();
  picking_ = true;
  thread_.pick(pixel);
}

void Viewer::select(std::optional<std::uint32_t> solid, bool keep_pick) {
  if (!keep_pick) picked_.reset();
  if (solid == looks_.selected) return;
  looks_.selected = solid;
  change(true);
}

std::string Viewer::solid_name(std::uint32_t solid) const {
  if (!arrangement_ || solid >= arrangement_->tree.solids().size()) return "no longer shown";
  const std::string& name = arrangement_->tree.solids()[solid].name;
  return name.empty() ? fmt::format("solid {}", solid) : name;
}

std::string Viewer::describe(const Picked& picked) const {
  if (!picked.hit) return "nothing";
  if (!picked.what.empty()) {
    return fmt::format("{}, at {:.6g} {:.6g} {:.6g}", picked.what, picked.where.x, picked.where.y,
                       picked.where.z);
  }
  std::string text = fmt::format(
      "{}, triangle {}{}, at {:.6g} {:.6g} {:.6g}", solid_name(picked.solid), picked.triangle,
      picked.cut ? " from within" : "", picked.where.x, picked.where.y, picked.where.z);
  if (picked.thickness) text += fmt::format(", thickness {:.6g}", *picked.thickness);
  return text;
}

}  // namespace strata::view
