#include "mesh/attributes/select_parts.h"

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>

#include "core/did_you_mean.h"
#include "core/printable.h"
#include "mesh/no_vertex.h"
#include "mesh/split_parts.h"

namespace strata::detail {
namespace {

/// Names of parts that a message lists.
constexpr std::size_t kMostListed = 12;
constexpr std::size_t kMostLetters = 100;

std::string list_of(const std::vector<MeshPart>& parts) {
  std::string list;
  for (std::size_t i = 0; i < parts.size() && i < kMostListed; ++i) {
    list += fmt::format("{}'{}'", i == 0 ? "" : ", ", printable(parts[i].name, kMostLetters));
  }
  if (parts.size() > kMostListed) list += fmt::format(" and {} more", parts.size() - kMostListed);
  return list;
}

/// Whether a name is that of a part, or of an object that the part is a group of.
bool names_part(std::string_view wanted, std::string_view part) {
  return part.starts_with(wanted) && (part.size() == wanted.size() || part[wanted.size()] == '/');
}

/// For each part, whether it is kept.
Result<std::vector<bool>> kept_parts(const std::vector<std::string>& wanted,
                                     const std::string& name, const std::vector<MeshPart>& parts) {
  std::vector<bool> kept(parts.size());
  for (const std::string& one : wanted) {
    bool found = false;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (!names_part(one, parts[i].name)) continue;
      found = kept[i] = true;
    }
    if (found) continue;
    if (parts.empty()) {
      return fail(ErrorCode::kInput, "{}: there is no part '{}': the file names no parts", name,
                  printable(one, kMostLetters));
    }
    std::vector<std::string_view> known;
    for (const MeshPart& part : parts) known.push_back(part.name);
    if (known.size() > 1000) known.clear();  // a list that nobody reads
    return fail(ErrorCode::kInput, "{}: there is no part '{}'{}; {} {}", name,
                printable(one, kMostLetters), printable(did_you_mean(one, known)),
                parts.size() == 1 ? "its part is" : "its parts are", list_of(parts));
  }
  return kept;
}

/// Gives the parts that are kept new numbers.
void renumber_parts(MeshAttributes& all, const std::vector<bool>& kept) {
  std::vector<std::uint32_t> numbers(kept.size(), MeshAttributes::kNone);
  std::vector<MeshPart> parts;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (!kept[i]) continue;
    numbers[i] = static_cast<std::uint32_t>(parts.size());
    parts.push_back(std::move(all.parts[i]));
  }
  all.parts = std::move(parts);
  std::vector<MeshAttributes::Range> ranges;
  for (MeshAttributes::Range range : all.part_ranges) {
    if (range.index != MeshAttributes::kNone) range.index = numbers[range.index];
    if (ranges.empty() || ranges.back().index != range.index) ranges.push_back(range);
  }
  all.part_ranges = std::move(ranges);
}

/// Keeps the triangles whose face element has a part.
void drop_triangles(TriangleSoup& soup, const MeshAttributes& all) {
  const std::vector<std::uint32_t> parts = parts_of_triangles(soup, all);
  std::vector<std::uint32_t> elements;
  std::size_t count = 0;
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    if (parts[t] == MeshAttributes::kNone) continue;
    soup.triangles[count++] = soup.triangles[t];
    elements.push_back(soup.face_elements.empty() ? static_cast<std::uint32_t>(t)
                                                  : soup.face_elements[t]);
  }
  if (count == soup.triangles.size()) return;
  soup.triangles.resize(count);
  soup.face_elements = std::move(elements);
}

/// Drops the vertices that no triangle uses.
void drop_vertices(TriangleSoup& soup, MeshAttributes& all) {
  std::vector<std::uint32_t> index(soup.positions.size(), kNoVertex);
  for (const glm::uvec3& t : soup.triangles) index[t.x] = index[t.y] = index[t.z] = 0;
  std::uint32_t count = 0;
  for (std::size_t v = 0; v < index.size(); ++v) {
    if (index[v] == kNoVertex) continue;
    index[v] = count;
    soup.positions[count] = soup.positions[v];
    if (!all.vertex_colours.empty()) all.vertex_colours[count] = all.vertex_colours[v];
    ++count;
  }
  soup.positions.resize(count);
  if (!all.vertex_colours.empty()) all.vertex_colours.resize(count);
  for (glm::uvec3& t : soup.triangles) t = {index[t.x], index[t.y], index[t.z]};
  for (MeshAttributes::Corner& corner : all.corners) {
    if (corner.vertex < index.size()) corner.vertex = index[corner.vertex];
  }
}

}  // namespace

Result<void> select_parts(const std::vector<std::string>& parts, const std::string& name,
                          MeshFile& file) {
  const auto kept = kept_parts(parts, name, file.attributes.parts);
  if (!kept) return tl::unexpected(kept.error());
  if (file.attributes.part_ranges.empty()) return {};  // there is one part, and it is kept
  renumber_parts(file.attributes, *kept);
  drop_triangles(file.soup, file.attributes);
  if (file.soup.triangles.empty()) {
    return fail(ErrorCode::kInput, "{}: no triangle of the part '{}' can be used", name,
                printable(parts.front(), kMostLetters));
  }
  drop_vertices(file.soup, file.attributes);
  file.stats.vertices = file.soup.positions.size();
  file.stats.triangles = file.soup.triangles.size();
  return {};
}

}  // namespace strata::detail
