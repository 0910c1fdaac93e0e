#include "strata/csg/input/see_through.h"

#include <algorithm>
#include <new>
#include <set>
#include <utility>

#include "csg/input/tree_fragments.h"
#include "csg/picture/shade.h"
#include "csg/surface/surface_tiles.h"
#include "csg/translucent/translucent.h"
#include "strata/mesh/soup_tools.h"

namespace strata::csg {
namespace {

constexpr float kUsualOpacity = 0.5f;

/// Opacity of what is not transparent by its own colour.
float opacity_of(const Scene& scene, const SeeThroughOptions& options) {
  if (options.opacity) return *options.opacity;
  const auto solids = scene.tree.solids();
  bool any = !scene.backgrounds.empty() || !scene.highlights.empty() ||
             std::any_of(solids.begin(), solids.end(),
                         [](const Solid& solid) { return solid.colour && solid.colour->a < 1.0f; });
  for (const MeshAttributes& of_solid : options.attributes) {
    for (const SurfaceMaterial& material : of_solid.materials) {
      any = any || material.colour.a < 1.0f;
    }
  }
  return any ? 1.0f : kUsualOpacity;
}

/// All triangles of meshes, object by object.
class FaceCollector {
 public:
  FaceCollector(const glm::vec4& usual, transparency::Scene& scene)
      : usual_(usual), scene_(scene) {}

  Result<void> add(const Solid& solid, const MeshAttributes* attributes) {
    if (!solid.mesh || solid.mesh->triangles.empty()) return {};
    const TriangleSoup& mesh = *solid.mesh;
    const std::uint64_t vertices = scene_.mesh.positions.size() + mesh.positions.size();
    const std::uint64_t triangles = scene_.mesh.triangles.size() + mesh.triangles.size();
    if (vertices > 0xfffffffeu || triangles > 0x7fffffffu) {
      return fail(ErrorCode::kLimit, "the meshes have {} triangles together; the limit is {}",
                  triangles, 0x7fffffffu);
    }
    const auto first = static_cast<std::uint32_t>(scene_.mesh.positions.size());
    for (const glm::dvec3& position : mesh.positions) {
      scene_.mesh.positions.emplace_back(solid.world_from_mesh * glm::dvec4(position, 1.0));
    }
    const bool mirrored = glm::determinant(glm::dmat3(solid.world_from_mesh)) < 0.0;
    for (glm::uvec3 triangle : mesh.triangles) {
      if (mirrored) std::swap(triangle.y, triangle.z);
      scene_.mesh.triangles.push_back(triangle + first);
    }
    const auto object = static_cast<std::uint32_t>(scene_.objects.size());
    scene_.objects.push_back({solid.name, seen_through(colour_or(solid.colour, usual_))});
    scene_.object_of.resize(triangles, object);
    if (attributes != nullptr && !attributes->materials.empty()) {
      add_materials(solid, *attributes, triangles - mesh.triangles.size());
    }
    return {};
  }

 private:
  /// Triangles from `first` on get objects by their materials.
  void add_materials(const Solid& solid, const MeshAttributes& attributes, std::uint64_t first) {
    const auto base = static_cast<std::uint32_t>(scene_.objects.size());
    for (const SurfaceMaterial& material : attributes.materials) {
      const glm::vec3 colour(material.coloured ? material.colour : usual_);
      const float alpha = material.colour.a < 1.0f ? material.colour.a : usual_.a;
      scene_.objects.push_back({fmt::format("{}: {}", solid.name, material.name),
                                seen_through(glm::vec4(colour, alpha)), base - 1});
    }
    const auto& elements = solid.mesh->face_elements;
    for (std::size_t t = 0; t < solid.mesh->triangles.size(); ++t) {
      const std::uint32_t material = attributes.material_of(elements.empty() ? t : elements[t]);
      if (material != MeshAttributes::kNone) scene_.object_of[first + t] = base + material;
    }
  }

  [[nodiscard]] glm::vec4 seen_through(const glm::vec4& colour) const {
    return colour.a < 1.0f ? colour : glm::vec4(glm::vec3(colour), usual_.a);
  }

