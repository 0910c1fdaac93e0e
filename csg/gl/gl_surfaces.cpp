#include "csg/gl/gl_surfaces.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "csg/gl/tile_programs.h"
#include "csg/gl/walk_programs.h"
#include "csg/surface/frame_input.h"
#include "csg/surface/tile_surface.h"
#include "hashbuffer/gl/build_sized.h"
#include "raster/gl/compute.h"
#include "strata/gl/buffer.h"
#include "strata/gl/shader_program.h"

namespace strata::glsl {
extern const gl::GlslPiece csg_gl_walk_comp;
}  // namespace strata::glsl

namespace strata::csg {
namespace {

constexpr std::uint32_t kDoubtful = 0xfffffffeu;  // of walk.comp.glsl
constexpr std::uint32_t kGroupSide = 8;
constexpr std::uint64_t kDoubtHeader = 16;  // bytes

enum Binding : unsigned { kTriangles = 0, kSurfaces = 4, kDoubts = 5 };

/// All solids that the walk looks at, as one mesh.
struct AllSolids {
  LatticeVertices vertices;
  std::vector<glm::uvec3> triangles;
  std::vector<std::uint32_t> first_of;  ///< first triangle of each part
  std::vector<glm::uvec2> facts;        ///< of each triangle: solid, and extra depth steps of a
                                        ///< than Coincidence::range() it may be off

  void gather(const FrameInput& frame, const std::vector<std::uint8_t>& used,
              const Execution& execution);
};

void AllSolids::gather(const FrameInput& frame, const std::vector<std::uint8_t>& used,
                       const Execution& execution) {
  vertices.clear();
  triangles.clear();
  first_of.assign(frame.view_parts.size(), 0);
  std::vector<std::uint32_t> first_vertex(frame.view_parts.size(), 0);
  std::size_t vertex_count = 0, triangle_count = 0;
  for (std::size_t solid = 0; solid < frame.view_parts.size(); ++solid) {
    first_of[solid] = static_cast<std::uint32_t>(triangle_count);
    first_vertex[solid] = static_cast<std::uint32_t>(vertex_count);
    if (used[solid] == 0) continue;
    vertex_count += frame.view_parts[solid].mesh.vertices.size();
    triangle_count += frame.view_parts[solid].mesh.triangles.size();
  }
  vertices.resize(vertex_count);
  triangles.resize(triangle_count);
  facts.resize(triangle_count);
  const AxisFrame axes(Axis::kZ);
  const double steep_from = frame.coincidence.steep_from();
  parallel_for(execution, frame.view_parts.size(), [&](std::size_t solid, int) {
    if (used[solid] == 0) return;
    const LatticeMesh& mesh = frame.view_parts[solid].mesh;
    std::copy(mesh.vertices.begin(), mesh.vertices.end(),
              vertices.begin() + static_cast<std::ptrdiff_t>(first_vertex[solid]));
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const glm::uvec3& triangle = mesh.triangles[t];
      triangles[first_of[solid] + t] = triangle + first_vertex[solid];
      const glm::ivec3 &a = mesh.vertices[triangle.x], &b = mesh.vertices[triangle.y],
                       &c = mesh.vertices[triangle.z];
      glm::uvec2& fact = facts[first_of[solid] + t];
      fact = {solid, 0};
      TriangleSetup setup;
      if (!setup_triangle(a, b, c, axes, setup) || !(setup.steepness() > steep_from)) continue;
      // No bound is more than the triangle is deep.
      constexpr auto kLimit = static_cast<std::int32_t>(kPictureDepthLimit);
      const auto [low, high] = std::minmax({a.z, b.z, c.z});
      fact.y =
          static_cast<std::uint32_t>(std::clamp(high, 0, kLimit) - std::clamp(low, 0, kLimit)) + 1;
    }
  });
}

/// Decides pixels from their lists by the CPU's rules. Scratch of one thread.
class PixelJudge {
 public:
  PixelJudge(const FrameInput& frame, const AllSolids& all)
      : frame_(&frame), all_(&all), finder_(frame.program) {}

