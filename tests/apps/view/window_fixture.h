#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <png.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "tests/apps/strata/run_tool.h"

// The window under Xvfb, driven by scripts, through the executable that people start.

namespace strata::testkit {

/// A display without a screen, for as long as all tests run.
class Display : public testing::Environment {
 public:
  void SetUp() override {
    int ends[2];
    if (pipe(ends) != 0) return;
    child_ = fork();
    if (child_ == 0) {
      close(ends[0]);
      const std::string number = std::to_string(ends[1]);
      const char* words[] = {"Xvfb",         "-displayfd", number.c_str(), "-screen", "0",
                             "1600x1200x24", "-nolisten",  "tcp",          nullptr};
      const int nothing = open("/dev/null", O_WRONLY);
      dup2(nothing, STDERR_FILENO);
      execvp(words[0], const_cast<char* const*>(words));
      _exit(127);
    }
    close(ends[1]);
    // The number and the end of its line may come one after the other.
    std::string text;
    char letter = 0;
    while (read(ends[0], &letter, 1) == 1 && letter != '\n') text += letter;
    close(ends[0]);
    if (!text.empty()) name_ = ":" + text;
  }
  void TearDown() override {
    if (child_ <= 0) return;
    kill(child_, SIGTERM);
    waitpid(child_, nullptr, 0);
  }
  /// Empty when there is none.
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  pid_t child_ = -1;
  std::string name_;
};
inline Display* const display =
    static_cast<Display*>(testing::AddGlobalTestEnvironment(new Display));  // gtest owns it

struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
  [[nodiscard]] const std::uint8_t* at(int u, int v) const {
    return rgb.data() + 3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                             static_cast<std::size_t>(u));
  }
  friend bool operator==(const Image&, const Image&) = default;
};

inline Image image_of(const Workplace& place, const std::string& name) {
  Image image;
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&png, place.path(name).c_str()) == 0) {
    ADD_FAILURE() << name << ": " << png.message;
    return image;
  }
  png.format = PNG_FORMAT_RGB;
  image.width = static_cast<int>(png.width), image.height = static_cast<int>(png.height);
  image.rgb.resize(PNG_IMAGE_SIZE(png));
  png_image_finish_read(&png, nullptr, image.rgb.data(), 0, nullptr);
  return image;
}

/// How many pixels of the rectangle differ, `b` beginning at (0, 0).
inline int different(const Image& a, const Image& b, int width, int height) {
  int count = 0;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u)
      count += std::equal(a.at(u, v), a.at(u, v) + 3, b.at(u, v)) ? 0 : 1;
  }
  return count;
}

inline constexpr const char* kScene =
    "difference() {\n"
    "cube(size = [20, 20, 6], center = true);\n"
    "multmatrix([[1,0,0,5],[0,1,0,5],[0,0,1,0],[0,0,0,1]]) { cylinder($fn = 24, h = 9, r1 = 3, r2 "
    "= 3, center = true); }\n"
    "multmatrix([[1,0,0,-5],[0,1,0,-4],[0,0,1,3],[0,0,0,1]]) { sphere($fn = 32, r = 4); }\n"
    "}\n"
    "color([0.2, 0.4, 0.8, 1]) multmatrix([[1,0,0,-6],[0,1,0,6],[0,0,1,5],[0,0,0,1]]) { cube(size "
    "= [4, 4, 4], center = true); }\n";

class Window : public testing::Test {
 protected:
  void SetUp() override {
    if (display->name().empty()) {
      const char* why = "no Xvfb could be started (package xvfb)";
      if (std::getenv("CI") != nullptr) FAIL() << why;
      GTEST_SKIP() << why;
    }
    place_.write("part.csg", kScene);
  }

  /// Mistakes in the use of GL end the program with an error. AddressSanitizer's leaks do not: the
  /// X libraries that GLFW opens and closes leave 112 bytes behind, which no suppression can name.
  RunOptions options() const {
    RunOptions options;
    options.environment = {"DISPLAY=" + display->name(), "LP_NUM_THREADS=1", "STRATA_GL_DEBUG=1",
                           "LIBGL_ALWAYS_SOFTWARE=1", "STRATA_GL_FAULTS=" + fault_,
                           "ASAN_OPTIONS=detect_leaks=0",
                           // Nothing of the user's is read or written.
                           "XDG_CONFIG_HOME=" + place_.path("config"),
                           "XDG_STATE_HOME=" + place_.path("state"), "VISUAL=", "EDITOR="};
    return options;
  }
  RunResult view(const std::string& script, std::vector<std::string> arguments = {},
                 std::function<void(int)> meanwhile = {}) {
    place_.write("drive.txt", script);
    std::vector<std::string> words = {"view", "part.csg", "--script", "drive.txt"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    RunOptions how = options();
    how.while_running = std::move(meanwhile);
    return place_.run(words, how);
  }
  Image csg(const std::vector<std::string>& arguments) {
    // The window's picture at rest has eight samples.
    std::vector<std::string> words = {"csg", "part.csg", "-o", "expected.png", "--samples", "8"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    const RunResult run = place_.run(words);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return image_of(place_, "expected.png");
  }
  /// Waits until the program has written a file.
  void await(const std::string& name) const {
    for (int i = 0; i < 3000 && !place_.has(name); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_TRUE(place_.has(name)) << "never came: " << name;
  }

  Workplace place_;
  std::string fault_;  ///< that is provoked
};

}  // namespace strata::testkit
