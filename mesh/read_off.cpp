#include <algorithm>

#include "mesh/reader_common.h"
#include "mesh/text_scanner.h"

// [ST][C][N][4][n]OFF, then for nOFF the dimension, then the numbers of vertices, faces and edges;
// a line for each vertex and each face. What a line says beyond coordinates or corners (normals,
// colours, texture) is skipped, with or without a prefix that announces it. Comments and blank
// lines may stand anywhere. (Geomview manual, "OFF Files".)

namespace strata::detail {
namespace {

class OffReader {
 public:
  explicit OffReader(const ReaderInput& input)
      : input_(input), begin_(input.text.data()), end_(begin_ + input.text.size()), p_(begin_) {}
  Result<MeshFile> read();

 private:
  Result<void> read_header();
  Result<void> read_vertices();
  /// Reads faces from p_ on; visit(start, corners) returns false to stop.
  template <class Visit>
  Result<void> read_faces(Visit&& visit);
  FacePlace locate(std::uint32_t element);

  /// Past white space, comments and line ends.
  void skip_gap() {
    for (;;) {
      while (is_space(*p_)) ++p_;
      if (*p_ != '#') return;
      skip_line();
    }
  }
  void skip_line() {
    while (*p_ != '\n' && *p_ != '\r' && !at_end()) ++p_;
  }
  [[nodiscard]] bool at_end() const { return p_ >= end_; }
  [[nodiscard]] tl::unexpected<Error> error(const std::string& message) const {
    return fail(ErrorCode::kInput, "{}:{}: {}", input_.name, line_of(input_.text, p_), message);
  }
  [[nodiscard]] std::string found() const {
    return at_end() ? "the file ends" : "found " + describe(p_, end_);
  }
  /// An integer that ends its token; false leaves p_ at what stands there.
  bool next_integer(std::int64_t& value) {
    skip_gap();
    const char* stop = parse_integer(p_, value);
    if (stop == nullptr || !(ends_token(*stop) || *stop == '#')) return false;
    p_ = stop;
    return true;
  }

  const ReaderInput& input_;
  const char* begin_;
  const char* end_;
  const char* p_;
  bool homogeneous_ = false;  ///< four coordinates, the last divides
  std::uint64_t vertex_count_ = 0, face_count_ = 0;
  const char* faces_begin_ = nullptr;
  RawMesh mesh_;
};

Result<void> OffReader::read_header() {
  if (input_.text.starts_with("\xef\xbb\xbf")) p_ += 3;
  skip_gap();
  std::string_view word = token_at(p_);
  bool with_dimension = false;
  if (word.ends_with("OFF")) {
    p_ += word.size();
    word.remove_suffix(3);
    const auto prefix = [&word](std::string_view text) {
      if (!word.starts_with(text)) return false;
      word.remove_prefix(text.size());
      return true;
    };
    prefix("ST");
    prefix("C");
    prefix("N");
    homogeneous_ = prefix("4");
    with_dimension = prefix("n");
    if (!word.empty()) return error(fmt::format("'{}' is no prefix of OFF", word));
    skip_gap();
    if (token_at(p_) == "BINARY") return error("binary OFF files are not supported");
  } else if (!is_digit(*p_)) {
    return error(fmt::format("expected OFF, {}", found()));
  }
  std::int64_t dimension = 3;
  if (with_dimension && (!next_integer(dimension) || dimension != 3)) {
    return error(fmt::format("only 3 dimensions are supported, {}", found()));
  }
  std::int64_t vertices = 0, faces = 0;
  if (!next_integer(vertices) || vertices < 0) {
    return error(fmt::format("expected the number of vertices, {}", found()));
  }
  if (!next_integer(faces) || faces < 0) {
    return error(fmt::format("expected the number of faces, {}", found()));
  }
  skip_line();  // the number of edges, which nobody needs
  vertex_count_ = static_cast<std::uint64_t>(vertices);
  face_count_ = static_cast<std::uint64_t>(faces);
  // A vertex is at least "0 0 0\n", a face "0\n".
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
  for (std::uint64_t v = 0; v < vertex_count_; ++v) {
    double value[4] = {0.0, 0.0, 0.0, 1.0};
    for (int i = 0; i < (homogeneous_ ? 4 : 3); ++i) {
      skip_gap();
      const char* stop = parse_double(p_, value[i]);
      if (stop == nullptr || !(ends_token(*stop) || *stop == '#')) {
        return error(fmt::format("expected coordinate {} of vertex {} of {}, {}", i, v,
                                 vertex_count_, found()));
      }
      p_ = stop;
    }
    glm::dvec3 position(value[0], value[1], value[2]);
    if (homogeneous_) position /= value[3];
    mesh_.soup.positions.push_back(position);
    skip_line();
    if (!watch.step(v, p_)) return {};
  }
  return {};
}

template <class Visit>
Result<void> OffReader::read_faces(Visit&& visit) {
  std::vector<std::uint32_t> corners;
  for (std::uint64_t f = 0; f < face_count_; ++f) {
    std::int64_t count = 0;
    if (!next_integer(count) || count < 0) {
      return error(fmt::format("expected the size of face {} of {}, {}", f, face_count_, found()));
    }
    const char* const start = p_;
    corners.clear();
    for (std::int64_t i = 0; i < count; ++i) {
      std::int64_t index = 0;
      if (!next_integer(index)) {
        return error(
            fmt::format("expected corner {} of the {} of face {}, {}", i, count, f, found()));
      }
      corners.push_back(index >= 0 && index <= static_cast<std::int64_t>(kMaxVertices)
                            ? static_cast<std::uint32_t>(index)
                            : kNoVertex);
    }
    skip_line();
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

Result<MeshFile> OffReader::read() {
  if (auto header = read_header(); !header) return tl::unexpected(header.error());
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
  if (!faces) return tl::unexpected(faces.error());
  if (input_.execution.stop.stop_requested()) {
    return fail(ErrorCode::kCancelled, "{}: reading was stopped", input_.name);
  }
  skip_gap();
  if (!at_end()) {
    mesh_.stats.warnings.push_back(fmt::format("{}:{}: what follows the last face is ignored",
                                               input_.name, line_of(input_.text, p_)));
  }
  mesh_.stats.format = "off";
  return finish_mesh(input_, std::move(mesh_),
                     [this](std::uint32_t element) { return locate(element); });
}

}  // namespace

Result<MeshFile> read_off(const ReaderInput& input) { return OffReader(input).read(); }

}  // namespace strata::detail
