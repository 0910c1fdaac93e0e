#include "strata/csg/gl/gpu.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "csg/gl/gl_surfaces.h"
#include "csg/gl/result_lists.h"
#include "hashbuffer/gl/hash_store.h"
#include "hashbuffer/gl/scan_store.h"
#include "strata/csg/picture/picture.h"
#include "strata/csg/solid_lists.h"
#include "strata/gl/context.h"
#include "strata/hashbuffer/build_ldi.h"
#include "strata/mesh/shapes.h"
#include "strata/raster/lattice_mesh.h"

namespace strata::csg {
namespace {

/// Whether this machine may have a GPU. Loading a driver to find out takes longer than many a job.
bool has_gpu_device() {
  if (gl::pretends_hardware()) return true;
  std::error_code ignored;
  if (std::filesystem::exists("/dev/nvidia0", ignored)) return true;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/dri", ignored)) {
    if (entry.path().filename().string().starts_with("renderD")) return true;
  }
  return false;
}

/// A body with small and large triangles, some of them half outside.
TriangleSoup example() {
  TriangleSoup soup = make_torus_knot(2, 3, 0.5, 24, 8);
  const auto first = static_cast<unsigned>(soup.positions.size());
  const TriangleSoup box = make_box({-6, -6, -0.7}, {1.3, 1.1, 0.9});
  soup.positions.insert(soup.positions.end(), box.positions.begin(), box.positions.end());
  for (const auto& t : box.triangles) soup.triangles.push_back(t + first);
  return soup;
}

/// A tree of three solids.
Tree example_tree() {
  Tree tree;
  const auto add = [&tree](TriangleSoup mesh) {
    Solid solid;
    solid.mesh = std::make_shared<TriangleSoup>(std::move(mesh));
    return tree.add_solid(std::move(solid));
  };
  const auto box = add(make_box({-1, -1, -1}, {1, 1, 1}));
  const auto ball = add(make_icosphere(1.3, 2));
  const auto hole = add(make_cylinder(0.4, 3, 12));
  const auto both = tree.add(Operation::kIntersection, {box, ball});
  tree.set_root(tree.add(Operation::kDifference, {both, hole}));
  return tree;
}

/// Makes an example's lists on both, within +-`half` of the origin. @return kInternal where they
/// differ
Result<void> try_lists(ListSource& source, const TriangleSoup& soup, const glm::dvec3& half,
                       const TileListFilter* filter) {
  VoxelGrid grid;
  grid.dims = {70, 50, 40};
  grid.origin = -half;
  grid.voxel_size = 2.0 * half / glm::dvec3(grid.dims);
  const auto mesh = snap_to_lattice(soup, grid);
  if (!mesh) return tl::unexpected(mesh.error());
  const RasterTarget target = raster_target(grid, Axis::kY);
  const auto found = build_ldi(source, *mesh, target, {}, filter);
  if (!found) return tl::unexpected(found.error());
  const auto expected = build_ldi(*mesh, target, {}, {}, filter);
  if (!expected) return tl::unexpected(expected.error());
  if (*found == *expected) return {};
  return fail(ErrorCode::kInternal, "the self-test's lists differ from the CPU's");
}

Result<void> try_lists(ListSource& source) {
  if (auto tried = try_lists(source, example(), {3.6, 3.6, 1.6}, nullptr); !tried) return tried;
  const Tree tree = example_tree();
  const SolidLists lists(tree, tree.root());
  return try_lists(source, lists.soup(), {1.2, 1.1, 1.6}, &lists.filter());
}

/// The same for the surfaces of a small tree.
Result<void> try_surfaces(SurfaceSource& source) {
  const Tree tree = example_tree();
  Preview own(tree, {}, 1e-6), other(tree, {}, 1e-6);
  other.set_source(&source);
  Camera camera;
  centre_camera(camera, own.box());
  fit_camera(camera, own.box());
  const auto expected = own.picture(camera, {48, 40});
  const auto found = other.picture(camera, {48, 40});
  if (!expected) return tl::unexpected(expected.error());
  if (!found) return tl::unexpected(found.error());
  if (found->pixels == expected->pixels) return {};
  return fail(ErrorCode::kInternal, "the self-test's picture differs from the CPU's");
}

class GlGpu final : public Gpu {
 public:
  GlGpu(std::unique_ptr<gl::Context> context, GpuRequest request)
      : context_(std::move(context)), request_(std::move(request)) {}

