#include "mesh/formats/format_of_content.h"

#include <algorithm>
#include <iterator>
#include <string>

#include "core/letters.h"
#include "mesh/formats/reader_common.h"
#include "mesh/gltf/read_gltf.h"
#include "mesh/text/text_scanner.h"

namespace strata::detail {
namespace {

constexpr std::size_t kLooked = 1 << 16;

/// Whether lines are those of an OBJ, up to a vertex at least.
bool looks_like_obj(std::string_view text) {
  constexpr std::string_view kBefore[] = {"o", "g", "s", "vt", "vn", "vp", "mtllib", "usemtl"};
  while (!text.empty()) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos || line[begin] == '#') continue;
    line.remove_prefix(begin);
    const std::size_t end = std::min(line.find_first_of(" \t\r"), line.size());
    const std::string_view word = line.substr(0, end);
    if (word == "v") {
      const std::size_t number = line.find_first_not_of(" \t", end);
      return number != std::string_view::npos &&
             std::string_view("+-.0123456789").find(line[number]) != std::string_view::npos;
    }
    if (std::find(std::begin(kBefore), std::end(kBefore), word) == std::end(kBefore)) return false;
  }
  return false;
}

/// The kind of a ZIP archive, by the names of what it holds.
MeshFormat format_of_archive(std::string_view bytes) {
  const std::string names =
      lower_case(std::string(bytes.substr(bytes.size() - std::min(bytes.size(), kLooked))));
  if (names.find(".model") != std::string::npos) return MeshFormat::k3mf;
  return names.find(".amf") != std::string::npos ? MeshFormat::kAmf : MeshFormat::kAuto;
}

}  // namespace

MeshFormat format_of_content(std::string_view bytes) {
  if (is_glb(bytes)) return MeshFormat::kGltf;
  if (bytes.starts_with("PK\x03\x04")) return format_of_archive(bytes);
  const std::string_view text = without_byte_order_mark(bytes).substr(0, kLooked);
  const auto begins = [&](std::string_view word, std::string_view next) {
    return text.starts_with(word) && text.size() > word.size() &&
           next.find(text[word.size()]) != std::string_view::npos;
  };
  if (begins("ply", "\r\n")) return MeshFormat::kPly;
  if (begins("OFF", "\r\n ") || text.starts_with("COFF")) return MeshFormat::kOff;
  if (is_binary_stl(bytes) || begins("solid", "\r\n ")) return MeshFormat::kStl;
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return MeshFormat::kAuto;
  if (text[first] == '<') {
    return text.find("<amf") != std::string_view::npos ? MeshFormat::kAmf : MeshFormat::kAuto;
  }
  if (text[first] == '{') {
    return text.find("\"asset\"") != std::string_view::npos ? MeshFormat::kGltf : MeshFormat::kAuto;
  }
  return looks_like_obj(text) ? MeshFormat::kObj : MeshFormat::kAuto;
}

}  // namespace strata::detail