  glm::vec4 usual_;
  transparency::Scene& scene_;
};

/// The solid operands of the unions at the top. @return kUsage naming a part that is none
Result<std::vector<std::uint32_t>> united_solids(const Tree& tree) {
  std::vector<std::uint32_t> solids;
  if (tree.root() == Tree::kNone) return solids;
  std::vector<Tree::NodeId> stack{tree.root()};
  while (!stack.empty()) {
    const Tree::Node& node = tree.nodes()[stack.back()];
    const Tree::NodeId id = stack.back();
    stack.pop_back();
    if (node.operation == Operation::kSolid) {
      solids.push_back(node.first);
    } else if (node.operation == Operation::kUnion) {
      const auto operands = tree.operands(id);
      stack.insert(stack.end(), operands.rbegin(), operands.rend());
    } else {
      return fail(ErrorCode::kUsage,
                  "a part of the scene is {} of solids; whole solids are needed here",
                  node.operation == Operation::kDifference ? "a difference" : "an intersection");
    }
  }
  return solids;
}

/// What is drawn of a scene, ghosts included.
std::vector<Ghost> ghosts_of(const Scene& scene) {
  std::vector<Ghost> ghosts;
  for (const Tree::NodeId node : scene.backgrounds) ghosts.push_back({node, kBackgroundGhost});
  for (const Tree::NodeId node : scene.highlights) ghosts.push_back({node, kHighlightGhost});
  return ghosts;
}

/// A scene with Boolean operations, prepared to be seen from anywhere.
struct SeenTree {
  SeenTree(Tree all, const std::vector<Ghost>& ghosts, double relative_precision,
           const ColourScheme& colours, const Execution& execution)
      : tree(std::move(all)),
        opaque_root(take_translucent(tree, translucent)),
        geometry(tree, execution),
        opaque(compile(tree, opaque_root)),
        trees(tree, with_ghosts(ghosts), geometry, geometry.world_error(tree, relative_precision)),
        scheme(colours) {}

  std::span<const Translucent> with_ghosts(const std::vector<Ghost>& ghosts) {
    for (const Ghost& ghost : ghosts) translucent.push_back({ghost.node, ghost.colour});
    return translucent;
  }
  [[nodiscard]] bool any_opaque() const {
    if (opaque_root == Tree::kNone) return false;
    const Tree::Node& node = tree.nodes()[opaque_root];
    return node.operation == Operation::kSolid || node.count > 0;
  }
  [[nodiscard]] Result<View> view(const Camera& camera, const glm::ivec2& size,
                                  const Execution& execution) const {
    std::vector<Tree::NodeId> shown{tree.root()};
    for (const Translucent& part : translucent) shown.push_back(part.node);
    return view_of_tree(tree, geometry, shown, camera, size, execution);
  }

  Tree tree;
  std::vector<Translucent> translucent;
  Tree::NodeId opaque_root;
  Geometry geometry;
  Program opaque;
  TranslucentTrees trees;
  ColourScheme scheme;
};

}  // namespace

struct SeeThrough::Parts {
  float opacity = 1.0f;
  std::uint64_t objects = 0, triangles = 0;
  Bounds box;  ///< of `faces`
  std::optional<transparency::Scene> faces;
  std::shared_ptr<SeenTree> tree;  ///< instead

