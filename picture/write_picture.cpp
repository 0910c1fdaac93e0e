#include "picture/encode_png.h"

#include <isa-l/crc.h>
#include <isa-l/igzip_lib.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstring>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string_view>

#include "core/atomic_file.h"
#include "core/png_chunks.h"
#include "strata/picture/pixels.h"

namespace strata {
namespace {

/// The colours of a picture of at most 256, as flat faces have. An index is that of its first call.
class Palette {
 public:
  /// The index of a colour, or nothing when there are too many.
  std::optional<std::uint8_t> index(std::uint32_t colour) {
    for (std::size_t at = (colour * 0x9e3779b1u) >> 22;; at = (at + 1) % kSlots) {
      if (slots_[at] == 0) {
        if (colours_.size() == 256) return std::nullopt;
        colours_.push_back(colour);
        slots_[at] = static_cast<std::uint16_t>(colours_.size());
      }
      const std::size_t found = slots_[at] - 1u;
      if (colours_[found] == colour) return static_cast<std::uint8_t>(found);
    }
  }
  [[nodiscard]] std::span<const std::uint32_t> colours() const { return colours_; }

 private:
  static constexpr std::size_t kSlots = 1024;
  std::array<std::uint16_t, kSlots> slots_{};  ///< index + 1
  std::vector<std::uint32_t> colours_;
};

/// How PNG stores the pixels of a picture: in the smallest of its forms that holds them.
struct PngForm {
  /// PNG's numbers: 2 red, green, blue; 3 palette; 6 with alpha.
  std::uint8_t colour_type = 6;
  std::uint8_t bits = 8;      ///< a channel
  std::size_t row_bytes = 0;  ///< without the byte that says how the row is filtered
  Palette palette;            ///< of colour type 3
};

/// The end of the run of pixels of one colour that starts at `begin`. @pre begin != end
const Rgba* end_of_run(const Rgba* begin, const Rgba* end) {
  constexpr std::ptrdiff_t kAtOnce = 16;
  const Rgba colour = *begin;
  const auto differs = [&](const Rgba& pixel) {
    return std::bit_cast<std::uint32_t>(pixel) ^ std::bit_cast<std::uint32_t>(colour);
  };
  for (; end - begin >= kAtOnce; begin += kAtOnce) {
    std::uint32_t other = 0;
    for (std::ptrdiff_t i = 0; i < kAtOnce; ++i) other |= differs(begin[i]);
    if (other != 0) break;
  }
  return std::find_if(begin, end, differs);
}

bool all_opaque(const Rgba* begin, const Rgba* end) {
  constexpr std::ptrdiff_t kAtOnce = 16;
  std::uint32_t all = ~0u;
  for (; end - begin >= kAtOnce; begin += kAtOnce) {
    for (std::ptrdiff_t i = 0; i < kAtOnce; ++i) all &= std::bit_cast<std::uint32_t>(begin[i]);
  }
  for (; begin != end; ++begin) all &= std::bit_cast<std::uint32_t>(*begin);
  return std::bit_cast<Rgba>(all).a == 255;
}

/// What the bytes of a row differ by from those above, modulo 256.
void subtract(const std::uint8_t* row, const std::uint8_t* above, std::size_t bytes,
              std::uint8_t* to) {
  using Block = std::array<std::uint8_t, 32>;
  std::size_t i = 0;
  for (; bytes - i >= std::tuple_size_v<Block>; i += std::tuple_size_v<Block>) {
    Block a, b;
    std::memcpy(a.data(), row + i, sizeof a);
    std::memcpy(b.data(), above + i, sizeof b);
    for (std::size_t k = 0; k < a.size(); ++k) a[k] = static_cast<std::uint8_t>(a[k] - b[k]);
    std::memcpy(to + i, a.data(), sizeof a);
  }
  for (; i < bytes; ++i) to[i] = static_cast<std::uint8_t>(row[i] - above[i]);
}

/// Calls use(index, count) for the runs of one colour from `begin` to `end`.
/// @return false when there are too many colours
template <class Use>
bool for_each_run(Palette& palette, const Rgba* begin, const Rgba* end, Use&& use) {
  while (begin != end) {
    const auto index = palette.index(std::bit_cast<std::uint32_t>(*begin));
    if (!index) return false;
    const Rgba* const next = end_of_run(begin, end);
    use(*index, static_cast<std::size_t>(next - begin));
    begin = next;
  }
  return true;
}

/// Rows of a picture that are compressed apart from others.
class Bands {
 public:
  Bands(const Picture& picture, std::size_t row_bytes)
      : height_(static_cast<std::size_t>(picture.height)),
        rows_(std::max<std::size_t>(1, kBytes / std::max<std::size_t>(row_bytes, 1))) {}
  [[nodiscard]] std::size_t count() const { return (height_ + rows_ - 1) / rows_; }
  [[nodiscard]] std::size_t begin(std::size_t band) const { return band * rows_; }
  [[nodiscard]] std::size_t end(std::size_t band) const {
    return std::min(height_, (band + 1) * rows_);
  }

