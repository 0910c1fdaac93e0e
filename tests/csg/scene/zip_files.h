#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace strata::csg {

/// The bytes of a zip archive with these files, stored without compression.
inline std::string zip_of(const std::vector<std::pair<std::string, std::string>>& files) {
  const auto crc = [](std::string_view bytes) {
    std::uint32_t sum = 0xffffffffu;
    for (const char c : bytes) {
      sum ^= static_cast<unsigned char>(c);
      for (int bit = 0; bit < 8; ++bit) sum = (sum >> 1) ^ ((sum & 1u) ? 0xedb88320u : 0u);
    }
    return ~sum;
  };
  const auto number = [](std::string& to, std::size_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) to += static_cast<char>((value >> (8 * i)) & 0xffu);
  };
  std::string zip, directory;
  for (const auto& [name, bytes] : files) {
    std::string common;  // what a local header and the directory share
    number(common, 20, 2);
    number(common, 0, 8);  // flags, method, time, date
    number(common, crc(bytes), 4);
    number(common, bytes.size(), 4);
    number(common, bytes.size(), 4);
    number(common, name.size(), 2);
    number(common, 0, 2);
    directory += "PK\1\2";
    number(directory, 20, 2);
    directory += common;
    number(directory, 0, 8);  // comment, disk, attributes
    number(directory, 0, 2);
    number(directory, zip.size(), 4);
    directory += name;
    zip += "PK\3\4" + common + name + bytes;
  }
  const std::size_t at = zip.size();
  zip += directory + "PK\5\6";
  number(zip, 0, 4);
  number(zip, files.size(), 2);
  number(zip, files.size(), 2);
  number(zip, directory.size(), 4);
  number(zip, at, 4);
  number(zip, 0, 2);
  return zip;
}

}  // namespace strata::csg
