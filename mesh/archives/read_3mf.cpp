#include "mesh/archives/read_3mf_amf.h"

#ifdef STRATA_HAVE_PUGIXML

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <memory>
#include <new>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "core/printable.h"
#include "mesh/archives/model_looks.h"
#include "mesh/archives/model_properties.h"
#include "mesh/archives/slicer_settings.h"
#include "mesh/archives/xml_mesh.h"
#include "mesh/archives/zip_entry.h"
#include "mesh/textures/read_texture.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"

namespace strata {
namespace {

using namespace detail;

/// The mesh of an object, and what its triangles look like if that is asked.
struct ObjectMesh {
  TriangleSoup soup;
  std::vector<TriangleLook> looks;
  /// Triangles up to `end`, from the end of the volume before.
  struct Volume {
    std::string name;
    std::size_t end = 0;
  };
  std::vector<Volume> volumes;  ///< as a slicer divides the mesh; empty: it does not
};

/// Finds the properties that triangles name.
class LookFinder {
 public:
  LookFinder(const pugi::xml_node& object, const PropertyGroups& groups)
      : object_(object), groups_(groups) {
    own_id_ = object.attribute("pid").value();
    own_ = group_of(own_id_);
    own_index_ = index_of(object.attribute("pindex").value());
  }
  TriangleLook look(const pugi::xml_node& triangle) {
    const std::string_view pid = triangle.attribute("pid").value();
    const std::string_view p1 = triangle.attribute("p1").value();
    const PropertyGroup* const group = pid.empty() ? own_ : pid == last_id_ ? last_ : group_of(pid);
    if (!pid.empty()) {
      last_id_ = pid;
      last_ = group;
    }
    const std::string_view id = pid.empty() ? own_id_ : pid;
    if (group == nullptr) {
      if (!id.empty()) miss(triangle, id, nullptr, 0);
      return {};
    }
    const std::uint32_t first = p1.empty() ? own_index_ : index_of(p1);
    const auto or_first = [&](const char* name) {
      const std::string_view text = triangle.attribute(name).value();
      return text.empty() ? first : index_of(text);
    };
    std::array<std::uint32_t, 3> corners{first, first, first};
    if (!p1.empty()) corners = {first, or_first("p2"), or_first("p3")};
    const std::uint32_t most = *std::max_element(corners.begin(), corners.end());
    if (!group->skipped && most >= group->size()) miss(triangle, id, group, most);
    return group->look(corners);
  }
  /// Tells of triangles whose property does not exist.
  void warn(const XmlMesh& file, std::vector<std::string>& warnings) const {
    if (missed_ == 0) return;
    warnings.push_back(
        file.refuse(first_missed_,
                    fmt::format("object '{}': {}; {} no colour",
                                printable(object_.attribute("id").value(), 40), what_missed_,
                                missed_ == 1 ? "this triangle has"
                                             : fmt::format("{} triangles have", missed_)))
            .value()
            .message);
  }

 private:
  void miss(const pugi::xml_node& triangle, std::string_view id, const PropertyGroup* group,
            std::uint32_t index) {
    if (missed_++ > 0) return;
    first_missed_ = triangle;
    const std::string name = printable(id, 40);
    what_missed_ =
        group == nullptr ? fmt::format("there is no property group '{}' (pid)", name)
        : index == MeshAttributes::kNone
            ? fmt::format(
                  "it names the property group '{}' (pid), but no property of it (pindex, "
                  "p1)",
                  name)
            : fmt::format("there is no property {} in the group '{}', which has {}", index, name,
                          group->size());
  }
  [[nodiscard]] const PropertyGroup* group_of(std::string_view id) const {
    const auto found = groups_.find(id);
    return found == groups_.end() ? nullptr : &found->second;
  }
  static std::uint32_t index_of(std::string_view text) {
    const auto number = read_number(text);
    return number && *number >= 0.0 && *number < 4e9 ? static_cast<std::uint32_t>(*number)
                                                     : MeshAttributes::kNone;
  }

