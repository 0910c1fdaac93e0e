#include "csg/surface/visible_surface.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numeric>
#include <utility>

namespace strata::csg {
namespace {

/// Lists up to this length are sorted by insertion: parts of them are in order. Longer ones are
/// sorted in time that grows with their length, byte by byte.
constexpr std::size_t kShort = 40;

bool goes_after(const Transition& a, const Transition& b) {
  return a.depth != b.depth ? a.depth > b.depth : a.solid > b.solid;
}

/// Sorts by the upper half, a byte at a time; what is equal stays in order.
void sort_by_bytes(std::vector<std::uint64_t>& keys, std::vector<std::uint64_t>& scratch) {
  constexpr std::size_t kBytes = 4;
  std::array<std::array<std::uint32_t, 256>, kBytes> begins{};
  for (const std::uint64_t key : keys) {
    for (std::size_t i = 0; i < kBytes; ++i) ++begins[i][key >> (32 + 8 * i) & 0xff];
  }
  scratch.resize(keys.size());
  for (std::size_t i = 0; i < kBytes; ++i) {
    const auto first_byte = keys.front() >> (32 + 8 * i) & 0xff;
    if (begins[i][first_byte] == keys.size()) continue;  // the top byte, mostly
    std::exclusive_scan(begins[i].begin(), begins[i].end(), begins[i].begin(), 0u);
    for (const std::uint64_t key : keys) scratch[begins[i][key >> (32 + 8 * i) & 0xff]++] = key;
    std::swap(keys, scratch);
  }
}

}  // namespace

Coincidence::Coincidence(const View& view, double world_error) : world_error_(world_error) {
  constexpr double kPixelPart = 0.1;
  const glm::dmat4 image_from_eye = view.image_from_world * glm::inverse(view.eye_from_world);
  const double scale = std::abs(image_from_eye[1][1]);  // pixels a world unit (at distance 1)
  if (view.perspective) {
    const double difference = 1.0 / view.near - 1.0 / view.far;
    a_ = 1.0 / view.near;
    b_ = difference / kPictureDepthLimit;
    const double steps = kPictureDepthLimit / difference;  // d(depth) = steps * d(1 / distance)
    flat_ = steps * world_error;
    // A pixel is distance / scale wide: steps / (scale * distance) depth steps, least far away.
    steep_from_ = 2.0 * kPixelPart * steps / (scale * view.far);
  } else {
    const double steps = kPictureDepthLimit / (view.far - view.near);
    flat_ = steps * world_error;
    steep_from_ = 2.0 * kPixelPart * steps / scale;
  }
}

Coincidence::Face Coincidence::face(const LatticeMesh& mesh, std::uint32_t triangle) {
  const glm::uvec3& t = mesh.triangles[triangle];
  const glm::ivec3 &p = mesh.vertices[t.x], &q = mesh.vertices[t.y], &r = mesh.vertices[t.z];
  TriangleSetup setup;
  if (!setup_triangle(p, q, r, AxisFrame(Axis::kZ), setup)) return {};
  const auto [low, high] = std::minmax({p.z, q.z, r.z});
  return {0.5 * setup.steepness(), static_cast<double>(low), static_cast<double>(high), true};
}

Coincidence::Range Coincidence::range() const {
  constexpr double kMore = 2.0 * 1.01;
  return {static_cast<float>(a_), static_cast<float>(b_),
          static_cast<float>(kMore * (1.5 + 0.5 * steep_from_) + 1.0),
          static_cast<float>(kMore * flat_)};
}

bool TransitionFaces::beneath(const Transition& below, const Transition& above) const {
  const auto corners = [&](const Transition& transition) {
    const Geometry::Part& part = (*parts_)[transition.solid];
    const glm::uvec3& t =
        part.triangles[(*view_parts_)[transition.solid].source(transition.triangle)];
    return std::array<glm::dvec3, 3>{part.positions[t.x], part.positions[t.y], part.positions[t.z]};
  };
  const auto of_above = corners(above), of_below = corners(below);
  const glm::dvec3 normal = glm::cross(of_above[1] - of_above[0], of_above[2] - of_above[0]);
  const double length = glm::length(normal);
  return std::all_of(of_below.begin(), of_below.end(), [&](const glm::dvec3& p) {
    const double rounding = 1e-10 * glm::length(p);
    return glm::dot(p - of_above[0], normal) <= (coincidence_->world_error() + rounding) * length;
  });
}

const Transition& FirstHit::choose(const TransitionFaces& faces) const {
  const auto first_of = [&](const auto& may) {
    const Candidate* best = nullptr;
    for (const Candidate& candidate : candidates_) {
      if (may(candidate) && (best == nullptr || goes_before(candidate, *best))) best = &candidate;
    }
    return best;
  };
  const Candidate* best = first_of([](const Candidate&) { return true; });
  // Of united solids the outermost face shows. Where solids are intersected, each is needed.
  if (candidates_.size() == 1 || best->transition->triangle == Surface::kNone ||
      (best->alone && !best->transition->exit)) {
    return *best->transition;
  }
  constexpr int kMostPlanes = 4;
  for (int i = 0; i < kMostPlanes; ++i) {
    const Candidate* above = first_of([&](const Candidate& candidate) {
      return candidate.alone == best->alone &&
             candidate.transition->exit == best->transition->exit &&
             candidate.transition->solid != best->transition->solid &&
             faces.ends_at(*best->transition, *candidate.transition);
    });
    if (above == nullptr) break;
    best = above;
  }
  return *best->transition;
}

FirstHit::Change FirstHit::find_change(const std::vector<Transition>& transitions,
                                       std::size_t begin, std::size_t end,
                                       const TransitionFaces& faces) {
  if (end - begin == 1) return {faces.bound(transitions[begin]), begin};
  toggled_.clear();
  for (std::size_t i = begin; i < end; ++i) {  // a solid that is cut may be entered and left there
    const std::uint32_t solid = transitions[i].solid;
    if (i == begin || solid != toggled_.back()) toggled_.push_back(solid);
  }
  state_.vary(toggled_);
  Change change{{}, end};
  for (std::size_t i = begin; i < end; ++i) {
    if (!state_.contributes(transitions[i].solid)) continue;
    const Coincidence::Bound one = faces.bound(transitions[i]);
    change.bound.nearer = std::max(change.bound.nearer, one.nearer);
    change.bound.farther = std::max(change.bound.farther, one.farther);
    change.first = std::min(change.first, i);
  }
  return change;
}

FirstHit::Interval FirstHit::walk_inside(const std::vector<Transition>& transitions,
                                         std::size_t begin, std::size_t at, double settles) {
  Interval interval;
  interval.begin = begin, interval.group_end = at;
  interval.settled = interval.exit_begin = interval.exit_end = at;
  const auto note_operands = [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      interval.union_operand = interval.union_operand || enters_union_operand(transitions[i]);
    }
  };
  note_operands(begin, at);
  while (interval.exit_end < transitions.size()) {
    interval.exit_begin = interval.exit_end;
    interval.exit_end = apply(transitions, interval.exit_end);
    if (!state_.value()) break;
    if (transitions[interval.exit_begin].depth <= settles) interval.settled = interval.exit_end;
    note_operands(interval.exit_begin, interval.exit_end);
  }
  return interval;
}

