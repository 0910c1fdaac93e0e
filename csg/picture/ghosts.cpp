#include "csg/picture/ghosts.h"

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>
#include <memory>
#include <utility>

#include "csg/surface/tile_surface.h"
#include "strata/hashbuffer/build_ldi.h"

namespace strata::csg {
namespace {

/// Whether all solids below each node have an alpha below 1 (false for none). What is taken away
/// does not count: its faces have their own colours.
std::vector<std::uint8_t> translucent_nodes(const Tree& tree) {
  std::vector<std::uint8_t> result(tree.nodes().size(), 0);
  for (Tree::NodeId id = 0; id < result.size(); ++id) {
    const Tree::Node& node = tree.nodes()[id];
    if (node.operation == Operation::kSolid) {
      const auto& colour = tree.solids()[node.first].colour;
      result[id] = colour && colour->a < 1.0f ? 1 : 0;
      continue;
    }
    auto operands = tree.operands(id);
    if (node.operation == Operation::kDifference) {
      operands = operands.first(std::min<std::size_t>(1, operands.size()));
    }
    result[id] = !operands.empty() && std::all_of(operands.begin(), operands.end(),
                                                  [&](Tree::NodeId o) { return result[o] != 0; })
                     ? 1
                     : 0;
  }
  return result;
}

/// The tree below `node` alone: its solids, without meshes, in the order of `solids`.
Tree subtree(const Tree& tree, Tree::NodeId root, std::vector<std::uint32_t>& solids) {
  std::vector<Tree::NodeId> order{root};  // parents before operands
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (tree.nodes()[order[i]].operation == Operation::kSolid) continue;
    const auto operands = tree.operands(order[i]);
    order.insert(order.end(), operands.begin(), operands.end());
  }
  Tree out;
  std::vector<Tree::NodeId> made(order.size()), operands;
  // Operands of order[i] stand one after another, after those of all earlier nodes.
  std::size_t next = order.size();
  for (std::size_t i = order.size(); i-- > 0;) {
    const Tree::Node& node = tree.nodes()[order[i]];
    if (node.operation == Operation::kSolid) {
      made[i] = out.add_solid({});
      solids.push_back(node.first);
      continue;
    }
    next -= node.count;
    operands.assign(made.begin() + static_cast<std::ptrdiff_t>(next),
                    made.begin() + static_cast<std::ptrdiff_t>(next + node.count));
    made[i] = out.add(node.operation, operands);
  }
  out.set_root(made.front());
  return out;
}

}  // namespace

Tree::NodeId take_translucent(Tree& tree, std::vector<Translucent>& out) {
  const Tree::NodeId root = tree.root();
  if (root == Tree::kNone) return root;
  const std::vector<std::uint8_t> translucent = translucent_nodes(tree);
  if (std::find(translucent.begin(), translucent.end(), 1) == translucent.end()) return root;
  // Down the unions; what they unite stays or goes as a whole.
  std::vector<Tree::NodeId> stack{root}, kept;
  const std::size_t before = out.size();
  while (!stack.empty()) {
    const Tree::NodeId id = stack.back();
    stack.pop_back();
    if (tree.nodes()[id].operation == Operation::kUnion) {
      const auto operands = tree.operands(id);
      stack.insert(stack.end(), operands.rbegin(), operands.rend());
    } else if (translucent[id] != 0) {
      out.push_back({id, {}});
    } else {
      kept.push_back(id);
    }
  }
  return out.size() == before ? root : tree.add(Operation::kUnion, kept);
}

GhostPainter::GhostPainter(const Tree& tree, std::span<const Translucent> ghosts,
                           const Geometry& geometry, double world_error)
    : geometry_(&geometry), world_error_(world_error) {
  for (const Translucent& ghost : ghosts) {
    if (ghost.node == Tree::kNone) continue;
    std::vector<std::uint32_t> solids;
    const Tree part = subtree(tree, ghost.node, solids);
    for (std::uint32_t leaf = 0; leaf < solids.size(); ++leaf) {
      slots_.push_back({static_cast<std::uint32_t>(programs_.size()), solids[leaf], leaf});
    }
    programs_.push_back({compile(part, part.root()), ghost.colour});
  }
}

/// The ghosts in one view: all their triangles as one mesh.
struct GhostPainter::Painted {
  std::vector<ViewPart> parts;                 ///< of each slot
  std::vector<std::uint32_t> first_triangles;  ///< of each slot
  std::vector<std::uint32_t> slot_of;          ///< of each triangle
  std::vector<glm::uvec3> triangles;
  LatticeMesh mesh;
};

