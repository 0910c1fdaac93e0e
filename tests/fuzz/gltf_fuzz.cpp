// A .glb, a .gltf, or the two chunks of a .glb: the JSON, then a line "#bin", then bytes.
#include <string>

#include "mesh/gltf/read_gltf.h"
#include "tests/fuzz/scene_fuzzing.h"
#include "tests/mesh/gltf/glb_bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  constexpr std::string_view kBinary = "\n#bin\n";
  const std::size_t at = bytes.find(kBinary);
  const bool chunks = !is_glb(bytes) && at != std::string_view::npos;
  const std::string made =
      chunks ? testing_gltf::glb_of(std::string(bytes.substr(0, at)),
                                    std::string(bytes.substr(at + kBinary.size())))
             : std::string(bytes);
  Execution execution;
  execution.memory_limit = std::uint64_t{1} << 26;
  const auto model =
      read_gltf(made, "input", {.attributes = true, .standard_input = true}, execution);
  if (!model) {
    if (model.error().code != ErrorCode::kUsage) check_refusal(model.error(), "input");
    return 0;
  }
  check_soup(model->soup);
  const MeshAttributes& look = model->attributes;
  must(!model->soup.triangles.empty(), "a mesh has triangles");
  must(!look.parts.empty(), "a mesh has parts");
  for (std::uint64_t face = 0; face < model->soup.triangles.size(); ++face) {
    must(look.part_of(face) < look.parts.size(), "a face has a part");
    const std::uint32_t material = look.material_of(face);
    must(material == MeshAttributes::kNone || material < look.materials.size(),
         "a material is there");
    for (const MeshAttributes::Corner& corner : look.corners_of(face)) {
      must(corner.vertex < model->soup.positions.size(), "corners are vertices");
    }
  }
  must(look.vertex_colours.empty() || look.vertex_colours.size() == model->soup.positions.size(),
       "each vertex has a colour");
  return 0;
}
