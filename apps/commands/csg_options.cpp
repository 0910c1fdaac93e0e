#include "apps/commands/csg_options.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <glm/geometric.hpp>
#include <tuple>

#include "apps/commands/film_options.h"
#include "apps/session/file_conflicts.h"
#include "apps/session/option_values.h"
#include "strata/picture/animation.h"
#include "strata/voxelize/formats/voxel_writer.h"

namespace strata::apps {
namespace {

constexpr std::pair<std::string_view, Projection> kProjections[] = {
    {"p", Projection::kPerspective},           {"perspective", Projection::kPerspective},
    {"o", Projection::kOrthographic},          {"ortho", Projection::kOrthographic},
    {"orthogonal", Projection::kOrthographic}, {"orthographic", Projection::kOrthographic}};

constexpr std::pair<std::string_view, bool> kOnOff[] = {{"on", true}, {"off", false}};
constexpr std::pair<std::string_view, bool> kHatched[] = {{"hatched", true}, {"plain", false}};

/// `512,512`, and `512x512` as people write it.
Result<glm::ivec2> parse_size(std::string_view text) {
  const std::size_t mark = text.find_first_of(",x");
  if (mark == std::string_view::npos) {
    return fail(ErrorCode::kUsage, "--size must be width,height, got '{}'", text);
  }
  const auto width = parse_integer("--size", text.substr(0, mark));
  const auto height = parse_integer("--size", text.substr(mark + 1));
  if (!width || !height) {
    return fail(ErrorCode::kUsage, "--size must be two whole numbers width,height, got '{}'", text);
  }
  if (*width < 1 || *height < 1 || *width > kMaxPictureSide || *height > kMaxPictureSide) {
    return fail(ErrorCode::kUsage, "--size {}: each side must be 1 to {} pixels", text,
                kMaxPictureSide);
  }
  return glm::ivec2(*width, *height);
}

Result<const csg::ColourScheme*> parse_scheme(std::string_view text) {
  const csg::ColourScheme* scheme = csg::find_colour_scheme(text);
  if (scheme != nullptr) return scheme;
  std::vector<std::string_view> names;
  for (const csg::ColourScheme& one : csg::colour_schemes()) names.push_back(one.name);
  return no_such_choice("--colorscheme", text, names);
}

Result<int> parse_samples(std::string_view text) {
  const auto count = parse_integer("--samples", text);
  if (!count) return tl::unexpected(count.error());
  if (*count < 1 || *count > 64 || !std::has_single_bit(static_cast<std::uint64_t>(*count))) {
    return fail(ErrorCode::kUsage, "--samples must be 1, 2, 4, 8, 16, 32 or 64, got '{}'", text);
  }
  return static_cast<int>(*count);
}

constexpr std::pair<std::string_view, int> kQualities[] = {
    {"draft", 1}, {"normal", 8}, {"high", 16}};

/// --samples, or as many as --quality takes.
Result<int> read_samples(const CsgWords& words) {
  const auto quality =
      parse_choice("--quality", words.quality.empty() ? "normal" : words.quality, kQualities);
  return quality && !words.samples.empty() ? parse_samples(words.samples) : quality;
}

struct NamedColour {
  std::string_view name;
  glm::u8vec3 colour;
};
/// The names of CSS 2, in its order.
constexpr NamedColour kColours[] = {
    {"black", {0, 0, 0}},       {"silver", {192, 192, 192}}, {"gray", {128, 128, 128}},
    {"white", {255, 255, 255}}, {"maroon", {128, 0, 0}},     {"red", {255, 0, 0}},
    {"purple", {128, 0, 128}},  {"fuchsia", {255, 0, 255}},  {"green", {0, 128, 0}},
    {"lime", {0, 255, 0}},      {"olive", {128, 128, 0}},    {"yellow", {255, 255, 0}},
    {"navy", {0, 0, 128}},      {"blue", {0, 0, 255}},       {"teal", {0, 128, 128}},
    {"aqua", {0, 255, 255}},    {"orange", {255, 165, 0}}};

}  // namespace

Result<glm::u8vec3> parse_colour(std::string_view must, std::string_view text) {
  for (const NamedColour& one : kColours) {
    if (one.name == text) return one.colour;
  }
  const bool hex = !text.empty() && text.front() == '#' &&
                   text.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string_view::npos;
  if (hex && (text.size() == 7 || text.size() == 4)) {
    const std::size_t digits = (text.size() - 1) / 3;
    glm::u8vec3 colour;
    for (int c = 0; c < 3; ++c) {
      unsigned value = 0;
      const auto part = text.substr(1 + static_cast<std::size_t>(c) * digits, digits);
      std::from_chars(part.data(), part.data() + part.size(), value, 16);
      colour[c] = static_cast<std::uint8_t>(digits == 1 ? value * 17 : value);
    }
    return colour;
  }
  std::string names;
  for (const NamedColour& one : kColours) names += fmt::format(", {}", one.name);
  return fail(ErrorCode::kUsage, "{} a colour, got '{}'; a colour is #rrggbb or one of{}", must,
              text, names.substr(1));
}

namespace {

/// --background and --transparent; nothing: the colour scheme's.
Result<std::optional<Backdrop>> read_background(const CsgWords& words,
                                                const csg::ColourScheme* scheme) {
  const std::string& text = words.background;
  if (words.transparent && !text.empty() && text != "transparent") {
    return fail(ErrorCode::kUsage, "--transparent and --background {} cannot be combined", text);
  }
  if (words.transparent || text == "transparent") return Backdrop{};
  if (text.empty()) return std::nullopt;
  if (text == "gradient") {
    return gradient_backdrop((scheme != nullptr ? *scheme : csg::default_scheme()).background);
  }
  const auto colour = parse_colour("--background must be gradient, transparent or", text);
  if (!colour) return tl::unexpected(colour.error());
  return plain_backdrop(*colour);
}

/// How faces look: --crease, --occlusion, --caps.
Result<void> read_shading(const CsgWords& words, csg::PictureOptions& picture) {
  if (!words.crease.empty()) {
    const auto degrees = parse_numbers("--crease", words.crease, 1, 1);
    if (!degrees) return tl::unexpected(degrees.error());
    if (!(degrees->front() >= 0.0 && degrees->front() <= 180.0)) {
      return fail(ErrorCode::kUsage, "--crease must be 0 to 180 degrees, got {}", words.crease);
    }
    picture.crease = degrees->front();
  }
  if (!words.occlusion.empty()) {
    const auto on = parse_choice("--occlusion", words.occlusion, kOnOff);
    if (!on) return tl::unexpected(on.error());
    picture.occlusion = *on;
  }
  if (!words.caps.empty()) {
    const auto hatched = parse_choice("--caps", words.caps, kHatched);
    if (!hatched) return tl::unexpected(hatched.error());
    picture.hatched_caps = *hatched;
  }
  return {};
}

/// `--view edges,axes`: what openscad shows beside the scene.
Result<void> read_shown(std::string_view list, CsgCommand& command) {
  while (!list.empty()) {
    const std::string_view word = list.substr(0, list.find(','));
    list.remove_prefix(std::min(word.size() + 1, list.size()));
    if (word == "edges") {
      command.picture.edges = true;
    } else if (word == "axes" || word == "crosshairs" || word == "scales") {
      return fail(ErrorCode::kUsage,
                  "--view {}: strata does not draw this; openscad -o FILE.png --view {} does", word,
                  word);
    } else if (word == "wireframe") {
      return fail(
          ErrorCode::kUsage,
          "--view wireframe: strata draws faces; --view edges adds lines along their edges");
    } else {
      return fail(ErrorCode::kUsage, "--view must be edges, got '{}'", word);
    }
  }
  return {};
}

/// Of openscad's options those that are not handed on to it: done, or a sentence on what to use.
Result<void> read_openscad_words(const CsgWords& words, CsgCommand& command) {
  const std::string& render = words.render;
  command.render = !render.empty();
  if (command.render && render != "-" && render != "cgal" && render != "force" &&
      render != "true") {
    return fail(ErrorCode::kUsage, "--render must have no value, or cgal or force, got '{}'",
                render);
  }
  if (!words.preview.empty() && words.preview != "-") {
    return fail(ErrorCode::kUsage,
                "--preview={}: strata has one preview; use --preview alone, or strata view "
                "--ghosts to show subtracted solids",
                words.preview);
  }
  if (!words.preview.empty() && command.render) {
    return fail(ErrorCode::kUsage, "--preview and --render cannot be combined");
  }
  if (auto read = read_shown(words.shown, command); !read) return read;
  if (!words.export_format.empty() && words.export_format != "png") {
    return fail(ErrorCode::kUsage,
                "--export-format {}: strata csg writes png only; openscad --export-format {} "
                "writes geometry, strata voxelize writes voxels",
                words.export_format, words.export_format);
  }
  if (!words.summary_file.empty()) {
    return fail(ErrorCode::kUsage,
                "--summary-file {}: use --json={}, which writes strata's own report",
                words.summary_file, words.summary_file);
  }
  command.summary = !words.summary.empty();
  constexpr std::string_view kSummaries[] = {"all",      "cache",        "time", "camera",
                                             "geometry", "bounding-box", "area"};
  if (command.summary && std::find(std::begin(kSummaries), std::end(kSummaries), words.summary) ==
                             std::end(kSummaries)) {
    return no_such_choice("--summary", words.summary, kSummaries);
  }
  if (!words.csg_limit.empty()) {
    if (auto limit = parse_integer("--csglimit", words.csg_limit); !limit) {
      return tl::unexpected(limit.error());
    }
  }
  if (words.frames.empty()) return {};
  constexpr std::int64_t kMostFrames = 99'999;  // five digits in the names
  const auto frames = parse_integer("--animate", words.frames);
  if (!frames) return tl::unexpected(frames.error());
  if (*frames < 1 || *frames > kMostFrames) {
    return fail(ErrorCode::kUsage, "--animate must be 1 to {}, got {}", kMostFrames, *frames);
  }
  command.frames = static_cast<int>(*frames);
  const auto& files = command.input.files;
  if (std::none_of(files.begin(), files.end(),
                   [](const auto& file) { return has_extension(file, ".scad"); })) {
    return fail(ErrorCode::kUsage, "--animate needs a .scad input, whose $t it sets");
  }
  for (const auto* path : {&command.output, &command.ids, &command.depth}) {
    if (!path->empty() && is_stream(*path)) {
      return fail(ErrorCode::kUsage, "--animate writes several files, but {} is a stream", *path);
    }
  }
  if (command.output.empty() || command.json || command.summary) {
    return fail(ErrorCode::kUsage,
                "--animate needs -o FILE.png, or a film, and cannot be combined with --json or "
                "--summary");
  }
  return {};
}

}  // namespace

std::string other_writer(const std::string& path) {
  if (solid_format_of(path) != SolidFormat::kAuto) return "; strata mesh writes meshes";
  if (has_extension(path, ".png")) return "; strata csg writes pictures";
  if (voxel_format_for(path, "")) return "; strata voxelize writes voxels";
  return {};
}

Result<void> check_picture_name(std::string_view asked_by, const std::string& path, bool depth) {
  if (is_stream(path) || has_extension(path, depth ? ".exr" : ".png")) return {};
  if (!depth && check_animation_name(path)) {
    return fail(ErrorCode::kUsage,
                "{}{}: pictures are written as .png; films, of --turntable, --animate or --frames, "
                "also as .gif, .webp, .apng or FOLDER/",
                asked_by, path);
  }
  return fail(ErrorCode::kUsage, "{}{}: {}{}", asked_by, path,
              depth ? "distances are written as .exr" : "pictures are written as .png",
              other_writer(path));
}

Result<Projection> parse_projection(std::string_view text) {
  return parse_choice("--projection", text, kProjections);
}

Result<Camera> parse_camera(std::string_view text) {
  const auto numbers = parse_numbers("--camera", text, 6, 7);
  if (!numbers) return tl::unexpected(numbers.error());
  const auto& n = *numbers;
  const glm::dvec3 first(n[0], n[1], n[2]), second(n[3], n[4], n[5]);
  if (n.size() == 6) {
    if (first == second) {
      return fail(ErrorCode::kUsage, "--camera {}: eye and target must differ", text);
    }
    return look_at(first, second);
  }
  Camera camera;
  camera.target = first;
  camera.rotation = second;
  camera.distance = n[6];
  return camera;
}

Result<csg::SectionPlane> parse_section(std::string_view text) {
  csg::SectionPlane plane;
  const auto no_plane = [text] {
    return fail(ErrorCode::kUsage,
                "--cut must be a plane such as x=5, z<10 or nx,ny,nz,d, got '{}'", text);
  };
  const std::size_t axis =
      text.empty() ? std::string_view::npos : std::string_view("xyz").find(text[0]);
  if (axis != std::string_view::npos && text.size() > 2 &&
      std::string_view("=<>").find(text[1]) != std::string_view::npos) {
    const auto at = parse_numbers("--cut", text.substr(2), 1, 1);
    if (!at) return no_plane();
    plane.normal[static_cast<int>(axis)] = text[1] == '>' ? -1.0 : 1.0;
    plane.offset = text[1] == '>' ? -at->front() : at->front();
    plane.towards_eye = text[1] == '=';
    return plane;
  }
  if (text.find(',') == std::string_view::npos) return no_plane();
  const auto numbers = parse_numbers("--cut", text, 4, 4);
  if (!numbers) return tl::unexpected(numbers.error());
  const auto& n = *numbers;
  plane.normal = {n[0], n[1], n[2]};
  const double length = glm::length(plane.normal);
  if (!(length > 0) || !std::isfinite(length)) {
    return fail(ErrorCode::kUsage, "--cut {}: the normal nx,ny,nz must be finite and not 0", text);
  }
  plane.normal /= length;
  plane.offset = n[3] / length;
  return plane;
}

Result<void> read_picture_options(const CsgWords& words, PictureRequest& request) {
  std::optional<Error> error;
  const auto take = [&error](auto value, auto& target) {
    if (value) {
      target = *std::move(value);
    } else if (!error) {
      error = std::move(value.error());
    }
  };
  request.input.expression = words.expression;
  if (!words.size.empty()) take(parse_size(words.size), request.size);
  request.view_all = words.view_all;
  request.auto_centre = words.auto_centre;
  request.asked_view = words.view_all || words.auto_centre;
  if (words.camera.empty()) {
    request.view_all = request.auto_centre = request.default_camera = true;
  } else {
    take(parse_camera(words.camera), request.camera);
  }
  if (!words.projection.empty()) {
    take(parse_projection(words.projection), request.camera.projection);
  }
  if (!words.scheme.empty()) take(parse_scheme(words.scheme), request.picture.scheme);
  request.asked_samples = !words.samples.empty() || !words.quality.empty();
  take(read_samples(words), request.picture.samples);
  take(read_background(words, request.picture.scheme), request.picture.backdrop);
  for (const std::string& cut : words.cuts) {
    take(parse_section(cut), request.cuts.emplace_back());
  }
  if (error) return tl::unexpected(*error);
  if (request.input.files.empty()) {
    return fail(ErrorCode::kUsage, "no input file is given");
  }
  if (!(request.camera.distance > 0) && !request.view_all) {
    return fail(ErrorCode::kUsage, "--camera {}: the distance must be above 0, or give --view-all",
                words.camera);
  }
  return {};
}

Result<void> read_csg_options(const CsgWords& words, CsgCommand& command) {
  if (auto read = read_picture_options(words, command); !read) return read;
  if (!words.measure.empty()) {
    const auto resolution = parse_integer("--measure", words.measure);
    if (!resolution) return tl::unexpected(resolution.error());
    if (*resolution < 1 || *resolution > kMaxGridSide / 2) {
      return fail(ErrorCode::kUsage, "--measure must be 1 to {}, got {}", kMaxGridSide / 2,
                  words.measure);
    }
    command.measure_resolution = static_cast<int>(*resolution);
  }
  command.picture.edges = words.edges;
  command.picture.ground_shadow = words.shadow;
  if (auto read = read_shading(words, command.picture); !read) return read;
  command.ids = words.ids;
  command.depth = words.depth;
  if (auto read = read_openscad_words(words, command); !read) return read;
  if (auto read = read_film_options(words, command); !read) return read;
  if (command.output.empty() && command.ids.empty() && command.depth.empty() && !command.json) {
    command.summary = true;
  }
  if (command.measure_resolution && !command.json && !command.summary) {
    return fail(ErrorCode::kUsage, "--measure needs --summary or --json");
  }
  for (const auto& [asked_by, path, depth] :
       {std::tuple("", &command.output, false), std::tuple("--ids ", &command.ids, false),
        std::tuple("--depth ", &command.depth, true)}) {
    if (path->empty() || (path == &command.output && writes_film(command))) continue;
    if (auto named = check_picture_name(asked_by, *path, depth); !named) return named;
  }
  return {};
}

}  // namespace strata::apps
