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

/// Internal parts of the scene reader.
namespace strata::csg {

/// The operation that a module applies to its children, or kLeaf.
enum class NodeKind : std::uint8_t {
  kUnion,  ///< group, union, render, color, multmatrix, and unknown modules
  kDifference,
  kIntersection,
  // The following kinds evaluate their children in a frame of their own, without the transform
  // outside.
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

/// One piece of geometry that is passed up: a node of the tree, or a flat region.
struct Operand {
  Tree::NodeId solid = Tree::kNone;
  Outline outline;
  std::optional<glm::vec4> colour;  ///< colour of an outline
  std::uint32_t node = 0;           ///< node of the Ast that made it
  std::uint32_t child = 0;          ///< number of the child of the node that takes it
  std::uint32_t highlight = 0;      ///< number of the `#` that it belongs to; 0: none
  glm::dmat4 place{1.0};            ///< an outline's whole transform, which places its slab
  bool flat = false;
};

enum class Dimension : std::uint8_t { kNone, kFlat, kSolid };

/// Turns an Ast into a Scene, in one walk in preorder with a stack of open nodes: deep nesting only
/// costs memory. Transforms and colours are passed down to the leaves. Solids are passed up as
/// nodes of the scene's tree. Nodes of kind kUnion do not combine their children: the operands stay
/// on the stack for the node around them.
class Evaluator {
 public:
  /// @param folder  folder for relative file names; empty: the working directory
  /// @param root  folder that all files of the scene must lie in; empty: any folder
  Evaluator(const Ast& ast, const Execution& execution, std::string folder, std::string root = {});
  Result<Scene> run();

 private:
  struct Context {
    glm::dmat4 world{1.0};  ///< transform to the nearest enclosing node that has a frame
    glm::dmat3 plane{1.0};  ///< the same transform for flat geometry
    glm::dmat4 outer{1.0};  ///< from that frame to the world, as far as it is known; for ghosts
    std::optional<glm::vec4> colour;
    bool highlighted = false;     ///< inside a `#`
    bool keep_flattened = false;  ///< keep solids without volume, which hull and minkowski accept
  };
  struct Frame {
    std::uint32_t node = 0;  ///< index in the Ast; its size for the top level
    std::uint32_t end = 0;
    NodeKind kind = NodeKind::kUnion;
    Dimension dimension = Dimension::kNone;
    bool emptied = false;  ///< an operand that decides the result is empty
    std::uint8_t modifiers = 0;
    std::uint32_t children = 0;
    std::size_t base = 0;  ///< index of its first operand
    Context outside;       ///< context of the node itself
    Context inside;        ///< context of its children
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
  /// Makes one node of a range of operands and takes them: copy the operands, or the node, for
  /// further use. @param placed  puts outlines where their transforms in space say
  Tree::NodeId ghost(std::size_t begin, std::size_t end, bool placed = false);
  /// Turns highlighted operands into ghosts and removes their mark.
  void show_highlights(std::size_t begin, std::size_t end, const glm::dmat4& outer);
  /// Shows the operands that the result leaves out because they are flat beside solids, or solid
  /// beside outlines. @return whether there are any
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
  /// Finds the file that a node asks for and adds it to the scene's files. Returns nothing if the
  /// file is left out or refused; the message has been given then.
  [[nodiscard]] std::optional<std::string> asset(std::uint32_t node, const std::string& file);

  // evaluate_arguments.cpp: reads arguments and warns of bad ones
  /// The number that is given, else `otherwise`.
  [[nodiscard]] double number(std::uint32_t node, std::string_view argument, const ValueRef& value,
                              double otherwise);
  [[nodiscard]] double number(std::uint32_t node, std::string_view argument, double otherwise) {
    return number(node, argument, arguments(node).find(argument), otherwise);
  }
  /// Reads the argument `size`: one number for all sizes, or one for each.
  void read_sizes(std::uint32_t node, std::span<double> sizes);
  /// Reads the argument `newsize` of resize. A missing or bad size is 0.
  void read_new_size(std::uint32_t node, std::span<double> sizes);
  /// Reads a radius. If the diameter is given instead, returns its half.
  [[nodiscard]] double radius(std::uint32_t node, std::string_view radius,
                              std::string_view diameter, std::uint32_t position, double otherwise);
  /// Reads $fn, $fa and $fs.
  [[nodiscard]] Segments segments(std::uint32_t node);
  /// Whether a length is valid: finite and not negative. A length of 0 is valid and makes nothing.
  bool is_length(std::uint32_t node, std::string_view argument, double length);

