#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numeric>

#include "csg/picture.h"
#include "csg/program.h"
#include "csg/tile_surface.h"

namespace strata::csg {
namespace {

/// Solids with more triangles than this are prepared one after another, each by all threads.
constexpr std::size_t kLargePart = 20000;

/// Which solids may be met in which tile.
struct TileSolids {
  std::vector<std::uint32_t> offsets, solids;

  void build(std::span<const ViewPart> parts, int tiles_u, int tiles_v) {
    offsets.assign(static_cast<std::size_t>(tiles_u) * static_cast<std::size_t>(tiles_v) + 1, 0);
    const auto for_each = [&](auto&& body) {
      for (std::uint32_t solid = 0; solid < parts.size(); ++solid) {
        const PixelRect& rect = parts[solid].rect;
        if (rect.empty()) continue;
        for (int tv = rect.v0 / kTileSide; tv <= (rect.v1 - 1) / kTileSide; ++tv) {
          for (int tu = rect.u0 / kTileSide; tu <= (rect.u1 - 1) / kTileSide; ++tu) {
            body(static_cast<std::size_t>(tv) * static_cast<std::size_t>(tiles_u) +
                     static_cast<std::size_t>(tu),
                 solid);
          }
        }
      }
    };
    for_each([&](std::size_t tile, std::uint32_t) { ++offsets[tile + 1]; });
    std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
    solids.resize(offsets.back());
    std::vector<std::uint32_t> cursor(offsets.begin(), offsets.end() - 1);
    for_each([&](std::size_t tile, std::uint32_t solid) { solids[cursor[tile]++] = solid; });
  }
  [[nodiscard]] std::span<const std::uint32_t> at(std::size_t tile) const {
    return std::span(solids).subspan(offsets[tile], offsets[tile + 1] - offsets[tile]);
  }
};

/// One tree of solids in one view.
class Frame {
 public:
  Frame(const Program& program, const Geometry& geometry, double world_error)
      : program_(&program), geometry_(&geometry), world_error_(world_error) {}

  Result<void> draw(const View& view, const Execution& execution) {
    view_ = view;
    coincidence_ = Coincidence(view, world_error_);
    tiles_u_ = (view.size.x + kTileSide - 1) / kTileSide;
    tiles_v_ = (view.size.y + kTileSide - 1) / kTileSide;
    const auto& parts = geometry_->parts();
    view_parts_.clear();
    view_parts_.resize(parts.size());
    std::vector<std::uint32_t> small, large;
    for (std::uint32_t solid = 0; solid < parts.size(); ++solid) {
      if (program_->leaves[solid].parent == Program::kNone) continue;
      (parts[solid].triangles.size() > kLargePart ? large : small).push_back(solid);
    }
    std::vector<Result<void>> failures(parts.size());
    const auto prepare = [&](std::uint32_t solid, const Execution& how) {
      auto part = view_part(parts[solid], view_, how);
      if (part) {
        view_parts_[solid] = std::move(*part);
      } else {
        failures[solid] = tl::unexpected(part.error());
      }
    };
    constexpr std::size_t kAtOnce = 16;
    Execution alone;
    alone.threads = 1;
    parallel_for(execution, (small.size() + kAtOnce - 1) / kAtOnce, [&](std::size_t chunk, int) {
      const std::size_t end = std::min(small.size(), (chunk + 1) * kAtOnce);
      for (std::size_t i = chunk * kAtOnce; i < end; ++i) prepare(small[i], alone);
    });
    for (const std::uint32_t solid : large) prepare(solid, execution);
    for (const auto& failure : failures) {
      if (!failure) return failure;
    }
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    image_.width = view.size.x, image_.height = view.size.y;
    const std::size_t pixels =
        static_cast<std::size_t>(view.size.x) * static_cast<std::size_t>(view.size.y);
    for (auto* plane : {&image_.depth, &image_.solid, &image_.triangle}) plane->resize(pixels);
    finders_.clear();
    report_ = {};
    solids_.build(view_parts_, tiles_u_, tiles_v_);
    std::vector<std::uint32_t> tiles(static_cast<std::size_t>(tiles_u_ * tiles_v_));
    std::iota(tiles.begin(), tiles.end(), 0u);
    return find(tiles, execution);
  }

  Result<void> moved(std::uint32_t solid, const Execution& execution) {
    const PixelRect before = view_parts_[solid].rect;
    auto part = view_part(geometry_->parts()[solid], view_, execution);
    if (!part) return tl::unexpected(part.error());
    view_parts_[solid] = std::move(*part);
    const PixelRect after = view_parts_[solid].rect;
    solids_.build(view_parts_, tiles_u_, tiles_v_);
    std::vector<std::uint32_t> tiles;
    for (int tv = 0; tv < tiles_v_; ++tv) {
      for (int tu = 0; tu < tiles_u_; ++tu) {
        const auto meets = [&](const PixelRect& rect) {
          return !rect.empty() && rect.u0 < (tu + 1) * kTileSide && rect.u1 > tu * kTileSide &&
                 rect.v0 < (tv + 1) * kTileSide && rect.v1 > tv * kTileSide;
        };
        if (meets(before) || meets(after)) {
          tiles.push_back(static_cast<std::uint32_t>(tv * tiles_u_ + tu));
        }
      }
    }
    return find(tiles, execution);
  }

