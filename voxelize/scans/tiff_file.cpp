#include "voxelize/scans/tiff_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>

#include "voxelize/heads/head_fields.h"

namespace strata {
namespace {

enum Tag : std::uint16_t {
  kWidth = 256,
  kLength = 257,
  kBits = 258,
  kCompression = 259,
  kPhotometric = 262,
  kDescription = 270,
  kStripOffsets = 273,
  kSamples = 277,
  kRowsPerStrip = 278,
  kStripBytes = 279,
  kXResolution = 282,
  kYResolution = 283,
  kPlanar = 284,
  kPredictor = 317,
  kTileWidth = 322,
  kSampleFormat = 339
};

/// A directory and its values.
struct Directory {
  std::map<std::uint16_t, std::vector<double>> numbers;
  std::string description;
  std::uint64_t next = 0;
  [[nodiscard]] double number(Tag tag, double otherwise) const {
    const auto found = numbers.find(tag);
    return found == numbers.end() || found->second.empty() ? otherwise : found->second[0];
  }
};

class TiffParser {
 public:
  TiffParser(std::string_view bytes, const std::string& path) : bytes_(bytes), path_(path) {}

  Result<TiffFile> parse();

 private:
  [[nodiscard]] tl::unexpected<Error> refused(std::string_view what) const {
    return fail(ErrorCode::kInput, "{}: page {}: {}", path_, page_, what);
  }
  /// A whole number of `size` bytes; 0 and failed_ beyond the end.
  std::uint64_t whole(std::uint64_t at, std::size_t size) {
    if (at > bytes_.size() || size > bytes_.size() - at) {
      failed_ = true;
      return 0;
    }
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const auto byte =
          static_cast<unsigned char>(bytes_[at + (file_.big_endian ? size - 1 - i : i)]);
      value |= static_cast<std::uint64_t>(byte) << 8 * i;
    }
    return value;
  }
  Result<Directory> directory(std::uint64_t at);
  void take_entry(std::uint64_t at, Directory& into);
  Result<void> add_page(const Directory& page);
  Result<void> take_first(const Directory& page);
  Result<void> add_strips(const Directory& page);
  void place(const Directory& first);
  void place_by_own(const HeadFields& lines);

  std::string_view bytes_;
  const std::string& path_;
  bool big_ = false, failed_ = false;
  int page_ = 0;
  TiffFile file_;
  std::uint64_t contiguous_ = 1;  // pages of a stack that has one directory
};

void TiffParser::take_entry(std::uint64_t at, Directory& into) {
  constexpr std::size_t kSizes[] = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4, 0, 0, 8, 8, 8};
  const auto tag = static_cast<std::uint16_t>(whole(at, 2));
  const std::uint64_t type = whole(at + 2, 2), count = whole(at + 4, big_ ? 8 : 4);
  const std::size_t size = type < std::size(kSizes) ? kSizes[type] : 0;
  const std::size_t field = big_ ? 8 : 4;
  if (size == 0 || count > bytes_.size() / size) return;
  at += 4 + field;
  if (size * count > field) at = whole(at, field);
  if (tag == kDescription) {
    if (at <= bytes_.size() && count <= bytes_.size() - at)
      into.description = bytes_.substr(at, count);
    return;
  }
  constexpr Tag kKnown[] = {kWidth,        kLength,  kBits,         kCompression, kPhotometric,
                            kStripOffsets, kSamples, kRowsPerStrip, kStripBytes,  kXResolution,
                            kYResolution,  kPlanar,  kPredictor,    kTileWidth,   kSampleFormat};
  if (std::find(std::begin(kKnown), std::end(kKnown), tag) == std::end(kKnown)) return;
  std::vector<double>& numbers = into.numbers[tag];
  for (std::uint64_t i = 0; i < count && !failed_; ++i) {
    const std::uint64_t place = at + i * size;
    numbers.push_back(type == 5 ? static_cast<double>(whole(place, 4)) /
                                      static_cast<double>(whole(place + 4, 4))
                                : static_cast<double>(whole(place, size)));
  }
}

Result<Directory> TiffParser::directory(std::uint64_t at) {
  Directory read;
  const std::uint64_t count = whole(at, big_ ? 8 : 2), entry = big_ ? 20 : 12;
  at += big_ ? 8 : 2;
  if (count > bytes_.size() / entry) failed_ = true;
  for (std::uint64_t i = 0; i < count && !failed_; ++i) take_entry(at + i * entry, read);
  read.next = whole(at + count * entry, big_ ? 8 : 4);
  if (failed_) return refused("the directory lies beyond the end of the file");
  return read;
}

