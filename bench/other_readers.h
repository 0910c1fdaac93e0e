#pragma once

#include <cstddef>
#include <memory>
#include <string>

/// Readers of other libraries, as their users call them.
namespace strata::bench {

/// A mesh in a library's own form.
struct OtherMesh {
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  std::shared_ptr<void> data;  ///< kept until the clock has stopped
};

/// OpenMesh::IO::read_mesh into a TriMesh_ArrayKernelT<> with its default traits. STL vertices are
/// welded by it. triangles is 0 when it refuses the file.
OtherMesh read_by_openmesh(const std::string& path);

/// tinyobj::ObjReader with triangulation, in double as Debian also ships it, or float.
OtherMesh read_by_tinyobj(const std::string& path);

}  // namespace strata::bench
