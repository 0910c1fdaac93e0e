#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

// Memory of techniques that keep whole lists, in bytes, by the formulas of the papers, for pixels
// and fragments. The papers count bits: S. Lefebvre, S. Hornus, A. Lasram, "HA-Buffer" (2013),
// table of section 6, takes fragments of 24 + 32 bits; the techniques here keep 64.

namespace strata::transparency::list_bytes {

[[nodiscard]] constexpr std::uint64_t bytes(std::uint64_t bits) { return (bits + 7) / 8; }

/// Count, sum up, store: a fragment's bits; of a pixel its count and its base, 32 bits each. The
/// table of 2013 counts 32 a pixel.
[[nodiscard]] constexpr std::uint64_t count_scan(std::uint64_t pixels, std::uint64_t fragments,
                                                 std::uint64_t fragment_bits = 64,
                                                 std::uint64_t pixel_bits = 64) {
  return bytes(pixel_bits * pixels + fragment_bits * fragments);
}
/// Linked lists: the head of each pixel and the link of each fragment, 32 bits each.
[[nodiscard]] constexpr std::uint64_t linked(std::uint64_t pixels, std::uint64_t fragments,
                                             std::uint64_t fragment_bits = 64) {
  return bytes(32 * pixels + (fragment_bits + 32) * fragments);
}
/// Lists of pages of `page` fragments and a link of 32 bits.
[[nodiscard]] constexpr std::uint64_t paged(std::uint64_t pixels, std::uint64_t pages,
                                            std::uint64_t page, std::uint64_t fragment_bits = 64,
                                            std::uint64_t pixel_bits = 64) {
  return bytes(pixel_bits * pixels + pages * (fragment_bits * page + 32));
}
/// The same if no page has a gap. (The published formula spreads the link of a page over its
/// fragments.)
[[nodiscard]] constexpr std::uint64_t paged_least(std::uint64_t pixels, std::uint64_t fragments,
                                                  std::uint64_t page,
                                                  std::uint64_t fragment_bits = 64,
                                                  std::uint64_t pixel_bits = 64) {
  return bytes(pixel_bits * pixels + fragments * (fragment_bits * page + 32) / page);
}
/// The same if the last page of each pixel has one fragment.
[[nodiscard]] constexpr std::uint64_t paged_most(std::uint64_t pixels, std::uint64_t fragments,
                                                 std::uint64_t page,
                                                 std::uint64_t fragment_bits = 64,
                                                 std::uint64_t pixel_bits = 64) {
  return paged_least(pixels, fragments, page, fragment_bits, pixel_bits) +
         bytes(fragment_bits * (page - 1) * pixels);
}
/// A fixed array of slots a pixel and its count, 32 bits.
[[nodiscard]] constexpr std::uint64_t fixed(std::uint64_t pixels, std::uint64_t slots,
                                            std::uint64_t fragment_bits = 64) {
  return bytes((fragment_bits * slots + 32) * pixels);
}
/// A hash table: cells, and an age of `age_bytes` for each of the blocks of 8 x 8 pixels.
[[nodiscard]] constexpr std::uint64_t hash_table(std::uint64_t cells, std::uint64_t blocks,
                                                 std::uint64_t cell_bits = 64,
                                                 std::uint64_t age_bytes = 1) {
  return bytes(cell_bits * cells) + age_bytes * blocks;
}
/// Cells of a table that is to be `load` full.
[[nodiscard]] inline std::uint64_t cells_at(double load, std::uint64_t fragments) {
  return static_cast<std::uint64_t>(std::ceil(static_cast<double>(fragments) / load));
}
/// Blocks of 8 x 8 pixels.
[[nodiscard]] constexpr std::uint64_t blocks(std::uint64_t width, std::uint64_t height) {
  return ((width + 7) / 8) * ((height + 7) / 8);
}

}  // namespace strata::transparency::list_bytes
