#include "csg/measure/ray_image.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <new>
#include <numeric>
#include <span>
#include <utility>

#include "csg/geometry.h"
#include "csg/program.h"
#include "csg/surface/tile_surface.h"
#include "strata/hashbuffer/build_ldi.h"

namespace strata::csg {
namespace {

/// All solids in one view, as one mesh.
struct Lists {
  std::vector<ViewPart> parts;          ///< the view of each solid
  std::vector<std::uint32_t> solid_of;  ///< the solid of each triangle
  LayeredDepthImage image;
};

/// Walks the depth lists of one view. One object serves one thread.
class RayWalk {
 public:
  RayWalk(const Program& program, const Geometry& geometry, const Lists& lists, const View& view,
          double world_error)
      : geometry_(&geometry), lists_(&lists), view_(&view), state_(program) {
    const glm::dmat4 image_from_eye = view.image_from_world * glm::inverse(view.eye_from_world);
    scale_ = image_from_eye[0][0];
    const double pixels = std::max(std::abs(image_from_eye[0][0]), std::abs(image_from_eye[1][1]));
    // Lengths along the view axis that count as nothing, in world units: a constant and a multiple
    // of the distance.
    const double tenth = 0.1 / pixels;
    slack_ = world_error + (view.perspective ? 0.0 : tenth);
    slack_per_distance_ = view.perspective ? tenth : 0.0;
  }

  /// Takes the list of the next ray. @pre sorted by depth
  void take(std::span<const DepthItem> items) {
    items_ = items;
    gather(items);
  }

  /// Counts the crossings with the first `counted` solids that lie in none of the other solids.
  std::uint32_t crossings(std::size_t counted) {
    if (counted >= lists_->parts.size()) return static_cast<std::uint32_t>(items_.size());
    within_.assign(lists_->parts.size() - counted, 0);
    std::uint32_t count = 0;
    int around = 0;  // number of the other solids that the ray is in
    std::size_t next = 0;
    for (const DepthItem item : items_) {
      if (lists_->solid_of[item.triangle()] >= counted) continue;
      for (; next < transitions_.size() && transitions_[next].depth <= item.depth(); ++next) {
        const Transition& transition = transitions_[next];
        if (transition.solid < counted) continue;
        std::uint8_t& within = within_[transition.solid - counted];
        // A face at the depth where a section begins still counts.
        if (within == 0 && transition.depth == item.depth()) break;
        within ^= 1;
        around += within != 0 ? 1 : -1;
      }
      count += around == 0 ? 1 : 0;
    }
    return count;
  }

  /// The length of the first interval inside the tree, along the ray of pixel (u, v).
  float thickness(int u, int v) {
    double begin = -1, end = -1;
    bool inside = state_.value();
    if (inside) begin = view_->near;
    std::size_t i = 0;
    while (i < transitions_.size()) {
      const std::uint32_t depth = transitions_[i].depth;
      for (; i < transitions_.size() && transitions_[i].depth == depth; ++i)
        state_.toggle(transitions_[i].solid);
      if (state_.value() == inside) continue;
      const double distance = view_->distance(depth);
      const double nothing = slack_ + slack_per_distance_ * distance + step(depth);
      if (!inside) {
        // A negligible gap joins the next interval to the first; a larger gap ends the walk.
        if (end >= 0 && distance - end > nothing) break;
        if (end < 0) begin = distance;
        end = -1;
      } else if (distance - begin > nothing) {
        end = distance;
      } else {
        begin = -1;
      }
      inside = state_.value();
    }
    const bool open = inside && end < 0 && i == transitions_.size();
    for (std::size_t j = 0; j < i; ++j) state_.toggle(transitions_[j].solid);
    if (open && begin >= 0) return std::numeric_limits<float>::infinity();
    if (begin < 0 || end < 0) return 0.0f;
    return static_cast<float>((end - begin) * slant(u, v));
  }

 private:
  /// The world length of three depth steps.
  [[nodiscard]] double step(std::uint32_t depth) const {
    return 3.0 * (view_->distance(depth + 1.0) - view_->distance(depth));
  }
  /// The length along the ray per unit of length along the view axis.
  [[nodiscard]] double slant(int u, int v) const {
    if (!view_->perspective) return 1.0;
    const double x = (u + 0.5 - view_->size.x / 2.0) / scale_;
    const double y = (v + 0.5 - view_->size.y / 2.0) / scale_;
    return std::sqrt(1.0 + x * x + y * y);
  }
  /// The transitions of a ray, sorted by depth.
  void gather(std::span<const DepthItem> items) {
    transitions_.clear();
    sorted_.assign(items.begin(), items.end());
    std::stable_sort(sorted_.begin(), sorted_.end(), [this](DepthItem a, DepthItem b) {
      return lists_->solid_of[a.triangle()] < lists_->solid_of[b.triangle()];
    });
    for (std::size_t i = 0; i < sorted_.size();) {
      const std::size_t begin = i;
      const std::uint32_t solid = lists_->solid_of[sorted_[begin].triangle()];
      while (i < sorted_.size() && lists_->solid_of[sorted_[i].triangle()] == solid) ++i;
      transitions_of(std::span(sorted_).subspan(begin, i - begin), solid,
                     geometry_->parts()[solid].rule, lists_->parts[solid].cut, transitions_);
    }
    std::stable_sort(transitions_.begin(), transitions_.end(),
                     [](const Transition& a, const Transition& b) { return a.depth < b.depth; });
  }

