#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "csg/surface/visible_surface.h"
#include "csg/transition.h"

// What rays show where faces of several solids coincide, decided once for all rays that meet the
// same faces there. Private to csg/.

namespace strata::csg {

/// Transitions of a ray, of different solids, that are close to each other. The order of such
/// transitions changes from pixel to pixel, and FirstHit finds the same in each order if they are
/// close enough: they all count as one face.
struct Cluster {
  std::vector<std::uint32_t> inside;  ///< solids that the ray is in before
  std::vector<Transition> members;    ///< without depths
  enum class Outcome : std::uint8_t {
    kShown,    ///< `surface`, where the first depth is at which the ray is in the tree
    kPassed,   ///< the ray is not in the tree behind them: there is nothing
    kByOrder,  ///< that depends
  } outcome = Outcome::kByOrder;
  Surface surface;
  std::uint32_t outward = 0;             ///< of members, a bit each: FirstHit::Verdict has it
  std::vector<Coincidence::Face> faces;  ///< of members
  std::vector<double> shares;            ///< of members, TransitionFaces::share()

  /// How far apart two members may be that lie between two depths and coincide in any case, in
  /// depth steps.
  [[nodiscard]] std::uint32_t width(const Coincidence& coincidence, std::uint32_t from,
                                    std::uint32_t to) const;
};

/// The clusters that were met. Scratch of one thread.
class Clusters {
 public:
  static constexpr std::size_t kMostMembers = FirstHit::kMostJudged;

  /// Forgets all of them: faces are those of another view.
  void clear();
  /// @param members  1 to kMostMembers, of different solids
  const Cluster& find(std::span<const std::uint32_t> inside, std::span<const Transition> members,
                      FirstHit& first_hit, const TransitionFaces& faces);

 private:
  std::array<Cluster, 64> kept_;
};

}  // namespace strata::csg
