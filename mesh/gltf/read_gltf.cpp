// This work is based on: The Khronos Group, "glTF 2.0 Specification", 2021 (ISO/IEC 12113:2022),
// and its extensions KHR_mesh_quantization, KHR_texture_transform, EXT_mesh_gpu_instancing.
#include "mesh/gltf/read_gltf.h"

#include <fmt/format.h>

#include <cstring>
#include <filesystem>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>
#include <new>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>

#include "core/printable.h"
#include "core/reserve_large.h"
#include "mesh/gltf/gltf_data.h"
#include "mesh/gltf/gltf_document.h"
#include "mesh/gltf/gltf_looks.h"
#include "mesh/gltf/gltf_shape.h"
#include "mesh/part_names.h"

namespace strata {
namespace detail {
namespace {

constexpr std::string_view kMagic = "glTF";

std::uint32_t word_at(std::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    word |= std::uint32_t{static_cast<unsigned char>(bytes[at + i])} << (8 * i);
  }
  return word;
}

/// The JSON of a .glb. Its binary chunk goes to `source`.
std::string_view open_glb(std::string_view bytes, GltfSource& source) {
  constexpr std::size_t kHeader = 12, kChunkHeader = 8;
  if (bytes.size() < kHeader + kChunkHeader) {
    refuse_gltf("{}: the file is cut short after {} bytes", source.name, bytes.size());
  }
  if (const std::uint32_t version = word_at(bytes, 4); version != 2) {
    refuse_gltf("{}: version {} of GLB is not read; version 2 is", source.name, version);
  }
  const std::uint32_t length = word_at(bytes, 8);
  if (length > bytes.size() || length < kHeader + kChunkHeader) {
    refuse_gltf("{}: the header says {} bytes, the file has {}", source.name, length, bytes.size());
  }
  bytes = bytes.substr(0, length);
  const auto chunk = [&](std::size_t at) {
    const std::uint32_t size = word_at(bytes, at);
    if (size > bytes.size() - at - kChunkHeader) {
      refuse_gltf("{}: byte {}: a chunk of {} bytes reaches beyond the file", source.name, at,
                  size);
    }
    return bytes.substr(at + kChunkHeader, size);
  };
  constexpr std::uint32_t kJson = 0x4e4f534a, kBinary = 0x004e4942;
  if (word_at(bytes, kHeader + 4) != kJson) {
    refuse_gltf("{}: the first chunk is not JSON", source.name);
  }
  const std::string_view json = chunk(kHeader);
  for (std::size_t at = kHeader + kChunkHeader + json.size(); at + kChunkHeader <= bytes.size();) {
    const std::string_view found = chunk(at);
    if (word_at(bytes, at + 4) == kBinary && !source.has_binary) {
      source.binary = found;
      source.has_binary = true;
    }
    at += kChunkHeader + found.size();
  }
  return json;
}

/// Puts the shapes of a scene into one soup.
class SceneWalk {
 public:
  SceneWalk(const GltfDocument& document, GltfData& data, const GltfOptions& options)
      : document_(document), data_(data), options_(options) {}

  GltfModel walk() {
    find_parents();
    place_nodes();
    textures_wanted_.resize(document_.materials.size());
    for (const std::uint32_t node : nodes_of_scene()) {
      if (document_.nodes[node].mesh) ++uses_[*document_.nodes[node].mesh];
    }
    for (const std::uint32_t node : order_) {
      if (document_.nodes[node].mesh) add_node(node);
    }
    finish();
    return std::move(model_);
  }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  void find_parents() {
    parents_.assign(document_.nodes.size(), kNone);
    for (std::uint32_t n = 0; n < document_.nodes.size(); ++n) {
      for (const std::uint32_t child : document_.nodes[n].children) {
        if (parents_[child] != kNone && parents_[child] != n) {
          refuse_gltf("{}: nodes[{}] is a child of nodes[{}] and of nodes[{}]", data_.name(), child,
                      parents_[child], n);
        }
        parents_[child] = n;
      }
    }
  }

