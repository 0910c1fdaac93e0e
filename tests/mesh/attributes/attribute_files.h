#pragma once

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "strata/mesh/formats/read_mesh.h"
#include "tests/support/temporary_folder.h"

/// Helpers for the tests of parts and colours.
namespace strata::testing_attributes {

/// A file's mesh with its attributes, which must be there.
inline MeshFile with_attributes(MeshFormat format, std::string_view text,
                                std::size_t chunk_bytes = std::size_t{1} << 19) {
  MeshReadOptions options;
  options.format = format;
  options.attributes = true;
  options.chunk_bytes = chunk_bytes;
  auto read = parse_mesh(text, "file", options);
  EXPECT_TRUE(read.has_value()) << (read ? "" : read.error().message);
  return read ? *std::move(read) : MeshFile{};
}

/// Of each face element, the name of its part; "-" for none.
inline std::vector<std::string> part_names_of(const MeshFile& file) {
  std::vector<std::string> names;
  for (std::uint64_t e = 0; e < file.stats.faces; ++e) {
    const std::uint32_t part = file.attributes.part_of(e);
    names.push_back(part == MeshAttributes::kNone ? "-" : file.attributes.parts[part].name);
  }
  return names;
}

/// Of each face element, the name of its material; "-" for none.
inline std::vector<std::string> material_names_of(const MeshFile& file) {
  std::vector<std::string> names;
  for (std::uint64_t e = 0; e < file.stats.faces; ++e) {
    const std::uint32_t material = file.attributes.material_of(e);
    names.push_back(material == MeshAttributes::kNone ? "-"
                                                      : file.attributes.materials[material].name);
  }
  return names;
}

using Names = std::vector<std::string>;

/// Files in a folder of the test's own.
class AttributeFiles : public testing::Test {
 protected:
  /// Reads a file of the folder with its attributes.
  Result<MeshFile> read(const std::string& name, MeshReadOptions options = {}) const {
    options.attributes = true;
    return read_mesh(folder_.file(name), options);
  }
  MeshFile good(const std::string& name, const MeshReadOptions& options = {}) const {
    auto file = read(name, options);
    EXPECT_TRUE(file.has_value()) << (file ? "" : file.error().message);
    return file ? *std::move(file) : MeshFile{};
  }
  testkit::TemporaryFolder folder_;
};

}  // namespace strata::testing_attributes
