// Wavefront OBJ, and its colours as a library of materials (.mtl).

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <unordered_set>
#include <utility>

#include "mesh/writers/mesh_blocks.h"

namespace strata::detail {
namespace {

/// A name as one word: blanks would begin the next word.
std::string one_word(std::string_view name) {
  std::string word = one_line(name);
  std::replace(word.begin(), word.end(), ' ', '_');
  return word;
}

std::string material_name(const Colour& c) {
  return fmt::format("rgba_{:02x}{:02x}{:02x}{:02x}", c.r, c.g, c.b, c.a);
}

/// Numbers in [0, 1] with the fewest digits that give back the byte.
std::string channel(std::uint8_t value) { return fmt::format("{:.4g}", value / 255.0); }

std::string materials_text(const std::vector<Colour>& colours) {
  std::string text = "# written by strata\n";
  std::unordered_set<std::uint32_t> told;
  for (const Colour& c : colours) {
    if (!told.insert(packed(c)).second) continue;
    text += fmt::format("newmtl {}\nKd {} {} {}\n", material_name(c), channel(c.r), channel(c.g),
                        channel(c.b));
    if (c.a != 255) text += fmt::format("d {}\n", channel(c.a));
  }
  return text;
}

/// The triangles of each part, one part after the other, and where each part begins.
struct PartOrder {
  std::vector<std::uint32_t> triangles;
  std::vector<std::size_t> begins;
};

PartOrder order_by_part(const SolidMesh& mesh) {
  PartOrder order;
  order.begins.assign(mesh.parts.size() + 1, 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) ++order.begins[part_of(mesh, t) + 1];
  std::partial_sum(order.begins.begin(), order.begins.end(), order.begins.begin());
  order.triangles.resize(mesh.triangles.size());
  std::vector<std::size_t> next(order.begins.begin(), order.begins.end() - 1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    order.triangles[next[part_of(mesh, t)]++] = static_cast<std::uint32_t>(t);
  }
  return order;
}

}  // namespace

Result<void> write_solid_obj(const std::string& path, const SolidMesh& mesh,
                             const SolidWriteOptions& options, const Execution& execution) {
  std::vector<Colour> colours;
  if (!options.materials.empty()) colours = part_colours(mesh);
  Blocks blocks;
  std::string head = "# written by strata\n";
  if (!colours.empty()) {
    head +=
        fmt::format("mtllib {}\n", std::filesystem::path(options.materials).filename().string());
    Blocks materials;
    add_text(materials, materials_text(colours));
    if (auto written = write_blocks(options.materials, std::move(materials), {}); !written)
      return written;
  }
  add_text(blocks, std::move(head));
  add_ranges(blocks, mesh.positions.size(), kBlockElements,
             [&mesh](std::size_t first, std::size_t last, std::string& out) {
               for (std::size_t v = first; v < last; ++v) {
                 out += "v ";
                 add_vector(out, mesh.positions[v]);
                 out += '\n';
               }
             });
  const PartOrder order = order_by_part(mesh);
  for (std::size_t part = 0; part < mesh.parts.size(); ++part) {
    const std::size_t begin = order.begins[part], count = order.begins[part + 1] - begin;
    if (count == 0) continue;
    std::string group;
    if (mesh.parts.size() > 1 || !mesh.parts[part].name.empty()) {
      const std::string name = one_word(mesh.parts[part].name);
      group = fmt::format("g {}\n", name.empty() ? fmt::format("part_{}", part) : name);
    }
    if (!colours.empty()) group += fmt::format("usemtl {}\n", material_name(colours[part]));
    if (!group.empty()) add_text(blocks, std::move(group));
    add_ranges(blocks, count, kBlockElements,
               [&mesh, &order, begin](std::size_t first, std::size_t last, std::string& out) {
                 for (std::size_t i = first; i < last; ++i) {
                   const glm::uvec3& triangle = mesh.triangles[order.triangles[begin + i]];
                   out += 'f';
                   for (int k = 0; k < 3; ++k) {
                     out += ' ';
                     add_integer(out, std::uint64_t{triangle[k]} + 1);
                   }
                   out += '\n';
                 }
               });
  }
  return write_blocks(path, std::move(blocks), execution);
}

}  // namespace strata::detail
