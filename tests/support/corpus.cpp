#include "tests/support/corpus.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <system_error>
#include <utility>

#include "strata/mesh/formats/read_mesh.h"
#include "tests/support/temporary_folder.h"

namespace strata::testkit {
namespace {

namespace fs = std::filesystem;

/// libcgal-demo ships its data packed. Empty where it is not installed.
const fs::path& cgal_data() {
  static const TemporaryFolder folder;
  static const fs::path path = [] {
    const fs::path archive = "/usr/share/doc/libcgal-dev/data.tar.gz";
    std::error_code absent;
    if (!fs::exists(archive, absent)) return fs::path();
    const std::string command =
        "tar -xzf '" + archive.string() + "' -C '" + folder.path().string() + "'";
    return std::system(command.c_str()) == 0 ? folder.path() : fs::path();
  }();
  return path;
}

}  // namespace

const std::vector<CorpusFile>& mesh_files() {
  static const std::vector<CorpusFile> files = [] {
    std::vector<CorpusFile> found;
    for (const auto& [source, folder] :
         {std::pair<std::string, fs::path>("models", STRATA_SOURCE_DIR "/../shared/models"),
          {"assimp", "/usr/share/assimp/models"},
          {"openscad", "/usr/share/openscad"},
          {"cgal", cgal_data()}}) {
      std::error_code error;
      for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end;
           it.increment(error)) {
        if (!it->is_regular_file(error)) continue;
        const MeshFormat format = mesh_format_of(it->path().string());
        if (format == MeshFormat::kAuto || format == MeshFormat::kGltf) continue;
        found.push_back({source + "/" + it->path().filename().string(), it->path()});
      }
    }
    std::sort(found.begin(), found.end(), [](const CorpusFile& a, const CorpusFile& b) {
      return std::pair(a.name, a.path) < std::pair(b.name, b.path);
    });
    return found;
  }();
  return files;
}

std::vector<CorpusFile> gltf_files() {
  std::vector<CorpusFile> found;
  const fs::path folder = "/usr/share/assimp/models";
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    if (mesh_format_of(it->path().string()) != MeshFormat::kGltf) continue;
    found.push_back({it->path().lexically_relative(folder).string(), it->path()});
  }
  return found;
}

const std::vector<CorpusScene>& scene_files() {
  static const std::vector<CorpusScene> scenes = [] {
    const fs::path folder = "/usr/share/openscad";
    std::map<std::string, fs::path> folder_of;
    std::vector<CorpusScene> found;
    std::error_code error;
    for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end;
         it.increment(error)) {
      const fs::path& path = it->path();
      if (path.extension() == ".scad") folder_of[path.stem()] = path.parent_path();
      if (path.extension() != ".csg") continue;
      const std::string stem = path.stem();
      found.push_back({stem.substr(0, stem.rfind("-expected")), path, folder});
    }
    for (CorpusScene& scene : found) {
      if (const auto at = folder_of.find(scene.name); at != folder_of.end()) {
        scene.assets = at->second;
      }
    }
    std::sort(found.begin(), found.end(),
              [](const CorpusScene& a, const CorpusScene& b) { return a.file < b.file; });
    return found;
  }();
  return scenes;
}

std::vector<NamedMesh> real_meshes(std::size_t max_triangles) {
  std::vector<NamedMesh> meshes;
  for (const CorpusFile& entry : mesh_files()) {
    auto file = read_mesh(entry.path.string());
    if (!file || file->soup.triangles.size() > max_triangles) continue;
    meshes.push_back({entry.name, std::move(file->soup)});
  }
  return meshes;
}

std::vector<NamedMesh> scans(std::initializer_list<const char*> stems) {
  std::vector<NamedMesh> meshes;
  for (const std::string stem : stems) {
    auto file = read_mesh((cgal_data() / "data/meshes" / (stem + ".off")).string());
    if (file) meshes.push_back({stem, std::move(file->soup)});
  }
  return meshes;
}

}  // namespace strata::testkit
