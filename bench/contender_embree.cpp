#include <embree3/rtcore.h>
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/vec2.hpp>
#include <utility>
#include <vector>

#include "bench/contenders.h"
#include "strata/voxelize/intervals.h"

namespace strata::bench {
namespace {

constexpr int kMaxPacket = 16;

/// Intervals of the columns of one row.
struct Row {
  std::vector<std::uint32_t> offsets;
  std::vector<Interval> items;
};

class RowSet : public VoxelSet {
 public:
  explicit RowSet(std::size_t count) : rows(count) {}
  [[nodiscard]] std::uint64_t solid_voxels() const override {
    std::uint64_t count = 0;
    for (const Row& row : rows) {
      for (const Interval& interval : row.items) {
        count += static_cast<std::uint64_t>(interval.length());
      }
    }
    return count;
  }
  std::vector<Row> rows;
};

/// What the filter function sees; Embree hands the base class through.
struct Hits : RTCIntersectContext {
  /// By ray: the bits of the distance, which sort like distances, and whether the ray leaves.
  /// [distance:31 | exit:1]
  std::array<std::vector<std::uint32_t>, kMaxPacket> lists;
};

/// Notes a hit and rejects it, so that the traversal goes on.
void collect(const RTCFilterFunctionNArguments* arguments) {
  Hits& hits = *static_cast<Hits*>(arguments->context);
  const unsigned n = arguments->N;
  for (unsigned i = 0; i < n; ++i) {
    if (arguments->valid[i] != -1) continue;
    arguments->valid[i] = 0;
    const bool exit = RTCHitN_Ng_z(arguments->hit, n, i) > 0;
    const auto distance = std::bit_cast<std::uint32_t>(RTCRayN_tfar(arguments->ray, n, i));
    hits.lists[RTCRayN_id(arguments->ray, n, i)].push_back(distance << 1 |
                                                           static_cast<std::uint32_t>(exit));
  }
}

constexpr float kBehind = 1.0F;  // rays start this many voxels before the first centre

/// Sorts the hits of a ray and appends the runs of centres between entering and leaving. A hit
/// that repeats (rays that pass exactly through an edge hit both triangles) changes nothing.
void append_intervals(std::vector<std::uint32_t>& hits, int depth, std::vector<Interval>& out) {
  for (std::size_t i = 1; i < hits.size(); ++i) {  // short lists
    const std::uint32_t hit = hits[i];
    std::size_t at = i;
    for (; at > 0 && hits[at - 1] > hit; --at) hits[at] = hits[at - 1];
    hits[at] = hit;
  }
  int begin = -1;
  for (const std::uint32_t hit : hits) {
    const float z = std::bit_cast<float>(hit >> 1) - kBehind;
    // Centres are at whole numbers; the first one behind z.
    const int voxel = std::min(static_cast<int>(z + 1.0F), depth);
    if ((hit & 1) == 0) {
      if (begin < 0) begin = voxel;
    } else if (begin >= 0) {
      if (begin < voxel) {
        out.push_back({static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(voxel - 1)});
      }
      begin = -1;
    }
  }
}

template <class Packet>
void aim(Packet& rays, unsigned lane, float x, float y, float far) {
  rays.org_x[lane] = x;
  rays.org_y[lane] = y;
  rays.org_z[lane] = -kBehind;
  rays.dir_x[lane] = rays.dir_y[lane] = 0;
  rays.dir_z[lane] = 1;
  rays.tnear[lane] = 0;
  rays.tfar[lane] = far;
  rays.time[lane] = 0;
  rays.mask[lane] = ~0U;
  rays.id[lane] = lane;
  rays.flags[lane] = 0;
}

class Embree : public Contender {
 public:
  Embree(int threads, const EmbreeOptions& options) : threads_(threads), options_(options) {}
  ~Embree() override {
    if (device_ != nullptr) rtcReleaseDevice(device_);
  }
  [[nodiscard]] std::string name() const override { return "Embree"; }
  [[nodiscard]] int threads() const override { return threads_; }
  void prepare() override {
    if (device_ == nullptr) device_ = rtcNewDevice(nullptr);
  }

  std::shared_ptr<VoxelSet> voxelize(const TriangleSoup& mesh, const VoxelGrid& grid) override {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads_));
    tbb::task_arena arena(threads_);
    return arena.execute([&] { return voxelize_here(mesh, grid); });
  }

