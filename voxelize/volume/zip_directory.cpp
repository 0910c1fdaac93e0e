// ZIP (PKWARE, APPNOTE.TXT 6.3), from the end: the directory names all files. Not by libzip, which
// the build can do without: voxels need no more than this.

#include "voxelize/volume/zip_directory.h"

#include <algorithm>

#include "voxelize/volume/read_context.h"

namespace strata {
namespace {

constexpr std::uint32_t kEnd = 0x06054b50, kEnd64 = 0x06064b50, kLocator = 0x07064b50;
constexpr std::uint32_t kEntry = 0x02014b50, kLocal = 0x04034b50;
constexpr std::size_t kEndBytes = 22, kLocatorBytes = 20;
constexpr std::uint32_t kWide = 0xffffffff;

struct Directory {
  std::uint64_t entries = 0, offset = 0;
};

Result<Directory> find_directory(std::string_view bytes, const std::string& path) {
  constexpr std::size_t kLongestComment = 65535;
  const std::size_t first = bytes.size() - std::min(bytes.size(), kEndBytes + kLongestComment);
  for (std::size_t at = bytes.size() - std::min(bytes.size(), kEndBytes) + 1; at-- > first;) {
    ByteCursor end(bytes, at);
    if (end.get<std::uint32_t>() != kEnd) continue;
    end.take(6);
    Directory found;
    found.entries = end.get<std::uint16_t>();
    end.take(4);
    found.offset = end.get<std::uint32_t>();
    if (end.failed()) continue;
    if (at < kLocatorBytes) return found;
    ByteCursor locator(bytes, at - kLocatorBytes);
    if (locator.get<std::uint32_t>() != kLocator) return found;
    locator.take(4);
    ByteCursor wide(bytes, locator.get<std::uint64_t>());
    if (wide.get<std::uint32_t>() != kEnd64) {
      return fail(ErrorCode::kInput,
                  "{}: byte {}: the 64-bit directory of the archive is not there", path, at);
    }
    wide.take(28);
    found.entries = wide.get<std::uint64_t>();
    wide.get<std::uint64_t>();
    found.offset = wide.get<std::uint64_t>();
    return found;
  }
  return fail(ErrorCode::kInput, "{}: not a ZIP archive: it has no directory at its end", path);
}

// Takes 64-bit numbers from the extra field, in the order in which the entry lacks them.
void widen(std::string_view extra, std::initializer_list<std::uint64_t*> numbers) {
  for (ByteCursor cursor(extra); cursor.left() >= 4;) {
    const auto id = cursor.get<std::uint16_t>();
    const std::string_view field = cursor.take(cursor.get<std::uint16_t>());
    if (id != 1) continue;
    ByteCursor wide(field);
    for (std::uint64_t* number : numbers) {
      if (*number == kWide && wide.left() >= 8) *number = wide.get<std::uint64_t>();
    }
  }
}

}  // namespace

Result<std::vector<ZipMember>> zip_members(std::string_view bytes, const std::string& path) {
  const Result<Directory> directory = find_directory(bytes, path);
  if (!directory) return tl::unexpected(directory.error());
  std::vector<ZipMember> members;
  ByteCursor cursor(bytes, directory->offset);
  for (std::uint64_t i = 0; i < directory->entries; ++i) {
    const std::uint64_t at = cursor.at();
    if (cursor.get<std::uint32_t>() != kEntry) {
      return fail(ErrorCode::kInput, "{}: byte {}: entry {} of {} of the archive is not there",
                  path, at, i + 1, directory->entries);
    }
    cursor.take(4);
    const auto flags = cursor.get<std::uint16_t>(), method = cursor.get<std::uint16_t>();
    cursor.take(8);
    std::uint64_t packed = cursor.get<std::uint32_t>();
    ZipMember member;
    member.bytes = cursor.get<std::uint32_t>();
    const auto name = cursor.get<std::uint16_t>(), extra = cursor.get<std::uint16_t>();
    const auto comment = cursor.get<std::uint16_t>();
    cursor.take(8);
    std::uint64_t offset = cursor.get<std::uint32_t>();
    member.name = cursor.take(name);
    widen(cursor.take(extra), {&member.bytes, &packed, &offset});
    cursor.take(comment);
    if ((flags & 1) != 0 || (method != 0 && method != 8)) {
      return fail(ErrorCode::kInput, "{}: {} is {}; only stored and deflated files are read", path,
                  member.name, (flags & 1) != 0 ? "encrypted" : "packed by another method");
    }
    member.deflated = method == 8;
    ByteCursor local(bytes, offset);
    const bool head = local.get<std::uint32_t>() == kLocal;
    local.take(22);
    const auto local_name = local.get<std::uint16_t>(), local_extra = local.get<std::uint16_t>();
    local.take(std::uint64_t{local_name} + local_extra);
    member.packed = local.take(packed);
    if (!head || local.failed() || (!member.deflated && packed != member.bytes)) {
      return fail(ErrorCode::kInput, "{}: byte {}: {} of {} bytes is not there", path, offset,
                  member.name, packed);
    }
    members.push_back(std::move(member));
  }
  return members;
}

}  // namespace strata
