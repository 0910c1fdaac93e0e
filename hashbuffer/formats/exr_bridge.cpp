// The only file that includes OpenEXR. It writes and reads depth lists as deep scanline files;
// ldi_io.h describes the layout.
//
// The samples follow: Florian Kainz. Interpreting OpenEXR Deep Pixels. 2013.

#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineInputFile.h>
#include <ImfDeepScanLineOutputFile.h>
#include <ImfDoubleAttribute.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfIntAttribute.h>
#include <ImfMatrixAttribute.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <ImfVersion.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <limits>
#include <mutex>
#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "hashbuffer/formats/seekable_output.h"
#include "strata/core/grid.h"
#include "strata/hashbuffer/formats/ldi_io.h"

namespace strata {
namespace {

static_assert(std::endian::native == std::endian::little, "raw chunks are read as they are");

constexpr std::uint32_t kNone = 0xffffffffu;  // strata.depthBack if no crossing ends the sample
constexpr const char* kIntervals = "intervals";
constexpr const char* kSamples = "samples";

struct Sample {
  float a = 1, z = 0, z_back = 0;
  std::uint32_t id = 0, facing = 0, depth = 0, payload = 0, depth_back = kNone, payload_back = 0;
};

struct Channel {
  const char* name;
  Imf::PixelType type;
  std::size_t offset;
};

constexpr std::array kIntervalChannels = {
    Channel{"A", Imf::FLOAT, offsetof(Sample, a)},
    Channel{"Z", Imf::FLOAT, offsetof(Sample, z)},
    Channel{"ZBack", Imf::FLOAT, offsetof(Sample, z_back)},
    Channel{"id", Imf::UINT, offsetof(Sample, id)},
    Channel{"strata.depth", Imf::UINT, offsetof(Sample, depth)},
    Channel{"strata.payload", Imf::UINT, offsetof(Sample, payload)},
    Channel{"strata.depthBack", Imf::UINT, offsetof(Sample, depth_back)},
    Channel{"strata.payloadBack", Imf::UINT, offsetof(Sample, payload_back)},
};
constexpr std::array kSampleChannels = {
    Channel{"A", Imf::FLOAT, offsetof(Sample, a)},
    Channel{"Z", Imf::FLOAT, offsetof(Sample, z)},
    Channel{"id", Imf::UINT, offsetof(Sample, id)},
    Channel{"facing", Imf::UINT, offsetof(Sample, facing)},
    Channel{"strata.depth", Imf::UINT, offsetof(Sample, depth)},
    Channel{"strata.payload", Imf::UINT, offsetof(Sample, payload)},
};

std::span<const Channel> channels_of(bool samples) {
  if (samples) return kSampleChannels;
  return kIntervalChannels;
}

// World length of a lattice step along the rays, or 1 (see ldi_io.h).
double depth_scale(const LayeredDepthImage& image) {
  const glm::dmat4& m = image.world_from_image;
  const bool affine = m[0][3] == 0 && m[1][3] == 0 && m[2][3] == 0 && m[3][3] == 1;
  const double length = std::hypot(m[2][0], m[2][1], m[2][2]);
  const bool fits = length > std::numeric_limits<float>::min() &&
                    length * image.depth_limit < std::numeric_limits<float>::max() / 2;
  return affine && fits ? length : 1.0;
}

float next_float(float x) { return std::nextafter(x, std::numeric_limits<float>::infinity()); }

// Appends the samples of one list. Z is strictly increasing, so the deep pixel is tidy.
void append_samples(std::span<const DepthItem> list, bool points, double scale,
                    std::vector<Sample>& out) {
  const std::size_t start = out.size();
  float z = -1;
  std::int64_t winding = 0;
  bool open = false;  // the next crossing ends the last sample
  for (const DepthItem item : list) {
    z = std::max(static_cast<float>(item.depth() * scale), z < 0 ? 0.0F : next_float(z));
    if (open && out.size() > start) out.back().z_back = z;
    winding += item.exit() ? -1 : 1;
    if (!points && item.exit() && winding == 0) {  // it closes the last sample
      out.back().depth_back = item.depth();
      out.back().payload_back = item.payload();
      open = false;
      continue;
    }
    Sample sample;
    sample.z = sample.z_back = z;
    sample.id = item.triangle();
    sample.facing = item.exit() ? 1 : 0;
    sample.depth = item.depth();
    sample.payload = item.payload();
    open = winding > 0;
    sample.a = points || open ? 1.0F : 0.0F;
    out.push_back(sample);
  }
}

// --- streams ------------------------------------------------------------------------------------

// OpenEXR expects exceptions from its streams. They do not leave this file.
class OutputStream final : public Imf::OStream {
 public:
  OutputStream(SeekableOutput& output, const std::string& name)
      : Imf::OStream(name.c_str()), output_(output) {}
  void write(const char c[], int n) override {
    const Result<void> written = output_.write(c, static_cast<std::size_t>(n));
    if (!written) throw std::runtime_error(written.error().message);
  }
  std::uint64_t tellp() override { return output_.position(); }
  void seekp(std::uint64_t position) override { output_.seek(position); }

