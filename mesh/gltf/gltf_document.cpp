#include "mesh/gltf/gltf_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <new>

#include "core/printable.h"

#ifdef STRATA_HAVE_JSON
#include <nlohmann/json.hpp>
#endif

namespace strata::detail {

#ifdef STRATA_HAVE_JSON

namespace {

using nlohmann::json;

constexpr std::uint64_t kMostWhole = std::uint64_t{1} << 53;

/// An element of the document, for messages.
struct Place {
  const std::string& file;
  const char* list = "";
  std::size_t index = 0;
  std::string within{};  ///< ".primitives[3]"

  [[nodiscard]] std::string text() const {
    return *list ? fmt::format("{}: {}[{}]{}", file, list, index, within) : file;
  }
  /// A member of it: "a.gltf: nodes[3].mesh", "a.gltf: scene".
  [[nodiscard]] std::string at(const char* key) const {
    return text() + (*list ? "." : ": ") + key;
  }
};

const json* member(const json& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(key);
  return found == object.end() ? nullptr : &*found;
}

std::string shown(const json& value) {
  if (value.is_structured()) return value.is_array() ? "a list" : "an object";
  return printable(value.dump(-1, ' ', false, json::error_handler_t::replace), 40);
}

/// A whole number of 0 to `most`, or `missing` where there is none.
std::uint64_t whole(const json& object, const char* key, const Place& place, std::uint64_t missing,
                    std::uint64_t most = kMostWhole) {
  const json* const value = member(object, key);
  if (!value) return missing;
  if (value->is_number()) {
    const auto number = value->get<double>();
    if (number >= 0 && number <= static_cast<double>(most) && number == std::floor(number)) {
      return static_cast<std::uint64_t>(number);
    }
  }
  refuse_gltf("{} must be a whole number of 0 to {}, got {}", place.at(key), most, shown(*value));
}

std::uint64_t needed(const json& object, const char* key, const Place& place) {
  if (!member(object, key)) refuse_gltf("{} has no {}", place.text(), key);
  return whole(object, key, place, 0);
}

double number(const json& value, const char* key, const Place& place) {
  if (!value.is_number()) {
    refuse_gltf("{} must be a number, got {}", place.at(key), shown(value));
  }
  return value.get<double>();
}

/// Numbers of a list, `count` of them. Nothing if there is no such list.
template <std::size_t count>
std::optional<std::array<double, count>> numbers(const json& object, const char* key,
                                                 const Place& place) {
  const json* const list = member(object, key);
  if (!list) return std::nullopt;
  if (!list->is_array() || list->size() != count) {
    refuse_gltf("{} must have {} numbers", place.at(key), count);
  }
  std::array<double, count> all{};
  for (std::size_t i = 0; i < count; ++i) all[i] = number((*list)[i], key, place);
  return all;
}

std::vector<double> any_numbers(const json& object, const char* key, const Place& place) {
  std::vector<double> all;
  const json* const list = member(object, key);
  if (!list || !list->is_array()) return all;
  for (const json& value : *list) all.push_back(number(value, key, place));
  return all;
}

std::string text_of(const json& object, const char* key) {
  const json* const value = member(object, key);
  return value && value->is_string() ? value->get<std::string>() : std::string();
}

const json* extension(const json& object, const char* name) {
  const json* const all = member(object, "extensions");
  return all ? member(*all, name) : nullptr;
}

class Reader {
 public:
  Reader(const json& root, const std::string& file) : root_(root), file_(file) {}

