#include "mesh/check/self_meetings.h"

#include <algorithm>
#include <glm/common.hpp>

#include "mesh/check/box_pairs.h"
#include "mesh/check/plain_stars.h"

namespace strata {
namespace {

using exact::FilePoint;

// From 2^53 to what an int32 holds.
constexpr int kBoxShift = 23;

std::vector<LatticeBox> boxes_of(std::span<const FilePoint> points,
                                 std::span<const glm::uvec3> triangles,
                                 const Execution& execution) {
  std::vector<LatticeBox> boxes(triangles.size());
  constexpr std::size_t kBlock = std::size_t{1} << 14;
  parallel_for(execution, (triangles.size() + kBlock - 1) / kBlock, [&](std::size_t block, int) {
    const std::size_t end = std::min(triangles.size(), (block + 1) * kBlock);
    for (std::size_t i = block * kBlock; i < end; ++i) {
      const glm::uvec3& t = triangles[i];
      const FilePoint &a = points[t.x], &b = points[t.y], &c = points[t.z];
      boxes[i] = {glm::ivec3(glm::min(a, glm::min(b, c)) >> FilePoint(kBoxShift)),
                  glm::ivec3(glm::max(a, glm::max(b, c)) >> FilePoint(kBoxShift))};
    }
  });
  return boxes;
}

class Tester {
 public:
  // `plain` is of plain_stars(), or empty.
  Tester(std::span<const FilePoint> points, std::span<const glm::uvec3> triangles,
         std::span<const std::uint8_t> plain, std::size_t most, int threads)
      : points_(points),
        triangles_(triangles),
        plain_(plain),
        most_(most),
        found_(static_cast<std::size_t>(threads)) {}

  void test(std::span<const BoxPair> pairs, int worker) {
    SelfMeetings& found = found_[static_cast<std::size_t>(worker)];
    for (const BoxPair& pair : pairs) {
      if (in_plain_star(triangles_[pair.first], triangles_[pair.second])) continue;
      const Meeting meeting = triangles_meet(corners(pair.first), corners(pair.second));
      if (is_clean(meeting)) continue;
      found.touching += meeting == Meeting::kTouch;
      found.crossing += meeting == Meeting::kCross;
      found.overlapping += meeting == Meeting::kOverlap;
      keep({pair.first, pair.second, meeting}, found.first);
    }
  }

  SelfMeetings result() {
    SelfMeetings all;
    for (const SelfMeetings& found : found_) {
      all.touching += found.touching;
      all.crossing += found.crossing;
      all.overlapping += found.overlapping;
      for (const SelfMeetings::Pair& pair : found.first) keep(pair, all.first);
    }
    return all;
  }

 private:
  [[nodiscard]] bool in_plain_star(const glm::uvec3& s, const glm::uvec3& t) const {
    if (plain_.empty()) return false;
    for (int k = 0; k < 3; ++k) {
      if ((s[k] == t.x || s[k] == t.y || s[k] == t.z) && plain_[s[k]] != 0) return true;
    }
    return false;
  }

  [[nodiscard]] TriangleCorners corners(std::uint32_t t) const {
    const glm::uvec3& at = triangles_[t];
    return {points_[at.x], points_[at.y], points_[at.z]};
  }

  void keep(const SelfMeetings::Pair& pair, std::vector<SelfMeetings::Pair>& first) const {
    if (first.size() == most_ && (first.empty() || first.back() < pair)) return;
    first.insert(std::ranges::upper_bound(first, pair), pair);
    if (first.size() > most_) first.pop_back();
  }

  std::span<const FilePoint> points_;
  std::span<const glm::uvec3> triangles_;
  std::span<const std::uint8_t> plain_;
  std::size_t most_;
  std::vector<SelfMeetings> found_;  // of each worker
};

}  // namespace

Result<SelfMeetings> find_self_meetings(std::span<const FilePoint> points,
                                        std::span<const glm::uvec3> triangles, bool closed,
                                        std::size_t most, const Execution& execution) {
  const std::vector<LatticeBox> boxes = boxes_of(points, triangles, execution);
  std::vector<std::uint8_t> plain;
  if (closed && exact::kFilters) plain = plain_stars(points, triangles, execution);
  Tester tester(points, triangles, plain, most, execution.thread_count());
  const auto done = for_box_pairs(
      boxes, {}, [&](std::span<const BoxPair> pairs, int worker) { tester.test(pairs, worker); },
      execution);
  if (!done) return tl::unexpected(done.error());
  return tester.result();
}

}  // namespace strata
