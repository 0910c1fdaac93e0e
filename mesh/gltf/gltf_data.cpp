#include "mesh/gltf/gltf_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>

#include "core/printable.h"
#include "mesh/text/text_scanner.h"

namespace strata::detail {
namespace {

constexpr std::uint64_t kMostZeros = std::uint64_t{1} << 24;  // of an accessor without bytes

std::uint64_t bytes_of(GltfNumber type) {
  constexpr std::uint64_t kBytes[] = {1, 1, 2, 2, 4, 4, 4};
  return kBytes[static_cast<int>(type) - static_cast<int>(GltfNumber::kInt8)];
}

/// Calls use(T()) with the type of the numbers.
template <class Use>
void with_type(GltfNumber type, Use&& use) {
  switch (type) {
    case GltfNumber::kInt8:
      return use(std::int8_t());
    case GltfNumber::kUint8:
      return use(std::uint8_t());
    case GltfNumber::kInt16:
      return use(std::int16_t());
    case GltfNumber::kUint16:
      return use(std::uint16_t());
    case GltfNumber::kInt32:
      return use(std::int32_t());
    case GltfNumber::kUint32:
      return use(std::uint32_t());
    case GltfNumber::kFloat:
      return use(float());
  }
}

template <class T>
double value_of(const unsigned char* at, bool normalized) {
  T number;
  std::memcpy(&number, at, sizeof number);
  if constexpr (std::is_integral_v<T>) {
    if (normalized) {
      constexpr auto kMost = static_cast<double>(std::numeric_limits<T>::max());
      return std::max(static_cast<double>(number) / kMost, -1.0);
    }
  }
  return static_cast<double>(number);
}

template <class T>
void copy_values(const unsigned char* from, std::uint64_t stride, std::uint64_t count,
                 int components, bool normalized, double* to) {
  for (std::uint64_t i = 0; i < count; ++i, from += stride) {
    for (int c = 0; c < components; ++c) {
      *to++ = value_of<T>(from + static_cast<std::size_t>(c) * sizeof(T), normalized);
    }
  }
}

constexpr std::array<std::int8_t, 256> kLetters = [] {
  std::array<std::int8_t, 256> all{};
  for (std::int8_t& one : all) one = -1;
  constexpr std::string_view kInOrder =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < kInOrder.size(); ++i) {
    all[static_cast<unsigned char>(kInOrder[i])] = static_cast<std::int8_t>(i);
  }
  return all;
}();

std::string decoded_data(std::string_view uri, const GltfUser& user) {
  const std::size_t comma = uri.find(',');
  std::string bytes;
  if (comma == std::string_view::npos || !uri.substr(0, comma).ends_with(";base64") ||
      !decode_base64(uri.substr(comma + 1), bytes)) {
    refuse_gltf("{}.uri is no valid base64", user.text());
  }
  return bytes;
}

}  // namespace

std::string GltfUser::text() const {
  return fmt::format("{}: {}[{}]{}", file, list, index, within);
}

bool decode_base64(std::string_view text, std::string& bytes) {
  for (int padding = 0; padding < 2 && text.ends_with('='); ++padding) text.remove_suffix(1);
  if (text.size() % 4 == 1) return false;
  bytes.resize(text.size() / 4 * 3 + (text.size() % 4 * 3) / 4);
  std::uint32_t bits = 0;
  int held = 0;
  char* to = bytes.data();
  for (const char c : text) {
    const std::int8_t value = kLetters[static_cast<unsigned char>(c)];
    if (value < 0) return false;
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    held += 6;
    if (held < 8) continue;
    held -= 8;
    *to++ = static_cast<char>(bits >> held & 0xff);
  }
  return true;
}

InputBytes GltfData::open_file(const std::string& uri, const GltfUser& user) {
  const std::string shown = printable(uri, 80);
  if (!source_.may_name) {
    refuse_gltf("{}: '{}' is another file; standard input can name none", user.text(), shown);
  }
  if (uri.find("://") != std::string::npos) refuse_gltf("{}: '{}' is no file", user.text(), shown);
  const std::string relative = without_escapes(uri);
  if (relative.find('\0') != std::string::npos)
    refuse_gltf("{}: '{}' is no file", user.text(), shown);
  const std::string path = (std::filesystem::path(source_.folder) / relative).string();
  if (!source_.root.empty() && !lies_below(path, source_.root)) {
    refuse_gltf("{}: '{}' lies outside of {}", user.text(), shown, source_.root);
  }
  auto file = InputBytes::open(path, execution_.memory_limit, execution_.stop);
  if (!file) throw GltfRefusal{{file.error().code, user.text() + ": " + file.error().message}};
  opened_.push_back(identify_file(path));
  return *std::move(file);
}

