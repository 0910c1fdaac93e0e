#include "mesh/attributes/mtl_library.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "core/did_you_mean.h"
#include "core/printable.h"
#include "mesh/text/input_bytes.h"
#include "mesh/textures/read_texture.h"
#include "strata/core/file_identity.h"

namespace strata::detail {
namespace {

namespace fs = std::filesystem;

/// Bytes of a .mtl file, or of a picture's file, that are read.
constexpr std::uint64_t kMostFileBytes = std::uint64_t{1} << 30;
/// Files that an OBJ file may name.
constexpr std::size_t kMostNamedFiles = 1000;
/// Sentences of one kind that a user reads.
constexpr std::size_t kMostSentences = 8;

bool is_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

}  // namespace

/// The path of a file that another one names. Paths of Windows are known by their backslashes; of
/// one from another machine the last name counts.
std::string MtlLibrary::find(std::string_view name, const std::string& beside) const {
  const fs::path folder = fs::path(beside).parent_path();
  const fs::path plain = folder / name;
  if (is_file(plain)) return plain.string();
  std::string slashes(name);
  std::replace(slashes.begin(), slashes.end(), '\\', '/');
  if (is_file(folder / slashes)) return (folder / slashes).string();
  const fs::path last = folder / fs::path(slashes).filename();
  return is_file(last) ? last.string() : plain.string();
}

Result<void> MtlLibrary::check_root(const std::string& path, const char* what) const {
  if (input_.options.root.empty() || lies_below(path, input_.options.root)) return {};
  return fail(ErrorCode::kInput, "{}: the {} {} lies outside of --root {}", input_.name, what,
              printable(path), input_.options.root);
}

Result<void> MtlLibrary::open(std::string_view names) {
  if (input_.path.empty()) {
    if (file_.stats.missing.empty()) {
      file_.stats.missing.push_back(fmt::format("{}: the material file {} is not looked for",
                                                input_.name, printable(names, 200)));
    }
    return {};
  }
  if (is_file(find(names, input_.path))) return read_file(std::string(names));
  while (!names.empty()) {
    const std::string_view name = names.substr(0, names.find_first_of(" \t"));
    names.remove_prefix(std::min(name.size() + 1, names.size()));
    if (name.empty()) continue;
    if (auto done = read_file(std::string(name)); !done) return done;
  }
  return {};
}

Result<void> MtlLibrary::read_file(const std::string& name) {
  const std::string path = find(name, input_.path);
  if (!had_.insert(path).second) return {};
  if (had_.size() > kMostNamedFiles) {
    return fail(ErrorCode::kLimit, "{}: more than {} .mtl files are named", input_.name,
                kMostNamedFiles);
  }
  if (!is_file(path)) {
    file_.stats.missing.push_back(
        fmt::format("{}: the material file {} is not there", input_.name, printable(path)));
    return {};
  }
  if (auto inside = check_root(path, "material file"); !inside) return inside;
  file_.opened.push_back(identify_file(path));
  const auto file = InputBytes::open(path, kMostFileBytes, input_.execution.stop);
  if (!file) return tl::unexpected(file.error());
  if (file->view().size() > kMostFileBytes) {
    return fail(ErrorCode::kLimit, "{}: the file is larger than {} bytes", path, kMostFileBytes);
  }
  auto read = parse_mtl(file->view(), path, &file_.stats.warnings);
  if (!read) return tl::unexpected(read.error());
  for (MtlMaterial& material : *read) {
    // The first of a name counts.
    const auto number = static_cast<std::uint32_t>(materials_.size());
    if (!numbers_.emplace(material.surface.name, number).second) continue;
    materials_.push_back(std::move(material));
    homes_.push_back(path);
  }
  return {};
}

std::uint32_t MtlLibrary::number_of(std::string_view name) {
  const auto found = numbers_.find(name);
  if (found != numbers_.end()) return found->second;
  if (unknown_.size() < kMostSentences) unknown_.insert(printable(name, 200));
  return MeshAttributes::kNone;
}

void MtlLibrary::warn_of_unknown() {
  if (materials_.empty() && !file_.stats.missing.empty()) return;  // that says it all
  std::vector<std::string_view> known;
  for (const auto& [name, number] : numbers_) known.push_back(name);
  std::size_t said = file_.stats.missing.size();
  for (const std::string& name : unknown_) {
    if (said++ > kMostSentences) break;
    file_.stats.warnings.push_back(fmt::format("{}: there is no material '{}'{}", input_.name, name,
                                               did_you_mean(name, known)));
  }
}

/// A picture that is damaged is told; its material has its colour.
Result<void> MtlLibrary::pass_over(const Error& error) {
  if (error.code != ErrorCode::kInput) return tl::unexpected(error);
  if (damaged_++ < kMostSentences) {
    file_.stats.warnings.push_back(error.message + "; the texture is not shown");
  }
  return {};
}

Result<void> MtlLibrary::read_picture(MtlMaterial& material, const std::string& beside) {
  const std::string path = find(material.picture, beside);
  const auto [found, is_new] = textures_.try_emplace(
      fmt::format("{} {}", path, material.wrap == TextureWrap::kClamp ? 'c' : 'r'),
      SurfaceMaterial::kNoTexture);
  std::vector<Texture>& textures = file_.attributes.textures;
  if (is_new) {
    if (!is_file(path)) {
      if (file_.stats.missing.size() <= kMostSentences) {
        file_.stats.missing.push_back(
            fmt::format("{}: the picture {} is not there", beside, printable(path)));
      }
      return {};
    }
    if (auto inside = check_root(path, "picture"); !inside) return inside;
    if (textures.size() >= kMostNamedFiles) {
      return fail(ErrorCode::kLimit, "{}: more than {} pictures are named", input_.name,
                  kMostNamedFiles);
    }
    file_.opened.push_back(identify_file(path));
    const auto bytes = InputBytes::open(path, kMostFileBytes, input_.execution.stop);
    if (!bytes) return pass_over(bytes.error());
    Execution rest = input_.execution;  // what is left of the memory
    rest.progress = {};
    std::uint64_t taken = 0;
    for (const Texture& texture : textures) taken += 4 * texture.texels.size();
    if (rest.memory_limit != 0) {
      rest.memory_limit =
          std::max<std::uint64_t>(rest.memory_limit > taken ? rest.memory_limit - taken : 0, 1);
    }
    auto texture = read_texture(path, bytes->view(), rest);
    if (!texture) return pass_over(texture.error());
    texture->wrap_u = texture->wrap_v = material.wrap;
    found->second = static_cast<std::uint32_t>(textures.size());
    textures.push_back(*std::move(texture));
  }
  if (found->second == SurfaceMaterial::kNoTexture) return {};
  // Programs write any Kd beside a picture and show the picture alone.
  material.surface.texture = found->second;
  material.surface.colour = glm::vec4(1.0f, 1.0f, 1.0f, material.surface.colour.a);
  material.surface.coloured = true;
  return {};
}

Result<void> MtlLibrary::finish(const std::vector<bool>& used) {
  warn_of_unknown();
  for (std::size_t i = 0; i < materials_.size(); ++i) {
    if (input_.options.textures && used[i] && !materials_[i].picture.empty()) {
      if (auto done = read_picture(materials_[i], homes_[i]); !done) return done;
    }
    file_.attributes.materials.push_back(materials_[i].surface);
  }
  return {};
}

}  // namespace strata::detail
