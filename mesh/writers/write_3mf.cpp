// 3MF: 3MF Consortium, "3MF Core Specification" 1.3 and "Materials and Properties Extension" 1.2.
// docs/decisions/07-parts-and-colours-of-meshes.md says what parts and colours become.

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/markup.h"
#include "core/split_mix.h"
#include "mesh/writers/mesh_blocks.h"
#include "mesh/writers/zip_output.h"

namespace strata::detail {
namespace {

constexpr const char* kContentTypes =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
)";

constexpr const char* kRelationships =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
)";

constexpr const char* kUnits[] = {"micron", "millimeter", "centimeter", "meter", "inch", "foot"};

/// For each part, 0 where it is closed by itself: each edge is used as often in one direction as in
/// the other. Edges are summed as numbers that a hash makes of them, added in one direction and
/// subtracted in the other: an open part passes by chance once in 2^64. The sum of parts that are
/// closed together is 0.
std::vector<std::uint64_t> edge_sums(const SolidMesh& mesh) {
  std::vector<std::uint64_t> sums(mesh.parts.size(), 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    std::uint64_t& sum = sums[part_of(mesh, t)];
    for (int k = 0; k < 3; ++k) {
      const std::uint64_t a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
      sum += a < b ? split_mix(a << 32 | b) : 0 - split_mix(b << 32 | a);
    }
  }
  return sums;
}

constexpr std::uint32_t kNoObject = std::numeric_limits<std::uint32_t>::max();

/// For each part, the first of the parts that are an object with it; kNoObject where it is a part
/// of what is left over. Parts that are not closed by themselves are an object where all of one
/// name are closed together: the colours of one part of a file.
std::vector<std::uint32_t> objects_of_parts(const SolidMesh& mesh) {
  const std::vector<std::uint64_t> sums = edge_sums(mesh);
  std::vector<std::uint32_t> objects(sums.size(), kNoObject);
  struct Named {
    std::uint64_t sum = 0;
    std::uint32_t first = kNoObject;
  };
  std::unordered_map<std::string_view, Named> named;
  for (std::uint32_t part = 0; part < sums.size(); ++part) {
    if (sums[part] == 0) {
      objects[part] = part;
    } else if (!mesh.parts[part].name.empty()) {
      Named& together = named[mesh.parts[part].name];
      together.sum += sums[part];
      together.first = std::min(together.first, part);
    }
  }
  for (std::uint32_t part = 0; part < sums.size(); ++part) {
    const auto together = named.find(mesh.parts[part].name);
    if (objects[part] != kNoObject || together == named.end()) continue;
    if (together->second.sum == 0) objects[part] = together->second.first;
  }
  return objects;
}

/// An <object> of the file: some triangles of the mesh, with the vertices they use.
struct Object {
  std::string name;
  std::uint32_t part = 0;               ///< whose colour the object has
  bool mixed = false;                   ///< its triangles are of several parts
  std::vector<std::uint32_t> vertices;  ///< of the mesh
  std::vector<std::uint32_t> sources;   ///< the triangles of the mesh
  std::vector<glm::uvec3> triangles;    ///< the same, as indices into `vertices`
};

/// What is closed is an object. All else is one object together. Without their vertices.
std::vector<Object> objects_of(const SolidMesh& mesh) {
  const std::vector<std::uint32_t> groups = objects_of_parts(mesh);
  std::vector<Object> objects;
  std::vector<std::uint32_t> object_of(mesh.parts.size(), kNoObject);  // of the groups
  std::uint32_t rest = kNoObject;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t part = part_of(mesh, t), group = groups[part];
    std::uint32_t& place = group == kNoObject ? rest : object_of[group];
    if (place == kNoObject) {
      place = static_cast<std::uint32_t>(objects.size());
      objects.push_back({mesh.parts[part].name, part, false, {}, {}, {}});
    }
    Object& object = objects[place];
    object.mixed = object.mixed || object.part != part;
    if (object.mixed && group == kNoObject) object.name.clear();
    object.sources.push_back(static_cast<std::uint32_t>(t));
  }
  return objects;
}

