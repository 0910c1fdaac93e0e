// strata-verify compares Strata's result of a Boolean tree with CGAL's exact one. Exit codes are
// those of ErrorCode; 7 means that they differ.

#include <fmt/core.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstdio>
#include <exception>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/commands/file_uses.h"
#include "apps/session/file_conflicts.h"
#include "apps/session/help.h"
#include "apps/session/json_writer.h"
#include "apps/session/session.h"
#include "apps/strata/library_session.h"
#include "apps/verify/comparison.h"
#include "apps/verify/verify_options.h"
#include "strata/csg/input/scene_input.h"

namespace strata::apps {
namespace {

std::string size_line(const char* name, const SizeCheck& check) {
  return fmt::format("{:<8} {:>16.9g}  CGAL {:>16.9g}  difference {:.3g}, bound {:.3g}{}\n", name,
                     check.lists, check.exact, check.difference(), check.bound,
                     check.within() ? "" : "  OUTSIDE");
}

std::string point_lines(const char* name, const PointCheck& check) {
  std::string text = fmt::format(
      "{:<8} {} compared, {} inside; {} on the surface, {} differ within the snap, {} wrong{}\n",
      name, check.compared, check.inside, check.boundary, check.near, check.wrong,
      check.wrong == 0 ? "" : "  OUTSIDE");
  for (const auto& example : check.examples) {
    text += fmt::format("         {}, {}, {} is {} by CGAL\n", example.point.x, example.point.y,
                        example.point.z, example.inside ? "inside" : "outside");
  }
  return text;
}

std::string snapped_line(const SnapCheck& check) {
  if (!check.compared) return fmt::format("snapped  not compared: {}\n", check.reason);
  return fmt::format("snapped  {:>16.9g}  CGAL {:>16.9g}  {}\n", check.boundary, check.exact,
                     check.equal ? "equal as fractions" : "NOT EQUAL as fractions");
}

void write(JsonWriter& json, const SnapCheck& check) {
  json.key("snapped").begin_object();
  json.member("compared", check.compared);
  if (check.compared) {
    json.member("boundary", check.boundary);
    json.member("exact", check.exact);
    json.member("equal", check.equal);
  } else {
    json.member("reason", check.reason);
  }
  json.end_object();
}

void write(JsonWriter& json, const char* name, const SizeCheck& check) {
  json.key(name).begin_object();
  json.member("lists", check.lists);
  json.member("exact", check.exact);
  json.member("difference", check.difference());
  json.member("bound", check.bound);
  json.member("within", check.within());
  json.end_object();
}

void write(JsonWriter& json, const char* name, const PointCheck& check) {
  json.key(name).begin_object();
  json.member("compared", check.compared);
  json.member("inside", check.inside);
  json.member("boundary", check.boundary);
  json.member("near", check.near);
  json.member("wrong", check.wrong);
  json.key("examples").begin_array();
  for (const auto& example : check.examples) {
    json.begin_object();
    json.member("point", example.point);
    json.member("inside", example.inside);
    json.end_object();
  }
  json.end_array();
  json.end_object();
}

std::string report(const Verification& found, double milliseconds) {
  JsonWriter json;
  json.begin_object();
  json.member("agrees", found.agrees());
  write(json, "volume", found.volume);
  write(json, "area", found.area);
  write(json, "voxels", found.voxels);
  write(json, "points", found.points);
  write(json, found.snapped);
  json.key("exact").begin_object();
  json.member("solids", found.exact.solids);
  json.member("corefinements", found.exact.corefinements);
  json.member("nef_operations", found.exact.nef_operations);
  json.member("triangles", found.exact.triangles);
  json.end_object();
  json.member("milliseconds", milliseconds);
  json.end_object();
  return json.take();
}

Result<void> run(const VerifyWords& words, Session& session) {
  session.configure(words.command.common);
  if (words.has_json) {
    std::vector<FileUse> read = inputs_of(words.command.input);
    if (!words.against.empty()) read.push_back({"--against", words.against});
    const std::vector<FileUse> written{{"--json", words.json}};
    if (auto kept = check_files(read, written); !kept) return kept;
    session.set_outputs(written);
  }
  const auto load = [&session](const csg::SceneInput& input) {
    return csg::load_scene(input, messages_of(session), session.execution("reading"));
  };
  const auto scene = load(words.command.input);
  if (!scene) return tl::unexpected(scene.error());
  std::optional<csg::Scene> other;
  if (!words.against.empty()) {
    csg::SceneInput input = words.command.input;
    input.files = {words.against};
    input.expression.clear();
    auto loaded = load(input);
    if (!loaded) return tl::unexpected(loaded.error());
    other = *std::move(loaded);
  }
  if (auto strict = session.check_strict(); !strict) return strict;
  const Execution execution = session.execution("verifying", 1.0);
  const auto found =
      verify(scene->tree, other ? other->tree : scene->tree, words.options, execution);
  session.end_progress();
  if (!found) return tl::unexpected(found.error());
  if (words.has_json) {
    auto printed = print_report(report(*found, session.milliseconds()), words.json, false);
    if (!printed) return printed;
  }
  if (!words.command.common.quiet && !(words.has_json && words.json == "-")) {
    const std::string text = size_line("volume", found->volume) + size_line("area", found->area) +
                             point_lines("voxels", found->voxels) +
                             point_lines("points", found->points) + snapped_line(found->snapped);
    auto printed = write_text(STDOUT_FILENO, text, "standard output");
    if (!printed) return printed;
  }
  if (!found->agrees()) {
    return fail(ErrorCode::kVerification, "Strata and CGAL differ by more than the method allows");
  }
  return {};
}

int verify_main(int argc, char** argv) {
  Session session(Session::Clock::now());
  CLI::App app("", "strata-verify");
  VerifyWords words;
  define_verify_options(app, words);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    const bool all = dynamic_cast<const CLI::CallForAllHelp*>(&asked) != nullptr;
    const bool version = dynamic_cast<const CLI::CallForVersion*>(&asked) != nullptr;
    const std::string text = version ? app.version() + "\n" : help_text(app, all);
    return write_text(STDOUT_FILENO, text, "standard output")
               ? 0
               : static_cast<int>(ErrorCode::kOutput);
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "strata-verify: error: {}\nstrata-verify: see strata-verify --help\n",
               parse_mistake(app, error));
    return static_cast<int>(ErrorCode::kUsage);
  }
  words.has_json = app.count("--json") > 0;
  if (words.has_json && words.json.empty()) words.json = "-";
  Result<void> result;
  try {
    result = run(words, session);
  } catch (const std::bad_alloc&) {
    result = fail(ErrorCode::kLimit, "out of memory");
  }
  session.end_progress();
  if (result) return 0;
  const ErrorCode code = session.interrupted() ? ErrorCode::kCancelled : result.error().code;
  session.complain({code, result.error().message});
  return static_cast<int>(code);
}

}  // namespace
}  // namespace strata::apps

int main(int argc, char** argv) {
  try {
    return strata::apps::verify_main(argc, argv);
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "strata-verify: error: %s\n", failure.what());
    return static_cast<int>(strata::ErrorCode::kInternal);
  }
}
