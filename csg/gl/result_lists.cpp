#include "csg/gl/result_lists.h"

#include <algorithm>
#include <array>
#include <glm/common.hpp>
#include <limits>
#include <new>
#include <span>
#include <utility>
#include <vector>

#include "csg/gl/result_lists_for_tests.h"
#include "csg/gl/walk_programs.h"
#include "csg/tree_filter.h"
#include "strata/hashbuffer/build_ldi.h"

namespace strata::glsl {
extern const gl::GlslPiece csg_gl_result_comp;
}  // namespace strata::glsl

namespace strata::csg {
namespace {

// Of result.comp.glsl.
constexpr std::uint32_t kParity = 0x80000000u, kHandedOver = 0x80000000u;
constexpr std::uint32_t kGroupSide = 8;
constexpr std::uint64_t kHeaderBytes = 16;
enum Binding : unsigned { kTriangles = 0, kPlaces = 4, kItems = 5 };

struct Place {
  std::uint32_t first, counts;
  [[nodiscard]] bool handed_over() const { return (counts & kHandedOver) != 0; }
  [[nodiscard]] std::uint32_t crossings() const { return counts >> 16 & 0x7fffu; }
  [[nodiscard]] std::uint32_t items() const { return counts & 0xffffu; }
};

/// What a dispatch said.
enum class Walked { kAll, kTooMuch, kTooLong };

/// The box of a solid's vertices, lattice steps.
struct Box {
  glm::ivec3 low{std::numeric_limits<int>::max()}, high{std::numeric_limits<int>::min()};
};

}  // namespace

struct GlResultSource::Impl {
  Impl(const gl::Info& info, const Execution& wanted)
      : execution(wanted),
        binding_bytes(info.limits.storage_block_bytes),
        longest(info.works_around("loop-rounds") ? 10000 : 32767),
        walks(glsl::csg_gl_result_comp, info, "15000u") {}

  void make_programs(const RasterTarget& target, int v_begin, int v_end);
  Result<Walked> walk(const gl::Store& store, const gl::Program& program, int band,
                      gl::PixelRows rows);
  Result<void> take(std::uint32_t width, gl::PixelRows rows, LayeredDepthImage& image);
  void filter_handed_over(const std::vector<std::uint32_t>& pixels);