/// Scratch of one thread.
class GhostPainter::PixelPainter {
 public:
  PixelPainter(const GhostPainter& painter, const Painted& painted, const View& view,
               const Shader& shader)
      : painter_(&painter), painted_(&painted), shader_(&shader) {
    states_.resize(painter.programs_.size());
    // Depth steps of a tenth of a pixel and of the scene's own error: thinner is nothing.
    const glm::dmat4 image_from_eye = view.image_from_world * glm::inverse(view.eye_from_world);
    const double pixels = std::max(std::abs(image_from_eye[0][0]), std::abs(image_from_eye[1][1]));
    if (view.perspective) {
      const double difference = 1.0 / view.near - 1.0 / view.far;
      const double steps = kPictureDepthLimit / difference;
      a_ = 1.0 / view.near, b_ = difference / kPictureDepthLimit;
      pixel_ = steps * 0.1 / pixels;
      flat_ = steps * painter.world_error_;
    } else {
      const double steps = kPictureDepthLimit / (view.far - view.near);
      pixel_ = steps * 0.1 / pixels;
      flat_ = steps * painter.world_error_;
    }
  }

  /// @param opaque depth of the opaque surface, or kNone
  void paint(std::span<const DepthItem> items, std::uint32_t opaque, Rgba& colour) {
    gather(items);
    glm::vec3 light(0.0f);  // premultiplied, front to back
    float left = 1.0f;
    bool painted = false;
    for (const Fragment& fragment : fragments_) {
      if (opaque != SurfaceImage::kNone && fragment.depth > opaque + slack(opaque)) break;
      const glm::vec4 face = face_colour(fragment);
      light += left * face.a * glm::vec3(face);
      left *= 1.0f - face.a;
      painted = true;
    }
    if (!painted) return;
    const glm::vec4 behind = glm::vec4(colour) / 255.0f;
    colour = to_bytes(glm::vec4(light + left * glm::vec3(behind), 1.0f - left * (1.0f - behind.a)));
  }

 private:
  struct Fragment {
    std::uint32_t depth = 0, ghost = 0, solid = 0, triangle = 0;  ///< triangle of the soup
    bool exit = false;
  };

  [[nodiscard]] double slack(std::uint32_t depth) const {
    const double nearness = a_ - b_ * depth;
    return 3.0 + pixel_ * nearness + flat_ * nearness * nearness;
  }

  /// All surfaces of all ghosts along a ray, sorted.
  void gather(std::span<const DepthItem> items) {
    fragments_.clear();
    sorted_.assign(items.begin(), items.end());
    std::stable_sort(sorted_.begin(), sorted_.end(), [this](DepthItem a, DepthItem b) {
      return painted_->slot_of[a.triangle()] < painted_->slot_of[b.triangle()];
    });
    for (std::size_t i = 0; i < sorted_.size();) {
      const std::uint32_t ghost = slot(sorted_[i]).ghost;
      transitions_.clear();
      while (i < sorted_.size() && slot(sorted_[i]).ghost == ghost) {
        const std::size_t begin = i;
        const std::uint32_t at = painted_->slot_of[sorted_[begin].triangle()];
        while (i < sorted_.size() && painted_->slot_of[sorted_[i].triangle()] == at) ++i;
        const Slot& one = painter_->slots_[at];
        transitions_of(std::span(sorted_).subspan(begin, i - begin), one.leaf,
                       painter_->geometry_->parts()[one.solid].rule, painted_->parts[at].cut,
                       transitions_);
      }
      walk(ghost);
    }
    std::stable_sort(fragments_.begin(), fragments_.end(),
                     [](const Fragment& a, const Fragment& b) { return a.depth < b.depth; });
    std::erase_if(fragments_, [](const Fragment& f) { return f.triangle == Surface::kNone; });
  }

  /// The surfaces of one ghost's tree, from its transitions.
  void walk(std::uint32_t ghost) {
    std::stable_sort(transitions_.begin(), transitions_.end(),
                     [](const Transition& a, const Transition& b) { return a.depth < b.depth; });
    if (!states_[ghost]) {
      states_[ghost] = std::make_unique<ProgramState>(painter_->programs_[ghost].program);
    }
    ProgramState& state = *states_[ghost];
    const std::size_t first = fragments_.size();
    bool value = state.value();
    for (std::size_t i = 0; i < transitions_.size();) {
      const std::size_t begin = i;
      std::size_t shown = begin;
      for (; i < transitions_.size() && transitions_[i].depth == transitions_[begin].depth; ++i) {
        const bool before = state.value();
        state.toggle(transitions_[i].solid);
        if (state.value() != before) shown = i;
      }
      if (state.value() == value) continue;
      value = !value;
      const Transition& transition = transitions_[shown];
      // Faces that coincide leave slivers and gaps that are none.
      if (fragments_.size() > first && fragments_.back().solid != transition.solid &&
          transition.depth - fragments_.back().depth <= slack(transition.depth)) {
        fragments_.pop_back();
        continue;
      }
      fragments_.push_back(
          {transition.depth, ghost, transition.solid, transition.triangle, transition.exit});
    }
    for (const Transition& transition : transitions_)
      state.toggle(transition.solid);  // an even number of each or all of them
    if (state.value() != states_initial(ghost)) states_[ghost].reset();
  }
  [[nodiscard]] bool states_initial(std::uint32_t ghost) const {
    return painter_->programs_[ghost].program.value_when_outside();
  }

