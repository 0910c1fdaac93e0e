#include <algorithm>
#include <atomic>
#include <limits>
#include <memory>
#include <mutex>

#include "mesh/reader_common.h"
#include "mesh/text_scanner.h"
#include "mesh/weld.h"

// Binary: 80 bytes of anything, a count, and 50 bytes a facet: normal, three corners as float, two
// bytes. Ascii: facet normal x y z, outer loop, vertex x y z ..., endloop, endfacet; numbers are
// read as double. In both, corners become vertices where their positions are equal.

namespace strata::detail {
namespace {

constexpr std::size_t kHeaderBytes = 84, kFacetBytes = 50;

std::uint32_t little_endian_32(const char* p) {
  std::uint32_t value = 0;
  std::memcpy(&value, p, sizeof value);
  return std::endian::native == std::endian::little ? value : __builtin_bswap32(value);
}

/// Corner `c` of a binary file, three to a facet.
glm::vec3 binary_corner(const char* data, std::size_t c) {
  const char* p = data + kHeaderBytes + c / 3 * kFacetBytes + 12 + c % 3 * 12;
  return {std::bit_cast<float>(little_endian_32(p)), std::bit_cast<float>(little_endian_32(p + 4)),
          std::bit_cast<float>(little_endian_32(p + 8))};
}

Result<MeshFile> read_binary(const ReaderInput& input) {
  const std::size_t size = input.text.size();
  const char* const data = input.text.data();
  if (size < kHeaderBytes) {
    return fail(ErrorCode::kInput, "{}: {} bytes are too few for an STL file", input.name, size);
  }
  const std::uint64_t claimed = little_endian_32(data + 80);
  const std::uint64_t held = (size - kHeaderBytes) / kFacetBytes;
  if (claimed > held) {
    return fail(ErrorCode::kInput,
                "{}: byte 80 claims {} triangles, which end at byte {}, but the file has {} bytes",
                input.name, claimed, kHeaderBytes + kFacetBytes * claimed, size);
  }
  if (claimed == 0 && held != 0) {
    return fail(ErrorCode::kInput, "{}: byte 80 claims 0 triangles, but {} more bytes follow",
                input.name, size - kHeaderBytes);
  }
  if (claimed == 0) return fail(ErrorCode::kInput, "{}: no triangles", input.name);
  const std::size_t corners = 3 * claimed;
  if (corners > kMaxVertices || exceeds_limit(input.execution, claimed / 2, claimed)) {
    return fail(ErrorCode::kLimit, "{}: {} triangles are more than the memory limit or {} corners",
                input.name, claimed, kMaxVertices);
  }
  RawMesh mesh;
  mesh.stats.format = "stl binary";
  mesh.stats.faces = claimed;
  if (const std::size_t rest = size - kHeaderBytes - kFacetBytes * claimed; rest != 0) {
    mesh.stats.warnings.push_back(
        fmt::format("{}: {} bytes after the {} triangles are ignored", input.name, rest, claimed));
  }
  TriangleSoup& soup = mesh.soup;
  reserve_large(soup.triangles, claimed);
  soup.triangles.resize(claimed);
  static_assert(sizeof(glm::uvec3) == 3 * sizeof(std::uint32_t));
  auto* const index = &soup.triangles.front().x;  // corner c is component c % 3 of triangle c / 3
  ReadWatch watch(input);
  const std::size_t different = weld_first<float>(
      input.execution, corners, [data](std::size_t c) { return binary_corner(data, c); }, index,
      [&](std::size_t c) {
        return watch.at(static_cast<double>(c) / static_cast<double>(corners));
      });
  if (input.execution.stop.stop_requested()) {
    return fail(ErrorCode::kCancelled, "{}: reading was stopped", input.name);
  }
  reserve_large(soup.positions, different);
  // First occurrences become vertices in the order of the file; what follows looks back to them.
  for (std::size_t c = 0; c < corners; ++c) {
    if (index[c] == c) {
      index[c] = static_cast<std::uint32_t>(soup.positions.size());
      soup.positions.emplace_back(WeldTable<float>::canonical(binary_corner(data, c)));
    } else {
      index[c] = index[index[c]];
    }
  }
  return finish_mesh(input, std::move(mesh), [&input](std::uint32_t element) {
    return FacePlace{fmt::format("{}: triangle {} (byte {})", input.name, element,
                                 kHeaderBytes + kFacetBytes * element),
                     {}};
  });
}

/// Facets of a part of an ascii file.
struct Chunk {
  std::vector<glm::dvec3> corners;
  std::vector<std::uint32_t> sizes;  ///< corners of each loop
  std::size_t error_offset = std::numeric_limits<std::size_t>::max();
  std::string error;
  bool ended = false;  ///< the last solid was closed by endsolid
};

class AsciiReader {
 public:
  explicit AsciiReader(const ReaderInput& input)
      : input_(input), begin_(input.text.data()), end_(begin_ + input.text.size()) {}
  Result<MeshFile> read();

