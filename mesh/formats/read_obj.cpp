#include <algorithm>
#include <limits>

#include "mesh/attributes/obj_attributes.h"
#include "mesh/formats/reader_common.h"
#include "mesh/text/obj_lines.h"
#include "mesh/text/plain_lines.h"
#include "mesh/text/text_chunks.h"
#include "mesh/text/text_scanner.h"

// The text is cut at line ends into chunks, which all threads parse. Finished chunks are appended
// in order. Face indices are absolute in OBJ, except negative ones, which count back from the last
// vertex read: only these need the number of vertices before their chunk.

namespace strata::detail {
namespace {

/// The contents of a chunk. The object is reused after its contents were appended.
struct Chunk {
  std::vector<glm::dvec3> positions;
  std::vector<glm::uvec3> triangles;
  std::vector<std::uint32_t> elements;  ///< of each triangle, within the chunk; empty: its index
  std::vector<std::size_t> relative;    ///< triangles with corners counted from the chunk's start
  std::vector<std::uint8_t> relative_corners;  ///< bits 0 to 2 mark those corners
  std::uint64_t faces = 0, short_faces = 0, first_short_face = 0, ignored = 0;
  std::size_t error_offset = ChunksEnd::kNone;
  std::string error;

  void clear() {
    positions.clear();
    triangles.clear();
    elements.clear();
    relative.clear();
    relative_corners.clear();
    faces = short_faces = first_short_face = ignored = 0;
  }
};

class ObjReader {
 public:
  explicit ObjReader(const ReaderInput& input)
      : input_(input), begin_(input.text.data()), end_(begin_ + input.text.size()) {}

  Result<MeshFile> read();

 private:
  void parse(const char* p, const char* end, Chunk& chunk) const;
  static const char* parse_plain(const char* p, Chunk& chunk);
  const char* parse_vertex(const char* p, Chunk& chunk) const;
  const char* parse_face(const char* p, Chunk& chunk) const;
  const char* fail_at(const char* p, Chunk& chunk, std::string message) const;
  void append(Chunk& chunk);
  void reserve();
  FacePlace locate(std::uint32_t element) const;

