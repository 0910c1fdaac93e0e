#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "apps/commands/oit_options.h"
#include "apps/session/session.h"
#include "apps/strata/allocation_failures.h"
#include "apps/strata/library_session.h"
#include "apps/strata/oit_page.h"
#include "apps/strata/oit_report.h"
#include "apps/strata/run_commands.h"
#include "apps/strata/scene_camera.h"
#include "core/atomic_file.h"
#include "picture/encode_png.h"
#include "strata/csg/input/scene_input.h"
#include "strata/csg/input/see_through.h"
#include "strata/transparency/media/fxaa.h"
#include "strata/transparency/media/media.h"
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

std::vector<std::uint8_t> png_of(const transparency::Image& image, int threads) {
  return encode_png({image.width, image.height, transparency::to_bytes(image)}, threads);
}

/// Writes index.html into a folder, which is made if it is not there.
Result<void> write_page(const std::string& page, const std::string& folder) {
  std::error_code ignored;
  std::optional<AtomicFolder> made;
  std::string place = folder;
  if (!std::filesystem::is_directory(folder, ignored)) {
    auto created = AtomicFolder::create(folder);
    if (!created) return tl::unexpected(created.error());
    made = *std::move(created);
    place = made->temporary_path();
  }
  auto written = print_report(page, (std::filesystem::path(place) / "index.html").string(), false);
  if (!written || !made) return written;
  return made->commit();
}

/// The attributes of the meshes that are solids of a tree, by solid.
std::vector<MeshAttributes> attributes_of(const csg::Tree& tree,
                                          const std::vector<csg::InputFacts>& files) {
  std::vector<MeshAttributes> all(tree.solids().size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (const csg::InputFacts& file : files) {
      if (!file.is_scene && file.path == tree.solids()[i].name) all[i] = file.attributes;
    }
  }
  return all;
}

/// The work of one scene and camera.
class OitRun {
 public:
  OitRun(const OitCommand& command, Session& session) : command_(command), session_(session) {}

  Result<void> run() {
    if (auto done = load(); !done) return done;
    if (!command_.media.empty()) {
      if (auto done = draw_media(); !done) return done;
      return report();
    }
    if (auto done = open_frame(); !done) return done;
    if (auto done = draw_reference(); !done) return done;
    for (const OitChoice& choice : command_.choices) {
      if (auto done = draw(choice); !done) return done;
    }
    return report();
  }

 private:
  Result<void> load();
  [[nodiscard]] transparency::FrameOptions frame_options() const;
  Result<void> open_frame();
  Result<void> draw_media();
  Result<void> draw_reference();
  Result<void> time_again(const OitChoice& choice, OitResult& result);
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
  csg::InputMessages messages = messages_of(session_);
  const bool all_faces = only_meshes(command_);
  if (all_faces && command_.media.empty()) {
    // A mesh need not be closed to be seen through.
    messages.warn = [warn = messages.warn](std::string code, std::string message) {
      if (code != "open") warn(std::move(code), std::move(message));
    };
  }
  csg::SceneInput input = command_.input;
  input.attributes = all_faces || !command_.media.empty();
  input.textures = false;
  std::vector<csg::InputFacts> files;
  auto scene = csg::load_scene(input, messages, session_.execution("reading"), &files);
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
  options.all_faces = all_faces || !command_.media.empty();
  if (!command_.media.empty() && !options.opacity) options.opacity = 1.0f;
  if (options.all_faces) options.attributes = attributes_of(scene->tree, files);
  auto made =
      csg::SeeThrough::make(*std::move(scene), options, session_.execution("preparing", 0.1));
  if (!made) return with_limit(std::move(made.error()));
  scene_ = *std::move(made);
  outcome_.objects = scene_->objects();
  outcome_.triangles = scene_->triangles();
  outcome_.opacity = scene_->opacity();
  return {};
}

transparency::FrameOptions OitRun::frame_options() const {
  const csg::ColourScheme& scheme =
      command_.picture.scheme != nullptr ? *command_.picture.scheme : csg::default_scheme();
  transparency::FrameOptions options;
  options.size = command_.size;
  options.samples = command_.picture.samples;
  const Rgba ground = command_.picture.backdrop.value_or(plain_backdrop(scheme.background)).top;
  if (ground.a != 0) options.background = glm::vec4(ground) / 255.0f;
  return options;
}

