#include "voxelize/distance/nearest_triangles.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <span>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "voxelize/distance/nearest_triangles.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// Packets of 2 x 2 x 2 voxels go down the tree together. Each voxel has its own bound, so that a
// packet sees hardly more than a voxel would. The nearest triangle of the packet before gives the
// first bounds.

#ifndef STRATA_VOXELIZE_NEAREST_PACKET
#define STRATA_VOXELIZE_NEAREST_PACKET
namespace strata {
namespace {

constexpr std::size_t kPacket = 8;  // voxel i lies at (i >> 2, i >> 1 & 1, i & 1)

/// Voxels that look for their nearest triangles.
struct Packet {
  glm::dvec3 middle{0.0};  // units of the longest side of a voxel
  glm::dvec3 scale{1.0};
  alignas(32) float squares[kPacket];  // found so far; below 0: not asked for
};

/// A triangle's forms about the middle of a packet (tile_distance.cpp says what they are).
struct PacketForms {
  float height, beside[3], before[3], beyond[3];

  PacketForms(const TriangleFrame& frame, const glm::dvec3& middle)
      : height(static_cast<float>(glm::dot(frame.normal, middle - frame.corners[0]))) {
    for (int i = 0; i < 3; ++i) {
      const glm::dvec3 from = middle - frame.corners[i], to = middle - frame.corners[(i + 1) % 3];
      beside[i] = static_cast<float>(glm::dot(frame.beside[i], from));
      before[i] = static_cast<float>(-glm::dot(frame.along[i], from));
      beyond[i] = static_cast<float>(glm::dot(frame.along[i], to));
    }
    if (!frame.is_line) return;
    for (int i = 1; i < 3; ++i) beside[i] = before[i] = beyond[i] = 1e9f;
  }
};

}  // namespace
}  // namespace strata
#endif  // STRATA_VOXELIZE_NEAREST_PACKET

HWY_BEFORE_NAMESPACE();
namespace strata {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Node = NearestTriangles::Node;
// Products and sums are kept apart: fused ones round otherwise.
using Lane = hn::CappedTag<float, kPacket>;
using Vec = hn::Vec<Lane>;

/// Lowers the packet's squares to those of the distances to a triangle. @return whether any fell
HWY_INLINE bool meet_triangle(const TriangleFrame& frame, const float (*offsets)[kPacket],
                              Packet& packet) {
  const Lane d;
  const Vec zero = hn::Zero(d);
  const PacketForms forms(frame, packet.middle);
  bool fell = false;
  for (std::size_t lane = 0; lane < kPacket; lane += hn::Lanes(d)) {
    const Vec x = hn::Load(d, offsets[0] + lane), y = hn::Load(d, offsets[1] + lane),
              z = hn::Load(d, offsets[2] + lane);
    const auto along = [&](const glm::dvec3& direction) {
      return hn::Add(hn::Add(hn::Mul(hn::Set(d, static_cast<float>(direction.x)), x),
                             hn::Mul(hn::Set(d, static_cast<float>(direction.y)), y)),
                     hn::Mul(hn::Set(d, static_cast<float>(direction.z)), z));
    };
    Vec plane = zero, farthest = zero;
    for (int i = 0; i < 3; ++i) {
      const Vec beside = hn::Add(along(frame.beside[i]), hn::Set(d, forms.beside[i]));
      const Vec on = along(frame.along[i]);
      const Vec out = hn::Max(hn::Max(hn::Sub(hn::Set(d, forms.before[i]), on),
                                      hn::Add(on, hn::Set(d, forms.beyond[i]))),
                              zero);
      const Vec square = hn::Add(hn::Mul(beside, beside), hn::Mul(out, out));
      plane = i == 0 ? square : hn::Min(plane, square);
      farthest = i == 0 ? hn::Max(beside, out) : hn::Max(farthest, beside);
    }
    plane = hn::IfThenZeroElse(hn::Le(farthest, zero), plane);
    const Vec height = hn::Add(along(frame.normal), hn::Set(d, forms.height));
    const Vec found = hn::Add(hn::Mul(height, height), plane);
    const Vec before = hn::Load(d, packet.squares + lane);
    fell = fell || !hn::AllFalse(d, hn::Lt(found, before));
    hn::Store(hn::Min(found, before), d, packet.squares + lane);
  }
  return fell;
}

/// Whether a box may hold something that is nearer to a voxel than what was found.
HWY_INLINE bool may_be_nearer(const Node& node, const float (*points)[kPacket], float margin,
                              const Packet& packet) {
  const Lane d;
  for (std::size_t lane = 0; lane < kPacket; lane += hn::Lanes(d)) {
    Vec square = hn::Zero(d);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Vec p = hn::Load(d, points[axis] + lane);
      const Vec out = hn::Max(hn::Max(hn::Sub(hn::Set(d, node.low[axis] - margin), p),
                                      hn::Sub(p, hn::Set(d, node.high[axis] + margin))),
                              hn::Zero(d));
      square = hn::Add(square, hn::Mul(out, out));
    }
    const Vec least = hn::Mul(square, hn::Set(d, 1.0f - 1e-6f));
    if (!hn::AllFalse(d, hn::Le(least, hn::Load(d, packet.squares + lane)))) return true;
  }
  return false;
}