  /// World matrices of all nodes, parents first.
  void place_nodes() {
    worlds_.resize(document_.nodes.size());
    std::vector<std::uint32_t> open;
    std::size_t reached = 0;
    for (std::uint32_t n = 0; n < document_.nodes.size(); ++n) {
      if (parents_[n] == kNone) open.push_back(n);
    }
    std::vector<bool> seen(document_.nodes.size());
    while (!open.empty()) {
      const std::uint32_t node = open.back();
      open.pop_back();
      if (seen[node]) continue;  // a child that is named twice
      seen[node] = true;
      ++reached;
      const glm::dmat4& local = document_.nodes[node].parent_from_node;
      worlds_[node] = parents_[node] == kNone ? local : worlds_[parents_[node]] * local;
      const std::vector<std::uint32_t>& children = document_.nodes[node].children;
      open.insert(open.end(), children.begin(), children.end());
    }
    if (reached == document_.nodes.size()) return;
    const auto lost = std::find(seen.begin(), seen.end(), false) - seen.begin();
    refuse_gltf("{}: nodes[{}] lies within a circle of children", data_.name(), lost);
  }

  /// The nodes that are shown, each before its children.
  const std::vector<std::uint32_t>& nodes_of_scene() {
    std::vector<std::uint32_t> open;
    if (document_.scenes.empty()) {
      for (std::uint32_t n = 0; n < document_.nodes.size(); ++n) {
        if (parents_[n] == kNone) open.push_back(n);
      }
    } else {
      const std::uint32_t shown = document_.scene.value_or(0);
      open = document_.scenes[shown];
      if (document_.scenes.size() > 1) {
        model_.warnings.push_back(fmt::format("{}: it has {} scenes; scene {} is read",
                                              data_.name(), document_.scenes.size(), shown));
      }
    }
    std::reverse(open.begin(), open.end());
    std::vector<bool> seen(document_.nodes.size());
    while (!open.empty()) {
      const std::uint32_t node = open.back();
      open.pop_back();
      if (seen[node]) continue;
      seen[node] = true;
      order_.push_back(node);
      const std::vector<std::uint32_t>& children = document_.nodes[node].children;
      open.insert(open.end(), children.rbegin(), children.rend());
    }
    return order_;
  }

  void add_node(std::uint32_t index) {
    const GltfNode& node = document_.nodes[index];
    const std::uint32_t mesh = *node.mesh;
    const bool own = !node.weights.empty();
    const std::vector<double>& weights = own ? node.weights : document_.meshes[mesh].weights;
    GltfShape made;
    const GltfShape* shape = &made;
    if (own || uses_[mesh] == 1) {
      made = make_shape(document_, data_, mesh, weights, options_.attributes);
    } else {
      const auto [place, fresh] = shapes_.try_emplace(mesh);
      if (fresh) place->second = make_shape(document_, data_, mesh, weights, options_.attributes);
      shape = &place->second;
    }
    model_.ignored += shape->ignored;
    model_.losses.too_few += shape->losses.too_few;
    model_.losses.out_of_range += shape->losses.out_of_range;
    model_.losses.non_finite += shape->losses.non_finite;
    if (model_.losses.first.empty()) model_.losses.first = shape->losses.first;
    if (shape->triangles.empty()) return;
    begin_part(index);
    if (node.skin && shape->pulls_each > 0) {
      add_shape(*shape, pulled(*shape, *node.skin), mirrored_by_skin_, index);
      return;
    }
    for (const glm::dmat4& instance : instances(node)) {
      const glm::dmat4 world = worlds_[index] * instance;
      std::vector<glm::dvec3> positions(shape->positions.size());
      for (std::size_t v = 0; v < positions.size(); ++v) {
        positions[v] = glm::dvec3(world * glm::dvec4(shape->positions[v], 1.0));
      }
      add_shape(*shape, std::move(positions), glm::determinant(glm::dmat3(world)) < 0, index);
    }
  }

