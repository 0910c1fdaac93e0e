#include "apps/verify/snapped_volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "apps/verify/fraction_sum.h"
#include "csg/boundary/boundary_arrangement.h"
#include "csg/boundary/open_edges.h"
#include "csg/geometry.h"
#include "csg/lattice/lattice_solids.h"

namespace strata::apps {
namespace {

using csg::BoundaryFaces;
using csg::LatticeSolids;
using csg::Tree;
using Whole = boost::multiprecision::mpz_int;
using Vector = std::array<Fraction, 3>;

template <int kWords>
Whole whole(const exact::Wide<kWords>& value) {
  Whole result = static_cast<std::int64_t>(value.word[kWords - 1]);
  for (int i = kWords - 2; i >= 0; --i) result = (result << 64) + value.word[i];
  return result;
}

Vector vector_of(const exact::LatticePoint& p) { return {p.x, p.y, p.z}; }

Vector vector_of(const exact::RationalPoint& p) {
  const Whole w = whole(p.w);
  return {Fraction(whole(p.x), w), Fraction(whole(p.y), w), Fraction(whole(p.z), w)};
}

Fraction determinant(const Vector& a, const Vector& b, const Vector& c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/// Sums tetrahedra of the origin: with faces that are triangles, and with triangles from a point of
/// each plane to the edges of its faces.
Fraction six_volumes(const BoundaryFaces& faces) {
  FractionSum sum;
  const auto point = [&](std::uint32_t p) { return vector_of(faces.points.rational(p)); };
  for (const BoundaryFaces::Whole& whole_face : faces.wholes) {
    const glm::uvec3& t = whole_face.points;
    sum.add(determinant(point(t.x), point(t.y), point(t.z)));
  }
  for (const csg::BoundaryPlane& plane : faces.planes) {
    const Vector base = vector_of(plane.plane.base);
    for (std::uint32_t e = 0; e < plane.edge_count; ++e) {
      const csg::BoundaryEdge& edge = faces.edges[plane.first_edge + e];
      sum.add(determinant(base, point(edge.from), point(edge.to)));
    }
  }
  return sum.total();
}

/// The tree with other meshes: those of `solids`, in steps.
Tree with_solids(Tree tree, const LatticeSolids& solids) {
  for (std::size_t s = 0; s < solids.solid_count(); ++s) {
    auto mesh = std::make_shared<TriangleSoup>();
    std::uint32_t least = ~0u, end = 0;  // a solid's vertices are a range
    for (auto t = solids.first_triangle[s]; t < solids.first_triangle[s + 1]; ++t) {
      const glm::uvec3& v = solids.triangles[t];
      least = std::min({least, v.x, v.y, v.z});
      end = std::max({end, v.x + 1, v.y + 1, v.z + 1});
      mesh->triangles.push_back(v);
    }
    for (glm::uvec3& v : mesh->triangles) v -= least;
    for (std::uint32_t v = least; v < end; ++v) {
      mesh->positions.emplace_back(solids.vertices[v]);
    }
    csg::Solid& solid = tree.solids()[s];
    solid.mesh = std::move(mesh);
    solid.world_from_mesh = glm::dmat4(1.0);
  }
  return tree;
}

}  // namespace

Result<SnappedVolume> snapped_volume(const Tree& tree, const Execution& execution) {
  const csg::BoundaryOptions options;
  const auto boundary = csg::find_exact_boundary(tree, tree.root(), options, execution);
  if (!boundary) return tl::unexpected(boundary.error());
  SnappedVolume result;
  const Fraction six = six_volumes(boundary->faces);
  result.six_volumes = six.str();
  result.step = boundary->lattice.step;
  result.volume = Fraction(six / 6).convert_to<double>() * std::pow(result.step, 3);
  auto solids =
      csg::snap_solids(tree, tree.root(), csg::Geometry(tree, execution), options.bits, execution);
  if (!solids) return tl::unexpected(solids.error());
  const auto caps = csg::close_solids(*solids, options.open, tree, execution);
  if (!caps) return tl::unexpected(caps.error());
  result.snapped = with_solids(tree, *solids);
  return result;
}

}  // namespace strata::apps
