#include "mesh/writers/zip_output.h"

#include <zlib.h>

#include <cstdint>
#include <limits>
#include <new>
#include <utility>

// Format: PKWARE, APPNOTE.TXT 6.3.3, sections 4.3.7 to 4.3.16. Each block of a member ends on a
// byte (Z_SYNC_FLUSH), so blocks that were deflated apart are one stream when joined, as pigz (Mark
// Adler) does it.

namespace strata::detail {
namespace {

/// Appends raw DEFLATE of `text`.
void add_deflated(std::string& out, const std::string& text, bool last) {
  constexpr int kLevel = 1;  // of model text 6 is an eighth smaller and takes five times as long
  constexpr int kRaw = -15, kMemory = 9;
  z_stream stream{};
  if (deflateInit2(&stream, kLevel, Z_DEFLATED, kRaw, kMemory, Z_DEFAULT_STRATEGY) != Z_OK) {
    throw std::bad_alloc();
  }
  const std::size_t before = out.size();
  constexpr std::size_t kFlush = 16;  // room for the empty block at the end
  out.resize(before + deflateBound(&stream, static_cast<uLong>(text.size())) + kFlush);
  stream.next_in = reinterpret_cast<z_const Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data() + before);
  stream.avail_out = static_cast<uInt>(out.size() - before);
  deflate(&stream, last ? Z_FINISH : Z_SYNC_FLUSH);
  out.resize(before + stream.total_out);
  deflateEnd(&stream);
}

/// What the headers of a member say.
struct MemberFacts {
  std::string name;
  std::uint32_t checksum = 0;
  std::uint64_t size = 0, deflated = 0;
  std::uint64_t offset = 0;  ///< of its local header
};

/// The part that both headers of a member have.
void add_facts(std::string& out, const MemberFacts& member) {
  constexpr std::uint16_t kVersion = 20, kDeflate = 8, kNoTime = 0, kFirstDay = 1 << 5 | 1;
  add_bytes(out, kVersion);
  add_bytes(out, std::uint16_t{0});  // flags
  add_bytes(out, kDeflate);
  add_bytes(out, kNoTime);
  add_bytes(out, kFirstDay);
  add_bytes(out, member.checksum);
  add_bytes(out, static_cast<std::uint32_t>(member.deflated));
  add_bytes(out, static_cast<std::uint32_t>(member.size));
  add_bytes(out, static_cast<std::uint16_t>(member.name.size()));
  add_bytes(out, std::uint16_t{0});  // extra fields
}

std::string local_header(const MemberFacts& member) {
  std::string out("PK\3\4");
  add_facts(out, member);
  return out + member.name;
}

void add_directory_entry(std::string& out, const MemberFacts& member) {
  out += "PK\1\2";
  add_bytes(out, std::uint16_t{20});  // made by this version, on a FAT file system
  add_facts(out, member);
  out.append(10, '\0');  // comment, disk, attributes
  add_bytes(out, static_cast<std::uint32_t>(member.offset));
  out += member.name;
}

std::string directory(const std::vector<MemberFacts>& members, std::uint64_t offset) {
  std::string out;
  for (const MemberFacts& member : members) add_directory_entry(out, member);
  const auto size = static_cast<std::uint32_t>(out.size());
  out += "PK\5\6";
  out.append(4, '\0');  // disks
  for (int i = 0; i < 2; ++i) add_bytes(out, static_cast<std::uint16_t>(members.size()));
  add_bytes(out, size);
  add_bytes(out, static_cast<std::uint32_t>(offset));
  out.append(2, '\0');  // comment
  return out;
}

/// Deflates a member. @param facts  gets its sizes and checksum
Result<std::string> deflate_member(const std::string& path, const ZipMember& member,
                                   const Execution& execution, MemberFacts& facts) {
  struct Piece {
    std::uint32_t checksum = 0;
    std::size_t size = 0;
  };
  std::vector<Piece> pieces(member.blocks.size());
  Blocks deflated;
  for (std::size_t i = 0; i < member.blocks.size(); ++i) {
    const auto deflate_block = [&, i](std::string& out) {
      std::string text;
      member.blocks[i].make(text);
      pieces[i].checksum = static_cast<std::uint32_t>(
          crc32(0, reinterpret_cast<const Bytef*>(text.data()), static_cast<uInt>(text.size())));
      pieces[i].size = text.size();
      add_deflated(out, text, i + 1 == member.blocks.size());
    };
    deflated.push_back({deflate_block, member.blocks[i].elements});
  }
  std::string all;
  std::size_t next = 0;
  auto made = make_in_order(deflated, execution, [&](std::string& bytes) -> Result<void> {
    const Piece& piece = pieces[next++];
    facts.checksum = static_cast<std::uint32_t>(
        crc32_combine(facts.checksum, piece.checksum, static_cast<z_off_t>(piece.size)));
    facts.size += piece.size;
    if (facts.size > std::numeric_limits<std::uint32_t>::max()) {
      return fail(ErrorCode::kLimit,
                  "{}: the model has more than 4 GiB of text, the most of a zip archive; PLY has "
                  "no such limit",
                  path);
    }
    if (execution.memory_limit != 0 && all.size() + bytes.size() > execution.memory_limit) {
      return fail(ErrorCode::kLimit, "{}: the model needs more than the memory limit of {} bytes",
                  path, execution.memory_limit);
    }
    all += bytes;
    return {};
  });
  if (!made) return tl::unexpected(made.error());
  facts.deflated = all.size();
  return all;
}

}  // namespace

Result<void> write_zip(const std::string& path, std::vector<ZipMember> members,
                       const Execution& execution) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  std::vector<MemberFacts> facts;
  std::uint64_t offset = 0;
  for (ZipMember& member : members) {
    member.blocks = joined(std::move(member.blocks));
    MemberFacts& known = facts.emplace_back();
    known.name = member.name;
    known.offset = offset;
    const auto bytes = deflate_member(path, member, execution, known);
    if (!bytes) return tl::unexpected(bytes.error());
    const std::string header = local_header(known);
    for (const std::string* part : {&header, &*bytes}) {
      if (auto written = file->write(part->data(), part->size()); !written) return written;
      offset += part->size();
    }
  }
  const std::string end = directory(facts, offset);
  if (auto written = file->write(end.data(), end.size()); !written) return written;
  return file->commit();
}

}  // namespace strata::detail
