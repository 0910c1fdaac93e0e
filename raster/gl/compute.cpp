#include "raster/gl/compute.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

namespace strata::glsl {
extern const gl::GlslPiece raster_gl_triangle_h;
extern const gl::GlslPiece raster_gl_compute_common;
extern const gl::GlslPiece raster_gl_compute_bin_comp;
extern const gl::GlslPiece raster_gl_compute_small_comp;
extern const gl::GlslPiece raster_gl_compute_large_comp;
}  // namespace strata::glsl

namespace strata::gl {
namespace {

constexpr std::uint32_t kGroupSize = 64;       // threads that take a triangle each
constexpr std::uint32_t kBlockGroupSize = 32;  // threads that take a block together
constexpr std::uint64_t kLargeBytes = 128;     // struct RasterLarge
constexpr std::uint64_t kBlockBytes = 8;       // uvec2
constexpr std::uint64_t kVertexBytes = 12;     // three coordinates
constexpr std::size_t kKeptPasses = 16;

enum Binding : unsigned {
  kVertices = 0,
  kTriangles = 1,
  kSmall = 2,
  kLarge = 3,
  kBlocks = 4,
  kCounters = 5,
  kView = 6
};

/// RasterView of compute_common.glsl.
struct ViewBlock {
  std::int32_t axes[4];
  std::int32_t clip[4];
  std::int32_t first_row, width;
  std::uint32_t depth_limit, unused;
};

GlslSettings settings_for(GlslSettings settings, std::uint32_t group_size) {
  const char* const kInt64 = "GL_ARB_gpu_shader_int64";
  if (std::find(settings.extensions.begin(), settings.extensions.end(), kInt64) ==
      settings.extensions.end()) {
    settings.extensions.emplace_back(kInt64);
  }
  settings.defines.emplace_back("RASTER_GROUP", std::to_string(group_size));
  return settings;
}

}  // namespace

Result<std::unique_ptr<ComputeRasterizer>> ComputeRasterizer::create(const Context& context) {
  const Info& info = context.info();
  if (!info.has_int64) {
    return fail(
        ErrorCode::kUsage,
        "no 64-bit integers in shaders (GL_ARB_gpu_shader_int64), which the exact rasterizer "
        "needs");
  }
  std::unique_ptr<ComputeRasterizer> result(new ComputeRasterizer());
  result->binding_bytes_ = info.limits.storage_block_bytes;
  const GlslPiece pieces[] = {glsl::raster_gl_triangle_h, glsl::raster_gl_compute_common,
                              glsl::raster_gl_compute_bin_comp};
  auto program = Program::compute(pieces, settings_for({}, kGroupSize));
  if (!program) return tl::unexpected(program.error());
  result->bin_program_ = *std::move(program);
  auto view = Buffer::allocate(sizeof(ViewBlock));
  if (!view) return tl::unexpected(view.error());
  result->view_ = *std::move(view);
  auto counters = Buffer::allocate(3 * sizeof(std::uint32_t));
  if (!counters) return tl::unexpected(counters.error());
  result->counters_ = *std::move(counters);
  return result;
}

Result<void> ComputeRasterizer::set_mesh(const LatticeMesh& mesh) {
  binned_ = {};
  const std::uint64_t most = binding_bytes_ / kLargeBytes;  // all of a part may be large
  const bool shared = mesh.vertices.size() * kVertexBytes <= binding_bytes_;
  const std::size_t count = mesh.triangles.size();
  if (count > std::numeric_limits<std::int32_t>::max()) {
    return fail(ErrorCode::kLimit, "the mesh has {} triangles; the limit is 2^31 - 1", count);
  }
  if (shared) {
    auto uploaded = vertices_.assign(std::span<const glm::ivec3>(mesh.vertices));
    if (!uploaded) return uploaded;
  }
  parts_.resize((count + most - 1) / most);
  std::vector<glm::ivec3> corners;
  std::vector<std::uint32_t> indices;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    Part& part = parts_[i];
    part.first = static_cast<std::uint32_t>(i * most);
    part.count = static_cast<std::uint32_t>(std::min<std::uint64_t>(most, count - part.first));
    const auto triangles = mesh.triangles.subspan(part.first, part.count);
    if (shared) {
      part.own_vertices = Buffer();
      if (auto uploaded = part.triangles.assign(triangles); !uploaded) return uploaded;
      continue;
    }
    corners.clear();
    indices.clear();
    for (const glm::uvec3& triangle : triangles) {
      for (int corner = 0; corner < 3; ++corner) {
        indices.push_back(static_cast<std::uint32_t>(corners.size()));
        corners.push_back(mesh.vertices[triangle[corner]]);
      }
    }
    auto uploaded = part.triangles.assign(std::span<const std::uint32_t>(indices));
    if (uploaded) uploaded = part.own_vertices.assign(std::span<const glm::ivec3>(corners));
    if (!uploaded) return uploaded;
  }
  return check_errors("uploading a mesh");
}

