// Depth lists as a NumPy archive: a ZIP of .npy arrays. ldi_io.h describes the layout.

#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "hashbuffer/formats/npy_head.h"
#include "hashbuffer/formats/seekable_output.h"
#include "strata/core/grid.h"
#include "strata/hashbuffer/formats/ldi_io.h"

namespace strata {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are written as they are");

constexpr std::size_t kPart = std::size_t{1} << 16;  // elements converted or copied at a time

// --- writing ------------------------------------------------------------------------------------

// Presents a SeekableOutput, which is empty at first, to libzip.
zip_int64_t call_output(void* state, void* data, zip_uint64_t bytes, zip_source_cmd_t command) {
  auto& to = *static_cast<SeekableOutput*>(state);
  zip_error_t error{};
  switch (command) {
    case ZIP_SOURCE_SUPPORTS:
      return zip_source_make_command_bitmap(
          ZIP_SOURCE_OPEN, ZIP_SOURCE_READ, ZIP_SOURCE_CLOSE, ZIP_SOURCE_STAT, ZIP_SOURCE_ERROR,
          ZIP_SOURCE_FREE, ZIP_SOURCE_SEEK, ZIP_SOURCE_TELL, ZIP_SOURCE_BEGIN_WRITE,
          ZIP_SOURCE_COMMIT_WRITE, ZIP_SOURCE_ROLLBACK_WRITE, ZIP_SOURCE_WRITE,
          ZIP_SOURCE_SEEK_WRITE, ZIP_SOURCE_TELL_WRITE, ZIP_SOURCE_REMOVE, -1);
    case ZIP_SOURCE_STAT: {
      auto& told = *static_cast<zip_stat_t*>(data);
      zip_stat_init(&told);
      told.size = 0;
      told.valid = ZIP_STAT_SIZE;
      return sizeof told;
    }
    case ZIP_SOURCE_ERROR:
      zip_error_set(&error, ZIP_ER_WRITE, 0);
      return zip_error_to_data(&error, data, bytes);
    case ZIP_SOURCE_WRITE:
      return to.write(data, bytes) ? static_cast<zip_int64_t>(bytes) : -1;
    case ZIP_SOURCE_SEEK_WRITE: {
      const zip_int64_t offset =
          zip_source_seek_compute_offset(to.position(), to.end(), data, bytes, &error);
      if (offset < 0) return -1;
      to.seek(static_cast<std::uint64_t>(offset));
      return 0;
    }
    case ZIP_SOURCE_TELL_WRITE:
      return static_cast<zip_int64_t>(to.position());
    default:
      return 0;
  }
}

// A .npy file that is produced part by part while libzip reads it.
struct ArraySource {
  std::string head;
  std::size_t count = 0, element_bytes = 0;
  // The bytes of a range of elements.
  std::function<std::span<const std::byte>(std::size_t, std::size_t)> part;
  std::function<bool(std::size_t)> go_on;  // called with the number of bytes produced; false stops
  std::size_t next = 0;
  std::span<const std::byte> left{};  // unread bytes of the current part

  zip_int64_t read(std::byte* to, std::size_t bytes) {
    std::size_t done = 0;
    while (done < bytes) {
      if (left.empty()) {
        if (next == count) break;
        const std::size_t end = std::min(next + kPart, count);
        left = part(std::exchange(next, end), end);
        if (!go_on(left.size())) return -1;
      }
      const std::size_t taken = std::min(left.size(), bytes - done);
      std::copy_n(left.begin(), taken, to + done);
      left = left.subspan(taken);
      done += taken;
    }
    return static_cast<zip_int64_t>(done);
  }

