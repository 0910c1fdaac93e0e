#pragma once

#include <array>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/grid.h"
#include "voxelize/volume/read_context.h"

namespace strata {

/// The parts of an OpenVDB file that stand before and between its trees: io/Archive.cc,
/// io/GridDescriptor.cc, MetaMap.cc, math/Maps.h of OpenVDB 10. (Internal to voxelize/readers.)

/// The type of a tree's values.
enum class VdbType { kMask, kBool, kInt32, kInt64, kFloat, kDouble, kVec3s };
/// Bytes of a value as inner nodes hold it.
[[nodiscard]] std::size_t bytes_of(VdbType type);
/// "mask", "bool", "int32", ...
[[nodiscard]] std::string_view name_of(VdbType type);

/// A grid of a file.
struct VdbGridEntry {
  std::string name, tree_type, parent;  ///< `parent`: another grid, whose tree this one shares
  std::uint64_t grid_at = 0, blocks_at = 0;
};

/// What stands before a tree.
struct VdbGridHead {
  std::uint32_t compression = 0;
  std::map<std::string, std::string> metadata;  ///< by name: the bytes of the value
  glm::dvec3 voxel_size{1.0}, centre{0.0};      ///< of index (0, 0, 0): its voxel's centre
  glm::dmat3 steps{1.0};                        ///< columns: from an index to the next
  std::string note;                             ///< where the transform is more than that
  std::uint64_t tree_at = 0;
};

/// All grids of a file. @return kInput naming the byte
Result<std::vector<VdbGridEntry>> read_vdb_entries(const ReadContext& context);
/// @return kInput
Result<VdbGridHead> read_vdb_head(const ReadContext& context, const VdbGridEntry& entry);

/// The types whose trees are read, of branching 5, 4, 3; nothing for others.
struct VdbTreeType {
  bool read = false;
  VdbType type = VdbType::kMask;
  bool half = false;  ///< values of leaves and tiles are halves
};
[[nodiscard]] VdbTreeType vdb_tree_type(std::string_view name);

/// Compressed lists of values: io/Compression.h. Of a tree. Three floats are light of red, green
/// and blue: their value is 1 and the packed colour, where they are active, else 0.
class VdbValueLists {
 public:
  VdbValueLists(VdbTreeType type, std::uint32_t compression)
      : type_(type), compression_(compression) {}

  void set_background(float background) { background_ = background; }
  /// Moves past a list of `count` values, whose active ones are in `mask`.
  void skip(ByteCursor& cursor, std::span<const std::uint64_t> mask) const;
  /// The values of such a list, 64 for each word of `mask`. @return an empty text, or what is wrong
  std::string read(ByteCursor& cursor, std::span<const std::uint64_t> mask, float* values) const;
  /// One value as it stands in a root.
  [[nodiscard]] float one(ByteCursor& cursor) const;

  [[nodiscard]] bool colours() const { return type_.type == VdbType::kVec3s; }

 private:
  struct Head {
    std::uint8_t kind = 0;
    float inactive[2] = {0.0f, 0.0f};
    std::string_view selection{};
    std::size_t count = 0;  // of values that follow
  };
  [[nodiscard]] Head head(ByteCursor& cursor, std::span<const std::uint64_t> mask) const;
  [[nodiscard]] std::size_t stored_bytes() const { return type_.half ? 2 : bytes_of(type_.type); }
  [[nodiscard]] float number(const std::byte* from) const;

  VdbTreeType type_;
  std::uint32_t compression_;
  float background_ = 0.0f;
};

}  // namespace strata
