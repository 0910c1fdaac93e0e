#include "mesh/attributes/obj_attributes.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "mesh/attributes/colour_values.h"
#include "mesh/attributes/mtl_library.h"
#include "mesh/attributes/obj_corners.h"
#include "mesh/no_vertex.h"
#include "mesh/text/obj_lines.h"
#include "mesh/text/text_chunks.h"
#include "mesh/text/text_scanner.h"

// Faces and vertices are counted as read_obj.cpp counts them. Names of objects and groups are not
// continued over lines there, and so not here.

namespace strata::detail {
namespace {

enum class ObjWord { kObject, kGroup, kMaterial, kLibrary };

/// A statement that says something of the faces after it.
struct ObjStatement {
  ObjWord word;
  std::uint64_t faces;  ///< before it
  std::string_view name;
};

/// What a chunk holds besides positions and corners.
struct ObjScan {
  std::uint64_t faces = 0, vertices = 0, texture_points = 0;
  std::vector<ObjStatement> statements;
  std::vector<glm::vec3> colours;  ///< of the first vertices, up to the last that has one

  void clear() {
    faces = vertices = texture_points = 0;
    statements.clear();
    colours.clear();
  }
};

/// A vertex whose line has no colour, beside others that have one.
constexpr glm::vec3 kNoColour(-1.0f);

/// `v x y z r g b`: four numbers are x, y, z and a weight.
const char* scan_vertex(const char* p, ObjScan& scan) {
  glm::vec3 colour(0.0f);
  int count = 0;
  for (;;) {
    p = skip_blanks_obj(p);
    if (*p == '\n' || *p == '\0' || *p == '#') break;
    if (count >= 3 && count < 6) {
      double number = 0.0;
      if (parse_double(p, number) == nullptr) break;
      colour[count - 3] = number > 0.0 ? static_cast<float>(number) : 0.0f;  // NaN is 0, too
    }
    while (!ends_token(*p) && *p != '\\') ++p;
    if (*p == '\\' && p[1] != '\n' && p[1] != '\r') p = skip_token(p);
    ++count;
  }
  if (count >= 6) {
    scan.colours.resize(scan.vertices, kNoColour);
    scan.colours.push_back(colour);
  }
  ++scan.vertices;
  return p;
}

void scan_chunk(const char* p, const char* end, bool looks, ObjScan& scan) {
  const auto say = [&](ObjWord word, const char* name) {
    scan.statements.push_back({word, scan.faces, rest_of_line(name, end)});
  };
  while (p < end) {
    p = skip_blanks(p);
    const bool short_word = *p != '\0' && (ends_token(p[1]) || p[1] == '\\');
    if (*p == 'v' && short_word) {
      if (looks) {
        p = scan_vertex(p + 1, scan);
      } else {
        ++scan.vertices;
      }
      p = skip_statement(p, end);
    } else if (*p == 'f' && (short_word || (p[1] == 'o' && is_blank(p[2])))) {
      ++scan.faces;
      p = skip_statement(p, end);
    } else if ((*p == 'l' || *p == 'p') && short_word) {
      p = skip_statement(p, end);
    } else {
      const char* at = p;
      if (*p == 'v' && p[1] == 't' && ends_token(p[2])) {
        ++scan.texture_points;
      } else if (take_statement(at, "o")) {
        say(ObjWord::kObject, at);
      } else if (take_statement(at, "g")) {
        say(ObjWord::kGroup, at);
      } else if (take_statement(at, "usemtl")) {
        say(ObjWord::kMaterial, at);
      } else if (take_statement(at, "mtllib")) {
        say(ObjWord::kLibrary, at);
      }
      p = next_line(p, end);
    }
  }
}

/// Puts together what the chunks hold.
class ObjAttributeReader {
 public:
  ObjAttributeReader(const ReaderInput& input, MeshFile& file)
      : input_(input), file_(file), library_(input, file) {}

  Result<void> read() {
    const std::vector<const char*> cuts = cut_statements(input_.text, input_.options.chunk_bytes);
    ChunksEnd chunks_end;
    starts_.reserve(cuts.size());
    const bool looks = input_.options.attributes;
    read_chunks<ObjScan>(
        input_, cuts, chunks_end,
        [looks](const char* begin, const char* end, ObjScan& scan) {
          scan_chunk(begin, end, looks, scan);
        },
        [this](const ObjScan& scan) { append_scan(scan); });
    if (auto status = chunks_end.status(input_); !status) return status;
    take_parts();
    if (!looks) return {};
    take_colours();
    if (auto done = take_materials(); !done) return done;
    return read_obj_corners(input_, cuts, starts_, library_.materials(), file_);
  }

