// A TIFF stack (TIFF 6.0; BigTIFF where the file is 4 GB or more): a page a layer of z, rows by
// increasing y, so that tifffile, ImageJ and Fiji see an array [z, y, x]. Voxels that are solid or
// not are bytes of 0 and 255. Strips are zlib streams (compression 8, "Adobe deflate") made from
// runs. The first page has ImageJ's description: spacing, unit and, in voxels, the origin; the
// lines after these say the grid exactly, for readers of ours. On a pipe, where nothing can be
// filled in later, the directories come first and strips are not packed.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "voxelize/output/block_output.h"
#include "voxelize/output/dense_rows.h"
#include "voxelize/output/grid_text.h"
#include "voxelize/output/run_deflate.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

constexpr std::uint64_t kHeadBytes = 16;  // of BigTIFF; TIFF leaves half of it unused
constexpr std::uint64_t kSmall = std::uint64_t{1} << 32;

/// A directory of a page, in either format.
class TiffPage {
 public:
  enum Type : std::uint16_t { kText = 2, kShort = 3, kLong = 4, kFraction = 5, kLong8 = 16 };

  explicit TiffPage(bool big) : big_(big) {}

  void put(std::uint16_t tag, Type type, const std::vector<std::uint64_t>& numbers) {
    std::string bytes;
    for (const std::uint64_t number : numbers) {
      bytes.append(reinterpret_cast<const char*>(&number), type == kShort  ? 2
                                                           : type == kLong ? 4
                                                                           : 8);
    }
    entries_.push_back({tag, type, numbers.size(), std::move(bytes)});
  }
  void put_text(std::uint16_t tag, std::string text) {
    text += '\0';
    const std::uint64_t count = text.size();
    entries_.push_back({tag, kText, count, std::move(text)});
  }
  /// Numbers that may be offsets or sizes of a file of any length.
  void put_places(std::uint16_t tag, const std::vector<std::uint64_t>& numbers) {
    put(tag, big_ ? kLong8 : kLong, numbers);
  }

  /// The bytes of the directory and its values, which are to stand at `at`; the next one follows
  /// them at once unless this is the last.
  [[nodiscard]] std::string text(std::uint64_t at, bool last) const {
    const std::uint64_t field = big_ ? 8 : 4;
    const std::uint64_t size = (big_ ? 8 : 2) + entries_.size() * (big_ ? 20 : 12) + field;
    std::string head, values;
    number(head, entries_.size(), big_ ? 8 : 2);
    for (const Entry& entry : entries_) {
      number(head, entry.tag, 2);
      number(head, entry.type, 2);
      number(head, entry.count, field);
      if (entry.bytes.size() <= field) {
        head += entry.bytes + std::string(field - entry.bytes.size(), '\0');
      } else {
        number(head, at + size + values.size(), field);
        values += entry.bytes;
        values.resize((values.size() + 7) / 8 * 8);
      }
    }
    const std::uint64_t bytes = (size + values.size() + 15) / 16 * 16;
    number(head, last ? 0 : at + bytes, field);
    head += values;
    head.resize(bytes);
    return head;
  }

 private:
  struct Entry {
    std::uint16_t tag;
    Type type;
    std::uint64_t count;
    std::string bytes;
  };
  static void number(std::string& to, std::uint64_t value, std::size_t bytes) {
    to.append(reinterpret_cast<const char*>(&value), bytes);
  }

  bool big_;
  std::vector<Entry> entries_;  // by tag, as the format wants them
};

