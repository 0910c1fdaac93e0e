#include "apps/view/scene/exporter.h"

#include <algorithm>
#include <exception>
#include <filesystem>
#include <new>
#include <system_error>
#include <utility>
#include <vector>

#include "apps/session/session.h"
#include "apps/strata/mesh_parts.h"
#include "core/printable.h"
#include "csg/measure/result_bounds.h"
#include "strata/core/file_identity.h"
#include "strata/csg/boundary/boundary_mesh.h"
#include "strata/csg/boundary/face_parts.h"
#include "strata/csg/input/scene_input.h"
#include "strata/csg/solid_lists.h"
#include "strata/mesh/writers/write_solid.h"
#include "strata/voxelize/formats/voxel_writer.h"
#include "strata/voxelize/grid_fit.h"
#include "strata/voxelize/voxelize.h"

namespace strata::view {
namespace {

std::string materials_of(const std::string& path) {
  return std::filesystem::path(path).replace_extension(".mtl").string();
}

/// The input's mesh files alone, to be read with their parts and colours. A pipe has nothing left,
/// and of a file that is gone the mesh that is shown is all there is.
csg::SceneInput mesh_files_of(const csg::SceneInput& input) {
  csg::SceneInput meshes = input;
  meshes.attributes = true;
  meshes.expression.clear();
  std::erase_if(meshes.files, [&](const std::string& path) {
    std::error_code gone;
    return path == "-" || !std::filesystem::is_regular_file(path, gone) ||
           csg::kind_of(path, input).is_scene;
  });
  return meshes;
}

/// Refuses a file that no longer holds the mesh that is shown.
Result<void> check_unchanged(const csg::Tree& read, const csg::Tree& shown) {
  for (const csg::Solid& now : read.solids()) {
    for (const csg::Solid& then : shown.solids()) {
      if (!then.mesh || then.name != now.name || then.mesh == now.mesh) continue;
      if (then.mesh->triangles == now.mesh->triangles &&
          then.mesh->positions == now.mesh->positions) {
        continue;
      }
      return fail(ErrorCode::kInput, "{}: the file has changed since it was read; load it again",
                  now.name);
    }
  }
  return {};
}

/// Parts and colours of the faces that mesh files give, and how the result is divided.
Result<csg::FaceParts> parts_of_files(const ExportRequest& request, csg::BoundaryOptions& options,
                                      apps::Session& session, const Execution& execution) {
  const csg::SceneInput input = mesh_files_of(request.input);
  if (input.files.empty()) return csg::FaceParts();
  std::vector<csg::InputFacts> facts;
  const auto read = csg::load_scene(input, {}, execution, &facts);
  if (!read) return tl::unexpected(read.error());
  const csg::Tree& tree = request.what->tree;
  if (auto same = check_unchanged(read->tree, tree); !same) return tl::unexpected(same.error());
  const auto any = [&](auto&& is) { return std::any_of(facts.begin(), facts.end(), is); };
  if (any([](const csg::InputFacts& file) { return file.attributes.parts.size() > 1; })) {
    options.parts = csg::BoundaryParts::kSolids;
  } else if (any([](const csg::InputFacts& file) { return file.attributes.coloured(); })) {
    options.parts = csg::BoundaryParts::kColours;
  }
  auto faces = apps::face_parts(tree, facts, options.parts, session, execution);
  if (!faces) return faces;
  // A colour that was given here is that of the whole solid.
  for (std::size_t s = 0; s < faces->of_triangles.size(); ++s) {
    if (tree.solids()[s].colour) faces->of_triangles[s].clear();
  }
  return faces;
}

Result<std::string> export_mesh(const ExportRequest& request, const Execution& execution) {
  const csg::Tree& tree = request.what->tree;
  const SolidFormat format = solid_format_of(request.path);
  csg::BoundaryOptions options;
  options.float_positions = format == SolidFormat::kStl;
  const bool coloured =
      std::any_of(tree.solids().begin(), tree.solids().end(),
                  [](const csg::Solid& solid) { return solid.colour.has_value(); });
  if (coloured && format != SolidFormat::kStl) options.parts = csg::BoundaryParts::kColours;
  Execution quiet = execution;
  quiet.progress = {};
  apps::Session session(apps::Session::Clock::now(), quiet);
  csg::FaceParts faces;
  if (format != SolidFormat::kStl) {
    auto of_files = parts_of_files(request, options, session, quiet);
    if (!of_files) return tl::unexpected(of_files.error());
    faces = *std::move(of_files);
  }
  auto made = csg::boundary_mesh(tree, tree.root(), options, faces, execution);
  if (!made) return tl::unexpected(made.error());
  if (made->mesh.triangles.empty()) {
    return fail(ErrorCode::kGeometry, "{}: nothing is left to write", request.path);
  }
  SolidWriteOptions writing;
  writing.format = format;
  writing.unit = apps::unit_of_output(request.input);
  const bool in_colours = std::any_of(made->mesh.parts.begin(), made->mesh.parts.end(),
                                      [](const MeshPart& part) { return part.colour.has_value(); });
  if (in_colours && format == SolidFormat::kObj) writing.materials = materials_of(request.path);
  auto written = write_solid(request.path, made->mesh, writing, quiet);
  if (!written) return tl::unexpected(written.error());
  std::string told =
      fmt::format("{}: {}", request.path, counted(made->mesh.triangles.size(), "triangle"));
  if (options.parts == csg::BoundaryParts::kSolids) {
    told += ", " + counted(made->mesh.parts.size(), "part");
  }
  if (!made->report.caps.empty()) {
    told += fmt::format(", {} closed", counted(made->report.caps.size(), "hole"));
  }
  for (const apps::Warning& warning : session.warnings()) told += "; " + warning.message;
  return told;
}

Result<std::string> export_voxels(const ExportRequest& request, const Execution& execution) {
  const csg::Tree& tree = request.what->tree;
  const auto format = voxel_format_for(request.path, "");
  if (!format) return tl::unexpected(format.error());
  Execution quiet = execution;
  quiet.progress = {};
  const auto box = csg::result_bounds(tree, tree.root(), 0, quiet);
  if (!box) return tl::unexpected(box.error());
  GridRequest wanted;
  wanted.resolution = request.resolution;
  if (box->empty()) {
    return fail(ErrorCode::kGeometry, "{}: nothing is left to write", request.path);
  }
  const auto grid = fit_grid(*box, wanted);
  if (!grid) return tl::unexpected(grid.error());
  csg::SolidLists lists(tree, tree.root());
  if (auto fitted = lists.fit(*grid, nullptr, quiet); !fitted)
    return tl::unexpected(fitted.error());
  VoxelizeOptions options;
  options.axis = format->axis;
  options.closedness = Closedness::kAssumeClosed;  // the filter makes closed lists
  options.filter = &lists.filter();
  const auto set = voxelize(lists.soup(), *grid, options, execution);
  if (!set) return tl::unexpected(set.error());
  if (auto written = write_voxels(*set, request.path, {}, quiet); !written) {
    return tl::unexpected(written.error());
  }
  return fmt::format("{}: {} x {} x {} voxels, {} solid", request.path, grid->dims.x, grid->dims.y,
                     grid->dims.z, set->solid_voxels());
}

/// The voxels of a file in another format, or with another threshold.
Result<std::string> export_read_voxels(const ExportRequest& request, ExportKind kind,
                                       const Execution& execution) {
  if (kind == ExportKind::kMesh) {
    return fail(ErrorCode::kUsage, "{}: meshes are made of meshes and scenes, these are voxels",
                request.path);
  }
  const auto set = request.what->voxels->solid(request.what->voxel_looks.threshold, execution);
  VoxelWriterOptions options;
  for (int tv = 0; set->has_labels() && tv < set->tiles_v(); ++tv) {
    for (int tu = 0; tu < set->tiles_u(); ++tu) {
      for (const std::uint32_t label : set->tile(tu, tv).labels) {
        options.ids = std::max(options.ids, label);
      }
    }
  }
  if (auto written = write_voxels(*set, request.path, options, execution); !written) {
    return tl::unexpected(written.error());
  }
  const glm::ivec3 dims = set->grid().dims;
  return fmt::format("{}: {} x {} x {} voxels, {} solid", request.path, dims.x, dims.y, dims.z,
                     set->solid_voxels());
}

Result<std::string> export_safely(const ExportRequest& request, const Execution& execution) {
  try {
    return export_what_is_seen(request, execution);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory", request.path);
  } catch (const std::exception& failure) {
    return fail(ErrorCode::kInternal, "internal error: {}", failure.what());
  }
}

}  // namespace

Result<ExportKind> export_kind(const std::string& path) {
  if (has_extension(path, ".png")) return ExportKind::kPicture;
  if (solid_format_of(path) != SolidFormat::kAuto) return ExportKind::kMesh;
  if (voxel_format_for(path, "")) return ExportKind::kVoxels;
  return fail(ErrorCode::kUsage,
              "{}: the name must end as a mesh (.3mf .stl .obj .ply .off), as voxels (.vdb .npy "
              ".nrrd ..., / for a folder of slices) or as a picture (.png)",
              path);
}

std::vector<std::string> export_files(const std::string& path) {
  std::vector<std::string> files{path};
  if (solid_format_of(path) == SolidFormat::kObj) files.push_back(materials_of(path));
  return files;
}

Result<std::string> export_what_is_seen(const ExportRequest& request, const Execution& execution) {
  const auto kind = export_kind(request.path);
  if (!kind) return tl::unexpected(kind.error());
  if (*kind == ExportKind::kPicture) {
    return fail(ErrorCode::kUsage, "{}: the window writes pictures", request.path);
  }
  if (request.what->voxels) return export_read_voxels(request, *kind, execution);
  return *kind == ExportKind::kMesh ? export_mesh(request, execution)
                                    : export_voxels(request, execution);
}

void Exporter::start(ExportRequest request, int threads) {
  busy_ = true;
  progress_ = 0;
  thread_ = std::jthread([this, request = std::move(request), threads](std::stop_token stop) {
    Execution execution;
    execution.threads = threads;
    execution.stop = std::move(stop);
    execution.progress = [this](double fraction) { progress_ = fraction; };
    auto result = export_safely(request, execution);
    {
      const std::lock_guard lock(mutex_);
      done_ = std::move(result);
    }
    busy_ = false;
    wake_();
  });
}

std::optional<Result<std::string>> Exporter::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(done_, {});
}

}  // namespace strata::view