void ComputeRasterizer::set_target(const RasterTarget& target, int v_begin, int v_end) {
  target_ = target;
  v_begin_ = v_begin;
  v_end_ = v_end;
  binned_ = {};
}

void ComputeRasterizer::bind(const Part& part) const {
  (part.own_vertices ? part.own_vertices : vertices_).bind(kVertices);
  part.triangles.bind(kTriangles);
  part.small.bind(kSmall);
  part.large.bind(kLarge);
  part.blocks.bind(kBlocks);
  counters_.bind(kCounters);
  view_.bind(kView);
}

Result<void> ComputeRasterizer::bin(Part& part) {
  if (auto room = part.small.reserve(part.count * sizeof(std::uint32_t)); !room) return room;
  // A guess at first; then what was counted.
  std::uint64_t large = std::max<std::uint64_t>(256, part.count / 16), blocks = 4096;
  for (;;) {
    if (auto room = part.large.reserve(large * kLargeBytes); !room) return room;
    if (auto room = part.blocks.reserve(blocks * kBlockBytes); !room) return room;
    large = part.large.bytes() / kLargeBytes;
    blocks = part.blocks.bytes() / kBlockBytes;
    counters_.clear(0);
    bind(part);
    bin_program_.use();
    bin_program_.set("raster_first_triangle", part.first);
    bin_program_.set("raster_triangle_count", part.count);
    bin_program_.set("raster_large_capacity", static_cast<std::uint32_t>(large));
    bin_program_.set("raster_block_capacity", static_cast<std::uint32_t>(blocks));
    const Groups groups = groups_for(part.count, kGroupSize);
    bin_program_.dispatch(groups.x, groups.y);
    storage_barrier();
    std::array<std::uint32_t, 3> counted{};
    counters_.download(std::span<std::uint32_t>(counted));
    if (auto done = check_errors("sorting triangles out"); !done) return done;
    if (counted[1] <= large && counted[2] <= blocks) {
      part.small_count = counted[0];
      part.large_count = counted[1];
      part.block_count = counted[2];
      return {};
    }
    // Large triangles that found no room have not counted their blocks.
    blocks = std::max<std::uint64_t>(counted[2] + counted[2] / 4,
                                     counted[1] > large ? 2 * blocks : blocks);
    large = std::max<std::uint64_t>(large, counted[1]);
    if (blocks * kBlockBytes > binding_bytes_) {
      blocks = binding_bytes_ / kBlockBytes;
      if (counted[2] > blocks) {
        return fail(ErrorCode::kLimit,
                    "large triangles cover {} blocks of 32 x 32 pixels, but one binding of {} "
                    "holds {}: draw fewer rows at once",
                    counted[2], binding_bytes_, blocks);
      }
    }
  }
}

