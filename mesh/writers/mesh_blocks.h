#pragma once

#include <cstdint>
#include <cstring>
#include <functional>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/atomic_file.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/mesh/solid_mesh.h"
#include "strata/mesh/writers/write_solid.h"

// A file as a row of blocks, which several threads make and one writes; what formats share.

namespace strata::detail {

/// Appends the bytes of a block to `out`. Several threads call blocks at once.
using MakeBlock = std::function<void(std::string& out)>;
struct Block {
  MakeBlock make;
  std::size_t elements = 0;  ///< vertices or triangles, or as much text
};
using Blocks = std::vector<Block>;

/// Adds a block of given bytes.
void add_text(Blocks& blocks, std::string text);

/// Adds blocks for the elements [0, count), `per_block` in each.
template <class Make>
void add_ranges(Blocks& blocks, std::size_t count, std::size_t per_block, const Make& make) {
  for (std::size_t first = 0; first < count; first += per_block) {
    const std::size_t last = std::min(count, first + per_block);
    blocks.push_back(
        {[make, first, last](std::string& out) { make(first, last, out); }, last - first});
  }
}

/// Elements of a block: about half a megabyte of text.
inline constexpr std::size_t kBlockElements = 1 << 14;

/// The same bytes in blocks of about kBlockElements: a file of many small parts has many small
/// blocks.
[[nodiscard]] Blocks joined(Blocks blocks);

/// Makes the blocks on all threads, some of them at a time, and gives their bytes to `take` in
/// their order. @return what `take` returns when it fails; kCancelled
Result<void> make_in_order(const Blocks& blocks, const Execution& execution,
                           const std::function<Result<void>(std::string& bytes)>& take);

/// Writes the blocks to a file, which appears when all is written.
Result<void> write_blocks(const std::string& path, Blocks blocks, const Execution& execution);

void add_number(std::string& out, double value);          ///< the shortest text that gives it back
void add_integer(std::string& out, std::uint64_t value);  ///< decimal
void add_vector(std::string& out, const glm::dvec3& v);   ///< "x y z"

/// Appends the bytes of a number, the lowest first.
template <class T>
void add_bytes(std::string& out, T value) {
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);  // the machines that Strata runs on are little-endian
  out.append(bytes, sizeof value);
}

/// Red, green, blue, alpha.
using Colour = glm::u8vec4;
inline std::uint32_t packed(const Colour& c) {
  return std::uint32_t{c.r} << 24 | std::uint32_t{c.g} << 16 | std::uint32_t{c.b} << 8 | c.a;
}

/// The colour of each part; empty if no part has one.
std::vector<Colour> part_colours(const SolidMesh& mesh);

/// The part of a triangle.
inline std::uint32_t part_of(const SolidMesh& mesh, std::size_t triangle) {
  return mesh.part_of.empty() ? 0 : mesh.part_of[triangle];
}

/// A name on one line: control characters become blanks, bytes that are not UTF-8 question marks.
std::string one_line(std::string_view name);

// Each format in a file of its own. The mesh is valid.
Result<void> write_solid_3mf(const std::string& path, const SolidMesh& mesh,
                             const SolidWriteOptions& options, const Execution& execution);
Result<void> write_solid_obj(const std::string& path, const SolidMesh& mesh,
                             const SolidWriteOptions& options, const Execution& execution);

}  // namespace strata::detail