Result<void> OitRun::open_frame() {
  auto frame = scene_->frame(outcome_.camera, command_.size, frame_options(),
                             session_.execution("preparing", 0.1));
  if (!frame) return with_limit(std::move(frame.error()));
  frame_ = *std::move(frame);
  outcome_.prepare_ms = session_.milliseconds() - outcome_.read_ms;
  return {};
}

/// --media: a picture by a way of its own.
Result<void> OitRun::draw_media() {
  auto settings = transparency::read_media(command_.media);
  if (!settings) return tl::unexpected(settings.error());
  if (auto kept = session_.opened(settings->files); !kept) return kept;
  if (command_.light) {
    settings->light.at = *command_.light;
    settings->light.point = false;
    if (settings->light.radiance == glm::vec3(0.0f)) settings->light.radiance = glm::vec3(1.0f);
  }
  const auto view = scene_->view(outcome_.camera, command_.size, session_.execution("preparing"));
  if (!view) return tl::unexpected(view.error());
  const double begin = session_.milliseconds();
  outcome_.prepare_ms = begin - outcome_.read_ms;
  auto drawn = transparency::render_media(*scene_->faces(), *view, *settings, frame_options(),
                                          session_.execution("drawing", 1.0));
  if (!drawn) return with_limit(std::move(drawn.error()));
  outcome_.draw_ms = session_.milliseconds() - begin;
  outcome_.media = std::move(drawn->solids);
  for (const transparency::SolidReport& solid : outcome_.media) {
    if (solid.unbalanced_pixels == 0) continue;
    session_.warn("open",
                  fmt::format("{} is not closed: its medium is left out in {} of {}", solid.object,
                              solid.unbalanced_pixels, counted(solid.pixels, "sample")));
  }
  if (auto strict = session_.check_strict(); !strict) return strict;
  return write(drawn->rendering.image, command_.output);
}

Result<void> OitRun::draw_reference() {
  const auto found = transparency::find_technique("count-scan");
  if (!found) return tl::unexpected(found.error());
  outcome_.reference = *found;
  if (!compares()) return {};
  auto drawn = frame_->render(**found, {}, rendering("the reference"));
  if (!drawn) return with_limit(std::move(drawn.error()));
  reference_ = std::move(drawn->image);
  if (!command_.report.empty()) outcome_.reference_picture = png_of(reference_, session_.threads());
  return {};
}

/// The first picture was a warm-up: times are the medians of three more.
Result<void> OitRun::time_again(const OitChoice& choice, OitResult& result) {
  outcome_.runs = 3;
  std::vector<double> seconds, technique_seconds;
  for (int run = 0; run < outcome_.runs; ++run) {
    const auto drawn =
        frame_->render(*choice.chosen.technique, choice.chosen.settings, rendering(choice.text));
    if (!drawn) return tl::unexpected(drawn.error());
    seconds.push_back(drawn->seconds);
    technique_seconds.push_back(drawn->technique_seconds);
  }
  std::sort(seconds.begin(), seconds.end());
  std::sort(technique_seconds.begin(), technique_seconds.end());
  result.seconds = seconds[seconds.size() / 2];
  result.technique_seconds = technique_seconds[technique_seconds.size() / 2];
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
  if (!command_.report.empty()) {
    if (auto timed = time_again(choice, result); !timed) return with_limit(timed.error());
    result.picture = png_of(drawn->image, session_.threads());
    result.heat = encode_png(heat_map(drawn->image, reference_), session_.threads());
  }
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
  transparency::Image filtered;
  if (command_.fxaa) filtered = transparency::fxaa(image, {}, session_.execution("filtering"));
  const transparency::Image& seen = command_.fxaa ? filtered : image;
  if (has_extension(place, ".exr")) {
    done = transparency::write_exr(seen, place);
  } else {
    done = csg::write_png({seen.width, seen.height, transparency::to_bytes(seen)}, place,
                          {.threads = session_.threads()});
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
  if (!command_.report.empty()) {
    const std::string page = oit_page(command_, outcome_, session_.threads());
    if (auto done = write_page(page, command_.report); !done) return done;
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
