#include <fmt/format.h>

#include <utility>

#include "mesh/formats/reader_common.h"
#include "mesh/gltf/read_gltf.h"

namespace strata::detail {

Result<MeshFile> read_gltf_mesh(const ReaderInput& input) {
  GltfOptions options;
  options.attributes = input.options.attributes;
  options.textures = input.options.textures;
  options.parts = input.options.wants_parts();
  options.standard_input = input.path.empty();
  options.root = input.options.root;
  auto model = read_gltf(input.text, input.name, options, input.execution);
  if (!model) return tl::unexpected(model.error());
  const GltfLosses& losses = model->losses;
  const std::uint64_t dropped = losses.too_few + losses.out_of_range + losses.non_finite;
  if (dropped > 0) {
    if (input.options.strict) return fail(ErrorCode::kInput, "{}", losses.first);
    model->warnings.push_back(fmt::format("{}; {}", losses.first, faces_text(dropped)));
  }
  RawMesh raw;
  raw.soup = std::move(model->soup);
  raw.stats.format = is_glb(input.text) ? "glb" : "gltf";
  raw.stats.faces = raw.soup.triangles.size() + dropped;
  raw.stats.ignored = model->ignored;
  raw.stats.warnings = std::move(model->warnings);
  raw.stats.missing = std::move(model->missing);
  raw.stats.unit_metres = 1.0;
  raw.stats.y_up = true;
  auto file = finish_mesh(input, std::move(raw), [&](std::uint32_t triangle) {
    return FacePlace{fmt::format("{}: triangle {}", input.name, triangle), ""};
  });
  if (!file) return file;
  // What is dropped already has been told.
  file->stats.too_few_vertices = losses.too_few;
  file->stats.out_of_range = losses.out_of_range;
  file->stats.non_finite = losses.non_finite;
  file->attributes = std::move(model->attributes);
  file->opened = std::move(model->opened);
  return file;
}

}  // namespace strata::detail