void FirstHit::list_candidates(const std::vector<Transition>& transitions, const Interval& interval,
                               const Coincidence::Bound& surface_bound,
                               const TransitionFaces& faces) {
  const std::uint32_t depth = transitions[interval.begin].depth;
  // Of one solid only its last transition counts, unless it has one in the group.
  for (std::size_t i = 0; i < interval.settled; ++i) last_[transitions[i].solid] = i;
  for (std::size_t i = interval.begin; i < interval.group_end; ++i) {
    last_[transitions[i].solid] = i;
  }
  candidates_.clear();
  toggled_.clear();
  for (std::size_t i = 0; i < interval.settled; ++i) {
    const Transition& transition = transitions[i];
    if (transition.triangle == Surface::kNone) continue;
    // What begins just behind the surface varies too: at the surface the ray is not in it yet.
    const bool settled = i >= interval.begin && last_[transition.solid] == i;
    if (settled) toggled_.push_back(transition.solid);
    if (state_.inside(transition.solid) == transition.exit) continue;
    const bool in_group = i >= interval.begin && i < interval.group_end;
    if (!in_group) {
      const Coincidence::Bound bound = faces.bound(transition);
      if (transition.depth < depth
              ? depth - transition.depth > surface_bound.nearer + bound.farther
              : transition.depth - depth > surface_bound.farther + bound.nearer) {
        continue;
      }
      if (last_[transition.solid] != i) continue;
    }
    candidates_.push_back({&transition, false});
    if (!settled && !in_group) toggled_.push_back(transition.solid);
  }
  keep_contributing();
}

void FirstHit::keep_contributing() {
  state_.vary(toggled_);
  std::erase_if(candidates_, [this](const Candidate& candidate) {
    return !state_.contributes(candidate.transition->solid);
  });
  for (Candidate& candidate : candidates_) {
    candidate.alone = state_.decides(candidate.transition->solid);
  }
}

