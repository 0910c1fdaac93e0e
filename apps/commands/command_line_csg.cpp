// `strata csg` on the command line.

#include <CLI/App.hpp>

#include "apps/commands/choice_words.h"
#include "apps/commands/command_words.h"
#include "apps/commands/scene_options.h"
#include "apps/session/file_conflicts.h"
#include "apps/session/help.h"
#include "apps/session/option_values.h"

namespace strata::apps {
namespace {

constexpr const char* kCsgExamples =
    R"(Draw or measure a Boolean tree: a scene, a union of meshes, an expression.

  strata csg plate.csg                      measures as text
  strata csg plate.csg -o plate.png         from OpenSCAD's direction
  strata csg part.scad -o part.png --size 1920,1080 --quality high
  strata csg part.scad -D 'width=40' -o wide.png            set a variable
  strata csg plate.stl holes.stl --expr 'plate - holes' -o part.png
  strata csg a.stl b.stl c.stl --expr '(a + b) * c' -o part.png    by position
  strata csg part.csg -o part.png --camera=0,0,5,60,0,30,140 --cut 'y>0'
  strata csg part.csg -o part.webp --turntable 60

In --expr, + and | unite, - subtracts, * and & intersect and bind first, and ^
is exclusive or. A .scad file that sets $vpr, $vpt, $vpd or $vpf places the
camera; --camera overrides it. The options --camera, --projection, --colorscheme
and --render are OpenSCAD's as well.
)";

using Group = const char*;

}  // namespace

void define_picture_input(CLI::App& app, Words& words) {
  const Group input = "Input";
  app.add_option("INPUT", words.files,
                 "Scenes (.csg .scad) and meshes (.obj .stl .ply .off .3mf .amf .gltf .glb); - "
                 "reads standard input")
      ->type_name("")
      ->group(input);
  app.add_option("--expr", words.csg.expression,
                 "Boolean expression to draw, such as 'a - b' (default: the union of all inputs)")
      ->type_name("EXPR")
      ->group(input);
  app.add_option("--input-format", words.input_format,
                 "Format of standard input, or of every file where standard input is not read "
                 "(default: auto, by name and content)")
      ->type_name("csg|" + choices(kMeshFormatWords))
      ->group(input);
  app.add_option(
         "--rule", words.rule,
         "Winding numbers that are inside a mesh: above 0, not 0, or odd (default: winding)")
      ->type_name(choices(kRuleWords))
      ->group(input);
  app.add_flag("--keep-orientation", words.keep_orientation,
               "Do not reverse meshes that are inside out")
      ->group(input);
}

void define_picture_camera(CLI::App& app, CsgWords& csg) {
  const Group camera = "Camera (default: OpenSCAD's direction, the result fills the picture)";
  const auto option = [&](const char* names, std::string& word, const char* what,
                          const char* value) {
    app.add_option(names, word, what)->type_name(value)->group(camera);
  };
  option("--size,--imgsize", csg.size, "Width and height in pixels (default: 512,512)", "W,H");
  option("--camera", csg.camera,
         "Target x,y,z, rotation rx,ry,rz in degrees and distance; or eye x,y,z and target x,y,z",
         "NUMBERS");
  app.add_flag("--view-all,--viewall", csg.view_all,
               "Move back until everything is visible, as OpenSCAD does: a ball fits")
      ->group(camera);
  app.add_flag("--auto-center,--autocenter", csg.auto_centre, "Look at the centre of the scene")
      ->group(camera);
  option("--projection", csg.projection, "Perspective or orthographic (default: p)", "p|o");
}

void define_films(CLI::App& app, CsgWords& csg) {
  const Group films = "Films (-o FILE.gif, .webp, .apng, or FOLDER/ of PNG files)";
  const auto option = [&](const char* names, std::string& word, const char* what,
                          const char* value) {
    app.add_option(names, word, what)->type_name(value)->group(films);
  };
  option("--turntable", csg.turntable,
         "Draw N pictures of one turn about the vertical axis, 1 to 99999", "N");
  option("--camera-file", csg.camera_file,
         "Camera as a file, such as the window saves; with times also the path of a film", "FILE");
  option("--frames", csg.path_frames, "Draw N pictures along the path of --camera-file", "N");
  option("--fps", csg.fps, "Pictures a second, 0.1 to 100, of a .gif to 50 (default: 25)",
         "NUMBER");
}

void define_picture_quality(CLI::App& app, CsgWords& csg) {
  app.add_option("--colorscheme", csg.scheme,
                 "Neutral, or one of OpenSCAD's, with its lights and facets (default: Neutral)")
      ->type_name("SCHEME")
      ->group(kLookGroup);
  app.add_option("--quality", csg.quality, "Samples per pixel: 1, 8 or 16 (default: normal)")
      ->type_name("draft|normal|high")
      ->group(kLookGroup);
  app.add_option("--samples", csg.samples, "Samples per pixel (default: those of --quality)")
      ->type_name("1|2|4|8|16|32|64")
      ->group(kLookGroup);
}