  [[nodiscard]] const SurfaceImage& image() const { return image_; }
  [[nodiscard]] const View& view() const { return view_; }
  [[nodiscard]] const std::vector<ViewPart>& view_parts() const { return view_parts_; }
  [[nodiscard]] const DrawReport& report() const { return report_; }

 private:
  Result<void> find(std::span<const std::uint32_t> tiles, const Execution& execution) {
    const auto workers = static_cast<std::size_t>(execution.thread_count());
    while (finders_.size() < workers) {
      finders_.push_back(std::make_unique<TileFinder>(*program_, view_parts_, geometry_->parts(),
                                                      view_, coincidence_));
    }
    parallel_for(execution, tiles.size(), [&](std::size_t i, int worker) {
      const auto tile = static_cast<int>(tiles[i]);
      finders_[static_cast<std::size_t>(worker)]->find(
          tile % tiles_u_, tile / tiles_u_, solids_.at(static_cast<std::size_t>(tile)), image_);
    });
    report_.fragments = report_.resolved = 0;
    for (const auto& finder : finders_) {
      report_.fragments += finder->fragments();
      report_.resolved += finder->resolved();
    }
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    return {};
  }

  const Program* program_;
  const Geometry* geometry_;
  double world_error_;
  View view_;
  Coincidence coincidence_;
  int tiles_u_ = 0, tiles_v_ = 0;
  std::vector<ViewPart> view_parts_;
  TileSolids solids_;
  std::vector<std::unique_ptr<TileFinder>> finders_;
  SurfaceImage image_;
  DrawReport report_;
};

constexpr ColourScheme kSchemes[] = {
    {"Cornfield", {0xff, 0xff, 0xe5}, {0xf9, 0xd7, 0x2c}, {0x9d, 0xcb, 0x51}},
    {"Metallic", {0xaa, 0xaa, 0xff}, {0xdd, 0xdd, 0xff}, {0xdd, 0x22, 0xdd}},
    {"Sunset", {0xaa, 0x44, 0x44}, {0xff, 0xaa, 0xaa}, {0x88, 0x22, 0x33}},
    {"Starnight", {0x00, 0x00, 0x00}, {0xff, 0xff, 0xe0}, {0x00, 0xff, 0xff}},
    {"BeforeDawn", {0x33, 0x33, 0x33}, {0xcc, 0xcc, 0xcc}, {0x55, 0x63, 0xdd}},
    {"Nature", {0xfa, 0xfa, 0xfa}, {0x16, 0xa0, 0x85}, {0xdb, 0xf4, 0xda}},
    {"DeepOcean", {0x33, 0x33, 0x33}, {0xee, 0xee, 0xee}, {0x0b, 0xab, 0xc8}},
    {"Solarized", {0xfd, 0xf6, 0xe3}, {0xb5, 0x88, 0x00}, {0x88, 0x22, 0x33}},
    {"Tomorrow", {0xf8, 0xf8, 0xf8}, {0x42, 0x71, 0xae}, {0xf5, 0x87, 0x1f}},
    {"Tomorrow Night", {0x1d, 0x1f, 0x21}, {0x81, 0xa2, 0xbe}, {0xde, 0x93, 0x5f}},
    {"Monotone", {0xff, 0xff, 0xe5}, {0xf9, 0xd7, 0x2c}, {0xf9, 0xd7, 0x2c}},
};

/// Light on a flat face: two directional lights of the eye, and what comes from everywhere.
class Shader {
 public:
  Shader(const Tree& tree, const Geometry& geometry, const View& view, const ColourScheme& scheme)
      : tree_(&tree), geometry_(&geometry), eye_from_world_(glm::dmat3(view.eye_from_world)) {
    face_ = glm::vec4(glm::vec3(scheme.face) / 255.0f, 1.0f);
    cut_ = glm::vec4(glm::vec3(scheme.cut) / 255.0f, 1.0f);
  }

  /// How bright the face is; it is seen from its other side at an exit.
  [[nodiscard]] float light(std::uint32_t solid, std::uint32_t triangle, bool exit) const {
    const Geometry::Part& part = geometry_->parts()[solid];
    const glm::uvec3& t = part.triangles[triangle];
    const glm::dvec3& a = part.positions[t.x];
    const glm::dvec3 across =
        eye_from_world_ * glm::cross(part.positions[t.y] - a, part.positions[t.z] - a);
    const double length = glm::length(across);
    if (!(length > 0)) return 1.0f;
    const glm::dvec3 normal = across / (exit ? -length : length);
    const double third = 1.0 / std::sqrt(3.0);
    const double one = std::max(0.0, glm::dot(normal, glm::dvec3(-third, third, third)));
    const double other = std::max(0.0, glm::dot(normal, glm::dvec3(third, -third, -third)));
    return static_cast<float>(std::min(1.0, 0.2 + one + other));
  }
  [[nodiscard]] glm::vec4 base(std::uint32_t solid, bool exit) const {
    const auto& colour = tree_->solids()[solid].colour;
    return colour ? *colour : exit ? cut_ : face_;
  }

