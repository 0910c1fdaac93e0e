#include "csg/scene/scad.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "mesh/input_bytes.h"

extern char** environ;

namespace strata::csg {
namespace {

/// A folder of our own for the output, removed with all in it.
class Folder {
 public:
  Folder() {
    std::error_code status;
    std::string name = (std::filesystem::temp_directory_path(status) / "strata-XXXXXX").string();
    if (!status && ::mkdtemp(name.data())) path_ = name;
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// What openscad says, line by line as it comes.
class Speech {
 public:
  /// @param path  of the program, as messages name it
  explicit Speech(const std::string& path) : path_(path) {}

  void hear(std::string_view bytes) {
    constexpr std::size_t kMost = 1 << 16;  // its last words are the ones that count
    said_.append(bytes);
    if (said_.size() > 2 * kMost) said_.erase(0, said_.size() - kMost);
    line_.append(bytes);
    std::size_t begin = 0;
    for (std::size_t end = 0; (end = line_.find('\n', begin)) != std::string::npos;) {
      take(std::string_view(line_).substr(begin, end - begin));
      begin = end + 1;
    }
    line_.erase(0, begin);
    if (line_.size() > kMost) end();
  }
  /// No more will come.
  void end() {
    take(line_);
    line_.clear();
  }

  /// The end of it, on one line.
  [[nodiscard]] std::string last_words() const {
    constexpr std::size_t kMost = 400;
    std::string_view said = said_;
    while (!said.empty() && said.back() == '\n') said.remove_suffix(1);
    const std::string text =
        printable(said.size() > kMost ? said.substr(said.size() - kMost) : said);
    return text.empty() ? "it said nothing" : text;
  }
  /// The first error; empty: there was none.
  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] std::size_t further_errors() const { return errors_ > 0 ? errors_ - 1 : 0; }
  [[nodiscard]] std::vector<std::string>& warnings() { return warnings_; }
  [[nodiscard]] std::vector<std::string>& notes() { return notes_; }

 private:
  static constexpr std::size_t kMostLines = 1000;  // of each kind

  static std::string printable(std::string_view line) {
    std::string text(line);
    for (char& c : text) {
      if (static_cast<unsigned char>(c) < ' ') c = ' ';
    }
    return text;
  }

  void take(std::string_view line) {
    if (line.empty()) return;
    // ERROR, PARSER-ERROR, WARNING, FONT-WARNING, ECHO, TRACE, ...
    const std::string_view kind = line.substr(0, line.find(": "));
    if (kind.ends_with("ERROR") && is_kind(kind)) {
      if (errors_++ == 0) error_ = placed(printable(line));
    } else if (kind.ends_with("WARNING") && is_kind(kind)) {
      if (warnings_.size() < kMostLines) warnings_.push_back(placed(printable(line)));
    } else if (notes_.size() < kMostLines) {
      notes_.push_back(printable(line));
    }
  }

  static bool is_kind(std::string_view word) {
    return std::all_of(word.begin(), word.end(),
                       [](char c) { return (c >= 'A' && c <= 'Z') || c == '-'; });
  }

  /// `WARNING: text in file F, line N` with the place in front, as in messages of our own.
  [[nodiscard]] std::string placed(std::string line) const {
    constexpr std::string_view kFile = " in file ", kLine = ", line ";
    const std::size_t file = line.rfind(kFile), number = line.rfind(kLine);
    if (file == std::string::npos || number == std::string::npos || number < file) {
      return fmt::format("{}: openscad: {}", path_, line);
    }
    std::string name = line.substr(file + kFile.size(), number - file - kFile.size());
    // Its names are relative to the folder of the program.
    const std::filesystem::path program(path_);
    if (name == program.filename().string()) name = path_;
    const std::string at = line.substr(number + kLine.size());
    line.resize(file);
    return fmt::format("{}:{}: openscad: {}", name, at, line);
  }

  const std::string& path_;
  std::string said_, line_, error_;
  std::vector<std::string> warnings_, notes_;
  std::size_t errors_ = 0;
};

/// A child process in a group of its own; killed, if it still runs, with this.
class Child {
 public:
  /// @return 0, or the reason why it did not start
  int start(const char* const* arguments) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return errno;
    output_ = ends[0];
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    posix_spawn_file_actions_init(&actions);
    posix_spawnattr_init(&attributes);
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, ends[1], 1);
    posix_spawn_file_actions_adddup2(&actions, ends[1], 2);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setpgroup(&attributes, 0);
    const int status = ::posix_spawnp(&process_, arguments[0], &actions, &attributes,
                                      const_cast<char* const*>(arguments), environ);
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    ::close(ends[1]);
    if (status != 0) process_ = -1;
    return status;
  }
  Child() = default;
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (process_ > 0) {
      ::kill(-process_, SIGKILL);
      int status = 0;
      while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
      }
    }
    if (output_ >= 0) ::close(output_);
  }

  /// Reads what it says for up to `milliseconds`. @return whether more may come
  bool listen(int milliseconds, Speech& said) {
    pollfd waiting{output_, POLLIN, 0};
    const int ready = ::poll(&waiting, 1, milliseconds);
    if (ready <= 0) return true;
    char buffer[4096];
    const ssize_t count = ::read(output_, buffer, sizeof buffer);
    if (count <= 0) return count < 0 && errno == EINTR;
    said.hear({buffer, static_cast<std::size_t>(count)});
    return true;
  }

  /// @return whether it has ended, with its status
  bool ended(int& status) {
    const pid_t result = ::waitpid(process_, &status, WNOHANG);
    if (result == 0 || (result < 0 && errno == EINTR)) return false;
    process_ = -1;
    return true;
  }

 private:
  pid_t process_ = -1;
  int output_ = -1;
};

}  // namespace

