// Writes the meshes of data/ into a folder. Not part of the tests' build:
//   cmake --build build/release --target make_data && build/release/bin/make_data data

#include <cmath>
#include <cstdio>
#include <glm/gtc/matrix_transform.hpp>
#include <string>

#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"

namespace {

using strata::TriangleSoup;

TriangleSoup moved(const TriangleSoup& mesh, double x, double y, double z) {
  return strata::transform(mesh, glm::translate(glm::dmat4(1.0), glm::dvec3(x, y, z)));
}

/// Four digits: small files, and the same on every machine.
TriangleSoup rounded(TriangleSoup mesh) {
  for (glm::dvec3& p : mesh.positions) {
    for (int k = 0; k < 3; ++k) p[k] = std::round(p[k] * 1e4) / 1e4 + 0.0;
  }
  return mesh;
}

/// Without the triangles all of whose corners are above z.
TriangleSoup cut_above(TriangleSoup mesh, double z) {
  std::erase_if(mesh.triangles, [&](const glm::uvec3& t) {
    return mesh.positions[t.x].z > z && mesh.positions[t.y].z > z && mesh.positions[t.z].z > z;
  });
  return mesh;
}

TriangleSoup two_spheres() {
  TriangleSoup mesh = moved(strata::make_icosphere(1.0, 3), -0.6, 0.0, 0.0);
  append(mesh, moved(strata::make_icosphere(0.8, 2), 0.6, 0.0, 0.1));
  return mesh;
}

TriangleSoup link() {
  TriangleSoup mesh = strata::make_torus(1.0, 0.3, 48, 18);
  const glm::dmat4 upright =
      glm::rotate(glm::dmat4(1.0), std::acos(0.0), glm::dvec3(1.0, 0.0, 0.0));
  append(mesh,
         moved(strata::transform(strata::make_torus(1.0, 0.3, 48, 18), upright), 1.0, 0.0, 0.0));
  return mesh;
}

TriangleSoup cavity() {
  TriangleSoup mesh = strata::make_icosphere(1.0, 3);
  TriangleSoup inner = strata::make_icosphere(0.6, 2);
  strata::reverse_orientation(inner);
  append(mesh, inner);
  return mesh;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
    return 2;
  }
  const struct {
    const char* name;
    TriangleSoup mesh;
  } files[] = {{"knot.obj", strata::make_torus_knot(2, 3, 0.45, 140, 12)},
               {"torus.obj", strata::make_torus(1.0, 0.4, 48, 24)},
               {"two_spheres.stl", two_spheres()},
               {"link.ply", link()},
               {"open_sphere.off", cut_above(strata::make_uv_sphere(1.0, 48, 24), 0.75)},
               {"cavity.off", cavity()}};
  for (const auto& file : files) {
    const std::string path = std::string(argv[1]) + "/" + file.name;
    if (auto written = strata::write_mesh(path, rounded(file.mesh)); !written) {
      std::fprintf(stderr, "%s\n", written.error().message.c_str());
      return 4;
    }
  }
  return 0;
}
