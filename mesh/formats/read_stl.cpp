#include <algorithm>
#include <limits>
#include <memory>

#include "mesh/attributes/stl_attributes.h"
#include "mesh/formats/reader_common.h"
#include "mesh/text/plain_lines.h"
#include "mesh/text/text_chunks.h"
#include "mesh/text/text_scanner.h"
#include "mesh/weld.h"

// Binary: 80 bytes of any content, a count, and 50 bytes per facet (normal, three corners as float,
// two bytes). ASCII: facet normal x y z, outer loop, vertex x y z ..., endloop, endfacet; numbers
// are read as double. Exporters also write "end loop", a name glued to "endsolid", and lines of
// their own, such as colours, between the loops. In both kinds, corners with equal positions become
// one vertex.

namespace strata::detail {
namespace {

constexpr std::size_t kHeaderBytes = 84, kFacetBytes = 50;

std::uint32_t little_endian_32(const char* p) {
  std::uint32_t value = 0;
  std::memcpy(&value, p, sizeof value);
  return std::endian::native == std::endian::little ? value : __builtin_bswap32(value);
}

/// Corner `c` of a binary file; a facet has three.
glm::vec3 binary_corner(const char* data, std::size_t c) {
  const char* p = data + kHeaderBytes + 12 + c * 12 + c / 3 * (kFacetBytes - 36);
  return {std::bit_cast<float>(little_endian_32(p)), std::bit_cast<float>(little_endian_32(p + 4)),
          std::bit_cast<float>(little_endian_32(p + 8))};
}

/// The number of triangles in a binary file. The file's size decides, unless it is not a whole
/// number of triangles. Then the claimed number decides: either other data follows those triangles,
/// or the file is cut off.
struct BinaryCount {
  std::uint64_t claimed = 0;  ///< the number in the header
  std::uint64_t held = 0;     ///< the number that fits the file's size
  std::uint64_t count = 0;    ///< the number to read
};

Result<BinaryCount> count_binary(const ReaderInput& input) {
  const std::size_t size = input.text.size();
  if (size < kHeaderBytes) {
    return fail(ErrorCode::kInput, "{}: {} bytes are too few for an STL file", input.name, size);
  }
  BinaryCount found;
  found.claimed = little_endian_32(input.text.data() + 80);
  found.held = (size - kHeaderBytes) / kFacetBytes;
  if (found.held == 0 && found.claimed == 0) {
    return fail(ErrorCode::kInput, "{}: no triangles", input.name);
  }
  const std::size_t odd = (size - kHeaderBytes) % kFacetBytes;
  found.count = found.claimed == 0 || odd == 0 ? found.held : found.claimed;
  // Text, unlike triangles, contains no zero bytes.
  const bool is_text =
      input.text.substr(kHeaderBytes, 16 * kFacetBytes).find('\0') == std::string_view::npos;
  if (found.count > found.held || (found.count != found.claimed && is_text)) {
    return fail(ErrorCode::kInput,
                "{}: byte 80 claims {} triangles, which end at byte {}, but the file has {} bytes",
                input.name, found.claimed, kHeaderBytes + kFacetBytes * found.claimed, size);
  }
  if (3 * found.count > kMaxVertices ||
      exceeds_limit(input.execution, found.count / 2, found.count)) {
    return fail(ErrorCode::kLimit, "{}: {} triangles are more than the memory limit or {} corners",
                input.name, found.count, kMaxVertices);
  }
  return found;
}

/// Welds the corners. @return kCancelled
Result<void> read_facets(const ReaderInput& input, std::size_t count, TriangleSoup& soup) {
  const char* const data = input.text.data();
  const std::size_t corners = 3 * count;
  reserve_large(soup.triangles, count);
  soup.triangles.resize(count);
  static_assert(sizeof(glm::uvec3) == 3 * sizeof(std::uint32_t));
  auto* const index = &soup.triangles.front().x;  // corner c is component c % 3 of triangle c / 3
  // Threads may need what another one gave back; then they read it again.
  constexpr std::size_t kStep = std::size_t{1} << 16;  // corners between two calls
  const auto forget = [&](std::size_t c) {
    const std::size_t before = c < kStep ? 0 : (c - kStep) / 3;
    input.forget(data + kHeaderBytes + before * kFacetBytes,
                 data + kHeaderBytes + c / 3 * kFacetBytes);
  };
  ReadWatch watch(input);
  const auto load = [data](std::size_t c) { return binary_corner(data, c); };
  const auto go_on = [&](std::size_t c) {
    forget(c);
    return watch.at(static_cast<double>(c) / static_cast<double>(corners));
  };
  reserve_large(soup.positions, count / 2 + 2);  // of a closed mesh
  const bool done =
      weld_numbers<float>(input.execution, corners, load, index, go_on, soup.positions);
  if (done && watch.at(1.0)) return {};  // the calling thread may have welded nothing
  return fail(ErrorCode::kCancelled, "{}: reading was stopped", input.name);
}

Result<MeshFile> read_binary(const ReaderInput& input) {
  const auto found = count_binary(input);
  if (!found) return tl::unexpected(found.error());
  const auto [claimed, held, count] = *found;
  const std::size_t size = input.text.size();
  RawMesh mesh;
  mesh.stats.format = "stl binary";
  mesh.stats.faces = count;
  if (count != claimed) {
    mesh.stats.warnings.push_back(
        fmt::format("{}: byte 80 claims {} triangle{}, but the file has {} bytes, room for {}: all "
                    "{} are read",
                    input.name, claimed, claimed == 1 ? "" : "s", size, held, held));
    if (input.options.strict) return fail(ErrorCode::kInput, "{}", mesh.stats.warnings.front());
  }
  if (const std::size_t rest = size - kHeaderBytes - kFacetBytes * count; rest != 0) {
    mesh.stats.warnings.push_back(
        fmt::format("{}: {} bytes after the {} triangles are ignored", input.name, rest, count));
  }
  if (auto done = read_facets(input, count, mesh.soup); !done) return tl::unexpected(done.error());
  auto file = finish_mesh(input, std::move(mesh), [&input](std::uint32_t element) {
    return FacePlace{fmt::format("{}: triangle {} (byte {})", input.name, element,
                                 kHeaderBytes + kFacetBytes * element),
                     {}};
  });
  if (file && input.options.attributes) read_stl_colours(input.text, count, file->attributes);
  return file;
}

/// The facets of a piece of an ASCII file. Equal corners within it are one.
struct Chunk {
  WeldTable<double> table{1024};      ///< of `positions`
  std::vector<glm::dvec3> positions;  ///< different ones
  std::vector<std::uint64_t> hashes;  ///< of `positions`
  std::vector<std::uint32_t> corners;
  std::vector<std::uint32_t> sizes;  ///< number of corners of each loop
  std::vector<StlSolid> solids;      ///< counted from the chunk's first loop
  std::size_t error_offset = ChunksEnd::kNone;
  std::string error;
  bool ended = false;  ///< endsolid has closed the last solid
  std::uint64_t strange_lines = 0;
  std::size_t first_strange = 0;  ///< offset of the first strange line

