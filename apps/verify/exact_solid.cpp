// The only file of the tool that knows CGAL, whose Booleans are GPL. It takes minutes to compile.

#include "apps/verify/exact_solid.h"

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Nef_polyhedron_3.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polygon_mesh_processing/triangulate_faces.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/convert_nef_polyhedron_to_polygon_mesh.h>

#include <gmp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "apps/verify/fraction_sum.h"
#include "csg/geometry.h"

namespace strata::apps {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using csg::Operation;
using csg::Tree;
using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Point = Kernel::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;
using Nef = CGAL::Nef_polyhedron_3<Kernel>;

/// Corners of a result are made from corners of results, whose digits grow each time, and coplanar
/// pieces keep asking exact numbers. From here on Nef polyhedra, which make corners from the
/// solids' planes, are quicker: 12 nested boxes take 14 s with 1000 bits, over a minute with 3000.
constexpr std::size_t kMostBits = 1500;

/// What is no error of the input but the reason to go another way.
struct Refused {};
/// Ends the job.
struct Failed {
  Error error;
};

/// A solid's components, each closed and without self-intersection, oriented outward. Their union
/// is the solid.
using Components = std::vector<Mesh>;

/// Triangles with vertices welded by position; those without a third vertex are left out.
Mesh weld(const csg::Geometry::Part& part) {
  std::vector<Point> points;
  std::vector<std::array<std::size_t, 3>> faces;
  std::map<std::tuple<double, double, double>, std::size_t> indices;
  const auto vertex = [&](unsigned index) {
    const glm::dvec3 p = part.positions[index] + 0.0;  // -0 becomes +0
    const auto [found, added] = indices.try_emplace({p.x, p.y, p.z}, points.size());
    if (added) points.emplace_back(p.x, p.y, p.z);
    return found->second;
  };
  for (const glm::uvec3& t : part.triangles) {
    const std::array<std::size_t, 3> face{vertex(t.x), vertex(t.y), vertex(t.z)};
    if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0]) faces.push_back(face);
  }
  // Edges of four faces become two edges of two.
  if (!pmp::is_polygon_soup_a_polygon_mesh(faces)) pmp::orient_polygon_soup(points, faces);
  Mesh mesh;
  pmp::polygon_soup_to_polygon_mesh(points, faces, mesh);
  pmp::remove_degenerate_faces(mesh);
  return mesh;
}

/// Signed, of a closed mesh: tetrahedra of exact corners, summed as numbers of 64 bits.
double signed_volume(const Mesh& mesh) {
  if (mesh.number_of_faces() == 0) return 0;
  const Point& origin = mesh.point(*mesh.vertices().begin());
  long double sum = 0;
  for (const auto face : mesh.faces()) {
    const auto edge = mesh.halfedge(face);
    sum += CGAL::to_double(CGAL::volume(origin, mesh.point(mesh.source(edge)),
                                        mesh.point(mesh.target(edge)),
                                        mesh.point(mesh.target(mesh.next(edge)))));
  }
  return static_cast<double>(sum);
}

glm::dvec3 to_double(const Point& p) {
  return {CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z())};
}

/// Of length 1; 0 for a face without area.
glm::dvec3 normal_of(const Mesh& mesh, Mesh::Face_index face) {
  const auto edge = mesh.halfedge(face);
  const glm::dvec3 a = to_double(mesh.point(mesh.source(edge)));
  const glm::dvec3 across = glm::cross(to_double(mesh.point(mesh.target(edge))) - a,
                                       to_double(mesh.point(mesh.target(mesh.next(edge)))) - a);
  const double length = glm::length(across);
  return length > 0 ? across / length : glm::dvec3(0.0);
}

double creases_of(const Mesh& mesh) {
  double sum = 0;
  for (const auto edge : mesh.edges()) {
    const auto half = mesh.halfedge(edge);
    const glm::dvec3 turn = glm::abs(normal_of(mesh, mesh.face(half)) -
                                     normal_of(mesh, mesh.face(mesh.opposite(half))));
    sum += glm::length(to_double(mesh.point(mesh.target(half))) -
                       to_double(mesh.point(mesh.source(half)))) *
           (turn.x + turn.y + turn.z);
  }
  return sum;
}

