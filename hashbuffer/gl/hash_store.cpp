#include "hashbuffer/gl/hash_store.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "hashbuffer/gl/store_glsl.h"
#include "strata/hashbuffer/record.h"
#include "strata/hashbuffer/resize_policy.h"
#include "strata/hashbuffer/table_law.h"

namespace strata::glsl {
extern const gl::GlslPiece hashbuffer_gl_clear_and_count_comp;
extern const gl::GlslPiece hashbuffer_gl_count_layers;
extern const gl::GlslPiece hashbuffer_gl_insert_32;
extern const gl::GlslPiece hashbuffer_gl_insert_64;
extern const gl::GlslPiece hashbuffer_gl_insert_payload;
extern const gl::GlslPiece hashbuffer_gl_read_hash;
}  // namespace strata::glsl

namespace strata::gl {
namespace {

constexpr unsigned kTable = 8, kOffsets = 9, kCounts = 10, kPayloads = 11, kParams = 8;
constexpr std::uint32_t kCellsOfGroup = 2048;
constexpr std::uint64_t kOffsetBytes = (Record32::kAgeMax + 1) * sizeof(std::uint32_t);

/// llvmpipe ends all loops of an invocation after 65535 rounds, without a word, and counts those of
/// the slowest of its neighbours in a vector.
std::uint32_t most_steps(const Info& info) {
  if (!info.works_around("loop-rounds")) return 1000000;
  const bool has_16_neighbours = info.renderer.find("512 bits") != std::string::npos;
  return has_16_neighbours ? 4000 : 8000;
}

}  // namespace

Result<std::unique_ptr<HashStore>> HashStore::create(const Info& info,
                                                     const HashStoreOptions& options) {
  if (options.record_bits != 32 && options.record_bits != 64) {
    return fail(ErrorCode::kUsage, "hash store: records must have 32 or 64 bits, got {}",
                options.record_bits);
  }
  if (options.record_bits == 64 && options.path == WordPath::kAtomic && !info.has_int64_atomics &&
      !options.serial) {
    return fail(ErrorCode::kUsage, "hash store: no 64-bit atomic maximum: {}",
                info.int64_atomics_reason);
  }
  WordPath path = WordPath::kAtomic;
  if (options.record_bits == 64 && (options.path == WordPath::kTwoPass ||
                                    (options.path == WordPath::kAuto && !info.has_int64_atomics))) {
    path = WordPath::kTwoPass;
  }
  return std::unique_ptr<HashStore>(new HashStore(info, options, path));
}

HashStore::HashStore(const Info& info, const HashStoreOptions& options, WordPath path)
    : Store(info.limits), most_steps_(most_steps(info)), options_(options), path_(path) {
  if (options.binding_bytes > 0) binding_bytes_ = std::min(binding_bytes_, options.binding_bytes);
  // Cell numbers and their sums are 32-bit in the shaders.
  binding_bytes_ = std::min<std::uint64_t>(binding_bytes_, (std::uint64_t{1} << 31) * word_bytes());
}

std::uint64_t HashStore::bytes_of(std::uint64_t cells) const {
  return cells * word_bytes() * (two_tables() ? 2 : 1) + kOffsetBytes + sizeof(StoreBlock);
}

std::uint64_t HashStore::allowed_cells() const {
  if (memory_limit_ == 0) return std::numeric_limits<std::uint64_t>::max();
  const std::uint64_t share = memory_limit_ / std::max<std::size_t>(bands_.size(), 1);
  const std::uint64_t fixed = bytes_of(0) + sizeof(Counts);
  return share < fixed ? 0 : (share - fixed) / (bytes_of(1) - bytes_of(0));
}

std::uint64_t HashStore::memory_bytes() const {
  std::uint64_t bytes = 0;
  for (const Band& band : bands_) bytes += bytes_of(band.cells) + sizeof(Counts);
  return bytes;
}

std::uint64_t HashStore::cells() const {
  std::uint64_t cells = 0;
  for (const Band& band : bands_) cells += band.cells;
  return cells;
}

std::uint32_t HashStore::payload_mask() const { return options_.record_bits == 64 ? ~0u : 0u; }

PixelRows HashStore::band_rows(int band) const {
  return bands_[static_cast<std::size_t>(band)].rows;
}

std::string HashStore::name_of_words() const {
  return std::string(options_.record_bits == 32 ? Record32::kName : Record64::kName);
}

// --- passes -----------------------------------------------------------------------------------

int HashStore::passes() const {
  const std::size_t each = mode_ == Mode::kInsert && two_tables() ? 2 : 1;
  return static_cast<int>(active_.size() * each);
}

HashStore::Kind HashStore::kind_of(int pass) const {
  if (mode_ == Mode::kCountLayers) return Kind::kLayers;
  return two_tables() && pass % 2 == 1 ? Kind::kPayloads : Kind::kWords;
}

std::size_t HashStore::band_of(int pass) const {
  const bool two = mode_ == Mode::kInsert && two_tables();
  return active_[static_cast<std::size_t>(two ? pass / 2 : pass)];
}

PixelRows HashStore::rows_of(int pass) const { return bands_[band_of(pass)].rows; }

StoreGlsl HashStore::glsl(int pass) const {
  switch (kind_of(pass)) {
    case Kind::kLayers:
      return store_glsl(glsl::hashbuffer_gl_count_layers, {});
    case Kind::kPayloads:
      return store_glsl(glsl::hashbuffer_gl_insert_payload, {});
    case Kind::kWords:
      break;
  }
  GlslSettings settings;
  settings.defines = {{"STORE_COHERENT", options_.read_first ? "coherent" : ""},
                      {"STORE_MOST_STEPS", std::to_string(most_steps_) + "u"}};
  if (options_.read_first) settings.defines.emplace_back("STORE_READ_FIRST", "1");
  if (word_bytes() == 8) {
    settings.extensions = {"GL_ARB_gpu_shader_int64"};
    if (options_.serial) {
      settings.defines.emplace_back("STORE_SERIAL", "1");
    } else {
      settings.extensions.emplace_back("GL_NV_shader_atomic_int64");
    }
    if (options_.cull_opacity > 0.0) {
      settings.defines.emplace_back("STORE_CULL", std::to_string(1.0 - options_.cull_opacity));
    }
    return store_glsl(glsl::hashbuffer_gl_insert_64, std::move(settings));
  }
  return store_glsl(glsl::hashbuffer_gl_insert_32, std::move(settings));
}

StoreGlsl HashStore::glsl_read() const {
  GlslSettings settings;
  settings.defines = {{"STORE_WORDS", options_.record_bits == 64 ? "2" : "1"}};
  if (two_tables()) settings.defines.emplace_back("STORE_PAYLOADS", "1");
  return store_glsl(glsl::hashbuffer_gl_read_hash, std::move(settings));
}

void HashStore::bind_for_reading(int band) const {
  const Band& of = bands_[static_cast<std::size_t>(band)];
  of.table.bind(kTable);
  of.offsets.bind(kOffsets);
  counts_.bind(kCounts);
  if (two_tables()) of.payloads.bind(kPayloads);
  of.params.bind_uniform(kParams);
}

Result<bool> HashStore::begin_pass(int pass) {
  storage_barrier();
  bind_for_reading(static_cast<int>(band_of(pass)));
  return true;
}

// --- frames -----------------------------------------------------------------------------------

Result<void> HashStore::begin(std::uint32_t width, std::uint32_t height) {
  if (width < 1 || height < 1 ||
      std::uint64_t{width} * height > std::numeric_limits<std::uint32_t>::max()) {
    return fail(ErrorCode::kUsage,
                "hash store: a screen must have 1 to 2^32 - 1 pixels, got {} x {}", width, height);
  }
  if (!clear_) {
    const GlslPiece piece = glsl::hashbuffer_gl_clear_and_count_comp;
    auto program = Program::compute(
        {&piece, 1}, {.extensions = {}, .defines = {{"WORDS", word_bytes() == 8 ? "2" : "1"}}});
    if (!program) return tl::unexpected(program.error());
    clear_ = std::move(*program);
  }
  mode_ = Mode::kInsert;
  const std::uint64_t wanted = std::max(options_.cells, 2 * std::exchange(expected_, 0));
  const bool too_small = wanted > options_.cells && wanted > cells();
  if (width != width_ || height != height_ || bands_.empty() || too_small) {
    width_ = width;
    height_ = height;
    const std::uint64_t bands =
        std::max<std::uint64_t>(1, (wanted + most_cells() - 1) / most_cells());
    if (auto done = lay_out(bands, wanted); !done) return done;
  }
  return begin_bands();
}

/// Cuts the screen into that many bands, whose tables have about `cells` cells together. They are
/// made by begin_bands().
Result<void> HashStore::lay_out(std::uint64_t bands, std::uint64_t cells) {
  // No band may have more pixels than a table has cells.
  while (bands < height_ && ((height_ + bands - 1) / bands) * width_ > most_cells()) ++bands;
  bands = std::min<std::uint64_t>(bands, height_);
  if (((height_ + bands - 1) / bands) * width_ > most_cells()) {
    return fail(ErrorCode::kLimit,
                "hash store: a row has {} pixels, but a table has at most {} cells", width_,
                most_cells());
  }
  bands_.clear();
  bands_.resize(bands);
  for (std::uint64_t i = 0; i < bands; ++i) {
    Band& band = bands_[i];
    band.rows = {static_cast<std::uint32_t>(height_ * i / bands),
                 static_cast<std::uint32_t>(height_ * (i + 1) / bands)};
    band.pixels = std::uint64_t{band.rows.end - band.rows.begin} * width_;
    band.cells = std::max(band.pixels,
                          bands == 1 ? cells : cells / height_ * (band.rows.end - band.rows.begin));
    band.cells = std::min(band.cells, most_cells());
  }
  return {};
}

/// Twice as many bands, if the screen has the rows; false if not.
Result<bool> HashStore::split(std::uint64_t cells) {
  if (bands_.size() >= height_) return false;
  if (auto done = lay_out(bands_.size() * 2, cells); !done) return tl::unexpected(done.error());
  if (auto begun = begin_bands(); !begun) return tl::unexpected(begun.error());
  return true;
}

/// Empties all tables, sized by what they held, for a new frame.
Result<void> HashStore::begin_bands() {
  if (auto room = counts_.reserve(bands_.size() * sizeof(Counts)); !room) return room;
  std::vector<Counts> held(bands_.size());
  if (options_.resize) {
    auto counted = clear_and_count();
    if (!counted) return tl::unexpected(counted.error());
    held = std::move(*counted);
  } else {
    for (Band& band : bands_) {
      if (band.table) band.table.clear();
    }
  }
  active_.clear();
  for (std::size_t i = 0; i < bands_.size(); ++i) {
    Band& band = bands_[i];
    active_.push_back(i);
    band.layers_counted = false;
    std::uint64_t target = std::max(band.cells, band.pixels);
    if (band.frame > 0 && options_.resize) {
      target = next_frame_cells(target, band.pixels, held[i].held);
    }
    const bool keeps_offsets = !options_.resize && band.frame > 0;
    ++band.frame;
    if (target > most_cells()) {
      const auto done = split(target * bands_.size());
      if (!done) return tl::unexpected(done.error());
      if (*done) return {};  // split() has begun all bands
      target = most_cells();
    }
    target = std::min(target, allowed_cells());
    if (target < band.pixels) {
      return fail(ErrorCode::kLimit,
                  "hash store: a screen of {} x {} pixels needs {} bytes, the limit is {}", width_,
                  height_, bytes_of(band.pixels) * bands_.size(), memory_limit_);
    }
    if (keeps_offsets && target == band.cells) continue;
    if (auto done = resize_band(band, target, options_.offsets); !done) return done;
  }
  for (Band& band : bands_) {
    if (band.payloads) band.payloads.clear();
  }
  counts_.clear();
  return {};
}

/// Gives the band an emptied table of that many cells. The table is empty already if it keeps its
/// size.
Result<void> HashStore::resize_band(Band& band, std::uint64_t cells, OffsetKind kind) {
  if (!band.table || band.table.bytes() != cells * word_bytes()) {
    band.table = Buffer();
    band.payloads = Buffer();
    band.cells = cells;
    auto table = Buffer::allocate(cells * word_bytes());
    if (!table) return tl::unexpected(table.error());
    band.table = std::move(*table);
    band.table.clear();
    if (two_tables()) {
      auto payloads = Buffer::allocate(cells * 4);
      if (!payloads) return tl::unexpected(payloads.error());
      band.payloads = std::move(*payloads);
    }
  }
  band.cells = cells;
  return draw_offsets(band, kind);
}

Result<void> HashStore::draw_offsets(Band& band, OffsetKind kind) {
  const unsigned ages =
      options_.age_limit == 0 ? Record32::kAgeMax : std::min(options_.age_limit, Record32::kAgeMax);
  // The same draw as a HashBuffer's.
  const std::uint64_t draw = kind == OffsetKind::kFarthestPoint ? 0 : band.frame;
  const auto offsets = make_offsets(kind, {.pixels = band.pixels,
                                           .cells = band.cells,
                                           .width = width_,
                                           .ages = ages,
                                           .seed = options_.seed ^ draw * 0x9e3779b97f4a7c15u});
  std::vector<std::uint32_t> words(kOffsetBytes / 4, 0);
  std::transform(offsets.begin(), offsets.end(), words.begin(),
                 [](std::uint64_t offset) { return static_cast<std::uint32_t>(offset); });
  band.age_limit = static_cast<unsigned>(offsets.size()) - 1;
  band.offset_kind = kind;
  auto uploaded = band.offsets.assign(std::span<const std::uint32_t>(words));
  if (!uploaded) return uploaded;
  const StoreBlock params{band.rows.begin * width_, static_cast<std::uint32_t>(band.pixels),
                          static_cast<std::uint32_t>(band.cells), band.age_limit,
                          static_cast<std::uint32_t>(&band - bands_.data())};
  return band.params.assign(std::span(&params, 1));
}

/// Empties the tables; counts[i].held is what band i held, the other counts are those of the frame.
Result<std::vector<HashStore::Counts>> HashStore::clear_and_count() {
  std::vector<Counts> counts(bands_.size());
  // The word `held` of band i, as a buffer of its own: bindings begin at multiples of 256.
  if (auto room = held_.reserve(256 * bands_.size()); !room) return tl::unexpected(room.error());
  held_.clear();
  bool any = false;
  for (std::size_t i = 0; i < bands_.size(); ++i) {
    Band& band = bands_[i];
    if (!band.table) continue;
    any = true;
    band.table.bind(0);
    held_.bind(1, 256 * i, 4);
    clear_.set("cells", static_cast<std::uint32_t>(band.cells));
    const Groups groups = groups_for(band.cells, kCellsOfGroup);
    storage_barrier();
    clear_.dispatch(groups.x, groups.y);
    storage_barrier();
  }
  if (!any) return counts;
  const auto words = held_.download_all<std::uint32_t>();
  if (auto checked = check_errors("hash store"); !checked) return tl::unexpected(checked.error());
  for (std::size_t i = 0; i < bands_.size(); ++i) counts[i].held = words[64 * i];
  return counts;
}

Result<bool> HashStore::end() {
  if (mode_ == Mode::kCountLayers) return look_at_layers();
  std::vector<Counts> counts(bands_.size());
  counts_.download(std::span(counts));
  if (auto checked = check_errors("hash store"); !checked) return tl::unexpected(checked.error());
  const bool complete = std::all_of(counts.begin(), counts.end(),
                                    [](const Counts& count) { return count.failures == 0; });
  if (!complete) return look_at_failures(counts);
  for (const Counts& count : counts) {
    if (count.strangers > 0) {
      return fail(ErrorCode::kInternal,
                  "hash store: {} fragments of the second pass were not in the first",
                  count.strangers);
    }
  }
  return true;
}

/// Fragments did not fit: notes how many, and has the layers of each pixel counted, or grows.
Result<bool> HashStore::look_at_failures(const std::vector<Counts>& counts) {
  active_.clear();
  // All tables are emptied only to count the ones that failed: so the whole frame is drawn again.
  auto held = clear_and_count();
  if (!held) return tl::unexpected(held.error());
  bool counted = true;
  for (std::size_t i = 0; i < bands_.size(); ++i) {
    Band& band = bands_[i];
    band.missing = counts[i].failures;
    band.stored = (*held)[i].held;
    if (band.missing > 0) {
      counted = counted && band.layers_counted;
      active_.push_back(i);
    }
  }
  counts_.clear();
  if (!counted) {
    mode_ = Mode::kCountLayers;
    return false;
  }
  return look_at_layers();
}

/// Reads the number of fragments of each pixel of a band. Refuses a pixel with more than ages.
Result<void> HashStore::read_layers(Band& band) {
  const unsigned ages =
      options_.age_limit == 0 ? Record32::kAgeMax : std::min(options_.age_limit, Record32::kAgeMax);
  std::vector<std::uint32_t> layers(band.pixels);
  band.table.download(std::span(layers));
  if (auto checked = check_errors("hash store"); !checked) return checked;
  const auto deepest = std::max_element(layers.begin(), layers.end());
  band.layers_counted = true;
  band.deepest = *deepest;
  band.table.clear();
  if (*deepest <= ages) return {};
  const auto pixel = static_cast<std::uint64_t>(deepest - layers.begin());
  return fail(ErrorCode::kLimit,
              "hash store: pixel ({}, {}) has {} fragments, but {} counts at most {}; use the "
              "count/scan store",
              pixel % width_, band.rows.begin + pixel / width_, *deepest, name_of_words(), ages);
}

/// Refuses a pixel with more fragments than ages; else gives every band that failed more room.
Result<bool> HashStore::look_at_layers() {
  const bool counted = mode_ == Mode::kCountLayers;
  for (const std::size_t i : active_) {
    Band& band = bands_[i];
    if (counted) {
      if (auto read = read_layers(band); !read) return tl::unexpected(read.error());
    }
    if (band.offset_kind == OffsetKind::kPlaneFirst && band.pixels * band.deepest <= band.cells) {
      // There was a cell for every fragment: a thread took too many steps. Where bands have fewer
      // rows than it inserts, it takes less.
      constexpr std::uint32_t kFewRows = 128;
      mode_ = Mode::kInsert;
      if (band.rows.end - band.rows.begin <= kFewRows) {
        const auto done = split(cells());
        if (!done) return tl::unexpected(done.error());
        if (*done) return false;
      }
      return fail(ErrorCode::kLimit,
                  "hash store: lists of {} fragments need more than the {} steps of a thread; use "
                  "the count/scan store",
                  band.deepest, most_steps_);
    }
    const std::uint64_t needed = band.stored + band.missing;
    const bool lacks_ages = is_too_empty(needed, band.cells);
    std::uint64_t target = rebuilt_cells(needed, band.cells);
    if (target > most_cells()) {
      mode_ = Mode::kInsert;
      const auto done = split(target * bands_.size());
      if (!done) return tl::unexpected(done.error());
      if (*done) return false;
      target = most_cells();
    }
    target = std::min(target, allowed_cells());
    if (target <= band.cells) {
      return fail(ErrorCode::kLimit,
                  "hash store: {} of {} fragments did not fit in {} cells, {} bytes; the limit is "
                  "{} bytes",
                  band.missing, needed, band.cells, bytes_of(band.cells),
                  memory_limit_ > 0 ? memory_limit_ : binding_bytes_);
    }
    if (auto done =
            resize_band(band, target, lacks_ages ? OffsetKind::kPlaneFirst : options_.offsets);
        !done) {
      return tl::unexpected(done.error());
    }
  }
  mode_ = Mode::kInsert;
  active_.clear();
  for (std::size_t i = 0; i < bands_.size(); ++i) {
    active_.push_back(i);
    if (bands_[i].payloads) bands_[i].payloads.clear();
  }
  return false;
}

// --- for tests --------------------------------------------------------------------------------

std::vector<std::uint64_t> HashStore::table(int band) const {
  const Band& of = bands_[static_cast<std::size_t>(band)];
  if (word_bytes() == 8) return of.table.download_all<std::uint64_t>();
  const auto keys = of.table.download_all<std::uint32_t>();
  std::vector<std::uint64_t> words(keys.begin(), keys.end());
  if (!two_tables()) return words;
  const auto payloads = of.payloads.download_all<std::uint32_t>();
  for (std::size_t i = 0; i < words.size(); ++i) words[i] = words[i] << 32 | payloads[i];
  return words;
}

std::uint64_t HashStore::checksum(int band) const { return detail::table_checksum(table(band)); }

}  // namespace strata::gl
