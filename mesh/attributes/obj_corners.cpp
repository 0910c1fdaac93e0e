#include "mesh/attributes/obj_corners.h"

#include <algorithm>
#include <cmath>
#include <glm/vec2.hpp>
#include <limits>

#include "core/reserve_large.h"
#include "mesh/no_vertex.h"
#include "mesh/text/obj_lines.h"
#include "mesh/text/text_chunks.h"
#include "mesh/text/text_scanner.h"

namespace strata::detail {
namespace {

/// A corner as a chunk has it.
struct PlacedCorner {
  std::uint32_t vertex = kNoVertex;  ///< of the file
  std::uint32_t point = kNoVertex;   ///< of the file's vt statements
};

/// The corners of a chunk's faces.
struct CornerChunk {
  std::vector<PlacedCorner> corners;
  std::vector<std::uint32_t> counts;  ///< of each face
  std::uint64_t bad = 0;              ///< corners whose vt is not there
  const char* first_bad = nullptr;

  void clear() {
    corners.clear();
    counts.clear();
    bad = 0;
    first_bad = nullptr;
  }
};

/// An index of OBJ, which counts from 1, or back from `before`. @return kNoVertex beyond `total`
std::uint32_t index_of(std::int64_t written, std::uint64_t before, std::uint64_t total) {
  const std::int64_t index =
      written > 0 ? written - 1 : static_cast<std::int64_t>(before) + written;
  return written != 0 && index >= 0 && index < static_cast<std::int64_t>(total) &&
                 index < static_cast<std::int64_t>(kNoVertex)
             ? static_cast<std::uint32_t>(index)
             : kNoVertex;
}

class CornerReader {
 public:
  CornerReader(const ReaderInput& input, std::span<const ObjChunkStart> starts,
               const std::vector<MtlMaterial>& materials, MeshFile& file)
      : input_(input), starts_(starts), materials_(materials), all_(file.attributes), file_(file) {}

  Result<void> read(std::span<const char* const> cuts) {
    points_.resize(starts_.back().texture_points);
    all_.corner_offsets.reserve(starts_.back().faces + 1);
    all_.corner_offsets.push_back(0);
    reserve();
    ChunksEnd chunks_end;
    read_chunks<CornerChunk>(
        input_, cuts, chunks_end,
        [&](const char* begin, const char* end, CornerChunk& chunk) {
          const auto index = std::lower_bound(cuts.begin(), cuts.end(), begin) - cuts.begin();
          parse(begin, end, starts_[static_cast<std::size_t>(index)], chunk);
        },
        [&](CornerChunk& chunk) { chunks_end.over_limit = !append(chunk); });
    if (auto status = chunks_end.status(input_); !status) return status;
    place_corners();
    if (bad_ != 0) {
      file_.stats.warnings.push_back(fmt::format(
          "{}:{}: corner of a face has a vt that is not there; {} such {} no place in the picture",
          input_.name, line_of(input_.text, first_bad_), bad_,
          bad_ == 1 ? "corner has" : "corners have"));
    }
    return {};
  }

 private:
  void reserve();
  void parse(const char* p, const char* end, ObjChunkStart at, CornerChunk& chunk);
  const char* parse_point(const char* p, glm::vec2& point) const;
  const char* parse_corners(const char* p, const ObjChunkStart& at, CornerChunk& chunk);
  bool append(const CornerChunk& chunk);
  void place_corners();
  [[nodiscard]] bool is_textured(std::uint32_t material) const {
    return material != MeshAttributes::kNone &&
           all_.materials[material].texture != SurfaceMaterial::kNoTexture;
  }