Result<void> TiffParser::take_first(const Directory& page) {
  if (page.numbers.contains(kTileWidth)) return refused("tiles are not read; strips are");
  constexpr double kRgb = 2;
  file_.colours = page.number(kSamples, 1) == 4 && page.number(kPhotometric, 1) == kRgb &&
                  page.number(kBits, 1) == 8 && page.number(kPlanar, 1) == 1;
  if (page.number(kSamples, 1) != 1 && !file_.colours) {
    return refused(
        fmt::format("{} numbers a voxel; one is read, or red, green, blue and alpha of "
                    "8 bits, side by side",
                    page.number(kSamples, 1)));
  }
  if (page.number(kPhotometric, 1) != 1 && !file_.colours) {
    return refused("pictures of other colours, or whose 0 is white, are not read");
  }
  const double compression = page.number(kCompression, 1);
  if (compression != 1 && compression != 8 && compression != 32946) {
    return refused(
        fmt::format("compression {} is not read; none and deflate (8) are", compression));
  }
  file_.packed = compression != 1;
  if (file_.packed && page.number(kPredictor, 1) != 1) return refused("a predictor is not read");
  const auto bits = static_cast<int>(page.number(kBits, 1));
  const auto format = static_cast<int>(page.number(kSampleFormat, 1));
  using enum NumberType;
  const std::optional<NumberType> type = numpy_type(fmt::format("{}{}",
                                                                format == 3   ? 'f'
                                                                : format == 2 ? 'i'
                                                                              : 'u',
                                                                bits / 8));
  if (!type || bits % 8 != 0 || bits > 64 || format > 3 || format < 1) {
    return refused(fmt::format("{} bits a voxel of kind {} are not read", bits, format));
  }
  file_.type = file_.colours ? kU32 : *type;
  file_.axes.sizes = {page.number(kWidth, 0), page.number(kLength, 0), 0.0};
  // A stack of ImageJ has one directory, and its pages follow one another.
  for (std::size_t begin = 0; begin < page.description.size();) {
    const std::size_t end = std::min(page.description.find('\n', begin), page.description.size());
    const std::string_view line = std::string_view(page.description).substr(begin, end - begin);
    begin = end + 1;
    if (!page.description.starts_with("ImageJ=") || !line.starts_with("images=")) continue;
    const std::vector<double> images = numbers_of(line.substr(7));
    if (page.next == 0 && !images.empty() && images[0] >= 1.0 && images[0] <= kMaxGridSide) {
      contiguous_ = static_cast<std::uint64_t>(images[0]);
    }
  }
  return {};
}

Result<void> TiffParser::add_strips(const Directory& page) {
  const auto offsets = page.numbers.find(kStripOffsets), sizes = page.numbers.find(kStripBytes);
  const double rows = file_.axes.sizes[1];
  const double a_strip = std::min(rows, page.number(kRowsPerStrip, rows));
  if (offsets == page.numbers.end() || sizes == page.numbers.end() || !(a_strip >= 1.0) ||
      offsets->second.size() != sizes->second.size() ||
      static_cast<double>(offsets->second.size()) != std::ceil(rows / a_strip)) {
    return refused("the places of its strips are missing");
  }
  const double row = file_.axes.sizes[0] * static_cast<double>(bytes_of(file_.type));
  for (std::size_t i = 0; i < offsets->second.size(); ++i) {
    TiffFile::Strip strip;
    strip.at = static_cast<std::uint64_t>(offsets->second[i]);
    strip.bytes = static_cast<std::uint64_t>(sizes->second[i]);
    strip.dense = static_cast<std::uint64_t>(
        row * std::min(a_strip, rows - a_strip * static_cast<double>(i)));
    if (strip.at > bytes_.size() || strip.bytes > bytes_.size() - strip.at ||
        (!file_.packed && strip.bytes < strip.dense)) {
      return refused(fmt::format("strip {} ends beyond the end of the file", i));
    }
    file_.strips.push_back(strip);
  }
  return {};
}