Surface FirstHit::find(std::vector<Transition>& transitions, const TransitionFaces& faces) {
  sort(transitions);
  Surface found;
  std::size_t at = 0;
  while (at < transitions.size()) {
    const std::size_t begin = at;
    at = apply(transitions, at);
    if (!state_.value()) continue;
    const std::uint32_t depth = transitions[begin].depth;
    const auto [bound, first] = find_change(transitions, begin, at, faces);
    // On to where the interval ends. What lies within the bound of its beginning is settled with
    // it; that must not depend on transitions that do not matter.
    const Interval interval = walk_inside(transitions, begin, at, depth + 2.0 * bound.farther);
    const bool eye_inside = depth == 0 && transitions[first].triangle == Surface::kNone;
    if (!state_.value()) {
      const Change exit = find_change(transitions, interval.exit_begin, interval.exit_end, faces);
      const Transition& leaves = transitions[exit.first];
      if (eye_inside) found = surface_of(leaves, leaves.depth);
      if (!eye_inside && !interval.union_operand &&
          leaves.depth - depth <= bound.farther + exit.bound.nearer) {
        at = interval.exit_end;
        continue;
      }
    }
    if (eye_inside) {  // the far side shows, if there is one
      at = interval.exit_end;
      break;
    }
    toggle_all(transitions, interval.settled, interval.exit_end);
    list_candidates(transitions, interval, bound, faces);
    found = surface_of(candidates_.empty() ? transitions[first] : choose(faces), depth);
    at = interval.settled;
    break;
  }
  // Copying the state is a sixteenth of a transition's work for each solid and node.
  if (at * 16 > state_.program().nodes.size() + state_.program().leaves.size()) {
    state_.reset();
  } else {
    toggle_all(transitions, 0, at);
  }
  return found;
}

std::uint32_t FirstHit::find_outward(std::span<const Transition> transitions) {
  const std::size_t count = transitions.size(), sets = std::size_t{1} << count;
  values_.resize(sets);
  std::size_t set = 0;
  for (std::size_t i = 1; i <= sets; ++i) {  // by a Gray code: one transition from set to set
    values_[set] = state_.value() ? 1 : 0;
    const std::size_t next = i < sets ? static_cast<std::size_t>(std::countr_zero(i)) : count - 1;
    set ^= std::size_t{1} << next;
    state_.toggle(transitions[next].solid);
  }
  std::uint32_t outward = 0;
  for (set = 0; set < sets; ++set) {
    for (std::size_t i = 0; i < count; ++i) {
      if (values_[set] > values_[set | std::size_t{1} << i]) outward |= 1u << i;
    }
  }
  return outward;
}

FirstHit::Verdict FirstHit::judge(std::span<const std::uint32_t> inside,
                                  std::span<const Transition> coincident,
                                  const TransitionFaces& faces) {
  for (const std::uint32_t solid : inside) state_.toggle(solid);
  Verdict verdict;
  verdict.outward = find_outward(coincident);
  for (const Transition& transition : coincident) state_.toggle(transition.solid);
  verdict.inside = state_.value();
  if (verdict.inside) {
    candidates_.clear();
    toggled_.clear();
    for (const Transition& transition : coincident) {
      candidates_.push_back({&transition, false});
      toggled_.push_back(transition.solid);
    }
    keep_contributing();
    if (!candidates_.empty()) verdict.surface = surface_of(choose(faces), 0);
  }
  for (const Transition& transition : coincident) state_.toggle(transition.solid);
  for (const std::uint32_t solid : inside) state_.toggle(solid);
  return verdict;
}

void FirstHit::sort(std::vector<Transition>& transitions) {
  if (transitions.size() <= kShort) {
    for (auto next = transitions.begin(); next != transitions.end(); ++next) {
      const Transition moved = *next;
      auto to = next;
      for (; to != transitions.begin() && goes_after(to[-1], moved); --to) *to = to[-1];
      *to = moved;
    }
    return;
  }
  order_.clear();
  for (const Transition& transition : transitions) {
    order_.push_back(std::uint64_t{transition.depth} << 32 | order_.size());
  }
  sort_by_bytes(order_, other_order_);
  sorted_.clear();
  for (const std::uint64_t key : order_)
    sorted_.push_back(transitions[static_cast<std::uint32_t>(key)]);
  std::swap(transitions, sorted_);
  for (auto begin = transitions.begin(); begin != transitions.end();) {
    auto end = begin + 1;
    while (end != transitions.end() && end->depth == begin->depth) ++end;
    if (end - begin > 1) {
      std::stable_sort(begin, end,
                       [](const Transition& a, const Transition& b) { return a.solid < b.solid; });
    }
    begin = end;
  }
}

}  // namespace strata::csg