 private:
  SeekableOutput& output_;
};

class InputStream final : public Imf::IStream {
 public:
  explicit InputStream(const std::string& path)
      : Imf::IStream(path.c_str()), file_(path, std::ios::binary | std::ios::ate) {
    if (file_) size_ = static_cast<std::uint64_t>(std::max<std::streamoff>(file_.tellg(), 0));
    file_.seekg(0);
  }
  [[nodiscard]] bool opened() const { return static_cast<bool>(file_); }
  [[nodiscard]] std::uint64_t size() const { return size_; }
  bool read(char c[], int n) override {
    if (n < 0 || static_cast<std::uint64_t>(n) > size_ - std::min(position_, size_)) {
      throw std::runtime_error("the file ends early");
    }
    file_.read(c, n);
    if (!file_) throw std::runtime_error("the file cannot be read");
    position_ += static_cast<std::uint64_t>(n);
    return position_ < size_;
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override {
    position_ = position;
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(std::min(position, size_)));
  }
  void clear() override { file_.clear(); }

 private:
  std::ifstream file_;
  std::uint64_t size_ = 0, position_ = 0;
};

// OpenEXR compresses with one thread pool for the whole process. If the application has not started
// it, this object runs one while a file is written.
class ThreadPool {
 public:
  explicit ThreadPool(int threads) {
    const std::lock_guard lock(mutex_);
    if (users_ == 0 && Imf::globalThreadCount() == 0 && threads > 1) {
      Imf::setGlobalThreadCount(threads);
      ours_ = true;
    }
    ++users_;
  }
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;
  ~ThreadPool() {
    const std::lock_guard lock(mutex_);
    if (--users_ == 0 && std::exchange(ours_, false)) Imf::setGlobalThreadCount(0);
  }

 private:
  static inline std::mutex mutex_;
  static inline int users_ = 0;
  static inline bool ours_ = false;
};

// --- writing ------------------------------------------------------------------------------------

Imf::Header make_header(const LayeredDepthImage& image, bool samples, double scale) {
  Imf::Header header(image.width, image.height);
  header.setType(Imf::DEEPSCANLINE);
  header.compression() = Imf::ZIPS_COMPRESSION;
  for (const Channel& channel : channels_of(samples)) {
    header.channels().insert(channel.name, Imf::Channel(channel.type));
  }
  Imf::addDeepImageState(header, Imf::DIS_TIDY);
  Imath::M44d matrix;  // its rows are the columns of GLM's matrix
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) matrix[i][j] = image.world_from_image[i][j];
  }
  header.insert("strata.version", Imf::IntAttribute(1));
  header.insert("strata.mode", Imf::StringAttribute(samples ? kSamples : kIntervals));
  header.insert("strata.depth_limit", Imf::IntAttribute(static_cast<int>(image.depth_limit)));
  header.insert("strata.depth_scale", Imf::DoubleAttribute(scale));
  header.insert("strata.world_from_image", Imf::M44dAttribute(matrix));
  return header;
}

// A batch of rows: their samples and the pointer tables through which OpenEXR reads them.
class RowBatch {
 public:
  RowBatch(int width, std::span<const Channel> channels)
      : width_(static_cast<std::size_t>(width)), channels_(channels), pointers_(channels.size()) {}