Result<void> TiffParser::add_page(const Directory& page) {
  if (page_ == 0) {
    if (auto taken = take_first(page); !taken) return taken;
  }
  const double width = page.number(kWidth, 0), length = page.number(kLength, 0);
  if (width != file_.axes.sizes[0] || length != file_.axes.sizes[1]) {
    return refused(fmt::format("{} x {} pixels; those before are {} x {}", width, length,
                               file_.axes.sizes[0], file_.axes.sizes[1]));
  }
  if (!(width >= 1.0 && length >= 1.0 && width <= kMaxGridSide && length <= kMaxGridSide)) {
    return refused(
        fmt::format("{} x {} pixels; each side must be 1 to {}", width, length, kMaxGridSide));
  }
  file_.axes.sizes[2] += static_cast<double>(contiguous_);
  if (contiguous_ == 1) return add_strips(page);
  const auto offsets = page.numbers.find(kStripOffsets);
  TiffFile::Strip stack;
  stack.dense = static_cast<std::uint64_t>(width * length) * bytes_of(file_.type) * contiguous_;
  stack.at = offsets == page.numbers.end() || offsets->second.empty()
                 ? bytes_.size()
                 : static_cast<std::uint64_t>(offsets->second[0]);
  if (file_.packed || stack.at > bytes_.size() || stack.dense > bytes_.size() - stack.at) {
    return refused(
        fmt::format("{} pages that follow it end beyond the end of the file", contiguous_));
  }
  stack.bytes = stack.dense;
  file_.strips.push_back(stack);
  return {};
}

void TiffParser::place_by_own(const HeadFields& lines) {
  const std::vector<double> origin = numbers_of(lines.get("strata_origin"));
  const std::vector<double> size = numbers_of(lines.get("strata_voxel_size"));
  const std::vector<double> turn = numbers_of(lines.get("strata_direction"));
  if (origin.size() != 3 || size.size() != 3) return;
  glm::dmat3 direction(1.0);
  for (int i = 0; i < 9 && turn.size() == 9; ++i) {
    direction[i / 3][i % 3] = turn[static_cast<std::size_t>(i)];
  }
  for (int axis = 0; axis < 3; ++axis) {
    file_.axes.steps[axis] = direction[axis] * size[static_cast<std::size_t>(axis)];
  }
  file_.axes.place = direction * glm::dvec3(origin[0], origin[1], origin[2]);
  file_.axes.corner = true;
  file_.placed = true;
  file_.space = lines.get("strata_space");
}

void TiffParser::place(const Directory& first) {
  HeadFields lines;
  for (std::size_t begin = 0; begin < first.description.size();) {
    const std::size_t end = std::min(first.description.find('\n', begin), first.description.size());
    const std::string_view line = std::string_view(first.description).substr(begin, end - begin);
    begin = end + 1;
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos) continue;
    lines.set(trimmed(line.substr(0, equals)), trimmed(line.substr(equals + 1)));
  }
  if (!lines.contains("ImageJ")) return;
  glm::dvec3 size(1.0), origin(0.0);
  const double across[2] = {first.number(kXResolution, 1.0), first.number(kYResolution, 1.0)};
  for (int axis = 0; axis < 2; ++axis) {
    if (std::isfinite(across[axis]) && across[axis] > 0.0) size[axis] = 1.0 / across[axis];
  }
  const std::vector<double> spacing = numbers_of(lines.get("spacing"));
  if (spacing.size() == 1 && spacing[0] > 0.0) size.z = spacing[0];
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double> at = numbers_of(lines.get(fmt::format("{}origin", "xyz"[axis])));
    file_.axes.steps[axis] = glm::dvec3(0.0);
    file_.axes.steps[axis][axis] = size[axis];
    if (at.size() == 1) origin[axis] = -at[0] * size[axis], file_.placed = true;
  }
  file_.axes.place = origin;
  file_.unit_metres = unit_named(lines.get("unit"));
  place_by_own(lines);
}

Result<TiffFile> TiffParser::parse() {
  const bool little = bytes_.starts_with("II"), msb = bytes_.starts_with("MM");
  file_.big_endian = msb;
  const std::uint64_t version = little || msb ? whole(2, 2) : 0;
  big_ = version == 43;
  if (version != 42 && version != 43) {
    return fail(ErrorCode::kInput,
                "{}: not a TIFF file: it begins with neither II nor MM and 42 or 43", path_);
  }
  std::uint64_t at = big_ ? whole(8, 8) : whole(4, 4);
  std::optional<Directory> first;
  while (at != 0) {
    if (page_ == kMaxGridSide) {
      return fail(ErrorCode::kLimit, "{}: more than {} pages", path_, kMaxGridSide);
    }
    auto page = directory(at);
    if (!page) return tl::unexpected(page.error());
    at = page->next;
    if (auto added = add_page(*page); !added) return tl::unexpected(added.error());
    ++page_;
    if (!first) first = std::move(*page);
  }
  if (!first) return fail(ErrorCode::kInput, "{}: no page", path_);
  place(*first);
  return std::move(file_);
}

}  // namespace

Result<TiffFile> parse_tiff(std::string_view bytes, const std::string& path) {
  return TiffParser(bytes, path).parse();
}

}  // namespace strata