  const Geometry* geometry_;
  const Lists* lists_;
  const View* view_;
  ProgramState state_;
  double scale_ = 1, slack_ = 0, slack_per_distance_ = 0;
  std::span<const DepthItem> items_;
  std::vector<DepthItem> sorted_;
  std::vector<Transition> transitions_;
  std::vector<std::uint8_t> within_;  ///< whether the ray is in each solid that is not counted
};

}  // namespace

struct RayMeter::Impl {
  Impl(const Tree& tree, Tree::NodeId root, double relative_precision, const Execution& execution,
       std::size_t counted_solids)
      : geometry(tree, execution),
        program(compile(tree, root)),
        counted(counted_solids),
        world_error(geometry.world_error(tree, relative_precision)) {}

  [[nodiscard]] Result<Lists> lists(const View& view, const Execution& execution) const {
    const auto& parts = geometry.parts();
    Lists lists;
    lists.parts.resize(parts.size());
    std::vector<Result<void>> failures(parts.size());
    parallel_for(execution, parts.size(), [&](std::size_t i, int) {
      if (program.leaves[i].parent == Program::kNone) return;
      Execution alone;
      alone.threads = 1;
      auto part = view_part(parts[i].placed(), view, alone);
      if (part) {
        lists.parts[i] = std::move(*part);
      } else {
        failures[i] = tl::unexpected(part.error());
      }
    });
    for (const auto& failure : failures) {
      if (!failure) return tl::unexpected(failure.error());
    }
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    std::size_t vertices = 0, count = 0;
    for (const ViewPart& part : lists.parts) {
      vertices += part.mesh.vertices.size(), count += part.mesh.triangles.size();
    }
    if (vertices > 0xffffffffu || count > 0x7fffffffu) {
      return fail(ErrorCode::kLimit, "the tree has {} triangles, but at most {} can be measured",
                  count, 0x7fffffffu);
    }
    LatticeMesh mesh;
    std::vector<glm::uvec3> triangles;
    mesh.vertices.reserve(vertices);
    triangles.reserve(count);
    lists.solid_of.reserve(count);
    for (std::uint32_t i = 0; i < parts.size(); ++i) {
      const LatticeMesh& part = lists.parts[i].mesh;
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      mesh.vertices.insert(mesh.vertices.end(), part.vertices.begin(), part.vertices.end());
      for (const glm::uvec3& triangle : part.triangles) triangles.push_back(triangle + first);
      lists.solid_of.resize(triangles.size(), i);
    }
    mesh.triangles = triangles;
    auto image =
        build_ldi(mesh, {Axis::kZ, view.size.x, view.size.y, kPictureDepthLimit}, {}, execution);
    if (!image) return tl::unexpected(image.error());
    lists.image = *std::move(image);
    return lists;
  }

  Geometry geometry;
  Program program;
  std::size_t counted;
  double world_error = 0;
};

RayMeter::RayMeter(const Tree& tree, Tree::NodeId root, double relative_precision,
                   const Execution& execution, std::size_t counted)
    : impl_(std::make_unique<Impl>(tree, root, relative_precision, execution, counted)) {}
RayMeter::~RayMeter() = default;
RayMeter::RayMeter(RayMeter&&) noexcept = default;
RayMeter& RayMeter::operator=(RayMeter&&) noexcept = default;

Result<RayImage> RayMeter::measure(const View& view, const Execution& execution) const try {
  const auto lists = impl_->lists(view, execution);
  if (!lists) return tl::unexpected(lists.error());
  RayImage result;
  result.width = view.size.x, result.height = view.size.y;
  const auto width = static_cast<std::size_t>(view.size.x);
  const std::size_t pixels = width * static_cast<std::size_t>(view.size.y);
  result.thickness.resize(pixels);
  result.crossings.resize(pixels);
  const LayeredDepthImage& image = lists->image;
  std::vector<std::unique_ptr<RayWalk>> walks(static_cast<std::size_t>(execution.thread_count()));
  parallel_for(execution, static_cast<std::size_t>(view.size.y), [&](std::size_t v, int worker) {
    auto& walk = walks[static_cast<std::size_t>(worker)];
    if (!walk) {
      walk = std::make_unique<RayWalk>(impl_->program, impl_->geometry, *lists, view,
                                       impl_->world_error);
    }
    for (std::size_t u = 0; u < width; ++u) {
      const std::size_t pixel = v * width + u;
      const auto items = image.list(static_cast<int>(u), static_cast<int>(v));
      if (items.empty()) continue;
      walk->take(items);
      result.crossings[pixel] = walk->crossings(impl_->counted);
      result.thickness[pixel] = walk->thickness(static_cast<int>(u), static_cast<int>(v));
    }
  });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  result.fragments =
      std::accumulate(result.crossings.begin(), result.crossings.end(), std::uint64_t{0});
  return result;
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "out of memory for the lists of {} x {} rays", view.size.x,
              view.size.y);
}

}  // namespace strata::csg