  Execution execution;
  std::uint64_t binding_bytes;
  std::uint32_t longest;  ///< crossings of a list that a thread may walk
  const LatticeMesh* mesh = nullptr;
  const TreeFilter* filter = nullptr;                 ///< null: the lists are the mesh's
  std::vector<Box> boxes;                             ///< of each solid
  std::vector<std::vector<std::uint32_t>> solids_of;  ///< of each tile
  TilePrograms programs;
  std::uint32_t first_row = 0;  ///< of the first tile, where the screen begins
  std::uint32_t tiles_u = 0;
  WalkPrograms walks;
  WalkTables tables;
  gl::Buffer triangles, places_buffer, items_buffer;
  std::vector<Place> places;
  std::vector<DepthItem> items;
  /// Lists of pixels that were handed over, filtered: 4096 of them in each batch.
  struct Batch {
    std::vector<std::uint32_t> offsets;
    std::vector<DepthItem> items;
  };
  std::vector<Batch> batches;
  std::uint64_t crossings = 0;  ///< of what was taken since it was set to 0
  Counts counts;
};

GlResultSource::GlResultSource(std::unique_ptr<Impl> impl)
    : ComputeListSource(impl->execution), impl_(std::move(impl)) {}
GlResultSource::~GlResultSource() = default;
const GlResultSource::Counts& GlResultSource::counts() const { return impl_->counts; }

Result<std::unique_ptr<GlResultSource>> GlResultSource::create(const gl::Context& context,
                                                               std::unique_ptr<gl::Store> store,
                                                               std::unique_ptr<gl::Store> spare,
                                                               std::int64_t pixels_at_once,
                                                               const Execution& execution) {
  Execution threads = execution;
  threads.progress = {};
  std::unique_ptr<GlResultSource> result(
      new GlResultSource(std::make_unique<Impl>(context.info(), threads)));
  auto opened = result->open(context, std::move(store), std::move(spare), pixels_at_once);
  if (!opened) return tl::unexpected(opened.error());
  return result;
}

void ResultListsForTests::limit_binding(GlResultSource& source, std::uint64_t bytes) {
  source.impl_->binding_bytes = std::min(source.impl_->binding_bytes, bytes);
}

Result<void> GlResultSource::set_mesh(const LatticeMesh& mesh) {
  impl_->mesh = &mesh;
  impl_->filter = nullptr;
  return ComputeListSource::set_mesh(mesh);
}

bool GlResultSource::use_filter(const TileListFilter& filter) {
  Impl& impl = *impl_;
  impl.filter = nullptr;
  const auto* tree = dynamic_cast<const TreeFilter*>(&filter);
  if (tree == nullptr || tree->labelled() || impl.mesh == nullptr) return false;
  const TreeFilter::Tables tables = tree->tables();
  const auto triangles = impl.mesh->triangles;
  if (triangles.size() != tables.solid_of.size() ||
      triangles.size() * sizeof(std::uint32_t) > impl.binding_bytes) {
    return false;
  }
  std::vector<std::uint32_t> words;
  try {
    impl.boxes.assign(tables.rules.size(), {});
    words.resize(triangles.size());
  } catch (const std::bad_alloc&) {
    return false;
  }
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const std::uint32_t solid = tables.solid_of[t];
    words[t] = solid | (tables.rules[solid] == InsideRule::kParity ? kParity : 0u);
    Box& box = impl.boxes[solid];
    for (int corner = 0; corner < 3; ++corner) {
      const glm::ivec3& p = impl.mesh->vertices[triangles[t][corner]];
      box.low = glm::min(box.low, p);
      box.high = glm::max(box.high, p);
    }
  }
  if (!impl.triangles.assign(std::span<const std::uint32_t>(words))) return false;
  impl.filter = tree;
  impl.counts = {};
  return true;
}

/// The tree's part in each tile of rows [v_begin, v_end).
void GlResultSource::Impl::make_programs(const RasterTarget& target, int v_begin, int v_end) {
  const AxisFrame frame(target.axis);
  const int first_tile_v = v_begin / kTileSide;
  const int count_u = (target.width + kTileSide - 1) / kTileSide;
  const int count_v = (v_end + kTileSide - 1) / kTileSide - first_tile_v;
  first_row = static_cast<std::uint32_t>(v_begin % kTileSide);
  tiles_u = static_cast<std::uint32_t>(count_u);
  solids_of.resize(static_cast<std::size_t>(count_u) * static_cast<std::size_t>(count_v));
  for (auto& solids : solids_of) solids.clear();
  constexpr int kTileBits = kLatticeBits + 6;
  static_assert(kTileSide == 1 << 6);
  for (std::uint32_t solid = 0; solid < boxes.size(); ++solid) {
    const Box& box = boxes[solid];
    if (box.low.x > box.high.x) continue;
    const int u0 = std::max(box.low[frame.u] >> kTileBits, 0);
    const int u1 = std::min(box.high[frame.u] >> kTileBits, count_u - 1);
    const int v0 = std::max((box.low[frame.v] >> kTileBits) - first_tile_v, 0);
    const int v1 = std::min((box.high[frame.v] >> kTileBits) - first_tile_v, count_v - 1);
    for (int v = v0; v <= v1; ++v) {
      for (int u = u0; u <= u1; ++u) {
        solids_of[static_cast<std::size_t>(v * count_u + u)].push_back(solid);
      }
    }
  }
  programs.make(filter->tables().program, solids_of, binding_bytes);
}

