#pragma once

#include <algorithm>
#include <cstdint>

// When a hash table changes its size, after: Lefebvre, Hornus, Lasram, "HA-Buffer", 2013, section
// 4.4, whose captions (1024^2 -> 1280^2 -> 1600^2) fix "25 %" to mean each side.
// We differ: never below the screen, and all steps that are due are taken at once.

namespace strata {

/// One step up: 25 % more a side, so 25 / 16 of the cells, rounded up.
[[nodiscard]] constexpr std::uint64_t grown_cells(std::uint64_t cells) {
  return cells + (9 * cells + 15) / 16;
}

/// One step down: 25 % less a side, so 9 / 16 of the cells.
[[nodiscard]] constexpr std::uint64_t shrunk_cells(std::uint64_t cells) { return 9 * cells / 16; }

/// True from 80 % on.
[[nodiscard]] constexpr bool is_too_full(std::uint64_t stored, std::uint64_t cells) {
  return stored >= cells - cells / 5;
}

/// True below 30 %.
[[nodiscard]] constexpr bool is_too_empty(std::uint64_t stored, std::uint64_t cells) {
  return stored < cells / 10 * 3 + (cells % 10 * 3 + 9) / 10;
}

/// `cells`, grown until that many fragments are not too many.
[[nodiscard]] constexpr std::uint64_t cells_for(std::uint64_t fragments, std::uint64_t cells) {
  while (is_too_full(fragments, cells)) cells = grown_cells(cells);
  return cells;
}

/// The size after a table of `cells` cells did not take all `fragments`: at least one step up,
/// since a table that is not full fails by bad luck with its ages. (Where luck fails again and
/// again, OffsetKind::kPlaneFirst with one plane a layer cannot.)
[[nodiscard]] constexpr std::uint64_t rebuilt_cells(std::uint64_t fragments, std::uint64_t cells) {
  return cells_for(fragments, grown_cells(cells));
}

/// The size of the next frame's table, from the fragments of the last frame: grows while the load
/// would be 80 % or more, else shrinks while it would be less than 30 %, never below `pixels`. A
/// grown table is at least 51 % full (unless one step was not enough for the first) and a shrunk
/// one at most 54 %, so a constant number of fragments causes at most one change.
[[nodiscard]] constexpr std::uint64_t next_frame_cells(std::uint64_t cells, std::uint64_t pixels,
                                                       std::uint64_t fragments) {
  cells = std::max(cells, pixels);
  if (is_too_full(fragments, cells)) return cells_for(fragments, cells);
  while (cells > pixels && is_too_empty(fragments, cells)) {
    cells = std::max(shrunk_cells(cells), pixels);
  }
  return cells;
}

}  // namespace strata
