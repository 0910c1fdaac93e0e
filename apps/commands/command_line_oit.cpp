// `strata oit` on the command line.

#include <CLI/App.hpp>

#include "apps/commands/command_words.h"
#include "apps/session/help.h"

namespace strata::apps {
namespace {

constexpr const char* kOitExamples =
    R"(Draw transparent meshes or scenes by techniques of order-independent transparency.

  strata oit knot.obj --opacity 0.4 -o knot.png           exact: sorted lists
  strata oit knot.obj --technique mlab:4 -o knot.png      four rows a pixel
  strata oit knot.obj --technique all -o pictures/        a picture each
  strata oit glass.csg --technique mlab:4,mlab:8 --json   costs and errors
  strata oit glass.csg --technique all --report report/   a page that compares
  strata oit fog.csg --media fog.json --light 1,2,3 -o fog.png
  strata oit --list                                       all techniques

Each technique has a name, some a number such as slots a pixel and a variant:
NAME, NAME:K, NAME:VARIANT or NAME:K:VARIANT. Without --technique the picture is
the exact one.
)";

}  // namespace

void define_oit(CLI::App& app, Words& words) {
  app.description(kOitExamples);
  CsgWords& csg = words.csg;
  OitWords& oit = words.oit;
  define_picture_input(app, words);
  const auto option = [&app](const char* names, std::string& word, const char* what,
                             const char* value, const char* group) {
    app.add_option(names, word, what)->type_name(value)->group(group);
  };
  const char* technique = "Transparency";
  app.add_option("--technique", oit.techniques,
                 "Techniques to draw by, separated by commas, or all (default: count-scan, which "
                 "is exact); may be repeated")
      ->type_name("TECHNIQUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->group(technique);
  option("--opacity", oit.opacity,
         "Opacity of all that is opaque by its colour or material, 0 to 1 (default: 0.5, or 1 if "
         "something is transparent already)",
         "A", technique);
  option("--seed", oit.seed, "Seed of techniques that draw random numbers (default: 1)", "N",
         technique);
  option("--load", oit.load, "Records over cells of hash tables, above 0, at most 1 (default: 0.5)",
         "L", technique);
  option("--threshold", oit.threshold,
         "Opacity behind which fragments may be left out by techniques that do so, above 0, at "
         "most 1 (default: 0.99)",
         "T", technique);
  option("--media", oit.media,
         "Media inside of closed solids and particles to draw, a .json file (docs/media.md)",
         "FILE", technique);
  option("--light", oit.light, "With --media: direction to a light, instead of the file's", "X,Y,Z",
         technique);
  app.add_flag("--fxaa", oit.fxaa,
               "Filter pictures before they are written: FXAA blends what looks like the steps of "
               "an edge")
      ->group(technique);
  app.add_flag("--list", oit.list,
               "List all techniques with accuracy, memory, papers and where they fail, and exit")
      ->group(technique);
  const char* output = "Output";
  option("-o,--output", words.output,
         "Picture to write, .png, or .exr in linear float; FOLDER/ for a picture each; - for "
         "standard output. Several techniques write FILE-NAME.png",
         "FILE", output);
  option("--report", oit.report,
         "Folder for a page, index.html, that compares the techniques by pictures, differences, "
         "costs and times",
         "FOLDER", output);
  add_json(app, words, output);
  define_picture_camera(app, csg);
  define_picture_quality(app, csg);
  define_picture_cuts(app, csg);
  add_common(app, words);
  define_scene_options(app, csg.scene);
}

OitCommand oit_command(Words words, Reader& reader) {
  OitCommand command;
  command.list = words.oit.list;
  if (command.list) {
    command.common = common_options(words, reader);
    if (!words.json.empty()) command.json = words.json;
    return command;
  }
  picture_request(words, reader, command);
  if (!reader.error()) reader.take(read_picture_options(words.csg, command));
  if (!reader.error()) reader.take(read_oit_options(words.oit, command));
  if (words.csg.background == "gradient") {
    reader.fail_with(
        "--background gradient: strata oit draws one colour; give that, or transparent");
  }
  // Comparisons are of one sample unless told: their costs grow with the samples.
  const bool compares = command.all || command.choices.size() > 1 || !command.report.empty();
  if (compares && !command.asked_samples) command.picture.samples = 1;
  return command;
}

}  // namespace strata::apps