 private:
  /// What a band holds about. Copies do not reach from one to another.
  static constexpr std::size_t kBytes = std::size_t{1} << 18;
  std::size_t height_, rows_;
};

/// Finds the form. Palettes of bands are joined in their order, so that a palette is in the order
/// of the picture.
PngForm form_of(const Picture& picture, const Execution& execution) {
  const auto columns = static_cast<std::size_t>(picture.width);
  const Bands bands(picture, columns * sizeof(Rgba));
  std::vector<Palette> palettes(bands.count());
  std::vector<std::uint8_t> opaque(bands.count(), 0);
  std::atomic<bool> too_many{false};
  parallel_for(execution, bands.count(), [&](std::size_t band, int) {
    const Rgba* const begin = picture.pixels.data() + bands.begin(band) * columns;
    const Rgba* const end = picture.pixels.data() + bands.end(band) * columns;
    opaque[band] = all_opaque(begin, end) ? 1 : 0;
    if (too_many.load(std::memory_order_relaxed)) return;
    if (!for_each_run(palettes[band], begin, end, [](std::uint8_t, std::size_t) {})) {
      too_many.store(true, std::memory_order_relaxed);
    }
  });
  PngForm form;
  bool fits = !too_many;
  for (std::size_t band = 0; fits && band < palettes.size(); ++band) {
    for (const std::uint32_t colour : palettes[band].colours()) {
      fits = fits && form.palette.index(colour).has_value();
    }
  }
  if (fits) {
    // Indices of few colours are put 2, 4 or 8 a byte: the fewer bytes, the less to compress.
    const std::size_t colours = form.palette.colours().size();
    form.colour_type = 3;
    form.bits = colours <= 2 ? 1 : colours <= 4 ? 2 : colours <= 16 ? 4 : 8;
    form.row_bytes = (columns * form.bits + 7) / 8;
  } else {
    const bool needs_alpha = std::count(opaque.begin(), opaque.end(), 0) > 0;
    form.colour_type = needs_alpha ? 6 : 2;
    form.row_bytes = columns * (needs_alpha ? 4 : 3);
  }
  return form;
}

/// A row of pixels as PNG's indices, `bits` each.
void put_indices(Palette& palette, unsigned bits, std::span<const Rgba> pixels, std::uint8_t* to) {
  unsigned byte = 0, filled = 0;
  const auto add = [&](std::uint8_t index) {
    byte = byte << bits | index;
    filled += bits;
    if (filled < 8) return;
    *to++ = static_cast<std::uint8_t>(byte);
    filled = 0;
  };
  for_each_run(palette, pixels.data(), pixels.data() + pixels.size(),
               [&](std::uint8_t index, std::size_t count) {
                 for (; count > 0 && filled > 0; --count) add(index);
                 const std::size_t bytes = count * bits / 8;
                 // The index in each of a byte's places.
                 to = std::fill_n(to, bytes,
                                  static_cast<std::uint8_t>(index * (255u / ((1u << bits) - 1))));
                 for (count -= bytes * 8 / bits; count > 0; --count) add(index);
               });
  if (filled > 0) *to = static_cast<std::uint8_t>(byte << (8 - filled));
}

/// Makes bands of compressed rows. A thread has one of its own.
class BandEncoder {
 public:
  BandEncoder(const Picture& picture, const PngForm& form)
      : picture_(&picture), form_(&form), palette_(form.palette) {}

