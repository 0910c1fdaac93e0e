#pragma once

#include <pugixml.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/printable.h"
#include "strata/core/result.h"
#include "strata/mesh/triangle_soup.h"

/// What the readers of 3MF and AMF share. Private to this room.
namespace strata::detail {

/// The name without a namespace prefix.
inline std::string_view local_name(const pugi::xml_node& node) {
  const std::string_view name = node.name();
  const std::size_t colon = name.find(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

inline pugi::xml_node child(const pugi::xml_node& node, std::string_view name) {
  for (const pugi::xml_node& at : node.children()) {
    if (local_name(at) == name) return at;
  }
  return {};
}

inline std::optional<double> read_number(std::string_view text) {
  while (!text.empty() && static_cast<unsigned char>(text.front()) <= ' ') text.remove_prefix(1);
  while (!text.empty() && static_cast<unsigned char>(text.back()) <= ' ') text.remove_suffix(1);
  if (text.starts_with('+')) text.remove_prefix(1);
  double number = 0.0;
  const auto [stop, status] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (status != std::errc() || stop != text.data() + text.size() || !std::isfinite(number)) {
    return std::nullopt;
  }
  return number;
}

class XmlMesh {
 public:
  XmlMesh(const std::string& path, std::string text, std::stop_token stop = {})
      : path_(path), text_(std::move(text)), stop_(std::move(stop)) {}

  Result<void> parse() {
    const pugi::xml_parse_result parsed = document_.load_buffer(text_.data(), text_.size());
    if (parsed.status == pugi::status_out_of_memory) {
      return fail(ErrorCode::kLimit, "{}: no memory for the document", path_);
    }
    if (!parsed) {
      return fail(ErrorCode::kInput, "{}:{}: {}", path_, line(parsed.offset), parsed.description());
    }
    return {};
  }

  [[nodiscard]] pugi::xml_node root() const { return document_.document_element(); }

  tl::unexpected<Error> refuse(const pugi::xml_node& node, std::string_view text,
                               ErrorCode code = ErrorCode::kInput) const {
    return fail(code, "{}:{}: {}", path_, line(node.offset_debug()), text);
  }
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] bool stopped() const { return stop_.stop_requested(); }

  /// Reads a corner of a triangle: an index below `count`.
  Result<std::uint32_t> corner(const pugi::xml_node& node, std::string_view text,
                               std::size_t count) const {
    const auto number = read_number(text);
    if (!number || *number < 0.0 || *number != std::floor(*number)) {
      return refuse(node, fmt::format("'{}' is not a vertex index", text.substr(0, 40)));
    }
    if (*number >= static_cast<double>(count)) {
      return refuse(
          node, fmt::format("a triangle refers to vertex {:.0f}, the mesh has {}", *number, count));
    }
    return static_cast<std::uint32_t>(*number);
  }

  /// @return whether the triangle was added: its corners differ
  Result<bool> add_triangle(TriangleSoup& mesh, const pugi::xml_node& node,
                            const std::string_view (&texts)[3], std::size_t first) const {
    if (stopped()) return fail(ErrorCode::kCancelled, "stopped");
    glm::uvec3 triangle(0u);
    for (int i = 0; i < 3; ++i) {
      auto index = corner(node, texts[i], mesh.positions.size() - first);
      if (!index) return tl::unexpected(index.error());
      triangle[i] = *index + static_cast<std::uint32_t>(first);
    }
    const bool flat =
        triangle.x == triangle.y || triangle.y == triangle.z || triangle.z == triangle.x;
    if (!flat) mesh.triangles.push_back(triangle);
    return !flat;
  }

 private:
  [[nodiscard]] std::ptrdiff_t line(std::ptrdiff_t offset) const {
    const auto end =
        std::clamp<std::ptrdiff_t>(offset, 0, static_cast<std::ptrdiff_t>(text_.size()));
    return 1 + std::count(text_.begin(), text_.begin() + end, '\n');
  }

  std::string path_;
  std::string text_;
  std::stop_token stop_;
  pugi::xml_document document_;
};

/// The unit of a document in metres, by default the millimetre. One that is not known is a warning.
inline double unit_of(const XmlMesh& file, std::vector<std::string>& warnings) {
  constexpr std::pair<std::string_view, double> kUnits[] = {
      {"millimeter", 1e-3}, {"micron", 1e-6}, {"micrometer", 1e-6}, {"centimeter", 1e-2},
      {"inch", 0.0254},     {"foot", 0.3048}, {"feet", 0.3048},     {"meter", 1.0}};
  const std::string_view unit = file.root().attribute("unit").value();
  for (const auto& [name, metres] : kUnits) {
    if (unit == name) return metres;
  }
  if (file.root().attribute("unit")) {
    warnings.push_back(
        fmt::format("{}: the unit '{}' is not known; numbers are taken as millimetres", file.path(),
                    printable(unit)));
  }
  return 1e-3;
}

}  // namespace strata::detail
