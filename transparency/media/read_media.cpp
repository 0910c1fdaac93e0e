#include "strata/transparency/media/media.h"

#ifdef STRATA_HAVE_JSON

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <new>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "core/did_you_mean.h"
#include "core/printable.h"
#include "transparency/media/particle_file.h"

// Media files. The members and their ranges are those of docs/media.md.

namespace strata::transparency {
namespace {

using Json = nlohmann::json;

/// A value of the file and what it is called in messages, such as "media[1].albedo".
struct Member {
  const std::string& path;
  const Json& value;
  std::string name;

  template <class... Args>
  [[nodiscard]] tl::unexpected<Error> fault(fmt::format_string<Args...> text,
                                            Args&&... args) const {
    return fail(ErrorCode::kInput, "{}: {} {}", path, name.empty() ? "the file" : name,
                fmt::format(text, std::forward<Args>(args)...));
  }
  [[nodiscard]] std::string shown() const {
    return printable(value.dump(-1, ' ', false, Json::error_handler_t::replace), 60);
  }
  [[nodiscard]] bool has(const char* key) const { return value.contains(key); }
  [[nodiscard]] Member operator[](const char* key) const {
    return {path, value.at(key), name.empty() ? key : name + "." + key};
  }
  [[nodiscard]] Member at(std::size_t i) const {
    return {path, value.at(i), fmt::format("{}[{}]", name, i)};
  }

