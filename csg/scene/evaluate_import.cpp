#include <algorithm>
#include <filesystem>
#include <optional>

#include "core/printable.h"
#include "csg/scene/evaluator.h"
#include "mesh/formats/read_3mf_amf.h"
#include "strata/mesh/formats/read_mesh.h"
#include "strata/mesh/soup_tools.h"

namespace strata::csg {
namespace {

namespace fs = std::filesystem;

/// A file's name as messages show it.
std::string shown(std::string_view name) { return printable(name, 120); }

std::string extension_of(const std::string& path) {
  std::string extension = fs::path(path).extension().string();
  for (char& c : extension) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  return extension;
}

Result<MeshFile> read_any_mesh(const std::string& path, const std::string& extension,
                               const Execution& execution) {
  if (extension == ".3mf" || extension == ".amf") {
    MeshFile file;
    auto soup = (extension == ".3mf" ? read_3mf : read_amf)(path, execution, &file.stats.warnings);
    if (!soup) return tl::unexpected(soup.error());
    file.soup = *std::move(soup);
    return file;
  }
  return read_mesh(path, {}, execution);
}

void move_to_middle(TriangleSoup& mesh) {
  const Bounds box = bounds(mesh);
  if (box.empty()) return;
  const glm::dvec3 middle = 0.5 * box.low + 0.5 * box.high;
  for (glm::dvec3& p : mesh.positions) p -= middle;
}

/// Looks for `name` in a folder and the folders around it. Returns the first path that passes the
/// test.
template <class Test>
std::optional<std::string> first_place(const std::string& folder, const std::string& name,
                                       Test&& test) {
  if (fs::path(name).is_absolute()) return test(name) ? std::optional(name) : std::nullopt;
  constexpr int kMostLevels = 8;
  fs::path around(folder);
  for (int level = 0; level < kMostLevels; ++level, around /= "..") {
    const fs::path path = around / name;
    if (test(path)) return path.string();
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> find_asset(const std::string& folder, const std::string& name) {
  return first_place(folder, name, [](const fs::path& path) {
    std::error_code ignored;
    return fs::is_regular_file(path, ignored);
  });
}

std::optional<std::string> Evaluator::asset(std::uint32_t node, const std::string& file) {
  if (auto found = find_asset(folder_, file)) {
    if (!root_.empty() && !lies_below(*found, root_)) {
      stop(ErrorCode::kInput, node,
           fmt::format("'{}' needs the file '{}', which lies outside of the root folder {}",
                       name(node), shown(file), root_));
      return std::nullopt;
    }
    if (asked_for_.insert(*found).second) scene_.files.push_back(identify_file(*found));
    return found;
  }
  const std::string wanted = (fs::path(folder_) / file).string();
  if (asked_for_.insert(wanted).second) scene_.files.push_back({wanted, 0, 0});
  const auto other = first_place(folder_, file, [](const fs::path& path) {
    std::error_code ignored;
    return fs::exists(path, ignored);
  });
  warn(node, "missing-file",
       fmt::format("'{}' needs the file '{}', which is {}; it is left out", name(node), shown(file),
                   !other                     ? "missing"
                   : fs::is_directory(*other) ? "a folder"
                                              : "not a regular file"));
  return std::nullopt;
}

void Evaluator::import(std::uint32_t node, const Context& context) {
  const NodeArguments given = arguments(node);
  const std::string file = given.find("file", 0).string();
  if (file.empty()) return;
  const std::string extension = extension_of(file);
  const bool flat = extension == ".svg" || extension == ".dxf";
  const bool solid =
      extension == ".3mf" || extension == ".amf" || mesh_format_of(file) != MeshFormat::kAuto;
  const auto path = asset(node, file);
  if (!path) return;
  if (flat) return add_outline(node, context, import_outline(node, *path));
  if (!solid) {
    return warn(node, "not-done",
                extension == ".nef3"
                    ? fmt::format("'{}': Nef polyhedra are not read; it is left out", shown(file))
                    : fmt::format("'{}': the file's type is unknown; it is left out", shown(file)));
  }
  const bool centre = given.truth("center", false);
  Imported& imported = imports_[{*path, centre}];
  if (!imported.mesh) {
    Execution execution = execution_;
    execution.progress = {};
    auto mesh = read_any_mesh(*path, extension, execution);
    if (!mesh) {
      leave_out(node, "geometry", mesh.error(), "it is left out");
      if (error_) return;
    } else {
      if (mesh->stats.dropped_faces() > 0) {
        warn(node, "geometry",
             fmt::format("{}: {} of {} faces are broken and left out", *path,
                         mesh->stats.dropped_faces(), mesh->stats.faces));
      }
      for (const std::string& text : mesh->stats.warnings) warn(node, "geometry", text);
      if (centre) move_to_middle(mesh->soup);
      if (!mesh->soup.triangles.empty()) imported.rule = inspect(node, mesh->soup);
    }
    imported.mesh =
        std::make_shared<const TriangleSoup>(mesh ? std::move(mesh->soup) : TriangleSoup());
  }
  add_solid(node, context, imported.mesh, imported.rule);
}

Outline Evaluator::import_outline(std::uint32_t node, const std::string& path) {
  const NodeArguments given = arguments(node);
  OutlineImport options;
  options.layer = given.find("layer", 1).string();
  if (const std::string id = given.find("id").string(); !id.empty()) options.layer = id;
  double origin[2] = {0.0, 0.0};
  given.find("origin", 3).numbers(origin, 2);
  options.origin = {origin[0], origin[1]};
  options.scale = number(node, "scale", given.find("scale", 4), options.scale);
  options.dpi = number(node, "dpi", options.dpi);
  options.centre = given.truth("center", false);
  options.segments = segments(node);
  std::vector<std::string> warnings;
  auto outline = read_outline(path, options, execution_, &warnings);
  for (const std::string& text : warnings) warn(node, "geometry", text);
  if (outline) return *std::move(outline);
  leave_out(node, "geometry", outline.error(), "it is left out");
  return {};
}

}  // namespace strata::csg