  GltfDocument read() {
    check_version();
    check_extensions();
    GltfDocument to;
    to.buffers = list<GltfBuffer>("buffers", &Reader::buffer);
    to.views = list<GltfView>("bufferViews", &Reader::view);
    to.accessors = list<GltfAccessor>("accessors", &Reader::accessor);
    to.meshes = list<GltfMesh>("meshes", &Reader::mesh);
    to.nodes = list<GltfNode>("nodes", &Reader::node);
    to.skins = list<GltfSkin>("skins", &Reader::skin);
    to.images = list<GltfImage>("images", &Reader::image);
    to.textures = list<GltfTexture>("textures", &Reader::texture);
    to.materials = list<GltfMaterial>("materials", &Reader::material);
    to.scenes = list<std::vector<std::uint32_t>>("scenes", &Reader::scene);
    to.scene = reference(root_, "scene", Place{file_}, "scenes");
    return to;
  }

 private:
  void check_version() const {
    if (!root_.is_object()) refuse_gltf("{}: the JSON is not an object", file_);
    const json* const asset = member(root_, "asset");
    const std::string version = asset ? text_of(*asset, "version") : "";
    if (version.empty()) refuse_gltf("{}: the JSON has no asset.version, so it is not glTF", file_);
    if (!version.starts_with("2.")) {
      refuse_gltf("{}: glTF {} is not read; glTF 2.0 is", file_, printable(version, 20));
    }
  }

  /// Extensions that do not change shapes are passed over; their looks are not all shown.
  void check_extensions() const {
    const json* const names = member(root_, "extensionsRequired");
    if (!names || !names->is_array()) return;
    for (const json& name : *names) {
      const std::string word = name.is_string() ? name.get<std::string>() : "";
      const bool known = word == "KHR_mesh_quantization" || word == "KHR_texture_transform" ||
                         word == "EXT_mesh_gpu_instancing" || word == "KHR_lights_punctual" ||
                         word == "KHR_texture_basisu" || word == "EXT_texture_webp" ||
                         word == "EXT_texture_avif" || word == "MSFT_texture_dds" ||
                         word == "KHR_animation_pointer" || word == "KHR_xmp_json_ld" ||
                         word.starts_with("KHR_materials_");
      if (known) continue;
      refuse_gltf("{}: it requires the extension {}, which is not read{}", file_,
                  printable(word.empty() ? "''" : word, 60),
                  word == "KHR_draco_mesh_compression" || word == "EXT_meshopt_compression"
                      ? "; write the file without compression"
                      : "");
    }
  }

  [[nodiscard]] std::size_t count_of(const char* list) const {
    const json* const all = member(root_, list);
    return all && all->is_array() ? all->size() : 0;
  }

  template <class T>
  std::vector<T> list(const char* name, T (Reader::*element)(const json&, const Place&)) {
    std::vector<T> all;
    const json* const values = member(root_, name);
    if (!values) return all;
    if (!values->is_array()) refuse_gltf("{}: {} must be a list", file_, name);
    all.reserve(values->size());
    for (const json& value : *values) {
      const Place place{file_, name, all.size()};
      if (!value.is_object()) refuse_gltf("{} must be an object", place.text());
      all.push_back((this->*element)(value, place));
    }
    return all;
  }

  std::uint32_t index(const json& value, const char* key, const Place& place,
                      const char* list) const {
    const std::size_t count = count_of(list);
    const double number = value.is_number() ? value.get<double>() : -1;
    if (!(number >= 0 && number < static_cast<double>(count)) || number != std::floor(number)) {
      refuse_gltf("{} must be an index of {}, which has {}, got {}", place.at(key), list,
                  counted(count, "element"), shown(value));
    }
    return static_cast<std::uint32_t>(number);
  }
  GltfIndex reference(const json& object, const char* key, const Place& place,
                      const char* list) const {
    const json* const value = member(object, key);
    return value ? GltfIndex(index(*value, key, place, list)) : GltfIndex();
  }
  std::vector<std::uint32_t> references(const json& object, const char* key, const Place& place,
                                        const char* list) const {
    std::vector<std::uint32_t> all;
    const json* const values = member(object, key);
    if (!values) return all;
    if (!values->is_array()) refuse_gltf("{} must be a list", place.at(key));
    for (const json& value : *values) all.push_back(index(value, key, place, list));
    return all;
  }
  std::uint32_t needed_reference(const json& object, const char* key, const Place& place,
                                 const char* list) const {
    const GltfIndex found = reference(object, key, place, list);
    if (!found) refuse_gltf("{} has no {}", place.text(), key);
    return *found;
  }

