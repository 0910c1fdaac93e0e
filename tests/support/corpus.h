#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

#include "strata/mesh/triangle_soup.h"

// Real files of Debian packages, those that are installed (group corpus of cmake/packages.txt).
// Tests that need some skip with the reason when none is there.

namespace strata::testkit {

struct NamedMesh {
  std::string name;
  TriangleSoup mesh;
};

struct CorpusFile {
  std::string name;  ///< "cgal/cube.off": source and file name, for tables and messages
  std::filesystem::path path;
};

/// Meshes of assimp-testmodels (`assimp/`), libcgal-demo (`cgal/`) and openscad-testing-data
/// (`openscad/`), and, where the folder shared/models lies beside the checkout, its (`models/`),
/// sorted by name. The archive of libcgal-demo is unpacked for as long as the process lives.
[[nodiscard]] const std::vector<CorpusFile>& mesh_files();

/// glTF files of assimp-testmodels, named by their paths below its folder.
[[nodiscard]] std::vector<CorpusFile> gltf_files();

/// Those of mesh_files() that the readers take and that have at most `max_triangles`.
[[nodiscard]] std::vector<NamedMesh> real_meshes(std::size_t max_triangles);

/// Meshes of libcgal-demo by their stems ("bunny00"), those that are there.
[[nodiscard]] std::vector<NamedMesh> scans(std::initializer_list<const char*> stems);

struct CorpusScene {
  std::string name;            ///< "union-tests"
  std::filesystem::path file;  ///< a .csg
  std::filesystem::path
      assets;  ///< where the program lies that it was dumped from, and its imports
};

/// What OpenSCAD's own tests expect `openscad -o x.csg` to write: of openscad-testing-data, sorted.
[[nodiscard]] const std::vector<CorpusScene>& scene_files();

inline constexpr char kNoScenes[] = "needs Debian's openscad-testing-data";
inline constexpr char kNoMeshes[] =
    "needs meshes of Debian's assimp-testmodels, libcgal-demo or openscad-testing-data";
inline constexpr char kNoScans[] = "needs Debian's libcgal-demo";

}  // namespace strata::testkit