  const ReaderInput& input_;
  std::span<const ObjChunkStart> starts_;
  const std::vector<MtlMaterial>& materials_;
  MeshAttributes& all_;
  MeshFile& file_;
  std::vector<glm::vec2> points_;
  std::vector<std::uint32_t> point_of_;  ///< of each corner
  std::uint64_t bad_ = 0;
  const char* first_bad_ = nullptr;
};

/// Most faces are triangles.
void CornerReader::reserve() {
  std::uint64_t faces = 0;
  const std::vector<MeshAttributes::Range>& ranges = all_.material_ranges;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const std::uint64_t end = i + 1 < ranges.size() ? ranges[i + 1].first : starts_.back().faces;
    if (is_textured(ranges[i].index) && end > ranges[i].first) faces += end - ranges[i].first;
  }
  const std::uint64_t corners = std::min<std::uint64_t>(3 * faces, input_.text.size() / 4);
  reserve_large(all_.corners, corners);
  reserve_large(point_of_, corners);
}

const char* CornerReader::parse_point(const char* p, glm::vec2& point) const {
  for (int i = 0; i < 2; ++i) {
    double number = 0.0;
    p = skip_blanks(p);
    const char* next = parse_double(p, number);
    if (next == nullptr) break;
    point[i] = std::isfinite(number) ? static_cast<float>(number) : 0.0f;
    p = next;
  }
  return p;
}

/// Corners of a face: `vertex/point/normal` and the like.
const char* CornerReader::parse_corners(const char* p, const ObjChunkStart& at,
                                        CornerChunk& chunk) {
  const std::size_t first = chunk.corners.size();
  bool complete = true;
  for (;;) {
    p = skip_blanks_obj(p);
    if (*p == '\n' || *p == '\0' || *p == '#') break;
    const char* const corner_at = p;
    std::int64_t vertex = 0, point = 0;
    const char* next = parse_integer(p, vertex);
    if (next == nullptr) break;  // the first pass has read it
    p = next;
    if (*p == '/') next = parse_integer(p + 1, point);
    while (!ends_token(*p) && *p != '\\') ++p;
    if (*p == '\\' && p[1] != '\n' && p[1] != '\r') p = skip_token(p);
    const PlacedCorner corner{index_of(vertex, at.vertices, starts_.back().vertices),
                              index_of(point, at.texture_points, points_.size())};
    if (point != 0 && corner.point == kNoVertex && chunk.bad++ == 0) chunk.first_bad = corner_at;
    complete = complete && corner.point != kNoVertex && corner.vertex != kNoVertex;
    chunk.corners.push_back(corner);
  }
  if (!complete) chunk.corners.resize(first);
  chunk.counts.push_back(static_cast<std::uint32_t>(chunk.corners.size() - first));
  return p;
}

void CornerReader::parse(const char* p, const char* end, ObjChunkStart at, CornerChunk& chunk) {
  const std::vector<MeshAttributes::Range>& ranges = all_.material_ranges;
  auto next =
      std::upper_bound(ranges.begin(), ranges.end(), at.faces,
                       [](std::uint64_t face, const auto& range) { return face < range.first; });
  bool textured = next != ranges.begin() && is_textured(next[-1].index);
  while (p < end) {
    p = skip_blanks(p);
    const bool short_word = *p != '\0' && (ends_token(p[1]) || p[1] == '\\');
    if (*p == 'f' && (short_word || (p[1] == 'o' && is_blank(p[2])))) {
      for (; next != ranges.end() && next->first <= at.faces; ++next) {
        textured = is_textured(next->index);
      }
      if (textured) {
        p = parse_corners(p + (short_word ? 1 : 2), at, chunk);
      } else {
        chunk.counts.push_back(0);
      }
      ++at.faces;
      p = skip_statement(p, end);
    } else if ((*p == 'v' || *p == 'l' || *p == 'p') && short_word) {
      at.vertices += *p == 'v' ? 1 : 0;
      p = skip_statement(p, end);
    } else {
      if (*p == 'v' && p[1] == 't' && ends_token(p[2])) {
        p = parse_point(p + 2, points_[at.texture_points++]);
      }
      p = next_line(p, end);
    }
  }
}

/// @return false if there are too many corners
bool CornerReader::append(const CornerChunk& chunk) {
  if (all_.corners.size() + chunk.corners.size() > std::numeric_limits<std::uint32_t>::max()) {
    return false;
  }
  for (const std::uint32_t count : chunk.counts) {
    all_.corner_offsets.push_back(all_.corner_offsets.back() + count);
  }
  for (const PlacedCorner& corner : chunk.corners) {
    all_.corners.push_back({input_.dropped->index_of(corner.vertex), {}, glm::u8vec4(255)});
    point_of_.push_back(corner.point);
  }
  if (bad_ == 0) first_bad_ = chunk.first_bad;
  bad_ += chunk.bad;
  return true;
}

/// A vt may stand behind the faces that use it.
void CornerReader::place_corners() {
  for (std::size_t i = 0; i < all_.material_ranges.size(); ++i) {
    const auto [first, index] = all_.material_ranges[i];
    const std::uint64_t faces = starts_.back().faces;
    const std::uint64_t end =
        i + 1 < all_.material_ranges.size() ? all_.material_ranges[i + 1].first : faces;
    if (!is_textured(index) || first >= end) continue;
    const MtlMaterial& material = materials_[index];
    for (std::uint32_t c = all_.corner_offsets[first]; c < all_.corner_offsets[end]; ++c) {
      all_.corners[c].texture_at = material.scale * points_[point_of_[c]] + material.offset;
    }
  }
}

}  // namespace

Result<void> read_obj_corners(const ReaderInput& input, std::span<const char* const> cuts,
                              std::span<const ObjChunkStart> starts,
                              const std::vector<MtlMaterial>& materials, MeshFile& file) {
  if (file.attributes.textures.empty()) return {};
  return CornerReader(input, starts, materials, file).read(cuts);
}

}  // namespace strata::detail
