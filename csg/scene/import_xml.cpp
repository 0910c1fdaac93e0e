#include "csg/scene/import_xml.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/mat4x4.hpp>
#include <new>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "csg/scene/zip_entry.h"
#include "mesh/input_bytes.h"
#include "mesh/shapes.h"
#include "mesh/soup_tools.h"

#ifdef STRATA_HAVE_PUGIXML
#include <pugixml.hpp>
#endif

namespace strata::csg {

#ifdef STRATA_HAVE_PUGIXML

namespace {

constexpr std::size_t kMostTriangles = 100'000'000;

/// The name without a namespace prefix.
std::string_view local_name(const pugi::xml_node& node) {
  const std::string_view name = node.name();
  const std::size_t colon = name.find(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

pugi::xml_node child(const pugi::xml_node& node, std::string_view name) {
  for (const pugi::xml_node& at : node.children()) {
    if (local_name(at) == name) return at;
  }
  return {};
}

std::optional<double> read_number(std::string_view text) {
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
  XmlMesh(const std::string& path, std::string text) : path_(path), text_(std::move(text)) {}

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

  tl::unexpected<Error> refuse(const pugi::xml_node& node, std::string_view text) const {
    return fail(ErrorCode::kInput, "{}:{}: {}", path_, line(node.offset_debug()), text);
  }

  /// A corner of a triangle: an index below `count`.
  Result<std::uint32_t> corner(const pugi::xml_node& node, std::string_view text,
                               std::size_t count) const {
    const auto number = read_number(text);
    if (!number || *number < 0.0 || *number != std::floor(*number)) {
      return refuse(node, fmt::format("'{}' is no index of a vertex", text.substr(0, 40)));
    }
    if (*number >= static_cast<double>(count)) {
      return refuse(
          node, fmt::format("a triangle refers to vertex {:.0f}, the mesh has {}", *number, count));
    }
    return static_cast<std::uint32_t>(*number);
  }

  Result<void> add_triangle(TriangleSoup& mesh, const pugi::xml_node& node,
                            const std::string_view (&texts)[3], std::size_t first) const {
    glm::uvec3 triangle(0u);
    for (int i = 0; i < 3; ++i) {
      auto index = corner(node, texts[i], mesh.positions.size() - first);
      if (!index) return tl::unexpected(index.error());
      triangle[i] = *index + static_cast<std::uint32_t>(first);
    }
    const bool flat =
        triangle.x == triangle.y || triangle.y == triangle.z || triangle.z == triangle.x;
    if (!flat) mesh.triangles.push_back(triangle);
    return {};
  }

 private:
  [[nodiscard]] std::ptrdiff_t line(std::ptrdiff_t offset) const {
    const auto end =
        std::clamp<std::ptrdiff_t>(offset, 0, static_cast<std::ptrdiff_t>(text_.size()));
    return 1 + std::count(text_.begin(), text_.begin() + end, '\n');
  }

  std::string path_;
  std::string text_;
  pugi::xml_document document_;
};

// --- 3MF
// ------------------------------------------------------------------------------------------

Result<TriangleSoup> read_object_mesh(const XmlMesh& file, const pugi::xml_node& node) {
  TriangleSoup mesh;
  for (const pugi::xml_node& vertex : child(node, "vertices").children()) {
    glm::dvec3 p;
    const char* const axes[] = {"x", "y", "z"};
    for (int i = 0; i < 3; ++i) {
      const auto number = read_number(vertex.attribute(axes[i]).value());
      if (!number) return file.refuse(vertex, fmt::format("a vertex without a usable {}", axes[i]));
      p[i] = *number;
    }
    mesh.positions.push_back(p);
  }
  for (const pugi::xml_node& triangle : child(node, "triangles").children()) {
    if (local_name(triangle) != "triangle") continue;
    const std::string_view texts[] = {triangle.attribute("v1").value(),
                                      triangle.attribute("v2").value(),
                                      triangle.attribute("v3").value()};
    if (auto added = file.add_triangle(mesh, triangle, texts, 0); !added) {
      return tl::unexpected(added.error());
    }
  }
  return mesh;
}

/// "m00 m01 m02 m10 ... m32", for row vectors: the rows are the columns of ours.
Result<glm::dmat4> read_transform(const XmlMesh& file, const pugi::xml_node& node) {
  glm::dmat4 matrix(1.0);
  std::string_view text = node.attribute("transform").value();
  if (text.empty()) return matrix;
  for (int i = 0; i < 12; ++i) {
    while (text.starts_with(' ')) text.remove_prefix(1);
    const std::size_t space = std::min(text.find(' '), text.size());
    const auto number = read_number(text.substr(0, space));
    if (!number) return file.refuse(node, "a transform that is not twelve numbers");
    matrix[i / 3][i % 3] = *number;
    text.remove_prefix(space);
  }
  return matrix;
}

/// An object at a place, on the way to the soup.
struct Instance {
  std::string_view id;
  glm::dmat4 world{1.0};
  int depth = 0;
  pugi::xml_node node;
};

Result<TriangleSoup> assemble(const XmlMesh& file) {
  constexpr int kMostDepth = 64;
  constexpr std::size_t kMostInstances = 1'000'000;
  std::unordered_map<std::string_view, pugi::xml_node> objects;
  for (const pugi::xml_node& object : child(file.root(), "resources").children()) {
    if (local_name(object) == "object") objects[object.attribute("id").value()] = object;
  }
  std::unordered_map<std::string_view, TriangleSoup> meshes;
  std::vector<Instance> waiting;
  const auto add = [&](const pugi::xml_node& item, const Instance& around) -> Result<void> {
    auto matrix = read_transform(file, item);
    if (!matrix) return tl::unexpected(matrix.error());
    waiting.push_back(
        {item.attribute("objectid").value(), around.world * *matrix, around.depth + 1, item});
    return {};
  };
  for (const pugi::xml_node& item : child(file.root(), "build").children()) {
    if (local_name(item) != "item") continue;
    if (auto added = add(item, {}); !added) return tl::unexpected(added.error());
  }
  TriangleSoup all;
  std::size_t instances = 0;
  while (!waiting.empty()) {
    const Instance instance = waiting.back();
    waiting.pop_back();
    const auto object = objects.find(instance.id);
    if (object == objects.end()) {
      return file.refuse(instance.node, fmt::format("there is no object '{}'", instance.id));
    }
    if (instance.depth > kMostDepth) {
      return file.refuse(instance.node, "components within components, more than 64 deep");
    }
    if (++instances > kMostInstances || all.triangles.size() > kMostTriangles) {
      return fail(ErrorCode::kLimit, "the model has more than {} triangles or {} components",
                  kMostTriangles, kMostInstances);
    }
    for (const pugi::xml_node& part : object->second.children()) {
      if (local_name(part) == "components") {
        for (const pugi::xml_node& component : part.children()) {
          if (auto added = add(component, instance); !added) return tl::unexpected(added.error());
        }
      } else if (local_name(part) == "mesh") {
        auto [mesh, is_new] = meshes.try_emplace(instance.id);
        if (is_new) {
          auto read = read_object_mesh(file, part);
          if (!read) return read;
          mesh->second = *std::move(read);
        }
        append(all, transform(mesh->second, instance.world));
      }
    }
  }
  return all;
}

// --- AMF
// ------------------------------------------------------------------------------------------

Result<void> read_amf_mesh(const XmlMesh& file, const pugi::xml_node& node, TriangleSoup& all) {
  const std::size_t first = all.positions.size();
  for (const pugi::xml_node& vertex : child(node, "vertices").children()) {
    if (local_name(vertex) != "vertex") continue;
    const pugi::xml_node place = child(vertex, "coordinates");
    glm::dvec3 p;
    const char* const axes[] = {"x", "y", "z"};
    for (int i = 0; i < 3; ++i) {
      const auto number = read_number(child(place, axes[i]).text().get());
      if (!number) return file.refuse(vertex, fmt::format("a vertex without a usable {}", axes[i]));
      p[i] = *number;
    }
    all.positions.push_back(p);
  }
  for (const pugi::xml_node& volume : node.children()) {
    if (local_name(volume) != "volume") continue;
    for (const pugi::xml_node& triangle : volume.children()) {
      if (local_name(triangle) != "triangle") continue;
      const std::string_view texts[] = {child(triangle, "v1").text().get(),
                                        child(triangle, "v2").text().get(),
                                        child(triangle, "v3").text().get()};
      if (auto added = file.add_triangle(all, triangle, texts, first); !added) return added;
    }
  }
  return {};
}

}  // namespace

Result<TriangleSoup> read_3mf(const std::string& path) try {
  auto text = unzip_first(path, [](std::string_view name) { return name.ends_with(".model"); });
  if (!text) return tl::unexpected(text.error());
  XmlMesh file(path, *std::move(text));
  if (auto parsed = file.parse(); !parsed) return tl::unexpected(parsed.error());
  return assemble(file);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "{}: too large for the memory", path);
}

Result<TriangleSoup> read_amf(const std::string& path) try {
  std::string text;
  {
    auto bytes = detail::InputBytes::open(path, 0);
    if (!bytes) return tl::unexpected(bytes.error());
    if (!bytes->view().starts_with("PK")) text = bytes->view();
  }
  if (text.empty()) {
    auto unpacked = unzip_first(path, [](std::string_view name) { return !name.ends_with('/'); });
    if (!unpacked) return tl::unexpected(unpacked.error());
    text = *std::move(unpacked);
  }
  XmlMesh file(path, std::move(text));
  if (auto parsed = file.parse(); !parsed) return tl::unexpected(parsed.error());
  TriangleSoup all;
  for (const pugi::xml_node& object : file.root().children()) {
    if (local_name(object) != "object") continue;
    if (auto read = read_amf_mesh(file, child(object, "mesh"), all); !read) {
      return tl::unexpected(read.error());
    }
  }
  return all;
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "{}: too large for the memory", path);
}

#else

Result<TriangleSoup> read_3mf(const std::string& path) {
  return fail(ErrorCode::kUsage, "{}: this build cannot read it (libpugixml-dev was missing)",
              path);
}
Result<TriangleSoup> read_amf(const std::string& path) { return read_3mf(path); }

#endif

}  // namespace strata::csg
