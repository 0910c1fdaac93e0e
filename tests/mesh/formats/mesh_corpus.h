#pragma once

#include <filesystem>
#include <string>
#include <vector>

/// Public meshes that may be on this machine; none is part of the project.
namespace strata::testing_mesh {

struct CorpusFile {
  std::string name;  ///< "cgal/cube.off": source and file name, for tables and messages
  std::filesystem::path path;
};

/// Obj, stl, ply and off files of the Debian packages assimp-testmodels, openscad-testing-data and
/// libcgal-demo, and of the shared models beside the project, sorted by name. Empty when none is
/// there. The archive of libcgal-demo is unpacked into `scratch`.
std::vector<CorpusFile> corpus_files(const std::filesystem::path& scratch);

}  // namespace strata::testing_mesh