  void fill(const LayeredDepthImage& image, int begin, int end, bool points, double scale) {
    begin_ = begin;
    samples_.clear();
    starts_.assign(1, 0);
    counts_.clear();
    for (int v = begin; v < end; ++v) {
      for (int u = 0; u < image.width; ++u) {
        append_samples(image.list(u, v), points, scale, samples_);
        counts_.push_back(static_cast<std::uint32_t>(samples_.size() - starts_.back()));
        starts_.push_back(samples_.size());
      }
    }
    for (std::size_t c = 0; c < channels_.size(); ++c) {
      pointers_[c].resize(counts_.size());
      char* const base = reinterpret_cast<char*>(samples_.data()) + channels_[c].offset;
      for (std::size_t i = 0; i < counts_.size(); ++i) {
        pointers_[c][i] = base + starts_[i] * sizeof(Sample);
      }
    }
  }
  [[nodiscard]] Imf::DeepFrameBuffer frame_buffer() {
    Imf::DeepFrameBuffer frame;
    frame.insertSampleCountSlice(Imf::Slice(Imf::UINT, origin(counts_.data(), sizeof counts_[0]),
                                            sizeof counts_[0], sizeof counts_[0] * width_));
    for (std::size_t c = 0; c < channels_.size(); ++c) {
      frame.insert(channels_[c].name,
                   Imf::DeepSlice(channels_[c].type, origin(pointers_[c].data(), sizeof(char*)),
                                  sizeof(char*), sizeof(char*) * width_, sizeof(Sample)));
    }
    return frame;
  }

 private:
  // The address that row 0 would have. It lies outside the array, so it is computed with integers.
  [[nodiscard]] char* origin(void* data, std::size_t bytes) const {
    return reinterpret_cast<char*>(reinterpret_cast<std::uintptr_t>(data) -
                                   static_cast<std::size_t>(begin_) * width_ * bytes);
  }
  std::size_t width_;
  std::span<const Channel> channels_;
  int begin_ = 0;
  std::vector<Sample> samples_;
  std::vector<std::size_t> starts_;
  std::vector<std::uint32_t> counts_;
  std::vector<std::vector<char*>> pointers_;
};

Result<void> write_rows(SeekableOutput& output, const std::string& path,
                        const LayeredDepthImage& image, bool samples, const Execution& execution) {
  const double scale = depth_scale(image);
  const int threads = execution.thread_count();
  const ThreadPool pool(threads);
  OutputStream stream(output, path);
  Imf::DeepScanLineOutputFile file(stream, make_header(image, samples, scale), threads);
  constexpr int kBatchPixels = 1 << 16;
  const int rows = std::max({kBatchPixels / image.width, threads, 1});
  RowBatch batch(image.width, channels_of(samples));
  for (int begin = 0; begin < image.height; begin += rows) {
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "{}: cancelled", path);
    const int end = std::min(begin + rows, image.height);
    batch.fill(image, begin, end, samples, scale);
    file.setFrameBuffer(batch.frame_buffer());
    file.writePixels(end - begin);
    if (execution.progress) execution.progress(static_cast<double>(end) / image.height);
  }
  return {};
}

// --- reading ------------------------------------------------------------------------------------

// The most bytes that zlib makes of one byte.
constexpr std::uint64_t kLargestRatio = 1040;
constexpr std::uint64_t kChunkHeader = 28;  // [row:i32 | counts:u64 | packed:u64 | unpacked:u64]

tl::unexpected<Error> not_ours(const std::string& path, const std::string& why) {
  return fail(ErrorCode::kInput, "{}: not depth lists written by Strata: {}", path, why);
}