  // evaluate_operation.cpp: nodes with a frame of their own; they replace the operands from `base`
  // on
  void operate(Frame& frame);
  void replace_operands(Frame& frame);
  void hull(Frame& frame);
  void minkowski(Frame& frame);
  void add_sum(const Frame& frame, std::vector<MinkowskiPart> sum,
               std::span<const Tree::NodeId> sources);
  /// An execution for long work on one node. Its progress is the node's part of the file.
  [[nodiscard]] Execution part_execution(const Frame& frame);
  void resize(Frame& frame);
  void projection(Frame& frame);
  void linear_extrude(Frame& frame);
  void rotate_extrude(Frame& frame);
  void flat_operation(Frame& frame);
  void flat_minkowski(Frame& frame);
  void flat_resize(Frame& frame, const Outline& outline);
  void offset(Frame& frame, const Outline& outline);
  /// Unites all outlines from `base` on into one region.
  [[nodiscard]] Outline united(std::size_t base);
  /// Unites all solids from `base` on into one node.
  [[nodiscard]] Tree::NodeId united_solid(std::size_t base);
  /// Triangles that include the boundary of the operand and lie nowhere outside it.
  [[nodiscard]] TriangleSoup boundary_mesh(std::uint32_t node, Tree::NodeId solid);

  // evaluate_parts.cpp
  void add_solid(std::uint32_t node, const Context& context,
                 std::shared_ptr<const TriangleSoup> mesh, InsideRule rule = InsideRule::kWinding);
  void add_solid(std::uint32_t node, const Context& context, TriangleSoup mesh,
                 InsideRule rule = InsideRule::kWinding);
  void add_outline(std::uint32_t node, const Context& context, Outline outline);
  /// Checks whether an imported mesh is closed and faces outward. Reverses it if it does not, and
  /// warns.
  [[nodiscard]] InsideRule inspect(std::uint32_t node, TriangleSoup& mesh);
  void warn(std::uint32_t node, std::string code, std::string_view text);
  void stop(ErrorCode code, std::uint32_t node, std::string_view text);
  /// The kind of items that a node makes, for limits.
  enum class Made { kTriangles, kPoints };
  /// Checks, before a node makes `count` items, that they are within the limits; otherwise ends the
  /// run. @param of  their origin, such as "360 segments"
  [[nodiscard]] bool fits(std::uint32_t node, std::string_view of, double count, Made made);
  /// Warns that the error leaves something out: `error; what`. Limits, above all that of memory,
  /// and a stop by the user end the whole run instead: any other picture would be wrong.
  void leave_out(std::uint32_t node, std::string code, const Error& error, std::string_view what);
  /// Whether work on flat geometry ended early; then ends the run.
  bool job_ended(std::uint32_t node);
  [[nodiscard]] std::string place(std::uint32_t node) const;
  [[nodiscard]] std::string_view name(std::uint32_t node) const;
  [[nodiscard]] NodeArguments arguments(std::uint32_t node) const {
    return {ast_, ast_.nodes[node]};
  }

  const Ast& ast_;
  const Execution& execution_;
  std::string folder_, root_;
  std::set<std::string> asked_for_;   ///< paths of files that were requested
  std::uint32_t highlights_ = 0;      ///< number of `#` so far
  std::vector<Tree::NodeId> beside_;  ///< shown, but not part of the result
  bool leftovers_ = false;            ///< the tree has nodes that belong to nothing
  bool newer_ = false;                ///< the file has the dialect after 2021.01
  Scene scene_;
  std::uint32_t walk_first_ = 0, walk_end_ = 0;  ///< range of nodes in the walk
  double made_bytes_ = 0;                        ///< estimated size of the meshes so far
  double reported_ = 0;                          ///< last progress
  std::vector<Frame> frames_;
  std::vector<Operand> operands_;
  std::uint64_t warnings_left_out_ = 0;
  std::optional<Error> error_;
  OutlineJob job_;  ///< limits for flat geometry
  using PrimitiveKey = std::pair<std::string_view, std::vector<double>>;
  std::map<PrimitiveKey, std::shared_ptr<const TriangleSoup>> primitives_;
  struct Imported {
    std::shared_ptr<const TriangleSoup> mesh;
    InsideRule rule = InsideRule::kWinding;
  };
  std::map<std::pair<std::string, bool>, Imported> imports_;  ///< by path and whether centred
};

}  // namespace strata::csg
