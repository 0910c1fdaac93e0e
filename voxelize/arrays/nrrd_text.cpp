#include "voxelize/arrays/nrrd_text.h"

#include <fmt/core.h>

#include "voxelize/output/grid_text.h"

namespace strata {
namespace {

std::string vector_text(const glm::dvec3& vector) {
  return fmt::format("({},{},{})", vector.x + 0.0, vector.y + 0.0, vector.z + 0.0);
}

}  // namespace

std::string nrrd_text(const VoxelGrid& grid, const VoxelWriterOptions& options,
                      const DenseValues& values, const std::string& data_file) {
  const WorldAxes axes = world_axes(grid, options.frame);
  const bool colours = values.kind == DenseValues::Kind::kColours;  // the fastest axis
  const std::string type =
      values.is_float() ? "float" : fmt::format("uint{}", values.number_bits());
  const std::string space = one_line(options.frame.space);
  std::string units(unit_name(options.frame.unit_metres));
  if (!units.empty()) units = fmt::format("space units: \"{0}\" \"{0}\" \"{0}\"\n", units);
  return fmt::format(
      "NRRD0004\n# Complete NRRD file format specification at:\n"
      "# http://teem.sourceforge.net/nrrd/format.html\n"
      "content: {}\ntype: {}\n{}dimension: {}\n{}\nsizes: {}{} {} {}\n"
      "space directions: {}{} {} {}\nspace origin: {}\n{}"
      "centers: {}cell cell cell\nkinds: {}domain domain domain\nencoding: {}\n{}\n",
      one_line(options.name), type, values.number_bits() == 8 ? "" : "endian: little\n",
      colours ? 4 : 3, space.empty() ? "space dimension: 3" : "space: " + space,
      colours ? "4 " : "", grid.dims.x, grid.dims.y, grid.dims.z, colours ? "none " : "",
      vector_text(axes.steps[0]), vector_text(axes.steps[1]), vector_text(axes.steps[2]),
      vector_text(axes.centre), units, colours ? "??? " : "", colours ? "RGBA-color " : "",
      data_file.empty() ? "gzip" : "raw",
      data_file.empty() ? "" : fmt::format("data file: {}\n", data_file));
}

}  // namespace strata
