#include <algorithm>
#include <optional>
#include <utility>

#include "apps/commands/oit_options.h"
#include "apps/session/session.h"
#include "apps/strata/allocation_failures.h"
#include "apps/strata/library_session.h"
#include "apps/strata/oit_report.h"
#include "apps/strata/run_commands.h"
#include "apps/strata/scene_camera.h"
#include "core/atomic_file.h"
#include "strata/csg/input/scene_input.h"
#include "strata/csg/input/see_through.h"
#include "strata/transparency/write_image.h"

namespace strata::apps {
namespace {

using transparency::Rendering;

/// Whether the inputs are meshes that are just united: then every face is seen.
bool only_meshes(const OitCommand& command) {
  const csg::SceneInput& input = command.input;
  return input.expression.empty() && command.cuts.empty() &&
         std::none_of(input.files.begin(), input.files.end(),
                      [&](const std::string& file) { return csg::kind_of(file, input).is_scene; });
}

/// The work of one scene and camera.
class OitRun {
 public:
  OitRun(const OitCommand& command, Session& session) : command_(command), session_(session) {}

  Result<void> run() {
    if (auto done = load(); !done) return done;
    if (auto done = open_frame(); !done) return done;
    if (auto done = draw_reference(); !done) return done;
    for (const OitChoice& choice : command_.choices) {
      if (auto done = draw(choice); !done) return done;
    }
    return report();
  }

 private:
  Result<void> load();
  Result<void> open_frame();
  Result<void> draw_reference();
  Result<void> draw(const OitChoice& choice);
  Result<void> write(const transparency::Image& image, const std::string& path);
  Result<void> report();

  /// Whether pictures are held against the exact one.
  [[nodiscard]] bool compares() const { return command_.json || !command_.report.empty(); }
  /// For one of the renderings that are still to be done.
  Execution rendering(std::string_view name) {
    const std::size_t left = command_.choices.size() - outcome_.results.size();
    return session_.execution(std::string(name), 1.0 / static_cast<double>(left + 1));
  }
  /// What ran out of memory does not know what the user can do about it.
  [[nodiscard]] tl::unexpected<Error> with_limit(Error error) const {
    if (error.code == ErrorCode::kLimit &&
        error.message.find("out of memory") != std::string::npos) {
      error.message += fmt::format("; the limit is {} (--memory-limit)",
                                   readable_bytes(session_.memory_limit()));
    }
    return tl::unexpected(std::move(error));
  }

