// This work is based on: ISO/ASTM 52915, "Specification for Additive Manufacturing File Format".
#include "mesh/archives/read_3mf_amf.h"

#ifdef STRATA_HAVE_PUGIXML

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <map>
#include <new>
#include <optional>
#include <utility>
#include <vector>

#include "mesh/archives/model_looks.h"
#include "mesh/archives/xml_mesh.h"
#include "mesh/archives/zip_entry.h"
#include "mesh/text/input_bytes.h"

namespace strata {
namespace {

using namespace detail;

using AmfColour = std::optional<glm::u8vec4>;

/// The <color> of an element: red, green, blue and perhaps alpha, from 0 to 1. Formulas give none.
AmfColour amf_colour(const pugi::xml_node& owner) {
  const pugi::xml_node node = child(owner, "color");
  if (!node) return std::nullopt;
  glm::u8vec4 colour(255);
  const char* const channels[] = {"r", "g", "b", "a"};
  for (int i = 0; i < 4; ++i) {
    const pugi::xml_node channel = child(node, channels[i]);
    if (i == 3 && !channel) break;
    const auto number = read_number(channel.text().get());
    if (!number) return std::nullopt;
    colour[i] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(*number, 0.0, 1.0)));
  }
  return colour;
}

std::string amf_name(const pugi::xml_node& owner) {
  for (const pugi::xml_node& node : owner.children()) {
    if (local_name(node) != "metadata") continue;
    if (std::string_view(node.attribute("type").value()) == "name") return node.text().get();
  }
  return {};
}

class AmfReader {
 public:
  AmfReader(const XmlMesh& file, const ArchiveOptions& options) : file_(file), options_(options) {}

  Result<ArchiveModel> read() {
    model_.unit_metres = unit_of(file_, model_.warnings);
    if (options_.attributes) read_materials();
    for (const pugi::xml_node& object : file_.root().children()) {
      if (local_name(object) != "object") continue;
      if (file_.stopped()) return fail(ErrorCode::kCancelled, "stopped");
      if (auto done = read_object(object); !done) return tl::unexpected(done.error());
    }
    if (model_.soup.triangles.empty()) {
      return fail(ErrorCode::kInput, "{}: no object has a triangle", file_.path());
    }
    model_.attributes = looks_.finish();
    return std::move(model_);
  }

 private:
  void read_materials() {
    std::vector<SurfaceMaterial>& all = looks_.attributes.materials;
    for (const pugi::xml_node& node : file_.root().children()) {
      if (local_name(node) != "material") continue;
      SurfaceMaterial material;
      material.name = amf_name(node);
      if (const AmfColour colour = amf_colour(node)) {
        material.colour = glm::vec4(*colour) / 255.0f;
        material.coloured = true;
      }
      materials_.emplace(node.attribute("id").value(), static_cast<std::uint32_t>(all.size()));
      all.push_back(std::move(material));
    }
  }

  Result<void> read_object(const pugi::xml_node& object) {
    const pugi::xml_node mesh = child(object, "mesh");
    const std::size_t first = model_.soup.positions.size();
    if (auto done = read_vertices(child(mesh, "vertices")); !done) return done;
    std::string name = amf_name(object);
    if (name.empty()) name = fmt::format("object {}", object.attribute("id").value());
    const AmfColour colour = options_.attributes ? amf_colour(object) : std::nullopt;
    for (const pugi::xml_node& volume : mesh.children()) {
      if (local_name(volume) != "volume") continue;
      const std::string own = amf_name(volume);
      looks_.begin_part(own.empty() ? name : own);
      if (auto done = read_volume(volume, colour, first); !done) return done;
    }
    return {};
  }

  Result<void> read_vertices(const pugi::xml_node& vertices) {
    vertex_colours_.clear();
    bool any = false;
    for (const pugi::xml_node& vertex : vertices.children()) {
      if (local_name(vertex) != "vertex") continue;
      const pugi::xml_node place = child(vertex, "coordinates");
      if (file_.stopped()) return fail(ErrorCode::kCancelled, "stopped");
      glm::dvec3 p;
      const char* const axes[] = {"x", "y", "z"};
      for (int i = 0; i < 3; ++i) {
        const auto number = read_number(child(place, axes[i]).text().get());
        if (!number) return file_.refuse(vertex, fmt::format("a vertex has no valid {}", axes[i]));
        p[i] = *number;
      }
      model_.soup.positions.push_back(p);
      if (!options_.attributes) continue;
      vertex_colours_.push_back(amf_colour(vertex));
      any = any || vertex_colours_.back();
    }
    if (!any) vertex_colours_.clear();
    return {};
  }

