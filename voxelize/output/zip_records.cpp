#include "voxelize/output/zip_records.h"

#include <algorithm>
#include <bit>

namespace strata {
namespace {

constexpr std::uint32_t kUnknown = 0xffffffff;  // the 64-bit field has the number

template <class T>
void put(std::string& to, T value) {
  static_assert(std::endian::native == std::endian::little);
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}
void put16(std::string& to, std::uint64_t value) { put(to, static_cast<std::uint16_t>(value)); }
void put32(std::string& to, std::uint64_t value) { put(to, static_cast<std::uint32_t>(value)); }

}  // namespace

// What the local head and the directory share, from the version on.
void ZipEntry::put_common(std::string& to) const {
  const bool ascii = std::all_of(name.begin(), name.end(), [](char c) { return (c & 0x80) == 0; });
  put16(to, wide ? 45 : 20);  // version needed
  put16(to, (follows ? 1 << 3 : 0) | (ascii ? 0 : 1 << 11));
  put16(to, deflated ? 8 : 0);
  put16(to, 0);           // time
  put16(to, 1 << 5 | 1);  // 1980-01-01
  put32(to, crc);
  put32(to, wide ? kUnknown : compressed);
  put32(to, wide ? kUnknown : bytes);
  put16(to, name.size());
}

std::string ZipEntry::local_head() const {
  std::string head("PK\x03\x04", 4);
  ZipEntry shown = *this;
  if (follows) shown.crc = 0, shown.bytes = shown.compressed = 0;
  shown.put_common(head);
  put16(head, wide ? 20 : 0);
  head += name;
  if (!wide) return head;
  put16(head, 1);
  put16(head, 16);
  put(head, shown.bytes);
  put(head, shown.compressed);
  return head;
}

std::string ZipEntry::descriptor() const {
  std::string text("PK\x07\x08", 4);
  put32(text, crc);
  for (const std::uint64_t size : {compressed, bytes}) {
    if (wide) {
      put(text, size);
    } else {
      put32(text, size);
    }
  }
  return text;
}

void ZipEntry::put_in_directory(std::string& to) const {
  std::string extra;
  if (wide) put(extra, bytes), put(extra, compressed);
  if (far()) put(extra, offset);
  to.append("PK\x01\x02", 4);
  put16(to, wide ? 45 : 20);  // version made by
  put_common(to);
  put16(to, extra.empty() ? 0 : extra.size() + 4);
  put16(to, 0);  // comment
  put16(to, 0);  // disk
  put16(to, 0);  // attributes
  put32(to, 0);
  put32(to, far() ? kUnknown : offset);
  to += name;
  if (extra.empty()) return;
  put16(to, 1);
  put16(to, extra.size());
  to += extra;
}

std::string zip_directory(std::span<const ZipEntry> entries, std::uint64_t begin) {
  constexpr std::uint64_t kMostEntries = 0xffff;
  std::string directory;
  bool wide = begin >= kUnknown || entries.size() >= kMostEntries;
  for (const ZipEntry& entry : entries) {
    entry.put_in_directory(directory);
    wide = wide || entry.wide;
  }
  const std::uint64_t size = directory.size(), count = entries.size();
  if (wide) {
    directory.append("PK\x06\x06", 4);
    put(directory, std::uint64_t{44});  // bytes that follow
    put16(directory, 45);
    put16(directory, 45);
    put(directory, std::uint64_t{0});  // disks
    for (const std::uint64_t number : {count, count, size, begin}) put(directory, number);
    directory.append("PK\x06\x07", 4);
    put32(directory, 0);
    put(directory, begin + size);  // of the record before
    put32(directory, 1);           // disks
  }
  directory.append("PK\x05\x06", 4);
  put32(directory, 0);  // disks
  put16(directory, std::min(count, kMostEntries));
  put16(directory, std::min(count, kMostEntries));
  put32(directory, size);
  put32(directory, wide ? kUnknown : begin);
  put16(directory, 0);  // comment
  return directory;
}

}  // namespace strata
