#include <utility>

#include "apps/view/viewer.h"

// How the viewer measures.

namespace strata::view {

void Viewer::take_up(Tool tool) {
  board_.take_up(shows_voxels() || board_.tool() == tool ? Tool::kNone : tool);
}

void Viewer::measure_at(const glm::ivec2& pixel) {
  const bool outside =
      pixel.x < 0 || pixel.y < 0 || pixel.x >= viewport_.x || pixel.y >= viewport_.y;
  if (!arrangement_ || outside || board_.tool() == Tool::kNone) {
    board_.take({});
    return;
  }
  picking_ = true;
  centre_on_pick_ = false;
  thread_.pick(pixel, facts_of(board_.tool()).wish);
}

void Viewer::set_heat_range(std::optional<glm::dvec2> range) {
  heat_range_ = std::move(range);
  change(false);
}

}  // namespace strata::view