/// GMP's number in a rational number, which CGAL takes from one library or another.
template <class Rational>
mpq_srcptr rational(const Rational& value) {
  if constexpr (requires { value.get_mpq_t(); }) {
    return value.get_mpq_t();
  } else if constexpr (requires { value.backend().data(); }) {
    return value.backend().data();
  } else {
    return value.mpq();
  }
}

/// Digits of the longest coordinate's numerator, base 2.
std::size_t bits_of(const Mesh& mesh) {
  std::size_t most = 0;
  for (const auto vertex : mesh.vertices()) {
    const auto& exact = CGAL::exact(mesh.point(vertex));
    for (int i = 0; i < 3; ++i) {
      most = std::max(most, mpz_sizeinbase(mpq_numref(rational(exact[i])), 2));
    }
  }
  return most;
}

double area_of(const Mesh& mesh) {
  long double sum = 0;
  for (const auto face : mesh.faces()) {
    const auto edge = mesh.halfedge(face);
    sum += std::sqrt(CGAL::to_double(CGAL::squared_area(mesh.point(mesh.source(edge)),
                                                        mesh.point(mesh.target(edge)),
                                                        mesh.point(mesh.target(mesh.next(edge))))));
  }
  return static_cast<double>(sum);
}

/// Turns meshes of the tree into what CGAL's operations may be given.
Components components_of(const csg::Geometry::Part& part, const std::string& name) {
  const auto refuse = [&name](const char* why) -> Failed {
    return {{ErrorCode::kGeometry, fmt::format("{}: CGAL cannot process it: {}", name, why)}};
  };
  if (part.triangles.empty()) return {};
  Mesh mesh = weld(part);
  if (mesh.number_of_faces() == 0) return {};
  if (!CGAL::is_closed(mesh)) throw refuse("it is open");
  if (!pmp::does_self_intersect(mesh)) {
    if (pmp::does_bound_a_volume(mesh)) return {std::move(mesh)};
    if (part.rule == InsideRule::kParity) {
      pmp::orient_to_bound_a_volume(mesh);
      return {std::move(mesh)};
    }
  }
  Components components;
  pmp::split_connected_components(mesh, components);
  bool outward = true, inward = true;
  for (const Mesh& component : components) {
    if (pmp::does_self_intersect(component)) throw refuse("faces of one component intersect");
    (signed_volume(component) > 0 ? inward : outward) = false;
  }
  // Winding numbers of components that face one way have one sign.
  if (outward && part.rule != InsideRule::kParity) return components;
  if (inward && part.rule == InsideRule::kWinding) return {};
  if (inward && part.rule == InsideRule::kNonzero) {
    for (Mesh& component : components) pmp::reverse_face_orientations(component);
    return components;
  }
  throw refuse("its components overlap and face both ways, or overlap under the parity rule");
}

bool apart(const CGAL::Bbox_3& a, const CGAL::Bbox_3& b) { return !CGAL::do_overlap(a, b); }

/// Evaluates the tree, by meshes as far as they go.
class Evaluator {
 public:
  Evaluator(const Tree& tree, const Execution& execution)
      : tree_(tree),
        execution_(execution),
        geometry_(tree, execution),
        solids_(tree.solids().size()) {}

  Mesh run(Tree::NodeId root) {
    if (root == Tree::kNone) return {};
    try {
      return mesh_of(root);
    } catch (const Refused&) {
      return mesh_from(nef_of(root), true);
    }
  }

  [[nodiscard]] const ExactSolid::Facts& facts() const { return facts_; }

 private:
  void check_stop() const {
    if (execution_.stop.stop_requested()) throw Failed{{ErrorCode::kCancelled, "stopped"}};
  }

  const Components& components(std::uint32_t solid) {
    std::optional<Components>& known = solids_[solid];
    if (!known) {
      const std::string& name = tree_.solids()[solid].name;
      known = components_of(geometry_.parts()[solid],
                            name.empty() ? fmt::format("solid {}", solid) : name);
      ++facts_.solids;
    }
    return *known;
  }

  // --- by corefinement --------------------------------------------------------------------------