std::string_view GltfData::buffer(std::uint32_t index) {
  const GltfBuffer& from = document_.buffers[index];
  const GltfUser user{source_.name, "buffers", index};
  std::string_view bytes;
  if (!from.uri) {
    if (index != 0 || !source_.has_binary) refuse_gltf("{} has no bytes", user.text());
    bytes = source_.binary;
  } else if (is_data(*from.uri)) {
    const auto [place, first] = decoded_.try_emplace(index);
    if (first) place->second = decoded_data(*from.uri, user);
    bytes = place->second;
  } else {
    auto found = files_.find(index);
    if (found == files_.end()) {
      found = files_.emplace(index, open_file(*from.uri, user)).first;
    }
    bytes = found->second.view();
  }
  if (bytes.size() < from.bytes) {
    refuse_gltf("{} has {} bytes, but its byteLength is {}", user.text(), bytes.size(), from.bytes);
  }
  return bytes.substr(0, from.bytes);
}

std::string_view GltfData::view(std::uint32_t index, const GltfUser& user) {
  const GltfView& from = document_.views[index];
  if (from.packed && !document_.buffers[from.buffer].uri &&
      !(from.buffer == 0 && source_.has_binary)) {
    refuse_gltf(
        "{}: it is packed by EXT_meshopt_compression, which is not read; write the file "
        "without compression",
        user.text());
  }
  const std::string_view all = buffer(from.buffer);
  if (from.offset > all.size() || from.bytes > all.size() - from.offset) {
    refuse_gltf("{}: bufferViews[{}] has bytes {} to {}, but its buffer has {}", source_.name,
                index, from.offset, from.offset + from.bytes, all.size());
  }
  return all.substr(from.offset, from.bytes);
}

GltfData::Elements GltfData::elements(std::uint32_t view_index, std::uint64_t offset,
                                      std::uint64_t count, std::uint64_t bytes, bool strided,
                                      const GltfUser& user) {
  const std::string_view all = view(view_index, user);
  const std::uint64_t stride = strided && document_.views[view_index].stride != 0
                                   ? document_.views[view_index].stride
                                   : bytes;
  if (stride < bytes) {
    refuse_gltf("{}: its elements have {} bytes, but bufferViews[{}].byteStride is {}", user.text(),
                bytes, view_index, stride);
  }
  const std::uint64_t room = offset <= all.size() ? all.size() - offset : 0;
  if (count > 0 && (bytes > room || count - 1 > (room - bytes) / stride)) {
    refuse_gltf("{}: its {} elements reach beyond the {} bytes of bufferViews[{}]", user.text(),
                count, all.size(), view_index);
  }
  return {reinterpret_cast<const unsigned char*>(all.data()) + (count > 0 ? offset : 0), stride};
}

GltfData::Elements GltfData::elements(std::uint32_t index) {
  const GltfAccessor& from = document_.accessors[index];
  const GltfUser user{source_.name, "accessors", index};
  if (from.view) {
    return elements(*from.view, from.offset, from.count,
                    bytes_of(from.type) * static_cast<std::uint64_t>(from.components), true, user);
  }
  if (from.count > kMostZeros) {
    throw GltfRefusal{{ErrorCode::kLimit, fmt::format("{} has {} elements and no bufferView; at "
                                                      "most {} are read",
                                                      user.text(), from.count, kMostZeros)}};
  }
  return {};
}

