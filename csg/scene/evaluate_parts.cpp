#include <algorithm>
#include <glm/gtc/matrix_inverse.hpp>
#include <glm/matrix.hpp>

#include "core/printable.h"
#include "csg/scene/evaluator.h"
#include "strata/mesh/diagnose.h"
#include "strata/mesh/orient.h"
#include "strata/mesh/soup_tools.h"

namespace strata::csg {
namespace {

constexpr std::size_t kMostWarnings = 1000;

/// Longest text of the scene that a message quotes, in characters.
constexpr std::size_t kMostText = 600;

}  // namespace

std::string Evaluator::place(std::uint32_t node) const {
  return node < ast_.nodes.size() ? ast_.place(ast_.nodes[node].offset) : ast_.name;
}

std::string_view Evaluator::name(std::uint32_t node) const {
  return node < ast_.nodes.size() ? ast_.nodes[node].name : "scene";
}

void Evaluator::warn(std::uint32_t node, std::string code, std::string_view text) {
  if (scene_.warnings.size() >= kMostWarnings) {
    ++warnings_left_out_;
    return;
  }
  scene_.warnings.push_back(
      {std::move(code), fmt::format("{}: {}", place(node), printable(text, kMostText))});
}

void Evaluator::stop(ErrorCode code, std::uint32_t node, std::string_view text) {
  if (error_) return;
  const std::string shown = printable(text, kMostText);
  error_ = {code,
            code == ErrorCode::kCancelled ? shown : fmt::format("{}: {}", place(node), shown)};
}

bool Evaluator::fits(std::uint32_t node, std::string_view of, double count, Made made) {
  // A triangle counts with its half of a vertex, once in the mesh and once in the code that shows
  // it. A point of an outline counts with its edges in Clipper.
  const bool flat = made == Made::kPoints;
  const double each = flat ? 200.0 : 64.0, most = flat ? 20e6 : 100e6;
  const std::string_view unit = flat ? "points" : "triangles";
  const double bytes = count * each;
  if (!(count <= most)) {
    stop(ErrorCode::kLimit, node,
         fmt::format("'{}' of {} would have {:.3g} {}; the limit is {:g}", name(node), of, count,
                     unit, most));
    return false;
  }
  if (execution_.memory_limit > 0 &&
      made_bytes_ + bytes > static_cast<double>(execution_.memory_limit)) {
    stop(ErrorCode::kLimit, node,
         fmt::format("'{}' of {} would have {:.3g} {}; with the scene so far they need about "
                     "{:.3g} GB, but the memory limit is {:.3g} GB",
                     name(node), of, count, unit, (made_bytes_ + bytes) / 1e9,
                     static_cast<double>(execution_.memory_limit) / 1e9));
    return false;
  }
  if (!flat) made_bytes_ += bytes;
  return true;
}

void Evaluator::leave_out(std::uint32_t node, std::string code, const Error& error,
                          std::string_view what) {
  if (error.code == ErrorCode::kLimit || error.code == ErrorCode::kCancelled) {
    return stop(error.code, node, error.message);
  }
  warn(node, std::move(code), fmt::format("{}; {}", error.message, what));
}

bool Evaluator::job_ended(std::uint32_t node) {
  if (job_.ended()) stop(job_.error->code, node, job_.error->message);
  return job_.error.has_value();
}

void Evaluator::add_solid(std::uint32_t node, const Context& context, TriangleSoup mesh,
                          InsideRule rule) {
  if (mesh.triangles.empty()) return;
  add_solid(node, context, std::make_shared<const TriangleSoup>(std::move(mesh)), rule);
}

void Evaluator::add_solid(std::uint32_t node, const Context& context,
                          std::shared_ptr<const TriangleSoup> mesh, InsideRule rule) {
  if (!mesh || mesh->triangles.empty()) return;
  if (!context.keep_flattened && glm::determinant(glm::dmat3(context.world)) == 0.0) {
    warn(node, "geometry",
         fmt::format("'{}' is scaled by 0 and has no volume; it is left out", name(node)));
    return;
  }
  Solid solid;
  solid.mesh = std::move(mesh);
  solid.world_from_mesh = context.world;
  solid.colour = context.colour;
  solid.rule = rule;
  solid.name = fmt::format("{} at {}", name(node), place(node));
  Operand operand;
  operand.node = node;
  operand.solid = scene_.tree.add_solid(std::move(solid));
  operands_.push_back(std::move(operand));
}

void Evaluator::add_outline(std::uint32_t node, const Context& context, Outline outline) {
  if (outline.empty()) return;
  Operand operand;
  if (context.plane == glm::dmat3(1.0)) {
    operand.outline = std::move(outline);
  } else {
    if (glm::determinant(glm::dmat2(context.plane)) == 0.0) {
      warn(node, "geometry",
           fmt::format("'{}' is scaled by 0 and has no area; it is left out", name(node)));
      return;
    }
    operand.outline = transform(outline, context.plane);
  }
  const glm::dmat3& p = context.plane;
  const glm::dmat4 plane(glm::dvec4(p[0].x, p[0].y, 0, 0), glm::dvec4(p[1].x, p[1].y, 0, 0),
                         glm::dvec4(0, 0, 1, 0), glm::dvec4(p[2].x, p[2].y, 0, 1));
  if (context.world != plane) operand.place = context.world * glm::inverse(plane);
  operand.flat = true;
  operand.node = node;
  operand.colour = context.colour;
  operands_.push_back(std::move(operand));
}

InsideRule Evaluator::inspect(std::uint32_t node, TriangleSoup& mesh) {
  Execution execution = execution_;
  execution.progress = {};
  const double volume = signed_volume(mesh, execution);
  const Orientation turned = orient_parts(mesh, execution);
  for (const std::string& text : sentences(turned, true)) {
    warn(node, "geometry", fmt::format("'{}': {}", name(node), text));
  }
  if (!turned.closed) {
    const MeshDiagnosis found = diagnose(mesh, execution);
    std::string text = fmt::format("'{}' is not closed: {} of {} edges are unbalanced", name(node),
                                   found.unbalanced_edges, found.edges);
    if (found.boundary_edges > 0) text += fmt::format(", {} border a hole", found.boundary_edges);
    if (found.misoriented_edges > 0) {
      text += fmt::format(", {} join faces of opposite orientation", found.misoriented_edges);
    }
    if (!found.examples.empty()) {
      const UnbalancedEdge& edge = found.examples.front();
      text += fmt::format("; the first from ({:.9g}, {:.9g}, {:.9g}) to ({:.9g}, {:.9g}, {:.9g})",
                          edge.from.x, edge.from.y, edge.from.z, edge.to.x, edge.to.y, edge.to.z);
    }
    text += found.even
                ? "; every edge is used an even number of times, so parity decides what is inside"
                : "; parity decides what is inside, and a face without a partner is a sheet";
    warn(node, "geometry", text);
    return InsideRule::kParity;
  }
  if (turned.all_turned && turned.turned_parts > 0) {
    warn(node, "geometry",
         fmt::format("'{}' is inside out (its volume is {:.6g}); it was reversed", name(node),
                     volume));
  }
  return InsideRule::kWinding;
}

}  // namespace strata::csg
