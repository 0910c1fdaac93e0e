#include "mesh/formats/plain_body.h"

#include "mesh/text/obj_lines.h"
#include "mesh/text/plain_lines.h"
#include "mesh/text/text_chunks.h"

namespace strata::detail {
namespace {

/// The lines of a piece of the body.
struct PlainChunk {
  std::vector<glm::dvec3> positions;
  std::vector<glm::uvec3> triangles;
  const char* faces_begin = nullptr;
  bool plain = true;

  void clear() {
    positions.clear();
    triangles.clear();
    faces_begin = nullptr;
    plain = true;
  }
};

const char* plain_face(const char* p, glm::uvec3& corners) {
  return p[0] == '3' && p[1] == ' ' ? plain_triangle(p + 2, corners) : nullptr;
}

void parse_plain(const char* p, const char* end, PlainChunk& chunk) {
  glm::dvec3 position;
  const char* next = nullptr;
  for (; p < end && (next = plain_vertex(p, position)) != nullptr; p = next) {
    chunk.positions.push_back(position);
  }
  chunk.faces_begin = p;
  glm::uvec3 corners;
  for (; p < end && (next = plain_face(p, corners)) != nullptr; p = next) {
    chunk.triangles.push_back(corners);
  }
  while (p < end && is_space(*p)) ++p;
  chunk.plain = p >= end;
}

/// Whether the first line is a plain vertex and the last one a plain triangle.
bool looks_plain(const char* begin, const char* end) {
  while (end > begin && is_space(end[-1])) --end;
  const char* last = end;
  while (last > begin && last[-1] != '\n') --last;
  glm::dvec3 position;
  glm::uvec3 corners;
  return plain_vertex(begin, position) != nullptr && plain_face(last, corners) != nullptr;
}

}  // namespace

const char* read_plain_body(const ReaderInput& input, const char* begin, std::uint64_t vertices,
                            std::uint64_t triangles, RawMesh& mesh) {
  const char* const end = input.text.data() + input.text.size();
  const auto left = static_cast<std::uint64_t>(end - begin);
  constexpr std::uint64_t kVertexBytes = 6, kFaceBytes = 8;  // "0 0 0", "3 0 1 2" and line ends
  if (vertices > left / kVertexBytes || triangles > left / kFaceBytes || vertices > kMaxVertices ||
      exceeds_limit(input.execution, vertices, triangles) || !looks_plain(begin, end)) {
    return nullptr;
  }
  TriangleSoup& soup = mesh.soup;
  reserve_large(soup.positions, vertices);
  reserve_large(soup.triangles, triangles);
  const char* faces_begin = nullptr;
  ChunksEnd chunks_end;
  const auto append = [&](PlainChunk& chunk) {
    const bool plain = chunk.plain && (chunk.positions.empty() || faces_begin == nullptr) &&
                       soup.positions.size() + chunk.positions.size() <= vertices &&
                       soup.triangles.size() + chunk.triangles.size() <= triangles;
    chunks_end.over_limit = !plain;  // no further piece is read
    if (!plain) return;
    if (faces_begin == nullptr && !chunk.triangles.empty()) faces_begin = chunk.faces_begin;
    soup.positions.insert(soup.positions.end(), chunk.positions.begin(), chunk.positions.end());
    soup.triangles.insert(soup.triangles.end(), chunk.triangles.begin(), chunk.triangles.end());
  };
  const std::string_view body(begin, static_cast<std::size_t>(end - begin));
  read_chunks<PlainChunk>(input, cut_statements(body, input.options.chunk_bytes), chunks_end,
                          parse_plain, append);
  if (chunks_end.early() || soup.positions.size() != vertices ||
      soup.triangles.size() != triangles) {
    soup = {};
    return nullptr;
  }
  mesh.stats.faces = triangles;
  return faces_begin;
}

}  // namespace strata::detail
