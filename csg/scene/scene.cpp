#include "strata/csg/scene/scene.h"

#include <filesystem>
#include <iterator>
#include <new>
#include <utility>
#include <vector>

#include "core/printable.h"
#include "csg/scene/csg_parser.h"
#include "csg/scene/evaluator.h"
#include "csg/scene/scad.h"
#include "mesh/text/input_bytes.h"

namespace strata::csg {
namespace {

Result<Scene> evaluate(std::string_view text, const std::string& name, const std::string& folder,
                       const ReadSceneOptions& options, const Execution& execution) try {
  auto ast = parse_csg(text, name);
  if (!ast) return tl::unexpected(ast.error());
  return Evaluator(*ast, execution, options.asset_folder.empty() ? folder : options.asset_folder,
                   options.root_folder)
      .run();
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "{}: out of memory", name);
} catch (const std::exception& error) {
  return fail(ErrorCode::kInternal, "{}: {}", name, error.what());
}

}  // namespace

Result<Scene> read_scene(const std::string& path, const ReadSceneOptions& options,
                         const Execution& execution) {
  const std::filesystem::path file(path);
  const std::string folder = file.parent_path().string();
  if (file.extension() == ".scad" || file.extension() == ".SCAD") {
    OpenscadOptions program;
    program.options = options.openscad_options;
    program.timeout_s = options.scad_timeout_s;
    auto run = run_openscad(path, program, execution);
    if (!run) return tl::unexpected(run.error());
    for (const FileIdentity& read : run->files) {
      if (options.root_folder.empty() || lies_below(read.path, options.root_folder)) continue;
      return fail(ErrorCode::kInput,
                  "{}: the program reads the file {}, which lies outside of the root folder {}",
                  path, printable(read.path, 200), options.root_folder);
    }
    auto scene = evaluate(run->text, path + " (as .csg)", folder, options, execution);
    if (!scene) return scene;
    std::vector<SceneWarning> warnings;
    for (std::string& text : run->warnings) warnings.push_back({"openscad", std::move(text)});
    scene->warnings.insert(scene->warnings.begin(), std::make_move_iterator(warnings.begin()),
                           std::make_move_iterator(warnings.end()));
    scene->notes = std::move(run->notes);
    scene->view = std::move(run->view);
    scene->files.insert(scene->files.end(), std::make_move_iterator(run->files.begin()),
                        std::make_move_iterator(run->files.end()));
    return scene;
  }
  FileIdentity itself = identify_file(path);
  auto bytes = detail::InputBytes::open(path, execution.memory_limit, execution.stop);
  if (!bytes) return tl::unexpected(bytes.error());
  auto scene = evaluate(bytes->view(), path, folder, options, execution);
  if (scene && path != "-") scene->files.push_back(std::move(itself));
  return scene;
}

Result<Scene> parse_scene(std::string_view text, const std::string& name,
                          const ReadSceneOptions& options, const Execution& execution) {
  return evaluate(text, name, {}, options, execution);
}

}  // namespace strata::csg
