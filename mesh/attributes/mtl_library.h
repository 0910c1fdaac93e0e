#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/attributes/mtl_file.h"
#include "mesh/text/reader_input.h"
#include "strata/core/result.h"
#include "strata/mesh/mesh_file.h"

namespace strata::detail {

/// The materials that an OBJ file names, and their pictures. Files lie in the folder of the OBJ
/// file, or are named from there. A file that is not there is a sentence in MeshReadStats::missing;
/// one outside of MeshReadOptions::root is an error.
class MtlLibrary {
 public:
  /// Both must outlive the library.
  MtlLibrary(const ReaderInput& input, MeshFile& file) : input_(input), file_(file) {}

  /// Reads the files of an mtllib statement: `a.mtl b.mtl`, or one name with blanks.
  Result<void> open(std::string_view names);
  /// The number of a material; MeshAttributes::kNone, with a warning by finish(), if there is none.
  [[nodiscard]] std::uint32_t number_of(std::string_view name);
  /// Puts the materials into the attributes. Reads the pictures of those that are used.
  Result<void> finish(const std::vector<bool>& used);

  [[nodiscard]] const std::vector<MtlMaterial>& materials() const { return materials_; }

 private:
  [[nodiscard]] std::string find(std::string_view name, const std::string& beside) const;
  Result<void> check_root(const std::string& path, const char* what) const;
  Result<void> read_file(const std::string& name);
  Result<void> read_picture(MtlMaterial& material, const std::string& beside);
  Result<void> pass_over(const Error& error);
  void warn_of_unknown();

  const ReaderInput& input_;
  MeshFile& file_;
  std::vector<MtlMaterial> materials_;
  std::vector<std::string> homes_;  ///< of each material, the .mtl file
  std::map<std::string, std::uint32_t, std::less<>> numbers_;
  std::map<std::string, std::uint32_t> textures_;  ///< by path and wrap
  std::set<std::string> unknown_, had_;
  std::size_t damaged_ = 0;  ///< pictures
};

}  // namespace strata::detail