  std::vector<glm::dmat4> instances(const GltfNode& node) {
    const GltfIndex any = node.translations ? node.translations
                          : node.rotations  ? node.rotations
                                            : node.scales;
    if (!any) return {glm::dmat4(1.0)};
    const std::uint64_t count = data_.accessor(*any).count;
    constexpr std::uint64_t kMost = 1'000'000;
    if (count > kMost) {
      throw GltfRefusal{{ErrorCode::kLimit, fmt::format("{}: a node has {} instances; at most {} "
                                                        "are read",
                                                        data_.name(), count, kMost)}};
    }
    std::vector<glm::dmat4> all;
    const auto read = [&](GltfIndex accessor, int components) {
      return accessor ? data_.read_all(*accessor, components) : std::vector<double>();
    };
    const std::vector<double> moves = read(node.translations, 3), turns = read(node.rotations, 4),
                              scales = read(node.scales, 3);
    if ((!moves.empty() && moves.size() != 3 * count) ||
        (!turns.empty() && turns.size() != 4 * count) ||
        (!scales.empty() && scales.size() != 3 * count)) {
      refuse_gltf("{}: the attributes of EXT_mesh_gpu_instancing differ in count", data_.name());
    }
    for (std::size_t i = 0; i < count; ++i) {
      glm::dmat4 matrix(1.0);
      if (!turns.empty()) {
        const double* q = &turns[4 * i];
        const glm::dquat turn(q[3], q[0], q[1], q[2]);
        if (const double length = glm::length(turn); length > 0) {
          matrix = glm::dmat4(glm::mat3_cast(turn / length));
        }
      }
      for (int c = 0; c < 3; ++c) {
        const std::size_t at = 3 * i + static_cast<std::size_t>(c);
        if (!scales.empty()) matrix[c] *= scales[at];
        if (!moves.empty()) matrix[3][c] = moves[at];
      }
      all.push_back(matrix);
    }
    return all;
  }

  /// Positions as the joints of a skin pull them.
  std::vector<glm::dvec3> pulled(const GltfShape& shape, std::uint32_t skin_index) {
    const GltfSkin& skin = document_.skins[skin_index];
    std::vector<double> binds;
    if (skin.bind_matrices) binds = data_.read_all(*skin.bind_matrices, 16);
    if (skin.bind_matrices && binds.size() < 16 * skin.joints.size()) {
      refuse_gltf("{}: skins[{}] has {} joints, but {} inverseBindMatrices", data_.name(),
                  skin_index, skin.joints.size(), binds.size() / 16);
    }
    std::vector<glm::dmat4> joints;
    for (std::size_t j = 0; j < skin.joints.size(); ++j) {
      glm::dmat4 bind(1.0);
      for (int i = 0; i < 16 && !binds.empty(); ++i) {
        bind[i / 4][i % 4] = binds[16 * j + static_cast<std::size_t>(i)];
      }
      joints.push_back(worlds_[skin.joints[j]] * bind);
    }
    mirrored_by_skin_ = !joints.empty() && glm::determinant(glm::dmat3(joints.front())) < 0;
    std::vector<glm::dvec3> positions(shape.positions.size());
    for (std::size_t v = 0; v < positions.size(); ++v) {
      glm::dvec3 sum(0.0);
      double all = 0.0;
      for (std::size_t s = 0; s < shape.pulls_each; ++s) {
        const GltfPull& pull = shape.pulls[v * shape.pulls_each + s];
        for (int i = 0; i < 4; ++i) {
          if (pull.weights[i] == 0.0) continue;
          if (pull.joints[i] >= joints.size()) {
            refuse_gltf("{}: a vertex has joint {}, but skins[{}] has {}", data_.name(),
                        pull.joints[i], skin_index, joints.size());
          }
          sum += pull.weights[i] *
                 glm::dvec3(joints[pull.joints[i]] * glm::dvec4(shape.positions[v], 1.0));
          all += pull.weights[i];
        }
      }
      positions[v] = all != 0.0 ? sum / all : shape.positions[v];
    }
    return positions;
  }