Result<LayeredDepthImage> GlResultSource::read(gl::Store& store, const RasterTarget& target,
                                               int v_begin, int v_end) {
  Impl& impl = *impl_;
  if (impl.filter == nullptr) return ComputeListSource::read(store, target, v_begin, v_end);
  try {
    impl.make_programs(target, v_begin, v_end);
    if (auto done = impl.tables.upload(impl.programs); !done) return tl::unexpected(done.error());
    const auto program = impl.walks.get(store, impl.programs);
    if (!program) return tl::unexpected(program.error());
    LayeredDepthImage image;
    image.width = target.width;
    image.height = v_end - v_begin;
    image.offsets.push_back(0);
    impl.crossings = 0;
    Walked last = Walked::kAll;
    for (int band = 0; band < store.bands() && last == Walked::kAll; ++band) {
      gl::PixelRows rows = store.band_rows(band);
      const std::uint32_t end = rows.end;
      while (rows.begin < end) {
        const auto walked = impl.walk(store, **program, band, rows);
        if (!walked) return tl::unexpected(walked.error());
        last = *walked;
        const std::uint32_t height = rows.end - rows.begin;
        if (last == Walked::kTooLong || (last == Walked::kTooMuch && height == 1)) break;
        if (last == Walked::kTooMuch) {
          rows.end = rows.begin + height / 2;
          continue;
        }
        if (auto taken = impl.take(store.width(), rows, image); !taken) {
          return tl::unexpected(taken.error());
        }
        rows = {rows.end, std::min(rows.end + height, end)};
      }
    }
    crossings_ = impl.crossings;
    if (last == Walked::kAll) return image;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "no memory for the lists of {} x {} pixels", target.width,
                v_end - v_begin);
  }
  auto all = ComputeListSource::read(store, target, v_begin, v_end);
  return all ? filter_lists(*all, *impl.filter, impl.execution) : std::move(all);
}

/// Walks some rows of a band, until the items find room.
Result<Walked> GlResultSource::Impl::walk(const gl::Store& store, const gl::Program& program,
                                          int band, gl::PixelRows rows) {
  const std::uint32_t width = store.width();
  const std::uint64_t pixels = std::uint64_t{width} * (rows.end - rows.begin);
  if (pixels * sizeof(Place) > binding_bytes) return Walked::kTooMuch;
  if (auto room = places_buffer.reserve(pixels * sizeof(Place)); !room) {
    return tl::unexpected(room.error());
  }
  std::uint64_t wanted = std::max<std::uint64_t>(4096, pixels);
  for (;;) {
    const std::uint64_t most = (binding_bytes - kHeaderBytes) / sizeof(DepthItem);
    if (auto room = items_buffer.reserve(kHeaderBytes + std::min(wanted, most) * sizeof(DepthItem));
        !room) {
      return tl::unexpected(room.error());
    }
    const auto capacity = static_cast<std::uint32_t>(std::min<std::uint64_t>(
        (items_buffer.bytes() - kHeaderBytes) / sizeof(DepthItem), 0xffffffffu));
    items_buffer.clear(0, 0, kHeaderBytes);
    program.set("walk_width", width);
    program.set("walk_row_begin", rows.begin);
    program.set("walk_row_end", rows.end);
    program.set("walk_first_row", first_row);
    program.set("walk_tiles_u", tiles_u);
    program.set("walk_capacity", capacity);
    program.set("walk_longest", longest);
    store.bind_for_reading(band);
    tables.bind();
    triangles.bind(kTriangles);
    places_buffer.bind(kPlaces);
    items_buffer.bind(kItems);
    gl::storage_barrier();
    program.dispatch((width + kGroupSide - 1) / kGroupSide,
                     (rows.end - rows.begin + kGroupSide - 1) / kGroupSide);
    gl::storage_barrier();
    std::array<std::uint32_t, 2> said{};  // items, too long
    items_buffer.download(std::span<std::uint32_t>(said));
    if (auto done = gl::check_errors("walking lists of solids"); !done) {
      return tl::unexpected(done.error());
    }
    if (said[1] != 0) return Walked::kTooLong;
    if (said[0] > most) return Walked::kTooMuch;
    if (said[0] > capacity) {
      wanted = said[0] + std::uint64_t{said[0]} / 8;
      continue;
    }
    places.resize(pixels);
    places_buffer.download(std::span<Place>(places));
    items.resize(said[0]);
    items_buffer.download(std::span<DepthItem>(items), kHeaderBytes);
    if (auto done = gl::check_errors("reading lists of a tree"); !done) {
      return tl::unexpected(done.error());
    }
    return Walked::kAll;
  }
}

