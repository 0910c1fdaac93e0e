#include <algorithm>

#include "mesh/attributes/colour_values.h"
#include "mesh/formats/plain_body.h"
#include "mesh/formats/reader_common.h"
#include "mesh/text/text_scanner.h"

// [ST][C][N][4][n]OFF, with the prefixes in any order; for nOFF the dimension; the numbers of
// vertices, faces and edges; the vertices; the faces. (Geomview manual, "OFF Files".)
//
// Most files have one line for each vertex and each face. The rest of a line after the coordinates
// or corners (normals, colours, texture) is skipped, whether a prefix announces it or not. The
// format itself, however, is a sequence of tokens. A file in which an element does not fit its
// line, or which ends too early when read by lines, is read again token by token. Then a vertex has
// the values that the prefixes announce, and nothing may be left over: a file with two meanings is
// an error. Comments and blank lines may be anywhere.

namespace strata::detail {
namespace {

/// How the end of an element is found.
enum class Layout {
  kLines,    ///< one element per line; the rest of the line is skipped
  kWrapped,  ///< vertices by tokens; the rest of the line after a face is skipped
  kTokens    ///< all elements by tokens
};

/// One way to read a file.
struct Attempt {
  Layout layout = Layout::kLines;
  bool edges_on_line =
      true;               ///< the number of edges, if given, stands in the line of that of faces
  int colour_values = 4;  ///< colour values of a vertex in COFF
};

class OffReader {
 public:
  explicit OffReader(const ReaderInput& input)
      : input_(input), begin_(input.text.data()), end_(begin_ + input.text.size()), p_(begin_) {}
  Result<MeshFile> read();

 private:
  Result<void> attempt(const Attempt& attempt);
  Result<void> read_prefixes();
  Result<void> read_header();
  Result<void> read_elements();
  Result<void> read_vertices();
  /// Reads faces from p_ on. visit(start, corners) returns false to stop.
  template <class Visit>
  Result<void> read_faces(Visit&& visit);
  FacePlace locate(std::uint32_t element);
  bool read_colour(glm::vec4& colour);
  void read_vertex_colours(MeshAttributes& attributes);
  void read_face_colours(MeshAttributes& attributes);

  /// Skips white space, comments and line ends.
  void skip_gap() {
    for (;;) {
      while (is_space(*p_)) ++p_;
      if (*p_ != '#') return;
      skip_line();
    }
  }
  /// Skips to the next value of the same element.
  void skip_inside() {
    if (how_.layout != Layout::kLines) return skip_gap();
    while (is_blank(*p_) && *p_ != '\r') ++p_;
  }
  void skip_line() {
    while (*p_ != '\n' && *p_ != '\r' && !at_end()) ++p_;
  }
  [[nodiscard]] bool at_end() const { return p_ >= end_; }
  [[nodiscard]] bool at_line_end() const { return *p_ == '\n' || *p_ == '\r' || *p_ == '#'; }
  [[nodiscard]] tl::unexpected<Error> error(const std::string& message) const {
    return fail(ErrorCode::kInput, "{}:{}: {}", input_.name, line_of(input_.text, p_), message);
  }
  [[nodiscard]] std::string found() const {
    if (at_end()) return "the file ends";
    return *p_ == '#' || *p_ == '\r' ? "found the end of the line" : "found " + describe(p_, end_);
  }
  /// Reads an integer that is a whole token. Returns false, with p_ unchanged, if there is none.
  bool take_integer(std::int64_t& value) {
    const char* stop = parse_integer(p_, value);
    if (stop == nullptr || !(ends_token(*stop) || *stop == '#')) return false;
    p_ = stop;
    return true;
  }
  bool next_integer(std::int64_t& value) {
    skip_gap();
    return take_integer(value);
  }