void define_picture_cuts(CLI::App& app, CsgWords& csg) {
  app.add_option("--background", csg.background,
                 "Background: a gradient, transparent, or a colour such as white or #f0f4f8 "
                 "(default: that of the colour scheme)")
      ->type_name("gradient|transparent|COLOUR")
      ->group(kLookGroup);
  app.add_flag("--transparent", csg.transparent, "The same as --background transparent")
      ->group(kLookGroup);
  app.add_option("--cut", csg.cuts,
                 "Section plane: x=5 removes the half towards the camera, z<10 keeps z below 10, "
                 "nx,ny,nz,d keeps nx*x + ny*y + nz*z below d; may be repeated")
      ->type_name("PLANE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->group(kLookGroup);
}

namespace {

/// Those that openscad has, too, and that are not among the others.
void define_openscad(CLI::App& app, CsgWords& csg) {
  define_scene_options(app, csg.scene);
  app.add_flag("--preview{-}", csg.preview,
               "Draw with ghosts and colours (default; the opposite of --render)")
      ->group(kOpenscadGroup);
  app.add_option("--view", csg.shown, "The same as --edges")
      ->type_name("edges")
      ->group(kOpenscadGroup);
  app.add_option("--animate", csg.frames,
                 "Draw N pictures with $t = 0, 1/N, ..., 1 to 99999: -o a.png writes a00000.png, "
                 "a00001.png, ..., other names a film")
      ->type_name("N")
      ->group(kOpenscadGroup);
  app.add_option("--export-format", csg.export_format, "Format of -o; png is the only one")
      ->type_name("png")
      ->group(kOpenscadGroup);
  app.add_flag("--summary{all}", csg.summary, "Print the measures as text as well")
      ->group(kOpenscadGroup);
  app.add_option("--summary-file", csg.summary_file, "Refused: --json=FILE does this")
      ->type_name("FILE")
      ->group("");
  app.add_option("--csglimit", csg.csg_limit, "Has no effect: scenes have no limit")
      ->type_name("N")
      ->group(kOpenscadGroup);
}

void define_look(CLI::App& app, Words& words) {
  CsgWords& csg = words.csg;
  define_picture_quality(app, csg);
  app.add_flag("--render{-}", csg.render,
               "Draw the result alone: no ghosts, no colours, flat scenes from above")
      ->group(kLookGroup);
  app.add_flag("--edges", csg.edges, "Draw dark lines along the edges of faces")->group(kLookGroup);
  app.add_option("--crease", csg.crease,
                 "Draw faces that meet at less than this as one curved surface, 0 to 180; 0: as "
                 "facets (default: 30; under OpenSCAD's schemes 0)")
      ->type_name("DEGREES")
      ->group(kLookGroup);
  app.add_option("--occlusion", csg.occlusion,
                 "Darken corners and holes, which see little around them (default: on; under "
                 "OpenSCAD's schemes off)")
      ->type_name("on|off")
      ->group(kLookGroup);
  app.add_option("--caps", csg.caps, "Faces of --cut under the scheme Neutral (default: hatched)")
      ->type_name("plain|hatched")
      ->group(kLookGroup);
  app.add_flag("--shadow", csg.shadow, "Draw a soft shadow on the plane below the result")
      ->group(kLookGroup);
  define_picture_cuts(app, csg);
}

}  // namespace

void define_csg(CLI::App& app, Words& words) {
  app.description(kCsgExamples);
  CsgWords& csg = words.csg;
  define_picture_input(app, words);
  const auto option = [&app](const char* names, std::string& word, const char* what,
                             const std::string& value, Group group) {
    app.add_option(names, word, what)->type_name(value)->group(group);
  };
  const Group output = "Output (default: the measures as text)";
  option("-o,--output", words.output, "Picture to write, .png; - for standard output", "FILE",
         output);
  option("--ids", csg.ids, "Picture of solid ids to write, .png: a colour for each opaque solid",
         "FILE", output);
  option("--depth", csg.depth,
         "Distances along the view to write, .exr, channel Z, in the scene's units", "FILE",
         output);
  add_json(app, words, output);
  option("--measure", csg.measure,
         "Measure by rays, with N voxels along each side of the box, 1 to 32768 (default: exactly; "
         "where a solid is not closed, 256, and up to 1024 where the error of the volume is large)",
         "N", output);
  define_picture_camera(app, csg);
  define_films(app, csg);
  define_look(app, words);
  add_backend(app, words, "Running");
  add_common(app, words);
  define_openscad(app, csg);
}

void picture_request(const Words& words, Reader& reader, PictureRequest& request) {
  request.common = common_options(words, reader);
  request.input = input_options(words, true, reader);
  reader.take(parse_choice("--rule", words.rule, kRuleWords), request.input.rule);
  request.input.keep_orientation = words.keep_orientation;
  request.output = words.output;
  if (!words.json.empty()) request.json = words.json;
  if (!words.output.empty()) return;
  refuse_bare_outputs(
      words.files, [](const std::string& file) { return has_extension(file, ".png"); }, reader);
}

CsgCommand csg_command(Words words, Reader& reader) {
  CsgCommand command;
  picture_request(words, reader, command);
  reader.take(parse_choice("--backend", words.backend, kBackendWords), command.backend);
  if (!reader.error()) reader.take(read_csg_options(words.csg, command));
  return command;
}

}  // namespace strata::apps
