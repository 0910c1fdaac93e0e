#pragma once

#include <string>
#include <string_view>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/mesh/mesh_file.h"

namespace strata {

/// Reads the triangles of a mesh file. Polygons are cut by PolygonCutter: flat convex ones are fans
/// from their first corner, others Delaunay triangles or at least triangles that do not overlap;
/// all share the face element. STL corners are welded by exact position (-0 equals +0). Vertices
/// keep the order of the file. Text may begin with a UTF-8 byte order mark. Counts in headers are
/// not trusted: the reader allocates no more than the bytes of the file can fill. The result does
/// not depend on the number of threads.
/// @param path  a file, or "-" for standard input, which needs options.format. Else the format is
/// that of the name, or for a name that says nothing what the content looks like.
/// @return kInput, with line or byte: no such file, unknown format, empty, malformed, truncated,
/// UTF-16 text, no vertices, no usable face, or with `strict` a face that had to be dropped;
/// kUsage: "-" without a format or with an archive's, a library not in this build; kLimit: more
/// than 2^32 - 2 vertices, memory; kCancelled. The file must not be changed by others meanwhile.
Result<MeshFile> read_mesh(const std::string& path, const MeshReadOptions& options = {},
                           const Execution& execution = {});

/// The same for bytes in memory. @param name  stands for the path in messages
/// @pre options.format is not kAuto, k3mf or kAmf; options.reader is kOwn
Result<MeshFile> parse_mesh(std::string_view bytes, const std::string& name,
                            const MeshReadOptions& options, const Execution& execution = {});

/// The format for a path's extension, in any letter case; kAuto when it names none.
[[nodiscard]] MeshFormat mesh_format_of(std::string_view path);

/// The same, and for a name that says nothing what the content looks like; kAuto when there is no
/// such file, it is no regular one, or it looks like none.
[[nodiscard]] MeshFormat mesh_format_of_file(const std::string& path);

/// "obj", "stl", "ply", "off", "3mf", "amf", "gltf", "glb"; kAuto for any other name.
[[nodiscard]] MeshFormat mesh_format_named(std::string_view name);

/// The inverse of mesh_format_named; "auto" for kAuto.
[[nodiscard]] const char* mesh_format_name(MeshFormat format);

}  // namespace strata
