#include "mesh/gltf/gltf_shape.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/printable.h"
#include "core/srgb.h"
#include "strata/mesh/triangle_soup.h"

namespace strata::detail {
namespace {

/// What primitives have in common that share their vertices.
using VertexKey = std::tuple<std::uint32_t, GltfIndex, GltfIndex, const GltfPrimitive*>;

/// The vertices of some primitives.
struct VertexGroup {
  const GltfPrimitive* primitive = nullptr;
  GltfIndex texture_places;
  std::uint32_t low = 0xffffffffu, high = 0;  ///< vertices of the accessor that are used
  std::uint64_t uses = 0;
  std::vector<std::uint32_t> used;  ///< sorted; empty: all from low to high
  std::uint32_t base = 0;           ///< of the first in the shape
};

/// Triangles of a primitive.
struct Piece {
  std::vector<glm::uvec3> triangles;  ///< vertices of the accessor
  std::size_t group = 0;
  GltfIndex material;
};

std::vector<glm::uvec3> triangles_of(int mode, std::vector<std::uint32_t>&& v) {
  std::vector<glm::uvec3> all;
  if (v.size() < 3) return all;
  if (mode == 4) {
    all.resize(v.size() / 3);
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = {v[3 * i], v[3 * i + 1], v[3 * i + 2]};
    return all;
  }
  all.reserve(v.size() - 2);
  for (std::size_t i = 0; i + 2 < v.size(); ++i) {
    glm::uvec3 t{v[0], v[i + 1], v[i + 2]};                         // a fan
    if (mode == 5) t = {v[i], v[i + 1 + i % 2], v[i + 2 - i % 2]};  // a strip
    // strips are joined by triangles without area
    if (t.x != t.y && t.y != t.z && t.z != t.x) all.push_back(t);
  }
  return all;
}

class ShapeMaker {
 public:
  ShapeMaker(const GltfDocument& document, GltfData& data, std::uint32_t mesh,
             std::span<const double> weights, bool looks)
      : document_(document), data_(data), mesh_(mesh), weights_(weights), looks_(looks) {}

  GltfShape make() {
    const std::vector<GltfPrimitive>& primitives = document_.meshes[mesh_].primitives;
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      index_ = i;
      add_piece(primitives[i]);
    }
    for (VertexGroup& group : groups_) read_vertices(group);
    for (Piece& piece : pieces_) place(piece);
    return std::move(shape_);
  }

 private:
  [[nodiscard]] std::string where() const {
    return fmt::format("{}: meshes[{}].primitives[{}]", data_.name(), mesh_, index_);
  }

  void add_piece(const GltfPrimitive& from) {
    if (data_.execution().stop.stop_requested()) {
      throw GltfRefusal{{ErrorCode::kCancelled, data_.name() + ": stopped"}};
    }
    if (!from.positions) return;
    const GltfAccessor& positions = data_.accessor(*from.positions);
    if (from.packed && !positions.view && !positions.sparse) {
      refuse_gltf(
          "{}: it is packed by KHR_draco_mesh_compression, which is not read; write the "
          "file without compression",
          where());
    }
    const std::uint64_t count =
        from.indices ? data_.accessor(*from.indices).count : positions.count;
    if (from.mode < 4) {
      shape_.ignored += from.mode == 0   ? count
                        : from.mode == 1 ? count / 2
                        : from.mode == 2 ? count
                                         : count - std::min<std::uint64_t>(count, 1);
      return;
    }
    data_.check(*from.positions);
    if (from.indices) data_.check(*from.indices);
    check_room(count);
    std::vector<std::uint32_t> vertices;
    if (from.indices) {
      vertices = data_.read_indices(*from.indices);
    } else {
      vertices.resize(count);
      std::iota(vertices.begin(), vertices.end(), 0u);
    }
    drop_incomplete(from.mode, vertices.size());
    if (vertices.size() < 3) return;
    const auto uses = static_cast<std::uint64_t>(vertices.size());
    Piece piece;
    const std::uint32_t most = *std::max_element(vertices.begin(), vertices.end());
    std::uint32_t low = *std::min_element(vertices.begin(), vertices.end()), high = most;
    piece.triangles = triangles_of(from.mode, std::move(vertices));
    if (most >= positions.count) {
      drop_out_of_range(piece.triangles, positions.count, most);
      if (piece.triangles.empty()) return;
      low = most;
      high = 0;
      for (const glm::uvec3& t : piece.triangles) {
        low = std::min({low, t.x, t.y, t.z});
        high = std::max({high, t.x, t.y, t.z});
      }
    }
    piece.group = group_of(from);
    piece.material = from.material;
    VertexGroup& group = groups_[piece.group];
    group.low = std::min(group.low, low);
    group.high = std::max(group.high, high);
    group.uses += uses;
    pieces_.push_back(std::move(piece));
  }