Result<OpenscadRun> run_openscad(const std::string& path, double timeout_s,
                                 const Execution& execution) {
  std::error_code status;
  if (!std::filesystem::is_regular_file(path, status)) {
    return fail(ErrorCode::kInput, "{}: no such file", path);
  }
  const Folder folder;
  if (folder.path().empty()) {
    return fail(ErrorCode::kInput, "{}: no temporary folder can be made for openscad", path);
  }
  const std::string output = folder.path() + "/scene.csg";
  // A name that begins with a dash would be an option.
  const std::string input = path.starts_with('-') ? "./" + path : path;
  const std::array<const char*, 5> arguments{"openscad", "-o", output.c_str(), input.c_str(),
                                             nullptr};
  Child child;
  if (const int reason = child.start(arguments.data()); reason != 0) {
    return fail(
        ErrorCode::kInput,
        "{}: a program needs `openscad` to be run, and that cannot be started ({}): install "
        "the package openscad, or write `openscad -o scene.csg {}` where it is installed "
        "and give the .csg file",
        path, std::generic_category().message(reason), path);
  }
  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  Speech said(path);
  int ended = 0;
  bool talks = true;
  while (!child.ended(ended)) {
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    if (std::chrono::duration<double>(Clock::now() - begin).count() > timeout_s) {
      return fail(ErrorCode::kInput, "{}: openscad took more than {:g} s and was ended: {}", path,
                  timeout_s, said.last_words());
    }
    if (talks) {
      talks = child.listen(20, said);
    } else {
      ::poll(nullptr, 0, 5);
    }
  }
  for (int i = 0; i < 1000 && talks; ++i) talks = child.listen(0, said) && i < 100;
  said.end();
  if (!WIFEXITED(ended) || WEXITSTATUS(ended) != 0) {
    return fail(ErrorCode::kInput, "{}: openscad failed: {}", path, said.last_words());
  }
  if (!said.error().empty()) {
    return fail(
        ErrorCode::kInput, "{}{}", said.error(),
        said.further_errors() > 0 ? fmt::format(" ({} more errors)", said.further_errors()) : "");
  }
  auto bytes = detail::InputBytes::open(output, 0);
  if (!bytes)
    return fail(ErrorCode::kInput, "{}: openscad wrote nothing: {}", path, said.last_words());
  OpenscadRun run;
  run.text = bytes->view();
  run.warnings = std::move(said.warnings());
  run.notes = std::move(said.notes());
  return run;
}

}  // namespace strata::csg
