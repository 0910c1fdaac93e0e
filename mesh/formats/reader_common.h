#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/reserve_large.h"
#include "mesh/no_vertex.h"
#include "mesh/text/reader_input.h"
#include "strata/core/result.h"

/// Shared by the readers of this folder; private.
namespace strata::detail {

/// The unchecked contents of a file: indices may be out of range, coordinates not finite. The
/// reader sets `stats.faces` and the counts that only it knows (too_few_vertices, ignored).
struct RawMesh {
  TriangleSoup soup;
  MeshReadStats stats;
  std::uint64_t first_short_face = 0;  ///< element of the first face with too few vertices
};

/// The place of a face element in the file, for messages ("bunny.obj:1204"), and its invalid vertex
/// as the file writes it (empty: the 0-based index).
struct FacePlace {
  std::string place;
  std::string vertex;
};
using LocateFace = std::function<FacePlace(std::uint32_t element)>;

/// The last step of every reader: drops and counts faces and vertices that a soup cannot keep,
/// collects warnings, and checks the whole. @return kInput when nothing is left, or when `strict`
/// is set and something was dropped
Result<MeshFile> finish_mesh(const ReaderInput& input, RawMesh&& raw, const LocateFace& locate);

/// "2 faces were dropped".
[[nodiscard]] std::string faces_text(std::uint64_t count);

Result<MeshFile> read_obj(const ReaderInput& input);
Result<MeshFile> read_stl(const ReaderInput& input);
Result<MeshFile> read_ply(const ReaderInput& input);
Result<MeshFile> read_off(const ReaderInput& input);
Result<MeshFile> read_gltf_mesh(const ReaderInput& input);

/// Whether a file has the size of a binary STL file with the number of triangles that it claims.
[[nodiscard]] bool is_binary_stl(std::string_view bytes);

/// Appends polygons as fans and keeps the number of their element, for readers that read face by
/// face. finish_mesh() cuts a polygon again if its fan is wrong.
class FanBuilder {
 public:
  explicit FanBuilder(RawMesh& mesh) : mesh_(mesh) {}
  /// Adds the next face element. @pre indices beyond 32 bits were replaced by kNoVertex
  void add(const std::uint32_t* corners, std::size_t count) {
    const std::uint64_t element = mesh_.stats.faces++;
    TriangleSoup& soup = mesh_.soup;
    if (count < 3) {
      if (mesh_.stats.too_few_vertices++ == 0) mesh_.first_short_face = element;
      return;
    }
    if (identity_ && (count > 3 || soup.triangles.size() != element)) {
      identity_ = false;
      soup.face_elements.resize(soup.triangles.size());
      for (std::size_t i = 0; i < soup.face_elements.size(); ++i) {
        soup.face_elements[i] = static_cast<std::uint32_t>(i);
      }
    }
    for (std::size_t i = 2; i < count; ++i) {
      soup.triangles.emplace_back(corners[0], corners[i - 1], corners[i]);
      if (!identity_) soup.face_elements.push_back(static_cast<std::uint32_t>(element));
    }
  }

 private:
  RawMesh& mesh_;
  bool identity_ = true;
};

}  // namespace strata::detail
