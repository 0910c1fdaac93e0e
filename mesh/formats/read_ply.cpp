#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "mesh/formats/plain_body.h"
#include "mesh/formats/ply_colours.h"
#include "mesh/formats/ply_source.h"
#include "mesh/formats/reader_common.h"
#include "mesh/text/text_scanner.h"

// The text header lists elements. Each has a count and properties: scalars, or lists with their own
// count. Positions are x, y, z of element "vertex". Faces are the list vertex_indices (or
// vertex_index) of element "face"; triangles also come from element "tristrips", in which -1 begins
// a new strip. Other properties are skipped according to their declared types. (G. Turk, The PLY
// Polygon File Format, 1994.)
//
// An ASCII element is a line, which may hold more than the header declares. A file in which an
// element does not fit its line is read again token by token; then nothing may be left over.

namespace strata::detail {
namespace {

using namespace ply;

/// Whether an element's corners make a polygon or a triangle strip.
enum class FaceKind { kPolygon, kStrip };

/// An element that holds faces. Messages need it to find a face again.
template <class Source>
struct FaceSource {
  const Element* element;
  Source source;
  FaceKind kind;
  std::uint64_t faces;  ///< number of faces it made
};

class PlyReader {
 public:
  explicit PlyReader(const ReaderInput& input)
      : input_(input), begin_(input.text.data()), end_(begin_ + input.text.size()), p_(begin_) {}
  Result<MeshFile> read();

 private:
  Result<void> read_header();
  Result<void> read_element_line(std::string_view line);
  Result<void> read_property_line(std::string_view line);
  Result<MeshFile> read_ascii();
  [[nodiscard]] bool may_be_plain() const;
  template <class Source>
  Result<MeshFile> read_body(Source source);
  template <class Source>
  Result<void> read_face_element(Source& source, const Element& element, FaceKind kind,
                                 FanBuilder& fans);
  template <class Source>
  Result<void> read_vertices(Source& source, const Element& element);
  template <class Source, class Visit>
  Result<void> read_faces(Source& source, const Element& element, Visit&& visit);
  template <class Source>
  Result<void> skip_element(Source& source, const Element& element);
  template <class Source>
  bool skip_property(Source& source, const Property& property);
  template <class Source>
  Result<void> read_colours(const std::optional<FaceSource<Source>>& vertices,
                            std::span<const FaceSource<Source>> faces, MeshFile& file) const;
  template <class Source>
  std::string place(const Source& source) const;
  template <class Source>
  tl::unexpected<Error> cut_short(const Source& source, const Element& element,
                                  std::uint64_t index);
  template <class Source>
  FacePlace locate(std::span<const FaceSource<Source>> sources, std::uint64_t face);
  [[nodiscard]] tl::unexpected<Error> header_error(const std::string& message) const {
    return fail(ErrorCode::kInput, "{}:{}: {}", input_.name, line_, message);
  }

