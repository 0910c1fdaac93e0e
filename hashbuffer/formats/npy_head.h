#pragma once

#include <fmt/core.h>

#include <string>
#include <string_view>

namespace strata {

/// The header of a .npy file, version 1.0: [magic:6 | version:2 | length:u16 | dictionary]. It is
/// padded so that the data starts at a multiple of 64. Private to hashbuffer/ and voxelize/.
inline std::string npy_head(std::string_view type, bool fortran_order, std::string_view shape) {
  std::string text = fmt::format("{{'descr': '{}', 'fortran_order': {}, 'shape': {}, }}", type,
                                 fortran_order ? "True" : "False", shape);
  constexpr std::size_t kFixed = 10;
  text.append(63 - (kFixed + text.size()) % 64, ' ');
  text += '\n';
  std::string head("\x93NUMPY\x01\x00", 8);
  head += static_cast<char>(text.size() & 0xff);
  head += static_cast<char>(text.size() >> 8);
  return head + text;
}

}  // namespace strata