  GltfBuffer buffer(const json& from, const Place& place) {
    GltfBuffer to;
    to.bytes = needed(from, "byteLength", place);
    if (member(from, "uri")) to.uri = text_of(from, "uri");
    return to;
  }

  GltfView view(const json& from, const Place& place) {
    GltfView to;
    to.buffer = needed_reference(from, "buffer", place, "buffers");
    to.offset = whole(from, "byteOffset", place, 0);
    to.bytes = needed(from, "byteLength", place);
    to.stride = whole(from, "byteStride", place, 0);
    constexpr std::uint64_t kStep = 4;
    if (member(from, "byteStride") && (to.stride < kStep || to.stride % kStep != 0)) {
      refuse_gltf("{} must be a multiple of {}, and not 0, got {}", place.at("byteStride"), kStep,
                  to.stride);
    }
    to.packed = extension(from, "EXT_meshopt_compression") != nullptr;
    return to;
  }

  static GltfNumber number_type(const json& from, const Place& place) {
    const std::uint64_t type = needed(from, "componentType", place);
    if (type < 5120 || type > 5126) {
      refuse_gltf("{}.componentType must be 5120 to 5126, got {}", place.text(), type);
    }
    return static_cast<GltfNumber>(type);
  }

  GltfAccessor accessor(const json& from, const Place& place) {
    constexpr std::pair<const char*, int> kTypes[] = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3},
                                                      {"VEC4", 4},   {"MAT2", 4}, {"MAT3", 9},
                                                      {"MAT4", 16}};
    GltfAccessor to;
    to.view = reference(from, "bufferView", place, "bufferViews");
    to.offset = whole(from, "byteOffset", place, 0);
    to.count = needed(from, "count", place);
    to.type = number_type(from, place);
    const json* const normalized = member(from, "normalized");
    to.normalized = normalized && normalized->is_boolean() && normalized->get<bool>();
    const std::string type = text_of(from, "type");
    const auto* const found = std::find_if(std::begin(kTypes), std::end(kTypes),
                                           [&](const auto& known) { return type == known.first; });
    if (found == std::end(kTypes)) {
      refuse_gltf("{}.type must be SCALAR, VEC2 to VEC4 or MAT2 to MAT4, got '{}'", place.text(),
                  printable(type, 20));
    }
    to.components = found->second;
    if (const json* const sparse = member(from, "sparse")) to.sparse = sparse_of(*sparse, place);
    return to;
  }

  GltfAccessor::Sparse sparse_of(const json& from, const Place& place) const {
    const json* const indices = member(from, "indices");
    const json* const values = member(from, "values");
    if (!indices || !values) refuse_gltf("{}.sparse has no indices or no values", place.text());
    GltfAccessor::Sparse to;
    const Place inside{file_, place.list, place.index, ".sparse"};
    to.count = needed(from, "count", inside);
    to.index_view = needed_reference(*indices, "bufferView", inside, "bufferViews");
    to.index_offset = whole(*indices, "byteOffset", inside, 0);
    to.index_type = number_type(*indices, inside);
    to.value_view = needed_reference(*values, "bufferView", inside, "bufferViews");
    to.value_offset = whole(*values, "byteOffset", inside, 0);
    return to;
  }