  static zip_int64_t call(void* state, void* data, zip_uint64_t bytes, zip_source_cmd_t command) {
    auto& array = *static_cast<ArraySource*>(state);
    switch (command) {
      case ZIP_SOURCE_SUPPORTS:
        return zip_source_make_command_bitmap(ZIP_SOURCE_OPEN, ZIP_SOURCE_READ, ZIP_SOURCE_CLOSE,
                                              ZIP_SOURCE_STAT, ZIP_SOURCE_ERROR, ZIP_SOURCE_FREE,
                                              -1);
      case ZIP_SOURCE_OPEN:
        array.next = 0;
        array.left = std::as_bytes(std::span(array.head));
        return 0;
      case ZIP_SOURCE_READ:
        return array.read(static_cast<std::byte*>(data), bytes);
      case ZIP_SOURCE_STAT: {
        auto& told = *static_cast<zip_stat_t*>(data);
        zip_stat_init(&told);
        told.size = array.head.size() + array.count * array.element_bytes;
        told.valid = ZIP_STAT_SIZE;
        return sizeof told;
      }
      case ZIP_SOURCE_ERROR: {
        zip_error_t error{};
        zip_error_set(&error, ZIP_ER_CANCELLED, 0);
        return zip_error_to_data(&error, data, bytes);
      }
      default:
        return 0;
    }
  }
};

class NpzWriter {
 public:
  NpzWriter(SeekableOutput& output, const LdiNpzOptions& options, const Execution& execution,
            std::uint64_t total_bytes)
      : options_(options), execution_(execution), total_(std::max<std::uint64_t>(total_bytes, 1)) {
    zip_source_t* const sink = zip_source_function_create(call_output, &output, nullptr);
    if (sink == nullptr) return;
    zip_ = zip_open_from_source(sink, ZIP_CREATE | ZIP_TRUNCATE, nullptr);
    if (zip_ == nullptr) zip_source_free(sink);
  }
  NpzWriter(const NpzWriter&) = delete;
  NpzWriter& operator=(const NpzWriter&) = delete;
  ~NpzWriter() {
    if (zip_ != nullptr) zip_discard(zip_);
  }

  // Adds array `name` of `count` elements. close() calls part(begin, end) for their bytes.
  template <class Part>
  bool add(const char* name, std::string_view type, const std::string& shape, std::size_t count,
           std::size_t element_bytes, Part&& part) {
    if (zip_ == nullptr) return false;
    const auto go_on = [this](std::size_t bytes) { return made(bytes); };
    arrays_.push_back(std::make_unique<ArraySource>(
        ArraySource{npy_head(type, false, shape), count, element_bytes, part, go_on}));
    zip_source_t* const source = zip_source_function(zip_, ArraySource::call, arrays_.back().get());
    if (source == nullptr) return false;
    const zip_int64_t index =
        zip_file_add(zip_, (std::string(name) + ".npy").c_str(), source, ZIP_FL_ENC_UTF_8);
    if (index < 0) {
      zip_source_free(source);
      return false;
    }
    const auto entry = static_cast<zip_uint64_t>(index);
    constexpr zip_uint16_t kFirstDay = 1 << 5 | 1;  // 1980-01-01: equal lists give equal bytes
    return zip_set_file_compression(zip_, entry, options_.compress ? ZIP_CM_DEFLATE : ZIP_CM_STORE,
                                    kLevel) == 0 &&
           zip_file_set_dostime(zip_, entry, 0, kFirstDay, 0) == 0;
  }
  // Writes the archive.
  bool close() {
    if (zip_ == nullptr || zip_close(zip_) != 0) return false;
    zip_ = nullptr;
    return true;
  }

 private:
  static constexpr zip_uint32_t kLevel = 6;  // zlib's default

