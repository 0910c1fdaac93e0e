#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/gltf/gltf_document.h"
#include "mesh/text/input_bytes.h"
#include "strata/core/execution.h"
#include "strata/core/file_identity.h"

/// Bytes of a glTF file: buffers, and the numbers that accessors find in them. Private to this
/// room.
namespace strata::detail {

/// Where the bytes of a file come from.
struct GltfSource {
  std::string name;         ///< for messages
  std::string folder;       ///< of files that it names
  bool may_name = true;     ///< false: it comes from standard input, so there is no folder
  std::string root;         ///< the other files must lie in it; empty: anywhere
  std::string_view binary;  ///< the chunk of a .glb
  bool has_binary = false;
};

/// Who needs bytes, for messages.
struct GltfUser {
  const std::string& file;
  const char* list;
  std::uint32_t index;
  const char* within = "";
  [[nodiscard]] std::string text() const;
};

/// Whether a URI holds the bytes themselves.
inline bool is_data(std::string_view uri) { return uri.starts_with("data:"); }

/// Text of base64 as bytes. @return false: a wrong letter, or a wrong end
bool decode_base64(std::string_view text, std::string& bytes);

/// Reads buffers when they are first used. Its functions throw GltfRefusal and std::bad_alloc.
class GltfData {
 public:
  GltfData(const GltfDocument& document, GltfSource source, const Execution& execution)
      : document_(document), source_(std::move(source)), execution_(execution) {}

  /// Checks that the bytes of an accessor are there.
  void check(std::uint32_t accessor) { elements(accessor); }
  /// Elements [first, first + count) of an accessor, `components` numbers each; normalized integers
  /// become -1 to 1. @param values  room for count * components numbers
  void read(std::uint32_t accessor, int components, std::uint64_t first, std::uint64_t count,
            double* values);
  /// All elements, `components` numbers each.
  std::vector<double> read_all(std::uint32_t accessor, int components);
  /// All whole numbers of an accessor of scalars.
  std::vector<std::uint32_t> read_indices(std::uint32_t accessor);
  /// The bytes of an image. @return kInput where they cannot be had: looks are not needed
  Result<std::string> read_image(std::uint32_t image);

  [[nodiscard]] const GltfAccessor& accessor(std::uint32_t index) const {
    return document_.accessors[index];
  }
  [[nodiscard]] const std::string& name() const { return source_.name; }
  [[nodiscard]] const Execution& execution() const { return execution_; }
  [[nodiscard]] const std::vector<FileIdentity>& opened() const { return opened_; }

 private:
  struct Elements {
    const unsigned char* first = nullptr;  ///< null: all are 0
    std::uint64_t stride = 0;
  };
  std::string_view buffer(std::uint32_t index);
  std::string_view view(std::uint32_t index, const GltfUser& user);
  Elements elements(std::uint32_t view, std::uint64_t offset, std::uint64_t count,
                    std::uint64_t bytes, bool strided, const GltfUser& user);
  Elements elements(std::uint32_t accessor);
  InputBytes open_file(const std::string& uri, const GltfUser& user);
  void replace_sparse(std::uint32_t accessor, int components, std::uint64_t first,
                      std::uint64_t count, double* values);

  const GltfDocument& document_;
  GltfSource source_;
  const Execution& execution_;
  std::map<std::uint32_t, InputBytes> files_;
  std::map<std::uint32_t, std::string> decoded_;
  std::vector<FileIdentity> opened_;
};

}  // namespace strata::detail