  /// The value must be an object with no other members than these.
  [[nodiscard]] Result<void> expect_object(std::initializer_list<std::string_view> known) const {
    if (!value.is_object()) return fault("must be an object, got {}", shown());
    for (const auto& [key, unused] : value.items()) {
      if (std::find(known.begin(), known.end(), key) != known.end()) continue;
      std::string all;
      for (const std::string_view word : known) {
        all += (all.empty() ? "" : ", ") + std::string(word);
      }
      return fault("has a member '{}', which must be one of {}{}", printable(key, 60), all,
                   did_you_mean(key, {known.begin(), known.size()}));
    }
    return {};
  }
  Result<void> read(double& out, double least, double most) const {
    if (!value.is_number()) return fault("must be a number, got {}", shown());
    const double number = value.get<double>();
    if (!(number >= least && number <= most)) {
      return fault("must be {} to {}, got {}", least, most, number);
    }
    out = number;
    return {};
  }
  Result<void> read(int& out, int least, int most) const {
    if (!value.is_number_integer()) return fault("must be a whole number, got {}", shown());
    double number = 0.0;
    if (auto done = read(number, least, most); !done) return done;
    out = static_cast<int>(number);
    return {};
  }
  Result<void> read(bool& out) const {
    if (!value.is_boolean()) return fault("must be true or false, got {}", shown());
    out = value.get<bool>();
    return {};
  }
  Result<void> read(std::string& out) const {
    if (!value.is_string()) return fault("must be a text, got {}", shown());
    out = value.get<std::string>();
    return {};
  }
  /// As many numbers as the vector has.
  template <glm::length_t N, class T>
  Result<void> read(glm::vec<N, T>& out, double least, double most) const {
    if (!value.is_array() || value.size() != static_cast<std::size_t>(N)) {
      return fault("must be {} numbers, got {}", N, shown());
    }
    for (glm::length_t i = 0; i < N; ++i) {
      double number = 0.0;
      if (auto done = at(static_cast<std::size_t>(i)).read(number, least, most); !done) return done;
      out[i] = static_cast<T>(number);
    }
    return {};
  }
  /// Red, green and blue, or one number for all of them.
  Result<void> read_colour(glm::vec3& out, double most) const {
    if (!value.is_number()) return read(out, 0.0, most);
    double number = 0.0;
    if (auto done = read(number, 0.0, most); !done) return done;
    out = glm::vec3(static_cast<float>(number));
    return {};
  }
};

Result<void> read_coefficients(const Member& from, glm::vec3& extinction, glm::vec3& albedo) {
  if (from.has("extinction")) {
    if (auto done = from["extinction"].read_colour(extinction, kMostExtinction); !done) return done;
  }
  if (!from.has("albedo")) return {};
  return from["albedo"].read_colour(albedo, 1.0);
}

Result<void> read_medium(const Member& from, MediaSettings& settings) {
  if (auto good = from.expect_object({"object", "extinction", "albedo", "surface"}); !good) {
    return good;
  }
  if (!from.has("object")) return from.fault("must have a member 'object'");
  NamedMedium named;
  if (auto done = from["object"].read(named.object); !done) return done;
  for (const NamedMedium& other : settings.media) {
    if (other.object != named.object) continue;
    return from.fault("is a second medium for '{}'", printable(named.object, 60));
  }
  Medium& medium = named.medium;
  if (auto done = read_coefficients(from, medium.extinction, medium.albedo); !done) return done;
  if (from.has("surface")) {
    const Member surface = from["surface"];
    medium.surface = true;
    Result<void> done;
    if (surface.value.is_boolean()) {
      done = surface.read(medium.surface);
    } else {
      done = surface.read(medium.surface_colour.emplace(), 0.0, 1.0);
    }
    if (!done) return done;
  }
  settings.media.push_back(std::move(named));
  return {};
}

Result<void> read_visibility(const Member& from, ShadowVisibility& visibility) {
  constexpr std::string_view kWords[] = {"lists", "slices", "occupancy", "fourier", "nodes"};
  std::string word;
  if (auto done = from.read(word); !done) return done;
  const auto* const found = std::find(std::begin(kWords), std::end(kWords), word);
  if (found == std::end(kWords)) {
    return from.fault("must be lists, slices, occupancy, fourier or nodes, got '{}'",
                      printable(word, 60));
  }
  visibility = static_cast<ShadowVisibility>(found - std::begin(kWords));
  return {};
}

Result<void> read_light(const Member& from, MediaLight& light) {
  if (auto good = from.expect_object({"direction", "position", "radiance", "shadows", "shadow_size",
                                      "shadow_steps", "visibility", "visibility_size"});
      !good) {
    return good;
  }
  if (from.has("direction") == from.has("position")) {
    return from.fault("must have one member of 'direction' and 'position'");
  }
  light.point = from.has("position");
  const Member at = from[light.point ? "position" : "direction"];
  if (auto done = at.read(light.at, -kFarthest, kFarthest); !done) return done;
  if (!light.point && light.at == glm::dvec3(0.0)) return at.fault("must not be 0, 0, 0");
  light.radiance = glm::vec3(1.0f);
  if (from.has("radiance")) {
    if (auto done = from["radiance"].read_colour(light.radiance, kMostExtinction); !done) {
      return done;
    }
  }
  if (from.has("shadows")) {
    if (auto done = from["shadows"].read(light.shadows); !done) return done;
  }
  if (from.has("shadow_size")) {
    if (auto done = from["shadow_size"].read(light.shadow_size, 1, 8192); !done) return done;
  }
  if (from.has("shadow_steps")) {
    if (auto done = from["shadow_steps"].read(light.shadow_steps, 0, 1024); !done) return done;
  }
  if (from.has("visibility")) {
    if (auto done = read_visibility(from["visibility"], light.visibility); !done) return done;
  }
  if (!from.has("visibility_size")) return {};
  return from["visibility_size"].read(light.visibility_size, 1, 64);
}

Result<void> read_particle(const Member& from, std::vector<Particle>& particles) {
  if (auto good = from.expect_object({"centre", "radius", "extinction", "albedo"}); !good) {
    return good;
  }
  for (const char* needed : {"centre", "radius"}) {
    if (!from.has(needed)) return from.fault("must have a member '{}'", needed);
  }
  Particle particle;
  if (auto done = from["centre"].read(particle.centre, -kFarthest, kFarthest); !done) return done;
  const Member radius = from["radius"];
  if (auto done = radius.read(particle.radius, 0.0, kFarthest); !done) return done;
  if (!(particle.radius > 0.0)) return radius.fault("must be above 0, got {}", particle.radius);
  if (auto done = read_coefficients(from, particle.extinction, particle.albedo); !done) return done;
  particles.push_back(particle);
  return {};
}

Result<void> read_particles_of(const Member& from, MediaSettings& settings) {
  std::vector<Particle>& particles = settings.particles;
  if (from.value.is_array()) {
    for (std::size_t i = 0; i < from.value.size(); ++i) {
      if (auto done = read_particle(from.at(i), particles); !done) return done;
    }
    return {};
  }
  if (auto good = from.expect_object({"file", "extinction", "albedo"}); !good) return good;
  if (!from.has("file")) return from.fault("must have a member 'file', or be a list");
  Particle common;
  if (auto done = read_coefficients(from, common.extinction, common.albedo); !done) return done;
  std::string file;
  if (auto done = from["file"].read(file); !done) return done;
  const auto beside = std::filesystem::path(from.path).parent_path() / file;
  settings.files.push_back(identify_file(beside.string()));
  return read_particles(beside.string(), common, particles);
}

Result<MediaSettings> read_all(const Member& from) {
  MediaSettings settings;
  settings.files.push_back(identify_file(from.path));
  if (auto good = from.expect_object({"media", "ambient", "light", "particles"}); !good) {
    return tl::unexpected(good.error());
  }
  Result<void> done;
  if (from.has("ambient")) done = from["ambient"].read_colour(settings.ambient, kMostExtinction);
  if (done && from.has("light")) done = read_light(from["light"], settings.light);
  if (done && from.has("media")) {
    const Member media = from["media"];
    if (!media.value.is_array()) done = media.fault("must be a list, got {}", media.shown());
    for (std::size_t i = 0; done && i < media.value.size(); ++i) {
      done = read_medium(media.at(i), settings);
    }
  }
  if (done && from.has("particles")) {
    done = read_particles_of(from["particles"], settings);
  }
  if (!done) return tl::unexpected(done.error());
  return settings;
}

/// Without the library's own words in front: "[json.exception.parse_error.101] parse error at".
std::string_view plain(std::string_view message) {
  if (const std::size_t end = message.find("] "); end != std::string_view::npos) {
    message.remove_prefix(end + 2);
  }
  return message;
}

}  // namespace

Result<MediaSettings> read_media(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return fail(ErrorCode::kInput, "{}: the file cannot be opened", path);
  try {
    const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    if (in.bad()) return fail(ErrorCode::kInput, "{}: reading failed", path);
    const Json json = Json::parse(text);
    return read_all({path, json, {}});
  } catch (const Json::exception& fault) {
    return fail(ErrorCode::kInput, "{}: {}", path, printable(plain(fault.what())));
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory", path);
  } catch (const std::exception& fault) {
    return fail(ErrorCode::kInput, "{}: reading failed: {}", path, printable(fault.what()));
  }
}

}  // namespace strata::transparency

#else

namespace strata::transparency {

Result<MediaSettings> read_media(const std::string& path) {
  return fail(ErrorCode::kUsage,
              "{}: this build reads no media files: nlohmann-json3-dev was missing", path);
}

}  // namespace strata::transparency

#endif