  const ReaderInput& input_;
  const char* begin_;
  const char* end_;
  const char* p_;
  std::uint64_t line_ = 0;
  Encoding encoding_ = Encoding::kAscii;
  std::vector<Element> elements_;
  RawMesh mesh_;
  std::size_t failed_at_ = 0;  ///< position in the text where a body ended too early
};

/// Takes the next word of a line.
std::string_view take_word(std::string_view& line) {
  while (!line.empty() && is_blank(line.front())) line.remove_prefix(1);
  std::size_t size = 0;
  while (size < line.size() && !is_blank(line[size])) ++size;
  const std::string_view word = line.substr(0, size);
  line.remove_prefix(size);
  return word;
}

Result<void> PlyReader::read_element_line(std::string_view line) {
  Element element;
  element.name = take_word(line);
  const std::string_view count = take_word(line);
  const auto [stop, code] =
      std::from_chars(count.data(), count.data() + count.size(), element.count);
  if (element.name.empty() || code != std::errc() || stop != count.data() + count.size()) {
    return header_error(fmt::format("'{}' is not an element count", count.substr(0, 40)));
  }
  elements_.push_back(std::move(element));
  return {};
}

Result<void> PlyReader::read_property_line(std::string_view line) {
  if (elements_.empty()) return header_error("a property before the first element");
  Property property;
  std::string_view word = take_word(line);
  if (word == "list") {
    word = take_word(line);
    property.list_type = type_named(word);
    if (!property.list_type) return header_error(fmt::format("unknown type '{}'", word));
    word = take_word(line);
  }
  const std::optional<Type> type = type_named(word);
  if (!type) return header_error(fmt::format("unknown type '{}'", word.substr(0, 40)));
  property.type = *type;
  property.name = take_word(line);
  elements_.back().properties.push_back(std::move(property));
  return {};
}

Result<void> PlyReader::read_header() {
  bool has_format = false;
  std::size_t end_size = 0;  // the line end that the first line shows: 1 for \n or \r, 2 for \r\n
  while (p_ < end_) {
    ++line_;
    const char* stop = p_;
    while (stop < end_ && *stop != '\n' && *stop != '\r') ++stop;
    if (stop == end_) break;
    if (end_size == 0) end_size = *stop == '\r' && stop[1] == '\n' ? 2 : 1;
    std::string_view line(p_, static_cast<std::size_t>(stop - p_));
    // A single \r\n in a file of \n lines is one line end. After the last line binary data may
    // follow.
    p_ = *stop == '\r' && stop[1] == '\n' && (end_size == 2 || line != "end_header") ? stop + 2
                                                                                     : stop + 1;
    const std::string_view word = take_word(line);
    if (line_ == 1) {
      if (word != "ply") return header_error("expected 'ply'");
    } else if (word == "format") {
      const std::string_view name = take_word(line);
      has_format = true;
      if (name == "ascii") {
        encoding_ = Encoding::kAscii;
      } else if (name == "binary_little_endian") {
        encoding_ = Encoding::kLittle;
      } else if (name == "binary_big_endian") {
        encoding_ = Encoding::kBig;
      } else {
        return header_error(fmt::format("unknown format '{}'", name.substr(0, 40)));
      }
    } else if (word == "element") {
      if (auto done = read_element_line(line); !done) return done;
    } else if (word == "property") {
      if (auto done = read_property_line(line); !done) return done;
    } else if (word == "end_header") {
      if (!has_format) return header_error("no 'format' line in the header");
      return {};
    } else if (word != "comment" && word != "obj_info" && !word.empty()) {
      // Some exporters leave out the word "comment".
      mesh_.stats.warnings.push_back(fmt::format("{}:{}: header line '{}' is ignored", input_.name,
                                                 line_, word.substr(0, 40)));
    }
  }
  return header_error("the file ends inside the header");
}

template <class Source>
std::string PlyReader::place(const Source& source) const {
  if constexpr (Source::kBinary) {
    return fmt::format("{}: byte {}", input_.name,
                       source.position() - begin_ + static_cast<std::ptrdiff_t>(input_.skipped));
  } else {
    return fmt::format("{}:{}", input_.name, line_of(input_.text, source.position()));
  }
}

template <class Source>
tl::unexpected<Error> PlyReader::cut_short(const Source& source, const Element& element,
                                           std::uint64_t index) {
  const char* at = source.position();
  failed_at_ = static_cast<std::size_t>(at - begin_);
  while (!Source::kBinary && is_space(*at)) ++at;  // the value may be on the next line
  if (at < end_ && !Source::kBinary) at = source.position();
  const bool ends = Source::kBinary || at >= end_;
  return fail(ErrorCode::kInput, "{}: {} in element {} {} of {}", place(Source(at, end_)),
              ends ? "the file ends" : describe(at, end_) + " is not a value", element.name, index,
              element.count);
}

template <class Source>
bool PlyReader::skip_property(Source& source, const Property& property) {
  if (!property.list_type) return source.skip(property.type, 1);
  double count = 0.0;
  return source.read(*property.list_type, count) && count >= 0.0 && count < 9e15 &&
         source.skip(property.type, static_cast<std::uint64_t>(count));
}

/// The positions of the coordinates among the properties of a vertex.
struct VertexLayout {
  int property[3] = {-1, -1, -1};  ///< for each axis; -1: none
  std::size_t offset[3] = {};      ///< in bytes, if the element has no lists
  std::size_t stride = 0;          ///< bytes per vertex, if the element has no lists
  bool lists = false;
};

VertexLayout layout_of(const Element& element) {
  VertexLayout layout;
  for (std::size_t i = 0; i < element.properties.size(); ++i) {
    const Property& property = element.properties[i];
    for (int axis = 0; axis < 3; ++axis) {
      if (property.list_type || property.name.size() != 1 || property.name[0] != 'x' + axis)
        continue;
      layout.property[axis] = static_cast<int>(i);
      layout.offset[axis] = layout.stride;
    }
    layout.lists = layout.lists || property.list_type.has_value();
    layout.stride += bytes_of(property.type);
  }
  return layout;
}

/// Reads all vertices at once, if they all have the same size. @pre source has them all
template <class Source>
void read_equal_vertices(Source& source, const Element& element, const VertexLayout& layout,
                         const Execution& execution, std::vector<glm::dvec3>& positions) {
  Type types[3];
  for (int axis = 0; axis < 3; ++axis) {
    types[axis] = element.properties[static_cast<std::size_t>(layout.property[axis])].type;
  }
  positions.resize(element.count);
  const char* const data = source.position();
  constexpr std::size_t kBlock = 1 << 15;
  parallel_for(execution, (element.count + kBlock - 1) / kBlock, [&](std::size_t block, int) {
    const std::size_t stop = std::min<std::size_t>(element.count, (block + 1) * kBlock);
    for (std::size_t v = block * kBlock; v < stop; ++v) {
      const char* p = data + v * layout.stride;
      positions[v] = {Source::at(types[0], p + layout.offset[0]),
                      Source::at(types[1], p + layout.offset[1]),
                      Source::at(types[2], p + layout.offset[2])};
    }
  });
  source.advance(layout.stride * element.count);
}

template <class Source>
Result<void> PlyReader::read_vertices(Source& source, const Element& element) {
  const VertexLayout layout = layout_of(element);
  for (int axis = 0; axis < 3; ++axis) {
    if (layout.property[axis] < 0) {
      return fail(ErrorCode::kInput, "{}: element vertex has no property {}", input_.name,
                  "xyz"[axis]);
    }
  }
  std::vector<glm::dvec3>& positions = mesh_.soup.positions;
  reserve_large(positions, element.count);
  if constexpr (Source::kBinary) {
    if (!layout.lists && source.left() / layout.stride >= element.count) {
      read_equal_vertices(source, element, layout, input_.execution, positions);
      return {};
    }
  }
  ReadWatch watch(input_);
  for (std::uint64_t v = 0; v < element.count; ++v) {
    glm::dvec3 position(0.0);
    source.begin_element();
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const Property& property = element.properties[i];
      const int index = static_cast<int>(i);
      bool good = true;
      if (index == layout.property[0]) {
        good = source.read(property.type, position.x);
      } else if (index == layout.property[1]) {
        good = source.read(property.type, position.y);
      } else if (index == layout.property[2]) {
        good = source.read(property.type, position.z);
      } else {
        good = skip_property(source, property);
      }
      if (!good) return cut_short(source, element, v);
    }
    source.end_element();
    positions.push_back(position);
    if (!watch.step(v, source.position())) return {};
  }
  return {};
}

/// An index that no vertex has and that differs from the -1 between strips.
constexpr std::uint32_t kBadVertex = kMaxVertices;

/// @return kNoVertex for -1, in a signed or unsigned type, which separates strips
std::uint32_t vertex_index(double value) {
  if (value == -1.0 || value == static_cast<double>(kNoVertex)) return kNoVertex;
  return value >= 0.0 && value < static_cast<double>(kBadVertex) && value == std::floor(value)
             ? static_cast<std::uint32_t>(value)
             : kBadVertex;
}

/// Calls visit(a, b, c) for the triangles of a strip, in equal orientation, until it returns false.
/// A strip may contain triangles with two corners in one place, which only connect its pieces.
template <class Visit>
bool each_strip_triangle(std::span<const std::uint32_t> strip, Visit&& visit) {
  std::size_t begin = 0;
  for (std::size_t i = 0; i < strip.size(); ++i) {
    if (strip[i] == kNoVertex) begin = i + 1;
    if (i < begin + 2) continue;
    const std::uint32_t a = strip[i - 2], b = strip[i - 1], c = strip[i];
    if (a == b || b == c || c == a) continue;
    const bool odd = (i - begin) % 2 != 0;
    if (!visit(odd ? b : a, odd ? a : b, c)) return false;
  }
  return true;
}

/// Calls visit(start, corners) for the faces from `source` on, until it returns false.
template <class Source, class Visit>
Result<void> PlyReader::read_faces(Source& source, const Element& element, Visit&& visit) {
  const Property* indices = nullptr;
  for (const Property& property : element.properties) {
    if (property.list_type &&
        (property.name == "vertex_indices" || property.name == "vertex_index")) {
      indices = &property;
    }
  }
  if (indices == nullptr) {
    return fail(ErrorCode::kInput, "{}: element {} has no list vertex_indices", input_.name,
                element.name);
  }
  // Almost all binary files have a one-byte count followed by 32-bit indices.
  const bool plain = Source::kBinary && element.properties.size() == 1 &&
                     bytes_of(*indices->list_type) == 1 &&
                     (indices->type == Type::kInt32 || indices->type == Type::kUint32);
  std::vector<std::uint32_t> corners;
  for (std::uint64_t f = 0; f < element.count; ++f) {
    source.begin_element();
    const char* const start = source.position();
    if constexpr (Source::kBinary) {
      if (plain && source.left() >= 13 && *start == 3) {
        const std::uint32_t three[3] = {Source::template load<std::uint32_t>(start + 1),
                                        Source::template load<std::uint32_t>(start + 5),
                                        Source::template load<std::uint32_t>(start + 9)};
        source.advance(13);
        if (!visit(start, std::span<const std::uint32_t>(three))) return {};
        continue;
      }
    }
    for (const Property& property : element.properties) {
      if (&property != indices) {
        if (!skip_property(source, property)) return cut_short(source, element, f);
        continue;
      }
      double count = 0.0, value = 0.0;
      if (!source.read(*property.list_type, count)) return cut_short(source, element, f);
      if (!(count >= 0.0 && count == std::floor(count))) {
        return fail(ErrorCode::kInput, "{}: face {} claims {} vertices", place(source), f, count);
      }
      corners.clear();
      for (double i = 0.0; i < count; ++i) {
        if (!source.read(property.type, value)) return cut_short(source, element, f);
        corners.push_back(vertex_index(value));
      }
    }
    source.end_element();
    if (!visit(start, std::span<const std::uint32_t>(corners))) return {};
  }
  return {};
}

template <class Source>
Result<void> PlyReader::skip_element(Source& source, const Element& element) {
  for (std::uint64_t i = 0; i < element.count; ++i) {
    source.begin_element();
    for (const Property& property : element.properties) {
      if (!skip_property(source, property)) return cut_short(source, element, i);
    }
    source.end_element();
  }
  return {};
}

template <class Source>
FacePlace PlyReader::locate(std::span<const FaceSource<Source>> sources, std::uint64_t face) {
  FacePlace result{input_.name, {}};
  for (const FaceSource<Source>& one : sources) {
    if (face >= one.faces) {
      face -= one.faces;
      continue;
    }
    std::uint64_t seen = 0;
    Source source = one.source;
    (void)read_faces(
        source, *one.element, [&](const char* start, std::span<const std::uint32_t> corners) {
          std::uint64_t made = one.kind == FaceKind::kPolygon ? 1 : 0;
          if (one.kind == FaceKind::kStrip) {
            each_strip_triangle(corners, [&](auto, auto, auto) { return ++made != 0; });
          }
          seen += made;
          if (seen <= face) return true;
          result.place = place(Source(start, end_));
          for (const std::uint32_t corner : corners) {
            if (corner == kBadVertex || (corner == kNoVertex && one.kind == FaceKind::kPolygon)) {
              result.vertex = "with no valid number";
            }
          }
          return false;
        });
    break;
  }
  return result;
}

template <class Source>
Result<void> PlyReader::read_face_element(Source& source, const Element& element, FaceKind kind,
                                          FanBuilder& fans) {
  if (exceeds_limit(input_.execution, mesh_.soup.positions.size(), element.count)) {
    return fail(ErrorCode::kLimit, "{}: {} faces are more than the memory limit", input_.name,
                element.count);
  }
  ReadWatch watch(input_);
  std::uint64_t face = 0;
  if (kind == FaceKind::kStrip) {
    return read_faces(source, element,
                      [&](const char* place, std::span<const std::uint32_t> corners) {
                        return each_strip_triangle(
                            corners, [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
                              const std::uint32_t triangle[] = {a, b, c};
                              fans.add(triangle, 3);
                              return watch.step(face++, place);
                            });
                      });
  }
  reserve_large(mesh_.soup.triangles, element.count);
  return read_faces(source, element,
                    [&](const char* place, std::span<const std::uint32_t> corners) {
                      fans.add(corners.data(), corners.size());
                      return watch.step(face++, place);
                    });
}

/// Reads the elements that have colours a second time.
template <class Source>
Result<void> PlyReader::read_colours(const std::optional<FaceSource<Source>>& vertices,
                                     std::span<const FaceSource<Source>> faces,
                                     MeshFile& file) const {
  const std::stop_token& stop = input_.execution.stop;
  const ColourLayout of_vertices = vertices ? colours_of(*vertices->element) : ColourLayout{};
  if (of_vertices.given()) {
    std::vector<glm::u8vec4>& colours = file.attributes.vertex_colours;
    colours.resize(vertices->element->count, glm::u8vec4(255));
    read_ply_colours(vertices->source, *vertices->element, of_vertices, 0, stop, colours);
    input_.dropped->remove_from(colours);
  }
  std::uint64_t first = 0;
  for (const FaceSource<Source>& one : faces) {
    // Strips are several triangles each; nobody gives them colours.
    const ColourLayout layout = colours_of(*one.element);
    if (one.kind == FaceKind::kPolygon && layout.given()) {
      file.attributes.element_colours.resize(file.stats.faces, glm::u8vec4(255));
      read_ply_colours(one.source, *one.element, layout, first, stop,
                       file.attributes.element_colours);
    }
    first += one.faces;
  }
  if (!stop.stop_requested()) return {};
  return fail(ErrorCode::kCancelled, "{}: reading was stopped", input_.name);
}

template <class Source>
Result<MeshFile> PlyReader::read_body(Source source) {
  FanBuilder fans(mesh_);
  std::vector<FaceSource<Source>> sources;
  std::optional<FaceSource<Source>> vertices;
  for (const Element& element : elements_) {
    std::uint64_t least = 0;
    for (const Property& property : element.properties) least += Source::least_bytes(property);
    if (least == 0) continue;  // takes no bytes in the body
    // The last value of an ASCII file may lack its blank.
    if (element.count > (source.left() + 1) / least) {
      return fail(ErrorCode::kInput,
                  "{}: {} elements '{}' are claimed, {} bytes or more, but only {} bytes follow",
                  place(source), element.count, element.name,
                  static_cast<double>(element.count) * static_cast<double>(least), source.left());
    }
    Result<void> done;
    if (element.name == "vertex" && mesh_.soup.positions.empty()) {
      if (element.count > kMaxVertices || exceeds_limit(input_.execution, element.count, 0)) {
        return fail(ErrorCode::kLimit, "{}: {} vertices are more than the memory limit",
                    input_.name, element.count);
      }
      vertices = {&element, source, FaceKind::kPolygon, 0};
      done = read_vertices(source, element);
    } else if (element.name == "face" || element.name == "tristrips") {
      const FaceKind kind = element.name == "face" ? FaceKind::kPolygon : FaceKind::kStrip;
      const std::uint64_t before = mesh_.stats.faces;
      const Source start = source;
      done = read_face_element(source, element, kind, fans);
      sources.push_back({&element, start, kind, mesh_.stats.faces - before});
    } else {
      mesh_.stats.ignored += element.count;
      done = skip_element(source, element);
    }
    if (!done) return tl::unexpected(done.error());
    if (input_.execution.stop.stop_requested()) {
      return fail(ErrorCode::kCancelled, "{}: reading was stopped", input_.name);
    }
  }
  if constexpr (!Source::kBinary) {
    source.begin_element();
    if (!source.by_lines() && source.left() != 0) {
      return fail(ErrorCode::kInput, "{}: text follows the last element", place(source));
    }
  }
  const std::span<const FaceSource<Source>> faces(sources);
  auto file = finish_mesh(input_, std::move(mesh_),
                          [&](std::uint32_t face) { return locate(faces, face); });
  if (!file || !input_.options.attributes) return file;
  if (auto done = read_colours(vertices, faces, *file); !done) return tl::unexpected(done.error());
  return file;
}

/// Whether the header declares vertices that have a position alone, and polygons.
bool PlyReader::may_be_plain() const {
  if (elements_.size() != 2 || elements_[0].name != "vertex" || elements_[1].name != "face") {
    return false;
  }
  const std::vector<Property>& position = elements_[0].properties;
  const std::vector<Property>& face = elements_[1].properties;
  for (std::size_t i = 0; i < position.size(); ++i) {
    if (position[i].list_type || position[i].name != std::string(1, static_cast<char>('x' + i))) {
      return false;
    }
  }
  return position.size() == 3 && face.size() == 1 && face[0].list_type &&
         (face[0].name == "vertex_indices" || face[0].name == "vertex_index");
}

Result<MeshFile> PlyReader::read_ascii() {
  if (may_be_plain()) {
    AsciiSource body(p_, end_);
    body.begin_element();
    const std::uint64_t count = elements_[1].count;
    const char* const begin =
        read_plain_body(input_, body.position(), elements_[0].count, count, mesh_);
    if (begin != nullptr) {
      const FaceSource<AsciiSource> faces[] = {
          {&elements_[1], AsciiSource(begin, end_), FaceKind::kPolygon, count}};
      return finish_mesh(input_, std::move(mesh_), [&](std::uint32_t face) {
        return locate(std::span<const FaceSource<AsciiSource>>(faces), face);
      });
    }
  }
  const std::vector<std::string> warnings = mesh_.stats.warnings;
  Result<MeshFile> by_lines = read_body(AsciiSource(p_, end_));
  if (by_lines || by_lines.error().code != ErrorCode::kInput) return by_lines;
  const std::size_t line_failed_at = std::exchange(failed_at_, 0);
  mesh_ = {};
  mesh_.stats.format = "ply ascii";
  mesh_.stats.warnings = warnings;
  Result<MeshFile> by_tokens = read_body(AsciiSource(p_, end_, false));
  // The attempt that read most of the file has the most helpful error.
  return by_tokens || failed_at_ > line_failed_at ? by_tokens : by_lines;
}

Result<MeshFile> PlyReader::read() {
  if (auto header = read_header(); !header) return tl::unexpected(header.error());
  switch (encoding_) {
    case Encoding::kLittle:
      mesh_.stats.format = "ply binary little endian";
      return read_body(BinarySource<std::endian::little>(p_, end_));
    case Encoding::kBig:
      mesh_.stats.format = "ply binary big endian";
      return read_body(BinarySource<std::endian::big>(p_, end_));
    case Encoding::kAscii:
      break;
  }
  mesh_.stats.format = "ply ascii";
  return read_ascii();
}

}  // namespace

Result<MeshFile> read_ply(const ReaderInput& input) { return PlyReader(input).read(); }

}  // namespace strata::detail
