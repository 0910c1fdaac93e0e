#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace strata {

/// A file in a ZIP archive (PKWARE, APPNOTE.TXT 6.3), and its records. The time is the first of the
/// year 1980: the same voxels give the same bytes. (Internal to voxelize/.)
struct ZipEntry {
  std::string name{};
  bool deflated = false;
  bool follows = false;  ///< CRC and sizes stand after the data
  bool wide = false;     ///< sizes of 64 bits
  std::uint32_t crc = 0;
  std::uint64_t bytes = 0, compressed = 0;
  std::uint64_t offset = 0;  ///< of the local head

  [[nodiscard]] std::string local_head() const;
  /// What stands after the data.
  [[nodiscard]] std::string descriptor() const;
  void put_in_directory(std::string& to) const;

 private:
  [[nodiscard]] bool far() const { return offset >= 0xffffffff; }
  void put_common(std::string& to) const;
};

/// What follows the last entry, at `begin`: the directory and its end.
[[nodiscard]] std::string zip_directory(std::span<const ZipEntry> entries, std::uint64_t begin);

}  // namespace strata
