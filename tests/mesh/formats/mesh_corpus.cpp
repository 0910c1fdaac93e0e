#include "tests/mesh/formats/mesh_corpus.h"

#include <algorithm>
#include <cstdlib>

#include "strata/mesh/formats/read_mesh.h"

namespace strata::testing_mesh {

std::vector<CorpusFile> corpus_files(const std::filesystem::path& scratch) {
  namespace fs = std::filesystem;
  std::vector<CorpusFile> files;
  const auto collect = [&files](const std::string& source, const fs::path& folder) {
    std::error_code reason;
    for (const auto& entry : fs::recursive_directory_iterator(folder, reason)) {
      if (!entry.is_regular_file(reason)) continue;
      if (mesh_format_of(entry.path().string()) == MeshFormat::kAuto) continue;
      files.push_back({source + "/" + entry.path().filename().string(), entry.path()});
    }
  };
  collect("models", STRATA_SOURCE_DIR "/../shared/models");
  collect("assimp", "/usr/share/assimp/models");
  collect("openscad", "/usr/share/openscad");
  const fs::path archive = "/usr/share/doc/libcgal-dev/data.tar.gz";
  std::error_code reason;
  if (fs::exists(archive, reason)) {
    fs::create_directories(scratch, reason);
    const std::string command = "tar -xzf '" + archive.string() + "' -C '" + scratch.string() + "'";
    if (std::system(command.c_str()) == 0) collect("cgal", scratch);
  }
  std::sort(files.begin(), files.end(), [](const CorpusFile& a, const CorpusFile& b) {
    return std::pair(a.name, a.path) < std::pair(b.name, b.path);
  });
  return files;
}

}  // namespace strata::testing_mesh
