#include "csg/scene/scad.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <initializer_list>
#include <random>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "core/printable.h"
#include "mesh/text/input_bytes.h"

namespace strata::csg {
namespace {

/// A file in memory for openscad's output. It vanishes with the last process that has it open.
class Memory {
 public:
  Memory() {
    const int made = ::memfd_create("strata", MFD_CLOEXEC);
    // Its descriptor must not be one of the standard streams, which may be closed.
    descriptor_ = made < 0 ? made : ::fcntl(made, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
    if (made >= 0) ::close(made);
  }
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;
  ~Memory() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  [[nodiscard]] int descriptor() const { return descriptor_; }
  [[nodiscard]] std::string path() const { return fmt::format("/proc/self/fd/{}", descriptor_); }
  [[nodiscard]] Result<std::string> text() const {
    auto bytes = detail::InputBytes::open(path(), 0);
    if (!bytes) return tl::unexpected(bytes.error());
    return std::string(bytes->view());
  }

 private:
  int descriptor_ = -1;
};

/// Sorts the text that openscad prints, line by line, into errors, warnings and notes.
class Speech {
 public:
  /// @param path  path of the program, as messages name it
  /// @param mark  prefix of the line with the camera
  Speech(const std::string& path, std::string mark) : path_(path), mark_(std::move(mark)) {}

  void hear(std::string_view bytes) {
    constexpr std::size_t kMost = 1 << 16;  // only the last words are kept
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
  /// The output has ended.
  void end() {
    take(line_);
    line_.clear();
  }

  /// The end of the output, on one line.
  [[nodiscard]] std::string last_words() const {
    constexpr std::size_t kMost = 400;
    std::string_view said = said_;
    while (!said.empty() && said.back() == '\n') said.remove_suffix(1);
    const std::string text =
        plain_line(said.size() > kMost ? said.substr(said.size() - kMost) : said);
    return text.empty() ? "it printed nothing" : text;
  }
  /// The first error, or empty.
  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] std::size_t further_errors() const { return errors_ > 0 ? errors_ - 1 : 0; }
  [[nodiscard]] std::vector<std::string>& warnings() { return warnings_; }
  [[nodiscard]] std::vector<std::string>& notes() { return notes_; }
  [[nodiscard]] std::size_t further_notes() const { return further_notes_; }
  /// Whether the program sets the camera, and the text after the mark.
  [[nodiscard]] bool has_view() const { return has_view_; }
  [[nodiscard]] const std::string& view() const { return view_; }

 private:
  static constexpr std::size_t kMostLines = 1000;  // for each kind
  static constexpr std::size_t kLongest = 4000;    // for each line

  static std::string plain_line(std::string_view line) {
    std::string text(line);
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == '\n' || c == '\t'; }, ' ');
    return printable(text, kLongest);
  }

  void take(std::string_view line) {
    if (line.empty()) return;
    if (line.starts_with(mark_)) {
      view_ = line.substr(mark_.size());
      return;
    }
    if (line.starts_with("WARNING: Viewall and autocenter disabled in favor of $vp")) {
      has_view_ = true;  // printed for every program that sets the camera; not a fault
      return;
    }
    // ERROR, PARSER-ERROR, WARNING, FONT-WARNING, ECHO, TRACE, ...
    const std::string_view kind = line.substr(0, line.find(": "));
    if (kind.ends_with("ERROR") && is_kind(kind)) {
      if (errors_++ == 0) error_ = placed(plain_line(line));
    } else if (kind.ends_with("WARNING") && is_kind(kind)) {
      if (warnings_.size() < kMostLines) warnings_.push_back(placed(plain_line(line)));
    } else if (notes_.size() < kMostLines) {
      notes_.push_back(plain_line(line));
    } else {
      ++further_notes_;
    }
  }

  static bool is_kind(std::string_view word) {
    return std::all_of(word.begin(), word.end(),
                       [](char c) { return (c >= 'A' && c <= 'Z') || c == '-'; });
  }

  /// Rewrites `WARNING: text in file F, line N` with the place first, as in messages of our own.
  [[nodiscard]] std::string placed(std::string line) const {
    constexpr std::string_view kFile = " in file ", kLine = ", line ";
    const std::size_t file = line.rfind(kFile), number = line.rfind(kLine);
    if (file == std::string::npos || number == std::string::npos || number < file) {
      return fmt::format("{}: openscad: {}", path_, line);
    }
    std::string name = line.substr(file + kFile.size(), number - file - kFile.size());
    // Relative names refer to the folder of the program.
    const std::filesystem::path program(path_);
    if (name == program.filename().string()) name = path_;
    const std::string at = line.substr(number + kLine.size());
    line.resize(file);
    return fmt::format("{}:{}: openscad: {}", name, at, line);
  }

