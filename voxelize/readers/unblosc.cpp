#include "voxelize/readers/unblosc.h"

#ifdef STRATA_HAVE_BLOSC
#include <blosc.h>
#endif

namespace strata {

bool unblosc(std::string_view packed, std::span<std::byte> to) {
#ifdef STRATA_HAVE_BLOSC
  std::size_t unpacked = 0;
  return blosc_cbuffer_validate(packed.data(), packed.size(), &unpacked) == 0 &&
         unpacked == to.size() &&
         blosc_decompress_ctx(packed.data(), to.data(), to.size(), 1) ==
             static_cast<int>(to.size());
#else
  static_cast<void>(packed), static_cast<void>(to);
  return false;
#endif
}

}  // namespace strata
