#include "strata/mesh/writers/write_solid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <new>
#include <optional>
#include <stdexcept>
#include <utility>

#include "mesh/writers/mesh_blocks.h"

namespace strata {
namespace {

using namespace detail;

struct NamedFormat {
  SolidFormat format;
  const char* name;
};
constexpr NamedFormat kFormats[] = {{SolidFormat::k3mf, "3mf"},
                                    {SolidFormat::kStl, "stl"},
                                    {SolidFormat::kObj, "obj"},
                                    {SolidFormat::kPly, "ply"},
                                    {SolidFormat::kOff, "off"}};

/// A sentence about the first fault of a mesh that no file may have.
std::optional<std::string> fault_of(const SolidMesh& mesh, bool as_floats) {
  if (mesh.triangles.empty()) return "the mesh has no triangle";
  if (mesh.parts.empty()) return "the mesh has no part";
  if (!mesh.part_of.empty() && mesh.part_of.size() != mesh.triangles.size()) {
    return fmt::format("the mesh has {} triangles, but names the parts of {}",
                       mesh.triangles.size(), mesh.part_of.size());
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const glm::uvec3& triangle = mesh.triangles[t];
    const std::uint32_t most = std::max({triangle.x, triangle.y, triangle.z});
    if (most >= mesh.positions.size()) {
      return fmt::format("triangle {} refers to vertex {}, the mesh has {}", t, most,
                         mesh.positions.size());
    }
    if (part_of(mesh, t) >= mesh.parts.size()) {
      return fmt::format("triangle {} belongs to part {}, the mesh has {}", t, part_of(mesh, t),
                         mesh.parts.size());
    }
  }
  const double most =
      as_floats ? std::numeric_limits<float>::max() : std::numeric_limits<double>::max();
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    for (int k = 0; k < 3; ++k) {
      const double value = mesh.positions[v][k];
      if (std::abs(value) <= most) continue;
      return fmt::format("coordinate {} of vertex {} is not a finite {}", value, v,
                         as_floats ? "float" : "number");
    }
  }
  return {};
}

void add_floats(std::string& out, const glm::dvec3& v) {
  for (int k = 0; k < 3; ++k) add_bytes(out, static_cast<float>(v[k]));
}

Result<void> write_stl(const std::string& path, const SolidMesh& mesh, const Execution& execution) {
  if (mesh.triangles.size() > std::numeric_limits<std::uint32_t>::max()) {
    return fail(ErrorCode::kLimit, "{}: STL holds at most 4294967295 triangles, the mesh has {}",
                path, mesh.triangles.size());
  }
  std::string header("binary STL written by strata");  // it must not begin with "solid"
  header.resize(80, ' ');
  add_bytes(header, static_cast<std::uint32_t>(mesh.triangles.size()));
  Blocks blocks;
  add_text(blocks, std::move(header));
  add_ranges(blocks, mesh.triangles.size(), kBlockElements,
             [&mesh](std::size_t first, std::size_t last, std::string& out) {
               out.reserve(50 * (last - first));
               for (std::size_t t = first; t < last; ++t) {
                 const glm::uvec3& triangle = mesh.triangles[t];
                 const glm::dvec3 &a = mesh.positions[triangle.x], &b = mesh.positions[triangle.y],
                                  &c = mesh.positions[triangle.z];
                 const glm::dvec3 normal = glm::cross(b - a, c - a);
                 const double length = glm::length(normal);
                 const bool has_length = length > 0.0 && std::isfinite(length);
                 add_floats(out, has_length ? normal / length : glm::dvec3(0.0));
                 add_floats(out, a);
                 add_floats(out, b);
                 add_floats(out, c);
                 add_bytes(out, std::uint16_t{0});
               }
             });
  return write_blocks(path, std::move(blocks), execution);
}

Result<void> write_ply(const std::string& path, const SolidMesh& mesh, const Execution& execution) {
  const std::vector<Colour> colours = part_colours(mesh);
  const bool in_parts = mesh.parts.size() > 1;
  std::string header = "ply\nformat binary_little_endian 1.0\ncomment written by strata\n";
  for (std::size_t part = 0; in_parts && part < mesh.parts.size(); ++part) {
    header += fmt::format("comment part {}: {}\n", part, one_line(mesh.parts[part].name));
  }
  header += fmt::format(
      "element vertex {}\nproperty double x\nproperty double y\nproperty double z\n"
      "element face {}\nproperty list uchar uint vertex_indices\n",
      mesh.positions.size(), mesh.triangles.size());
  if (!colours.empty()) {
    header +=
        "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n";
  }
  if (in_parts) header += "property uint part\n";
  header += "end_header\n";
  Blocks blocks;
  add_text(blocks, std::move(header));
  add_ranges(blocks, mesh.positions.size(), kBlockElements,
             [&mesh](std::size_t first, std::size_t last, std::string& out) {
               for (std::size_t v = first; v < last; ++v) {
                 for (int k = 0; k < 3; ++k) add_bytes(out, mesh.positions[v][k]);
               }
             });
  add_ranges(blocks, mesh.triangles.size(), kBlockElements,
             [&mesh, &colours, in_parts](std::size_t first, std::size_t last, std::string& out) {
               for (std::size_t t = first; t < last; ++t) {
                 add_bytes(out, std::uint8_t{3});
                 for (int k = 0; k < 3; ++k) add_bytes(out, mesh.triangles[t][k]);
                 const std::uint32_t part = part_of(mesh, t);
                 for (int k = 0; !colours.empty() && k < 4; ++k) add_bytes(out, colours[part][k]);
                 if (in_parts) add_bytes(out, part);
               }
             });
  return write_blocks(path, std::move(blocks), execution);
}

Result<void> write_off(const std::string& path, const SolidMesh& mesh, const Execution& execution) {
  std::vector<std::string> ends(mesh.parts.size(), "\n");  // of a face's line, for each part
  const std::vector<Colour> colours = part_colours(mesh);
  for (std::size_t part = 0; part < colours.size(); ++part) {
    const Colour& c = colours[part];
    ends[part] = c.a == 255 ? fmt::format(" {} {} {}\n", c.r, c.g, c.b)
                            : fmt::format(" {} {} {} {}\n", c.r, c.g, c.b, c.a);
  }
  Blocks blocks;
  add_text(blocks, fmt::format("OFF\n{} {} 0\n", mesh.positions.size(), mesh.triangles.size()));
  add_ranges(blocks, mesh.positions.size(), kBlockElements,
             [&mesh](std::size_t first, std::size_t last, std::string& out) {
               for (std::size_t v = first; v < last; ++v) {
                 add_vector(out, mesh.positions[v]);
                 out += '\n';
               }
             });
  add_ranges(blocks, mesh.triangles.size(), kBlockElements,
             [&mesh, &ends](std::size_t first, std::size_t last, std::string& out) {
               for (std::size_t t = first; t < last; ++t) {
                 out += '3';
                 for (int k = 0; k < 3; ++k) {
                   out += ' ';
                   add_integer(out, mesh.triangles[t][k]);
                 }
                 out += ends[part_of(mesh, t)];
               }
             });
  return write_blocks(path, std::move(blocks), execution);
}

Result<void> write_as(SolidFormat format, const std::string& path, const SolidMesh& mesh,
                      const SolidWriteOptions& options, const Execution& execution) {
  switch (format) {
    case SolidFormat::k3mf:
      return write_solid_3mf(path, mesh, options, execution);
    case SolidFormat::kStl:
      return write_stl(path, mesh, execution);
    case SolidFormat::kObj:
      return write_solid_obj(path, mesh, options, execution);
    case SolidFormat::kPly:
      return write_ply(path, mesh, execution);
    case SolidFormat::kOff:
      return write_off(path, mesh, execution);
    case SolidFormat::kAuto:
      break;
  }
  return fail(ErrorCode::kUsage, "{}: the format must be 3mf, stl, obj, ply or off", path);
}

}  // namespace

