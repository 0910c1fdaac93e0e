#include "tests/apps/strata/run_tool.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>

namespace strata::testkit {
namespace {

std::string contents(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

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

Workplace::Workplace() {
  std::string pattern = (std::filesystem::temp_directory_path() / "strata_cli_XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) ADD_FAILURE() << "no temporary folder";
  folder_ = std::filesystem::path(pattern) / "here";
  talk_ = std::filesystem::path(pattern) / "talk";
  std::filesystem::create_directories(folder_);
  std::filesystem::create_directories(talk_);
}

Workplace::~Workplace() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_.parent_path(), ignored);
}

std::string Workplace::path(const std::string& name) const { return (folder_ / name).string(); }
bool Workplace::has(const std::string& name) const {
  return std::filesystem::exists(folder_ / name);
}
std::string Workplace::read(const std::string& name) const { return contents(folder_ / name); }

void Workplace::write(const std::string& name, const std::string& bytes) const {
  std::ofstream(folder_ / name, std::ios::binary) << bytes;
}

std::vector<std::string> Workplace::names() const {
  std::vector<std::string> result;
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    result.push_back(entry.path().filename().string());
  }
  std::sort(result.begin(), result.end());
  return result;
}

RunResult Workplace::run(const std::vector<std::string>& arguments,
                         const RunOptions& options) const {
  const std::string in = talk_ / "in", out = talk_ / "out", err = talk_ / "err";
  std::ofstream(in, std::ios::binary) << options.input;
  std::vector<std::string> words = {STRATA_TOOL};
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
  if (!options.closed_stdout_pipe && !options.stdout_path) result.out = contents(out);
  result.err = contents(err);
  return result;
}

bool is_sanitized() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
  return true;
#endif
#endif
  return false;
}

}  // namespace strata::testkit