  /// A list of triangles ends with one or two corners too many, or a strip or fan has fewer than
  /// three.
  void drop_incomplete(int mode, std::size_t corners) {
    const std::size_t rest = mode == 4 ? corners % 3 : corners < 3 ? corners : 0;
    if (rest == 0) return;
    ++shape_.losses.too_few;
    if (!shape_.losses.first.empty()) return;
    shape_.losses.first = mode == 4 ? fmt::format(
                                          "{}: its triangles have {} corners, which is no "
                                          "multiple of 3",
                                          where(), corners)
                                    : fmt::format("{}: it has {}, too few for a triangle", where(),
                                                  counted(corners, "corner"));
  }

  void drop_out_of_range(std::vector<glm::uvec3>& triangles, std::uint64_t count,
                         std::uint32_t most) {
    const std::uint64_t dropped = std::erase_if(triangles, [&](const glm::uvec3& t) {
      return t.x >= count || t.y >= count || t.z >= count;
    });
    shape_.losses.out_of_range += dropped;
    if (dropped == 0 || !shape_.losses.first.empty()) return;
    shape_.losses.first =
        fmt::format("{}: an index is {}, but there are {} vertices", where(), most, count);
  }

  /// Primitives may name the same bytes again and again.
  void check_room(std::uint64_t corners) {
    corners_ += corners;
    const std::uint64_t limit = data_.execution().memory_limit;
    const std::uint64_t most = limit != 0 ? limit / sizeof(std::uint32_t) : 0xfffffffeu;
    if (corners_ <= most) return;
    throw GltfRefusal{
        {ErrorCode::kLimit,
         fmt::format("{}: meshes[{}] has {} corners of triangles; at most {} fit {}", data_.name(),
                     mesh_, corners_, most, limit != 0 ? "the memory limit" : "a mesh")}};
  }

  std::size_t group_of(const GltfPrimitive& from) {
    GltfIndex texture;
    if (looks_ && from.material && document_.materials[*from.material].texture) {
      const std::uint32_t set = document_.materials[*from.material].texture_set;
      if (set < from.texture_places.size()) texture = from.texture_places[set];
    }
    const bool alone = !from.skin.empty() || !from.morphs.empty();
    const VertexKey key{*from.positions, from.colours, texture, alone ? &from : nullptr};
    const auto [found, fresh] = known_.try_emplace(key, groups_.size());
    if (fresh) {
      VertexGroup& group = groups_.emplace_back();
      group.primitive = &from;
      group.texture_places = texture;
    }
    return found->second;
  }

  /// Calls read(first, count, at) for what is used, where `at` counts from the group's base.
  template <class Read>
  static void for_used(const VertexGroup& group, Read&& read) {
    if (group.used.empty()) return read(group.low, std::uint64_t{group.high} - group.low + 1, 0);
    const std::vector<std::uint32_t>& used = group.used;
    for (std::size_t i = 0, end = 0; i < used.size(); i = end) {  // neighbours at once
      for (end = i + 1; end < used.size() && used[end] == used[end - 1] + 1;) ++end;
      read(used[i], end - i, i);
    }
  }

