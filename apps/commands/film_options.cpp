#include "apps/commands/film_options.h"

#include <string_view>

#include "apps/session/file_conflicts.h"
#include "apps/session/option_values.h"
#include "strata/picture/animation.h"
#include "strata/raster/camera_file.h"

namespace strata::apps {
namespace {

constexpr std::int64_t kMostPictures = 99'999;

Result<int> parse_count(std::string_view option, std::string_view text) {
  const auto count = parse_integer(option, text);
  if (!count) return tl::unexpected(count.error());
  if (*count < 1 || *count > kMostPictures) {
    return fail(ErrorCode::kUsage, "{} must be 1 to {}, got {}", option, kMostPictures, *count);
  }
  return static_cast<int>(*count);
}

Result<void> read_camera_file(const CsgWords& words, CsgCommand& command) {
  if (!words.camera.empty()) {
    return fail(ErrorCode::kUsage, "--camera and --camera-file cannot be combined");
  }
  command.camera_file = words.camera_file;
  auto path = read_cameras(words.camera_file);
  if (!path) return tl::unexpected(path.error());
  command.path = *std::move(path);
  const Projection projection = command.camera.projection;
  command.camera = command.path.front().camera;
  if (!words.projection.empty()) {
    for (TimedCamera& one : command.path) one.camera.projection = projection;
    command.camera.projection = projection;
  }
  command.default_camera = false;
  command.view_all = words.view_all;
  command.auto_centre = words.auto_centre;
  return {};
}

Result<void> read_frames(const CsgWords& words, CsgCommand& command) {
  const auto frames = parse_count("--frames", words.path_frames);
  if (!frames) return tl::unexpected(frames.error());
  if (words.camera_file.empty()) {
    return fail(ErrorCode::kUsage, "--frames needs --camera-file with several cameras");
  }
  if (command.path.size() < 2) {
    return fail(ErrorCode::kUsage,
                "--frames needs several cameras, and {} has 1; a line `time` begins another",
                words.camera_file);
  }
  command.path_frames = *frames;
  return {};
}

/// What several pictures cannot have.
Result<void> check_film(const CsgCommand& command, std::string_view option) {
  const int kinds = (command.frames > 0 ? 1 : 0) + (command.turntable > 0 ? 1 : 0) +
                    (command.path_frames > 0 ? 1 : 0);
  if (kinds > 1) {
    return fail(ErrorCode::kUsage, "one of --turntable, --frames and --animate may be given");
  }
  if (command.output.empty()) {
    return fail(ErrorCode::kUsage, "{} needs -o FILE.gif, .webp, .apng, or a folder, -o FOLDER/",
                option);
  }
  if (is_stream(command.output)) {
    return fail(ErrorCode::kUsage, "{} cannot write to the stream {}", option, command.output);
  }
  if (!command.ids.empty() || !command.depth.empty() || command.json || command.summary) {
    return fail(ErrorCode::kUsage, "{} cannot be combined with --ids, --depth, --json or --summary",
                option);
  }
  return check_animation_name(command.output);
}

}  // namespace

bool writes_film(const CsgCommand& command) {
  if (command.turntable > 0 || command.path_frames > 0) return true;
  return command.frames > 0 && !has_extension(command.output, ".png");
}

Result<void> read_film_options(const CsgWords& words, CsgCommand& command) {
  if (!words.camera_file.empty()) {
    if (auto read = read_camera_file(words, command); !read) return read;
  }
  if (!words.turntable.empty()) {
    const auto count = parse_count("--turntable", words.turntable);
    if (!count) return tl::unexpected(count.error());
    command.turntable = *count;
  }
  if (!words.path_frames.empty()) {
    if (auto read = read_frames(words, command); !read) return read;
  }
  if (!words.fps.empty()) {
    const auto fps = parse_numbers("--fps", words.fps, 1, 1);
    if (!fps) return tl::unexpected(fps.error());
    const double most = has_extension(command.output, ".gif") ? 50 : 100;
    if (!(fps->front() >= 0.1 && fps->front() <= most)) {
      return fail(ErrorCode::kUsage, "--fps must be 0.1 to {}{}, got {}", most,
                  most < 100 ? " for a .gif" : "", words.fps);
    }
    command.fps = fps->front();
    if (!writes_film(command)) {
      return fail(ErrorCode::kUsage,
                  "--fps needs --turntable, --frames or --animate, and a .gif, "
                  ".webp or .apng to write");
    }
  }
  if (!writes_film(command)) return {};
  return check_film(command, command.turntable > 0     ? "--turntable"
                             : command.path_frames > 0 ? "--frames"
                                                       : "--animate");
}

}  // namespace strata::apps
