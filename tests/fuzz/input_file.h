#pragma once

#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace strata {

/// A file with these bytes, for readers that take a path. One at a time.
class InputFile {
 public:
  InputFile(std::string_view bytes, const char* extension)
      : path_((std::filesystem::temp_directory_path() /
               ("strata-fuzz-" + std::to_string(::getpid()) + extension))
                  .string()) {
    std::ofstream(path_, std::ios::binary) << bytes;
  }
  ~InputFile() { std::remove(path_.c_str()); }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace strata
