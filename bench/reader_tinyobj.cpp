#include <tiny_obj_loader.h>

#include "bench/other_readers.h"

namespace strata::bench {

OtherMesh read_by_tinyobj(const std::string& path) {
  auto reader = std::make_shared<tinyobj::ObjReader>();
  tinyobj::ObjReaderConfig config;
  config.triangulate = true;
  config.vertex_color = false;
  if (!reader->ParseFromFile(path, config)) return {};
  OtherMesh mesh;
  mesh.vertices = reader->GetAttrib().vertices.size() / 3;
  for (const tinyobj::shape_t& shape : reader->GetShapes()) {
    mesh.triangles += shape.mesh.num_face_vertices.size();
  }
  mesh.data = reader;
  return mesh;
}

}  // namespace strata::bench