  void add(const glm::dvec3& corner) {
    const glm::dvec3 key = WeldTable<double>::canonical(corner);
    const std::uint64_t hash = WeldTable<double>::hash(key);
    const auto next = static_cast<std::uint32_t>(positions.size());
    const std::uint32_t at = table.find_or_insert(key, hash, next);
    corners.push_back(at);
    if (at != next) return;
    positions.push_back(key);
    hashes.push_back(hash);
  }
  void clear() {
    table.clear();
    positions.clear();
    hashes.clear();
    corners.clear();
    sizes.clear();
    solids.clear();
    ended = false;
    strange_lines = first_strange = 0;
  }
};

class AsciiReader {
 public:
  explicit AsciiReader(const ReaderInput& input)
      : input_(input), begin_(input.text.data()), end_(begin_ + input.text.size()) {}
  Result<MeshFile> read();

 private:
  void cut();
  void parse(const char* p, const char* end, Chunk& chunk) const;
  static const char* parse_plain_vertex(const char* p, Chunk& chunk);
  const char* parse_vertex(const char* p, Chunk& chunk) const;
  const char* parse_strange(const char* p, Chunk& chunk) const;
  void append(const Chunk& chunk);
  FacePlace locate(std::uint32_t element) const;

  const ReaderInput& input_;
  const char* begin_;
  const char* end_;
  std::vector<const char*> cuts_;
  RawMesh mesh_;
  FanBuilder fans_{mesh_};
  WeldTable<double> table_{1024};
  std::vector<std::uint32_t> vertices_;  ///< of the positions of a chunk
  std::vector<std::uint32_t> loop_;
  std::vector<StlSolid> solids_;
  bool ended_ = false;
  ChunksEnd chunks_end_{.most_vertices = kMaxVertices - 0x10000000u};
  std::uint64_t strange_lines_ = 0;
  std::size_t first_strange_ = 0;
};

const char* skip_spaces(const char* p) {
  while (is_space(*p)) ++p;
  return p;
}

const char* skip_line(const char* p) {
  while (*p != '\n' && *p != '\r' && *p != '\0') ++p;
  return p;
}

/// The meaning of a token.
enum class Word { kSolid, kEndSolid, kFacet, kEndFacet, kLoop, kEndLoop, kNormal, kVertex, kOther };

std::string_view trimmed(const char* begin, const char* end) {
  while (begin < end && is_blank(*begin)) ++begin;
  while (begin < end && is_blank(end[-1])) --end;
  return {begin, static_cast<std::size_t>(end - begin)};
}

bool starts_no_case(std::string_view text, std::string_view word) {
  return equals_no_case(text.substr(0, word.size()), word);
}

/// The meaning of the token at p; `stop` is set to its end. Blanks may separate "end" from its
/// word, and the name of a solid may be glued to "solid" and "endsolid".
Word word_at(const char* p, const char*& stop) {
  stop = skip_token(p);
  std::string_view token(p, static_cast<std::size_t>(stop - p));
  const auto is = [token](std::string_view word, Word meaning) {
    return equals_no_case(token, word) ? meaning : Word::kOther;
  };
  switch (*p | 0x20) {
    case 'v':
      return is("vertex", Word::kVertex);
    case 'f':
      return is("facet", Word::kFacet);
    case 'n':
      return is("normal", Word::kNormal);
    case 'o':
      return is("outer", Word::kLoop);
    case 'l':
      return is("loop", Word::kLoop);
    case 's':
      return starts_no_case(token, "solid") ? Word::kSolid : Word::kOther;
    case 'e':
      break;
    default:
      return Word::kOther;
  }
  if (!starts_no_case(token, "end")) return Word::kOther;
  token.remove_prefix(3);
  if (token.empty()) {
    const char* const second = skip_blanks(stop);
    const char* const second_stop = skip_token(second);
    token = {second, static_cast<std::size_t>(second_stop - second)};
    if (equals_no_case(token, "facet") || equals_no_case(token, "loop") ||
        starts_no_case(token, "solid")) {
      stop = second_stop;
    }
  }
  if (equals_no_case(token, "loop")) return Word::kEndLoop;
  if (equals_no_case(token, "facet")) return Word::kEndFacet;
  return starts_no_case(token, "solid") ? Word::kEndSolid : Word::kOther;
}

/// Whether a line that begins with this word describes appearance. Exporters add such lines to
/// facets and vertices.
bool tells_of_looks(std::string_view word) {
  constexpr std::string_view kWords[] = {"color", "colour", "rgb", "material", "attribute"};
  return std::any_of(std::begin(kWords), std::end(kWords),
                     [&](std::string_view known) { return starts_no_case(word, known); });
}

/// A chunk ends after an "endfacet" at the start of a line, where the grammar begins anew.
/// (Elsewhere in a line the word may be part of a solid's name.)
void AsciiReader::cut() {
  cuts_.push_back(begin_);
  const char* p = begin_;
  while (static_cast<std::size_t>(end_ - p) > input_.options.chunk_bytes) {
    p += input_.options.chunk_bytes;
    bool found = false;
    while (p < end_ && !found) {
      while (p < end_ && *p != '\n' && *p != '\r') ++p;
      p = skip_spaces(p);
      const char* stop = p;
      found = p < end_ && word_at(p, stop) == Word::kEndFacet;
      if (found) p = stop;
    }
    if (!found) break;
    cuts_.push_back(p);
  }
  cuts_.push_back(end_);
}

const char* AsciiReader::parse_vertex(const char* p, Chunk& chunk) const {
  glm::dvec3 corner;
  for (int i = 0; i < 3; ++i) {
    p = skip_spaces(p);
    const char* next = parse_double(p, corner[i]);
    if (next == nullptr || !ends_token(*next)) {
      chunk.error_offset = static_cast<std::size_t>(p - begin_);
      chunk.error =
          p >= end_ ? "the file ends inside a vertex" : describe(p, end_) + " is not a number";
      return nullptr;
    }
    p = next;
  }
  chunk.add(corner);
  return p;
}

/// The same for a plain line. @return the next line; null, with nothing changed, for all else
const char* AsciiReader::parse_plain_vertex(const char* p, Chunk& chunk) {
  if (!scanner::may_read(p, 8) || std::memcmp(p, "vertex ", 7) != 0) return nullptr;
  glm::dvec3 corner;
  const char* const next = plain_vertex(p + 7, corner);
  if (next != nullptr) chunk.add(corner);
  return next;
}

/// Skips the values of a normal. They are not used, so any count is accepted.
const char* skip_numbers(const char* p) {
  glm::dvec3 normal;
  if (*p == ' ') {
    if (const char* next = plain_vertex(p + 1, normal); next != nullptr) return next;
  }
  double unused = 0.0;
  for (const char* q = p; q != nullptr;) {
    p = q;
    q = parse_double(skip_spaces(p), unused);
    if (q != nullptr && !ends_token(*q)) q = nullptr;
  }
  return p;
}

/// Behind white space and a word in lower case; null if another one is there.
template <std::size_t n>
const char* behind_word(const char* p, const char (&word)[n]) {
  p = skip_spaces(p);
  const bool same = scanner::may_read(p, n) ? std::memcmp(p, word, n - 1) == 0
                                            : std::strncmp(p, word, n - 1) == 0;
  return same && ends_token(p[n - 1]) ? p + n - 1 : nullptr;
}

/// From the last vertex of a facet to the first one of the next, as most files have it: "endloop
/// endfacet facet normal x y z outer loop". @return null for all else
const char* next_plain_facet(const char* p, const char* end) {
  if ((p = behind_word(p, "endloop")) == nullptr) return nullptr;
  if ((p = behind_word(p, "endfacet")) == nullptr || p >= end) return nullptr;
  if ((p = behind_word(p, "facet")) == nullptr) return nullptr;
  if ((p = behind_word(p, "normal")) == nullptr || *p != ' ') return nullptr;
  glm::dvec3 normal;
  if ((p = plain_vertex(p + 1, normal)) == nullptr) return nullptr;
  if ((p = behind_word(p, "outer")) == nullptr) return nullptr;
  return behind_word(p, "loop");
}

void AsciiReader::parse(const char* p, const char* end, Chunk& chunk) const {
  bool in_loop = false;
  std::size_t loop_begin = 0;
  const auto broken = [&](const char* at, std::string message) {
    chunk.error_offset = static_cast<std::size_t>(at - begin_);
    chunk.error = std::move(message);
  };
  for (p = skip_spaces(p); p < end; p = skip_spaces(p)) {
    const char* next = in_loop ? parse_plain_vertex(p, chunk) : nullptr;
    if (next != nullptr) {
      p = next;
      continue;
    }
    next = in_loop ? next_plain_facet(p, end) : nullptr;
    if (next != nullptr) {
      chunk.sizes.push_back(static_cast<std::uint32_t>(chunk.corners.size() - loop_begin));
      loop_begin = chunk.corners.size();
      chunk.ended = false;
      p = next;
      continue;
    }
    const char* stop = p;
    const Word word = word_at(p, stop);
    const std::string_view text(p, static_cast<std::size_t>(stop - p));
    if (word == Word::kVertex) {
      if (!in_loop) return broken(p, "vertex outside of a loop");
      p = parse_vertex(stop, chunk);
      if (p == nullptr) return;
    } else if (word == Word::kFacet || word == Word::kEndFacet) {
      if (in_loop) return broken(p, fmt::format("'{}' inside a loop", text));
      chunk.ended = false;
      p = stop;
    } else if (word == Word::kNormal) {
      p = skip_numbers(stop);
    } else if (word == Word::kLoop) {
      if (in_loop && text.size() == 5) return broken(p, "a loop inside a loop");
      if (!in_loop) loop_begin = chunk.corners.size();
      in_loop = true;
      p = stop;
    } else if (word == Word::kEndLoop) {
      if (!in_loop) return broken(p, fmt::format("'{}' without a loop", text));
      in_loop = false;
      chunk.sizes.push_back(static_cast<std::uint32_t>(chunk.corners.size() - loop_begin));
      p = stop;
    } else if (word == Word::kSolid || word == Word::kEndSolid) {
      if (in_loop) return broken(p, fmt::format("'{}' inside a loop", text));
      chunk.ended = word == Word::kEndSolid;
      const char* const name = p + 5;  // it may be glued to the word
      p = skip_line(stop);             // the rest of the line is a name
      if (word == Word::kSolid) chunk.solids.push_back({chunk.sizes.size(), trimmed(name, p)});
    } else if (!in_loop || tells_of_looks(text)) {
      p = parse_strange(p, chunk);
    } else {
      return broken(p, describe(p, end_) + " is not a word of a loop in an ASCII STL file");
    }
  }
  if (in_loop) broken(p, "the file ends inside a facet");
}

/// Skips text that no STL file should hold, to the end of the line or to a known word.
const char* AsciiReader::parse_strange(const char* p, Chunk& chunk) const {
  const char* stop = skip_token(p);
  if (!tells_of_looks({p, static_cast<std::size_t>(stop - p)}) && chunk.strange_lines++ == 0) {
    chunk.first_strange = static_cast<std::size_t>(p - begin_);
  }
  for (p = stop; p < end_;) {
    while (is_blank(*p) && *p != '\r') ++p;
    if (*p == '\n' || *p == '\r' || p >= end_) break;
    if (word_at(p, stop) != Word::kOther) break;
    p = std::max(p + 1, skip_token(p));
  }
  return p;
}

void AsciiReader::append(const Chunk& chunk) {
  std::size_t corner = 0;
  std::vector<glm::dvec3>& positions = mesh_.soup.positions;
  for (const StlSolid& solid : chunk.solids) {
    solids_.push_back({mesh_.stats.faces + solid.first, solid.name});
  }
  constexpr std::size_t kAhead = 16;  // look-ups in flight, so that their cache misses overlap
  vertices_.clear();
  for (std::size_t i = 0; i < chunk.positions.size(); ++i) {
    if (i + kAhead < chunk.hashes.size()) table_.prefetch(chunk.hashes[i + kAhead]);
    const auto next = static_cast<std::uint32_t>(positions.size());
    vertices_.push_back(table_.find_or_insert(chunk.positions[i], chunk.hashes[i], next));
    if (vertices_.back() == next) positions.push_back(chunk.positions[i]);
  }
  for (const std::uint32_t size : chunk.sizes) {
    loop_.clear();
    for (std::uint32_t i = 0; i < size; ++i) loop_.push_back(vertices_[chunk.corners[corner++]]);
    fans_.add(loop_.data(), loop_.size());
  }
  chunks_end_.over_limit =
      positions.size() > chunks_end_.most_vertices ||
      exceeds_limit(input_.execution, positions.size(), mesh_.soup.triangles.size());
  if (!chunk.sizes.empty() || chunk.ended) ended_ = chunk.ended;
  chunks_end_.error_offset = chunk.error_offset;
  chunks_end_.error = chunk.error;
  if (strange_lines_ == 0) first_strange_ = chunk.first_strange;
  strange_lines_ += chunk.strange_lines;
}

FacePlace AsciiReader::locate(std::uint32_t element) const {
  std::uint32_t loops = 0;
  const char* stop = begin_;
  for (const char* p = begin_; p < end_; p = stop) {
    while (p < end_ && ends_token(*p)) ++p;
    if (p >= end_) break;
    if (word_at(p, stop) == Word::kEndLoop && loops++ == element) {
      return {fmt::format("{}:{}", input_.name, line_of(input_.text, p)), {}};
    }
  }
  return {input_.name, {}};
}

Result<MeshFile> AsciiReader::read() {
  cut();
  read_chunks<Chunk>(
      input_, cuts_, chunks_end_,
      [this](const char* begin, const char* end, Chunk& chunk) { parse(begin, end, chunk); },
      [this](const Chunk& chunk) { append(chunk); });
  if (auto status = chunks_end_.status(input_); !status) return tl::unexpected(status.error());
  if (strange_lines_ != 0) {
    const char* const first = begin_ + first_strange_;
    const std::string what =
        fmt::format("{}:{}: {} is not a word of an ASCII STL file", input_.name,
                    line_of(input_.text, first), describe(first, end_));
    if (mesh_.soup.positions.empty()) return fail(ErrorCode::kInput, "{}", what);
    mesh_.stats.warnings.push_back(fmt::format("{}; {} such line{} skipped", what, strange_lines_,
                                               strange_lines_ == 1 ? " was" : "s were"));
  }
  if (!ended_) {
    mesh_.stats.warnings.push_back(fmt::format(
        "{}: no 'endsolid' after the last facet; the file may be cut short", input_.name));
  }
  mesh_.stats.format = "stl ascii";
  const std::uint64_t facets = mesh_.stats.faces;
  auto file = finish_mesh(input_, std::move(mesh_),
                          [this](std::uint32_t element) { return locate(element); });
  if (file && input_.options.wants_parts()) set_stl_parts(solids_, facets, file->attributes);
  return file;
}

/// Whether text begins like an ASCII file. Binary headers may also begin with "solid", but contain
/// zeros.
bool looks_ascii(std::string_view text) {
  if (text.substr(0, 512).find('\0') != std::string_view::npos) return false;
  const std::string_view word = token_at(skip_spaces(text.data()));
  return starts_no_case(word, "solid") || equals_no_case(word, "facet");
}

}  // namespace

bool is_binary_stl(std::string_view bytes) {
  return bytes.size() >= kHeaderBytes &&
         bytes.size() ==
             kHeaderBytes + kFacetBytes * std::size_t{little_endian_32(bytes.data() + 80)};
}

Result<MeshFile> read_stl(const ReaderInput& input) {
  if (!is_binary_stl(input.text) && looks_ascii(input.text)) return AsciiReader(input).read();
  return read_binary(input);
}

}  // namespace strata::detail
