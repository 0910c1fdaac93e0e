#include "csg/surface/clusters.h"

#include <algorithm>

namespace strata::csg {
namespace {

bool same_face(const Transition& a, const Transition& b) {
  return a.solid == b.solid && a.triangle == b.triangle && a.exit == b.exit;
}

std::size_t hash_of(std::span<const std::uint32_t> inside, std::span<const Transition> members) {
  std::uint32_t hash = 0;
  for (const std::uint32_t solid : inside) hash = hash * 31 + solid;
  for (const Transition& member : members) hash = hash * 31 + member.solid * 17 + member.triangle;
  return hash;
}

/// What comes of the members.
void decide(Cluster& cluster, FirstHit& first_hit, const TransitionFaces& faces) {
  const FirstHit::Verdict verdict = first_hit.judge(cluster.inside, cluster.members, faces);
  cluster.surface = verdict.surface;
  cluster.outcome = !verdict.inside                           ? Cluster::Outcome::kPassed
                    : verdict.surface.solid != Surface::kNone ? Cluster::Outcome::kShown
                                                              : Cluster::Outcome::kByOrder;
  cluster.outward = verdict.outward;
  cluster.faces.clear();
  cluster.shares.clear();
  for (const Transition& member : cluster.members) {
    cluster.faces.push_back(faces.face(member));
    cluster.shares.push_back(faces.share(member));
  }
}

}  // namespace

std::uint32_t Cluster::width(const Coincidence& coincidence, std::uint32_t from,
                             std::uint32_t to) const {
  double least = kPictureDepthLimit;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const Coincidence::Bound bound = coincidence.bound(faces[i], from, to, shares[i]);
    least = std::min({least, bound.nearer, bound.farther});
  }
  return static_cast<std::uint32_t>(2.0 * least);
}

void Clusters::clear() {
  for (Cluster& cluster : kept_) cluster.members.clear();
}

const Cluster& Clusters::find(std::span<const std::uint32_t> inside,
                              std::span<const Transition> members, FirstHit& first_hit,
                              const TransitionFaces& faces) {
  Cluster& kept = kept_[hash_of(inside, members) % kept_.size()];
  if (std::ranges::equal(kept.members, members, same_face) &&
      std::ranges::equal(kept.inside, inside)) {
    return kept;
  }
  kept.inside.assign(inside.begin(), inside.end());
  kept.members.assign(members.begin(), members.end());
  decide(kept, first_hit, faces);
  return kept;
}

}  // namespace strata::csg