  const std::string& path_;
  const std::string mark_;
  std::string said_, line_, error_, view_;
  std::vector<std::string> warnings_, notes_;
  std::size_t errors_ = 0, further_notes_ = 0;
  bool has_view_ = false;
};

/// A child process in a process group of its own. It is killed with this object and with this
/// process.
class Child {
 public:
  /// @param kept  descriptors that it inherits @return 0, or the errno of the failed start
  int start(const char* const* arguments, std::initializer_list<int> kept) {
    int ends[2], reasons[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return errno;
    output_ = ends[0];
    if (::pipe2(reasons, O_CLOEXEC) != 0) {
      const int reason = errno;
      ::close(ends[1]);
      return reason;
    }
    const pid_t parent = ::getpid();
    process_ = ::fork();
    if (process_ == 0) become(arguments, kept, parent, ends[1], reasons[1]);
    int reason = process_ < 0 ? errno : 0;
    ::close(ends[1]);
    ::close(reasons[1]);
    // The pipe closes without data once the program has begun.
    while (reason == 0 && ::read(reasons[0], &reason, sizeof reason) < 0 && errno == EINTR) {
    }
    ::close(reasons[0]);
    return reason;
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

  /// Reads its output for up to `milliseconds`. @return whether more may come
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

  /// @return whether it has ended; then `status` is its status
  bool ended(int& status) {
    const pid_t result = ::waitpid(process_, &status, WNOHANG);
    if (result == 0 || (result < 0 && errno == EINTR)) return false;
    process_ = -1;
    return true;
  }

 private:
  /// Runs in the child. Only system calls are allowed, since other threads may have held any lock.
  [[noreturn]] static void become(const char* const* arguments, std::initializer_list<int> kept,
                                  pid_t parent, int speech, int reasons) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);  // the parent died in the meantime
    ::setpgid(0, 0);
    for (const int descriptor : kept) ::fcntl(descriptor, F_SETFD, 0);
    const int nothing = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
    if (::dup2(speech, STDOUT_FILENO) >= 0 && ::dup2(speech, STDERR_FILENO) >= 0 &&
        ::dup2(nothing, STDIN_FILENO) >= 0) {
      ::execvp(arguments[0], const_cast<char* const*>(arguments));
    }
    const int reason = errno;
    (void)!::write(reasons, &reason, sizeof reason);
    ::_exit(127);
  }

  pid_t process_ = -1;
  int output_ = -1;
};

/// The values that echo() printed: `[90, 0, 0], 60` is two values.
std::vector<std::vector<double>> read_values(std::string_view text) {
  std::vector<std::vector<double>> values(1);
  int depth = 0;
  for (const char* at = text.data(); at != text.data() + text.size();) {
    double number = 0.0;
    const auto [end, status] = std::from_chars(at, text.data() + text.size(), number);
    if (status == std::errc()) {
      values.back().push_back(number);
      at = end;
      continue;
    }
    if (*at == '[') ++depth;
    if (*at == ']') --depth;
    if (*at == ',' && depth == 0) values.emplace_back();
    if (*at == '"') return {};  // no camera value is a string
    ++at;
  }
  return values;
}

bool all_finite(const std::vector<double>& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double n) { return std::isfinite(n); });
}

/// The camera that the program sets. The camera variables have values even if the program does not
/// set them: a value other than the default was set, and for a default value the program's text
/// decides.
SceneView read_view(const std::string& echoed, const std::vector<FileIdentity>& files) {
  SceneView view;
  const auto values = read_values(echoed);
  const auto sets = [&files](std::string_view variable) {
    return std::any_of(files.begin(), files.end(), [variable](const FileIdentity& file) {
      if (!file.path.ends_with(".scad")) return false;
      const auto text = detail::InputBytes::open(file.path, 0);
      return text && assigns(text->view(), variable);
    });
  };
  const auto vector = [&values](std::size_t i) -> std::optional<glm::dvec3> {
    if (i >= values.size() || values[i].size() < 2 || values[i].size() > 3) return {};
    const auto& n = values[i];
    if (!all_finite(n)) return {};
    return glm::dvec3(n[0], n[1], n.size() > 2 ? n[2] : 0.0);
  };
  const auto number = [&values](std::size_t i) -> std::optional<double> {
    if (i >= values.size() || values[i].size() != 1 || !all_finite(values[i])) return {};
    return values[i].front();
  };
  constexpr double kUnsetDistance = 500.0;
  if (const auto r = vector(0); r && (*r != glm::dvec3(0.0) || sets("$vpr"))) view.rotation = r;
  if (const auto t = vector(1)) view.target = t;  // the default is 0, which changes nothing
  if (const auto d = number(2); d && *d > 0 && (*d != kUnsetDistance || sets("$vpd"))) {
    view.distance = d;
  }
  if (const auto f = number(3); f && *f > 0 && *f < 180) view.field_of_view = f;
  return view;
}