// Walks over the header before OpenEXR does, because OpenEXR allocates as much as a false length
// demands.
Result<void> check_header_lengths(InputStream& stream, const std::string& path) {
  constexpr std::uint64_t kLongestAttribute = 1 << 16;
  std::array<char, 8> start{};
  stream.read(start.data(), 8);
  std::uint32_t version = 0;
  std::memcpy(&version, start.data() + 4, sizeof version);
  if (!Imf::isImfMagic(start.data())) return not_ours(path, "not an OpenEXR file");
  if ((version & 0xffu) != 2 || (version & Imf::NON_IMAGE_FLAG) == 0 ||
      (version & (Imf::TILED_FLAG | Imf::MULTI_PART_FILE_FLAG)) != 0) {
    return not_ours(path, "not a deep scanline file of one part");
  }
  const auto skip_name = [&] {
    char c = 0;
    std::size_t length = 0;
    for (stream.read(&c, 1); c != 0; stream.read(&c, 1)) {
      if (++length > 255) throw std::runtime_error("a name in the header is too long");
    }
    return length;
  };
  while (skip_name() > 0) {
    skip_name();
    std::uint32_t bytes = 0;
    stream.read(reinterpret_cast<char*>(&bytes), 4);
    if (bytes > kLongestAttribute || bytes > stream.size() - stream.tellg()) {
      return fail(ErrorCode::kInput, "{}: an attribute of {} bytes at position {}", path, bytes,
                  stream.tellg());
    }
    stream.seekg(stream.tellg() + bytes);
  }
  return {};
}

struct Layout {
  bool samples = false;
  std::uint64_t sample_bytes = 0;  // for all channels in the file
};

Result<Layout> check_channels(const Imf::Header& header, const std::string& path, bool samples) {
  Layout layout{samples, 0};
  for (auto i = header.channels().begin(); i != header.channels().end(); ++i) {
    if (i.channel().xSampling != 1 || i.channel().ySampling != 1) {
      return not_ours(path, "a channel is subsampled");
    }
    layout.sample_bytes += i.channel().type == Imf::HALF ? 2 : 4;
  }
  for (const Channel& channel : channels_of(layout.samples)) {
    const Imf::Channel* found = header.channels().findChannel(channel.name);
    const bool exact = std::string(channel.name).starts_with("strata.");
    if (exact && (!found || found->type != channel.type)) {
      return not_ours(path, "no UINT channel " + std::string(channel.name));
    }
  }
  return layout;
}

// Checks that the file is large enough for the image, and that the image fits the limits.
Result<void> check_size(const LayeredDepthImage& image, const std::string& path,
                        std::uint64_t file_bytes, std::uint64_t memory_limit) {
  // Every row has a chunk. Its table of counts is compressed at most by zlib's limit.
  const std::uint64_t width = static_cast<std::uint64_t>(image.width);
  const std::uint64_t height = static_cast<std::uint64_t>(image.height);
  if (height * (8 + kChunkHeader + 4 * width / kLargestRatio) > file_bytes) {
    return fail(ErrorCode::kInput, "{}: {} bytes cannot hold {} x {} pixels", path, file_bytes,
                image.width, image.height);
  }
  const std::uint64_t need = width * height * (sizeof(std::uint64_t) + sizeof(std::uint32_t));
  if (memory_limit != 0 && need > memory_limit) {
    return fail(ErrorCode::kLimit, "{}: {} x {} pixels need {} bytes, the memory limit is {}", path,
                image.width, image.height, need, memory_limit);
  }
  return {};
}

// Fills in the image except its lists.
Result<Layout> check_header(const Imf::Header& header, const std::string& path,
                            std::uint64_t file_bytes, std::uint64_t memory_limit,
                            LayeredDepthImage& image) {
  const auto* version = header.findTypedAttribute<Imf::IntAttribute>("strata.version");
  const auto* mode = header.findTypedAttribute<Imf::StringAttribute>("strata.mode");
  const auto* limit = header.findTypedAttribute<Imf::IntAttribute>("strata.depth_limit");
  const auto* matrix = header.findTypedAttribute<Imf::M44dAttribute>("strata.world_from_image");
  if (!version || !mode || !limit || !matrix) {
    return not_ours(path, "no strata.version, mode, depth_limit or world_from_image");
  }
  if (version->value() != 1) return not_ours(path, "its strata.version is not 1");
  if (mode->value() != kIntervals && mode->value() != kSamples) {
    return not_ours(path, "its strata.mode is neither intervals nor samples");
  }
  if (limit->value() < 1 || limit->value() > 1 << 24) {
    return not_ours(path, "its strata.depth_limit is not in [1, 16777216]");
  }
  if (!header.hasType() || header.type() != Imf::DEEPSCANLINE ||
      header.lineOrder() != Imf::INCREASING_Y) {
    return not_ours(path, "not deep scanlines in increasing order");
  }
  if (header.compression() != Imf::ZIPS_COMPRESSION) {
    return not_ours(path, "its compression is not ZIPS");
  }
  const Imath::Box2i window = header.dataWindow();
  if (window.min.x != 0 || window.min.y != 0 || window.max.x < 0 || window.max.y < 0 ||
      window.max.x >= kMaxGridSide || window.max.y >= kMaxGridSide) {
    return not_ours(path, "its data window does not start at (0, 0) or is too large");
  }
  const auto layout = check_channels(header, path, mode->value() == kSamples);
  if (!layout) return layout;
  image.width = window.max.x + 1;
  image.height = window.max.y + 1;
  image.depth_limit = static_cast<std::uint32_t>(limit->value());
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) image.world_from_image[i][j] = matrix->value()[i][j];
  }
  if (auto fits = check_size(image, path, file_bytes, memory_limit); !fits) {
    return tl::unexpected(fits.error());
  }
  return layout;
}