  void begin_part(std::uint32_t index) {
    if (!options_.attributes && !options_.parts) return;
    const std::string& own = document_.nodes[index].name;
    const std::string& mesh = document_.meshes[*document_.nodes[index].mesh].name;
    const std::string name = !own.empty()    ? own
                             : !mesh.empty() ? mesh
                                             : fmt::format("node {}", index);
    MeshAttributes& to = model_.attributes;
    to.part_ranges.push_back(
        {model_.soup.triangles.size(), static_cast<std::uint32_t>(to.parts.size())});
    to.parts.push_back({names_.unique(name), {}});
  }

  void check_room(const GltfShape& shape) const {
    const std::uint64_t vertices = model_.soup.positions.size() + shape.positions.size(),
                        triangles = model_.soup.triangles.size() + shape.triangles.size();
    constexpr std::uint64_t kMost = 0xfffffffeu;
    if (vertices > kMost || triangles > kMost) {
      throw GltfRefusal{
          {ErrorCode::kLimit, fmt::format("{}: it has more than {} {}", data_.name(), kMost,
                                          vertices > kMost ? "vertices" : "triangles")}};
    }
    const std::uint64_t limit = data_.execution().memory_limit;
    const std::uint64_t bytes = vertices * sizeof(glm::dvec3) + triangles * sizeof(glm::uvec3);
    if (limit != 0 && bytes > limit) {
      throw GltfRefusal{
          {ErrorCode::kLimit,
           fmt::format("{}: the mesh needs {} bytes or more, but the memory limit is {}",
                       data_.name(), bytes, limit)}};
    }
    if (data_.execution().stop.stop_requested()) {
      throw GltfRefusal{{ErrorCode::kCancelled, data_.name() + ": stopped"}};
    }
  }

  void add_shape(const GltfShape& shape, std::vector<glm::dvec3>&& positions, bool mirrored,
                 std::uint32_t node) {
    check_room(shape);
    for (const glm::dvec3& p : positions) {
      if (p.x * 0.0 + p.y * 0.0 + p.z * 0.0 == 0.0) continue;
      refuse_gltf("{}: nodes[{}] places a vertex at ({}, {}, {}), which is not finite",
                  data_.name(), node, p.x, p.y, p.z);
    }
    TriangleSoup& soup = model_.soup;
    const auto base = static_cast<std::uint32_t>(soup.positions.size());
    if (options_.attributes) add_looks(shape, base, mirrored);
    if (base == 0) {
      soup.positions = std::move(positions);
    } else {
      soup.positions.insert(soup.positions.end(), positions.begin(), positions.end());
    }
    soup.triangles.reserve(
        std::max(soup.triangles.capacity(), soup.triangles.size() + shape.triangles.size()));
    for (const glm::uvec3& t : shape.triangles) {
      soup.triangles.push_back(mirrored ? glm::uvec3(t.x + base, t.z + base, t.y + base)
                                        : t + base);
    }
  }

  void add_looks(const GltfShape& shape, std::uint32_t base, bool mirrored) {
    MeshAttributes& to = model_.attributes;
    const std::size_t first = model_.soup.triangles.size();
    if (!shape.colours.empty()) {
      to.vertex_colours.resize(base, glm::u8vec4(255));
      to.vertex_colours.insert(to.vertex_colours.end(), shape.colours.begin(), shape.colours.end());
    }
    for (std::size_t r = 0; r < shape.runs.size(); ++r) {
      const GltfIndex material = shape.runs[r].material;
      const std::size_t begin = shape.runs[r].first;
      const std::size_t end =
          r + 1 < shape.runs.size() ? shape.runs[r + 1].first : shape.triangles.size();
      if (begin == end) continue;
      const std::uint32_t number = material.value_or(MeshAttributes::kNone);
      if (to.material_ranges.empty() ? number != MeshAttributes::kNone
                                     : to.material_ranges.back().index != number) {
        to.material_ranges.push_back({first + begin, number});
      }
      if (!material) continue;
      textures_wanted_[*material] = options_.textures;
      const GltfMaterial& look = document_.materials[*material];
      if (look.texture) add_corners(shape, begin, end, look, first, base, mirrored);
    }
  }