  /// `list`: depths and payloads in turn.
  Surface judge(std::span<const std::uint32_t> list) {
    items_.clear();
    for (std::size_t i = 0; i + 1 < list.size(); i += 2) {
      const std::uint32_t triangle = list[i + 1] & 0x7fffffffu;
      const std::uint32_t solid = all_->facts[triangle].x;
      items_.push_back(
          {solid, DepthItem(list[i], list[i + 1] >> 31 != 0, triangle - all_->first_of[solid])});
    }
    std::stable_sort(items_.begin(), items_.end(),
                     [](const Item& a, const Item& b) { return a.solid < b.solid; });
    transitions_.clear();
    for (std::size_t i = 0; i < items_.size();) {
      const std::uint32_t solid = items_[i].solid;
      crossings_.clear();
      for (; i < items_.size() && items_[i].solid == solid; ++i) {
        crossings_.push_back(items_[i].item);
      }
      const Geometry::Part& part = frame_->parts[solid];
      // Tiles with solids that are cut are left to the CPU (TilePrograms).
      if (kind_of(frame_->program, solid, part, false) == LeafLayers::Kind::kFirstEntryOnly) {
        first_entry_of(crossings_, solid, transitions_);
      } else {
        transitions_of(crossings_, solid, part.rule, false, transitions_);
      }
    }
    return finder_.find(transitions_,
                        TransitionFaces(frame_->parts, frame_->view_parts, frame_->coincidence));
  }

 private:
  struct Item {
    std::uint32_t solid;
    DepthItem item;
  };
  const FrameInput* frame_;
  const AllSolids* all_;
  FirstHit finder_;
  std::vector<Item> items_;
  std::vector<DepthItem> crossings_;
  std::vector<Transition> transitions_;
};

}  // namespace

struct GlSurfaceSource::Impl {
  explicit Impl(const gl::Info& info) : walks(glsl::csg_gl_walk_comp, info, "6000u") {}

  std::unique_ptr<gl::Store> store;
  std::unique_ptr<gl::ComputeRasterizer> rasterizer;
  std::uint64_t binding_bytes = 0, pixels_at_once = 0;
  WalkPrograms walks;
  WalkTables tables;
  gl::Buffer triangles, surfaces, doubts;
  TilePrograms programs;
  AllSolids all;
  std::vector<glm::uvec2> found;
  std::vector<std::uint32_t> words;
  Counts counts;

  Result<void> upload();
  Result<bool> band(const FrameInput& frame, int v_begin, int v_end, SurfaceImage& image,
                    DrawReport& report, std::vector<std::uint32_t>& left,
                    const Execution& execution);
  Result<void> walk(const FrameInput& frame, const gl::Program& program, int v_begin);
  void take(const FrameInput& frame, int v_begin, int v_end, SurfaceImage& image,
            DrawReport& report, std::vector<std::uint32_t>& left, const Execution& execution);
};