class RowReader {
 public:
  RowReader(Imf::DeepScanLineInputFile& file, const Layout& layout, int width,
            std::uint64_t file_bytes)
      : file_(file),
        layout_(layout),
        file_bytes_(file_bytes),
        counts_(static_cast<std::size_t>(width)) {
    Imf::DeepFrameBuffer frame;
    frame.insertSampleCountSlice(
        Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts_.data()), sizeof counts_[0], 0));
    for (const Channel& channel : channels_of(layout.samples)) {
      if (!std::string(channel.name).starts_with("strata.")) continue;
      channels_.push_back(channel);
      pointers_.emplace_back(counts_.size());
    }
    for (std::size_t c = 0; c < channels_.size(); ++c) {
      frame.insert(channels_[c].name,
                   Imf::DeepSlice(channels_[c].type, reinterpret_cast<char*>(pointers_[c].data()),
                                  sizeof(char*), 0, sizeof(Sample)));
    }
    file_.setFrameBuffer(frame);  // all rows are read into the same arrays
  }

  // Appends the crossings of row v and the ends of its lists. Throws. `budget` is the most samples
  // it may hold.
  void read(int v, std::uint64_t budget, std::vector<DepthItem>& items,
            std::vector<std::uint64_t>& offsets) {
    const std::uint64_t samples = read_chunk(v);
    if (samples > budget) throw std::length_error("");
    samples_.assign(samples, Sample{});
    for (std::size_t c = 0; c < channels_.size(); ++c) {
      char* at = reinterpret_cast<char*>(samples_.data()) + channels_[c].offset;
      for (std::size_t i = 0; i < counts_.size(); ++i) {
        pointers_[c][i] = at;
        at += counts_[i] * sizeof(Sample);
      }
    }
    if (samples > 0) file_.readPixels(v, v);
    auto sample = samples_.begin();
    for (const std::uint32_t count : counts_) {
      for (std::uint32_t i = 0; i < count; ++i, ++sample) {
        items.push_back(item(sample->depth, sample->payload));
        if (sample->depth_back != kNone) {
          items.push_back(item(sample->depth_back, sample->payload_back));
        }
      }
      offsets.push_back(items.size());
    }
  }

 private:
  [[nodiscard]] static DepthItem item(std::uint32_t depth, std::uint32_t payload) {
    return DepthItem(std::uint64_t{depth} << 32 | payload);
  }

  // Reads the counts of row v and checks the lengths in its chunk against each other, since OpenEXR
  // does not. It avoids OpenEXR's functions that decode a raw chunk: they leak when the chunk is
  // damaged. @return number of samples in the row
  std::uint64_t read_chunk(int v) {
    std::uint64_t bytes = 0;
    file_.rawPixelData(v, nullptr, bytes);
    if (bytes < kChunkHeader || bytes > file_bytes_)
      throw std::runtime_error("its length is wrong");
    chunk_.resize(bytes);
    file_.rawPixelData(v, chunk_.data(), bytes);
    std::uint64_t table = 0, packed = 0, unpacked = 0;
    std::memcpy(&table, chunk_.data() + 4, 8);
    std::memcpy(&packed, chunk_.data() + 12, 8);
    std::memcpy(&unpacked, chunk_.data() + 20, 8);
    if (table > file_bytes_ || packed > file_bytes_ || bytes != chunk_.size() ||
        kChunkHeader + table + packed != bytes || table > 4 * counts_.size() || packed > unpacked ||
        unpacked / kLargestRatio > packed) {
      throw std::runtime_error("its lengths contradict each other");
    }
    std::fill(counts_.begin(), counts_.end(), 0u);
    file_.readPixelSampleCounts(v, v);
    std::uint64_t samples = 0;
    for (const std::uint32_t count : counts_) samples += count;
    if (samples * layout_.sample_bytes != unpacked) {
      throw std::runtime_error("its counts of samples contradict its length");
    }
    return samples;
  }

  Imf::DeepScanLineInputFile& file_;
  Layout layout_;
  std::uint64_t file_bytes_;
  std::vector<std::uint32_t> counts_;
  std::vector<Channel> channels_;
  std::vector<std::vector<char*>> pointers_;
  std::vector<char> chunk_;
  std::vector<Sample> samples_;
};

