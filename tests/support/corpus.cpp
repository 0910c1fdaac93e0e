#include "tests/support/corpus.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "strata/mesh/formats/read_mesh.h"

namespace strata::testkit {
namespace {

namespace fs = std::filesystem;

constexpr std::array kModelNames = {"beast", "beetle-alt",     "cow",     "fandisk", "rocker-arm",
                                    "spot",  "stanford-bunny", "suzanne", "teapot"};

std::vector<fs::path> mesh_files_under(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    if (it->is_regular_file(error) && mesh_format_of(it->path().string()) != MeshFormat::kAuto) {
      files.push_back(it->path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// libcgal-demo ships its data packed: unpacks them once into a folder that lives as long as the
/// process.
class UnpackedFolder {
 public:
  explicit UnpackedFolder(const fs::path& archive) {
    std::error_code error;
    if (!fs::exists(archive, error)) return;
    std::string pattern = (fs::temp_directory_path(error) / "strata-corpus-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) return;
    path_ = pattern;
    const std::string command = "tar -xzf '" + archive.string() + "' -C '" + pattern +
                                "' --wildcards '*/meshes/*' 2>/dev/null";
    unpacked_ = std::system(command.c_str()) == 0;
  }
  UnpackedFolder(const UnpackedFolder&) = delete;
  UnpackedFolder& operator=(const UnpackedFolder&) = delete;
  ~UnpackedFolder() {
    std::error_code error;
    if (!path_.empty()) fs::remove_all(path_, error);
  }
  [[nodiscard]] fs::path path() const { return unpacked_ ? path_ : fs::path(); }

 private:
  fs::path path_;
  bool unpacked_ = false;
};

}  // namespace

std::optional<TriangleSoup> shared_model(const std::string& stem) {
  const std::string path = std::string(STRATA_SOURCE_DIR "/../shared/models/") + stem + ".obj";
  std::error_code error;
  if (!fs::exists(path, error)) return std::nullopt;
  auto file = read_mesh(path);
  if (!file) return std::nullopt;
  return std::move(file->soup);
}

std::vector<NamedMesh> shared_models() {
  std::vector<NamedMesh> models;
  for (const char* name : kModelNames) {
    if (auto mesh = shared_model(name)) models.push_back({name, std::move(*mesh)});
  }
  return models;
}

std::vector<NamedMesh> debian_meshes(std::size_t max_triangles) {
  static const UnpackedFolder cgal("/usr/share/doc/libcgal-dev/data.tar.gz");
  std::vector<NamedMesh> meshes;
  for (const fs::path& folder :
       {fs::path("/usr/share/assimp/models"), cgal.path(), fs::path("/usr/share/openscad")}) {
    if (folder.empty()) continue;
    for (const fs::path& path : mesh_files_under(folder)) {
      auto file = read_mesh(path.string());
      if (!file || file->soup.triangles.size() > max_triangles) continue;
      meshes.push_back({path.filename().string(), std::move(file->soup)});
    }
  }
  return meshes;
}

}  // namespace strata::testkit