  void find_used(VertexGroup& group) {
    constexpr std::uint64_t kLoose = 4;
    if (std::uint64_t{group.high} - group.low < kLoose * group.uses) return;
    for (const Piece& piece : pieces_) {
      if (&groups_[piece.group] != &group) continue;
      for (const glm::uvec3& t : piece.triangles)
        group.used.insert(group.used.end(), {t.x, t.y, t.z});
    }
    std::sort(group.used.begin(), group.used.end());
    group.used.erase(std::unique(group.used.begin(), group.used.end()), group.used.end());
  }

  void read_vertices(VertexGroup& group) {
    find_used(group);
    const std::size_t first = shape_.positions.size();
    const std::size_t count =
        group.used.empty() ? std::size_t{group.high} - group.low + 1 : group.used.size();
    if (first + count > 0xfffffffeu) {
      throw GltfRefusal{
          {ErrorCode::kLimit,
           fmt::format("{}: meshes[{}] has more than 2^32 - 2 vertices", data_.name(), mesh_)}};
    }
    group.base = static_cast<std::uint32_t>(first);
    shape_.positions.resize(first + count);
    const GltfPrimitive& from = *group.primitive;
    for_used(group, [&](std::uint64_t low, std::uint64_t some, std::size_t at) {
      data_.read(*from.positions, 3, low, some, &shape_.positions[first + at].x);
    });
    for (std::size_t m = 0; m < from.morphs.size() && m < weights_.size(); ++m) {
      if (from.morphs[m] && weights_[m] != 0.0) morph(group, *from.morphs[m], weights_[m], count);
    }
    for (std::size_t v = first; v < first + count; ++v) {
      glm::dvec3& p = shape_.positions[v];
      if (p.x * 0.0 + p.y * 0.0 + p.z * 0.0 == 0.0) continue;
      if (shape_.losses.first.empty()) {
        shape_.losses.first =
            fmt::format("{}: meshes[{}] has a vertex at ({}, {}, {}), which is not finite",
                        data_.name(), mesh_, p.x, p.y, p.z);
      }
      not_finite_.resize(shape_.positions.size());
      not_finite_[v] = true;
      p = glm::dvec3(0.0);  // no triangle uses it
    }
    if (looks_ && from.colours) read_colours(group, *from.colours, count);
    if (group.texture_places) read_places(group, count);
    if (!from.skin.empty()) read_skin(group, count);
  }

  void morph(const VertexGroup& group, std::uint32_t accessor, double weight, std::size_t count) {
    std::vector<glm::dvec3> moves(count);
    for_used(group, [&](std::uint64_t low, std::uint64_t some, std::size_t at) {
      data_.read(accessor, 3, low, some, &moves[at].x);
    });
    for (std::size_t v = 0; v < count; ++v) shape_.positions[group.base + v] += weight * moves[v];
  }

  void read_colours(const VertexGroup& group, std::uint32_t accessor, std::size_t count) {
    const int channels = data_.accessor(accessor).components == 3 ? 3 : 4;
    std::vector<double> light(count * static_cast<std::size_t>(channels));
    for_used(group, [&](std::uint64_t low, std::uint64_t some, std::size_t at) {
      data_.read(accessor, channels, low, some, &light[at * static_cast<std::size_t>(channels)]);
    });
    shape_.colours.resize(group.base, glm::u8vec4(255));
    const double* at = light.data();
    const auto byte = [](double share) {
      return static_cast<std::uint8_t>(std::lround(255 * std::clamp(share, 0.0, 1.0)));
    };
    for (std::size_t v = 0; v < count; ++v, at += channels) {
      shape_.colours.emplace_back(byte(srgb_of_linear(at[0])), byte(srgb_of_linear(at[1])),
                                  byte(srgb_of_linear(at[2])), channels == 4 ? byte(at[3]) : 255);
    }
  }

  void read_places(const VertexGroup& group, std::size_t count) {
    std::vector<glm::dvec2> places(count);
    for_used(group, [&](std::uint64_t low, std::uint64_t some, std::size_t at) {
      data_.read(*group.texture_places, 2, low, some, &places[at].x);
    });
    shape_.texture_places.resize(group.base);
    for (const glm::dvec2& place : places) shape_.texture_places.emplace_back(place);
  }