  const ReaderInput& input_;
  const char* begin_;
  const char* end_;
  const char* p_;
  Attempt how_;
  bool counts_in_line_ = true;  ///< the numbers of vertices and faces are on one line
  bool left_over_ = false;      ///< there is text after the last face
  bool homogeneous_ = false;    ///< four coordinates, of which the last divides the others
  bool normals_ = false, colours_ = false, texture_ = false, with_dimension_ = false;
  std::uint64_t vertex_count_ = 0, face_count_ = 0;
  const char* vertices_begin_ = nullptr;
  const char* faces_begin_ = nullptr;
  const char* corners_end_ = nullptr;  ///< of the face that is visited
  RawMesh mesh_;
};

/// Reads the word OFF and its prefixes. A count may follow without a blank, as in ModelNet40's
/// files ("OFF8 6 0").
Result<void> OffReader::read_prefixes() {
  homogeneous_ = normals_ = colours_ = texture_ = with_dimension_ = false;
  std::string_view word = token_at(p_);
  const bool lower = word.find("off") < word.find("OFF");
  const std::size_t size = word.find(lower ? "off" : "OFF");
  const char behind =
      size == std::string_view::npos || size + 3 >= word.size() ? '0' : word[size + 3];
  if (size == std::string_view::npos || !is_digit(behind)) {
    if (is_digit(*p_)) return {};  // counts follow without a blank
    return error(fmt::format("expected OFF, {}", found()));
  }
  word = word.substr(0, size);
  const struct {
    std::string_view upper, lower;
    bool& flag;
  } kPrefixes[] = {{"ST", "st", texture_},
                   {"C", "c", colours_},
                   {"N", "N", normals_},
                   {"4", "4", homogeneous_},
                   {"n", "n", with_dimension_}};
  while (!word.empty()) {
    bool known = false;
    for (const auto& prefix : kPrefixes) {
      if (prefix.flag || !word.starts_with(lower ? prefix.lower : prefix.upper)) continue;
      word.remove_prefix(prefix.upper.size());
      known = prefix.flag = true;
      break;
    }
    if (!known) return error(fmt::format("'{}' is not a known prefix of OFF", word));
  }
  p_ += size + 3;
  skip_gap();
  if (token_at(p_) == "BINARY") return error("binary OFF files are not supported");
  return {};
}

Result<void> OffReader::read_header() {
  p_ = begin_;
  skip_gap();
  if (auto prefixes = read_prefixes(); !prefixes) return prefixes;
  std::int64_t dimension = 0, vertices = 0, faces = 0, edges = 0;
  if (with_dimension_ && !next_integer(dimension)) {
    return error(fmt::format("expected the dimension, {}", found()));
  }
  if (with_dimension_ && dimension != 3) {
    return error(fmt::format("only 3 dimensions are supported, got {}", dimension));
  }
  if (!next_integer(vertices) || vertices < 0) {
    return error(fmt::format("expected the number of vertices, {}", found()));
  }
  const char* const line = p_;
  if (!next_integer(faces) || faces < 0) {
    return error(fmt::format("expected the number of faces, {}", found()));
  }
  counts_in_line_ = std::find_if(line, p_, [](char c) { return c == '\n' || c == '\r'; }) == p_;
  if (how_.layout == Layout::kLines) {
    skip_inside();
    const bool has_edges = !at_line_end();
    skip_line();
    // The number of edges may be on a line of its own, which is too short for a vertex.
    const char* const next = p_;
    const bool is_number = !has_edges && next_integer(edges);
    skip_inside();
    if (!is_number || !at_line_end()) p_ = next;
  } else if (how_.edges_on_line) {
    while (is_blank(*p_) && *p_ != '\r') ++p_;
    (void)take_integer(edges);
  } else {
    (void)next_integer(edges);
  }
  vertex_count_ = static_cast<std::uint64_t>(vertices);
  face_count_ = static_cast<std::uint64_t>(faces);
  // A vertex takes at least "0 0 0\n", a face "0\n".
  const auto left = static_cast<std::uint64_t>(end_ - p_);
  if (vertex_count_ > left / 6 + 1 || face_count_ > left / 2 + 1) {
    return error(fmt::format("{} vertices and {} faces are claimed, but only {} bytes follow",
                             vertex_count_, face_count_, left));
  }
  if (vertex_count_ > kMaxVertices || exceeds_limit(input_.execution, vertex_count_, face_count_)) {
    return fail(ErrorCode::kLimit, "{}: {} vertices and {} faces are more than the memory limit",
                input_.name, vertex_count_, face_count_);
  }
  return {};
}

Result<void> OffReader::read_vertices() {
  reserve_large(mesh_.soup.positions, vertex_count_);
  ReadWatch watch(input_);
  const bool by_lines = how_.layout == Layout::kLines;
  const int coordinates = homogeneous_ ? 4 : 3;
  const int more =
      by_lines ? 0 : (normals_ ? 3 : 0) + (colours_ ? how_.colour_values : 0) + (texture_ ? 2 : 0);
  for (std::uint64_t v = 0; v < vertex_count_; ++v) {
    double value[4] = {0.0, 0.0, 0.0, 1.0};
    for (int i = 0; i < coordinates + more; ++i) {
      i == 0 ? skip_gap() : skip_inside();
      double skipped = 0.0;
      const char* stop = parse_double(p_, i < coordinates ? value[i] : skipped);
      if (stop == nullptr || !(ends_token(*stop) || *stop == '#')) {
        return error(fmt::format("expected {} {} of vertex {} of {}, {}",
                                 i < coordinates ? "coordinate" : "value", i, v, vertex_count_,
                                 found()));
      }
      p_ = stop;
    }
    glm::dvec3 position(value[0], value[1], value[2]);
    if (homogeneous_) position /= value[3];
    mesh_.soup.positions.push_back(position);
    if (by_lines) skip_line();
    if (!watch.step(v, p_)) return {};
  }
  return {};
}

template <class Visit>
Result<void> OffReader::read_faces(Visit&& visit) {
  std::vector<std::uint32_t> corners;
  const bool by_lines = how_.layout == Layout::kLines;
  for (std::uint64_t f = 0; f < face_count_; ++f) {
    std::int64_t count = 0;
    if (!next_integer(count)) {
      return error(fmt::format("expected the size of face {} of {}, {}", f, face_count_, found()));
    }
    if (count < (by_lines ? 0 : 1)) {
      return error(
          fmt::format("face {} of {} must have corners, its size is {}", f, face_count_, count));
    }
    const char* const start = p_;
    corners.clear();
    for (std::int64_t i = 0; i < count; ++i) {
      std::int64_t index = 0;
      skip_inside();
      if (!take_integer(index) ||
          (!by_lines && (index < 0 || index >= static_cast<std::int64_t>(vertex_count_)))) {
        return error(
            fmt::format("expected corner {} of the {} of face {}, {}", i, count, f, found()));
      }
      corners.push_back(index >= 0 && index <= static_cast<std::int64_t>(kMaxVertices)
                            ? static_cast<std::uint32_t>(index)
                            : kNoVertex);
    }
    corners_end_ = p_;
    if (how_.layout != Layout::kTokens) skip_line();
    if (!visit(start, corners)) break;
  }
  return {};
}

FacePlace OffReader::locate(std::uint32_t element) {
  p_ = faces_begin_;
  FacePlace result{input_.name, {}};
  std::uint32_t face = 0;
  (void)read_faces([&](const char* start, const std::vector<std::uint32_t>& corners) {
    if (face++ != element) return true;
    result.place = fmt::format("{}:{}", input_.name, line_of(input_.text, start));
    for (const std::uint32_t corner : corners) {
      std::int64_t written = 0;
      while (is_space(*start)) ++start;
      const char* stop = parse_integer(start, written);
      if (corner >= vertex_count_) {
        result.vertex = std::string(token_at(start));
        break;
      }
      start = stop == nullptr ? start : stop;
    }
    return false;
  });
  return result;
}

/// Reads the three or four values of a colour. @return false if there are fewer before the line
/// ends; the fourth is below 0 if it is not there
bool OffReader::read_colour(glm::vec4& colour) {
  const bool by_tokens = how_.layout != Layout::kLines;
  colour = glm::vec4(0.0f, 0.0f, 0.0f, -1.0f);
  for (int i = 0; i < (by_tokens ? how_.colour_values : 4); ++i) {
    skip_inside();
    double value = 0.0;
    const char* stop = parse_double(p_, value);
    if (stop == nullptr || !(ends_token(*stop) || *stop == '#')) return i == 3;
    colour[i] = value > 0.0 ? static_cast<float>(value) : 0.0f;
    p_ = stop;
  }
  return true;
}

/// Colours of which the largest value decides whether they are 0 to 1 or 0 to 255.
/// @param colours  below 0 in all: there is none
std::vector<glm::u8vec4> bytes_of_colours(const std::vector<glm::vec4>& colours) {
  float most = 0.0f;
  for (const glm::vec4& c : colours) most = std::max({most, c.r, c.g, c.b, c.a});
  const float scale = colour_scale(most);
  std::vector<glm::u8vec4> result;
  for (const glm::vec4& c : colours) {
    glm::u8vec4 bytes(255);
    for (int i = 0; i < 4; ++i) {
      if (c[i] >= 0.0f) bytes[i] = colour_byte(scale * c[i]);
    }
    result.push_back(bytes);
  }
  return result;
}

void OffReader::read_vertex_colours(MeshAttributes& attributes) {
  std::vector<glm::vec4> colours(vertex_count_, glm::vec4(-1.0f));
  p_ = vertices_begin_;
  const int before = (homogeneous_ ? 4 : 3) + (normals_ ? 3 : 0);
  for (std::uint64_t v = 0; v < vertex_count_; ++v) {
    skip_gap();
    double skipped = 0.0;
    for (int i = 0; i < before; ++i) {
      if (i > 0) skip_inside();
      const char* stop = parse_double(p_, skipped);
      if (stop == nullptr) break;  // a line without the normal that the prefix announces
      p_ = stop;
    }
    if (glm::vec4 colour; read_colour(colour)) colours[v] = colour;
    if (how_.layout == Layout::kLines) {
      skip_line();
      continue;
    }
    for (int i = 0; i < (texture_ ? 2 : 0); ++i) {
      skip_inside();
      const char* stop = parse_double(p_, skipped);
      p_ = stop == nullptr ? p_ : stop;
    }
  }
  attributes.vertex_colours = bytes_of_colours(colours);
  input_.dropped->remove_from(attributes.vertex_colours);
}

/// `4 0 1 2 3 255 0 0`: what stands behind the corners in their line. One value is an index of a
/// table that Geomview has, and is skipped.
void OffReader::read_face_colours(MeshAttributes& attributes) {
  std::vector<glm::vec4> colours(face_count_, glm::vec4(-1.0f));
  const Attempt before = how_;
  bool any = false;
  std::uint64_t face = 0;
  p_ = faces_begin_;
  (void)read_faces([&](const char*, const std::vector<std::uint32_t>&) {
    const char* const next = p_;
    p_ = corners_end_;
    how_ = {};  // to the end of the line
    glm::vec4 colour;
    if (read_colour(colour)) {
      any = true;
      colours[face] = colour;
    }
    how_ = before;
    p_ = next;
    ++face;
    return !input_.execution.stop.stop_requested();
  });
  if (any) attributes.element_colours = bytes_of_colours(colours);
}

/// The vertices, and the faces.
Result<void> OffReader::read_elements() {
  vertices_begin_ = p_;
  if (how_.layout == Layout::kLines && !homogeneous_ && !normals_ && !colours_ && !texture_) {
    skip_gap();
    faces_begin_ = read_plain_body(input_, p_, vertex_count_, face_count_, mesh_);
    p_ = faces_begin_ != nullptr ? end_ : vertices_begin_;
    if (faces_begin_ != nullptr) return {};
  }
  if (auto vertices = read_vertices(); !vertices) return tl::unexpected(vertices.error());
  if (input_.execution.stop.stop_requested()) {
    return fail(ErrorCode::kCancelled, "{}: reading was stopped", input_.name);
  }
  reserve_large(mesh_.soup.triangles, face_count_);
  faces_begin_ = p_;
  FanBuilder fans(mesh_);
  ReadWatch watch(input_);
  std::uint64_t face = 0;
  auto faces = read_faces([&](const char* place, const std::vector<std::uint32_t>& corners) {
    fans.add(corners.data(), corners.size());
    return watch.step(face++, place);
  });
  return faces;
}

Result<void> OffReader::attempt(const Attempt& attempt) {
  how_ = attempt;
  mesh_ = {};
  if (auto header = read_header(); !header) return tl::unexpected(header.error());
  if (auto elements = read_elements(); !elements) return tl::unexpected(elements.error());
  if (input_.execution.stop.stop_requested()) {
    return fail(ErrorCode::kCancelled, "{}: reading was stopped", input_.name);
  }
  skip_gap();
  left_over_ = !at_end();
  if (left_over_) {
    if (how_.layout != Layout::kLines) return error(fmt::format("expected the end, {}", found()));
    mesh_.stats.warnings.push_back(fmt::format("{}:{}: text after the last face is ignored",
                                               input_.name, line_of(input_.text, p_)));
  }
  mesh_.stats.format = "off";
  return {};
}

Result<MeshFile> OffReader::read() {
  Error furthest{ErrorCode::kInput, {}};
  const char* furthest_place = nullptr;
  const auto good = [&](const Attempt& how) {
    auto done = attempt(how);
    if (done) return true;
    // The attempt that read most of the file has the most helpful error.
    if (furthest_place == nullptr || p_ > furthest_place ||
        done.error().code != ErrorCode::kInput) {
      furthest = done.error();
      furthest_place = p_;
    }
    return false;
  };
  const bool lines = good({});
  bool read = lines && !left_over_;
  // If the first two counts have a line each, the number of edges most likely has one too.
  const bool first = counts_in_line_;
  for (const bool edges_on_line : {first, !first}) {
    for (const int colour_values : {4, 3}) {
      for (const Layout layout : {Layout::kWrapped, Layout::kTokens}) {
        if (read || furthest.code != ErrorCode::kInput || (colour_values == 3 && !colours_)) break;
        read = good({layout, edges_on_line, colour_values});
      }
    }
  }
  // A file that can be read by lines only has other text after its last face.
  if (!read && lines && furthest.code == ErrorCode::kInput) read = good({});
  if (!read) return tl::unexpected(std::move(furthest));
  auto file = finish_mesh(input_, std::move(mesh_),
                          [this](std::uint32_t element) { return locate(element); });
  if (!file || !input_.options.attributes) return file;
  if (colours_) read_vertex_colours(file->attributes);
  if (how_.layout != Layout::kTokens) read_face_colours(file->attributes);
  if (input_.execution.stop.stop_requested()) {
    return fail(ErrorCode::kCancelled, "{}: reading was stopped", input_.name);
  }
  return file;
}

}  // namespace

Result<MeshFile> read_off(const ReaderInput& input) { return OffReader(input).read(); }

}  // namespace strata::detail