  void add_corners(const GltfShape& shape, std::size_t begin, std::size_t end,
                   const GltfMaterial& look, std::size_t first, std::uint32_t base, bool mirrored) {
    MeshAttributes& to = model_.attributes;
    if (to.corners.size() + 3 * (end - begin) > 0xffffffffu) {
      throw GltfRefusal{{ErrorCode::kLimit, data_.name() + ": too many corners have textures"}};
    }
    to.corner_offsets.resize(first + begin + 1, static_cast<std::uint32_t>(to.corners.size()));
    for (std::size_t t = begin; t < end; ++t) {
      for (int i = 0; i < 3; ++i) {
        const std::uint32_t v = shape.triangles[t][mirrored ? (3 - i) % 3 : i];
        const glm::vec2 place =
            shape.texture_places.empty() ? glm::vec2(0.0f) : shape.texture_places[v];
        to.corners.push_back({v + base, texture_place(look, place), glm::u8vec4(255)});
      }
      to.corner_offsets.push_back(static_cast<std::uint32_t>(to.corners.size()));
    }
  }

  void finish() {
    const TriangleSoup& soup = model_.soup;
    if (soup.triangles.empty() && !model_.losses.first.empty()) {
      refuse_gltf("{}; no triangle can be used", model_.losses.first);
    }
    if (soup.triangles.empty()) {
      refuse_gltf("{}: the scene has no triangles{}", data_.name(),
                  model_.ignored > 0 ? "; points and lines are not read" : "");
    }
    MeshAttributes& to = model_.attributes;
    if (options_.attributes) {
      add_materials(document_, data_, textures_wanted_, to, model_.warnings, model_.missing);
      if (!to.vertex_colours.empty()) {
        to.vertex_colours.resize(soup.positions.size(), glm::u8vec4(255));
      }
      if (!to.corner_offsets.empty()) {
        to.corner_offsets.resize(soup.triangles.size() + 1,
                                 static_cast<std::uint32_t>(to.corners.size()));
      }
    }
    model_.opened = data_.opened();
  }

  const GltfDocument& document_;
  GltfData& data_;
  const GltfOptions& options_;
  std::vector<std::uint32_t> parents_, order_;
  std::vector<glm::dmat4> worlds_;
  std::unordered_map<std::uint32_t, std::uint32_t> uses_;  // of meshes, by nodes
  std::unordered_map<std::uint32_t, GltfShape> shapes_;    // of meshes that are used again
  PartNames names_;
  std::vector<bool> textures_wanted_;
  bool mirrored_by_skin_ = false;
  GltfModel model_;
};

}  // namespace
}  // namespace detail

bool is_glb(std::string_view bytes) { return bytes.starts_with(detail::kMagic); }

Result<GltfModel> read_gltf(std::string_view bytes, const std::string& name,
                            const GltfOptions& options, const Execution& execution) {
  detail::GltfSource source;
  source.name = name;
  source.may_name = !options.standard_input;
  source.folder = std::filesystem::path(name).parent_path().string();
  source.root = options.root;
  try {
    const std::string_view json = is_glb(bytes) ? detail::open_glb(bytes, source) : bytes;
    const detail::GltfDocument document = detail::parse_gltf(json, name);
    detail::GltfData data(document, std::move(source), execution);
    return detail::SceneWalk(document, data, options).walk();
  } catch (const detail::GltfRefusal& refusal) {
    return tl::unexpected(refusal.error);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: not enough memory for the mesh of {} bytes", name,
                bytes.size());
  } catch (const std::length_error&) {
    return fail(ErrorCode::kLimit, "{}: not enough memory for the mesh of {} bytes", name,
                bytes.size());
  }
}

}  // namespace strata