  [[nodiscard]] glm::vec4 face_colour(const Fragment& fragment) const {
    const std::uint32_t at = painted_->slot_of[fragment.triangle];
    const Slot& one = painter_->slots_[at];
    const std::uint32_t triangle =
        painted_->parts[at].source(fragment.triangle - painted_->first_triangles[at]);
    const auto& colour = painter_->programs_[one.ghost].colour;
    // The far wall of a translucent solid is no cut.
    const bool cut = fragment.exit && shader_->base(one.solid, false).a == 1.0f;
    const glm::vec4 base = colour ? *colour : shader_->base(one.solid, cut);
    return {glm::vec3(base) * shader_->light(one.solid, triangle, fragment.exit), base.a};
  }
  [[nodiscard]] const Slot& slot(DepthItem item) const {
    return painter_->slots_[painted_->slot_of[item.triangle()]];
  }

  const GhostPainter* painter_;
  const Painted* painted_;
  const Shader* shader_;
  double a_ = 1, b_ = 0, pixel_ = 0, flat_ = 0;
  std::vector<std::unique_ptr<ProgramState>> states_;
  std::vector<DepthItem> sorted_;
  std::vector<Transition> transitions_;
  std::vector<Fragment> fragments_;
};

Result<void> GhostPainter::paint(const View& view, const SurfaceImage& opaque, const Shader& shader,
                                 const Execution& execution, std::span<Rgba> colours) {
  Painted painted;
  painted.parts.resize(slots_.size());
  std::vector<Result<void>> failures(slots_.size());
  parallel_for(execution, slots_.size(), [&](std::size_t i, int) {
    Execution alone;
    alone.threads = 1;
    auto part = view_part(geometry_->parts()[slots_[i].solid].placed(), view, alone);
    if (part) {
      painted.parts[i] = std::move(*part);
    } else {
      failures[i] = tl::unexpected(part.error());
    }
  });
  for (const auto& failure : failures) {
    if (!failure) return failure;
  }
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  std::size_t vertices = 0, triangles = 0;
  for (const ViewPart& part : painted.parts) {
    vertices += part.mesh.vertices.size(), triangles += part.mesh.triangles.size();
  }
  if (vertices > 0xffffffffu || triangles > 0x7fffffffu) {
    return fail(ErrorCode::kLimit, "{} triangles are transparent; the limit is {}", triangles,
                0x7fffffffu);
  }
  painted.mesh.vertices.reserve(vertices);
  painted.triangles.reserve(triangles);
  painted.slot_of.reserve(triangles);
  for (std::uint32_t i = 0; i < slots_.size(); ++i) {
    const LatticeMesh& mesh = painted.parts[i].mesh;
    const auto first = static_cast<std::uint32_t>(painted.mesh.vertices.size());
    painted.first_triangles.push_back(static_cast<std::uint32_t>(painted.triangles.size()));
    painted.mesh.vertices.insert(painted.mesh.vertices.end(), mesh.vertices.begin(),
                                 mesh.vertices.end());
    for (const glm::uvec3& triangle : mesh.triangles) painted.triangles.push_back(triangle + first);
    painted.slot_of.resize(painted.triangles.size(), i);
  }
  painted.mesh.triangles = painted.triangles;
  const auto lists = build_ldi(
      painted.mesh, {Axis::kZ, view.size.x, view.size.y, kPictureDepthLimit}, {}, execution);
  if (!lists) return tl::unexpected(lists.error());
  fragments_ = lists->items.size();

  std::vector<std::unique_ptr<PixelPainter>> painters(
      static_cast<std::size_t>(execution.thread_count()));
  parallel_for(execution, static_cast<std::size_t>(view.size.y), [&](std::size_t v, int worker) {
    const auto width = static_cast<std::size_t>(view.size.x);
    const std::size_t begin = v * width, end = begin + width;
    if (lists->offsets[begin] == lists->offsets[end]) return;
    auto& painter = painters[static_cast<std::size_t>(worker)];
    if (!painter) painter = std::make_unique<PixelPainter>(*this, painted, view, shader);
    for (std::size_t i = begin; i < end; ++i) {
      const auto items = std::span(lists->items)
                             .subspan(lists->offsets[i], lists->offsets[i + 1] - lists->offsets[i]);
      if (!items.empty()) painter->paint(items, opaque.depth[i], colours[i]);
    }
  });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return {};
}

}  // namespace strata::csg