 private:
  void cut();
  void parse(const char* p, const char* end, Chunk& chunk) const;
  const char* parse_vertex(const char* p, Chunk& chunk) const;
  void append(const Chunk& chunk);
  FacePlace locate(std::uint32_t element) const;

  const ReaderInput& input_;
  const char* begin_;
  const char* end_;
  std::vector<const char*> cuts_;
  RawMesh mesh_;
  FanBuilder fans_{mesh_};
  WeldTable<double> table_{1024};
  std::vector<std::uint32_t> loop_;
  bool ended_ = false, over_limit_ = false;
  std::size_t error_offset_ = std::numeric_limits<std::size_t>::max();
  std::string error_;
};

const char* skip_spaces(const char* p) {
  while (is_space(*p)) ++p;
  return p;
}

const char* skip_line(const char* p) {
  while (*p != '\n' && *p != '\r' && *p != '\0') ++p;
  return p;
}

/// Chunks end behind an "endfacet" that begins a line, where the grammar starts afresh. (Further to
/// the right it may be part of a solid's name.)
void AsciiReader::cut() {
  constexpr std::string_view kWord = "endfacet";
  cuts_.push_back(begin_);
  const char* p = begin_;
  while (static_cast<std::size_t>(end_ - p) > input_.options.chunk_bytes) {
    p += input_.options.chunk_bytes;
    bool found = false;
    while (p < end_ && !found) {
      while (p < end_ && *p != '\n' && *p != '\r') ++p;
      p = skip_spaces(p);
      const std::string_view token(p, std::min(kWord.size(), static_cast<std::size_t>(end_ - p)));
      found = equals_no_case(token, kWord) && ends_token(p[kWord.size()]);
    }
    if (!found) break;
    p += kWord.size();
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
  chunk.corners.push_back(corner);
  return p;
}

void AsciiReader::parse(const char* p, const char* end, Chunk& chunk) const {
  bool in_loop = false;
  std::size_t loop_begin = 0;
  const auto broken = [&](const char* at, std::string message) {
    chunk.error_offset = static_cast<std::size_t>(at - begin_);
    chunk.error = std::move(message);
  };
  for (p = skip_spaces(p); p < end; p = skip_spaces(p)) {
    const char* const stop = skip_token(p);
    const std::string_view word(p, static_cast<std::size_t>(stop - p));
    if (equals_no_case(word, "vertex")) {
      if (!in_loop) return broken(p, "vertex outside of a loop");
      p = parse_vertex(stop, chunk);
      if (p == nullptr) return;
    } else if (equals_no_case(word, "facet") || equals_no_case(word, "endfacet")) {
      if (in_loop) return broken(p, fmt::format("'{}' inside a loop", word));
      chunk.ended = false;
      p = stop;
    } else if (equals_no_case(word, "normal")) {
      p = stop;
      double unused = 0.0;
      for (const char* q = p; q != nullptr;) {  // not used, so any number of numbers will do
        p = q;
        q = parse_double(skip_spaces(p), unused);
        if (q != nullptr && !ends_token(*q)) q = nullptr;
      }
    } else if (equals_no_case(word, "outer") || equals_no_case(word, "loop")) {
      if (in_loop && word.size() == 5) return broken(p, "a loop inside a loop");
      if (!in_loop) loop_begin = chunk.corners.size();
      in_loop = true;
      p = stop;
    } else if (equals_no_case(word, "endloop")) {
      if (!in_loop) return broken(p, "'endloop' without a loop");
      in_loop = false;
      chunk.sizes.push_back(static_cast<std::uint32_t>(chunk.corners.size() - loop_begin));
      p = stop;
    } else if (equals_no_case(word, "solid") || equals_no_case(word, "endsolid")) {
      if (in_loop) return broken(p, fmt::format("'{}' inside a loop", word));
      chunk.ended = word.size() == 8;
      p = skip_line(stop);  // the rest is a name
    } else {
      return broken(p, describe(p, end_) + " is no word of an ascii STL file");
    }
  }
  if (in_loop) broken(p, "the file ends inside a facet");
}

void AsciiReader::append(const Chunk& chunk) {
  std::size_t corner = 0;
  std::vector<glm::dvec3>& positions = mesh_.soup.positions;
  for (const std::uint32_t size : chunk.sizes) {
    loop_.clear();
    for (std::uint32_t i = 0; i < size; ++i) {
      const glm::dvec3 key = WeldTable<double>::canonical(chunk.corners[corner++]);
      const std::uint32_t vertex = table_.find_or_insert(
          key, WeldTable<double>::hash(key), static_cast<std::uint32_t>(positions.size()));
      if (vertex == positions.size()) positions.push_back(key);
      loop_.push_back(vertex);
    }
    fans_.add(loop_.data(), loop_.size());
  }
  over_limit_ = positions.size() > kMaxVertices - 0x10000000u ||
                exceeds_limit(input_.execution, positions.size(), mesh_.soup.triangles.size());
  if (!chunk.sizes.empty() || chunk.ended) ended_ = chunk.ended;
  error_offset_ = chunk.error_offset;
  error_ = chunk.error;
}

FacePlace AsciiReader::locate(std::uint32_t element) const {
  std::uint32_t loops = 0;
  for (const char* p = begin_; p < end_; p = skip_token(p)) {
    while (p < end_ && ends_token(*p)) ++p;
    if (equals_no_case(token_at(p), "endloop") && loops++ == element) {
      return {fmt::format("{}:{}", input_.name, line_of(input_.text, p)), {}};
    }
  }
  return {input_.name, {}};
}

Result<MeshFile> AsciiReader::read() {
  cut();
  std::mutex mutex;
  std::atomic<bool> over = false;
  std::vector<std::unique_ptr<Chunk>> ready(cuts_.size() - 1);
  std::size_t next = 0;
  ReadWatch watch(input_);
  parallel_for(input_.execution, ready.size(), [&](std::size_t index, int) {
    if (over.load(std::memory_order_relaxed)) return;
    auto chunk = std::make_unique<Chunk>();
    parse(cuts_[index], cuts_[index + 1], *chunk);
    const std::lock_guard lock(mutex);
    ready[index] = std::move(chunk);
    for (; next < ready.size() && ready[next] && !over; ++next) {
      append(*ready[next]);
      over = over_limit_ || error_offset_ != std::numeric_limits<std::size_t>::max();
      ready[next].reset();
    }
    (void)watch.at(static_cast<double>(next) / static_cast<double>(ready.size()));
  });
  if (input_.execution.stop.stop_requested()) {
    return fail(ErrorCode::kCancelled, "{}: reading was stopped", input_.name);
  }
  if (over_limit_) {
    return fail(ErrorCode::kLimit, "{}: the mesh needs more than the memory limit", input_.name);
  }
  if (error_offset_ != std::numeric_limits<std::size_t>::max()) {
    return fail(ErrorCode::kInput, "{}:{}: {}", input_.name,
                line_of(input_.text, begin_ + error_offset_), error_);
  }
  if (!ended_) {
    mesh_.stats.warnings.push_back(fmt::format(
        "{}: no 'endsolid' after the last facet; the file may be cut short", input_.name));
  }
  mesh_.stats.format = "stl ascii";
  return finish_mesh(input_, std::move(mesh_),
                     [this](std::uint32_t element) { return locate(element); });
}

/// Text that begins like an ascii file. Binary headers may begin with "solid" too, but hold zeros.
bool looks_ascii(std::string_view text) {
  if (text.substr(0, 512).find('\0') != std::string_view::npos) return false;
  const std::string_view word = token_at(skip_spaces(text.data()));
  return equals_no_case(word, "solid") || equals_no_case(word, "facet");
}

}  // namespace

Result<MeshFile> read_stl(const ReaderInput& input) {
  const std::size_t size = input.text.size();
  const bool binary_size =
      size >= kHeaderBytes &&
      size == kHeaderBytes + kFacetBytes * std::size_t{little_endian_32(input.text.data() + 80)};
  if (!binary_size && looks_ascii(input.text)) return AsciiReader(input).read();
  return read_binary(input);
}

}  // namespace strata::detail
