#include "mesh/archives/read_3mf_amf.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <glm/mat4x4.hpp>
#include <memory>
#include <new>
#include <optional>
#include <stop_token>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "mesh/archives/zip_entry.h"
#include "mesh/text/input_bytes.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"

#ifdef STRATA_HAVE_PUGIXML
#include <pugixml.hpp>
#endif

namespace strata {

#ifdef STRATA_HAVE_PUGIXML

namespace {

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

  Result<void> add_triangle(TriangleSoup& mesh, const pugi::xml_node& node,
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
  std::stop_token stop_;
  pugi::xml_document document_;
};

/// Warns of a unit that is not the millimetre. Numbers are taken as they are, so such a model has a
/// different size.
void note_unit(const XmlMesh& file, std::vector<std::string>& warnings) {
  constexpr std::pair<std::string_view, double> kUnits[] = {
      {"micron", 1e-3}, {"micrometer", 1e-3}, {"centimeter", 10.0}, {"inch", 25.4},
      {"foot", 304.8},  {"feet", 304.8},      {"meter", 1000.0}};
  const std::string_view unit = file.root().attribute("unit").value();
  for (const auto& [name, millimetres] : kUnits) {
    if (unit != name) continue;
    warnings.push_back(
        fmt::format("{}: its unit is the {}; the numbers are taken as they are, as OpenSCAD does; "
                    "scale({:g}) makes them millimetres",
                    file.path(), name, millimetres));
  }
}

// --- 3MF
// ------------------------------------------------------------------------------------------

Result<TriangleSoup> read_object_mesh(const XmlMesh& file, const pugi::xml_node& node) {
  TriangleSoup mesh;
  for (const pugi::xml_node& vertex : child(node, "vertices").children()) {
    if (vertex.type() != pugi::node_element) continue;
    if (file.stopped()) return fail(ErrorCode::kCancelled, "stopped");
    glm::dvec3 p;
    const char* const axes[] = {"x", "y", "z"};
    for (int i = 0; i < 3; ++i) {
      const auto number = read_number(vertex.attribute(axes[i]).value());
      if (!number) return file.refuse(vertex, fmt::format("a vertex has no valid {}", axes[i]));
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

/// Reads "m00 m01 m02 m10 ... m32", a matrix for row vectors. Its rows are the columns of ours.
Result<glm::dmat4> read_transform(const XmlMesh& file, const pugi::xml_node& node) {
  constexpr std::string_view kSpace = " \t\r\n";
  glm::dmat4 matrix(1.0);
  std::string_view text = node.attribute("transform").value();
  if (text.find_first_not_of(kSpace) == std::string_view::npos) return matrix;
  for (int i = 0; i < 12; ++i) {
    text.remove_prefix(std::min(text.find_first_not_of(kSpace), text.size()));
    const std::size_t space = std::min(text.find_first_of(kSpace), text.size());
    const auto number = read_number(text.substr(0, space));
    if (!number) return file.refuse(node, "a transform must have 12 numbers");
    matrix[i / 3][i % 3] = *number;
    text.remove_prefix(space);
  }
  if (text.find_first_not_of(kSpace) != std::string_view::npos) {
    return file.refuse(node, "a transform must have 12 numbers, got more");
  }
  return matrix;
}

/// The value of the attribute with this name, whatever the prefix of its namespace.
std::string_view any_attribute(const pugi::xml_node& node, std::string_view name) {
  for (const pugi::xml_attribute& attribute : node.attributes()) {
    const std::string_view full = attribute.name();
    const std::size_t colon = full.find(':');
    if ((colon == std::string_view::npos ? full : full.substr(colon + 1)) == name) {
      return attribute.value();
    }
  }
  return {};
}

/// An object of a model part. Its mesh is read when it is first used.
struct ModelObject {
  pugi::xml_node node;
  std::optional<TriangleSoup> mesh;
  bool is_open = false;  ///< it encloses the component being read
};

/// A model part of the archive.
struct ModelPart {
  XmlMesh file;
  std::unordered_map<std::string_view, ModelObject> objects;
};

/// An object with its place. Its mesh goes to the soup.
struct Instance {
  const TriangleSoup* mesh = nullptr;
  glm::dmat4 world{1.0};
};

struct PlaceHash {
  std::size_t operator()(const std::pair<const ModelObject*, std::array<double, 12>>& key) const {
    std::size_t hash = std::hash<const void*>()(key.first);
    for (const double number : key.second) {
      hash = hash * 0x9e3779b97f4a7c15u + std::hash<double>()(number);
    }
    return hash ^ (hash >> 29);
  }
};

/// Assembles the build items of an archive.
class Package {
 public:
  Package(ZipArchive archive, const Execution& execution)
      : archive_(std::move(archive)), execution_(execution) {}

  Result<TriangleSoup> assemble(std::vector<std::string>* warnings) {
    auto name = root_name();
    if (!name) return tl::unexpected(name.error());
    auto root = part(*name);
    if (!root) return tl::unexpected(root.error());
    const XmlMesh& file = (*root)->file;
    if (warnings) note_unit(file, *warnings);
    for (const pugi::xml_node& item : child(file.root(), "build").children()) {
      if (local_name(item) != "item") continue;
      if (auto added = add(**root, item, glm::dmat4(1.0), 0); !added) {
        return tl::unexpected(added.error());
      }
    }
    return gather();
  }

 private:
  static constexpr int kMostDepth = 64;
  static constexpr std::size_t kMostInstances = 1'000'000;

  /// The name of the part that the package's relationships declare as the model.
  Result<std::string> root_name() const {
    if (const auto rels = archive_.find("_rels/.rels")) {
      auto text = archive_.read(*rels, execution_);
      if (!text) return tl::unexpected(text.error());
      XmlMesh file(archive_.path() + "/" + *rels, *std::move(text));
      if (auto parsed = file.parse(); !parsed) return tl::unexpected(parsed.error());
      for (const pugi::xml_node& relation : file.root().children()) {
        if (!std::string_view(relation.attribute("Type").value()).ends_with("/3dmodel")) continue;
        const std::string_view target = relation.attribute("Target").value();
        if (const auto name = archive_.find(target)) return *name;
        return file.refuse(relation, fmt::format("there is no part '{}'", target));
      }
    }
    if (const auto name = archive_.find("3D/3dmodel.model")) return *name;
    for (const std::string& name : archive_.names()) {
      if (name.ends_with(".model")) return name;
    }
    return fail(ErrorCode::kInput, "{}: the archive has no model", archive_.path());
  }

  Result<ModelPart*> part(const std::string& name) {
    std::unique_ptr<ModelPart>& part = parts_[name];
    if (part) return part.get();
    auto text = archive_.read(name, execution_);
    if (!text) return tl::unexpected(text.error());
    auto made = std::make_unique<ModelPart>(
        ModelPart{XmlMesh(archive_.path() + "/" + name, *std::move(text), execution_.stop), {}});
    if (auto parsed = made->file.parse(); !parsed) return tl::unexpected(parsed.error());
    for (const pugi::xml_node& object : child(made->file.root(), "resources").children()) {
      if (local_name(object) != "object") continue;
      made->objects.try_emplace(object.attribute("id").value(), ModelObject{object, {}, false});
    }
    part = std::move(made);
    return part.get();
  }

  /// Adds the object that a build item or component names, at its place.
  Result<void> add(ModelPart& home, const pugi::xml_node& item, const glm::dmat4& around,
                   int depth) {
    if (execution_.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    auto matrix = read_transform(home.file, item);
    if (!matrix) return tl::unexpected(matrix.error());
    ModelPart* where = &home;
    if (const std::string_view path = any_attribute(item, "path"); !path.empty()) {
      const auto name = archive_.find(path);
      if (!name) return home.file.refuse(item, fmt::format("there is no part '{}'", path));
      auto other = part(*name);
      if (!other) return tl::unexpected(other.error());
      where = *other;
    }
    const std::string_view id = item.attribute("objectid").value();
    const auto found = where->objects.find(id);
    if (found == where->objects.end()) {
      return home.file.refuse(item, where == &home
                                        ? fmt::format("there is no object '{}'", id)
                                        : fmt::format("there is no object '{}' in part '{}'", id,
                                                      any_attribute(item, "path")));
    }
    ModelObject& object = found->second;
    if (object.is_open) {
      return home.file.refuse(item, fmt::format("object '{}' is a component of itself", id));
    }
    if (depth > kMostDepth) {
      return home.file.refuse(item,
                              fmt::format("components are nested more than {} deep", kMostDepth));
    }
    const glm::dmat4 world = around * *matrix;
    std::array<double, 12> place;
    for (int i = 0; i < 12; ++i) place[static_cast<std::size_t>(i)] = world[i / 3][i % 3];
    if (!placed_.emplace(&object, place).second) return {};  // the object is already at this place
    if (placed_.size() > kMostInstances) {
      return home.file.refuse(
          item, fmt::format("the model has more than {} objects at their places", kMostInstances),
          ErrorCode::kLimit);
    }
    return add_object(*where, object, world, depth);
  }

  Result<void> add_object(ModelPart& home, ModelObject& object, const glm::dmat4& world,
                          int depth) {
    for (const pugi::xml_node& content : object.node.children()) {
      if (local_name(content) == "mesh") {
        if (!object.mesh) {
          auto read = read_object_mesh(home.file, content);
          if (!read) return tl::unexpected(read.error());
          object.mesh = *std::move(read);
        }
        instances_.push_back({&*object.mesh, world});
      } else if (local_name(content) == "components") {
        object.is_open = true;
        for (const pugi::xml_node& component : content.children()) {
          if (local_name(component) != "component") continue;
          if (auto added = add(home, component, world, depth + 1); !added) return added;
        }
        object.is_open = false;
      }
    }
    return {};
  }

  Result<TriangleSoup> gather() const {
    std::size_t positions = 0, triangles = 0;
    for (const Instance& instance : instances_) {
      positions += instance.mesh->positions.size();
      triangles += instance.mesh->triangles.size();
    }
    constexpr std::size_t kMostTriangles = 100'000'000;
    if (triangles > kMostTriangles || positions > kMostTriangles) {
      return fail(ErrorCode::kLimit,
                  "{}: the model has {} triangles and {} vertices in {} objects; the limit is {}",
                  archive_.path(), triangles, positions, instances_.size(), kMostTriangles);
    }
    if (triangles == 0) {
      return fail(ErrorCode::kInput, "{}: no build item has a triangle", archive_.path());
    }
    const std::size_t bytes = positions * sizeof(glm::dvec3) + triangles * sizeof(glm::uvec3);
    if (execution_.memory_limit != 0 && bytes > execution_.memory_limit) {
      return fail(ErrorCode::kLimit, "{}: the model needs {} bytes, but the memory limit is {}",
                  archive_.path(), bytes, execution_.memory_limit);
    }
    TriangleSoup all;
    all.positions.reserve(positions);
    all.triangles.reserve(triangles);
    for (const Instance& instance : instances_) {
      if (execution_.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
      append(all, transform(*instance.mesh, instance.world));
    }
    for (const glm::dvec3& p : all.positions) {
      if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) continue;
      return fail(ErrorCode::kInput, "{}: its transforms give coordinates that are not finite",
                  archive_.path());
    }
    return all;
  }

  ZipArchive archive_;
  const Execution& execution_;
  std::unordered_map<std::string, std::unique_ptr<ModelPart>> parts_;
  std::unordered_set<std::pair<const ModelObject*, std::array<double, 12>>, PlaceHash> placed_;
  std::vector<Instance> instances_;
};

// --- AMF
// ------------------------------------------------------------------------------------------

Result<void> read_amf_mesh(const XmlMesh& file, const pugi::xml_node& node, TriangleSoup& all) {
  const std::size_t first = all.positions.size();
  for (const pugi::xml_node& vertex : child(node, "vertices").children()) {
    if (local_name(vertex) != "vertex") continue;
    const pugi::xml_node place = child(vertex, "coordinates");
    if (file.stopped()) return fail(ErrorCode::kCancelled, "stopped");
    glm::dvec3 p;
    const char* const axes[] = {"x", "y", "z"};
    for (int i = 0; i < 3; ++i) {
      const auto number = read_number(child(place, axes[i]).text().get());
      if (!number) return file.refuse(vertex, fmt::format("a vertex has no valid {}", axes[i]));
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

Result<TriangleSoup> read_3mf(const std::string& path, const Execution& execution,
                              std::vector<std::string>* warnings) try {
  auto archive = ZipArchive::open(path);
  if (!archive) return tl::unexpected(archive.error());
  return Package(*std::move(archive), execution).assemble(warnings);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "{}: out of memory", path);
}

Result<TriangleSoup> read_amf(const std::string& path, const Execution& execution,
                              std::vector<std::string>* warnings) try {
  std::string text;
  {
    auto bytes = detail::InputBytes::open(path, 0);
    if (!bytes) return tl::unexpected(bytes.error());
    if (!bytes->view().starts_with("PK")) text = bytes->view();
  }
  if (text.empty()) {
    auto archive = ZipArchive::open(path);
    if (!archive) return tl::unexpected(archive.error());
    const auto& names = archive->names();
    const auto first = std::find_if(names.begin(), names.end(),
                                    [](const std::string& at) { return !at.ends_with('/'); });
    if (first == names.end()) return fail(ErrorCode::kInput, "{}: the archive is empty", path);
    auto unpacked = archive->read(*first, execution);
    if (!unpacked) return tl::unexpected(unpacked.error());
    text = *std::move(unpacked);
  }
  XmlMesh file(path, std::move(text), execution.stop);
  if (auto parsed = file.parse(); !parsed) return tl::unexpected(parsed.error());
  if (warnings) note_unit(file, *warnings);
  TriangleSoup all;
  for (const pugi::xml_node& object : file.root().children()) {
    if (local_name(object) != "object") continue;
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    if (auto read = read_amf_mesh(file, child(object, "mesh"), all); !read) {
      return tl::unexpected(read.error());
    }
  }
  if (all.triangles.empty()) return fail(ErrorCode::kInput, "{}: no object has a triangle", path);
  return all;
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "{}: out of memory", path);
}

#else

Result<TriangleSoup> read_3mf(const std::string& path, const Execution&,
                              std::vector<std::string>*) {
  return fail(ErrorCode::kUsage, "{}: this build cannot read it (libpugixml-dev was missing)",
              path);
}
Result<TriangleSoup> read_amf(const std::string& path, const Execution&,
                              std::vector<std::string>*) {
  return read_3mf(path);
}

#endif

}  // namespace strata
