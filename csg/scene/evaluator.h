#pragma once

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "csg/outline/outline.h"
#include "csg/scene/csg_parser.h"
#include "csg/scene/node_arguments.h"
#include "csg/solids/minkowski.h"
#include "strata/csg/scene/scene.h"

/// Parts of the scene reader; not for users of the library.
namespace strata::csg {

/// What a module does to its children, or that it is a leaf.
enum class NodeKind : std::uint8_t {
  kUnion,  ///< group, union, render, color, multmatrix, and what is unknown
  kDifference,
  kIntersection,
  // From here on children are evaluated in a frame of their own, without the transform outside.
  kHull,
  kMinkowski,
  kResize,
  kProjection,
  kLinearExtrude,
  kRotateExtrude,
  kOffset,
  kFill,
  kRoof,
  kLeaf
};

/// One piece of geometry on its way up: a node of the tree, or a flat region.
struct Operand {
  Tree::NodeId solid = Tree::kNone;
  Outline outline;
  std::optional<glm::vec4> colour;  ///< of an outline
  std::uint32_t node = 0;           ///< of the Ast, where it comes from
  std::uint32_t child = 0;          ///< which child of the node that takes it
  std::uint32_t highlight = 0;      ///< number of the `#` that it is of; 0: none
  glm::dmat4 place{1.0};            ///< of an outline's slab in pictures: all of its transform
  bool flat = false;
};

enum class Dimension : std::uint8_t { kNone, kFlat, kSolid };

/// Turns an Ast into a Scene: one walk in preorder with a stack of open nodes, so that nesting
/// costs memory and nothing else. Transforms and colours go down to the leaves; solids that come
/// back are nodes of the scene's tree. Nodes of the union kind do not combine their children: the
/// operands stay on the stack for whoever does.
class Evaluator {
 public:
  /// @param folder  of relative file names; empty: where the process runs
  /// @param root  the scene may read files below it only; empty: everywhere
  Evaluator(const Ast& ast, const Execution& execution, std::string folder, std::string root = {});
  Result<Scene> run();

 private:
  struct Context {
    glm::dmat4 world{1.0};  ///< to the frame of the nearest node that has one
    glm::dmat3 plane{1.0};  ///< the same for flat geometry
    glm::dmat4 outer{1.0};  ///< from that frame to the world as far as it is known; for ghosts
    std::optional<glm::vec4> colour;
    bool highlighted = false;     ///< inside a `#` already
    bool keep_flattened = false;  ///< hull and minkowski take solids without volume
  };
  struct Frame {
    std::uint32_t node = 0;  ///< of the Ast; its size for the top level
    std::uint32_t end = 0;
    NodeKind kind = NodeKind::kUnion;
    Dimension dimension = Dimension::kNone;
    bool emptied = false;  ///< an operand that decides is empty
    std::uint8_t modifiers = 0;
    std::uint32_t children = 0;
    std::size_t base = 0;  ///< first of its operands
    Context outside;       ///< of the node itself
    Context inside;        ///< of its children
  };

  // evaluate.cpp: the walk
  void walk(std::uint32_t first, std::uint32_t end);
  void report(double done);
  void enter(std::uint32_t node);
  void leave();
  void combine(Frame& frame);
  void combine_flat(Frame& frame);
  void finish(std::uint32_t node, std::uint8_t modifiers, const Context& outside, std::size_t base,
              Dimension dimension);
  void take_child(Frame& parent, std::uint32_t node, std::size_t base, Dimension dimension);
  bool enter_transform(Frame& frame);
  void enter_colour(Frame& frame);
  /// Operands as one node. It takes them: they, or it, must be copied if they are used further.
  /// @param placed  outlines stand where their transforms in space put them
  Tree::NodeId ghost(std::size_t begin, std::size_t end, bool placed = false);
  /// Operands that are highlighted become ghosts, and are no longer marked.
  void show_highlights(std::size_t begin, std::size_t end, const glm::dmat4& outer);
  /// Operands that the result is without, since they are flat beside solids or the other way
  /// around: pictures may show them. @return whether they do
  bool show_beside(std::size_t base);
  [[nodiscard]] bool all_highlighted(std::size_t begin, std::size_t end) const;
  void make_slabs(std::size_t base);
  void drop_leftovers();
  Scene take_scene();

  // evaluate_leaf.cpp
  void leaf(std::uint32_t node, const Context& context);
  template <class Make>
  std::shared_ptr<const TriangleSoup> primitive(std::uint32_t node, std::vector<double> key,
                                                double segments, double triangles,
                                                const Make& make);
  void cube(std::uint32_t node, const Context& context);
  void sphere(std::uint32_t node, const Context& context);
  void cylinder(std::uint32_t node, const Context& context);
  void polyhedron(std::uint32_t node, const Context& context);
  void square(std::uint32_t node, const Context& context);
  void circle(std::uint32_t node, const Context& context);
  void polygon(std::uint32_t node, const Context& context);
  void text(std::uint32_t node, const Context& context);
  void surface(std::uint32_t node, const Context& context);
  void import(std::uint32_t node, const Context& context);
  [[nodiscard]] Outline import_outline(std::uint32_t node, const std::string& path);
  /// Where the file is that a node asks for; kept among the files of the scene. Empty: left out, or
  /// refused, as has been said.
  [[nodiscard]] std::optional<std::string> asset(std::uint32_t node, const std::string& file);