SolidFormat solid_format_of(std::string_view path) {
  const std::size_t dot = path.find_last_of("./");
  if (dot == std::string_view::npos || path[dot] != '.') return SolidFormat::kAuto;
  std::string extension(path.substr(dot + 1));
  for (char& letter : extension) {
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
  }
  for (const NamedFormat& known : kFormats) {
    if (extension == known.name) return known.format;
  }
  return SolidFormat::kAuto;
}

const char* solid_format_name(SolidFormat format) {
  for (const NamedFormat& known : kFormats) {
    if (known.format == format) return known.name;
  }
  return "auto";
}

Result<void> write_solid(const std::string& path, const SolidMesh& mesh,
                         const SolidWriteOptions& options, const Execution& execution) {
  SolidFormat format = options.format;
  if (format == SolidFormat::kAuto) format = solid_format_of(path);
  if (const auto fault = fault_of(mesh, format == SolidFormat::kStl)) {
    return fail(ErrorCode::kGeometry, "{}: {}", path, *fault);
  }
  try {
    return write_as(format, path, mesh, options, execution);
  } catch (const std::bad_alloc&) {
  } catch (const std::length_error&) {
  }
  return fail(ErrorCode::kLimit, "{}: not enough memory to write {} triangles", path,
              mesh.triangles.size());
}

}  // namespace strata