  const ReaderInput& input_;
  const char* begin_;
  const char* end_;
  std::vector<const char*> cuts_;  ///< chunk i is [cuts_[i], cuts_[i + 1])
  RawMesh mesh_;
  bool identity_ = true;
  ChunksEnd chunks_end_;
  std::int64_t vertex_total_ = 0;
};

const char* ObjReader::fail_at(const char* p, Chunk& chunk, std::string message) const {
  chunk.error_offset = static_cast<std::size_t>(p - begin_);
  chunk.error = std::move(message);
  return nullptr;
}

/// Reads the rest of the line of a triangle whose corners are `7/7`, `7//7` or `7/7/7`. @return the
/// next line; null for all else
const char* plain_corners(const char* p, glm::uvec3& corners) {
  for (int i = 0; i < 3; ++i) {
    while (*p == ' ') ++p;
    p = scanner::plain_index(p, corners[i]);
    if (p == nullptr) return nullptr;
    while (*p == '/') {
      std::uint32_t other = 0;
      if (*++p == '/') continue;
      p = scanner::plain_index(p, other);
      if (p == nullptr) return nullptr;
    }
    if (i < 2 && *p != ' ') return nullptr;
  }
  return behind_line(p);
}

/// Reads a plain line, as most lines are. @return the next line; null, with nothing changed, for
/// all else
const char* ObjReader::parse_plain(const char* p, Chunk& chunk) {
  if (p[0] == 'v' && p[1] == ' ') {
    glm::dvec3 position;
    const char* const next = plain_vertex(p + 2, position);
    if (next != nullptr) chunk.positions.push_back(position);
    return next;
  }
  if (p[0] != 'f' || p[1] != ' ') return nullptr;
  if (!chunk.elements.empty() || chunk.triangles.size() != chunk.faces) return nullptr;
  glm::uvec3 corners;
  const char* next = plain_triangle(p + 2, corners);
  if (next == nullptr) next = plain_corners(p + 2, corners);
  if (next == nullptr || corners.x == 0 || corners.y == 0 || corners.z == 0) return nullptr;
  chunk.triangles.push_back(corners - 1u);
  ++chunk.faces;
  return next;
}

const char* ObjReader::parse_vertex(const char* p, Chunk& chunk) const {
  glm::dvec3 position;
  for (int i = 0; i < 3; ++i) {
    p = skip_blanks_obj(p);
    const char* next = parse_double(p, position[i]);
    if (next == nullptr || !(ends_token(*next) || *next == '\\')) {
      return fail_at(p, chunk,
                     ends_token(*p) ? fmt::format("vertex has {} of 3 coordinates", i)
                                    : describe(p, end_) + " is not a number");
    }
    p = next;
  }
  chunk.positions.push_back(position);
  return p;
}

const char* ObjReader::parse_face(const char* p, Chunk& chunk) const {
  const std::size_t first_triangle = chunk.triangles.size();
  std::uint32_t corners[3] = {};
  unsigned relative = 0;  // the corners that count from the chunk's start
  std::size_t count = 0;
  for (;;) {
    p = skip_blanks_obj(p);
    if (*p == '\n' || *p == '\0' || *p == '#') break;
    std::int64_t index = 0;
    const char* next = parse_integer(p, index);
    if (next == nullptr || !(ends_token(*next) || *next == '/' || *next == '\\')) {
      return fail_at(p, chunk, describe(p, end_) + " is not a vertex of a face");
    }
    while (!ends_token(*next) && *next != '\\') ++next;  // skips indices of texture and normal
    if (*next == '\\' && next[1] != '\n' && next[1] != '\r') next = skip_token(next);
    p = next;

    std::uint32_t corner = kNoVertex;
    bool counted_back = false;
    if (index > 0 && index <= static_cast<std::int64_t>(kMaxVertices)) {
      corner = static_cast<std::uint32_t>(index - 1);
    } else if (index < 0 && index >= std::numeric_limits<std::int32_t>::min()) {
      // Modulo 2^32. append() adds the number of vertices before the chunk and checks for a wrap.
      corner =
          static_cast<std::uint32_t>(static_cast<std::int64_t>(chunk.positions.size()) + index);
      counted_back = true;
    }
    const unsigned slot = count < 2 ? static_cast<unsigned>(count) : 2u;
    if (count > 2) {
      corners[1] = corners[2];
      relative = (relative & 1u) | (relative >> 1 & 2u);
    }
    corners[slot] = corner;
    relative |= static_cast<unsigned>(counted_back) << slot;
    if (++count >= 3) {
      if (relative != 0) {
        chunk.relative.push_back(chunk.triangles.size());
        chunk.relative_corners.push_back(static_cast<std::uint8_t>(relative));
      }
      chunk.triangles.emplace_back(corners[0], corners[1], corners[2]);
    }
  }
  if (count < 3 && chunk.short_faces++ == 0) chunk.first_short_face = chunk.faces;
  if (chunk.elements.empty() && (count != 3 || first_triangle != chunk.faces)) {
    chunk.elements.resize(first_triangle);
    for (std::size_t i = 0; i < first_triangle; ++i) {
      chunk.elements[i] = static_cast<std::uint32_t>(i);
    }
  }
  if (!chunk.elements.empty() || first_triangle != chunk.faces || count != 3) {
    chunk.elements.resize(chunk.triangles.size(), static_cast<std::uint32_t>(chunk.faces));
  }
  ++chunk.faces;
  return p;
}

void ObjReader::parse(const char* p, const char* end, Chunk& chunk) const {
  while (p < end) {
    if (const char* next = parse_plain(p, chunk); next != nullptr) {
      p = next;
      continue;
    }
    p = skip_blanks(p);
    const bool short_word = *p != '\0' && (ends_token(p[1]) || p[1] == '\\');
    if (*p == 'v' && short_word) {
      p = parse_vertex(p + 1, chunk);
      if (p == nullptr) return;
      p = skip_statement(p, end);
    } else if ((*p == 'f' && short_word) || (*p == 'f' && p[1] == 'o' && is_blank(p[2]))) {
      p = parse_face(p + (short_word ? 1 : 2), chunk);
      if (p == nullptr) return;
      p = skip_statement(p, end);
    } else if ((*p == 'l' || *p == 'p') && short_word) {
      ++chunk.ignored;
      p = skip_statement(p, end);
    } else {
      // A comment is not continued: it may end in the backslash of a path.
      p = next_line(p, end);
    }
  }
}

/// Estimates the sizes from samples, so that the vectors are not copied as they grow.
void ObjReader::reserve() {
  constexpr std::size_t kSamples = 64, kSampleBytes = 2048;
  std::uint64_t vertices = 0, faces = 0, bytes = 0;
  const std::size_t step = std::max<std::size_t>(input_.text.size() / kSamples, kSampleBytes);
  for (std::size_t at = 0; at + kSampleBytes <= input_.text.size(); at += step) {
    const char* p = begin_ + at;
    const char* const stop = p + kSampleBytes;
    for (; p + 1 < stop; ++p) {
      if (*p != '\n') continue;
      vertices += p[1] == 'v' && p[2] == ' ';
      faces += p[1] == 'f';
    }
    bytes += kSampleBytes;
  }
  if (bytes == 0) return;
  const double scale = 1.1 * static_cast<double>(input_.text.size()) / static_cast<double>(bytes);
  const auto room = [&](std::uint64_t sampled, std::size_t least) {
    return std::min(static_cast<std::size_t>(static_cast<double>(sampled) * scale),
                    input_.text.size() / least);
  };
  // "v 0 0 0" and "f 1 2 3" with their line ends take 8 bytes.
  const std::size_t vertex_room = room(vertices, 8), face_room = room(faces, 8);
  if (exceeds_limit(input_.execution, vertex_room, face_room)) return;
  reserve_large(mesh_.soup.positions, vertex_room);
  reserve_large(mesh_.soup.triangles, face_room);
}

void ObjReader::append(Chunk& chunk) {
  TriangleSoup& soup = mesh_.soup;
  MeshReadStats& stats = mesh_.stats;
  if (chunk.error_offset != ChunksEnd::kNone) {
    chunks_end_.error_offset = chunk.error_offset;  // the chunk ends within a statement
    chunks_end_.error = std::move(chunk.error);
    return;
  }
  const std::uint64_t base = soup.positions.size();
  chunks_end_.over_limit = chunks_end_.over_limit || base + chunk.positions.size() > kMaxVertices ||
                           exceeds_limit(input_.execution, base + chunk.positions.size(),
                                         soup.triangles.size() + chunk.triangles.size());
  if (chunks_end_.over_limit) return;
  for (std::size_t i = 0; i < chunk.relative.size(); ++i) {
    glm::uvec3& triangle = chunk.triangles[chunk.relative[i]];
    for (int k = 0; k < 3; ++k) {
      if ((chunk.relative_corners[i] >> k & 1) == 0) continue;
      const std::int64_t corner =
          static_cast<std::int64_t>(base) + static_cast<std::int32_t>(triangle[k]);
      triangle[k] = corner >= 0 ? static_cast<std::uint32_t>(corner) : kNoVertex;
    }
  }
  if (identity_ && (!chunk.elements.empty() || soup.triangles.size() != stats.faces)) {
    identity_ = false;
    soup.face_elements.resize(soup.triangles.size());
    for (std::size_t i = 0; i < soup.face_elements.size(); ++i) {
      soup.face_elements[i] = static_cast<std::uint32_t>(i);
    }
  }
  if (!identity_) {
    for (std::size_t i = 0; i < chunk.triangles.size(); ++i) {
      const std::size_t element = chunk.elements.empty() ? i : chunk.elements[i];
      soup.face_elements.push_back(static_cast<std::uint32_t>(stats.faces + element));
    }
  }
  if (stats.too_few_vertices == 0) {
    mesh_.first_short_face = stats.faces + chunk.first_short_face;
  }
  soup.positions.insert(soup.positions.end(), chunk.positions.begin(), chunk.positions.end());
  soup.triangles.insert(soup.triangles.end(), chunk.triangles.begin(), chunk.triangles.end());
  stats.faces += chunk.faces;
  stats.too_few_vertices += chunk.short_faces;
  stats.ignored += chunk.ignored;
}

Result<MeshFile> ObjReader::read() {
  cuts_ = cut_statements(input_.text, input_.options.chunk_bytes);
  reserve();
  read_chunks<Chunk>(
      input_, cuts_, chunks_end_,
      [this](const char* begin, const char* end, Chunk& chunk) { parse(begin, end, chunk); },
      [this](Chunk& chunk) { append(chunk); });
  if (auto status = chunks_end_.status(input_); !status) return tl::unexpected(status.error());
  mesh_.stats.format = "obj";
  vertex_total_ = static_cast<std::int64_t>(mesh_.soup.positions.size());
  auto file = finish_mesh(input_, std::move(mesh_),
                          [this](std::uint32_t element) { return locate(element); });
  if (!file || !input_.options.wants_parts()) return file;
  if (auto done = read_obj_attributes(input_, *file); !done) return tl::unexpected(done.error());
  return file;
}

/// Reads the file again up to the face. This is slow, but only messages need it.
FacePlace ObjReader::locate(std::uint32_t element) const {
  Chunk chunk;
  std::uint64_t vertices = 0, faces = 0;
  for (const char* p = begin_; p < end_;) {
    chunk.clear();
    const char* const statement = skip_blanks(p);
    // A comment ends with its line; the other statements may be continued.
    const bool continued = statement[0] == 'v' || statement[0] == 'f';
    const char* const next = continued ? skip_statement(statement, end_) : next_line(p, end_);
    parse(p, next, chunk);
    if (chunk.faces != 0 && faces++ == element) {
      FacePlace result{fmt::format("{}:{}", input_.name, line_of(input_.text, statement)), {}};
      for (const char* q = skip_token(statement);;) {
        q = skip_blanks_obj(q);
        std::int64_t index = 0;
        const char* stop = parse_integer(q, index);
        if (stop == nullptr) break;
        if (index == 0 || index > vertex_total_ || index < -static_cast<std::int64_t>(vertices)) {
          result.vertex = std::string(q, stop);
          break;
        }
        q = stop;
        while (!ends_token(*q) && *q != '\\') ++q;
      }
      return result;
    }
    vertices += chunk.positions.size();
    p = next;
  }
  return {input_.name, {}};
}

}  // namespace

Result<MeshFile> read_obj(const ReaderInput& input) {
  if (input.text.find('\n') != std::string_view::npos ||
      input.text.find('\r') == std::string_view::npos) {
    return ObjReader(input).read();
  }
  // Old Macintosh files end lines with carriage returns. They are rare, so a copy of the text is
  // acceptable.
  std::string text(input.text);
  std::replace(text.begin(), text.end(), '\r', '\n');
  ReaderInput copy{text, input.name, input.options, input.execution};
  copy.path = input.path;
  copy.dropped = input.dropped;
  return ObjReader(copy).read();
}

}  // namespace strata::detail