/// Filters the lists of `pixels`, which lie in `items` at their places, in batches that look like
/// tiles.
void GlResultSource::Impl::filter_handed_over(const std::vector<std::uint32_t>& pixels) {
  batches.resize((pixels.size() + kTilePixels - 1) / kTilePixels);
  std::vector<std::unique_ptr<TileListFilter::Worker>> workers(
      static_cast<std::size_t>(execution.thread_count()));
  parallel_for(execution, batches.size(), [&](std::size_t index, int worker_index) {
    auto& worker = workers[static_cast<std::size_t>(worker_index)];
    if (!worker) worker = filter->worker();
    const auto own = std::span(pixels).subspan(
        index * kTilePixels,
        std::min<std::size_t>(kTilePixels, pixels.size() - index * kTilePixels));
    std::vector<std::uint32_t> offsets(1, 0);
    std::vector<DepthItem> keys;
    for (const std::uint32_t pixel : own) {
      const auto first = items.begin() + static_cast<std::ptrdiff_t>(places[pixel].first);
      keys.insert(keys.end(), first, first + static_cast<std::ptrdiff_t>(places[pixel].items()));
      offsets.push_back(static_cast<std::uint32_t>(keys.size()));
    }
    offsets.resize(kTilePixels + 1, static_cast<std::uint32_t>(keys.size()));
    TileLists<DepthItem> lists;
    lists.row_end = kTileSide;
    lists.fragments = keys.size();
    lists.offsets = offsets.data();
    lists.keys = keys.data();
    const TileLists<DepthItem> result = worker->apply(lists);
    Batch& batch = batches[index];
    batch.offsets.assign(1, 0);
    batch.items.clear();
    for (std::size_t i = 0; i < own.size(); ++i) {
      for_each_item(result, i, [&](DepthItem item) { batch.items.push_back(item); });
      batch.offsets.push_back(static_cast<std::uint32_t>(batch.items.size()));
    }
  });
}

/// Appends the walked rows to the image.
Result<void> GlResultSource::Impl::take(std::uint32_t width, gl::PixelRows rows,
                                        LayeredDepthImage& image) {
  std::vector<std::uint32_t> pixels;  // that were handed over
  for (std::uint32_t i = 0; i < places.size(); ++i) {
    crossings += places[i].crossings();
    if (places[i].handed_over()) {
      pixels.push_back(i);
    } else if (places[i].crossings() > 0) {
      ++counts.walked;
    }
  }
  counts.handed_over += pixels.size();
  filter_handed_over(pixels);
  // Batches that were skipped hold nothing, or another band's lists.
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  const std::size_t first_pixel = image.offsets.size() - 1;
  std::size_t next = 0;
  for (const Place& place : places) {
    std::uint32_t length = place.items();
    if (place.handed_over()) {
      const Batch& batch = batches[next / kTilePixels];
      const std::size_t at = next++ % kTilePixels;
      length = batch.offsets[at + 1] - batch.offsets[at];
    }
    image.offsets.push_back(image.offsets.back() + length);
  }
  image.items.resize(image.offsets.back());
  parallel_for(execution, rows.end - rows.begin, [&](std::size_t row, int) {
    for (std::size_t i = row * width; i < (row + 1) * width; ++i) {
      if (places[i].handed_over()) continue;
      const auto from = items.begin() + static_cast<std::ptrdiff_t>(places[i].first);
      std::copy(from, from + static_cast<std::ptrdiff_t>(places[i].items()),
                image.items.begin() + static_cast<std::ptrdiff_t>(image.offsets[first_pixel + i]));
    }
  });
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const Batch& batch = batches[i / kTilePixels];
    const std::size_t at = i % kTilePixels;
    std::copy(
        batch.items.begin() + static_cast<std::ptrdiff_t>(batch.offsets[at]),
        batch.items.begin() + static_cast<std::ptrdiff_t>(batch.offsets[at + 1]),
        image.items.begin() + static_cast<std::ptrdiff_t>(image.offsets[first_pixel + pixels[i]]));
  }
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return {};
}

}  // namespace strata::csg
