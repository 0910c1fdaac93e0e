#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace strata {

#ifdef STRATA_HAVE_BLOSC
inline constexpr bool kHaveBlosc = true;
#else
inline constexpr bool kHaveBlosc = false;
#endif

/// Unpacks a buffer of Blosc that has as many bytes as `to`. (Internal to voxelize/readers.)
/// @return false if it is damaged, has another size, or kHaveBlosc is false
[[nodiscard]] bool unblosc(std::string_view packed, std::span<std::byte> to);

}  // namespace strata
