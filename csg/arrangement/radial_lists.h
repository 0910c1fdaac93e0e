#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "csg/arrangement/pieces.h"

namespace strata::csg {

/// The sheets around each edge of the arrangement, sorted by angle: a depth list that is bent to a
/// circle. Between two sheets that follow each other lies a wedge of space. Wedges that belong
/// together are a cell; all points of a cell are inside of the same solids.
struct RadialLists {
  /// A piece of a triangle that ends at an edge, on the left or on the right of it.
  struct Sheet {
    std::uint32_t piece;
    bool left;
  };
  /// Sheets of one angle.
  struct Group {
    std::uint32_t first_sheet, sheet_count;
  };
  /// Groups counter-clockwise, as seen against the direction from a to b.
  struct Edge {
    std::uint32_t atomic_edge;
    std::uint32_t first_group, group_count;
  };

  std::vector<Edge> edges;  ///< atomic edges in order, without those where one triangle continues
                            ///< another
  std::vector<Group> groups;
  std::vector<Sheet> sheets;

  /// Pieces that continue each other are a patch: they have the same cells on their two sides.
  std::vector<std::uint32_t> patch_of;  ///< of each piece that is not dead
  std::uint32_t patch_count = 0;
  std::vector<std::uint32_t> component_of;  ///< of each patch: patches that share edges
  std::uint32_t component_count = 0;
  std::vector<std::uint32_t> cell_of;  ///< of the front (2 * patch) and the back of each patch
  std::uint32_t cell_count = 0;

  std::span<const Sheet> sheets_of(const Group& group) const {
    return std::span(sheets).subspan(group.first_sheet, group.sheet_count);
  }
  /// The cells before and behind a group, counter-clockwise.
  std::uint32_t cell_before(const Group& group) const { return cell(group, false); }
  std::uint32_t cell_behind(const Group& group) const { return cell(group, true); }
  /// The half-plane on the left of an edge has its front counter-clockwise behind it.
  std::uint32_t cell(const Group& group, bool behind) const {
    const Sheet& sheet = sheets[group.first_sheet];
    return cell_of[2 * patch_of[sheet.piece] + (sheet.left == behind ? 0 : 1)];
  }
};

/// @return kCancelled
Result<RadialLists> find_radial_lists(const ArrangementInput& input, const CutLines& lines,
                                      const Pieces& pieces, const Execution& execution);

}  // namespace strata::csg
