#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/info/check_report.h"
#include "apps/session/json_writer.h"
#include "strata/mesh/mesh_file.h"
#include "strata/mesh/soup_tools.h"

namespace strata::apps {

/// What `strata info` tells of parts, materials and colours.
struct AttributeFacts {
  struct Part {
    std::string name;
    std::uint64_t triangles = 0;
    Bounds bounds;
    std::optional<bool> closed;  ///< empty: there are too many to look
  };
  struct Picture {
    std::string name;
    int width = 0, height = 0;
  };
  std::vector<Part> parts;
  std::vector<SurfaceMaterial> materials;
  std::vector<Picture> textures;
  std::vector<std::string> missing;  ///< sentences: files that are not there
  bool vertex_colours = false, face_colours = false, corner_colours = false;
};

/// Looks at the attributes of a file. @param closed  the whole mesh is
AttributeFacts look_at_attributes(const MeshFile& file, bool closed, const Execution& execution);

/// The lines of the report.
[[nodiscard]] ReportLines attribute_lines(const AttributeFacts& facts);
/// The members of a file's report.
void write_attributes(JsonWriter& json, const AttributeFacts& facts);

}  // namespace strata::apps
