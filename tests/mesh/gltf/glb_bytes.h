#pragma once

#include <cstdint>
#include <string>

namespace strata::testing_gltf {

inline std::string little_endian(std::uint64_t number, int bytes = 4) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>((number >> (8 * i)) & 0xffu);
  return text;
}

/// A .glb of its two chunks.
inline std::string glb_of(std::string json, std::string binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  std::string file = "glTF" + little_endian(2) + little_endian(28 + json.size() + binary.size());
  file += little_endian(json.size()) + "JSON" + json;
  return file + little_endian(binary.size()) + std::string("BIN\0", 4) + binary;
}

}  // namespace strata::testing_gltf
