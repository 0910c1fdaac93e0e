#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include "bench/other_readers.h"

namespace strata::bench {

OtherMesh read_by_openmesh(const std::string& path) {
  using Mesh = OpenMesh::TriMesh_ArrayKernelT<>;
  auto mesh = std::make_shared<Mesh>();
  OpenMesh::IO::Options options;
  if (!OpenMesh::IO::read_mesh(*mesh, path, options)) return {};
  return {mesh->n_vertices(), mesh->n_faces(), mesh};
}

}  // namespace strata::bench