  /// @throws Refused when no manifold comes out
  Mesh combine(Operation operation, Mesh& a, Mesh& b) {
    check_stop();
    const bool disjoint = a.is_empty() || b.is_empty() || apart(pmp::bbox(a), pmp::bbox(b));
    if (disjoint) {
      if (operation == Operation::kIntersection) return {};
      if (operation == Operation::kUnion) a += b;
      return std::move(a);
    }
    ++facts_.corefinements;
    Mesh result;
    bool done = false;
    try {
      const auto strict = CGAL::parameters::throw_on_self_intersection(true);
      if (operation == Operation::kUnion) {
        done = pmp::corefine_and_compute_union(a, b, result, strict);
      } else if (operation == Operation::kIntersection) {
        done = pmp::corefine_and_compute_intersection(a, b, result, strict);
      } else {
        done = pmp::corefine_and_compute_difference(a, b, result, strict);
      }
    } catch (const std::exception&) {
      throw Refused{};
    }
    if (!done) throw Refused{};
    result.collect_garbage();
    if (bits_of(result) > kMostBits) throw Refused{};
    return result;
  }

  /// Small ones first, so that work does not grow with the square of their number.
  Mesh unite(std::vector<Mesh> meshes) {
    while (meshes.size() > 1) {
      std::sort(meshes.begin(), meshes.end(), [](const Mesh& a, const Mesh& b) {
        return a.number_of_faces() > b.number_of_faces();
      });
      Mesh a = std::move(meshes.back());
      meshes.pop_back();
      Mesh b = std::move(meshes.back());
      meshes.pop_back();
      meshes.push_back(combine(Operation::kUnion, a, b));
    }
    return meshes.empty() ? Mesh{} : std::move(meshes.front());
  }

  /// By corefinement, or by Nef polyhedra for this node, if what comes out is a manifold again.
  Mesh mesh_of(Tree::NodeId node) {
    const Tree::Node& what = tree_.nodes()[node];
    if (what.operation == Operation::kSolid) return unite(components(what.first));
    try {
      const auto operands = tree_.operands(node);
      std::vector<Mesh> meshes;
      for (const Tree::NodeId operand : operands) meshes.push_back(mesh_of(operand));
      if (meshes.empty()) return {};
      if (what.operation == Operation::kUnion) return unite(std::move(meshes));
      Mesh result = std::move(meshes.front());
      meshes.erase(meshes.begin());
      if (what.operation == Operation::kIntersection) {
        for (Mesh& mesh : meshes) result = combine(Operation::kIntersection, result, mesh);
        return result;
      }
      Mesh taken = unite(std::move(meshes));
      return combine(Operation::kDifference, result, taken);
    } catch (const Refused&) {
      return mesh_from(nef_of(node), false);
    }
  }

  // --- by Nef polyhedra -------------------------------------------------------------------------

  Nef unite(std::vector<Nef> parts) {
    // The first two of a queue: all are of about one size.
    for (std::size_t first = 0; parts.size() - first > 1; first += 2) {
      check_stop();
      ++facts_.nef_operations;
      parts.push_back((parts[first] + parts[first + 1]).regularization());
      parts[first] = parts[first + 1] = Nef();
    }
    return parts.empty() ? Nef() : parts.back();
  }

  /// Kept until it is used: meshes may refuse again further up.
  const Nef& nef_of(Tree::NodeId node) {
    const auto known = nefs_.find(node);
    if (known != nefs_.end()) return known->second;
    Nef nef = make_nef(node);
    if (tree_.nodes()[node].operation != Operation::kSolid) {
      for (const Tree::NodeId operand : tree_.operands(node)) nefs_.erase(operand);
    }
    return nefs_.emplace(node, std::move(nef)).first->second;
  }

  Nef make_nef(Tree::NodeId node) {
    const Tree::Node& what = tree_.nodes()[node];
    std::vector<Nef> parts;
    if (what.operation == Operation::kSolid) {
      for (const Mesh& component : components(what.first)) parts.emplace_back(component);
      return unite(std::move(parts));
    }
    for (const Tree::NodeId operand : tree_.operands(node)) parts.push_back(nef_of(operand));
    if (parts.empty()) return {};
    if (what.operation == Operation::kUnion) return unite(std::move(parts));
    Nef result = parts.front();
    parts.erase(parts.begin());
    if (what.operation == Operation::kDifference) {
      if (parts.empty()) return result;
      parts = {unite(std::move(parts))};
    }
    for (const Nef& part : parts) {
      check_stop();
      ++facts_.nef_operations;
      const bool minus = what.operation == Operation::kDifference;
      // Only what has a volume counts: faces and points that are left over go.
      result = (minus ? result - part : result * part).regularization();
    }
    return result;
  }