/// @param hint  a triangle that may be near; becomes one that was
void lower_packet(std::span<const TriangleFrame> triangles, std::span<const Node> nodes,
                  float margin, Packet& packet, std::uint32_t& hint) {
  HWY_ALIGN float offsets[3][kPacket];
  HWY_ALIGN float points[3][kPacket];
  for (int axis = 0; axis < 3; ++axis) {
    const auto half = static_cast<float>(packet.scale[axis] / 2);
    for (std::size_t i = 0; i < kPacket; ++i) {
      offsets[axis][i] = (i >> (2 - axis) & 1) != 0 ? half : -half;
      points[axis][i] = static_cast<float>(packet.middle[axis]) + offsets[axis][i];
    }
  }
  for (float& square : packet.squares) square = square < 0 ? -1.0f : square;
  meet_triangle(triangles[hint], offsets, packet);
  const glm::vec3 middle(packet.middle);
  const auto far_off = [&](const Node& node) {
    float sum = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      const float out = std::max({node.low[i] - middle[axis], middle[axis] - node.high[i], 0.0f});
      sum += out * out;
    }
    return sum;
  };
  std::uint32_t stack[64];
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const std::uint32_t at = stack[--depth];
    const Node& node = nodes[at];
    if (!may_be_nearer(node, points, margin, packet)) continue;
    if (node.count != 0) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        if (meet_triangle(triangles[i], offsets, packet)) hint = i;
      }
      continue;
    }
    const bool second_first = far_off(nodes[node.first]) < far_off(nodes[at + 1]);
    stack[depth++] = second_first ? at + 1 : node.first;
    stack[depth++] = second_first ? node.first : at + 1;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace strata
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata {

HWY_EXPORT(lower_packet);

namespace {

/// Builds the tree from the top: halves along the longest side of the middles' box.
class TreeBuilder {
 public:
  TreeBuilder(const LatticeMesh& mesh, const glm::dvec3& scale, const std::stop_token& stop)
      : mesh_(mesh),
        step_(scale / double{kLatticeSteps}),
        stop_(stop),
        order_(mesh.triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    for (const glm::uvec3& t : mesh.triangles) {
      const glm::ivec3 a = mesh.vertices[t.x], b = mesh.vertices[t.y], c = mesh.vertices[t.z];
      middles_.push_back(glm::min(a, glm::min(b, c)) / 2 + glm::max(a, glm::max(b, c)) / 2);
    }
  }

  void build(std::uint32_t begin, std::uint32_t end) {
    if (stop_.stop_requested()) return;
    const std::size_t at = nodes.size();
    nodes.push_back(box(begin, end));
    if (end - begin <= NearestTriangles::kLeafTriangles) {
      nodes[at].first = begin;
      nodes[at].count = end - begin;
      return;
    }
    glm::ivec3 low = middles_[order_[begin]], high = low;
    for (std::uint32_t i = begin; i < end; ++i) {
      low = glm::min(low, middles_[order_[i]]);
      high = glm::max(high, middles_[order_[i]]);
    }
    const glm::dvec3 size = glm::dvec3(high - low) * step_;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::uint32_t half = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + half, order_.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) {
                       return std::pair(middles_[a][axis], a) < std::pair(middles_[b][axis], b);
                     });
    build(begin, half);
    nodes[at].first = static_cast<std::uint32_t>(nodes.size());
    build(half, end);
  }

  [[nodiscard]] std::vector<TriangleFrame> triangles(const glm::dvec3& scale) const {
    std::vector<TriangleFrame> frames;
    frames.reserve(order_.size());
    for (const std::uint32_t t : order_) {
      const glm::uvec3 index = mesh_.triangles[t];
      const glm::ivec3 corners[3] = {mesh_.vertices[index.x], mesh_.vertices[index.y],
                                     mesh_.vertices[index.z]};
      frames.push_back(triangle_frame(corners, scale, glm::ivec3(0)));
    }
    return frames;
  }

  std::vector<NearestTriangles::Node> nodes;

 private:
  [[nodiscard]] NearestTriangles::Node box(std::uint32_t begin, std::uint32_t end) const {
    glm::ivec3 low(std::numeric_limits<int>::max()), high(std::numeric_limits<int>::min());
    for (std::uint32_t i = begin; i < end; ++i) {
      const glm::uvec3 t = mesh_.triangles[order_[i]];
      for (int c = 0; c < 3; ++c) {
        low = glm::min(low, mesh_.vertices[t[c]]);
        high = glm::max(high, mesh_.vertices[t[c]]);
      }
    }
    NearestTriangles::Node node;
    constexpr float kFar = std::numeric_limits<float>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      node.low[i] = std::nextafter(static_cast<float>(low[axis] * step_[axis]), -kFar);
      node.high[i] = std::nextafter(static_cast<float>(high[axis] * step_[axis]), kFar);
    }
    return node;
  }

  const LatticeMesh& mesh_;
  glm::dvec3 step_;
  const std::stop_token& stop_;
  std::vector<std::uint32_t> order_;
  std::vector<glm::ivec3> middles_;
};

}  // namespace