  const pugi::xml_node object_;
  const PropertyGroups& groups_;
  std::string_view own_id_;
  const PropertyGroup* own_ = nullptr;
  std::uint32_t own_index_ = MeshAttributes::kNone;
  std::string_view last_id_;
  const PropertyGroup* last_ = nullptr;
  std::uint64_t missed_ = 0;
  pugi::xml_node first_missed_;
  std::string what_missed_;
};

/// Divides the triangles as a slicer does, and drops those of volumes that are no solids.
/// @param elements  the number of each triangle in the file
/// @param left_out  gets the volumes that were dropped
void divide(const SlicerObject& object, const std::vector<std::uint32_t>& elements,
            ObjectMesh& mesh, std::vector<std::string>& left_out) {
  std::size_t kept = 0, t = 0;
  const auto take = [&](std::uint64_t end) {  // up to a triangle of the file
    for (; t < elements.size() && elements[t] < end; ++t, ++kept) {
      mesh.soup.triangles[kept] = mesh.soup.triangles[t];
      if (!mesh.looks.empty()) mesh.looks[kept] = mesh.looks[t];
    }
  };
  const auto end_part = [&](const std::string& name) {
    if (kept > (mesh.volumes.empty() ? 0 : mesh.volumes.back().end)) {
      mesh.volumes.push_back({name, kept});
    }
  };
  for (const SlicerPart& volume : object.volumes) {
    take(volume.first);  // triangles of no volume
    end_part(object.name);
    if (volume.not_solid.empty()) {
      take(volume.last + 1);
      end_part(object.name_of(volume));
      continue;
    }
    const std::size_t before = t;
    while (t < elements.size() && elements[t] <= volume.last) ++t;
    if (t > before) {
      left_out.push_back(
          fmt::format("'{}' ({})", printable(object.name_of(volume), 40), volume.not_solid));
    }
  }
  take(std::uint64_t{1} << 32);
  end_part(object.name);
  mesh.soup.triangles.resize(kept);
  if (!mesh.looks.empty()) mesh.looks.resize(kept);
}

/// @param finder  null: looks are not asked
/// @param elements  gets the number of each triangle in the file
Result<ObjectMesh> read_object_mesh(const XmlMesh& file, const pugi::xml_node& node,
                                    LookFinder* finder, std::vector<std::uint32_t>& elements) {
  ObjectMesh mesh;
  std::uint32_t element = 0;
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
    mesh.soup.positions.push_back(p);
  }
  for (const pugi::xml_node& triangle : child(node, "triangles").children()) {
    if (local_name(triangle) != "triangle") continue;
    const std::string_view texts[] = {triangle.attribute("v1").value(),
                                      triangle.attribute("v2").value(),
                                      triangle.attribute("v3").value()};
    const auto added = file.add_triangle(mesh.soup, triangle, texts, 0);
    if (!added) return tl::unexpected(added.error());
    if (*added && finder) mesh.looks.push_back(finder->look(triangle));
    if (*added) elements.push_back(element);
    ++element;
  }
  return mesh;
}

/// Whether a matrix has no inverse, but for rounding.
bool is_singular(glm::dmat3 matrix) {
  for (int k = 0; k < 3; ++k) {
    glm::dvec3& column = matrix[k];
    const double most = std::max({std::abs(column.x), std::abs(column.y), std::abs(column.z)});
    if (most == 0.0) return true;
    column = glm::normalize(column / most);
  }
  return std::abs(glm::determinant(matrix)) < 1e-12;
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
  if (is_singular(glm::dmat3(matrix))) {
    return file.refuse(node, fmt::format("the transform of object '{}' is singular: nothing with "
                                         "a volume is left of it",
                                         printable(node.attribute("objectid").value(), 40)));
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
  std::optional<ObjectMesh> mesh;
  bool is_open = false;  ///< it encloses the component being read
};

/// A model part of the archive.
struct ModelPart {
  XmlMesh file;
  std::unordered_map<std::string_view, ModelObject> objects;
  PropertyGroups properties;
};

/// An object with its place. Its mesh goes to the soup.
struct Instance {
  const ObjectMesh* mesh = nullptr;
  glm::dmat4 world{1.0};
  std::string name;
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
  Package(ZipArchive archive, const ArchiveOptions& options, const Execution& execution)
      : archive_(std::move(archive)), options_(options), execution_(execution) {}

  /// Extensions that the file requires, and that are not read.
  void warn_of_extensions(const XmlMesh& file) {
    std::string_view rest = file.root().attribute("requiredextensions").value();
    while (!rest.empty()) {
      const std::string prefix(rest.substr(0, rest.find(' ')));
      rest.remove_prefix(std::min(rest.size(), prefix.size() + 1));
      const std::string_view space = file.root().attribute(("xmlns:" + prefix).c_str()).value();
      if (prefix.empty() || space.find("/production/") != std::string_view::npos ||
          space.find("/material/") != std::string_view::npos) {
        continue;
      }
      model_.warnings.push_back(fmt::format(
          "{}: the file requires the extension '{}' ({}), which is not read; parts may be missing",
          file.path(), printable(prefix), printable(space)));
    }
  }

  Result<ArchiveModel> assemble() {
    auto name = root_name();
    if (!name) return tl::unexpected(name.error());
    auto root = part(*name);
    if (!root) return tl::unexpected(root.error());
    auto settings = read_slicer_settings(archive_, execution_, model_.warnings);
    if (!settings) return tl::unexpected(settings.error());
    settings_ = *std::move(settings);
    root_ = *root;
    const XmlMesh& file = (*root)->file;
    model_.unit_metres = unit_of(file, model_.warnings);
    warn_of_extensions(file);
    for (const pugi::xml_node& item : child(file.root(), "build").children()) {
      if (local_name(item) != "item") continue;
      if (auto added = add(**root, item, glm::dmat4(1.0), 0, "", nullptr); !added) {
        return tl::unexpected(added.error());
      }
    }
    if (!left_out_.empty()) {
      model_.warnings.push_back(fmt::format("{}: {}", archive_.path(),
                                            what_is_left_out("is left out, which is no solid",
                                                             "are left out, which are no "
                                                             "solids")));
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
    auto made = std::make_unique<ModelPart>(ModelPart{
        XmlMesh(archive_.path() + "/" + name, *std::move(text), execution_.stop), {}, {}});
    if (auto parsed = made->file.parse(); !parsed) return tl::unexpected(parsed.error());
    const pugi::xml_node resources = child(made->file.root(), "resources");
    if (options_.attributes) {
      auto groups =
          read_properties(made->file, resources, pictures(), looks_.attributes, model_.warnings);
      if (!groups) return tl::unexpected(groups.error());
      made->properties = *std::move(groups);
    }
    for (const pugi::xml_node& object : resources.children()) {
      if (local_name(object) != "object") continue;
      made->objects.try_emplace(object.attribute("id").value(), ModelObject{object, {}, false});
    }
    part = std::move(made);
    return part.get();
  }

  /// Reads pictures of the archive; empty where none are asked.
  ReadPicture pictures() {
    if (!options_.textures) return {};
    return [this](std::string_view path) -> Result<Texture> {
      const auto name = archive_.find(path);
      if (!name) {
        return fail(ErrorCode::kInput, "{}: there is no picture '{}'", archive_.path(),
                    printable(path, 80));
      }
      auto bytes = archive_.read(*name, execution_);
      if (!bytes) return tl::unexpected(bytes.error());
      return read_texture(archive_.path() + "/" + *name, *bytes, execution_);
    };
  }

  /// Adds the object that a build item or component names, at its place. @param name  of the object
  /// around it @param slicer  what a slicer says of the object around it; may be null
  Result<void> add(ModelPart& home, const pugi::xml_node& item, const glm::dmat4& around, int depth,
                   const std::string& name, const SlicerObject* slicer) {
    if (execution_.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    auto matrix = read_transform(home.file, item);
    if (!matrix) return tl::unexpected(matrix.error());
    ModelPart* where = &home;
    if (const std::string_view path = any_attribute(item, "path"); !path.empty()) {
      const auto other_name = archive_.find(path);
      if (!other_name) return home.file.refuse(item, fmt::format("there is no part '{}'", path));
      auto other = part(*other_name);
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
    const SlicerPart* const part = part_of(slicer, id);
    std::string own = object.node.attribute("name").value();
    if (part != nullptr && !part->name.empty()) own = slicer->name_of(*part);
    if (own.empty()) own = name;
    if (is_left_out(object, part, own)) return {};
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
    return add_object(*where, object, world, depth, own);
  }

  static const SlicerPart* part_of(const SlicerObject* slicer, std::string_view id) {
    if (slicer == nullptr) return nullptr;
    const auto found = slicer->parts.find(id);
    return found == slicer->parts.end() ? nullptr : &found->second;
  }
  /// What a slicer says of an object of the root model.
  const SlicerObject* slicer_object(const ModelPart& home, const ModelObject& object) const {
    if (&home != root_) return nullptr;
    const auto found = settings_.find(std::string_view(object.node.attribute("id").value()));
    return found == settings_.end() ? nullptr : &found->second;
  }
  /// Whether an object is no solid. Remembers it then.
  bool is_left_out(const ModelObject& object, const SlicerPart* part, const std::string& name) {
    const std::string_view type = object.node.attribute("type").value();
    std::string kind;
    if (type == "support" || type == "solidsupport" || type == "other") kind = type;
    if (part != nullptr && !part->not_solid.empty()) kind = part->not_solid;
    if (kind.empty()) return false;
    left_out_.push_back(fmt::format(
        "'{}' ({})",
        printable(
            name.empty() ? fmt::format("object {}", object.node.attribute("id").value()) : name,
            40),
        kind));
    return true;
  }
  /// "2 objects are ...: 'brim' (support), 'hole' (modifier)".
  [[nodiscard]] std::string what_is_left_out(const char* one, const char* several) const {
    constexpr std::size_t kMost = 5;
    std::string text = fmt::format("{} {}: ", counted(left_out_.size(), "object"),
                                   left_out_.size() == 1 ? one : several);
    for (std::size_t i = 0; i < left_out_.size() && i < kMost; ++i) {
      text += (i == 0 ? "" : ", ") + left_out_[i];
    }
    if (left_out_.size() > kMost) text += fmt::format(" and {} more", left_out_.size() - kMost);
    return text;
  }

  Result<void> read_mesh_of(ModelPart& home, ModelObject& object, const pugi::xml_node& content) {
    LookFinder finder(object.node, home.properties);
    std::vector<std::uint32_t> elements;
    auto read =
        read_object_mesh(home.file, content, options_.attributes ? &finder : nullptr, elements);
    if (!read) return tl::unexpected(read.error());
    if (options_.attributes) finder.warn(home.file, model_.warnings);
    object.mesh = *std::move(read);
    const SlicerObject* const slicer = slicer_object(home, object);
    if (slicer != nullptr && !slicer->volumes.empty()) {
      divide(*slicer, elements, *object.mesh, left_out_);
    }
    return {};
  }

  Result<void> add_object(ModelPart& home, ModelObject& object, const glm::dmat4& world, int depth,
                          std::string name) {
    const SlicerObject* const slicer = slicer_object(home, object);
    if (name.empty() && slicer != nullptr) name = slicer->name;
    for (const pugi::xml_node& content : object.node.children()) {
      if (local_name(content) == "mesh") {
        if (!object.mesh) {
          if (auto read = read_mesh_of(home, object, content); !read) return read;
        }
        instances_.push_back(
            {&*object.mesh, world,
             name.empty() ? fmt::format("object {}", object.node.attribute("id").value()) : name});
      } else if (local_name(content) == "components") {
        object.is_open = true;
        for (const pugi::xml_node& component : content.children()) {
          if (local_name(component) != "component") continue;
          if (auto added = add(home, component, world, depth + 1, name, slicer); !added) {
            return added;
          }
        }
        object.is_open = false;
      }
    }
    return {};
  }

  Result<ArchiveModel> gather() {
    std::size_t positions = 0, triangles = 0;
    for (const Instance& instance : instances_) {
      positions += instance.mesh->soup.positions.size();
      triangles += instance.mesh->soup.triangles.size();
    }
    constexpr std::size_t kMostTriangles = 100'000'000;
    if (triangles > kMostTriangles || positions > kMostTriangles) {
      return fail(ErrorCode::kLimit,
                  "{}: the model has {} triangles and {} vertices in {} objects; the limit is {}",
                  archive_.path(), triangles, positions, instances_.size(), kMostTriangles);
    }
    if (triangles == 0 && !left_out_.empty()) {
      return fail(ErrorCode::kInput, "{}: no build item is a solid: {}", archive_.path(),
                  what_is_left_out("is no solid", "are no solids"));
    }
    if (triangles == 0) {
      return fail(ErrorCode::kInput, "{}: no build item has a triangle", archive_.path());
    }
    const std::size_t bytes = positions * sizeof(glm::dvec3) + triangles * sizeof(glm::uvec3);
    if (execution_.memory_limit != 0 && bytes > execution_.memory_limit) {
      return fail(ErrorCode::kLimit, "{}: the model needs {} bytes, but the memory limit is {}",
                  archive_.path(), bytes, execution_.memory_limit);
    }
    TriangleSoup& all = model_.soup;
    all.positions.reserve(positions);
    all.triangles.reserve(triangles);
    for (const Instance& instance : instances_) {
      if (execution_.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
      append(all, transform(instance.mesh->soup, instance.world));
      add_looks(instance);
    }
    for (const glm::dvec3& p : all.positions) {
      if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) continue;
      return fail(ErrorCode::kInput, "{}: its transforms give coordinates that are not finite",
                  archive_.path());
    }
    model_.attributes = looks_.finish();
    return std::move(model_);
  }

  /// Says what the triangles look like that were added last.
  void add_looks(const Instance& instance) {
    if (!options_.attributes && !options_.parts) return;
    const std::vector<glm::uvec3>& before = instance.mesh->soup.triangles;
    std::size_t begin = 0;
    for (const ObjectMesh::Volume& volume : instance.mesh->volumes) {
      looks_.begin_part(volume.name.empty() ? instance.name : volume.name);
      add_looks(instance, begin, volume.end);
      begin = volume.end;
    }
    if (begin < before.size()) looks_.begin_part(instance.name);
    add_looks(instance, begin, before.size());
  }
  void add_looks(const Instance& instance, std::size_t begin, std::size_t end) {
    const std::vector<glm::uvec3>& before = instance.mesh->soup.triangles;
    const std::vector<glm::uvec3>& after = model_.soup.triangles;
    if (!options_.attributes) return looks_.skip(end - begin);
    const std::size_t first = after.size() - before.size();
    const auto base = static_cast<std::uint32_t>(model_.soup.positions.size() -
                                                 instance.mesh->soup.positions.size());
    for (std::size_t t = begin; t < end; ++t) {
      looks_.add(instance.mesh->looks[t], after[first + t],
                 after[first + t].y != before[t].y + base);
    }
  }

  ZipArchive archive_;
  const ArchiveOptions& options_;
  const Execution& execution_;
  ArchiveModel model_;
  ModelLooks looks_;
  std::unordered_map<std::string, std::unique_ptr<ModelPart>> parts_;
  std::unordered_set<std::pair<const ModelObject*, std::array<double, 12>>, PlaceHash> placed_;
  std::vector<Instance> instances_;
  SlicerSettings settings_;
  const ModelPart* root_ = nullptr;
  std::vector<std::string> left_out_;  ///< objects that are no solids: "'brim' (support)"
};

}  // namespace

Result<ArchiveModel> read_3mf_model(const std::string& path, const ArchiveOptions& options,
                                    const Execution& execution) try {
  auto archive = ZipArchive::open(path);
  if (!archive) return tl::unexpected(archive.error());
  return Package(*std::move(archive), options, execution).assemble();
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "{}: out of memory", path);
}

}  // namespace strata

#else

namespace strata {

Result<ArchiveModel> read_3mf_model(const std::string& path, const ArchiveOptions&,
                                    const Execution&) {
  return fail(ErrorCode::kUsage, "{}: this build cannot read it (libpugixml-dev was missing)",
              path);
}

}  // namespace strata

#endif

namespace strata {

Result<TriangleSoup> read_3mf(const std::string& path, const Execution& execution) {
  auto model = read_3mf_model(path, {}, execution);
  if (!model) return tl::unexpected(model.error());
  return std::move(model->soup);
}

}  // namespace strata