  struct Band {
    std::vector<std::uint8_t> deflated;  ///< whole bytes of DEFLATE (RFC 1951), which others follow
    std::uint32_t adler = 1;             ///< Adler-32 (RFC 1950) of what was compressed
    std::size_t size = 0;                ///< bytes of that
  };
  /// Throws std::bad_alloc. @param last  nothing follows
  Band encode(std::size_t begin, std::size_t end, bool last) {
    filter(begin, end);
    Band band{{}, isal_adler32(1, rows_.data(), rows_.size()), rows_.size()};
    make_codes(end - begin);
    isal_zstream& stream = state_->stream;
    stream = {};  // nothing of other bands may show in what is written
    isal_deflate_stateless_init(&stream);
    stream.hufftables = &state_->codes;
    stream.end_of_stream = last ? 1 : 0;
    stream.flush = last ? NO_FLUSH : FULL_FLUSH;
    room_.resize(rows_.size() + rows_.size() / 8 + 4096);  // for what cannot be compressed
    stream.next_in = rows_.data();
    stream.avail_in = static_cast<std::uint32_t>(rows_.size());
    stream.next_out = room_.data();
    stream.avail_out = static_cast<std::uint32_t>(room_.size());
    if (isal_deflate_stateless(&stream) != COMP_OK) throw std::bad_alloc();
    band.deflated.assign(room_.data(), room_.data() + stream.total_out);
    return band;
  }

 private:
  /// Each row but the first of the picture is stored as what it differs by from the one above:
  /// faces and backdrops are zeros then, and light that changes across a face nearly so.
  void filter(std::size_t begin, std::size_t end) {
    constexpr std::uint8_t kNone = 0, kUp = 2;
    const std::size_t bytes = form_->row_bytes;
    rows_.resize((end - begin) * (bytes + 1));
    // A pixel that is stored by its first three bytes overwrites one more.
    above_.resize(bytes + 1);
    row_.resize(bytes + 1);
    if (begin > 0) put_row(begin - 1, above_.data());
    std::uint8_t* to = rows_.data();
    for (std::size_t v = begin; v < end; ++v, to += bytes) {
      put_row(v, row_.data());
      *to++ = v > 0 ? kUp : kNone;
      if (v > 0) {
        subtract(row_.data(), above_.data(), bytes, to);
      } else {
        std::copy_n(row_.data(), bytes, to);
      }
      std::swap(row_, above_);
    }
  }
  /// Huffman codes for what some rows all over the band hold.
  void make_codes(std::size_t count) {
    constexpr std::size_t kOneOf = 8;
    const std::size_t row = form_->row_bytes + 1;
    state_->seen = {};
    for (std::size_t v = std::min(count - 1, kOneOf / 2); v < count; v += kOneOf) {
      isal_update_histogram(rows_.data() + v * row, static_cast<int>(row), &state_->seen);
    }
    isal_create_hufftables(&state_->codes, &state_->seen);
  }
  void put_row(std::size_t v, std::uint8_t* to) {
    const auto columns = static_cast<std::size_t>(picture_->width);
    const std::span pixels(picture_->pixels.data() + v * columns, columns);
    if (form_->colour_type == 3) return put_indices(palette_, form_->bits, pixels, to);
    const std::size_t channels = form_->colour_type == 2 ? 3 : 4;
    for (std::size_t i = 0; i < columns; ++i) {
      std::memcpy(to + i * channels, &pixels[i], sizeof(Rgba));
    }
  }