  GltfPrimitive primitive(const json& from, const Place& place) const {
    GltfPrimitive to;
    to.mode = static_cast<int>(whole(from, "mode", place, 4, 6));
    to.indices = reference(from, "indices", place, "accessors");
    to.material = reference(from, "material", place, "materials");
    to.packed = extension(from, "KHR_draco_mesh_compression") != nullptr;
    if (const json* const attributes = member(from, "attributes")) {
      const auto numbered = [&](const char* name, std::size_t i) {
        return reference(*attributes, fmt::format("{}_{}", name, i).c_str(), place, "accessors");
      };
      to.positions = reference(*attributes, "POSITION", place, "accessors");
      to.colours = reference(*attributes, "COLOR_0", place, "accessors");
      for (std::size_t i = 0; const GltfIndex at = numbered("TEXCOORD", i); ++i) {
        to.texture_places.push_back(at);
      }
      for (std::size_t i = 0; const GltfIndex at = numbered("JOINTS", i); ++i) {
        to.skin.push_back({at, numbered("WEIGHTS", i)});
      }
    }
    if (const json* const targets = member(from, "targets"); targets && targets->is_array()) {
      for (const json& target : *targets) {
        to.morphs.push_back(reference(target, "POSITION", place, "accessors"));
      }
    }
    return to;
  }

  GltfMesh mesh(const json& from, const Place& place) {
    GltfMesh to;
    to.name = text_of(from, "name");
    to.weights = any_numbers(from, "weights", place);
    const json* const primitives = member(from, "primitives");
    if (!primitives || !primitives->is_array()) {
      refuse_gltf("{} has no list of primitives", place.text());
    }
    for (const json& one : *primitives) {
      to.primitives.push_back(primitive(
          one,
          {file_, "meshes", place.index, fmt::format(".primitives[{}]", to.primitives.size())}));
    }
    return to;
  }

