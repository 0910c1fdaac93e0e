#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/read_mesh.h"

namespace strata {

/// Aborts unless `condition` holds, so that a fuzzer notices.
inline void must(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "violated: %s\n", what);
  std::abort();
}

/// Reads the bytes; what comes back must keep every promise of MeshFile.
inline int fuzz_reader(MeshFormat format, const std::uint8_t* data, std::size_t size) {
  MeshReadOptions options;
  options.format = format;
  Execution execution;
  execution.threads = 1;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto file = parse_mesh(bytes, "input", options, execution);
  // In pieces of a few bytes it must be the same.
  options.chunk_bytes = 9;
  const auto pieces = parse_mesh(bytes, "input", options, execution);
  must(file.has_value() == pieces.has_value(), "pieces are read or refused as the whole");
  if (!file) {
    must(file.error().message == pieces.error().message, "pieces are refused for the same reason");
    must(file.error().code == ErrorCode::kInput, "a refusal is kInput");
    must(file.error().message.starts_with("input"), "a refusal names the file");
    return 0;
  }
  const TriangleSoup& soup = file->soup;
  must(soup.positions == pieces->soup.positions && soup.triangles == pieces->soup.triangles &&
           soup.face_elements == pieces->soup.face_elements,
       "pieces make the same mesh");
  must(!soup.triangles.empty(), "a mesh has triangles");
  must(soup.triangles.size() == file->stats.triangles, "triangles are counted");
  must(soup.positions.size() == file->stats.vertices, "vertices are counted");
  must(soup.face_elements.empty() || soup.face_elements.size() == soup.triangles.size(),
       "every triangle has its element");
  for (const glm::uvec3& t : soup.triangles) {
    must(t.x < soup.positions.size() && t.y < soup.positions.size() && t.z < soup.positions.size(),
         "indices are in range");
    must(t.x != t.y && t.y != t.z && t.z != t.x, "corners differ");
  }
  for (const std::uint32_t element : soup.face_elements) {
    must(element < file->stats.faces, "elements are in range");
  }
  for (const glm::dvec3& p : soup.positions) {
    must(p.x - p.x == 0.0 && p.y - p.y == 0.0 && p.z - p.z == 0.0, "positions are finite");
  }
  must(diagnose(soup, execution).closed == is_closed(soup, execution), "both ways find it closed");
  return 0;
}

}  // namespace strata