 private:
  const Tree* tree_;
  const Geometry* geometry_;
  glm::dmat3 eye_from_world_;
  glm::vec4 face_, cut_;
};

Rgba to_bytes(const glm::vec4& colour) {
  return Rgba(glm::clamp(colour, 0.0f, 1.0f) * 255.0f + 0.5f);
}

}  // namespace

std::span<const ColourScheme> colour_schemes() { return kSchemes; }

const ColourScheme* find_colour_scheme(std::string_view name) {
  const auto same = [](char a, char b) { return std::tolower(a) == std::tolower(b); };
  for (const ColourScheme& scheme : kSchemes) {
    if (std::equal(scheme.name.begin(), scheme.name.end(), name.begin(), name.end(), same)) {
      return &scheme;
    }
  }
  return nullptr;
}

struct Preview::Impl {
  Impl(Tree t, std::vector<Ghost> g, double relative_precision, const Execution& execution)
      : tree(std::move(t)),
        ghosts(std::move(g)),
        geometry(tree, execution),
        program(compile(tree, tree.root())),
        frame(program, geometry, world_error(relative_precision)) {}
  [[nodiscard]] double world_error(double relative_precision) const {
    const Bounds& box = geometry.box();
    if (box.empty()) return 0;
    const glm::dvec3 reach = glm::max(glm::abs(box.low), glm::abs(box.high));
    return relative_precision * glm::length(reach);
  }

  Tree tree;
  std::vector<Ghost> ghosts;
  Geometry geometry;
  Program program;
  Frame frame;
  SurfaceImage with_sources;
};

Preview::Preview(Tree tree, std::vector<Ghost> ghosts, double relative_precision,
                 const Execution& execution)
    : impl_(std::make_unique<Impl>(std::move(tree), std::move(ghosts), relative_precision,
                                   execution)) {}
Preview::~Preview() = default;
Preview::Preview(Preview&&) noexcept = default;
Preview& Preview::operator=(Preview&&) noexcept = default;

Bounds Preview::box() const { return impl_->geometry.box(); }
const Tree& Preview::tree() const { return impl_->tree; }
const DrawReport& Preview::report() const { return impl_->frame.report(); }

Result<const SurfaceImage*> Preview::draw(const View& view, const Execution& execution) {
  if (auto done = impl_->frame.draw(view, execution); !done) return tl::unexpected(done.error());
  return &impl_->frame.image();
}

Result<const SurfaceImage*> Preview::move_solid(std::uint32_t solid,
                                                const glm::dmat4& world_from_mesh,
                                                const Execution& execution) {
  impl_->geometry.move_solid(solid, world_from_mesh);
  if (auto done = impl_->frame.moved(solid, execution); !done) return tl::unexpected(done.error());
  return &impl_->frame.image();
}

Result<Picture> Preview::picture(const Camera& camera, const glm::ivec2& size,
                                 const PictureOptions& options, const Execution& execution) {
  const ColourScheme& scheme = options.scheme != nullptr ? *options.scheme : kSchemes[0];
  auto view = make_view(camera, size, box());
  if (!view) return tl::unexpected(view.error());
  auto drawn = draw(*view, execution);
  if (!drawn) return tl::unexpected(drawn.error());
  const SurfaceImage& image = **drawn;
  const Shader shader(impl_->tree, impl_->geometry, *view, scheme);
  Picture picture{image.width, image.height, {}};
  picture.pixels.resize(image.depth.size());
  const Rgba background(scheme.background, options.transparent_background ? 0 : 255);
  const auto width = static_cast<std::size_t>(image.width);
  parallel_for(
      execution, static_cast<std::size_t>(image.height + 15) / 16, [&](std::size_t band, int) {
        const std::size_t end = std::min(static_cast<std::size_t>(image.height), (band + 1) * 16);
        std::uint32_t last_solid = SurfaceImage::kNone, last_triangle = 0;
        Rgba colour(0);
        for (std::size_t i = band * 16 * width; i < end * width; ++i) {
          if (image.depth[i] == SurfaceImage::kNone) {
            picture.pixels[i] = background;
            continue;
          }
          if (image.solid[i] != last_solid || image.triangle[i] != last_triangle) {
            last_solid = image.solid[i];
            last_triangle = image.triangle[i];
            const bool exit = (last_triangle & SurfaceImage::kExit) != 0;
            const ViewPart& part = impl_->frame.view_parts()[last_solid];
            const std::uint32_t source = part.source(last_triangle & ~SurfaceImage::kExit);
            const glm::vec4 base = shader.base(last_solid, exit);
            colour =
                to_bytes(glm::vec4(glm::vec3(base) * shader.light(last_solid, source, exit), 1.0f));
          }
          picture.pixels[i] = colour;
        }
      });
  return picture;
}

}  // namespace strata::csg