  bool made(std::size_t bytes) {
    done_ += bytes;
    if (execution_.progress) {
      execution_.progress(std::min(1.0, static_cast<double>(done_) / static_cast<double>(total_)));
    }
    return !execution_.stop.stop_requested();
  }
  LdiNpzOptions options_;
  const Execution& execution_;
  std::uint64_t total_, done_ = 0;
  std::vector<std::unique_ptr<ArraySource>> arrays_;
  zip_t* zip_ = nullptr;
};

bool write_arrays(NpzWriter& zip, const LayeredDepthImage& image) {
  const std::span<const DepthItem> items = image.items;
  const auto borrowed = [](const auto& array) {
    return [view = std::span(array)](std::size_t begin, std::size_t end) {
      return std::as_bytes(view.subspan(begin, end - begin));
    };
  };
  std::vector<std::uint32_t> part;
  const auto converted = [&](auto value) {
    return [&, value](std::size_t begin, std::size_t end) {
      part.resize(end - begin);
      std::transform(items.begin() + static_cast<std::ptrdiff_t>(begin),
                     items.begin() + static_cast<std::ptrdiff_t>(end), part.begin(), value);
      return std::as_bytes(std::span<const std::uint32_t>(part));
    };
  };
  std::array<double, 16> matrix;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      matrix[static_cast<std::size_t>(4 * row + column)] = image.world_from_image[column][row];
    }
  }
  const std::array<std::int64_t, 2> shape = {image.height, image.width};
  const std::array<std::uint32_t, 1> limit = {image.depth_limit};
  return zip.add("shape", "<i8", "(2,)", 2, 8, borrowed(shape)) &&
         zip.add("depth_limit", "<u4", "()", 1, 4, borrowed(limit)) &&
         zip.add("world_from_image", "<f8", "(4, 4)", 16, 8, borrowed(matrix)) &&
         zip.add("offsets", "<u8", fmt::format("({},)", image.offsets.size()), image.offsets.size(),
                 8, borrowed(image.offsets)) &&
         zip.add("depth", "<u4", fmt::format("({},)", items.size()), items.size(), 4,
                 converted([](DepthItem item) { return item.depth(); })) &&
         zip.add("payload", "<u4", fmt::format("({},)", items.size()), items.size(), 4,
                 converted([](DepthItem item) { return item.payload(); })) &&
         zip.close();
}

// --- reading ------------------------------------------------------------------------------------

// The most bytes that deflate makes of one byte.
constexpr std::uint64_t kLargestRatio = 1040;

// Whether a ZIP's closing record ends exactly at the end of the file.
bool ends_as_archive(const std::string& path) {
  constexpr std::streamoff kRecord = 22;  // without a comment, as NumPy and Strata write it
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file || file.tellg() < kRecord) return false;
  std::array<char, 4> signature{};
  file.seekg(-kRecord, std::ios::end);
  file.read(signature.data(), signature.size());
  return file && std::memcmp(signature.data(), "PK\5\6", 4) == 0;
}

struct ZipCloser {
  void operator()(zip_t* zip) const { zip_discard(zip); }
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};

// The contents of a .npy header.
struct ArrayHead {
  std::string type;
  std::vector<std::uint64_t> shape;
  std::uint64_t count = 1;
};

// The text after `key` in the dictionary of a header.
std::string_view value_of(std::string_view text, std::string_view key) {
  const std::size_t at = text.find(key);
  if (at == std::string_view::npos) return {};
  text.remove_prefix(at + key.size());
  const std::size_t start = text.find_first_not_of(" :");
  return start == std::string_view::npos ? std::string_view{} : text.substr(start);
}

// Returns an empty type if the header is malformed.
ArrayHead parse_head(std::string_view text) {
  ArrayHead head;
  const std::string_view type = value_of(text, "'descr'");
  const std::string_view order = value_of(text, "'fortran_order'");
  std::string_view shape = value_of(text, "'shape'");
  const std::size_t end = shape.find(')');
  if (type.size() < 5 || type[0] != '\'' || type[4] != '\'' || !order.starts_with("False") ||
      !shape.starts_with('(') || end == std::string_view::npos) {
    return head;
  }
  shape = shape.substr(1, end - 1);
  while (true) {
    const std::size_t start = shape.find_first_not_of(" ,");
    if (start == std::string_view::npos) break;
    shape.remove_prefix(start);
    std::uint64_t length = 0;
    const auto [rest, error] = std::from_chars(shape.data(), shape.data() + shape.size(), length);
    if (error != std::errc() || length > std::numeric_limits<std::uint32_t>::max() * 16ULL ||
        (head.count != 0 && length > std::numeric_limits<std::uint64_t>::max() / head.count)) {
      return head;
    }
    shape.remove_prefix(static_cast<std::size_t>(rest - shape.data()));
    head.shape.push_back(length);
    head.count *= length;
  }
  head.type = std::string(type.substr(1, 3));
  return head;
}