  void read_skin(const VertexGroup& group, std::size_t count) {
    const auto& sets = group.primitive->skin;
    if (shape_.pulls_each < sets.size()) widen_pulls(sets.size(), group.base);
    shape_.pulls.resize((group.base + count) * shape_.pulls_each);
    std::vector<glm::dvec4> joints(count), weights(count);
    for (std::size_t s = 0; s < sets.size(); ++s) {
      if (!sets[s][1])
        refuse_gltf("{}: meshes[{}] has joints without weights", data_.name(), mesh_);
      for_used(group, [&](std::uint64_t low, std::uint64_t some, std::size_t at) {
        data_.read(*sets[s][0], 4, low, some, &joints[at].x);
        data_.read(*sets[s][1], 4, low, some, &weights[at].x);
      });
      for (std::size_t v = 0; v < count; ++v) {
        GltfPull& pull = shape_.pulls[(group.base + v) * shape_.pulls_each + s];
        for (int i = 0; i < 4; ++i) {
          const double joint = joints[v][i], weight = weights[v][i];
          if (!(joint >= 0 && joint <= 65535) || !std::isfinite(weight)) {
            refuse_gltf("{}: meshes[{}] has a joint {} with weight {}", data_.name(), mesh_, joint,
                        weight);
          }
          pull.joints[i] = static_cast<std::uint32_t>(joint);
          pull.weights[i] = weight;
        }
      }
    }
  }

  /// Gives each position room for more joints.
  void widen_pulls(std::size_t each, std::size_t positions) {
    std::vector<GltfPull> wide(positions * each);
    for (std::size_t v = 0; v < positions && shape_.pulls_each > 0; ++v) {
      std::copy_n(shape_.pulls.begin() + static_cast<std::ptrdiff_t>(v * shape_.pulls_each),
                  shape_.pulls_each, wide.begin() + static_cast<std::ptrdiff_t>(v * each));
    }
    shape_.pulls = std::move(wide);
    shape_.pulls_each = each;
  }

  void place(Piece& piece) {
    const VertexGroup& group = groups_[piece.group];
    const auto local = [&](std::uint32_t vertex) {
      if (group.used.empty()) return vertex - group.low + group.base;
      const auto at = std::lower_bound(group.used.begin(), group.used.end(), vertex);
      return static_cast<std::uint32_t>(at - group.used.begin()) + group.base;
    };
    shape_.runs.push_back({shape_.triangles.size(), piece.material});
    for (glm::uvec3& t : piece.triangles) t = {local(t.x), local(t.y), local(t.z)};
    if (!not_finite_.empty()) {
      not_finite_.resize(shape_.positions.size());
      shape_.losses.non_finite += std::erase_if(piece.triangles, [&](const glm::uvec3& t) {
        return not_finite_[t.x] || not_finite_[t.y] || not_finite_[t.z];
      });
    }
    if (shape_.triangles.empty()) {
      shape_.triangles = std::move(piece.triangles);
    } else {
      shape_.triangles.insert(shape_.triangles.end(), piece.triangles.begin(),
                              piece.triangles.end());
      piece.triangles = {};
    }
  }

  const GltfDocument& document_;
  GltfData& data_;
  const std::uint32_t mesh_;
  const std::span<const double> weights_;
  const bool looks_;
  std::uint64_t corners_ = 0;
  std::vector<bool> not_finite_;  // of positions; empty: all are finite
  std::size_t index_ = 0;         // of the primitive being read
  std::map<VertexKey, std::size_t> known_;
  std::vector<VertexGroup> groups_;
  std::vector<Piece> pieces_;
  GltfShape shape_;
};

}  // namespace

GltfShape make_shape(const GltfDocument& document, GltfData& data, std::uint32_t mesh,
                     std::span<const double> weights, bool looks) {
  GltfShape shape = ShapeMaker(document, data, mesh, weights, looks).make();
  const std::size_t count = shape.positions.size();
  if (!shape.colours.empty()) shape.colours.resize(count, glm::u8vec4(255));
  if (!shape.texture_places.empty()) shape.texture_places.resize(count);
  if (shape.pulls_each > 0) shape.pulls.resize(count * shape.pulls_each);
  return shape;
}

}  // namespace strata::detail