 private:
  void append_scan(const ObjScan& scan);
  void take_parts();
  void take_colours();
  Result<void> take_materials();

  const ReaderInput& input_;
  MeshFile& file_;
  MtlLibrary library_;
  std::vector<ObjChunkStart> starts_{{}};  ///< of each chunk and the end
  std::vector<ObjStatement> statements_;
  std::vector<glm::vec3> colours_;
};

void ObjAttributeReader::append_scan(const ObjScan& scan) {
  const ObjChunkStart start = starts_.back();
  for (ObjStatement statement : scan.statements) {
    statement.faces += start.faces;
    statements_.push_back(statement);
  }
  if (!scan.colours.empty()) {
    colours_.resize(start.vertices, kNoColour);
    colours_.insert(colours_.end(), scan.colours.begin(), scan.colours.end());
  }
  starts_.push_back({start.faces + scan.faces, start.vertices + scan.vertices,
                     start.texture_points + scan.texture_points});
}

/// A part is an object, or a group of one. Faces before any name are of the group "default".
void ObjAttributeReader::take_parts() {
  MeshAttributes& all = file_.attributes;
  const std::uint64_t faces = starts_.back().faces;
  std::string object, group;
  std::unordered_map<std::string, std::uint32_t> numbers;
  bool named = false;
  const auto end_part = [&](std::uint64_t first, std::uint64_t end) {
    if (first == end) return;
    std::string name = object.empty()                     ? group
                       : group.empty() || group == object ? object
                                                          : object + "/" + group;
    named = named || !name.empty();
    if (name.empty()) name = "default";
    const auto [found, is_new] =
        numbers.try_emplace(std::move(name), static_cast<std::uint32_t>(all.parts.size()));
    if (is_new) all.parts.push_back({found->first, {}});
    const bool same = !all.part_ranges.empty() && all.part_ranges.back().index == found->second;
    if (!same) all.part_ranges.push_back({first, found->second});
  };
  std::uint64_t first = 0;
  for (const ObjStatement& statement : statements_) {
    if (statement.word != ObjWord::kObject && statement.word != ObjWord::kGroup) continue;
    end_part(first, statement.faces);
    first = statement.faces;
    if (statement.word == ObjWord::kObject) {
      object = statement.name;
      group.clear();
    } else {
      group = statement.name;
    }
  }
  end_part(first, faces);
  if (!named) all.parts.clear(), all.part_ranges.clear();
}

void ObjAttributeReader::take_colours() {
  if (colours_.empty()) return;
  colours_.resize(starts_.back().vertices, kNoColour);
  float most = 0.0f;
  for (const glm::vec3& colour : colours_) {
    most = std::max({most, colour.x, colour.y, colour.z});
  }
  const float scale = colour_scale(most);
  std::vector<glm::u8vec4>& colours = file_.attributes.vertex_colours;
  colours.reserve(colours_.size());
  for (const glm::vec3& colour : colours_) {
    colours.push_back(colour.x < 0.0f ? glm::u8vec4(255)
                                      : glm::u8vec4(colour_byte(scale * colour.x),
                                                    colour_byte(scale * colour.y),
                                                    colour_byte(scale * colour.z), 255));
  }
  colours_ = {};
  input_.dropped->remove_from(colours);
}

Result<void> ObjAttributeReader::take_materials() {
  const bool any = std::any_of(statements_.begin(), statements_.end(), [](const auto& statement) {
    return statement.word == ObjWord::kMaterial;
  });
  for (const ObjStatement& statement : statements_) {
    if (!any || statement.word != ObjWord::kLibrary) continue;
    if (auto done = library_.open(statement.name); !done) return done;
  }
  MeshAttributes& all = file_.attributes;
  std::vector<bool> used(library_.materials().size());
  for (const ObjStatement& statement : statements_) {
    if (statement.word != ObjWord::kMaterial) continue;
    auto& ranges = all.material_ranges;
    if (!ranges.empty() && ranges.back().first == statement.faces) ranges.pop_back();
    ranges.push_back({statement.faces, library_.number_of(statement.name)});
  }
  for (std::size_t i = 0; i < all.material_ranges.size(); ++i) {
    const auto [first, index] = all.material_ranges[i];
    if (index != MeshAttributes::kNone && first < starts_.back().faces) used[index] = true;
  }
  return library_.finish(used);
}

}  // namespace

Result<void> read_obj_attributes(const ReaderInput& input, MeshFile& file) {
  Execution quiet = input.execution;  // the first reading has told of its progress
  quiet.progress = {};
  const ReaderInput again{input.text,    input.name, input.options, quiet,
                          input.skipped, input.path, input.dropped};
  return ObjAttributeReader(again, file).read();
}

}  // namespace strata::detail
