#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/strata/run_commands.h"

namespace strata::apps {

int run_view_program(char** arguments) {
  std::error_code error;
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::string program =
      error ? std::string("strata-view") : (own.parent_path() / "strata-view").string();
  std::vector<char*> words;
  std::string name = program;
  words.push_back(name.data());
  for (char** word = arguments; *word != nullptr; ++word) words.push_back(*word);
  words.push_back(nullptr);
  execv(program.c_str(), words.data());
  if (errno == ENOENT) {
    std::fprintf(stderr,
                 "strata: error: strata view needs the program strata-view next to strata, but "
                 "there is no %s; a build makes it when libepoxy-dev, libglfw3-dev and "
                 "libimgui-dev are installed. strata csg draws pictures without a window.\n",
                 program.c_str());
  } else {
    std::fprintf(stderr, "strata: error: %s: %s\n", program.c_str(), std::strerror(errno));
  }
  return static_cast<int>(ErrorCode::kUsage);
}

}  // namespace strata::apps