GlSurfaceSource::GlSurfaceSource(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
GlSurfaceSource::~GlSurfaceSource() = default;
const GlSurfaceSource::Counts& GlSurfaceSource::counts() const { return impl_->counts; }

Result<std::unique_ptr<GlSurfaceSource>> GlSurfaceSource::create(const gl::Context& context,
                                                                 std::unique_ptr<gl::Store> store,
                                                                 std::uint64_t pixels_at_once) {
  auto impl = std::make_unique<Impl>(context.info());
  impl->store = std::move(store);
  impl->pixels_at_once = pixels_at_once;
  impl->binding_bytes = context.info().limits.storage_block_bytes;
  auto rasterizer = gl::ComputeRasterizer::create(context);
  if (!rasterizer) return tl::unexpected(rasterizer.error());
  impl->rasterizer = *std::move(rasterizer);
  return std::unique_ptr<GlSurfaceSource>(new GlSurfaceSource(std::move(impl)));
}

Result<void> GlSurfaceSource::Impl::upload() {
  auto done = triangles.assign(std::span<const glm::uvec2>(all.facts));
  return done ? tables.upload(programs) : done;
}

Result<void> GlSurfaceSource::find(const FrameInput& frame, SurfaceImage& image, DrawReport& report,
                                   std::vector<std::uint32_t>& left, const Execution& execution) {
  Impl& impl = *impl_;
  impl.counts = {};
  std::fill(image.depth.begin(), image.depth.end(), SurfaceImage::kNone);
  impl.programs.make(frame, impl.binding_bytes, left);
  impl.counts.left = left.size();
  if (!impl.programs.any) return {};
  impl.all.gather(frame, impl.programs.used, execution);
  // What was skipped is another frame's.
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  if (impl.all.facts.size() * sizeof(glm::uvec2) > impl.binding_bytes ||
      impl.all.facts.size() >= (std::size_t{1} << 31)) {
    impl.programs.leave_all(left);
    impl.counts.left = left.size();
    return {};
  }
  if (auto done = impl.upload(); !done) return done;
  LatticeMesh mesh{std::move(impl.all.vertices), impl.all.triangles};
  const auto set = impl.rasterizer->set_mesh(mesh);
  impl.all.vertices = std::move(mesh.vertices);  // room for the next frame
  if (!set) return set;
  const int step = static_cast<int>(
      std::max<std::uint64_t>(
          1, impl.pixels_at_once / static_cast<std::uint64_t>(frame.view.size.x) / kTileSide) *
      kTileSide);
  for (int v = 0; v < frame.view.size.y; v += step) {
    const int end = std::min(frame.view.size.y, v + step);
    const auto done = impl.band(frame, v, end, image, report, left, execution);
    if (!done) return tl::unexpected(done.error());
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    if (execution.progress) execution.progress(static_cast<double>(end) / frame.view.size.y);
  }
  impl.counts.left = left.size();
  return {};
}

Result<bool> GlSurfaceSource::Impl::band(const FrameInput& frame, int v_begin, int v_end,
                                         SurfaceImage& image, DrawReport& report,
                                         std::vector<std::uint32_t>& left,
                                         const Execution& execution) {
  const int first_tile = v_begin / kTileSide * frame.tiles_u;
  const int end_tile = (v_end + kTileSide - 1) / kTileSide * frame.tiles_u;
  if (std::none_of(programs.tiles.begin() + first_tile, programs.tiles.begin() + end_tile,
                   [](const WalkTile& tile) { return tile.slot_count > 0; })) {
    return false;
  }
  const RasterTarget target{Axis::kZ, frame.view.size.x, frame.view.size.y, kPictureDepthLimit};
  rasterizer->set_target(target, v_begin, v_end);
  const auto built = gl::build_sized(*store, *rasterizer, execution);
  if (!built) return tl::unexpected(built.error());
  report.fragments += built->fragments;
  const auto program = walks.get(*store, programs);
  if (!program) return tl::unexpected(program.error());
  const std::size_t pixels =
      static_cast<std::size_t>(frame.view.size.x) * static_cast<std::size_t>(v_end - v_begin);
  if (auto room = surfaces.reserve(pixels * sizeof(glm::uvec2)); !room) {
    return tl::unexpected(room.error());
  }
  // A guess: two doubtful pixels of a hundred with ten crossings each.
  std::uint64_t capacity = std::max<std::uint64_t>(4096, pixels / 2);
  for (;;) {
    if (auto room = doubts.reserve(kDoubtHeader + capacity * 4); !room) {
      return tl::unexpected(room.error());
    }
    capacity = (doubts.bytes() - kDoubtHeader) / 4;
    if (auto done = walk(frame, **program, v_begin); !done) return tl::unexpected(done.error());
    std::array<std::uint32_t, 1> used{};
    doubts.download(std::span<std::uint32_t>(used));
    if (auto done = gl::check_errors("walking lists of solids"); !done) {
      return tl::unexpected(done.error());
    }
    if (used[0] > capacity) {
      if (kDoubtHeader + std::uint64_t{used[0]} * 4 > binding_bytes) {
        for (int tile = first_tile; tile < end_tile; ++tile) {
          if (programs.tiles[static_cast<std::size_t>(tile)].slot_count > 0) {
            left.push_back(static_cast<std::uint32_t>(tile));
          }
        }
        return false;
      }
      capacity = used[0];
      continue;
    }
    words.resize(used[0]);
    doubts.download(std::span<std::uint32_t>(words), kDoubtHeader);
    break;
  }
  found.resize(pixels);
  surfaces.download(std::span<glm::uvec2>(found));
  if (auto done = gl::check_errors("walking lists of solids"); !done) {
    return tl::unexpected(done.error());
  }
  take(frame, v_begin, v_end, image, report, left, execution);
  return true;
}

Result<void> GlSurfaceSource::Impl::walk(const FrameInput& frame, const gl::Program& program,
                                         int v_begin) {
  doubts.clear(0, 0, kDoubtHeader);
  const Coincidence::Range range = frame.coincidence.range();
  program.use();
  program.set("walk_width", static_cast<std::uint32_t>(frame.view.size.x));
  program.set("walk_first_row", static_cast<std::uint32_t>(v_begin));
  program.set("walk_tiles_u", static_cast<std::uint32_t>(frame.tiles_u));
  program.set("walk_doubt_capacity",
              static_cast<std::uint32_t>((doubts.bytes() - kDoubtHeader) / 4));
  program.set("walk_range_intercept", range.intercept);
  program.set("walk_range_slope", range.slope);
  program.set("walk_range_constant", range.constant);
  program.set("walk_range_quadratic", range.quadratic);
  program.set("walk_depth_limit", static_cast<float>(kPictureDepthLimit));
  for (int band = 0; band < store->bands(); ++band) {
    const gl::PixelRows rows = store->band_rows(band);
    store->bind_for_reading(band);
    triangles.bind(kTriangles);
    tables.bind();
    surfaces.bind(kSurfaces);
    doubts.bind(kDoubts);
    program.set("walk_row_begin", rows.begin);
    program.set("walk_row_end", rows.end);
    program.dispatch((static_cast<std::uint32_t>(frame.view.size.x) + kGroupSide - 1) / kGroupSide,
                     (rows.end - rows.begin + kGroupSide - 1) / kGroupSide);
  }
  gl::storage_barrier();
  return gl::check_errors("walking lists of solids");
}

void GlSurfaceSource::Impl::take(const FrameInput& frame, int v_begin, int v_end,
                                 SurfaceImage& image, DrawReport& report,
                                 std::vector<std::uint32_t>& left, const Execution& execution) {
  const auto width = static_cast<std::size_t>(frame.view.size.x);
  const std::size_t first_pixel = static_cast<std::size_t>(v_begin) * width;
  constexpr int kRowsAtOnce = 16;
  parallel_for(execution,
               static_cast<std::size_t>((v_end - v_begin + kRowsAtOnce - 1) / kRowsAtOnce),
               [&](std::size_t chunk, int) {
                 const std::size_t begin = chunk * kRowsAtOnce * width;
                 const std::size_t end = std::min(found.size(), begin + kRowsAtOnce * width);
                 for (std::size_t i = begin; i < end; ++i) {
                   if (found[i].x >= kDoubtful) continue;
                   const std::uint32_t triangle = found[i].y & ~SurfaceImage::kExit;
                   const std::uint32_t solid = all.facts[triangle].x;
                   image.depth[first_pixel + i] = found[i].x;
                   image.solid[first_pixel + i] = solid;
                   image.triangle[first_pixel + i] =
                       (triangle - all.first_of[solid]) | (found[i].y & SurfaceImage::kExit);
                 }
               });

  // Doubtful pixels, each with its list.
  std::vector<std::size_t> starts;
  std::vector<std::uint32_t> too_long;
  for (std::size_t at = 0; at + 1 < words.size();) {
    const std::uint32_t length = words[at + 1];
    if (length == SurfaceImage::kNone) {
      const int u = static_cast<int>(words[at] % width), v = static_cast<int>(words[at] / width);
      too_long.push_back(
          static_cast<std::uint32_t>((v + v_begin) / kTileSide * frame.tiles_u + u / kTileSide));
      at += 2;
      continue;
    }
    starts.push_back(at);
    at += 2 + 2 * std::size_t{length};
  }
  std::sort(too_long.begin(), too_long.end());
  too_long.erase(std::unique(too_long.begin(), too_long.end()), too_long.end());
  left.insert(left.end(), too_long.begin(), too_long.end());
  report.resolved += starts.size();
  counts.doubtful += starts.size();
  for (int tv = v_begin / kTileSide; tv * kTileSide < v_end; ++tv) {
    const int rows = std::min(kTileSide, v_end - tv * kTileSide);
    for (int tu = 0; tu < frame.tiles_u; ++tu) {
      const int columns = std::min(kTileSide, frame.view.size.x - tu * kTileSide);
      const auto tile = static_cast<std::size_t>(tv * frame.tiles_u + tu);
      if (programs.tiles[tile].slot_count > 0) {
        counts.walked += static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(columns);
      }
    }
  }
  counts.walked -= starts.size();
  std::vector<std::unique_ptr<PixelJudge>> judges(
      static_cast<std::size_t>(execution.thread_count()));
  constexpr std::size_t kPixelsAChunk = 256;
  parallel_for(execution, (starts.size() + kPixelsAChunk - 1) / kPixelsAChunk,
               [&](std::size_t chunk, int worker) {
                 auto& judge = judges[static_cast<std::size_t>(worker)];
                 if (!judge) judge = std::make_unique<PixelJudge>(frame, all);
                 const std::size_t end = std::min(starts.size(), (chunk + 1) * kPixelsAChunk);
                 for (std::size_t i = chunk * kPixelsAChunk; i < end; ++i) {
                   const std::size_t at = starts[i];
                   const Surface surface = judge->judge(
                       std::span<const std::uint32_t>(words).subspan(at + 2, 2 * words[at + 1]));
                   const std::size_t pixel = first_pixel + words[at];
                   image.depth[pixel] = surface.depth;
                   image.solid[pixel] = surface.solid;
                   image.triangle[pixel] =
                       surface.triangle | (surface.exit ? SurfaceImage::kExit : 0u);
                 }
               });
}

}  // namespace strata::csg
