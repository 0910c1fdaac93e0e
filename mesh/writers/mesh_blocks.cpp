#include "mesh/writers/mesh_blocks.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <utility>

#include "core/printable.h"

namespace strata::detail {

static_assert(std::endian::native == std::endian::little, "add_bytes() copies numbers");

void add_text(Blocks& blocks, std::string text) {
  constexpr std::size_t kElementBytes = 32;
  const std::size_t elements = text.size() / kElementBytes;
  blocks.push_back({[text = std::move(text)](std::string& out) { out += text; }, elements});
}

Blocks joined(Blocks blocks) {
  Blocks result;
  for (std::size_t first = 0, last = 0; first < blocks.size(); first = last) {
    std::size_t elements = 0;
    do elements += blocks[last++].elements;
    while (last < blocks.size() && elements + blocks[last].elements <= kBlockElements);
    if (last == first + 1) {
      result.push_back(std::move(blocks[first]));
      continue;
    }
    std::vector<MakeBlock> makes;
    for (std::size_t i = first; i < last; ++i) makes.push_back(std::move(blocks[i].make));
    const auto all = [makes = std::move(makes)](std::string& out) {
      for (const MakeBlock& make : makes) make(out);
    };
    result.push_back({all, elements});
  }
  return result;
}

Result<void> make_in_order(const Blocks& blocks, const Execution& execution,
                           const std::function<Result<void>(std::string& bytes)>& take) {
  const auto workers = static_cast<std::size_t>(execution.thread_count());
  std::vector<std::string> made(std::min(blocks.size(), 2 * workers));
  for (std::size_t first = 0; first < blocks.size(); first += made.size()) {
    const std::size_t count = std::min(made.size(), blocks.size() - first);
    parallel_for(execution, count, [&](std::size_t i, int) {
      made[i].clear();
      blocks[first + i].make(made[i]);
    });
    for (std::size_t i = 0; i < count; ++i) {
      if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
      if (auto taken = take(made[i]); !taken) return taken;
    }
    if (execution.progress) {
      execution.progress(static_cast<double>(first + count) / static_cast<double>(blocks.size()));
    }
  }
  return {};
}

Result<void> write_blocks(const std::string& path, Blocks blocks, const Execution& execution) {
  blocks = joined(std::move(blocks));
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  auto written = make_in_order(blocks, execution, [&](std::string& bytes) {
    return file->write(bytes.data(), bytes.size());
  });
  if (!written) return written;
  return file->commit();
}

void add_number(std::string& out, double value) {
  char text[32];
  out.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

void add_integer(std::string& out, std::uint64_t value) {
  char text[24];
  out.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

void add_vector(std::string& out, const glm::dvec3& v) {
  char text[3 * 32];
  char* at = text;
  for (int k = 0; k < 3; ++k) {
    if (k != 0) *at++ = ' ';
    at = std::to_chars(at, text + sizeof text, v[k]).ptr;
  }
  out.append(text, at);
}

std::vector<Colour> part_colours(const SolidMesh& mesh) {
  constexpr Colour kUncoloured{0xf9, 0xd7, 0x2c, 0xff};  // of solids in pictures (Cornfield)
  std::vector<Colour> colours;
  if (std::none_of(mesh.parts.begin(), mesh.parts.end(),
                   [](const MeshPart& part) { return part.colour.has_value(); })) {
    return colours;
  }
  for (const MeshPart& part : mesh.parts) {
    Colour colour = kUncoloured;
    for (int k = 0; part.colour && k < 4; ++k) {
      const float value = (*part.colour)[k];
      colour[k] = static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(value, 0.0f, 1.0f)));
    }
    colours.push_back(colour);
  }
  return colours;
}

std::string one_line(std::string_view name) {
  std::string line;
  while (!name.empty()) {
    const std::size_t length = utf8_length(name);
    const std::string_view letter = name.substr(0, std::max<std::size_t>(length, 1));
    if (length == 0) {
      line += '?';
    } else if (is_control(letter)) {
      line += ' ';
    } else {
      line += letter;
    }
    name.remove_prefix(letter.size());
  }
  return line;
}

}  // namespace strata::detail
