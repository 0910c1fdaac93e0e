#pragma once

#include <memory>

#include "strata/gl/context.h"
#include "strata/hashbuffer/gl/store.h"

// Stores that keep the fragments of a pixel in the order of arrival; reading selects the next one.
// Private to transparency/gl/.

namespace strata::gl {

/// As many slots a pixel as the deepest one needs: it is found in a pass that overflows.
/// @param slots  of a pixel, at first
[[nodiscard]] std::unique_ptr<Store> make_fixed_store(const Info& info, std::uint32_t slots);

/// A linked list a pixel, of nodes of `page` fragments (1 to 16).
[[nodiscard]] std::unique_ptr<Store> make_linked_store(const Info& info, std::uint32_t page);

}  // namespace strata::gl