  Result<void> take_faces(const Scene& scene, const SeeThroughOptions& options,
                          const ColourScheme& scheme) {
    const auto solids = united_solids(scene.tree);
    if (!solids) return tl::unexpected(solids.error());
    faces.emplace();
    FaceCollector collector(glm::vec4(glm::vec3(scheme.face) / 255.0f, opacity), *faces);
    for (const std::uint32_t solid : *solids) {
      const MeshAttributes* attributes =
          solid < options.attributes.size() ? &options.attributes[solid] : nullptr;
      auto added = collector.add(scene.tree.solids()[solid], attributes);
      if (!added) return added;
    }
    box = bounds(faces->mesh);
    objects = std::set<std::uint32_t>(faces->object_of.begin(), faces->object_of.end()).size();
    triangles = faces->mesh.triangles.size();
    return {};
  }
  void take_tree(Scene scene, const ColourScheme& scheme, const Execution& execution) {
    for (Solid& solid : scene.tree.solids()) {
      if (opacity < 1.0f) {
        if (!solid.colour) solid.colour = glm::vec4(kSchemeColour, opacity);
        if (solid.colour->a >= 1.0f) solid.colour->a = opacity;
      }
      if (solid.mesh) triangles += solid.mesh->triangles.size();
    }
    if (!scene.shown.empty()) {
      scene.tree.set_root(scene.tree.add(Operation::kUnion, scene.shown));
    }
    const std::vector<Ghost> ghosts = ghosts_of(scene);
    tree = std::make_shared<SeenTree>(std::move(scene.tree), ghosts, scene.relative_precision,
                                      scheme, execution);
    objects = tree->trees.parts().size() + (tree->any_opaque() ? 1 : 0);
  }
  Result<transparency::Frame> tree_frame(const View& view,
                                         const transparency::FrameOptions& options,
                                         const Execution& execution) const {
    const auto [across, down] = sample_grid(options.samples);
    if (view.size.x > kMaxPictureSide / across || view.size.y > kMaxPictureSide / down) {
      return fail(ErrorCode::kUsage,
                  "a picture with its samples must be 1 to {} wide and high, got {} x {}",
                  kMaxPictureSide, std::int64_t{view.size.x} * across,
                  std::int64_t{view.size.y} * down);
    }
    const TreeFragmentsInput input{tree->trees, band_of(view, 0, view.size.y, across, down),
                                   tree->any_opaque() ? &tree->opaque : nullptr};
    const Shader shader(tree->tree, tree->geometry, input.view, tree->scheme);
    auto source = make_tree_fragments(input, shader, tree, execution);
    if (!source) return tl::unexpected(source.error());
    return transparency::Frame(std::move(*source), options);
  }
};

Result<SeeThrough> SeeThrough::make(Scene scene, const SeeThroughOptions& options,
                                    const Execution& execution) try {
  if (options.opacity && !(*options.opacity >= 0.0f && *options.opacity <= 1.0f)) {
    return fail(ErrorCode::kUsage, "the opacity must be 0 to 1, got {}", *options.opacity);
  }
  const ColourScheme& scheme = options.scheme != nullptr ? *options.scheme : default_scheme();
  SeeThrough result;
  result.parts_ = std::make_shared<Parts>();
  result.parts_->opacity = opacity_of(scene, options);
  if (options.all_faces) {
    auto taken = result.parts_->take_faces(scene, options, scheme);
    if (!taken) return tl::unexpected(taken.error());
  } else {
    result.parts_->take_tree(std::move(scene), scheme, execution);
  }
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return result;
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "out of memory for the triangles of the scene");
}

Result<View> SeeThrough::view(const Camera& camera, const glm::ivec2& size,
                              const Execution& execution) const {
  if (parts_->tree) return parts_->tree->view(camera, size, execution);
  auto view = make_view(camera, size, parts_->box);
  if (!view || !view->cut_short) return view;
  // The eye is among the faces: the nearest one decides where depths begin.
  return Preview(Tree(parts_->faces->mesh), {}, 0.0, execution).view(camera, size, execution);
}

Result<transparency::Frame> SeeThrough::frame(const Camera& camera, const glm::ivec2& size,
                                              const transparency::FrameOptions& options,
                                              const Execution& execution) const try {
  if (auto good = check_samples(options.samples); !good) return tl::unexpected(good.error());
  const auto seen = view(camera, size, execution);
  if (!seen) return tl::unexpected(seen.error());
  if (parts_->tree) return parts_->tree_frame(*seen, options, execution);
  return transparency::Frame::make(*parts_->faces, *seen, options, execution);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "out of memory for a picture of {} x {} pixels", size.x, size.y);
}

const transparency::Scene* SeeThrough::faces() const {
  return parts_->faces ? &*parts_->faces : nullptr;
}
float SeeThrough::opacity() const { return parts_->opacity; }
std::uint64_t SeeThrough::objects() const { return parts_->objects; }
std::uint64_t SeeThrough::triangles() const { return parts_->triangles; }

}  // namespace strata::csg
