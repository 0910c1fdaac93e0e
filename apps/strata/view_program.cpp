#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "apps/strata/run_commands.h"

namespace strata::apps {

namespace {

/// Where the program of the window lies.
std::string view_program() {
  std::error_code error;
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? std::string("strata-view") : (own.parent_path() / "strata-view").string();
}

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

}  // namespace

Result<void> check_view_program(std::string_view asked_by) {
  if (!is_set("DISPLAY") && !is_set("WAYLAND_DISPLAY")) {
    return fail(ErrorCode::kUsage,
                "{} needs a display, but neither DISPLAY nor WAYLAND_DISPLAY is set; `strata "
                "picture` draws without one",
                asked_by);
  }
  const std::string program = view_program();
  if (access(program.c_str(), X_OK) == 0) return {};
  return fail(
      ErrorCode::kUsage,
      "{} needs the program strata-view, but there is no {}; the package strata-view has it, "
      "and a build makes it when libepoxy-dev, libglfw3-dev and libimgui-dev are installed",
      asked_by, program);
}

int run_view_program(char** arguments) {
  const std::string program = view_program();
  std::vector<char*> words;
  std::string name = program;
  words.push_back(name.data());
  for (char** word = arguments; *word != nullptr; ++word) words.push_back(*word);
  words.push_back(nullptr);
  execv(program.c_str(), words.data());
  if (errno == ENOENT) {
    std::fprintf(stderr,
                 "strata: error: strata view needs the program strata-view next to strata, but "
                 "there is no %s; the package strata-view has it, and a build makes it when "
                 "libepoxy-dev, libglfw3-dev and libimgui-dev are installed. strata csg draws "
                 "pictures without a window.\n",
                 program.c_str());
  } else {
    std::fprintf(stderr, "strata: error: %s: %s\n", program.c_str(), std::strerror(errno));
  }
  return static_cast<int>(ErrorCode::kUsage);
}

}  // namespace strata::apps
