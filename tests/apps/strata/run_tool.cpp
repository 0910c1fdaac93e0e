#include "tests/apps/strata/run_tool.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <fstream>

namespace strata::testkit {
namespace {

void limit(__rlimit_resource resource, const std::optional<rlim_t>& value) {
  if (!value) return;
  const rlimit both{*value, *value};
  setrlimit(resource, &both);
}

void redirect(const char* path, int flags, int to) {
  const int descriptor = open(path, flags, 0600);
  if (descriptor < 0 || dup2(descriptor, to) < 0) _exit(125);
  close(descriptor);
}

}  // namespace

Workplace::Workplace() : folder_(place_.path() / "here"), talk_(place_.path() / "talk") {
  std::filesystem::create_directories(folder_);
  std::filesystem::create_directories(talk_);
}

std::string Workplace::path(const std::string& name) const { return (folder_ / name).string(); }
bool Workplace::has(const std::string& name) const {
  return std::filesystem::exists(folder_ / name);
}
std::string Workplace::read(const std::string& name) const { return bytes_of(folder_ / name); }

void Workplace::write(const std::string& name, const std::string& bytes) const {
  std::ofstream(folder_ / name, std::ios::binary) << bytes;
}

std::vector<std::string> Workplace::names() const { return names_in(folder_); }

RunResult Workplace::run(const std::vector<std::string>& arguments,
                         const RunOptions& options) const {
  const std::string in = talk_ / "in", out = talk_ / "out", err = talk_ / "err";
  std::ofstream(in, std::ios::binary) << options.input;
  std::vector<std::string> words = {options.program.empty() ? STRATA_TOOL : options.program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  std::vector<std::string> additions = options.environment;

  const pid_t child = fork();
  if (child == 0) {
    if (chdir(folder_.c_str()) != 0) _exit(125);
    if (options.closed_stdin) {
      close(STDIN_FILENO);
    } else if (options.silent_stdin_pipe) {
      // The writing end stays open in the tool itself.
      int ends[2];
      if (pipe(ends) != 0 || dup2(ends[0], STDIN_FILENO) < 0) _exit(125);
    } else {
      redirect(in.c_str(), O_RDONLY, STDIN_FILENO);
    }
    redirect(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, STDERR_FILENO);
    if (options.closed_stdout_pipe) {
      int ends[2];
      if (pipe(ends) != 0 || dup2(ends[1], STDOUT_FILENO) < 0) _exit(125);
      close(ends[0]);
      close(ends[1]);
    } else if (options.stdout_path) {
      redirect(options.stdout_path->c_str(), O_WRONLY | O_CREAT | O_TRUNC, STDOUT_FILENO);
    } else {
      redirect(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, STDOUT_FILENO);
    }
    for (std::string& addition : additions) putenv(addition.data());
    // The test program's own caller may ignore them.
    for (const int each : {SIGINT, SIGTERM, SIGPIPE}) signal(each, SIG_DFL);
    limit(RLIMIT_AS, options.address_space);
    limit(RLIMIT_FSIZE, options.file_size);
    execv(argv[0], argv.data());
    _exit(126);
  }
  RunResult result;
  if (child < 0) {
    ADD_FAILURE() << "fork failed";
    return result;
  }
  if (options.while_running) options.while_running(child);
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  if (!options.closed_stdout_pipe && !options.stdout_path) result.out = bytes_of(out);
  result.err = bytes_of(err);
  return result;
}

}  // namespace strata::testkit
