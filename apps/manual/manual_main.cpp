// Writes the manual pages and the completions of shells from the tables of options that --help is
// written from. Part of the build, not installed.
//
// usage: strata-manual FOLDER [strata-view] [strata-verify] [strata-mpi]: the programs that there
// are besides

#include <CLI/App.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "apps/commands/command_words.h"
#include "apps/manual/program_text.h"
#include "apps/view/view_options.h"
#include "strata/csg/picture/picture.h"
#include "strata/transparency/techniques.h"
#include "strata/voxelize/formats/voxel_writer.h"
#ifdef STRATA_HAVE_VERIFY
#include "apps/verify/verify_options.h"
#endif

namespace strata::manual {
namespace {

/// `strata` itself: its options and commands.
ProgramText strata_text() {
  ProgramText program;
  program.name = "strata";
  program.usage = "strata COMMAND [OPTIONS] FILE...";
  const std::string_view help = apps::top_examples();
  const std::size_t first = help.find(": "), end = help.find('\n');
  program.what = help.substr(first + 2, end - first - 2);
  program.examples = help.substr(end + 2);
  while (program.examples.ends_with('\n')) program.examples.pop_back();
  program.paragraphs = {
      "A file instead of a command is drawn as by \"strata csg\"; so a command line of\n"
      "openscad that writes a picture works with strata as well."};
  apps::OptionGroup options{
      "General",
      {{{"-h", "--help"}, "", "Print a short help and exit"},
       {{"--help-all"},
        "",
        "Print the help of every command with "
        "all options, and exit"},
       {{"-V", "--version"}, "", "Print the version; with --json, also how it was built"}}};
  program.options.push_back(std::move(options));
  std::string commands;
  for (const auto& [name, what] : apps::kCommands) {
    commands += std::string(name) + std::string(12 - name.size(), ' ') + std::string(what) + "\n";
  }
  commands.pop_back();
  program.more.push_back({"Commands", commands});
  return program;
}

std::vector<ProgramText> all_programs(const std::set<std::string>& there) {
  std::vector<ProgramText> programs = {strata_text()};
  for (const auto& [name, what] : apps::kCommands) {
    apps::Words words;
    CLI::App app("", "strata " + std::string(name));
    if (apps::define_command(name, app, words)) programs.push_back(program_text(app));
  }
  if (there.count("strata-view") != 0) {
    view::visit_view_options([&](const CLI::App& app) { programs.push_back(program_text(app)); });
  }
  if (there.count("strata-mpi") != 0) {
    apps::Words words;
    CLI::App app("", "strata-mpi");
    apps::define_command("voxelize", app, words);
    app.description(apps::kRanksHelp);
    programs.push_back(program_text(app));
    programs.back().usage = "mpirun -n N strata-mpi voxelize [OPTIONS] INPUT...";
  }
#ifdef STRATA_HAVE_VERIFY
  if (there.count("strata-verify") != 0) {
    apps::VerifyWords words;
    CLI::App app("", "strata-verify");
    apps::define_verify_options(app, words);
    programs.push_back(program_text(app));
  }
#endif
  return programs;
}

bool write(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) std::fprintf(stderr, "strata-manual: error: cannot write %s\n", path.c_str());
  return bool(file);
}

int manual_main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr,
                 "usage: strata-manual FOLDER [strata-view] [strata-verify] [strata-mpi]\n");
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  const std::set<std::string> there(argv + 2, argv + argc);
  const std::vector<ProgramText> pages = all_programs(there);
  std::vector<std::string> names;
  for (const ProgramText& page : pages) names.push_back(page.name);
  bool written = true;
  for (const ProgramText& page : pages) {
    std::string file = page.name + ".1";
    if (const auto blank = file.find(' '); blank != std::string::npos) file[blank] = '-';
    written = write(folder / "man" / file, man_page(page, names)) && written;
  }
  std::vector<ProgramText> programs = pages;
  for (const ProgramText& page : pages) {
    if (page.name != "strata view") continue;
    programs.push_back(page);  // `strata view` runs this program
    programs.back().name = "strata-view";
  }
  Completion completion{programs, {{"FORMAT", {}}, {"SCHEME", {}}, {"TECHNIQUE", {"all"}}}};
  for (const VoxelFormat& format : voxel_formats()) {
    completion.values[0].values.emplace_back(format.name);
  }
  for (const csg::ColourScheme& scheme : csg::colour_schemes()) {
    completion.values[1].values.emplace_back(scheme.name);
  }
  for (const transparency::Technique* technique : transparency::techniques()) {
    completion.values[2].values.emplace_back(technique->name);
  }
  for (const ProgramText& program : programs) {
    if (program.name.find(' ') != std::string::npos) continue;
    // bash and fish look for a file that is named as the program.
    written = write(folder / "bash" / program.name, bash_completion(completion)) && written;
  }
  written = write(folder / "zsh" / "_strata", zsh_completion(completion)) && written;
  written = write(folder / "fish" / "strata.fish", fish_completion(completion)) && written;
  return written ? 0 : 1;
}

}  // namespace
}  // namespace strata::manual

int main(int argc, char** argv) { return strata::manual::manual_main(argc, argv); }