  OitCommand command_;
  Session& session_;
  OitOutcome outcome_;
  std::optional<csg::SeeThrough> scene_;
  std::optional<transparency::Frame> frame_;
  std::optional<AtomicFolder> folder_;
  transparency::Image reference_;
};

Result<void> OitRun::load() {
  auto scene =
      csg::load_scene(command_.input, messages_of(session_), session_.execution("reading"));
  if (!scene) return tl::unexpected(scene.error());
  outcome_.read_ms = session_.milliseconds();
  take_scene_view(*scene, session_, command_);
  if (auto strict = session_.check_strict(); !strict) return strict;
  const auto fitted = fitted_camera(command_, *scene, false, session_);
  if (!fitted) return tl::unexpected(fitted.error());
  outcome_.camera = fitted->camera;
  csg::cut_scene(*scene, command_.cuts, outcome_.camera);
  csg::SeeThroughOptions options;
  options.opacity = command_.opacity;
  options.scheme = command_.picture.scheme;
  options.all_faces = only_meshes(command_);
  auto made =
      csg::SeeThrough::make(*std::move(scene), options, session_.execution("preparing", 0.1));
  if (!made) return with_limit(std::move(made.error()));
  scene_ = *std::move(made);
  outcome_.objects = scene_->objects();
  outcome_.triangles = scene_->triangles();
  outcome_.opacity = scene_->opacity();
  return {};
}

Result<void> OitRun::open_frame() {
  const csg::ColourScheme& scheme =
      command_.picture.scheme != nullptr ? *command_.picture.scheme : csg::colour_schemes().front();
  transparency::FrameOptions options;
  options.size = command_.size;
  options.samples = command_.picture.samples;
  if (!command_.picture.transparent_background) {
    options.background = glm::vec4(glm::vec3(scheme.background) / 255.0f, 1.0f);
  }
  auto frame =
      scene_->frame(outcome_.camera, command_.size, options, session_.execution("preparing", 0.1));
  if (!frame) return with_limit(std::move(frame.error()));
  frame_ = *std::move(frame);
  outcome_.prepare_ms = session_.milliseconds() - outcome_.read_ms;
  return {};
}

Result<void> OitRun::draw_reference() {
  const auto found = transparency::find_technique("count-scan");
  if (!found) return tl::unexpected(found.error());
  outcome_.reference = *found;
  if (!compares()) return {};
  auto drawn = frame_->render(**found, {}, rendering("the reference"));
  if (!drawn) return with_limit(std::move(drawn.error()));
  reference_ = std::move(drawn->image);
  return {};
}

Result<void> OitRun::draw(const OitChoice& choice) {
  const double begin = session_.milliseconds();
  const auto& [technique, settings] = choice.chosen;
  OitResult result;
  result.choice = &choice;
  auto drawn = frame_->render(*technique, settings, rendering(choice.text));
  if (!drawn && command_.all && drawn.error().code == ErrorCode::kUsage) {
    // It does not suit this input; the others may.
    result.left_out = drawn.error().message;
    session_.note(fmt::format("left out: {}", result.left_out));
    outcome_.results.push_back(std::move(result));
    return {};
  }
  if (!drawn) return with_limit(std::move(drawn.error()));
  result.costs = drawn->costs;
  result.seconds = drawn->seconds;
  result.technique_seconds = drawn->technique_seconds;
  if (compares()) result.difference = transparency::difference(drawn->image, reference_);
  outcome_.draw_ms += session_.milliseconds() - begin;
  result.path = picture_of(command_, choice);
  if (auto done = write(drawn->image, result.path); !done) return done;
  outcome_.results.push_back(std::move(result));
  return {};
}

Result<void> OitRun::write(const transparency::Image& image, const std::string& path) {
  if (path.empty()) return {};
  const double begin = session_.milliseconds();
  std::string place = path;
  if (writes_folder(command_)) {
    if (!folder_) {
      auto made = AtomicFolder::create(command_.output);
      if (!made) return tl::unexpected(made.error());
      folder_ = *std::move(made);
    }
    place = folder_->temporary_path() + path.substr(command_.output.size() - 1);
  }
  Result<void> done;
  if (has_extension(place, ".exr")) {
    done = transparency::write_exr(image, place);
  } else {
    done = csg::write_png({image.width, image.height, transparency::to_bytes(image)}, place);
  }
  outcome_.write_ms += session_.milliseconds() - begin;
  return done;
}

Result<void> OitRun::report() {
  session_.end_progress();
  const std::string json = command_.json ? oit_json(command_, outcome_, session_) : "";
  const bool to_file = command_.json && *command_.json != "-";
  if (to_file) {
    if (auto done = print_report(json, *command_.json, false); !done) return done;
  }
  if (folder_) {
    if (auto done = folder_->commit(); !done) return done;
  }
  if (auto done = commit_outputs(session_); !done) return done;
  if (!command_.json || to_file) return {};
  return print_report(json, "-", command_.output == "-");
}

Result<void> print_list(const OitCommand& command) {
  if (!command.json) return print_report(list_text(), "-", false);
  return print_report(list_json(), *command.json, false);
}

}  // namespace

Result<void> run_oit(const OitCommand& command, Session& session) {
  if (command.list) return print_list(command);
  return OitRun(command, session).run();
}

}  // namespace strata::apps