  /// @throws Refused when it is no manifold, unless `touching` says that it may touch itself: no
  /// operation takes it then
  static Mesh mesh_from(const Nef& nef, bool touching) {
    if (nef.is_empty()) return {};
    if (!touching && !nef.is_simple()) throw Refused{};
    std::vector<Point> points;
    std::vector<std::vector<std::size_t>> faces;
    CGAL::convert_nef_polyhedron_to_polygon_soup(nef, points, faces, true);
    if (!pmp::is_polygon_soup_a_polygon_mesh(faces)) pmp::orient_polygon_soup(points, faces);
    Mesh mesh;
    pmp::polygon_soup_to_polygon_mesh(points, faces, mesh);
    pmp::triangulate_faces(mesh);
    if (!touching && (!CGAL::is_closed(mesh) || !pmp::does_bound_a_volume(mesh))) throw Refused{};
    return mesh;
  }

  const Tree& tree_;
  const Execution& execution_;
  csg::Geometry geometry_;
  std::vector<std::optional<Components>> solids_;
  std::map<Tree::NodeId, Nef> nefs_;
  ExactSolid::Facts facts_;
};

}  // namespace

struct ExactSolid::Impl {
  Mesh mesh;
  Facts facts;
  double volume = 0, area = 0, creases = 0;
  std::optional<CGAL::Side_of_triangle_mesh<Mesh, Kernel>> side;
};

ExactSolid::ExactSolid(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ExactSolid::~ExactSolid() = default;
ExactSolid::ExactSolid(ExactSolid&&) noexcept = default;
ExactSolid& ExactSolid::operator=(ExactSolid&&) noexcept = default;

bool ExactSolid::empty() const { return impl_->mesh.is_empty(); }
double ExactSolid::volume() const { return impl_->volume; }
double ExactSolid::area() const { return impl_->area; }
std::string ExactSolid::six_volumes() const {
  FractionSum sum;
  const Mesh& mesh = impl_->mesh;
  for (const auto face : mesh.faces()) {
    const auto edge = mesh.halfedge(face);
    const auto six =
        6 * CGAL::volume(Point(0, 0, 0), mesh.point(mesh.source(edge)),
                         mesh.point(mesh.target(edge)), mesh.point(mesh.target(mesh.next(edge))));
    sum.add(Fraction(rational(CGAL::exact(six))));
  }
  return sum.total().str();
}
double ExactSolid::creases() const { return impl_->creases; }
const ExactSolid::Facts& ExactSolid::facts() const { return impl_->facts; }

ExactSolid::Side ExactSolid::side_of(const glm::dvec3& point) const {
  if (!impl_->side) return Side::kOutside;
  switch ((*impl_->side)(Point(point.x, point.y, point.z))) {
    case CGAL::ON_BOUNDED_SIDE:
      return Side::kInside;
    case CGAL::ON_BOUNDARY:
      return Side::kBoundary;
    default:
      return Side::kOutside;
  }
}

Result<ExactSolid> ExactSolid::evaluate(const Tree& tree, Tree::NodeId root,
                                        const Execution& execution) try {
  Evaluator evaluator(tree, execution);
  auto impl = std::make_unique<Impl>();
  impl->mesh = evaluator.run(root);
  impl->facts = evaluator.facts();
  impl->facts.triangles = impl->mesh.number_of_faces();
  impl->volume = signed_volume(impl->mesh);
  impl->area = area_of(impl->mesh);
  impl->creases = creases_of(impl->mesh);
  if (!impl->mesh.is_empty()) impl->side.emplace(impl->mesh);
  return ExactSolid(std::move(impl));
} catch (const Failed& failed) {
  return tl::unexpected(failed.error);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "out of memory in CGAL");
} catch (const std::exception& failure) {
  return fail(ErrorCode::kInternal, "CGAL: {}", failure.what());
} catch (const Refused&) {
  return fail(ErrorCode::kInternal, "CGAL finds no result");
}

}  // namespace strata::apps