 private:
  std::shared_ptr<VoxelSet> voxelize_here(const TriangleSoup& mesh, const VoxelGrid& grid) const {
    RTCScene scene = build(mesh, grid);
    auto result = std::make_shared<RowSet>(static_cast<std::size_t>(grid.dims.y));
    const auto shoot_bands = [&](const tbb::blocked_range<int>& range) {
      Hits hits;
      rtcInitIntersectContext(&hits);
      hits.filter = collect;
      hits.flags = options_.coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                     : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
      const glm::ivec2 size = packet_size();
      std::vector<Row> scratch(static_cast<std::size_t>(size.y));
      for (int band = range.begin(); band < range.end(); ++band) {
        const int y = band * size.y;
        const int rows = std::min(size.y, grid.dims.y - y);
        for (Row& row : scratch) {
          row.offsets.assign(1, 0);
          row.items.clear();
        }
        for (int x = 0; x < grid.dims.x; x += size.x) {
          const int columns = std::min(size.x, grid.dims.x - x);
          shoot(scene, hits, {x, y}, {columns, rows},
                static_cast<float>(grid.dims.z) + 2 * kBehind);
          for (int row = 0; row < rows; ++row) {
            Row& out = scratch[static_cast<std::size_t>(row)];
            for (int column = 0; column < columns; ++column) {
              auto& list = hits.lists[static_cast<std::size_t>(row * size.x + column)];
              if (!list.empty()) append_intervals(list, grid.dims.z, out.items);
              list.clear();
              out.offsets.push_back(static_cast<std::uint32_t>(out.items.size()));
            }
          }
        }
        for (int row = 0; row < rows; ++row) {
          const Row& done = scratch[static_cast<std::size_t>(row)];
          if (!done.items.empty()) result->rows[static_cast<std::size_t>(y + row)] = done;
        }
      }
    };
    const int bands = (grid.dims.y + packet_size().y - 1) / packet_size().y;
    tbb::parallel_for(tbb::blocked_range<int>(0, bands, 4), shoot_bands);
    rtcReleaseScene(scene);
    return result;
  }

  /// The BVH in index space, where voxel centres are whole numbers.
  [[nodiscard]] RTCScene build(const TriangleSoup& mesh, const VoxelGrid& grid) const {
    RTCScene scene = rtcNewScene(device_);
    constexpr std::array kQualities = {RTC_BUILD_QUALITY_LOW, RTC_BUILD_QUALITY_MEDIUM,
                                       RTC_BUILD_QUALITY_HIGH};
    const RTCBuildQuality quality = kQualities[static_cast<std::size_t>(options_.quality)];
    rtcSetSceneBuildQuality(scene, quality);
    rtcSetSceneFlags(scene, static_cast<RTCSceneFlags>(
                                RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION |
                                (options_.robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE)));
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                               mesh.positions.size()));
    for (const glm::dvec3& p : mesh.positions) {
      const glm::dvec3 index = (p - grid.origin) / grid.voxel_size - 0.5;
      for (int i = 0; i < 3; ++i) *points++ = static_cast<float>(index[i]);
    }
    auto* corners = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(unsigned), mesh.triangles.size()));
    for (const glm::uvec3& t : mesh.triangles) {
      for (int i = 0; i < 3; ++i) *corners++ = t[i];
    }
    rtcSetGeometryBuildQuality(geometry, quality);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    return scene;
  }

  /// Columns and rows of a packet: compact ones meet fewer triangles.
  [[nodiscard]] glm::ivec2 packet_size() const {
    switch (options_.packet) {
      case 16:
        return {4, 4};
      case 8:
        return {4, 2};
      case 4:
        return {2, 2};
      default:
        return {1, 1};
    }
  }

  /// Shoots the rays of `used` columns and rows from column and row `first`.
  template <class RayHits, class Intersect, class Occluded>
  void shoot_packet(RTCScene scene, Hits& hits, glm::ivec2 first, glm::ivec2 used, float far,
                    Intersect intersect, Occluded occluded) const {
    RayHits packet;
    constexpr int kWidth = static_cast<int>(sizeof(packet.ray.id) / sizeof(unsigned));
    alignas(64) std::array<int, static_cast<std::size_t>(kWidth)> valid{};
    const int columns = packet_size().x;
    for (int lane = 0; lane < kWidth; ++lane) {
      const glm::ivec2 at(lane % columns, lane / columns);
      valid[static_cast<std::size_t>(lane)] = at.x < used.x && at.y < used.y ? -1 : 0;
      aim(packet.ray, static_cast<unsigned>(lane), static_cast<float>(first.x + at.x),
          static_cast<float>(first.y + at.y), far);
    }
    if (options_.occluded) {
      occluded(valid.data(), scene, &hits, &packet.ray);
    } else {
      std::fill_n(packet.hit.geomID, kWidth, RTC_INVALID_GEOMETRY_ID);
      intersect(valid.data(), scene, &hits, &packet);
    }
  }

  void shoot(RTCScene scene, Hits& hits, glm::ivec2 first, glm::ivec2 used, float far) const {
    switch (options_.packet) {
      case 16:
        return shoot_packet<RTCRayHit16>(scene, hits, first, used, far, rtcIntersect16,
                                         rtcOccluded16);
      case 8:
        return shoot_packet<RTCRayHit8>(scene, hits, first, used, far, rtcIntersect8, rtcOccluded8);
      case 4:
        return shoot_packet<RTCRayHit4>(scene, hits, first, used, far, rtcIntersect4, rtcOccluded4);
      default:
        RTCRayHit one{};
        one.ray.org_x = static_cast<float>(first.x);
        one.ray.org_y = static_cast<float>(first.y);
        one.ray.org_z = -kBehind;
        one.ray.dir_z = 1;
        one.ray.tfar = far;
        one.ray.mask = ~0U;
        one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        if (options_.occluded) {
          rtcOccluded1(scene, &hits, &one.ray);
        } else {
          rtcIntersect1(scene, &hits, &one);
        }
    }
  }

  int threads_;
  EmbreeOptions options_;
  RTCDevice device_ = nullptr;
};

}  // namespace

std::unique_ptr<Contender> make_embree(int threads, const EmbreeOptions& options) {
  return std::make_unique<Embree>(threads, options);
}

}  // namespace strata::bench
