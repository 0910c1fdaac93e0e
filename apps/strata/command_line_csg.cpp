// `strata csg` on the command line.

#include <CLI/App.hpp>

#include "apps/strata/choice_words.h"
#include "apps/strata/command_words.h"
#include "apps/strata/option_values.h"
#include "apps/strata/scene_options.h"

namespace strata::apps {
namespace {

constexpr const char* kCsgExamples =
    R"(A picture of a Boolean tree: of a scene, of meshes united, of an expression over files.

  strata csg plate.csg                                   what it measures, as text
  strata csg plate.csg -o plate.png                      the whole scene, from OpenSCAD's place
  strata csg part.scad -o part.png --size 1920,1080 --samples 16
  strata csg part.scad -D 'width=40' -o wide.png         a variable of the program
  strata csg plate.stl holes.stl --expr 'plate - holes' -o part.png
  strata csg a.stl b.stl c.stl --expr '(a + b) * c' -o part.png     a, b, c: by position
  strata csg part.csg -o part.png --camera=0,0,5,60,0,30,140 --projection o --cut 'y>0'

In --expr, + and | unite, - takes away, * and & intersect and bind first, ^ is in one of the two.
A .scad file that sets $vpr, $vpt, $vpd or $vpf places the camera; --camera overrules it.
OpenSCAD's options have a block below; --imgsize, --camera, --viewall, --autocenter, --projection,
--colorscheme, --render and --hardwarnings are OpenSCAD's, too.
)";

using Group = const char*;

void define_input(CLI::App& app, Words& words) {
  app.add_option("INPUT", words.files,
                 "Scenes (.csg .scad), meshes (.obj .stl .ply .off); - a pipe")
      ->type_name("");
  const Group input = "Input";
  app.add_option("--expr", words.csg.expression,
                 "What is pictured, such as 'a - b'; else all inputs united")
      ->type_name("EXPR")
      ->group(input);
  app.add_option("--input-format", words.input_format,
                 "csg, obj, stl, ply or off: of -, else of all files whatever their names are")
      ->type_name("FORMAT")
      ->group(input);
  app.add_option("--rule", words.rule,
                 "Inside of meshes: winding (> 0, default), nonzero, parity (odd)")
      ->type_name("RULE")
      ->group(input);
  app.add_flag("--keep-orientation", words.keep_orientation,
               "Do not turn meshes around that are inside out")
      ->group(input);
}

/// Those that openscad has, too, and that are not among the others.
void define_openscad(CLI::App& app, CsgWords& csg) {
  define_scene_options(app, csg.scene);
  app.add_flag("--preview{-}", csg.preview, "What is done without --render")->group(kOpenscadGroup);
  app.add_option("--view", csg.shown, "edges: the same as --edges")
      ->type_name("LIST")
      ->group(kOpenscadGroup);
  app.add_option("--animate", csg.frames,
                 "N pictures with $t = 0, 1/N, ...: -o a.png makes a00000.png, a00001.png, ...")
      ->type_name("N")
      ->group(kOpenscadGroup);
  app.add_option("--export-format", csg.export_format, "png: what -o writes")
      ->type_name("FORMAT")
      ->group(kOpenscadGroup);
  app.add_flag("--summary{all}", csg.summary, "Print the report as text, beside a picture")
      ->group(kOpenscadGroup);
  app.add_option("--summary-file", csg.summary_file, "--json=FILE is meant")
      ->type_name("FILE")
      ->group("");
  app.add_option("--csglimit", csg.csg_limit, "No effect: any number of elements is drawn")
      ->type_name("N")
      ->group(kOpenscadGroup);
}

void define_look(CLI::App& app, Words& words) {
  CsgWords& csg = words.csg;
  const Group look = "Look";
  app.add_option("--colorscheme", csg.scheme, "Cornfield (default) or another of OpenSCAD's")
      ->type_name("NAME")
      ->group(look);
  app.add_option("--samples", csg.samples, "Samples a pixel: 1 (default), 2, 4 ... 64")
      ->type_name("N")
      ->group(look);
  app.add_flag("--render{-}", csg.render,
               "The result alone: no ghosts, no colours, flat scenes from above")
      ->group(look);
  app.add_flag("--edges", csg.edges, "Dark lines along the edges of faces")->group(look);
  app.add_flag("--transparent", csg.transparent, "Background without colour")->group(look);
  add_backend(app, words, look);
  app.add_option("--cut", csg.cuts,
                 "Section: x=5 (cuts what is nearer), z<10 (what stays) or nx,ny,nz,d")
      ->type_name("PLANE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->group(look);
}

}  // namespace

void define_csg(CLI::App& app, Words& words) {
  app.description(kCsgExamples);
  CsgWords& csg = words.csg;
  define_input(app, words);
  const auto option = [&app](const char* names, std::string& word, const char* what,
                             const char* type, Group group) {
    app.add_option(names, word, what)->type_name(type)->group(group);
  };
  const Group output = "Output (without any: the report as text)";
  option("-o,--output", words.output, "Picture to write, .png; - for standard output", "FILE",
         output);
  option("--ids", csg.ids, "Which opaque solid each pixel shows, as colours, .png", "FILE", output);
  option("--depth", csg.depth, "Distance along the view, .exr, channel Z", "FILE", output);
  add_json(app, words, output);
  option("--measure", csg.measure,
         "Voxels along each side of the box that the report measures on; default: 256, up to "
         "1024 where the volume's error asks for it",
         "N", output);
  const Group camera = "Camera (default: all in view from OpenSCAD's place, or as a .scad says)";
  option("--size,--imgsize", csg.size, "width,height in pixels; 512,512", "W,H", camera);
  option("--camera", csg.camera, "x,y,z,rx,ry,rz,distance or eye x,y,z, target x,y,z", "NUMBERS",
         camera);
  app.add_flag("--view-all,--viewall", csg.view_all, "From so far that all is seen")->group(camera);
  app.add_flag("--auto-center,--autocenter", csg.auto_centre, "Look at the middle of it all")
      ->group(camera);
  option("--projection", csg.projection, "p(erspective, default) or o(rtho)", "P", camera);
  define_look(app, words);
  define_openscad(app, csg);
  add_common(app, words);
}

CsgCommand csg_command(Words words, Reader& reader) {
  CsgCommand command;
  command.common = common_options(words, reader);
  command.scene_format = words.input_format == "csg";
  if (command.scene_format) words.input_format = "auto";
  command.input = input_options(words, reader);
  reader.take(parse_choice("--rule", words.rule, kRuleWords), command.rule);
  reader.take(parse_choice("--backend", words.backend, kBackendWords), command.backend);
  command.keep_orientation = words.keep_orientation;
  command.output = words.output;
  if (!words.json.empty()) command.json = words.json;
  if (!reader.error()) reader.take(read_csg_options(words.csg, command));
  return command;
}

}  // namespace strata::apps
