// The manual pages and the completions that the build has made: nothing that --help-all shows is
// missing, and the programs that read them take them.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

namespace strata {
namespace {

namespace fs = std::filesystem;

const fs::path kFolder = STRATA_MANUAL_FOLDER;
const std::string kTool = STRATA_TOOL;

std::string read(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// What a command of the shell prints, on both streams.
std::string output_of(const std::string& command) {
  std::string text;
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return "popen failed";
  std::array<char, 4096> part;
  while (const std::size_t n = fread(part.data(), 1, part.size(), pipe))
    text.append(part.data(), n);
  pclose(pipe);
  return text;
}

bool is_there(const std::string& program) { return !output_of("command -v " + program).empty(); }

/// `-j`, `--threads`, ...: the names at the beginnings of the entries of --help-all.
std::vector<std::string> options_of(const std::string& command) {
  std::vector<std::string> names;
  std::istringstream lines(output_of(kTool + " " + command + " --help-all"));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line.starts_with("  -") ? line : "");
    for (std::string word; words >> word && word.starts_with('-');) {
      const bool more = word.ends_with(',');
      names.push_back(word.substr(0, word.find_first_of(",[")));
      if (!more) break;
    }
  }
  return names;
}

/// A page as it is read, on lines without an end.
std::string shown(const fs::path& page) {
  return output_of("MANWIDTH=10000 man -l '" + page.string() + "' | col -bx");
}

/// What bash proposes for the last word.
std::vector<std::string> completed(const std::string& words) {
  const std::string text = output_of("bash -c 'source " + (kFolder / "bash" / "strata").string() +
                                     "; COMP_WORDS=(" + words +
                                     "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); cd /; _strata; "
                                     "printf \"%s\\n\" \"${COMPREPLY[@]}\"'");
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

using Words = std::vector<std::string>;

TEST(Manual, PagesAndCompletionsHaveEveryOptionOfHelpAll) {
  const std::string zsh = read(kFolder / "zsh" / "_strata");
  const std::string fish = read(kFolder / "fish" / "strata.fish");
  for (const std::string command : {"voxelize", "info", "ldi", "csg"}) {
    const std::vector<std::string> options = options_of(command);
    ASSERT_GT(options.size(), 20u) << command;
    std::string page = read(kFolder / "man" / ("strata-" + command + ".1"));
    for (std::size_t at; (at = page.find("\\-")) != std::string::npos;) page.erase(at, 1);
    const Words proposed = completed("strata " + command + " -");
    for (const std::string& option : options) {
      EXPECT_NE(page.find("\\fB" + option + "\\fR"), std::string::npos) << command << option;
      EXPECT_NE(std::find(proposed.begin(), proposed.end(), option), proposed.end())
          << command << option;
      EXPECT_NE(zsh.find("'" + option), zsh.find("'*" + option)) << command << option;
      const bool is_long = option.starts_with("--");
      const std::string name = (is_long ? " -l " : " -s ") + option.substr(is_long ? 2 : 1) + " ";
      EXPECT_NE(fish.find(name), std::string::npos) << command << option;
    }
  }
}

TEST(Manual, BashCompletesCommandsChoicesAndValuesBehindAnEqualsSign) {
  EXPECT_EQ(completed("strata vox"), Words{"voxelize"});
  EXPECT_EQ(completed("strata voxelize --rule \"\""), (Words{"winding", "nonzero", "parity"}));
  EXPECT_EQ(completed("strata voxelize --rule = n"), Words{"nonzero"});
  EXPECT_EQ(completed("strata voxelize --surface ="), (Words{"conservative", "26", "6"}));
  EXPECT_EQ(completed("strata part.scad --projection \"\""), (Words{"p", "o"}));
  EXPECT_EQ(completed("strata csg --colorscheme Corn"), Words{"Cornfield"});
  EXPECT_EQ(completed("strata voxelize --format nr"), Words{"nrrd"});
  EXPECT_EQ(completed("strata ldi --offsets f"), Words{"farthest"});
  EXPECT_EQ(completed("strata voxelize --threads \"\""), Words{""});
  const Words files = completed("strata info /");
  EXPECT_NE(std::find(files.begin(), files.end(), "/usr"), files.end());
}

TEST(Manual, PagesAreCleanRoff) {
  if (!is_there("groff")) GTEST_SKIP() << "groff is not installed";
  std::size_t pages = 0;
  for (const auto& page : fs::directory_iterator(kFolder / "man")) {
    EXPECT_EQ(output_of("groff -man -ww -z '" + page.path().string() + "'"), "") << page.path();
    if (is_there("mandoc")) {
      EXPECT_EQ(output_of("mandoc -Tlint -W warning '" + page.path().string() + "'"), "");
    }
    ++pages;
  }
  EXPECT_GE(pages, 5u);
}

TEST(Manual, APageShowsWhatTheHelpSays) {
  if (!is_there("man")) GTEST_SKIP() << "man is not installed";
  const std::string page = shown(kFolder / "man" / "strata-csg.1");
  for (const char* text : {"--cut PLANE", "$vpr, $vpt, $vpd", "a - b", "'plate - holes'", "and ^",
                           "130", "strata-voxelize(1)"}) {
    EXPECT_NE(page.find(text), std::string::npos) << text << "\n" << page;
  }
  EXPECT_NE(shown(kFolder / "man" / "strata.1").find("voxelize    Turn meshes"), std::string::npos);
}

TEST(Manual, ShellsTakeTheirCompletions) {
  EXPECT_EQ(output_of("bash -n '" + (kFolder / "bash" / "strata").string() + "'"), "");
  if (is_there("zsh")) {
    EXPECT_EQ(output_of("zsh -n '" + (kFolder / "zsh" / "_strata").string() + "'"), "");
  }
  if (is_there("fish")) {
    const std::string file = (kFolder / "fish" / "strata.fish").string();
    const std::string text = output_of("HOME=/tmp fish --no-config -c \"source '" + file +
                                       "'; complete -C 'strata voxelize --rule '\"");
    EXPECT_NE(text.find("parity\t"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace strata
