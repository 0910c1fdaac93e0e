#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <string>
#include <string_view>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/read_mesh.h"

namespace strata {

/// Aborts unless `condition` holds, so that a fuzzer notices.
inline void must(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "violated: %s\n", what);
  std::abort();
}

/// What MeshAttributes promises.
inline void check_attributes(const MeshFile& file) {
  const MeshAttributes& all = file.attributes;
  std::set<std::string> names;
  for (const MeshPart& part : all.parts) {
    must(names.insert(part.name).second, "names of parts are unique");
  }
  const auto ranges_hold = [&](const auto& ranges, std::size_t count) {
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      must(i == 0 || ranges[i].first > ranges[i - 1].first, "ranges increase");
      must(ranges[i].index == MeshAttributes::kNone || ranges[i].index < count, "ranges have one");
    }
  };
  ranges_hold(all.part_ranges, all.parts.size());
  ranges_hold(all.material_ranges, all.materials.size());
  must(all.vertex_colours.empty() || all.vertex_colours.size() == file.soup.positions.size(),
       "every vertex has a colour");
  must(all.element_colours.empty() || all.element_colours.size() == file.stats.faces,
       "every face has a colour");
}

/// Reads the attributes; the mesh must be the same, and pieces must give the same attributes.
inline void fuzz_attributes(const MeshFile& plain, MeshFormat format, std::string_view bytes,
                            const Execution& execution) {
  MeshReadOptions options;
  options.format = format;
  options.attributes = true;
  const auto file = parse_mesh(bytes, "input", options, execution);
  options.chunk_bytes = 9;
  const auto pieces = parse_mesh(bytes, "input", options, execution);
  must(file && pieces, "attributes refuse no file");
  must(file->soup.triangles == plain.soup.triangles && file->soup.positions == plain.soup.positions,
       "attributes change no mesh");
  check_attributes(*file);
  check_attributes(*pieces);
  const MeshAttributes &a = file->attributes, &b = pieces->attributes;
  const auto same = [](const auto& x, const auto& y) {
    return x.first == y.first && x.index == y.index;
  };
  must(std::ranges::equal(a.part_ranges, b.part_ranges, same) &&
           std::ranges::equal(a.material_ranges, b.material_ranges, same) &&
           a.vertex_colours == b.vertex_colours && a.element_colours == b.element_colours &&
           file->stats.warnings == pieces->stats.warnings,
       "pieces have the same attributes");
}

/// Reads the bytes; what comes back must keep every promise of MeshFile.
inline int fuzz_reader(MeshFormat format, const std::uint8_t* data, std::size_t size) {
  MeshReadOptions options;
  options.format = format;
  Execution execution;
  execution.threads = 1;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto file = parse_mesh(bytes, "input", options, execution);
  // In pieces of a few bytes it must be the same.
  options.chunk_bytes = 9;
  const auto pieces = parse_mesh(bytes, "input", options, execution);
  must(file.has_value() == pieces.has_value(), "pieces are read or refused as the whole");
  if (!file) {
    must(file.error().message == pieces.error().message, "pieces are refused for the same reason");
    must(file.error().code == ErrorCode::kInput, "a refusal is kInput");
    must(file.error().message.starts_with("input"), "a refusal names the file");
    return 0;
  }
  const TriangleSoup& soup = file->soup;
  must(soup.positions == pieces->soup.positions && soup.triangles == pieces->soup.triangles &&
           soup.face_elements == pieces->soup.face_elements,
       "pieces make the same mesh");
  must(!soup.triangles.empty(), "a mesh has triangles");
  must(soup.triangles.size() == file->stats.triangles, "triangles are counted");
  must(soup.positions.size() == file->stats.vertices, "vertices are counted");
  must(soup.face_elements.empty() || soup.face_elements.size() == soup.triangles.size(),
       "every triangle has its element");
  for (const glm::uvec3& t : soup.triangles) {
    must(t.x < soup.positions.size() && t.y < soup.positions.size() && t.z < soup.positions.size(),
         "indices are in range");
    must(t.x != t.y && t.y != t.z && t.z != t.x, "corners differ");
  }
  for (const std::uint32_t element : soup.face_elements) {
    must(element < file->stats.faces, "elements are in range");
  }
  for (const glm::dvec3& p : soup.positions) {
    must(p.x - p.x == 0.0 && p.y - p.y == 0.0 && p.z - p.z == 0.0, "positions are finite");
  }
  fuzz_attributes(*file, format, bytes, execution);
  must(diagnose(soup, execution).closed == is_closed(soup, execution), "both ways find it closed");
  return 0;
}

}  // namespace strata
