#include "csg/scene/scene.h"

#include <filesystem>
#include <iterator>
#include <new>
#include <utility>
#include <vector>

#include "csg/scene/csg_parser.h"
#include "csg/scene/evaluator.h"
#include "csg/scene/scad.h"
#include "mesh/input_bytes.h"

namespace strata::csg {
namespace {

Result<Scene> evaluate(std::string_view text, const std::string& name, const std::string& folder,
                       const ReadSceneOptions& options, const Execution& execution) try {
  auto ast = parse_csg(text, name);
  if (!ast) return tl::unexpected(ast.error());
  return Evaluator(*ast, execution, options.asset_folder.empty() ? folder : options.asset_folder)
      .run();
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "{}: too large for the memory", name);
} catch (const std::exception& error) {
  return fail(ErrorCode::kInternal, "{}: {}", name, error.what());
}

}  // namespace

Result<Scene> read_scene(const std::string& path, const ReadSceneOptions& options,
                         const Execution& execution) {
  const std::filesystem::path file(path);
  const std::string folder = file.parent_path().string();
  if (file.extension() == ".scad" || file.extension() == ".SCAD") {
    auto run = run_openscad(path, options.scad_timeout_s, execution);
    if (!run) return tl::unexpected(run.error());
    auto scene = evaluate(run->text, path + " (as .csg)", folder, options, execution);
    if (!scene) return scene;
    std::vector<SceneWarning> warnings;
    for (std::string& text : run->warnings) warnings.push_back({"openscad", std::move(text)});
    scene->warnings.insert(scene->warnings.begin(), std::make_move_iterator(warnings.begin()),
                           std::make_move_iterator(warnings.end()));
    scene->notes = std::move(run->notes);
    return scene;
  }
  auto bytes = detail::InputBytes::open(path, execution.memory_limit, execution.stop);
  if (!bytes) return tl::unexpected(bytes.error());
  return evaluate(bytes->view(), path, folder, options, execution);
}

Result<Scene> parse_scene(std::string_view text, const std::string& name,
                          const ReadSceneOptions& options, const Execution& execution) {
  return evaluate(text, name, {}, options, execution);
}

}  // namespace strata::csg
