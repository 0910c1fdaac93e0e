#include <gtest/gtest.h>
#include <stdlib.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

#include "apps/view/files/editor.h"
#include "apps/view/files/folder_listing.h"
#include "apps/view/files/user_files.h"
#include "apps/view/scene/part_numbers.h"
#include "apps/view/scene/view_history.h"
#include "strata/csg/scene/scene.h"
#include "tests/support/temporary_folder.h"

namespace strata::view {
namespace {

TEST(Editor, APlaceIsFoundInMessagesAndNames) {
  using Place = TextPlace;
  EXPECT_EQ(place_in("plate.csg:12:3: unknown node"), (Place{"plate.csg", 12}));
  EXPECT_EQ(place_in("a b/c.scad:7: openscad: WARNING: x"), (Place{"a b/c.scad", 7}));
  EXPECT_EQ(place_in("cube at dir/plate.csg:12:3"), (Place{"dir/plate.csg", 12}));
  EXPECT_EQ(place_in("cube at box.scad (as .csg):21:6"), (Place{"box.scad", 1}));
  EXPECT_EQ(place_in("C:x.csg:4"), (Place{"C:x.csg", 4}));
  for (const char* none : {"knot.obj", "section 1", "", ":", "a:0", "x:12a", "scan.ply: open"}) {
    EXPECT_FALSE(place_in(none)) << none;
  }
}

TEST(Editor, WordsAreFilledInWithoutAShell) {
  const auto words = [](const std::string& command) {
    const auto filled = editor_words(command, {"/tmp/a b;$x.csg", 12});
    EXPECT_TRUE(filled) << command;
    return filled.value_or(std::vector<std::string>());
  };
  using Words = std::vector<std::string>;
  EXPECT_EQ(words("ed -x %f:%l"), (Words{"ed", "-x", "/tmp/a b;$x.csg:12"}));
  EXPECT_EQ(words("'my editor' \"+%l\" '%f' 100%%"),
            (Words{"my editor", "+12", "/tmp/a b;$x.csg", "100%"}));
  EXPECT_EQ(words("unknown"), (Words{"unknown", "/tmp/a b;$x.csg"}));
  EXPECT_EQ(words("/usr/bin/gedit"), (Words{"/usr/bin/gedit", "+12", "/tmp/a b;$x.csg"}));
  EXPECT_EQ(words("code --wait"), (Words{"code", "--wait", "-g", "/tmp/a b;$x.csg:12"}));
  EXPECT_FALSE(editor_words("", {"a", 1}));
  EXPECT_FALSE(editor_words("'open", {"a", 1}));
  const auto relative = editor_words("ed %f", {"-rf.csg", 1});
  ASSERT_TRUE(relative);
  EXPECT_TRUE(relative->back().starts_with("/"));
}

TEST(Editor, OnlyThoseWithAWindowAreTakenFromTheEnvironment) {
  EXPECT_EQ(editor_command("vi", nullptr, nullptr), "vi");
  EXPECT_EQ(editor_command("", "vim", "gedit --new-window"), "gedit --new-window");
  EXPECT_EQ(editor_command("", "/usr/bin/code", "gedit"), "/usr/bin/code");
  EXPECT_EQ(editor_command("", "emacs -nw", nullptr), "");
  EXPECT_EQ(editor_command("", "nano", "vi"), "");
}

TEST(Editor, AProgramIsStartedOrTheReasonIsTold) {
  const testkit::TemporaryFolder folder;
  const std::string mark = folder.file("a b; touch x");
  ASSERT_TRUE(start_program({"touch", mark}));
  for (int i = 0; i < 1000 && !std::filesystem::exists(mark); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(std::filesystem::exists(mark));
  const auto failed = start_program({"no-such-editor-at-all"});
  ASSERT_FALSE(failed);
  EXPECT_NE(failed.error().message.find("no-such-editor-at-all"), std::string::npos);
}

ViewState state_of(double z, std::optional<double> offset = {}) {
  ViewState state;
  state.camera.rotation.z = z;
  if (offset) state.section = csg::SectionPlane{{0, 0, 1}, *offset, false};
  return state;
}

TEST(ViewHistory, GoesBackAndForthBetweenRests) {
  ViewHistory history;
  EXPECT_FALSE(history.undo(state_of(0)));
  history.rest(state_of(0));
  history.rest(state_of(10));
  history.rest(state_of(10));
  history.rest(state_of(10, 5.0));
  // What has changed since the last rest is a step, too.
  EXPECT_EQ(history.undo(state_of(20, 5.0)), state_of(10, 5.0));
  EXPECT_EQ(history.undo(state_of(10, 5.0)), state_of(10));
  EXPECT_EQ(history.redo(state_of(10)), state_of(10, 5.0));
  EXPECT_EQ(history.undo(state_of(10, 5.0)), state_of(10));
  EXPECT_EQ(history.undo(state_of(10)), state_of(0));
  EXPECT_FALSE(history.undo(state_of(0)));
  EXPECT_TRUE(history.can_redo());
  history.rest(state_of(3));  // another way is taken
  EXPECT_FALSE(history.can_redo());
  EXPECT_EQ(history.undo(state_of(3)), state_of(0));
}

TEST(ViewHistory, KeepsTheLastSteps) {
  ViewHistory history;
  for (int i = 0; i < 1000; ++i) history.rest(state_of(i));
  int steps = 0;
  for (auto at = history.undo(state_of(999)); at; at = history.undo(*at)) ++steps;
  EXPECT_EQ(steps, static_cast<int>(ViewHistory::kMostSteps));
}

class UserFilesTest : public testing::Test {
 protected:
  std::string make(const std::string& name) {
    std::ofstream(folder_.file(name)) << "cube();";
    return std::filesystem::canonical(folder_.file(name)).string();
  }
  testkit::TemporaryFolder folder_;
  UserFolders folders_{folder_.file("config/strata"), folder_.file("state/strata")};
};

TEST_F(UserFilesTest, TheLastTenFilesThatAreThereAreRecent) {
  EXPECT_TRUE(recent_files(folders_).empty());
  std::vector<std::string> made;
  for (int i = 0; i < 13; ++i) {
    made.push_back(make(std::to_string(i) + ".csg"));
    remember_file(folders_, made.back());
  }
  auto recent = recent_files(folders_);
  ASSERT_EQ(recent.size(), 10u);
  EXPECT_EQ(recent.front(), made[12]);
  EXPECT_EQ(recent.back(), made[3]);
  std::filesystem::remove(made[12]);
  remember_file(folders_, made[5]);
  recent = recent_files(folders_);
  EXPECT_EQ(recent.front(), made[5]);
  EXPECT_EQ(recent.size(), 9u);  // each once, and none that is gone
}

TEST_F(UserFilesTest, TheSizeOfTheWindowIsRemembered) {
  EXPECT_FALSE(remembered_size(folders_));
  remember_size(folders_, {900, 700});
  remember_size(folders_, {1500, 900});
  EXPECT_EQ(remembered_size(folders_), glm::ivec2(1500, 900));
  remember_size({}, {900, 700});
  EXPECT_FALSE(remembered_size({}));
  for (const char* spoilt : {"", "1500", "0 900", "wide 900", "99999 900"}) {
    std::ofstream(folders_.state + "/window-size") << spoilt;
    EXPECT_FALSE(remembered_size(folders_)) << spoilt;
  }
}

TEST_F(UserFilesTest, TheLookIsRemembered) {
  EXPECT_EQ(remembered_look(folders_), "");
  remember_look(folders_, "light");
  remember_look(folders_, "dark");
  EXPECT_EQ(remembered_look(folders_), "dark");
}

TEST_F(UserFilesTest, AFolderThatCannotBeWrittenIsNoFault) {
  make("file");
  const UserFolders nowhere{folder_.file("file/below"), folder_.file("file/below")};
  remember_look(nowhere, "light");
  remember_file(nowhere, folder_.file("file"));
  EXPECT_EQ(remembered_look(nowhere), "");
  remember_look({}, "light");
  EXPECT_EQ(remembered_look({}), "");
}

TEST_F(UserFilesTest, FoldersAreThoseOfTheSpecification) {
  ::setenv("XDG_CONFIG_HOME", "/c", 1);
  ::setenv("XDG_STATE_HOME", "relative", 1);
  ::setenv("HOME", "/h", 1);
  EXPECT_EQ(user_folders().config, "/c/strata");
  EXPECT_EQ(user_folders().state, "/h/.local/state/strata");
  ::unsetenv("XDG_CONFIG_HOME");
  EXPECT_EQ(user_folders().config, "/h/.config/strata");
  ::unsetenv("HOME");
  EXPECT_EQ(user_folders().config, "");
}

TEST_F(UserFilesTest, AFolderIsListedWithWhatCanBeOpened) {
  std::filesystem::create_directories(folder_.file("z"));
  std::filesystem::create_directories(folder_.file("Alpha"));
  std::filesystem::create_directories(folder_.file(".secret"));
  for (const char* name : {"b.csg", "a.STL", "c.txt", ".d.csg", "e.scad", "scad", "f.obj"}) {
    make(name);
  }
  const auto listed = list_folder(folder_.path().string());
  ASSERT_TRUE(listed) << listed.error().message;
  std::vector<std::string> names;
  for (const FolderEntry& entry : *listed) names.push_back(entry.name);
  EXPECT_EQ(names, (std::vector<std::string>{"Alpha", "z", "a.STL", "b.csg", "e.scad", "f.obj"}));
  EXPECT_TRUE((*listed)[1].is_folder);
  EXPECT_EQ((*listed)[3].bytes, 7u);
  EXPECT_FALSE(list_folder(folder_.file("none")));
  EXPECT_FALSE(list_folder(folder_.file("b.csg")));
}

std::shared_ptr<const Arrangement> arranged(const std::string& text) {
  auto what = std::make_shared<Arrangement>();
  auto scene = csg::parse_scene(text, "part.csg");
  EXPECT_TRUE(scene);
  if (scene) what->tree = scene->tree;
  return what;
}

TEST(PartNumbers, AreThoseOfTheSolid) {
  const auto numbers = measure_part(
      *arranged("difference() { cube(size = [20, 30, 10]); multmatrix([[1,0,0,5],[0,1,0,5],"
                "[0,0,1,-1],[0,0,0,1]]) cube(size = [10, 10, 20]); }"),
      {});
  ASSERT_TRUE(numbers) << numbers.error().message;
  EXPECT_EQ(numbers->size, glm::dvec3(20, 30, 10));
  EXPECT_NEAR(numbers->volume, 5000, 1e-3);
  EXPECT_NEAR(numbers->area, 2 * (600 - 100) + 100 * 10 + 40 * 10, 1e-3);
  EXPECT_EQ(numbers->open_holes, 0u);
  const Material* steel = find_material("Steel");
  ASSERT_NE(steel, nullptr);
  EXPECT_NEAR(weight_of(*numbers, *steel), 5 * 7.85, 1e-5);
  EXPECT_EQ(find_material("cheese"), nullptr);
}

TEST(PartNumbers, AreMeasuredInTheBackgroundAndCanBeStopped) {
  PartMeasurer measurer([] {});
  const auto what = arranged("cube(size = [2, 3, 4]);");
  measurer.start(what);
  measurer.cancel();
  EXPECT_FALSE(measurer.busy());
  EXPECT_FALSE(measurer.take());
  measurer.start(what);
  while (measurer.busy()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const auto done = measurer.take();
  ASSERT_TRUE(done && *done);
  EXPECT_NEAR((*done)->volume, 24, 1e-6);
  EXPECT_FALSE(measurer.take());
}

}  // namespace
}  // namespace strata::view