/// Waits until the child has ended. @return as run_openscad()
Result<void> wait_for(Child& child, Speech& said, const std::string& path, double timeout_s,
                      const Execution& execution) {
  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  int ended = 0;
  bool talks = true;
  while (!child.ended(ended)) {
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    if (std::chrono::duration<double>(Clock::now() - begin).count() > timeout_s) {
      return fail(ErrorCode::kInput, "{}: openscad took more than {:g} s and was stopped: {}", path,
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
  if (said.error().empty() && (!WIFEXITED(ended) || WEXITSTATUS(ended) != 0)) {
    return fail(ErrorCode::kInput, "{}: openscad failed: {}", path, said.last_words());
  }
  if (said.error().empty()) return {};
  return fail(
      ErrorCode::kInput, "{}{}", said.error(),
      said.further_errors() > 0 ? fmt::format(" ({} more errors)", said.further_errors()) : "");
}

std::string random_word() {
  std::random_device device;
  return fmt::format("strata_{:08x}{:08x}", device(), device());
}

}  // namespace

std::vector<std::string> files_of_rule(std::string_view rule) {
  std::vector<std::string> files;
  std::string name;
  const auto end_name = [&] {
    if (!name.empty()) files.push_back(std::exchange(name, {}));
  };
  const std::size_t begin = rule.find(": ");
  if (begin == std::string_view::npos) return files;
  for (std::size_t i = begin + 2; i < rule.size(); ++i) {
    const char c = rule[i];
    if (c == '\\' && i + 1 < rule.size()) {
      // A backslash before a line end continues the line; before a blank it makes the blank part of
      // the name.
      if (rule[++i] == '\n') {
        end_name();
      } else {
        if (rule[i] != ' ' && rule[i] != '\t') name += c;
        name += rule[i];
      }
    } else if (c == ' ' || c == '\t' || c == '\n') {
      end_name();
    } else {
      name += c;
    }
  }
  end_name();
  return files;
}

bool assigns(std::string_view program, std::string_view variable) {
  int depth = 0;
  for (std::size_t i = 0; i < program.size(); ++i) {
    const std::string_view rest = program.substr(i);
    if (rest.starts_with("//")) {
      i = std::min(program.find('\n', i), program.size());
    } else if (rest.starts_with("/*")) {
      const std::size_t end = program.find("*/", i + 2);
      i = end == std::string_view::npos ? program.size() : end + 1;
    } else if (rest[0] == '"') {
      for (++i; i < program.size() && program[i] != '"'; ++i) {
        if (program[i] == '\\') ++i;
      }
    } else if (rest[0] == '{' || rest[0] == '(') {
      ++depth;
    } else if (rest[0] == '}' || rest[0] == ')') {
      --depth;
    } else if (depth == 0 && rest.starts_with(variable)) {
      const std::size_t next = rest.find_first_not_of(" \t\r\n", variable.size());
      if (next != std::string_view::npos && rest[next] == '=' &&
          rest.substr(next).find_first_not_of('=') == 1) {
        return true;
      }
    }
  }
  return false;
}

Result<OpenscadRun> run_openscad(const std::string& path, const OpenscadOptions& options,
                                 const Execution& execution) {
  std::error_code status;
  if (!std::filesystem::is_regular_file(path, status)) {
    return fail(ErrorCode::kInput, "{}: no such file", path);
  }
  OpenscadRun run;
  run.files.push_back(identify_file(path));
  const Memory output, rule;
  if (output.descriptor() < 0 || rule.descriptor() < 0) {
    return fail(ErrorCode::kLimit, "{}: no memory for the output of openscad", path);
  }
  const std::string mark = random_word();
  std::vector<std::string> words{"openscad", "-o", output.path(), "--export-format",
                                 "csg",      "-d", rule.path()};
  words.insert(words.end(), options.options.begin(), options.options.end());
  // The echo() comes after the program's own text, where its variables have their values.
  words.insert(words.end(), {"-D", fmt::format("{0}=echo(\"{0}\",$vpr,$vpt,$vpd,$vpf)0", mark)});
  // A name that begins with a dash would be taken as an option.
  words.push_back(path.starts_with('-') ? "./" + path : path);
  std::vector<const char*> arguments;
  for (const std::string& word : words) arguments.push_back(word.c_str());
  arguments.push_back(nullptr);
  Child child;
  const int reason = child.start(arguments.data(), {output.descriptor(), rule.descriptor()});
  if (reason != 0) {
    return fail(ErrorCode::kInput,
                "{}: a .scad file needs `openscad`, which cannot be started ({}): install the "
                "package openscad, or run `openscad -o scene.csg {}` where it is installed "
                "and give the .csg file",
                path, std::generic_category().message(reason), path);
  }
  Speech said(path, fmt::format("ECHO: \"{}\", ", mark));
  if (auto done = wait_for(child, said, path, options.timeout_s, execution); !done) {
    return tl::unexpected(done.error());
  }
  auto text = output.text();
  if (!text || text->empty()) {
    return fail(ErrorCode::kInput, "{}: openscad wrote nothing: {}", path, said.last_words());
  }
  run.text = *std::move(text);
  for (const std::string& file : files_of_rule(rule.text().value_or(""))) {
    if (file != path) run.files.push_back(identify_file(file));
  }
  if (said.has_view()) run.view = read_view(said.view(), run.files);
  run.warnings = std::move(said.warnings());
  run.notes = std::move(said.notes());
  if (said.further_notes() > 0) {
    run.notes.push_back(fmt::format("ECHO: [... {} more lines]", said.further_notes()));
  }
  return run;
}

}  // namespace strata::csg