Result<void> ComputeRasterizer::bin(PixelRows rows) {
  const AxisFrame frame(target_.axis);
  const ViewBlock view{{frame.u, frame.v, frame.w, 0},
                       {0, v_begin_ + static_cast<int>(rows.begin), target_.width,
                        v_begin_ + static_cast<int>(rows.end)},
                       v_begin_,
                       target_.width,
                       target_.depth_limit,
                       0};
  view_.upload(std::span<const ViewBlock>(&view, 1));
  counts_ = {};
  for (Part& part : parts_) {
    if (auto done = bin(part); !done) return done;
    counts_.small += part.small_count;
    counts_.large += part.large_count;
    counts_.blocks += part.block_count;
  }
  binned_ = rows;
  return {};
}

Result<const ComputeRasterizer::Pass*> ComputeRasterizer::pass_for(const StoreGlsl& store) {
  const auto known = std::find_if(passes_.begin(), passes_.end(),
                                  [&](const Pass& pass) { return pass.store == store; });
  if (known != passes_.end()) return &*known;
  Pass pass;
  pass.store = store;
  const auto compile = [&](const GlslPiece& main, std::uint32_t group_size) {
    const GlslPiece pieces[] = {glsl::raster_gl_triangle_h, glsl::raster_gl_compute_common,
                                store.piece(), main};
    return Program::compute(pieces, settings_for(store.settings, group_size));
  };
  auto small = compile(glsl::raster_gl_compute_small_comp, kGroupSize);
  if (!small) return tl::unexpected(small.error());
  auto large = compile(glsl::raster_gl_compute_large_comp, kBlockGroupSize);
  if (!large) return tl::unexpected(large.error());
  pass.small = *std::move(small);
  pass.large = *std::move(large);
  if (passes_.size() == kKeptPasses) passes_.erase(passes_.begin());
  passes_.push_back(std::move(pass));
  return &passes_.back();
}

Result<void> ComputeRasterizer::draw(const StoreGlsl& store, PixelRows rows) {
  rows.end = std::min(rows.end, height());
  if (rows.begin >= rows.end || width() == 0) return {};
  if (binned_.begin != rows.begin || binned_.end != rows.end) {
    binned_ = {};
    if (auto done = bin(rows); !done) return done;
  }
  const auto pass = pass_for(store);
  if (!pass) return tl::unexpected(pass.error());
  for (const Part& part : parts_) {
    bind(part);
    if (part.small_count > 0) {
      const Program& program = (*pass)->small;
      program.use();
      program.set("raster_first_triangle", part.first);
      program.set("raster_small_count", part.small_count);
      const Groups groups = groups_for(part.small_count, kGroupSize);
      program.dispatch(groups.x, groups.y);
    }
    if (part.block_count > 0) {
      const Program& program = (*pass)->large;
      program.use();
      program.set("raster_block_count", part.block_count);
      const Groups groups = groups_for(part.block_count, 1);
      program.dispatch(groups.x, groups.y);
    }
  }
  storage_barrier();
  return check_errors("rasterizing in a compute shader");
}

Result<std::uint64_t> ComputeRasterizer::count(PixelRows rows) {
  constexpr std::size_t kSums = 1024;  // so that threads seldom wait for each other
  static const StoreGlsl kCount{"count of fragments",
                                {},
                                R"(
layout(std430, binding = 8) buffer StoreSums { uint store_sums[1024]; };
void strata_insert(uint pixel, uint depth, uint payload) {
  atomicAdd(store_sums[pixel & 1023u], 1u);
}
)"};
  if (auto room = sums_.reserve(kSums * sizeof(std::uint32_t)); !room) {
    return tl::unexpected(room.error());
  }
  sums_.clear(0);
  sums_.bind(8);
  if (auto drawn = draw(kCount, rows); !drawn) return tl::unexpected(drawn.error());
  std::array<std::uint32_t, kSums> sums{};
  sums_.download(std::span<std::uint32_t>(sums));
  if (auto done = check_errors("counting fragments"); !done) return tl::unexpected(done.error());
  return std::accumulate(sums.begin(), sums.end(), std::uint64_t{0});
}

}  // namespace strata::gl
