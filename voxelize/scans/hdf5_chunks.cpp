// The filters are those of the HDF5 File Format Specification 3.0: deflate, shuffle and fletcher32.

#include "voxelize/scans/hdf5_chunks.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>
#include <utility>

#include "voxelize/volume/inflate_stream.h"

namespace strata {
namespace {

constexpr std::size_t kFletcherBytes = 4;

/// As the filter of this name defines it: sums of 16-bit words, the first byte counting more.
std::uint32_t fletcher32(const std::vector<std::byte>& bytes, std::size_t size) {
  std::uint32_t first = 0, second = 0;
  const auto fold = [](std::uint32_t sum) { return (sum & 0xffff) + (sum >> 16); };
  for (std::size_t i = 0; i < size; i += 2) {
    const std::uint32_t low = i + 1 < size ? std::to_integer<std::uint32_t>(bytes[i + 1]) : 0;
    first = fold(first + (std::to_integer<std::uint32_t>(bytes[i]) << 8 | low));
    second = fold(second + first);
  }
  return fold(second) << 16 | fold(first);
}

/// Bytes of one place of all numbers stood together; they return to their numbers.
void unshuffle(std::vector<std::byte>& bytes, std::size_t element) {
  const std::size_t count = bytes.size() / element;
  std::vector<std::byte> apart = bytes;  // what is no whole number stays at the end
  for (std::size_t place = 0; place < element; ++place) {
    for (std::size_t i = 0; i < count; ++i) bytes[i * element + place] = apart[place * count + i];
  }
}

/// The next index of a box, the last axis first. @return false behind the end
bool advance(std::vector<hsize_t>& index, const std::vector<hsize_t>& first,
             const std::vector<hsize_t>& last, std::size_t axes) {
  for (std::size_t axis = axes; axis-- > 0;) {
    if (++index[axis] <= last[axis]) return true;
    index[axis] = first[axis];
  }
  return false;
}

}  // namespace

tl::unexpected<Error> Hdf5Chunks::damaged(std::string_view what) const {
  std::string place;
  for (const hsize_t begin : at_) place += fmt::format("{}{}", place.empty() ? "" : ", ", begin);
  return fail(ErrorCode::kInput, "{}: the chunk at ({}) is damaged: {}", path_, place, what);
}

Result<Hdf5Chunks> Hdf5Chunks::open(ReadContext& context, hid_t dataset, hid_t memory_type,
                                    const std::vector<hsize_t>& shape) {
  Hdf5Chunks chunks;
  chunks.path_ = context.path;
  chunks.dataset_ = dataset;
  chunks.memory_type_ = memory_type;
  chunks.shape_ = chunks.sides_ = shape;
  chunks.file_type_ = Hdf5Handle(H5Dget_type(dataset), H5Tclose);
  const Hdf5Handle properties(H5Dget_create_plist(dataset), H5Pclose);
  const int rank = static_cast<int>(shape.size());
  if (!properties || !chunks.file_type_ ||
      H5Pget_chunk(*properties, rank, chunks.sides_.data()) != rank ||
      std::ranges::find(chunks.sides_, hsize_t{0}) != chunks.sides_.end()) {
    return fail(ErrorCode::kInput, "{}: its chunks have not the axes of its voxels", context.path);
  }
  chunks.convert_ = H5Tequal(*chunks.file_type_, memory_type) <= 0;
  chunks.file_number_ = H5Tget_size(*chunks.file_type_);
  chunks.number_ = H5Tget_size(memory_type);
  const std::size_t widest = std::max(chunks.file_number_, chunks.number_);
  // A chunk is there packed, unpacked and while its bytes change places.
  double bytes = 3.0 * static_cast<double>(widest);
  for (const hsize_t side : chunks.sides_) bytes *= static_cast<double>(side);
  if (bytes > static_cast<double>(context.budget.limit()) ||
      !context.budget.take(static_cast<std::uint64_t>(bytes))) {
    return context.too_large("a chunk");
  }
  chunks.bytes_ = chunks.file_number_;
  for (const hsize_t side : chunks.sides_) chunks.bytes_ *= side;
  unsigned options = 0;
  H5Pget_chunk_opts(*properties, &options);
  chunks.edges_are_plain_ = (options & H5D_CHUNK_DONT_FILTER_PARTIAL_CHUNKS) != 0;
  chunks.fill_.assign(chunks.number_, std::byte{0});
  if (H5Pget_fill_value(*properties, memory_type, chunks.fill_.data()) < 0) {
    chunks.fill_.assign(chunks.number_, std::byte{0});  // it is said to be undefined
  }
  if (auto known = chunks.set_filters(*properties); !known) return tl::unexpected(known.error());
  // H5Dread_chunk reads as many bytes as the index of chunks says, which of chunks without filters
  // nothing else tells.
  const Hdf5Handle space(H5Dget_space(dataset), H5Sclose);
  hsize_t there = 0;
  if (chunks.filters_.empty()) {
    if (H5Dget_num_chunks(dataset, *space, &there) < 0 ||
        H5Dget_storage_size(dataset) != there * chunks.bytes_) {
      return fail(ErrorCode::kInput, "{}: its chunks have not the size that they should",
                  context.path);
    }
    // One chunk may be too large and another too small by as much. Pages that are not written cost
    // nothing.
    chunks.plain_ = std::make_unique_for_overwrite<std::byte[]>(
        std::max<std::size_t>(there * chunks.bytes_, chunks.bytes_));
  }
  return chunks;
}

Result<void> Hdf5Chunks::set_filters(hid_t properties) {
  const int count = H5Pget_nfilters(properties);
  bool packed = false;  // the size is not known from there on
  for (int i = 0; i < count; ++i) {
    unsigned flags = 0, config = 0;
    std::array<unsigned, 1> values{};
    std::size_t value_count = values.size();
    std::array<char, 1> name{};
    const H5Z_filter_t id =
        H5Pget_filter2(properties, static_cast<unsigned>(i), &flags, &value_count, values.data(),
                       name.size(), name.data(), &config);
    const bool known =
        id == H5Z_FILTER_DEFLATE || id == H5Z_FILTER_SHUFFLE || id == H5Z_FILTER_FLETCHER32;
    if (!known || (packed && id == H5Z_FILTER_DEFLATE) || count > 8) {
      return fail(ErrorCode::kInput,
                  "{}: its voxels are packed by filter {}; deflate, shuffle and fletcher32 are "
                  "read (h5repack -f GZIP=1 makes such a file)",
                  path_, static_cast<int>(id));
    }
    packed = packed || id == H5Z_FILTER_DEFLATE;
    filters_.push_back({id, value_count > 0 ? values[0] : 0});
  }
  return {};
}

/// Undoes the filters of packed_. @param left_out  filters that this chunk did not pass, as bits
Result<void> Hdf5Chunks::unpack(std::uint32_t left_out) {
  for (std::size_t i = filters_.size(); i-- > 0;) {
    const Filter& filter = filters_[i];
    if ((left_out >> i & 1) != 0) continue;
    if (filter.id == H5Z_FILTER_FLETCHER32) {
      if (packed_.size() < kFletcherBytes) return damaged("it has no checksum");
      const std::size_t size = packed_.size() - kFletcherBytes;
      std::uint32_t sum = 0;
      std::memcpy(&sum, packed_.data() + size, sizeof sum);
      if (sum != fletcher32(packed_, size)) return damaged("its checksum is wrong");
      packed_.resize(size);
    } else if (filter.id == H5Z_FILTER_SHUFFLE) {
      if (filter.element > 1 && filter.element <= packed_.size()) {
        unshuffle(packed_, filter.element);
      }
    } else {
      std::size_t size = bytes_;
      for (std::size_t before = 0; before < i; ++before) {
        const bool passed = (left_out >> before & 1) == 0;
        if (passed && filters_[before].id == H5Z_FILTER_FLETCHER32) size += kFletcherBytes;
      }
      chunk_.resize(size);
      InflateStream stream(
          std::string_view(reinterpret_cast<const char*>(packed_.data()), packed_.size()),
          InflateStream::kZlib, path_);
      if (auto read = stream.read(chunk_.data(), size); !read) return read;
      std::swap(chunk_, packed_);
    }
  }
  return packed_.size() == bytes_ ? Result<void>() : damaged("it has not the size of a chunk");
}

/// Makes the numbers of a chunk be in packed_; an empty one means that there is no chunk.
Result<void> Hdf5Chunks::load(const Hdf5Session& session, const std::vector<hsize_t>& begin) {
  at_ = begin;
  packed_.clear();
  // Not H5Dget_chunk_info_by_coord, which looks at all chunks, and may find another than
  // H5Dread_chunk does where the order of the chunks is damaged.
  hsize_t size = 0;
  if (H5Dget_chunk_storage_size(dataset_, begin.data(), &size) < 0) {
    const std::string reason = session.reason();
    if (reason.find("not allocated") != std::string::npos) return {};
    return damaged("it is not found: " + reason);
  }
  if (size == 0) return {};
  // What deflate cannot pack grows by a thousandth.
  if (size > bytes_ + bytes_ / 64 + 1024) return damaged("it is larger than a chunk");
  packed_.resize(size);
  std::uint32_t left_out = 0;
  std::byte* const to = plain_ ? plain_.get() : packed_.data();
  // A chunk without filters that is too small leaves the mark at its end, whatever it is.
  constexpr std::byte kMarks[] = {std::byte{0x5a}, std::byte{0xa5}};
  for (const std::byte mark : kMarks) {
    if (plain_) to[bytes_ - 1] = mark;
    if (H5Dread_chunk(dataset_, H5P_DEFAULT, begin.data(), &left_out, to) < 0) {
      return damaged("it cannot be read");
    }
    if (!plain_ || to[bytes_ - 1] != mark) break;
    if (mark == kMarks[1]) return damaged("it is smaller than a chunk");
  }
  if (plain_) std::memcpy(packed_.data(), to, std::min<std::size_t>(size, bytes_));
  for (std::size_t axis = 0; edges_are_plain_ && axis < shape_.size(); ++axis) {
    if (begin[axis] + sides_[axis] > shape_[axis]) left_out = ~std::uint32_t{0};
  }
  if (auto unpacked = unpack(left_out); !unpacked) return unpacked;
  if (!convert_) return {};
  const std::size_t count = bytes_ / file_number_;
  packed_.resize(count * std::max(file_number_, number_));
  if (H5Tconvert(*file_type_, memory_type_, count, packed_.data(), nullptr, H5P_DEFAULT) < 0) {
    return damaged("its numbers cannot be converted");
  }
  return {};
}

Result<void> Hdf5Chunks::read(const Hdf5Session& session, const std::vector<hsize_t>& begin,
                              const std::vector<hsize_t>& count, std::byte* to) {
  const std::size_t axes = shape_.size(), fastest = axes - 1;
  std::vector<hsize_t> first(axes), last(axes);  // chunks
  for (std::size_t axis = 0; axis < axes; ++axis) {
    first[axis] = begin[axis] / sides_[axis];
    last[axis] = (begin[axis] + count[axis] - 1) / sides_[axis];
  }
  std::vector<hsize_t> chunk = first, corner(axes), low(axes), high(axes), at(axes);
  do {
    for (std::size_t axis = 0; axis < axes; ++axis) {
      corner[axis] = chunk[axis] * sides_[axis];
      low[axis] = std::max(corner[axis], begin[axis]);
      high[axis] = std::min(corner[axis] + sides_[axis], begin[axis] + count[axis]) - 1;
    }
    if (auto loaded = load(session, corner); !loaded) return loaded;
    at = low;
    const std::size_t run = high[fastest] - low[fastest] + 1;
    do {
      std::size_t source = 0, target = 0;
      for (std::size_t axis = 0; axis < axes; ++axis) {
        source = source * sides_[axis] + (at[axis] - corner[axis]);
        target = target * count[axis] + (at[axis] - begin[axis]);
      }
      std::byte* const out = to + target * number_;
      if (!packed_.empty()) {
        std::copy_n(packed_.data() + source * number_, run * number_, out);
      } else {
        for (std::size_t i = 0; i < run * number_; ++i) out[i] = fill_[i % number_];
      }
    } while (advance(at, low, high, fastest));
  } while (advance(chunk, first, last, axes));
  return {};
}

}  // namespace strata