/// Gives each object vertices of its own, in the order of the mesh's.
void number_vertices(const SolidMesh& mesh, std::vector<Object>& objects) {
  std::vector<std::uint32_t> place(mesh.positions.size(), 0);
  std::vector<std::uint32_t> object_of(mesh.positions.size(), 0);  // 0: none, else the object + 1
  for (std::size_t o = 0; o < objects.size(); ++o) {
    Object& object = objects[o];
    const auto mark = static_cast<std::uint32_t>(o + 1);
    for (const std::uint32_t t : object.sources) {
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t vertex = mesh.triangles[t][k];
        if (object_of[vertex] == mark) continue;
        object_of[vertex] = mark;
        object.vertices.push_back(vertex);
      }
    }
    std::sort(object.vertices.begin(), object.vertices.end());
    for (std::size_t i = 0; i < object.vertices.size(); ++i) {
      place[object.vertices[i]] = static_cast<std::uint32_t>(i);
    }
    for (const std::uint32_t t : object.sources) {
      const glm::uvec3& triangle = mesh.triangles[t];
      object.triangles.emplace_back(place[triangle.x], place[triangle.y], place[triangle.z]);
    }
  }
}

/// The different colours of the parts, and which of them each part has.
struct Palette {
  std::vector<Colour> colours;
  std::vector<std::uint32_t> colour_of;  ///< each part; empty: the file has no colours
};

Palette palette_of(const SolidMesh& mesh) {
  Palette palette;
  std::unordered_map<std::uint32_t, std::uint32_t> places;
  for (const Colour& colour : part_colours(mesh)) {
    const auto [known, is_new] =
        places.try_emplace(packed(colour), static_cast<std::uint32_t>(palette.colours.size()));
    palette.colour_of.push_back(known->second);
    if (is_new) palette.colours.push_back(colour);
  }
  return palette;
}

/// The extruder of each colour, as PrusaSlicer marks triangles that were painted: its splits of a
/// triangle, of which there are none, and the number of the extruder in hexadecimal digits, the
/// lowest first. Empty: one colour, or more than it has extruders.
std::string painted(const Palette& palette, std::uint32_t colour) {
  constexpr std::size_t kMostExtruders = 16;
  if (palette.colours.size() < 2 || palette.colours.size() > kMostExtruders) return "";
  const std::uint32_t extruder = colour + 1;
  return fmt::format(" slic3rpe:mmu_segmentation=\"{}\"", extruder < 3
                                                              ? fmt::format("{}", 4 * extruder)
                                                              : fmt::format("{:X}C", extruder - 3));
}

constexpr int kPalette = 1;      ///< id of the group of colours
constexpr int kFirstObject = 2;  ///< ids of objects follow

/// Up to the first object. Slicers look for "m:colorgroup" in this spelling, and for capital
/// digits.
std::string model_head(const Palette& palette, LengthUnit unit) {
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"{}\" xml:lang=\"en-US\" "
      "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\"{}>\n"
      "<metadata name=\"Application\">strata</metadata>\n<resources>\n",
      kUnits[static_cast<std::size_t>(unit)],
      palette.colours.empty()
          ? ""
          : " xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\" "
            "xmlns:slic3rpe=\"http://schemas.slic3r.org/3mf/2017/06\"");
  if (palette.colours.empty()) return text;
  text += fmt::format("<m:colorgroup id=\"{}\">\n", kPalette);
  for (const Colour& c : palette.colours) {
    text += fmt::format("<m:color color=\"#{:02X}{:02X}{:02X}{:02X}\"/>\n", c.r, c.g, c.b, c.a);
  }
  return text + "</m:colorgroup>\n";
}

/// What stands behind the corners of a triangle, for each colour of the palette.
class TriangleEnds {
 public:
  explicit TriangleEnds(const Palette& palette) : colour_of_(palette.colour_of) {
    for (std::uint32_t colour = 0; colour < palette.colours.size(); ++colour) {
      const std::string paint = painted(palette, colour);
      plain_.push_back(fmt::format("\"{}/>\n", paint));
      mixed_.push_back(fmt::format("\" pid=\"{}\" p1=\"{}\"{}/>\n", kPalette, colour, paint));
    }
  }
  [[nodiscard]] std::string_view of(const Object& object, std::uint32_t part) const {
    if (colour_of_.empty()) return "\"/>\n";
    return (object.mixed ? mixed_ : plain_)[colour_of_[part]];
  }

