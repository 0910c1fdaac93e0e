// Numbers of a file, of any type and byte order, as floats and ids.

#include <algorithm>
#include <array>
#include <cstring>
#include <type_traits>

#include "voxelize/volume/dense_array.h"
#include "voxelize/volume/half_float.h"

namespace strata {
namespace {

template <class T>
T swapped(T value) {
  std::array<std::byte, sizeof(T)> bytes;
  std::memcpy(bytes.data(), &value, sizeof value);
  std::reverse(bytes.begin(), bytes.end());
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

/// Calls with a zero of the type's C++ type; halves are uint16_t.
template <class Call>
auto with_type(NumberType type, Call&& call) {
  switch (type) {
    case NumberType::kBool:
    case NumberType::kU8:
      return call(std::uint8_t{});
    case NumberType::kI8:
      return call(std::int8_t{});
    case NumberType::kU16:
    case NumberType::kF16:
      return call(std::uint16_t{});
    case NumberType::kI16:
      return call(std::int16_t{});
    case NumberType::kU32:
      return call(std::uint32_t{});
    case NumberType::kI32:
      return call(std::int32_t{});
    case NumberType::kU64:
      return call(std::uint64_t{});
    case NumberType::kI64:
      return call(std::int64_t{});
    case NumberType::kF32:
      return call(float{});
    case NumberType::kF64:
      break;
  }
  return call(double{});
}

template <class T>
T read(const std::byte* from, bool big_endian) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return big_endian ? swapped(value) : value;
}

}  // namespace

void RowConverter::to_floats(const std::byte* from, std::size_t count, float* to) const {
  with_type(type_, [&](auto zero) {
    using T = decltype(zero);
    for (std::size_t i = 0; i < count; ++i) {
      const T value = read<T>(from + i * sizeof(T), big_endian_);
      if constexpr (std::is_same_v<T, std::uint16_t>) {
        to[i] = type_ == NumberType::kF16 ? float_of_half(value) : value;
      } else {
        to[i] = static_cast<float>(value);
      }
    }
  });
}

bool RowConverter::to_ids(const std::byte* from, std::size_t count, std::uint32_t* to) const {
  return with_type(type_, [&](auto zero) {
    using T = decltype(zero);
    bool ids = true;
    for (std::size_t i = 0; i < count; ++i) {
      const T value = read<T>(from + i * sizeof(T), big_endian_);
      if constexpr (std::is_floating_point_v<T>) {
        ids = false;
      } else {
        to[i] = static_cast<std::uint32_t>(value);
        if constexpr (std::is_signed_v<T>) ids = ids && value >= 0;
        if constexpr (sizeof(T) == 8) ids = ids && value <= 0xffffffff;
      }
    }
    return ids;
  });
}

}  // namespace strata
