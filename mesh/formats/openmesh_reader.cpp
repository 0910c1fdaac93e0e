#include "mesh/formats/openmesh_reader.h"

#include <OpenMesh/Core/IO/MeshIO.hh>  // must precede the mesh headers: it registers the formats
#include <exception>

#include "strata/mesh/openmesh_bridge.h"

namespace strata {

Result<MeshFile> read_with_openmesh(const std::string& path, const MeshReadOptions& options,
                                    const Execution& execution) {
  const MeshFormat format = mesh_format_of(path);
  if (path == "-" || format == MeshFormat::kAuto || format == MeshFormat::k3mf ||
      format == MeshFormat::kAmf || format == MeshFormat::kGltf ||
      (options.format != MeshFormat::kAuto && options.format != format)) {
    return fail(ErrorCode::kUsage, "{}: OpenMesh takes the format from the extension of a file",
                path);
  }
  MeshReadOptions own = options;
  own.reader = MeshReader::kOwn;
  auto checked = read_mesh(path, own, execution);
  if (!checked) {
    checked.error().message += " (so OpenMesh was not asked)";
    return checked;
  }
  try {
    const detail::QuietOpenMesh quiet;
    OpenMeshPolyMesh mesh;
    OpenMesh::IO::Options flags;
    if (!OpenMesh::IO::read_mesh(mesh, path, flags)) {
      return fail(ErrorCode::kInput, "{}: OpenMesh cannot read it, our own reader can", path);
    }
    MeshFile file;
    file.soup = from_openmesh(mesh);
    if (file.soup.triangles.empty()) {
      return fail(ErrorCode::kInput, "{}: OpenMesh found no faces, our own reader did", path);
    }
    file.stats.format = std::string(mesh_format_name(format)) + " (OpenMesh)";
    file.stats.bytes = checked->stats.bytes;
    file.stats.vertices = mesh.n_vertices();
    file.stats.faces = mesh.n_faces();
    file.stats.triangles = file.soup.triangles.size();
    return file;
  } catch (const std::exception& error) {
    return fail(ErrorCode::kInput, "{}: OpenMesh: {}", path, error.what());
  }
}

}  // namespace strata
