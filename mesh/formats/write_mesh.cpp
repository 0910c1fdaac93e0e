#include "strata/mesh/formats/write_mesh.h"

#include <bit>
#include <charconv>
#include <cstring>
#include <glm/geometric.hpp>
#include <limits>
#include <new>

#include "core/atomic_file.h"

namespace strata {
namespace {

void add_number(std::string& out, double value) {
  char text[32];
  const auto result = std::to_chars(text, text + sizeof text, value);
  out.append(text, result.ptr);
}

void add_integer(std::string& out, std::uint64_t value) {
  char text[24];
  const auto result = std::to_chars(text, text + sizeof text, value);
  out.append(text, result.ptr);
}

void add_vertices(std::string& out, const TriangleSoup& mesh, std::string_view prefix) {
  for (const glm::dvec3& p : mesh.positions) {
    out += prefix;
    add_number(out, p.x);
    out += ' ';
    add_number(out, p.y);
    out += ' ';
    add_number(out, p.z);
    out += '\n';
  }
}

void add_faces(std::string& out, const TriangleSoup& mesh, std::string_view prefix,
               std::uint64_t base) {
  for (const glm::uvec3& t : mesh.triangles) {
    out += prefix;
    for (int k = 0; k < 3; ++k) {
      if (k != 0) out += ' ';
      add_integer(out, base + t[k]);
    }
    out += '\n';
  }
}

void add_little_endian(std::string& out, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(value >> shift & 0xff);
}

void add_floats(std::string& out, const glm::dvec3& v) {
  for (int k = 0; k < 3; ++k) {
    add_little_endian(out, std::bit_cast<std::uint32_t>(static_cast<float>(v[k])));
  }
}

std::string stl_bytes(const TriangleSoup& mesh) {
  std::string out("binary STL written by strata");  // the header must not begin with "solid"
  out.resize(80, ' ');
  out.reserve(84 + 50 * mesh.triangles.size());
  add_little_endian(out, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a = mesh.positions[t.x], b = mesh.positions[t.y], c = mesh.positions[t.z];
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const double length = glm::length(normal);
    add_floats(out, length > 0.0 ? normal / length : glm::dvec3(0.0));
    add_floats(out, a);
    add_floats(out, b);
    add_floats(out, c);
    out.append(2, '\0');
  }
  return out;
}

}  // namespace

std::string mesh_to_bytes(const TriangleSoup& mesh, MeshFormat format) {
  std::string out;
  switch (format) {
    case MeshFormat::kObj:
      add_vertices(out, mesh, "v ");
      add_faces(out, mesh, "f ", 1);
      break;
    case MeshFormat::kOff:
      out = fmt::format("OFF\n{} {} 0\n", mesh.positions.size(), mesh.triangles.size());
      add_vertices(out, mesh, "");
      add_faces(out, mesh, "3 ", 0);
      break;
    case MeshFormat::kPly:
      out = fmt::format(
          "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\n"
          "property double z\nelement face {}\nproperty list uchar uint vertex_indices\n"
          "end_header\n",
          mesh.positions.size(), mesh.triangles.size());
      add_vertices(out, mesh, "");
      add_faces(out, mesh, "3 ", 0);
      break;
    case MeshFormat::kStl:
      out = stl_bytes(mesh);
      break;
    case MeshFormat::kAuto:
    case MeshFormat::k3mf:
    case MeshFormat::kAmf:
    case MeshFormat::kGltf:
      break;
  }
  return out;
}

Result<void> write_mesh(const std::string& path, const TriangleSoup& mesh, MeshFormat format) {
  if (format == MeshFormat::kAuto) format = mesh_format_of(path);
  if (format == MeshFormat::kAuto || format == MeshFormat::k3mf || format == MeshFormat::kAmf ||
      format == MeshFormat::kGltf) {
    return fail(ErrorCode::kUsage, "{}: the format must be obj, stl, ply or off", path);
  }
  if (format == MeshFormat::kStl &&
      mesh.triangles.size() > std::numeric_limits<std::uint32_t>::max()) {
    return fail(ErrorCode::kLimit, "{}: STL holds at most 4294967295 triangles, the mesh has {}",
                path, mesh.triangles.size());
  }
  try {
    const std::string bytes = mesh_to_bytes(mesh, format);
    return write_file(path, bytes.data(), bytes.size());
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: not enough memory to write {} triangles", path,
                mesh.triangles.size());
  }
}

}  // namespace strata