  GltfNode node(const json& from, const Place& place) {
    GltfNode to;
    to.name = text_of(from, "name");
    to.children = references(from, "children", place, "nodes");
    to.mesh = reference(from, "mesh", place, "meshes");
    to.skin = reference(from, "skin", place, "skins");
    to.weights = any_numbers(from, "weights", place);
    if (const auto matrix = numbers<16>(from, "matrix", place)) {
      for (const char* other : {"translation", "rotation", "scale"}) {
        if (!member(from, other)) continue;
        refuse_gltf("{} has both a matrix and a {}; only one of them is allowed", place.text(),
                    other);
      }
      for (int i = 0; i < 16; ++i) {
        to.parent_from_node[i / 4][i % 4] = (*matrix)[static_cast<std::size_t>(i)];
      }
      const std::array<double, 16>& m = *matrix;
      if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1) {
        refuse_gltf("{} must be affine: its last row must be 0, 0, 0, 1, got {}, {}, {}, {}",
                    place.at("matrix"), m[3], m[7], m[11], m[15]);
      }
    } else {
      to.parent_from_node = placed(from, place);
    }
    if (const json* const instancing = extension(from, "EXT_mesh_gpu_instancing")) {
      if (const json* const attributes = member(*instancing, "attributes")) {
        to.translations = reference(*attributes, "TRANSLATION", place, "accessors");
        to.rotations = reference(*attributes, "ROTATION", place, "accessors");
        to.scales = reference(*attributes, "SCALE", place, "accessors");
      }
    }
    return to;
  }

  /// Translation, rotation (a quaternion) and scale.
  static glm::dmat4 placed(const json& from, const Place& place) {
    const auto move = numbers<3>(from, "translation", place);
    const auto turn = numbers<4>(from, "rotation", place);
    const auto scale = numbers<3>(from, "scale", place);
    glm::dmat4 matrix(1.0);
    if (turn) {
      const glm::dquat rotation((*turn)[3], (*turn)[0], (*turn)[1], (*turn)[2]);
      const double length = glm::length(rotation);
      if (!(length > 0)) refuse_gltf("{}.rotation has length 0", place.text());
      matrix = glm::dmat4(glm::mat3_cast(rotation / length));
    }
    for (int i = 0; i < 3; ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (scale) matrix[i] *= (*scale)[at];
      if (move) matrix[3][i] = (*move)[at];
    }
    return matrix;
  }

  GltfSkin skin(const json& from, const Place& place) {
    GltfSkin to;
    to.joints = references(from, "joints", place, "nodes");
    to.bind_matrices = reference(from, "inverseBindMatrices", place, "accessors");
    return to;
  }

  GltfImage image(const json& from, const Place& place) {
    GltfImage to;
    if (member(from, "uri")) to.uri = text_of(from, "uri");
    to.view = reference(from, "bufferView", place, "bufferViews");
    return to;
  }

  GltfTexture texture(const json& from, const Place& place) {
    const auto wrap_of = [&](const json& sampler, const char* key) {
      switch (whole(sampler, key, place, 10497)) {
        case 33071:
          return TextureWrap::kClamp;
        case 33648:
          return TextureWrap::kMirror;
        default:
          return TextureWrap::kRepeat;
      }
    };
    GltfTexture to;
    to.image = reference(from, "source", place, "images");
    if (const GltfIndex at = reference(from, "sampler", place, "samplers")) {
      const json& sampler = root_["samplers"][*at];
      to.wrap_u = wrap_of(sampler, "wrapS");
      to.wrap_v = wrap_of(sampler, "wrapT");
    }
    return to;
  }

  GltfMaterial material(const json& from, const Place& place) {
    GltfMaterial to;
    to.name = text_of(from, "name");
    const std::string alpha = text_of(from, "alphaMode");
    to.opaque = alpha != "MASK" && alpha != "BLEND";
    if (const json* const other = extension(from, "KHR_materials_pbrSpecularGlossiness")) {
      base_colour(*other, "diffuseFactor", "diffuseTexture", place, to);
    } else if (const json* const usual = member(from, "pbrMetallicRoughness")) {
      base_colour(*usual, "baseColorFactor", "baseColorTexture", place, to);
    }
    return to;
  }

  void base_colour(const json& from, const char* factor, const char* texture, const Place& place,
                   GltfMaterial& to) const {
    if (const auto colour = numbers<4>(from, factor, place)) {
      to.coloured = true;
      for (int i = 0; i < 4; ++i) {
        to.colour[i] = std::clamp((*colour)[static_cast<std::size_t>(i)], 0.0, 1.0);
      }
    }
    const json* const info = member(from, texture);
    if (!info) return;
    to.coloured = true;
    to.texture = needed_reference(*info, "index", place, "textures");
    to.texture_set = static_cast<std::uint32_t>(whole(*info, "texCoord", place, 0, 1000));
    const json* const moved = extension(*info, "KHR_texture_transform");
    if (!moved) return;
    if (const auto offset = numbers<2>(*moved, "offset", place)) {
      to.texture_offset = {(*offset)[0], (*offset)[1]};
    }
    if (const auto scale = numbers<2>(*moved, "scale", place)) {
      to.texture_scale = {(*scale)[0], (*scale)[1]};
    }
    if (const json* const turn = member(*moved, "rotation")) {
      to.texture_turn = number(*turn, "rotation", place);
    }
    to.texture_set =
        static_cast<std::uint32_t>(whole(*moved, "texCoord", place, to.texture_set, 1000));
  }

  std::vector<std::uint32_t> scene(const json& from, const Place& place) {
    return references(from, "nodes", place, "nodes");
  }

  const json& root_;
  const std::string& file_;
};

}  // namespace

GltfDocument parse_gltf(std::string_view text, const std::string& name) try {
  const json root = json::parse(text.begin(), text.end());
  return Reader(root, name).read();
} catch (const json::parse_error& error) {
  refuse_gltf("{}: byte {}: malformed JSON", name, error.byte);
} catch (const json::exception&) {
  refuse_gltf("{}: a number of the JSON is too large", name);
}

#else

GltfDocument parse_gltf(std::string_view, const std::string& name) {
  throw GltfRefusal{
      {ErrorCode::kUsage, name + ": this build reads no glTF (nlohmann-json3-dev was missing)"}};
}

#endif

}  // namespace strata::detail
