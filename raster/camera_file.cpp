#include "strata/raster/camera_file.h"

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <glm/vector_relational.hpp>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "core/atomic_file.h"

namespace strata {
namespace {

/// The words of a line, without its comment.
std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  line = line.substr(0, line.find('#'));
  constexpr std::string_view kBlank = " \t\r";
  for (;;) {
    const std::size_t begin = line.find_first_not_of(kBlank);
    if (begin == std::string_view::npos) return words;
    const std::size_t end = std::min(line.find_first_of(kBlank, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    line.remove_prefix(end);
  }
}

/// Reads the lines of a camera file.
class CameraReader {
 public:
  explicit CameraReader(const std::string& path) : path_(path) {}

  Result<void> read(std::string_view line) {
    ++line_;
    const auto words = words_of(line);
    if (words.empty()) return {};
    const std::string_view key = words.front();
    if (key == "projection") return projection(words);
    const std::size_t count = key == "target" || key == "rotation" || key == "eye" ? 3
                              : key == "distance" || key == "fov" || key == "time" ? 1
                                                                                   : 0;
    if (count == 0) {
      return wrong("'{}' is none of target, rotation, eye, distance, fov, projection and time",
                   key);
    }
    if (words.size() != count + 1) {
      return wrong("{} needs {}, got {}", key, count == 1 ? "1 number" : "3 numbers",
                   words.size() - 1);
    }
    std::array<double, 3> values{};
    for (std::size_t i = 0; i < count; ++i) {
      const std::string_view word = words[i + 1];
      const auto end = word.data() + word.size();
      const auto [at, code] = std::from_chars(word.data(), end, values[i]);
      if (code != std::errc() || at != end || !std::isfinite(values[i])) {
        return wrong("{} must be a finite number, got '{}'", key, word);
      }
    }
    return take(key, values);
  }
  Result<std::vector<TimedCamera>> done() {
    if (auto placed = place_eye(); !placed) return tl::unexpected(placed.error());
    if (!any_) return fail(ErrorCode::kInput, "{}: there is no camera in it", path_);
    return std::move(cameras_);
  }

 private:
  template <class... Args>
  tl::unexpected<Error> wrong(fmt::format_string<Args...> text, Args&&... args) const {
    return fail(ErrorCode::kInput, "{}:{}: {}", path_, line_,
                fmt::format(text, std::forward<Args>(args)...));
  }
  Result<void> projection(std::span<const std::string_view> words) {
    const std::string_view value = words.size() == 2 ? words[1] : "";
    if (value != "perspective" && value != "orthographic") {
      return wrong("projection must be perspective or orthographic");
    }
    camera().projection =
        value == "perspective" ? Projection::kPerspective : Projection::kOrthographic;
    any_ = true;
    return {};
  }
  Result<void> take(std::string_view key, const std::array<double, 3>& values) {
    const auto [x, y, z] = values;
    if (key == "time") {
      if (any_ && !(x > cameras_.back().time)) {
        return wrong("the time {} must be above the one before it, {}", x, cameras_.back().time);
      }
      if (auto placed = place_eye(); !placed) return placed;
      if (any_) cameras_.push_back(cameras_.back());
      cameras_.back().time = x;
    }
    if (key == "distance" && !(x > 0)) return wrong("the distance must be above 0, got {}", x);
    if (key == "fov" && !(x > 0 && x < 180)) {
      return wrong("fov must be between 0 and 180 degrees, got {}", x);
    }
    if (key == "target") camera().target = {x, y, z};
    if (key == "rotation") camera().rotation = {x, y, z};
    if (key == "distance") camera().distance = x;
    if (key == "fov") camera().field_of_view = x;
    if (key == "eye") eye_ = {x, y, z};
    any_ = true;
    return {};
  }
  /// The eye needs the target, which may stand after it.
  Result<void> place_eye() {
    if (!eye_) return {};
    if (glm::all(glm::equal(*eye_, camera().target))) return wrong("eye and target must differ");
    const Camera placed = look_at(*eye_, camera().target);
    camera().rotation = placed.rotation;
    camera().distance = placed.distance;
    eye_.reset();
    return {};
  }
  Camera& camera() { return cameras_.back().camera; }

  const std::string& path_;
  std::size_t line_ = 0;
  std::vector<TimedCamera> cameras_ = std::vector<TimedCamera>(1);
  std::optional<glm::dvec3> eye_;
  bool any_ = false;
};

}  // namespace

Result<std::vector<TimedCamera>> read_cameras(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return fail(ErrorCode::kInput, "{}: the file cannot be opened", path);
  CameraReader reader(path);
  constexpr std::size_t kMostLines = 1'000'000;
  std::size_t lines = 0;
  for (std::string line; std::getline(in, line);) {
    if (++lines > kMostLines) {
      return fail(ErrorCode::kInput, "{}: more than {} lines", path, kMostLines);
    }
    if (auto read = reader.read(line); !read) return tl::unexpected(read.error());
  }
  if (in.bad()) return fail(ErrorCode::kInput, "{}: the file cannot be read", path);
  return reader.done();
}

Result<void> write_camera(const Camera& camera, const std::string& path) {
  const std::string text = fmt::format(
      "# a camera for strata csg --camera-file\n"
      "target {} {} {}\nrotation {} {} {}\ndistance {}\nfov {}\nprojection {}\n",
      camera.target.x, camera.target.y, camera.target.z, camera.rotation.x, camera.rotation.y,
      camera.rotation.z, camera.distance, camera.field_of_view,
      camera.projection == Projection::kPerspective ? "perspective" : "orthographic");
  return write_file(path, text.data(), text.size());
}

}  // namespace strata