  Result<ListSource*> lists(StoreKind store, const Execution& execution) override {
    auto source = make_lists(store, execution);
    if (source) {
      if (auto tried = try_lists(**source); !tried) source = tl::unexpected(tried.error());
    }
    if (!source) return refused<ListSource*>(source.error());
    lists_ = *std::move(source);
    if (is_required()) return lists_.get();
    fallback_ = std::make_unique<ListSourceOrCpu>(*lists_, execution, [this](const Error& error) {
      warn(fmt::format("the GPU failed and the CPU continues: {}", error.message));
    });
    return fallback_.get();
  }

  Result<SurfaceSource*> surfaces() override {
    auto source = make_surfaces();
    if (source) {
      if (auto tried = try_surfaces(**source); !tried) source = tl::unexpected(tried.error());
    }
    if (!source) return refused<SurfaceSource*>(source.error());
    surfaces_ = *std::move(source);
    return surfaces_.get();
  }

 private:
  [[nodiscard]] bool is_required() const { return !request_.required_by.empty(); }
  Result<std::unique_ptr<GlResultSource>> make_lists(StoreKind kind, const Execution& execution) {
    const std::int64_t pixels = pixels_at_once(execution.memory_limit);
    auto scan = gl::ScanStore::create(context_->info());
    if (!scan) return tl::unexpected(scan.error());
    if (kind != StoreKind::kHaBuffer) {
      return GlResultSource::create(*context_, *std::move(scan), nullptr, pixels, execution);
    }
    auto hash = gl::HashStore::create(context_->info());
    if (!hash) return tl::unexpected(hash.error());
    return GlResultSource::create(*context_, *std::move(hash), *std::move(scan), pixels, execution);
  }
  /// Lists of about 16 crossings, and their copies, within a quarter of the memory limit.
  static std::int64_t pixels_at_once(std::uint64_t memory_limit) {
    constexpr std::uint64_t kMost = std::uint64_t{1} << 22, kBytesAPixel = 300;
    if (memory_limit == 0) return kMost;
    return static_cast<std::int64_t>(std::min(kMost, memory_limit / 4 / kBytesAPixel));
  }
  Result<std::unique_ptr<GlSurfaceSource>> make_surfaces() {
    auto scan = gl::ScanStore::create(context_->info());
    if (!scan) return tl::unexpected(scan.error());
    return GlSurfaceSource::create(*context_, *std::move(scan));
  }
  /// What is said, and what the CPU then does, where this driver cannot.
  template <class Source>
  Result<Source> refused(const Error& error) {
    if (error.code == ErrorCode::kCancelled) return tl::unexpected(error);
    const std::string why = fmt::format("{}: {}", context_->info().renderer, error.message);
    if (is_required()) return fail(ErrorCode::kUsage, "{}: {}", request_.required_by, why);
    warn(fmt::format("the CPU does the work, since the GPU cannot: {}", why));
    return Source{nullptr};
  }
  void warn(std::string text) const {
    if (request_.warn) request_.warn(std::move(text));
  }

  std::unique_ptr<gl::Context> context_;  // goes last
  GpuRequest request_;
  std::unique_ptr<GlResultSource> lists_;
  std::unique_ptr<ListSourceOrCpu> fallback_;
  std::unique_ptr<GlSurfaceSource> surfaces_;
};

}  // namespace

Result<std::unique_ptr<Gpu>> Gpu::open(GpuRequest request) {
  const bool required = !request.required_by.empty();
  const auto note = [&request](std::string text) {
    if (request.note) request.note(std::move(text));
  };
  if (!required && !has_gpu_device()) {
    note("no GPU: the CPU does the work");
    return nullptr;
  }
  auto context = gl::Context::headless();
  if (!context) {
    if (required) {
      return fail(ErrorCode::kUsage, "{}: {}", request.required_by, context.error().message);
    }
    note(fmt::format("the CPU does the work: {}", context.error().message));
    return nullptr;
  }
  const gl::Info& info = (*context)->info();
  if (!required && info.is_software) {
    note(fmt::format("{} is not a GPU: the CPU does the work", info.renderer));
    return nullptr;
  }
  note(fmt::format("{}, OpenGL {}", info.renderer, info.version));
  return std::make_unique<GlGpu>(*std::move(context), std::move(request));
}

}  // namespace strata::csg