class NpzReader {
 public:
  NpzReader(const std::string& path, const Execution& execution)
      : path_(path), execution_(execution) {
    std::error_code error;
    file_bytes_ = std::filesystem::file_size(path, error);
    if (!error && ends_as_archive(path)) zip_.reset(zip_open(path.c_str(), ZIP_RDONLY, nullptr));
  }
  [[nodiscard]] bool opened() const { return zip_ != nullptr; }

  // Reads a whole array and checks its `shape`; an entry of kAny accepts any length. `bytes_beside`
  // is what the caller makes of each element. It counts for the memory limit too.
  static constexpr std::uint64_t kAny = ~std::uint64_t{0};
  template <class T>
  Result<std::vector<T>> read(const char* name, const char* type,
                              const std::vector<std::uint64_t>& shape,
                              std::size_t bytes_beside = 0) {
    const Result<std::uint64_t> count = open(name, type, sizeof(T), bytes_beside, shape);
    if (!count) return tl::unexpected(count.error());
    std::vector<T> values(*count);
    const auto bytes = std::as_writable_bytes(std::span(values));
    for (std::size_t begin = 0; begin < bytes.size(); begin += kPart) {
      if (execution_.stop.stop_requested()) {
        return fail(ErrorCode::kCancelled, "{}: cancelled", path_);
      }
      if (!read_bytes(bytes.subspan(begin, std::min(kPart, bytes.size() - begin)))) {
        return damaged(name);
      }
    }
    // Reading to the end of the entry also checks its checksum.
    std::byte beyond;
    if (zip_fread(entry_.get(), &beyond, 1) != 0) return damaged(name);
    entry_.reset();
    return values;
  }

 private:
  tl::unexpected<Error> damaged(const char* name) const {
    return fail(ErrorCode::kInput, "{}: array {} is damaged or ends early", path_, name);
  }
  bool read_bytes(std::span<std::byte> out) {
    while (!out.empty()) {
      const zip_int64_t got = zip_fread(entry_.get(), out.data(), out.size());
      if (got <= 0) return false;
      out = out.subspan(static_cast<std::size_t>(got));
    }
    return true;
  }
  // Moves to the data of an array. @return its number of elements
  Result<std::uint64_t> open(const char* name, const char* type, std::size_t size,
                             std::size_t bytes_beside, const std::vector<std::uint64_t>& shape) {
    zip_stat_t info{};
    if (zip_stat(zip_.get(), (std::string(name) + ".npy").c_str(), 0, &info) != 0 ||
        (info.valid & ZIP_STAT_SIZE) == 0 || (info.valid & ZIP_STAT_INDEX) == 0) {
      return fail(ErrorCode::kInput, "{}: no array {}", path_, name);
    }
    std::array<char, 10> start{};
    std::string text;
    entry_.reset(zip_fopen_index(zip_.get(), info.index, 0));
    if (entry_ == nullptr || !read_bytes(std::as_writable_bytes(std::span(start))) ||
        std::memcmp(start.data(), "\x93NUMPY\x01", 7) != 0) {
      return damaged(name);
    }
    const std::size_t length =
        static_cast<unsigned char>(start[8]) + 256u * static_cast<unsigned char>(start[9]);
    text.resize(length);
    if (!read_bytes(std::as_writable_bytes(std::span(text)))) return damaged(name);
    const ArrayHead head = parse_head(text);
    bool fits = head.type == type && head.shape.size() == shape.size();
    for (std::size_t i = 0; fits && i < shape.size(); ++i) {
      fits = shape[i] == kAny || shape[i] == head.shape[i];
    }
    if (!fits) {
      return fail(ErrorCode::kInput, "{}: array {} has type '{}' and shape ({}), not '{}' and ({})",
                  path_, name, head.type, fmt::join(head.shape, ", "), type, describe(shape));
    }
    const std::uint64_t bytes = head.count * size;
    if (info.size != start.size() + length + bytes || bytes / kLargestRatio > file_bytes_) {
      return fail(ErrorCode::kInput, "{}: array {} of {} elements has {} bytes", path_, name,
                  head.count, info.size);
    }
    held_ += head.count * (size + bytes_beside);
    if (execution_.memory_limit != 0 && held_ > execution_.memory_limit) {
      return fail(ErrorCode::kLimit, "{}: array {} needs {} bytes, the memory limit is {}", path_,
                  name, held_, execution_.memory_limit);
    }
    return head.count;
  }
  static std::string describe(const std::vector<std::uint64_t>& shape) {
    std::vector<std::string> words;
    for (const std::uint64_t length : shape) {
      words.push_back(length == kAny ? "any" : std::to_string(length));
    }
    return fmt::format("{}", fmt::join(words, ", "));
  }