  // evaluate_arguments.cpp: what is not as it should be is named in a warning
  /// The number that is given, else `otherwise`.
  [[nodiscard]] double number(std::uint32_t node, std::string_view argument, const ValueRef& value,
                              double otherwise);
  [[nodiscard]] double number(std::uint32_t node, std::string_view argument, double otherwise) {
    return number(node, argument, arguments(node).find(argument), otherwise);
  }
  /// The argument `size`: one number for all, or as many as `sizes` has.
  void read_sizes(std::uint32_t node, std::span<double> sizes);
  /// The argument `newsize` of resize; 0 where a size is not given or none.
  void read_new_size(std::uint32_t node, std::span<double> sizes);
  /// A radius, or half the diameter that is given instead.
  [[nodiscard]] double radius(std::uint32_t node, std::string_view radius,
                              std::string_view diameter, std::uint32_t position, double otherwise);
  /// $fn, $fa and $fs.
  [[nodiscard]] Segments segments(std::uint32_t node);
  /// Whether a length may be one: finite and not negative. 0 may, it makes nothing.
  bool is_length(std::uint32_t node, std::string_view argument, double length);

  // evaluate_operation.cpp: nodes with a frame of their own; operands from `base` on are replaced
  void operate(Frame& frame);
  void replace_operands(Frame& frame);
  void hull(Frame& frame);
  void minkowski(Frame& frame);
  void add_sum(const Frame& frame, std::vector<MinkowskiPart> sum,
               std::span<const Tree::NodeId> sources);
  /// For long work on one node: its progress is the node's part of the file.
  [[nodiscard]] Execution part_execution(const Frame& frame);
  void resize(Frame& frame);
  void projection(Frame& frame);
  void linear_extrude(Frame& frame);
  void rotate_extrude(Frame& frame);
  void flat_operation(Frame& frame);
  /// All outlines from `base` on as one region.
  [[nodiscard]] Outline united(std::size_t base);
  /// All solids from `base` on as one node.
  [[nodiscard]] Tree::NodeId united_solid(std::size_t base);
  /// Triangles that hold the boundary of the operand, and nothing outside it.
  [[nodiscard]] TriangleSoup boundary_mesh(std::uint32_t node, Tree::NodeId solid);

  // evaluate_parts.cpp
  void add_solid(std::uint32_t node, const Context& context,
                 std::shared_ptr<const TriangleSoup> mesh, InsideRule rule = InsideRule::kWinding);
  void add_solid(std::uint32_t node, const Context& context, TriangleSoup mesh,
                 InsideRule rule = InsideRule::kWinding);
  void add_outline(std::uint32_t node, const Context& context, Outline outline);
  /// Looks whether a mesh from outside is closed and outward, turns it if not, warns.
  [[nodiscard]] InsideRule inspect(std::uint32_t node, TriangleSoup& mesh);
  void warn(std::uint32_t node, std::string code, std::string_view text);
  void stop(ErrorCode code, std::uint32_t node, std::string_view text);
  /// What a node makes, as far as limits go.
  enum class Made { kTriangles, kPoints };
  /// Before a node makes so many: whether they are within the limits. Else the run ends.
  /// @param of  what they come from: "360 segments"
  [[nodiscard]] bool fits(std::uint32_t node, std::string_view of, double count, Made made);
  /// Warns that the error leaves something out: `error; what`. What a limit, the memory's above
  /// all, or the user has stopped ends the whole run: another picture would be wrong.
  void leave_out(std::uint32_t node, std::string code, const Error& error, std::string_view what);
  /// Whether work on flat geometry ended early, which then ends the run.
  bool job_ended(std::uint32_t node);
  [[nodiscard]] std::string place(std::uint32_t node) const;
  [[nodiscard]] std::string_view name(std::uint32_t node) const;
  [[nodiscard]] NodeArguments arguments(std::uint32_t node) const {
    return {ast_, ast_.nodes[node]};
  }

  const Ast& ast_;
  const Execution& execution_;
  std::string folder_, root_;
  std::set<std::string> asked_for_;   ///< paths of files
  std::uint32_t highlights_ = 0;      ///< numbers of `#` given
  std::vector<Tree::NodeId> beside_;  ///< shown, but no part of the result
  bool leftovers_ = false;            ///< the tree has nodes that are part of nothing
  bool newer_ = false;                ///< the dialect after 2021.01
  Scene scene_;
  std::uint32_t walk_first_ = 0, walk_end_ = 0;  ///< nodes
  double made_bytes_ = 0;                        ///< of the meshes so far, estimated
  double reported_ = 0;                          ///< progress
  std::vector<Frame> frames_;
  std::vector<Operand> operands_;
  std::uint64_t warnings_left_out_ = 0;
  std::optional<Error> error_;
  OutlineJob job_;  ///< of flat geometry
  using PrimitiveKey = std::pair<std::string_view, std::vector<double>>;
  std::map<PrimitiveKey, std::shared_ptr<const TriangleSoup>> primitives_;
  struct Imported {
    std::shared_ptr<const TriangleSoup> mesh;
    InsideRule rule = InsideRule::kWinding;
  };
  std::map<std::pair<std::string, bool>, Imported> imports_;  ///< by path, and whether centred
};

/// Looks at solids that reach far out: warns of those whose faces are not known well enough for
/// what they meet. @return kGeometry naming the first solid that cannot be worked with
Result<void> check_coordinates(Scene& scene);

}  // namespace strata::csg