NearestTriangles::NearestTriangles(const LatticeMesh& mesh, const glm::dvec3& scale,
                                   const std::stop_token& stop) {
  if (mesh.triangles.empty()) return;
  TreeBuilder builder(mesh, scale, stop);
  builder.build(0, static_cast<std::uint32_t>(mesh.triangles.size()));
  if (stop.stop_requested()) return;
  nodes_ = std::move(builder.nodes);
  triangles_ = builder.triangles(scale);
}

void NearestTriangles::lower(const DistanceTile& tile, float band_square, float* squares,
                             const std::stop_token& stop) const {
  Packet packet;
  packet.scale = tile.scale;
  // Far above the rounding of places in the grid, as floats.
  const glm::dvec3 reach = glm::dvec3(tile.low + DistanceTile::kSide) * tile.scale;
  const auto margin = static_cast<float>(1e-6 * std::max({reach.x, reach.y, reach.z}) + 1e-5);
  std::uint32_t hint = 0;
  const auto place = [](const glm::ivec3& at, std::size_t i) {
    const int lane = static_cast<int>(i);
    return DistanceTile::offset(at.x + (lane >> 2), at.y + (lane >> 1 & 1), at.z + (lane & 1));
  };
  for (glm::ivec3 at(0); at.x < tile.size.x && !stop.stop_requested(); at.x += 2) {
    for (at.y = 0; at.y < tile.size.y; at.y += 2) {
      for (at.z = 0; at.z < tile.size.z; at.z += 2) {
        bool asked = false;
        for (std::size_t i = 0; i < kPacket; ++i) {
          const float square = squares[place(at, i)];
          const bool far = square >= band_square;
          asked = asked || far;
          packet.squares[i] = far ? std::numeric_limits<float>::max() : -1.0f;
        }
        if (!asked) continue;
        packet.middle = glm::dvec3(tile.low + at + 1) * tile.scale;
        HWY_DYNAMIC_DISPATCH(lower_packet)(triangles_, nodes_, margin, packet, hint);
        for (std::size_t i = 0; i < kPacket; ++i) {
          if (packet.squares[i] >= 0.0f) squares[place(at, i)] = packet.squares[i];
        }
      }
    }
  }
}

}  // namespace strata
#endif  // HWY_ONCE