  const std::string& path_;
  const Execution& execution_;
  std::uint64_t file_bytes_ = 0, held_ = 0;
  std::unique_ptr<zip_t, ZipCloser> zip_;
  std::unique_ptr<zip_file_t, ZipCloser> entry_;  // the entry being read
};

Result<LayeredDepthImage> read_arrays(const std::string& path, const Execution& execution) {
  NpzReader zip(path, execution);
  if (!zip.opened()) {
    return fail(ErrorCode::kInput, "{}: not a NumPy archive, or it ends early", path);
  }
  const auto shape = zip.read<std::int64_t>("shape", "<i8", {2});
  if (!shape) return tl::unexpected(shape.error());
  const auto limit = zip.read<std::uint32_t>("depth_limit", "<u4", {});
  if (!limit) return tl::unexpected(limit.error());
  const auto matrix = zip.read<double>("world_from_image", "<f8", {4, 4});
  if (!matrix) return tl::unexpected(matrix.error());
  const auto [height, width] = std::pair((*shape)[0], (*shape)[1]);
  if (height < 1 || width < 1 || height > kMaxGridSide || width > kMaxGridSide) {
    return fail(ErrorCode::kInput, "{}: {} x {} pixels; each side must be 1 to {}", path, width,
                height, kMaxGridSide);
  }
  LayeredDepthImage image;
  image.width = static_cast<int>(width);
  image.height = static_cast<int>(height);
  image.depth_limit = limit->front();
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      image.world_from_image[column][row] = (*matrix)[static_cast<std::size_t>(4 * row + column)];
    }
  }
  auto offsets =
      zip.read<std::uint64_t>("offsets", "<u8", {static_cast<std::uint64_t>(width * height) + 1});
  if (!offsets) return tl::unexpected(offsets.error());
  image.offsets = std::move(*offsets);
  {
    const auto depth =
        zip.read<std::uint32_t>("depth", "<u4", {NpzReader::kAny}, sizeof(DepthItem));
    if (!depth) return tl::unexpected(depth.error());
    image.items.reserve(depth->size());
    for (const std::uint32_t d : *depth) image.items.emplace_back(std::uint64_t{d} << 32);
  }
  const auto payload = zip.read<std::uint32_t>("payload", "<u4", {image.items.size()});
  if (!payload) return tl::unexpected(payload.error());
  for (std::size_t i = 0; i < payload->size(); ++i) image.items[i].bits |= (*payload)[i];
  if (const Result<void> valid = check_layered_depth_image(image); !valid) {
    return fail(ErrorCode::kInput, "{}: {}", path, valid.error().message);
  }
  return image;
}

}  // namespace

Result<void> write_ldi_npz(const std::string& path, const LayeredDepthImage& image,
                           const LdiNpzOptions& options, const Execution& execution) {
  if (const Result<void> valid = check_layered_depth_image(image); !valid) return valid;
  try {
    Result<SeekableOutput> output = SeekableOutput::create(path);
    if (!output) return tl::unexpected(output.error());
    bool written = false;
    {
      NpzWriter zip(*output, options, execution, image.offsets.size() * 8 + image.items.size() * 8);
      written = write_arrays(zip, image);
    }
    if (execution.stop.stop_requested() && !written) {
      return fail(ErrorCode::kCancelled, "{}: cancelled", path);
    }
    if (!output->status()) return output->status();
    if (!written) return fail(ErrorCode::kOutput, "{}: the archive cannot be written", path);
    return output->finish();
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory", path);
  }
}

Result<LayeredDepthImage> read_ldi_npz(const std::string& path, const Execution& execution) {
  try {
    return read_arrays(path, execution);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory", path);
  }
}

}  // namespace strata
