#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "csg/outline/extrude.h"
#include "csg/outline/roof.h"
#include "csg/outline/shadow.h"
#include "csg/scene/evaluator.h"
#include "csg/solids/boundary.h"
#include "csg/solids/hull.h"
#include "csg/solids/minkowski.h"
#include "csg/solids/primitives.h"
#include "strata/mesh/soup_tools.h"

namespace strata::csg {
/// Replaces the operands of a node that has a frame by the node's result, placed outside that
/// frame.
void Evaluator::operate(Frame& frame) {
  replace_operands(frame);
  job_ended(frame.node);
}

void Evaluator::replace_operands(Frame& frame) {
  leftovers_ = true;
  const bool takes_flat = frame.kind == NodeKind::kLinearExtrude ||
                          frame.kind == NodeKind::kRotateExtrude ||
                          frame.kind == NodeKind::kOffset || frame.kind == NodeKind::kFill ||
                          frame.kind == NodeKind::kRoof;
  const bool takes_solid = frame.kind == NodeKind::kProjection;
  if (operands_.size() == frame.base) {
    // The deprecated form names a file and has no children.
    const std::string file = arguments(frame.node).find("file").string();
    if (file.empty() || !(takes_flat || takes_solid)) return;
    import(frame.node, frame.inside);
    if (operands_.size() == frame.base) return;
    frame.dimension = operands_[frame.base].flat ? Dimension::kFlat : Dimension::kSolid;
  }
  const bool flat = frame.dimension == Dimension::kFlat;
  if ((flat && takes_solid) || (!flat && takes_flat)) {
    warn(frame.node, "ignored",
         fmt::format("'{}' takes {} children; the {} ones are left out", name(frame.node),
                     takes_flat ? "flat" : "solid", flat ? "flat" : "solid"));
    operands_.resize(frame.base);
    return;
  }
  switch (frame.kind) {
    case NodeKind::kLinearExtrude:
      return linear_extrude(frame);
    case NodeKind::kRotateExtrude:
      return rotate_extrude(frame);
    case NodeKind::kProjection:
      return projection(frame);
    case NodeKind::kHull:
      return flat ? flat_operation(frame) : hull(frame);
    case NodeKind::kMinkowski:
      return flat ? flat_operation(frame) : minkowski(frame);
    case NodeKind::kResize:
      return flat ? flat_operation(frame) : resize(frame);
    default:
      return flat_operation(frame);
  }
}

Outline Evaluator::united(std::size_t base) {
  std::vector<Outline> outlines;
  for (std::size_t i = base; i < operands_.size(); ++i) {
    outlines.push_back(std::move(operands_[i].outline));
  }
  operands_.resize(base);
  return outlines.size() == 1 ? std::move(outlines[0]) : unite(outlines, &job_);
}

Tree::NodeId Evaluator::united_solid(std::size_t base) {
  std::vector<Tree::NodeId> nodes;
  for (std::size_t i = base; i < operands_.size(); ++i) nodes.push_back(operands_[i].solid);
  operands_.resize(base);
  return nodes.size() == 1 ? nodes[0] : scene_.tree.add(Operation::kUnion, nodes);
}

TriangleSoup Evaluator::boundary_mesh(std::uint32_t node, Tree::NodeId solid) {
  auto mesh = boundary(scene_.tree, solid, execution_);
  if (mesh) return *std::move(mesh);
  if (mesh.error().code == ErrorCode::kCancelled) {
    stop(mesh.error().code, node, mesh.error().message);
    return {};
  }
  // Where the boundary cannot be computed, subtracted and intersected operands are ignored. The
  // result is too large then, but stays in the box of the first operands.
  TriangleSoup all;
  std::vector<Tree::NodeId> waiting{solid};
  while (!waiting.empty()) {
    const Tree::NodeId at = waiting.back();
    waiting.pop_back();
    const Tree::Node& entry = scene_.tree.nodes()[at];
    if (entry.operation == Operation::kSolid) {
      append(all, world_mesh(scene_.tree.solids()[entry.first]));
      continue;
    }
    const auto operands = scene_.tree.operands(at);
    const std::size_t count = entry.operation == Operation::kUnion
                                  ? operands.size()
                                  : std::min<std::size_t>(operands.size(), 1);
    waiting.insert(waiting.end(), operands.begin(),
                   operands.begin() + static_cast<std::ptrdiff_t>(count));
  }
  const Bounds exact = bounds(scene_.tree, solid), taken = bounds(all);
  const glm::dvec3 size = exact.empty() ? glm::dvec3(0.0) : exact.high - exact.low;
  warn(node, "approximate",
       fmt::format(
           "'{}': {}; only the first operands of differences and intersections are used: "
           "their box is {:.6g} x {:.6g} x {:.6g}, the box of the result is {:.6g} x {:.6g} x "
           "{:.6g}",
           name(node), mesh.error().message, taken.high.x - taken.low.x, taken.high.y - taken.low.y,
           taken.high.z - taken.low.z, size.x, size.y, size.z));
  return all;
}

void Evaluator::hull(Frame& frame) {
  const TriangleSoup mesh = boundary_mesh(frame.node, united_solid(frame.base));
  if (error_ || mesh.positions.empty()) return;
  const auto points = static_cast<double>(mesh.positions.size());
  if (!fits(frame.node, fmt::format("{} points", mesh.positions.size()), 2.0 * points,
            Made::kTriangles)) {
    return;
  }
  auto hull = convex_hull(mesh.positions, execution_.stop);
  if (!hull) return leave_out(frame.node, "geometry", hull.error(), "the hull is left out");
  add_solid(frame.node, frame.outside, *std::move(hull));
}

void Evaluator::minkowski(Frame& frame) {
  // One operand for each child that is not empty.
  std::vector<std::vector<Tree::NodeId>> children;
  for (std::size_t i = frame.base; i < operands_.size(); ++i) {
    if (i == frame.base || operands_[i].child != operands_[i - 1].child) children.emplace_back();
    children.back().push_back(operands_[i].solid);
  }
  operands_.resize(frame.base);
  std::vector<Tree::NodeId> sources;  // the solid of each operand, for its parts
  std::vector<std::vector<MinkowskiPart>> operands;
  for (const std::vector<Tree::NodeId>& child : children) {
    std::vector<MinkowskiPart> parts;
    for (const Tree::NodeId id : child) {
      for_each_operand(scene_.tree, id, [&](Tree::NodeId operand) {
        if (error_) return;
        const TriangleSoup mesh = boundary_mesh(frame.node, operand);
        if (error_) return;
        auto part = make_part(mesh, static_cast<std::uint32_t>(sources.size()), execution_);
        if (!part) return stop(part.error().code, frame.node, part.error().message);
        sources.push_back(operand);
        if (!part->empty()) parts.push_back(*std::move(part));
      });
    }
    if (error_) return;
    if (!parts.empty()) operands.push_back(std::move(parts));  // empty operands are ignored
  }
  if (operands.empty()) return;
  // Operands commute. The convex ones come first, so that their sum stays a single part.
  std::stable_partition(operands.begin(), operands.end(),
                        [](const auto& parts) { return parts.size() == 1 && parts[0].convex(); });
  std::vector<MinkowskiPart> sum = std::move(operands[0]);
  for (std::size_t i = 1; i < operands.size(); ++i) {
    auto next = minkowski_sum(sum, operands[i], i + 1 < operands.size(), part_execution(frame));
    if (!next) {
      return stop(next.error().code, frame.node,
                  next.error().code == ErrorCode::kCancelled
                      ? next.error().message
                      : fmt::format("'minkowski': {}", next.error().message));
    }
    sum = *std::move(next);
  }
  add_sum(frame, std::move(sum), sources);
}

/// Adds the parts of a sum as united solids. Very many convex parts become one mesh that overlaps
/// itself. Its pieces share edges, which readers of meshes would report as faults.
void Evaluator::add_sum(const Frame& frame, std::vector<MinkowskiPart> sum,
                        std::span<const Tree::NodeId> sources) {
  constexpr std::ptrdiff_t kMostSolids = 4096;
  const bool apart = std::count_if(sum.begin(), sum.end(),
                                   [](const auto& part) { return part.convex(); }) <= kMostSolids;
  TriangleSoup all;
  if (!apart) {
    std::size_t vertices = 0, triangles = 0;
    for (const MinkowskiPart& part : sum) {
      vertices += part.hull.mesh.positions.size();
      triangles += part.hull.mesh.triangles.size();
    }
    all.positions.reserve(vertices);
    all.triangles.reserve(triangles);
  }
  const std::size_t first_piece = scene_.tree.solids().size();
  for (MinkowskiPart& part : sum) {
    if (apart) {
      add_solid(frame.node, frame.outside, std::move(part.hull.mesh));
    } else {
      append(all, part.hull.mesh);
    }
    part.hull = {};
  }
  add_solid(frame.node, frame.outside, std::move(all));
  Bounds box;
  for (const Solid& piece : scene_.tree.solids().subspan(first_piece)) box.include(bounds(piece));
  for (const MinkowskiPart& part : sum) {
    if (part.convex()) continue;
    const glm::dmat4 world = frame.outside.world * glm::translate(glm::dmat4(1.0), part.offset);
    const Tree::NodeId source = sources[part.source];
    Operand operand;
    operand.node = frame.node;
    const std::size_t first = scene_.tree.solids().size();
    operand.solid = scene_.tree.append(scene_.tree, source, world);
    // The part lies inside the others, but the box of its operands may be larger.
    const Bounds reach = bounds(scene_.tree, operand.solid);
    if (!box.empty() &&
        !(glm::min(reach.low, box.low) == box.low && glm::max(reach.high, box.high) == box.high)) {
      Solid frame_box;
      frame_box.mesh = std::make_shared<const TriangleSoup>(make_cube(box.high - box.low, false));
      frame_box.world_from_mesh = glm::translate(glm::dmat4(1.0), box.low);
      operand.solid = scene_.tree.add(Operation::kIntersection,
                                      {operand.solid, scene_.tree.add_solid(std::move(frame_box))});
    }
    for (Solid& solid : scene_.tree.solids().subspan(first)) {
      solid.colour = frame.outside.colour;
      solid.name = fmt::format("{} at {}", name(frame.node), place(frame.node));
    }
    operands_.push_back(std::move(operand));
  }
}

void Evaluator::resize(Frame& frame) {
  const NodeArguments given = arguments(frame.node);
  double size[3] = {0.0, 0.0, 0.0};
  read_new_size(frame.node, size);
  bool follow[3] = {false, false, false};
  const ValueRef automatic = given.find("auto", 1);
  if (automatic.is_list()) {
    int axis = 0;
    for (const ValueRef value : automatic) {
      if (axis < 3) follow[axis++] = value.truth(false);
    }
  } else {
    for (bool& axis : follow) axis = automatic.truth(false);
  }
  const Tree::NodeId child = united_solid(frame.base);
  Operand operand;
  operand.node = frame.node;
  glm::dvec3 scale(1.0);
  if (size[0] != 0.0 || size[1] != 0.0 || size[2] != 0.0) {
    const Bounds box = bounds(boundary_mesh(frame.node, child));
    if (error_ || box.empty()) return;
    const glm::dvec3 old = box.high - box.low;
    int largest = 0;
    for (int i = 0; i < 3; ++i) {
      if (size[i] == 0.0) continue;
      scale[i] = size[i] / old[i];
      if (size[i] > size[largest]) largest = i;
    }
    const double shared = size[largest] != 0.0 ? size[largest] / old[largest] : 1.0;
    for (int i = 0; i < 3; ++i) {
      if (follow[i] && size[i] == 0.0) scale[i] = shared;
    }
    if (!std::isfinite(scale.x) || !std::isfinite(scale.y) || !std::isfinite(scale.z)) {
      warn(frame.node, "geometry",
           "'resize' would scale a flat object along an axis without extent; its size is kept");
      scale = glm::dvec3(1.0);
    }
  }
  const glm::dmat4 world = frame.outside.world * glm::scale(glm::dmat4(1.0), scale);
  operand.solid = scene_.tree.append(scene_.tree, child, world);
  operands_.push_back(std::move(operand));
}

void Evaluator::projection(Frame& frame) {
  const Tree::NodeId child = united_solid(frame.base);
  const NodeArguments given = arguments(frame.node);
  if (given.find("cut", 0).truth(false)) {
    add_outline(frame.node, frame.outside, cross_section(scene_.tree, child, &job_));
  } else {
    add_outline(frame.node, frame.outside, shadow(boundary_mesh(frame.node, child), &job_));
  }
}

void Evaluator::linear_extrude(Frame& frame) {
  const Outline outline = united(frame.base);
  const NodeArguments given = arguments(frame.node);
  LinearExtrude options;
  double direction[3] = {0.0, 0.0, 1.0};
  const bool slanted = given.find("v").numbers(direction, 3) == 3;
  const glm::dvec3 v(direction[0], direction[1], direction[2]);
  const double length = std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
  if (slanted && length > 0.0 && std::isfinite(length)) options.direction = v / length;
  options.height =
      number(frame.node, "height", given.find("height", 0), slanted ? length : options.height);
  options.centre = given.truth("center", false);
  options.twist = number(frame.node, "twist", 0.0);
  const ValueRef scale = given.find("scale");
  double both[2];
  if (scale.numbers(both, 2) < 2) both[0] = both[1] = number(frame.node, "scale", scale, 1.0);
  options.scale = {std::max(both[0], 0.0), std::max(both[1], 0.0)};
  const auto whole = [](double value, double most) {
    return static_cast<int>(std::isfinite(value) ? std::clamp(value, 0.0, most) : 0.0);
  };
  options.slices = whole(number(frame.node, "slices", 0.0), 2e9);
  options.outline_segments = whole(number(frame.node, "segments", 0.0), 1e6);
  options.divide_outline = newer_;
  options.segments = segments(frame.node);
  if (!is_length(frame.node, "the height", options.height)) return;
  if (!std::isfinite(options.twist) || !std::isfinite(options.scale.x) ||
      !std::isfinite(options.scale.y)) {
    return warn(frame.node, "geometry",
                fmt::format("'linear_extrude' with twist {:g}, scale [{:g}, {:g}], which must be "
                            "finite; it is left out",
                            options.twist, options.scale.x, options.scale.y));
  }
  const ExtrusionSize size = size_of(outline, options);
  const std::string of = fmt::format("{:g} slices (twist {:g}, $fn {:g})", size.steps,
                                     options.twist, options.segments.fn);
  if (!fits(frame.node, of, size.triangles, Made::kTriangles)) return;
  TriangleSoup mesh = csg::linear_extrude(outline, options, &job_);
  if (job_ended(frame.node)) return;
  add_solid(frame.node, frame.outside, std::move(mesh));
}

void Evaluator::rotate_extrude(Frame& frame) {
  const Outline outline = united(frame.base);
  const NodeArguments given = arguments(frame.node);
  RotateExtrude options;
  options.angle = number(frame.node, "angle", given.find("angle", 0), options.angle);
  if (!std::isfinite(options.angle)) {
    warn(frame.node, "geometry",
         fmt::format("'rotate_extrude': angle is {:g}, not finite; 360 is used", options.angle));
    options.angle = 360.0;
  }
  const bool full = std::abs(options.angle) >= 360.0;
  options.start = given.number("start", full ? 180.0 : 0.0);
  options.round_up = newer_;
  options.segments = segments(frame.node);
  const ExtrusionSize size = size_of(outline, options);
  if (!fits(frame.node, fmt::format("{:g} steps", size.steps), size.triangles, Made::kTriangles)) {
    return;
  }
  auto mesh = csg::rotate_extrude(outline, options, &job_);
  if (!mesh) {
    return leave_out(frame.node, "geometry", mesh.error(), "the 'rotate_extrude' is left out");
  }
  add_solid(frame.node, frame.outside, *std::move(mesh));
}

/// The Minkowski sum of the children's regions.
void Evaluator::flat_minkowski(Frame& frame) {
  std::vector<Outline> operands;
  while (operands_.size() > frame.base) {
    std::size_t first = operands_.size() - 1;
    while (first > frame.base && operands_[first - 1].child == operands_.back().child) --first;
    operands.push_back(united(first));
  }
  std::reverse(operands.begin(), operands.end());
  if (operands.empty()) return;
  add_outline(frame.node, frame.outside,
              operands.size() == 1 ? std::move(operands[0]) : minkowski_sum(operands, &job_));
}

void Evaluator::flat_resize(Frame& frame, const Outline& outline) {
  double size[2] = {0.0, 0.0};
  read_new_size(frame.node, size);
  const ValueRef automatic = arguments(frame.node).find("auto", 1);
  bool follow[2] = {automatic.truth(false), automatic.truth(false)};
  int axis = 0;
  for (const ValueRef value : automatic) {
    if (axis < 2) follow[axis++] = value.truth(false);
  }
  add_outline(frame.node, frame.outside, csg::resize(outline, {size[0], size[1]}, follow));
}

void Evaluator::offset(Frame& frame, const Outline& outline) {
  const NodeArguments given = arguments(frame.node);
  const ValueRef delta = given.find("delta");
  const double by = number(frame.node, delta.is_number() ? "delta" : "r",
                           delta.is_number() ? delta : given.find("r", 0), 1.0);
  if (!(std::abs(by) < kMostCoordinate)) {
    return warn(frame.node, "geometry",
                fmt::format("'offset' by {:g}, which must be less than {:g}; it is left out", by,
                            kMostCoordinate));
  }
  if (delta.is_number()) {
    return add_outline(frame.node, frame.outside,
                       offset_delta(outline, by, given.truth("chamfer", false), &job_));
  }
  const Segments round = segments(frame.node);
  const double points = offset_point_count(outline, by, round);
  if (!fits(frame.node, fmt::format("{} segments", round.count(std::abs(by))), points,
            Made::kPoints)) {
    return;
  }
  add_outline(frame.node, frame.outside, offset_round(outline, by, round, &job_));
}

/// Runs nodes that make flat regions, or roofs of flat regions.
void Evaluator::flat_operation(Frame& frame) {
  if (frame.kind == NodeKind::kMinkowski) return flat_minkowski(frame);
  Outline outline = united(frame.base);
  switch (frame.kind) {
    case NodeKind::kHull:
      return add_outline(frame.node, frame.outside, convex_hull({&outline, 1}));
    case NodeKind::kFill:
      return add_outline(frame.node, frame.outside, without_holes(outline, &job_));
    case NodeKind::kResize:
      return flat_resize(frame, outline);
    case NodeKind::kOffset:
      return offset(frame, outline);
    case NodeKind::kRoof: {
      auto roof = make_roof(outline, arguments(frame.node).find("method", 0).string("voronoi"),
                            segments(frame.node));
      if (!roof) return leave_out(frame.node, "not-done", roof.error(), "the roof is left out");
      return add_solid(frame.node, frame.outside, *std::move(roof));
    }
    default:
      return add_outline(frame.node, frame.outside, std::move(outline));
  }
}

}  // namespace strata::csg
