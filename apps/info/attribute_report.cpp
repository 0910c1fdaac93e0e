#include "apps/info/attribute_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "core/printable.h"
#include "mesh/split_parts.h"
#include "strata/mesh/diagnose.h"

namespace strata::apps {
namespace {

/// Things of one kind that the text lists; the JSON has all.
constexpr std::size_t kMostListed = 20;
/// Parts, and triangles, up to which it is looked at each part whether it is closed.
constexpr std::size_t kMostParts = 4096, kMostTriangles = 20'000'000;

std::string place(const glm::dvec3& v) {
  return fmt::format("({:.9g}, {:.9g}, {:.9g})", v.x, v.y, v.z);
}

/// Writes an array of objects; nothing where there is none.
template <class T, class Write>
void write_all(JsonWriter& json, std::string_view name, const std::vector<T>& all, Write&& write) {
  if (all.empty()) return;
  json.key(name).begin_array();
  for (const T& one : all) {
    json.begin_object();
    write(one);
    json.end_object();
  }
  json.end_array();
}

/// Adds a line for each of the first things, and the number of all.
template <class T, class Describe>
void add_all(ReportLines& lines, const char* topic, const std::vector<T>& all,
             Describe&& describe) {
  if (all.empty()) return;
  lines.emplace_back(topic, std::to_string(all.size()));
  for (std::size_t i = 0; i < all.size() && i < kMostListed; ++i) {
    lines.emplace_back("", describe(all[i]));
  }
  if (all.size() > kMostListed) {
    lines.emplace_back("", fmt::format("and {} more", all.size() - kMostListed));
  }
}

}  // namespace

AttributeFacts look_at_attributes(const MeshFile& file, bool closed, const Execution& execution) {
  const MeshAttributes& all = file.attributes;
  AttributeFacts facts;
  facts.parts.resize(all.parts.size());
  for (std::size_t i = 0; i < all.parts.size(); ++i) facts.parts[i].name = all.parts[i].name;
  if (!all.parts.empty()) {
    const auto parts = detail::parts_of_triangles(file.soup, all);
    for (std::size_t t = 0; t < parts.size(); ++t) {
      if (parts[t] == MeshAttributes::kNone) continue;
      AttributeFacts::Part& part = facts.parts[parts[t]];
      ++part.triangles;
      for (int k = 0; k < 3; ++k)
        part.bounds.include(file.soup.positions[file.soup.triangles[t][k]]);
    }
  }
  if (facts.parts.size() == 1 && facts.parts[0].triangles == file.soup.triangles.size()) {
    facts.parts[0].closed = closed;
  } else if (!facts.parts.empty() && facts.parts.size() <= kMostParts &&
             file.soup.triangles.size() <= kMostTriangles) {
    const std::vector<TriangleSoup> split = detail::split_parts(file.soup, all);
    for (std::size_t i = 0; i < facts.parts.size(); ++i) {
      facts.parts[i].closed = !split[i].triangles.empty() && is_closed(split[i], execution);
    }
  }
  facts.materials = all.materials;
  for (const Texture& texture : all.textures) {
    facts.textures.push_back({texture.name, texture.width, texture.height});
  }
  facts.missing = file.stats.missing;
  facts.vertex_colours = !all.vertex_colours.empty();
  facts.face_colours = !all.element_colours.empty();
  facts.corner_colours = all.corner_colours;
  return facts;
}

ReportLines attribute_lines(const AttributeFacts& facts) {
  ReportLines lines;
  add_all(lines, "parts", facts.parts, [](const AttributeFacts::Part& part) {
    std::string text =
        fmt::format("'{}': {}", printable(part.name, 60), counted(part.triangles, "triangle"));
    if (part.triangles > 0) {
      text += fmt::format(", {} to {}", place(part.bounds.low), place(part.bounds.high));
    }
    if (part.closed) text += *part.closed ? ", closed" : ", open";
    return text;
  });
  add_all(lines, "materials", facts.materials, [](const SurfaceMaterial& material) {
    std::string text = fmt::format("'{}'", printable(material.name, 60));
    if (material.texture != SurfaceMaterial::kNoTexture) {
      text += fmt::format(", texture {}", material.texture + 1);
    } else if (material.coloured) {
      const glm::vec4& c = material.colour;
      text += fmt::format(", {:.3g} {:.3g} {:.3g}", c.r, c.g, c.b);
    }
    if (material.colour.a < 1.0f) text += fmt::format(", opacity {:.3g}", material.colour.a);
    return text;
  });
  add_all(lines, "textures", facts.textures, [](const AttributeFacts::Picture& picture) {
    return fmt::format("{}: {} x {}", printable(picture.name), picture.width, picture.height);
  });
  std::string colours;
  for (const auto& [given, what] :
       {std::pair(facts.vertex_colours, "vertices"), std::pair(facts.face_colours, "faces"),
        std::pair(facts.corner_colours, "corners")}) {
    if (given) colours += fmt::format("{}{}", colours.empty() ? "of " : ", ", what);
  }
  if (!colours.empty()) lines.emplace_back("colours", colours);
  for (const std::string& sentence : facts.missing) {
    lines.emplace_back("missing", printable(sentence));
  }
  return lines;
}

void write_attributes(JsonWriter& json, const AttributeFacts& facts) {
  json.key("colours").begin_object();
  json.member("vertices", facts.vertex_colours);
  json.member("faces", facts.face_colours);
  json.member("corners", facts.corner_colours);
  json.end_object();
  write_all(json, "parts", facts.parts, [&](const AttributeFacts::Part& part) {
    json.member("name", part.name);
    json.member("triangles", part.triangles);
    json.member("low", part.bounds.low);
    json.member("high", part.bounds.high);
    json.key("closed");
    if (part.closed) {
      json.value(*part.closed);
    } else {
      json.null();
    }
  });
  write_all(json, "materials", facts.materials, [&](const SurfaceMaterial& material) {
    json.member("name", material.name);
    json.member("coloured", material.coloured);
    json.member("colour", glm::dvec3(material.colour));
    json.member("opacity", static_cast<double>(material.colour.a));
    json.key("texture");
    if (material.texture != SurfaceMaterial::kNoTexture) {
      json.value(material.texture);
    } else {
      json.null();
    }
  });
  write_all(json, "textures", facts.textures, [&](const AttributeFacts::Picture& picture) {
    json.member("name", picture.name);
    json.member("width", picture.width);
    json.member("height", picture.height);
  });
  if (facts.missing.empty()) return;
  json.key("missing").begin_array();
  for (const std::string& sentence : facts.missing) json.value(sentence);
  json.end_array();
}

}  // namespace strata::apps