  Result<void> read_volume(const pugi::xml_node& volume, AmfColour colour, std::size_t first) {
    TriangleSoup& soup = model_.soup;
    if (const AmfColour own = options_.attributes ? amf_colour(volume) : std::nullopt) colour = own;
    const auto material = materials_.find(std::string_view(volume.attribute("materialid").value()));
    for (const pugi::xml_node& triangle : volume.children()) {
      if (local_name(triangle) != "triangle") continue;
      const std::string_view texts[] = {child(triangle, "v1").text().get(),
                                        child(triangle, "v2").text().get(),
                                        child(triangle, "v3").text().get()};
      const auto added = file_.add_triangle(soup, triangle, texts, first);
      if (!added) return tl::unexpected(added.error());
      if (!*added) continue;
      if (!options_.attributes) {
        if (options_.parts) looks_.skip(1);
        continue;
      }
      TriangleLook look;
      if (material != materials_.end()) look.material = material->second;
      paint(look, amf_colour(triangle), colour, soup.triangles.back(), first);
      looks_.add(look, soup.triangles.back(), false);
    }
    return {};
  }

  /// The colour of the triangle counts, else those of its vertices, else that of the volume or
  /// object, else the material's.
  void paint(TriangleLook& look, const AmfColour& own, const AmfColour& around,
             const glm::uvec3& triangle, std::size_t first) const {
    const auto of_vertex = [&](int i) -> AmfColour {
      if (own) return own;
      if (vertex_colours_.empty()) return around;
      const AmfColour& colour = vertex_colours_[triangle[i] - first];
      return colour ? colour : around;
    };
    for (int i = 0; i < 3; ++i) look.coloured = look.coloured || of_vertex(i);
    if (!look.coloured) return;
    glm::u8vec4 other(255);
    if (look.material != MeshAttributes::kNone) {
      other = glm::u8vec4(glm::round(looks_.attributes.materials[look.material].colour * 255.0f));
    }
    for (int i = 0; i < 3; ++i) {
      look.colours[static_cast<std::size_t>(i)] = of_vertex(i).value_or(other);
    }
    look.material = MeshAttributes::kNone;
  }

  const XmlMesh& file_;
  const ArchiveOptions& options_;
  std::map<std::string, std::uint32_t, std::less<>> materials_;  // by id
  std::vector<AmfColour> vertex_colours_;                        // of the object; or empty
  ArchiveModel model_;
  ModelLooks looks_;
};

/// The text of a file, plain or zipped.
Result<std::string> amf_text(const std::string& path, const Execution& execution) {
  {
    auto bytes = InputBytes::open(path, 0);
    if (!bytes) return tl::unexpected(bytes.error());
    if (!bytes->view().empty() && !bytes->view().starts_with("PK")) {
      return std::string(bytes->view());
    }
  }
  auto archive = ZipArchive::open(path);
  if (!archive) return tl::unexpected(archive.error());
  const auto& names = archive->names();
  const auto first = std::find_if(names.begin(), names.end(),
                                  [](const std::string& at) { return !at.ends_with('/'); });
  if (first == names.end()) return fail(ErrorCode::kInput, "{}: the archive is empty", path);
  return archive->read(*first, execution);
}

}  // namespace

Result<ArchiveModel> read_amf_model(const std::string& path, const ArchiveOptions& options,
                                    const Execution& execution) try {
  auto text = amf_text(path, execution);
  if (!text) return tl::unexpected(text.error());
  XmlMesh file(path, *std::move(text), execution.stop);
  if (auto parsed = file.parse(); !parsed) return tl::unexpected(parsed.error());
  return AmfReader(file, options).read();
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "{}: out of memory", path);
}

}  // namespace strata

#else

namespace strata {

Result<ArchiveModel> read_amf_model(const std::string& path, const ArchiveOptions& options,
                                    const Execution& execution) {
  return read_3mf_model(path, options, execution);  // says what is missing
}

}  // namespace strata

#endif

namespace strata {

Result<TriangleSoup> read_amf(const std::string& path, const Execution& execution) {
  auto model = read_amf_model(path, {}, execution);
  if (!model) return tl::unexpected(model.error());
  return std::move(model->soup);
}

}  // namespace strata