Result<LayeredDepthImage> read_file(const std::string& path, const Execution& execution) {
  InputStream stream(path);
  if (!stream.opened()) return fail(ErrorCode::kInput, "{}: cannot be opened", path);
  if (const Result<void> lengths = check_header_lengths(stream, path); !lengths) {
    return tl::unexpected(lengths.error());
  }
  LayeredDepthImage image;
  Imf::Header header;
  int version = 0;
  stream.seekg(4);
  stream.read(reinterpret_cast<char*>(&version), 4);
  header.readFrom(stream, version);
  header.sanityCheck();
  const Result<Layout> layout =
      check_header(header, path, stream.size(), execution.memory_limit, image);
  if (!layout) return tl::unexpected(layout.error());

  stream.seekg(0);
  Imf::DeepScanLineInputFile file(stream, 0);
  if (!file.isComplete()) return fail(ErrorCode::kInput, "{}: the file ends early", path);
  RowReader reader(file, *layout, image.width, stream.size());
  image.offsets.reserve(
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) + 1);
  image.offsets.push_back(0);
  for (int v = 0; v < image.height; ++v) {
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "{}: cancelled", path);
    // A growing vector briefly holds up to three times its content.
    const std::uint64_t held = image.items.size() * sizeof(DepthItem) * 3;
    const std::uint64_t budget =
        execution.memory_limit == 0
            ? std::numeric_limits<std::uint64_t>::max()
            : (execution.memory_limit - std::min(execution.memory_limit, held)) / sizeof(Sample);
    try {
      reader.read(v, budget, image.items, image.offsets);
    } catch (const std::length_error&) {
      return fail(ErrorCode::kLimit, "{}: row {} of {} passes the memory limit of {} bytes", path,
                  v, image.height, execution.memory_limit);
    } catch (const std::exception& error) {
      return fail(ErrorCode::kInput, "{}: row {}: {}", path, v, error.what());
    }
    if (execution.progress) execution.progress((v + 1.0) / image.height);
  }
  if (const Result<void> valid = check_layered_depth_image(image); !valid) {
    return fail(ErrorCode::kInput, "{}: {}", path, valid.error().message);
  }
  return image;
}

}  // namespace

Result<void> write_ldi_exr(const std::string& path, const LayeredDepthImage& image,
                           const LdiExrOptions& options, const Execution& execution) {
  if (const Result<void> valid = check_layered_depth_image(image); !valid) return valid;
  Result<SeekableOutput> output = SeekableOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  try {
    const Result<void> rows = write_rows(*output, path, image, options.samples, execution);
    if (!rows) return rows;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory", path);
  } catch (const std::exception& error) {
    // The output's own error is clearer than OpenEXR's.
    if (!output->status()) return output->status();
    return fail(ErrorCode::kOutput, "{}: {}", path, error.what());
  }
  return output->finish();
}

Result<LayeredDepthImage> read_ldi_exr(const std::string& path, const Execution& execution) {
  try {
    return read_file(path, execution);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory", path);
  } catch (const std::exception& error) {
    return fail(ErrorCode::kInput, "{}: {}", path, error.what());
  }
}

}  // namespace strata
