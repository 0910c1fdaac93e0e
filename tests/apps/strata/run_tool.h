#pragma once

#include <sys/resource.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

// Runs the real executable in a folder of its own.

namespace strata::testkit {

/// How a run of the tool ended.
struct RunResult {
  int exit_code = -1;  ///< -1 when a signal ended it
  int signal = 0;      ///< 0 when it ended by itself
  std::string out, err;
};

struct RunOptions {
  std::string program = {};        ///< its path; empty: strata
  std::string input = {};          ///< standard input
  bool closed_stdin = false;       ///< there is none
  bool silent_stdin_pipe = false;  ///< standard input is a pipe that nothing comes through
  std::optional<std::string> stdout_path = {};      ///< standard output goes there, not to `out`
  bool closed_stdout_pipe = false;                  ///< standard output is a pipe nobody reads
  std::optional<rlim_t> address_space = {};         ///< bytes, as ulimit -v
  std::optional<rlim_t> file_size = {};             ///< bytes, as ulimit -f
  std::vector<std::string> environment = {};        ///< NAME=value to add
  std::function<void(int pid)> while_running = {};  ///< called in the parent once it runs
};

/// A temporary folder in which the tool runs; removed with all that is in it.
class Workplace {
 public:
  Workplace();

  /// Runs `strata ARGUMENTS...` here. Relative paths are of this folder.
  RunResult run(const std::vector<std::string>& arguments, const RunOptions& options = {}) const;

  [[nodiscard]] std::string path(const std::string& name) const;
  void write(const std::string& name, const std::string& bytes) const;
  [[nodiscard]] std::string read(const std::string& name) const;
  [[nodiscard]] bool has(const std::string& name) const;
  /// Names in this folder, sorted: to find what should not be there.
  [[nodiscard]] std::vector<std::string> names() const;

 private:
  TemporaryFolder place_;
  std::filesystem::path folder_;
  std::filesystem::path talk_;  // beside it, for what the tool says
};

}  // namespace strata::testkit