  struct State {
    isal_zstream stream;
    isal_hufftables codes;
    isal_huff_histogram seen;
  };
  const Picture* picture_;
  const PngForm* form_;
  Palette palette_;
  std::vector<std::uint8_t> rows_, row_, above_, room_;
  std::unique_ptr<State> state_ = std::make_unique<State>();
};

/// A zlib stream (RFC 1950) of all rows.
std::vector<std::uint8_t> compressed(const Picture& picture, const PngForm& form,
                                     const Execution& execution) {
  const Bands bands(picture, form.row_bytes);
  std::vector<BandEncoder::Band> made(bands.count());
  std::vector<std::optional<BandEncoder>> encoders(
      static_cast<std::size_t>(execution.thread_count()));
  parallel_for(execution, made.size(), [&](std::size_t band, int worker) {
    auto& encoder = encoders[static_cast<std::size_t>(worker)];
    if (!encoder) encoder.emplace(picture, form);
    made[band] = encoder->encode(bands.begin(band), bands.end(band), band + 1 == made.size());
  });
  std::vector<std::uint8_t> stream{0x78, 0x01};
  std::uint32_t adler = 1;
  for (const BandEncoder::Band& band : made) {
    stream.insert(stream.end(), band.deflated.begin(), band.deflated.end());
    adler = static_cast<std::uint32_t>(
        adler32_combine(adler, band.adler, static_cast<z_off_t>(band.size)));
  }
  for (const int shift : {24, 16, 8, 0}) {
    stream.push_back(static_cast<std::uint8_t>(adler >> shift & 0xff));
  }
  return stream;
}

}  // namespace

std::vector<std::uint8_t> encode_png(const Picture& picture, int threads) {
  const Execution execution{threads};
  const PngForm form = form_of(picture, execution);
  std::vector<std::uint8_t> bytes;
  PngChunks png(bytes, [](const void* data, std::size_t count) {
    return crc32_gzip_refl(0, static_cast<const unsigned char*>(data), count);
  });
  const auto add_chunk = [&](std::string_view type, std::span<const std::uint8_t> data) {
    png.begin(type);
    bytes.insert(bytes.end(), data.begin(), data.end());
    png.end();
  };
  png.header(picture.width, picture.height, form.bits, form.colour_type);
  if (form.colour_type == 3) {
    std::vector<std::uint8_t> colours, alpha;
    for (const std::uint32_t colour : form.palette.colours()) {
      const auto rgba = std::bit_cast<Rgba>(colour);
      colours.insert(colours.end(), {rgba.r, rgba.g, rgba.b});
      alpha.push_back(rgba.a);
    }
    add_chunk("PLTE", colours);
    if (std::count(alpha.begin(), alpha.end(), 255) != std::ssize(alpha)) add_chunk("tRNS", alpha);
  }
  // A chunk's length has 31 bits.
  constexpr std::size_t kMostBytes = 0x7fffffff;
  const std::vector<std::uint8_t> data = compressed(picture, form, execution);
  for (std::size_t at = 0; at < data.size(); at += kMostBytes) {
    add_chunk("IDAT", std::span(data).subspan(at, std::min(kMostBytes, data.size() - at)));
  }
  add_chunk("IEND", {});
  return bytes;
}

Result<void> write_png(const Picture& picture, const std::string& path,
                       const Execution& execution) {
  constexpr int kWidest = 1 << 28;  // what ISA-L counts in 32 bits
  if (picture.width > kWidest) {
    return fail(ErrorCode::kLimit, "{}: a picture must be 1 to {} pixels wide, got {}", path,
                kWidest, picture.width);
  }
  try {
    const std::vector<std::uint8_t> bytes = encode_png(picture, execution.threads);
    return write_file(path, bytes.data(), bytes.size());
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory for a picture of {} x {} pixels", path,
                picture.width, picture.height);
  }
}

}  // namespace strata