class TiffWriter final : public SlabWriter {
 public:
  TiffWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
             BlockOutput output)
      : SlabWriter(path, grid, Axis::kX),
        values_(options),
        frame_(options.frame),
        output_(std::move(output)),
        packed_(!output_.sequential()) {
    constexpr std::uint64_t kLargestStrip = std::uint64_t{1} << 26;
    row_bytes_ = static_cast<std::uint64_t>(grid.dims.x) * values_.bytes;
    rows_ = static_cast<int>(
        std::min<std::uint64_t>(std::max<std::uint64_t>(1, kLargestStrip / row_bytes_),
                                static_cast<std::uint64_t>(grid.dims.y)));
    strips_ = (grid.dims.y + rows_ - 1) / rows_;
    if (values_.kind == DenseValues::Kind::kFlags) values_.codes = RunBytes::kIds;
  }

  Result<void> begin() {
    const auto count = static_cast<std::size_t>(strips_) * static_cast<std::size_t>(dims().z);
    if (packed_) {
      sizes_.reserve(count);
      return output_.append(std::string(kHeadBytes, '\0'));
    }
    for (std::size_t i = 0; i < count; ++i) sizes_.push_back(strip_bytes(i));
    // How long the directories are does not depend on where the voxels are.
    const std::uint64_t length = directories(true, kHeadBytes, 0).size();
    const bool big = kHeadBytes + length + total() >= kSmall;
    const std::uint64_t begin =
        kHeadBytes + (big ? length : directories(false, kHeadBytes, 0).size());
    return output_.append(head(big, kHeadBytes) + directories(big, kHeadBytes, begin));
  }

 private:
  [[nodiscard]] std::uint64_t strip_bytes(std::size_t strip) const {
    const int first = static_cast<int>(strip % static_cast<std::size_t>(strips_)) * rows_;
    return row_bytes_ * static_cast<std::uint64_t>(std::min(rows_, dims().y - first));
  }
  [[nodiscard]] std::uint64_t total() const {
    std::uint64_t bytes = 0;
    for (const std::uint64_t size : sizes_) bytes += size;
    return bytes;
  }

  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    const auto strips = static_cast<std::size_t>(strips_);
    const std::size_t count = static_cast<std::size_t>(slab.v_end() - slab.v_begin()) * strips;
    const std::size_t before = static_cast<std::size_t>(slab.v_begin()) * strips;
    if (packed_) sizes_.resize(before + count);
    return output_.append_blocks(execution, count, [&](std::size_t index, Bytes& out, int) {
      const int z = slab.v_begin() + static_cast<int>(index / strips);
      const int first = static_cast<int>(index % strips) * rows_;
      const int last = std::min(first + rows_, dims().y);
      if (packed_) {
        out.clear();
        RunDeflater deflater(values_.codes, values_.bytes);
        append_zlib_stream(deflater, out, [&](RunDeflater& to) {
          emit_pixels(slab, z, first, last, [&](std::uint32_t value, int length) {
            to.run(value, static_cast<std::uint64_t>(length));
          });
        });
        sizes_[before + index] = out.size();
        return;
      }
      out.resize(static_cast<std::size_t>(last - first) * row_bytes_);
      std::byte* to = out.data();
      emit_pixels(slab, z, first, last, [&](std::uint32_t value, int length) {
        for (int i = 0; i < length; ++i, to += values_.bytes) {
          std::memcpy(to, &value, values_.bytes);
        }
      });
    });
  }

  /// Flags are 0 and 255.
  template <class Run>
  void emit_pixels(const VoxelIntervals& slab, int z, int first, int last, Run&& run) const {
    const bool flags = values_.kind == DenseValues::Kind::kFlags;
    emit_rows(slab, values_, z, first, last, [&](std::uint32_t value, int length) {
      run(flags && value != 0 ? std::uint32_t{255} : value, length);
    });
  }

  Result<void> finish_output(const Execution&) override {
    if (packed_) {
      const std::uint64_t at = (output_.position() + 15) / 16 * 16;
      const bool big = at + directories(true, at, kHeadBytes).size() >= kSmall;
      const std::string tail =
          std::string(at - output_.position(), '\0') + directories(big, at, kHeadBytes);
      if (Result<void> written = output_.append(tail); !written) return written;
      const std::string begin = head(big, at);
      auto patched = output_.patch(0, begin.data(), begin.size());
      if (!patched) return patched;
    }
    return output_.commit();
  }

  [[nodiscard]] static std::string head(bool big, std::uint64_t directory) {
    std::string text = big ? std::string("II\x2b\0\x08\0\0\0", 8) : std::string("II\x2a\0", 4);
    text.append(reinterpret_cast<const char*>(&directory), big ? 8 : 4);
    text.resize(kHeadBytes);
    return text;
  }

  /// All directories, of which the first is to stand at `at`.
  /// @param strip  where the first strip stands
  [[nodiscard]] std::string directories(bool big, std::uint64_t at, std::uint64_t strip) const {
    std::string all;
    for (int z = 0; z < dims().z; ++z) {
      std::vector<std::uint64_t> places, sizes;
      for (int s = 0; s < strips_; ++s) {
        const std::uint64_t size =
            sizes_[static_cast<std::size_t>(z) * static_cast<std::size_t>(strips_) +
                   static_cast<std::size_t>(s)];
        places.push_back(strip);
        sizes.push_back(size);
        strip += size;
      }
      all += page(big, z, places, sizes).text(at + all.size(), z + 1 == dims().z);
    }
    return all;
  }

  [[nodiscard]] TiffPage page(bool big, int z, const std::vector<std::uint64_t>& places,
                              const std::vector<std::uint64_t>& sizes) const {
    const auto size = [](int side) {
      return std::vector<std::uint64_t>{static_cast<std::uint64_t>(side)};
    };
    const std::vector<std::uint64_t> bits(values_.components, values_.number_bits());
    const std::vector<std::uint64_t> kind(values_.components, values_.is_float() ? 3 : 1);
    const bool colours = values_.components == 4;
    TiffPage page(big);
    page.put(256, TiffPage::kLong, size(dims().x));
    page.put(257, TiffPage::kLong, size(dims().y));
    page.put(258, TiffPage::kShort, bits);
    page.put(259, TiffPage::kShort, {packed_ ? 8u : 1u});
    page.put(262, TiffPage::kShort, {colours ? 2u : 1u});  // RGB; black is 0
    if (z == 0) page.put_text(270, description());
    page.put_places(273, places);
    page.put(277, TiffPage::kShort, {values_.components});
    page.put(278, TiffPage::kLong, size(rows_));
    page.put_places(279, sizes);
    page.put(282, TiffPage::kFraction, {pixels_a_unit(grid().voxel_size.x)});
    page.put(283, TiffPage::kFraction, {pixels_a_unit(grid().voxel_size.y)});
    page.put(284, TiffPage::kShort, {1});               // numbers of a voxel are together
    page.put(296, TiffPage::kShort, {1});               // the unit is that of the description
    if (colours) page.put(338, TiffPage::kShort, {2});  // alpha, not multiplied in
    page.put(339, TiffPage::kShort, kind);
    return page;
  }

  /// [numerator:32 | denominator:32], lowest first.
  [[nodiscard]] static std::uint64_t pixels_a_unit(double voxel) {
    constexpr double kMost = 4294967295.0;
    double over = 1.0, under = voxel;  // kept as large as both can be
    const double scale = kMost / std::max(over, under);
    over = std::max(1.0, std::round(over * scale)),
    under = std::max(1.0, std::round(under * scale));
    return static_cast<std::uint64_t>(over) | static_cast<std::uint64_t>(under) << 32;
  }

  [[nodiscard]] std::string description() const {
    const VoxelGrid& g = grid();
    const glm::dvec3 size = g.voxel_size, first = g.origin + 0.5 * size;
    const std::string_view unit = unit_name(frame_.unit_metres);
    std::string text = fmt::format(
        "ImageJ=1.53t\nimages={0}\nslices={0}\nspacing={1}\n{2}loop=false\nxorigin={3}\n"
        "yorigin={4}\nzorigin={5}\n",
        g.dims.z, size.z, unit.empty() ? "" : fmt::format("unit={}\n", unit), -first.x / size.x,
        -first.y / size.y, -first.z / size.z);
    text += fmt::format("strata_origin={} {} {}\nstrata_voxel_size={} {} {}\n", g.origin.x,
                        g.origin.y, g.origin.z, size.x, size.y, size.z);
    if (frame_.turned()) {
      const glm::dmat3& d = frame_.direction;
      text += fmt::format("strata_direction={} {} {} {} {} {} {} {} {}\n", d[0][0], d[0][1],
                          d[0][2], d[1][0], d[1][1], d[1][2], d[2][0], d[2][1], d[2][2]);
    }
    if (!frame_.space.empty()) text += fmt::format("strata_space={}\n", one_line(frame_.space));
    return text;
  }

  DenseValues values_;
  GridFrame frame_;
  BlockOutput output_;
  bool packed_;
  std::uint64_t row_bytes_ = 0;
  int rows_ = 0, strips_ = 0;         // rows of a strip, strips of a page
  std::vector<std::uint64_t> sizes_;  // of strips
};

}  // namespace

VoxelWriterResult open_tiff_writer(const std::string& path, const VoxelGrid& grid,
                                   const VoxelWriterOptions& options) {
  Result<BlockOutput> output = BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  return begun(std::make_unique<TiffWriter>(path, grid, options, std::move(*output)));
}

}  // namespace strata