void GltfData::read(std::uint32_t index, int components, std::uint64_t first, std::uint64_t count,
                    double* values) {
  const GltfAccessor& from = document_.accessors[index];
  if (from.components != components) {
    refuse_gltf("{}: accessors[{}] has {} numbers an element, where {} are needed", source_.name,
                index, from.components, components);
  }
  if (first > from.count || count > from.count - first) {
    refuse_gltf("{}: accessors[{}] has {} elements, where {} are needed", source_.name, index,
                from.count, first + count);
  }
  const Elements all = elements(index);
  if (all.first) {
    with_type(from.type, [&](auto type) {
      copy_values<decltype(type)>(all.first + first * all.stride, all.stride, count, components,
                                  from.normalized, values);
    });
  } else {
    std::fill_n(values, count * static_cast<std::uint64_t>(components), 0.0);
  }
  if (from.sparse) replace_sparse(index, components, first, count, values);
}

void GltfData::replace_sparse(std::uint32_t index, int components, std::uint64_t first,
                              std::uint64_t count, double* values) {
  const GltfAccessor& from = document_.accessors[index];
  const GltfAccessor::Sparse& sparse = *from.sparse;
  const GltfUser user{source_.name, "accessors", index, ".sparse"};
  const Elements places = elements(sparse.index_view, sparse.index_offset, sparse.count,
                                   bytes_of(sparse.index_type), false, user);
  const Elements replaced =
      elements(sparse.value_view, sparse.value_offset, sparse.count,
               bytes_of(from.type) * static_cast<std::uint64_t>(components), false, user);
  for (std::uint64_t i = 0; i < sparse.count; ++i) {
    double place = 0.0;
    with_type(sparse.index_type, [&](auto type) {
      place = value_of<decltype(type)>(places.first + i * places.stride, false);
    });
    if (!(place >= 0 && place < static_cast<double>(from.count))) {
      refuse_gltf("{} replaces element {}, the accessor has {}", user.text(), place, from.count);
    }
    const auto at = static_cast<std::uint64_t>(place);
    if (at < first || at - first >= count) continue;
    with_type(from.type, [&](auto type) {
      copy_values<decltype(type)>(replaced.first + i * replaced.stride, replaced.stride, 1,
                                  components, from.normalized,
                                  values + (at - first) * static_cast<std::uint64_t>(components));
    });
  }
}

std::vector<double> GltfData::read_all(std::uint32_t index, int components) {
  const std::uint64_t count = document_.accessors[index].count;
  elements(index);  // before memory is taken
  std::vector<double> all(count * static_cast<std::uint64_t>(components));
  read(index, components, 0, count, all.data());
  return all;
}

std::vector<std::uint32_t> GltfData::read_indices(std::uint32_t index) {
  const GltfAccessor& from = document_.accessors[index];
  const GltfUser user{source_.name, "accessors", index};
  const bool whole = from.type == GltfNumber::kUint8 || from.type == GltfNumber::kUint16 ||
                     from.type == GltfNumber::kUint32;
  if (!whole || from.components != 1) {
    refuse_gltf("{} holds indices, so it must have scalars of type 5121, 5123 or 5125",
                user.text());
  }
  const Elements all = elements(index);
  std::vector<std::uint32_t> indices(from.count);
  if (from.sparse) {
    std::vector<double> values(from.count);
    read(index, 1, 0, from.count, values.data());
    std::transform(values.begin(), values.end(), indices.begin(),
                   [](double value) { return static_cast<std::uint32_t>(value); });
    return indices;
  }
  if (!all.first) return indices;
  if (from.type == GltfNumber::kUint32 && all.stride == 4) {
    std::memcpy(indices.data(), all.first, 4 * indices.size());
    return indices;
  }
  const unsigned char* at = all.first;
  with_type(from.type, [&](auto value) {
    for (std::uint32_t& to : indices) {
      std::memcpy(&value, at, sizeof value);
      to = static_cast<std::uint32_t>(value);
      at += all.stride;
    }
  });
  return indices;
}

Result<std::string> GltfData::read_image(std::uint32_t index) {
  const GltfImage& from = document_.images[index];
  const GltfUser user{source_.name, "images", index};
  try {
    if (from.uri) {
      if (is_data(*from.uri)) return decoded_data(*from.uri, user);
      return std::string(open_file(*from.uri, user).view());
    }
    if (from.view) return std::string(view(*from.view, user));
  } catch (const GltfRefusal& refusal) {
    return tl::unexpected(refusal.error);
  }
  return fail(ErrorCode::kInput, "{} has no bytes", user.text());
}

}  // namespace strata::detail