 private:
  const std::vector<std::uint32_t>& colour_of_;
  std::vector<std::string> plain_, mixed_;
};

void add_object(Blocks& blocks, const SolidMesh& mesh, const Object& object, int id,
                const Palette& palette, const TriangleEnds& ends) {
  std::string head = fmt::format("<object id=\"{}\" type=\"model\"", id);
  if (!object.name.empty())
    head += fmt::format(" name=\"{}\"", escape_markup(one_line(object.name)));
  if (!palette.colours.empty()) {
    head += fmt::format(" pid=\"{}\" pindex=\"{}\"", kPalette, palette.colour_of[object.part]);
  }
  add_text(blocks, head + ">\n<mesh>\n<vertices>\n");
  const bool whole = object.triangles.empty();  // the object is all of the mesh
  add_ranges(blocks, whole ? mesh.positions.size() : object.vertices.size(), kBlockElements,
             [&mesh, &object, whole](std::size_t first, std::size_t last, std::string& out) {
               constexpr const char* kAxes[] = {"<vertex x=\"", "\" y=\"", "\" z=\""};
               for (std::size_t v = first; v < last; ++v) {
                 const glm::dvec3& p = mesh.positions[whole ? v : object.vertices[v]];
                 for (int k = 0; k < 3; ++k) {
                   out += kAxes[k];
                   add_number(out, p[k]);
                 }
                 out += "\"/>\n";
               }
             });
  add_text(blocks, "</vertices>\n<triangles>\n");
  add_ranges(blocks, object.sources.size(), kBlockElements,
             [&mesh, &object, &ends, whole](std::size_t first, std::size_t last, std::string& out) {
               constexpr const char* kCorners[] = {"<triangle v1=\"", "\" v2=\"", "\" v3=\""};
               for (std::size_t i = first; i < last; ++i) {
                 const std::uint32_t source = object.sources[i];
                 const glm::uvec3& t = whole ? mesh.triangles[source] : object.triangles[i];
                 for (int k = 0; k < 3; ++k) {
                   out += kCorners[k];
                   add_integer(out, t[k]);
                 }
                 out += ends.of(object, part_of(mesh, source));
               }
             });
  add_text(blocks, "</triangles>\n</mesh>\n</object>\n");
}

/// Several objects are components of one, so that slicers keep them where they are.
std::string model_end(std::size_t objects) {
  std::string text;
  int id = kFirstObject;
  if (objects > 1) {
    id += static_cast<int>(objects);
    text = fmt::format("<object id=\"{}\" type=\"model\">\n<components>\n", id);
    for (std::size_t o = 0; o < objects; ++o) {
      text += fmt::format("<component objectid=\"{}\"/>\n", kFirstObject + static_cast<int>(o));
    }
    text += "</components>\n</object>\n";
  }
  return text +
         fmt::format("</resources>\n<build>\n<item objectid=\"{}\"/>\n</build>\n</model>\n", id);
}

}  // namespace

Result<void> write_solid_3mf(const std::string& path, const SolidMesh& mesh,
                             const SolidWriteOptions& options, const Execution& execution) {
  std::vector<Object> objects = objects_of(mesh);
  if (objects.size() > 1) number_vertices(mesh, objects);
  const Palette palette = palette_of(mesh);
  const TriangleEnds ends(palette);
  std::vector<ZipMember> members(3);
  members[0].name = "[Content_Types].xml";
  add_text(members[0].blocks, kContentTypes);
  members[1].name = "_rels/.rels";
  add_text(members[1].blocks, kRelationships);
  members[2].name = "3D/3dmodel.model";
  Blocks& model = members[2].blocks;
  add_text(model, model_head(palette, options.unit));
  for (std::size_t o = 0; o < objects.size(); ++o) {
    add_object(model, mesh, objects[o], kFirstObject + static_cast<int>(o), palette, ends);
  }
  add_text(model, model_end(objects.size()));
  return write_zip(path, std::move(members), execution);
}

}  // namespace strata::detail
