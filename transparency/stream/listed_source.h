#pragma once

#include <memory>
#include <span>

#include "strata/transparency/stream/frame.h"
#include "transparency/stream/fragment_source.h"

namespace strata::transparency {

/// Fragments that are given one by one. @return kUsage naming the first one out of range
Result<std::shared_ptr<const FragmentSource>> make_listed_source(
    std::span<const ListedFragment> fragments, std::span<const glm::vec4> colours,
    const glm::ivec2& size);

}  // namespace strata::transparency
