#include "apps/view/files/editor.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <system_error>
#include <utility>

extern char** environ;

namespace strata::view {
namespace {

/// Editors with a window, and how they take a line.
constexpr std::pair<std::string_view, std::string_view> kEditors[] = {
    {"code", "-g %f:%l"},
    {"codium", "-g %f:%l"},
    {"subl", "%f:%l"},
    {"zed", "%f:%l"},
    {"gvim", "+%l %f"},
    {"gedit", "+%l %f"},
    {"gnome-text-editor", "+%l %f"},
    {"xed", "+%l %f"},
    {"pluma", "+%l %f"},
    {"geany", "-l %l %f"},
    {"kate", "-l %l %f"},
    {"kwrite", "-l %l %f"},
    {"mousepad", "-l %l %f"},
    {"emacsclient", "-n +%l %f"},
    {"emacs", "+%l %f"},
    {"featherpad", "+%l %f"},
    {"scite", "%f -goto:%l"},
    {"leafpad", "--jump=%l %f"},
    {"openscad", "%f"}};

std::string_view program_of(std::string_view word) { return word.substr(word.rfind('/') + 1); }

const std::pair<std::string_view, std::string_view>* known(std::string_view word) {
  const auto* found = std::find_if(std::begin(kEditors), std::end(kEditors),
                                   [&](const auto& one) { return one.first == program_of(word); });
  return found == std::end(kEditors) ? nullptr : found;
}

std::string filled_in(std::string_view word, const std::string& file, int line) {
  std::string text;
  for (std::size_t i = 0; i < word.size(); ++i) {
    const char next = word[i] == '%' && i + 1 < word.size() ? word[i + 1] : '\0';
    if (next == 'f' || next == 'l' || next == '%') {
      text += next == 'f' ? file : next == 'l' ? std::to_string(line) : "%";
      ++i;
    } else {
      text += word[i];
    }
  }
  return text;
}

}  // namespace

std::optional<TextPlace> place_in(std::string_view text) {
  for (std::size_t i = 1; i < text.size(); ++i) {
    if (text[i] != ':') continue;
    int line = 0;
    const char* end = text.data() + text.size();
    const auto [rest, status] = std::from_chars(text.data() + i + 1, end, line);
    const bool ends = rest == end || *rest == ':' || *rest == ' ';
    if (status != std::errc() || line < 1 || !ends) continue;
    std::string_view file = text.substr(0, i);
    const std::size_t at = file.find(" at ");
    if (at != std::string_view::npos) file.remove_prefix(at + 4);
    if (file.empty()) return {};
    // Of a program that openscad has evaluated: the line is one of its output.
    constexpr std::string_view kEvaluated = " (as .csg)";
    if (file.ends_with(kEvaluated)) {
      file.remove_suffix(kEvaluated.size());
      line = 1;
    }
    return TextPlace{std::string(file), line};
  }
  return {};
}

Result<std::vector<std::string>> split_command(std::string_view command) {
  std::vector<std::string> words;
  std::string word;
  bool any = false;
  char quote = '\0';
  for (const char c : command) {
    if (quote != '\0') {
      if (c == quote) {
        quote = '\0';
      } else {
        word += c;
      }
    } else if (c == '"' || c == '\'') {
      quote = c;
      any = true;
    } else if (c == ' ' || c == '\t') {
      if (any) words.push_back(std::exchange(word, {}));
      any = false;
    } else {
      word += c;
      any = true;
    }
  }
  if (quote != '\0') return fail(ErrorCode::kUsage, "--editor: a quote is not closed: {}", command);
  if (any) words.push_back(std::move(word));
  if (words.empty() || words.front().empty()) {
    return fail(ErrorCode::kUsage, "--editor must be a command such as 'gedit +%l %f', got '{}'",
                command);
  }
  return words;
}

std::string editor_command(const std::string& given, const char* visual, const char* editor) {
  if (!given.empty()) return given;
  for (const char* one : {visual, editor}) {
    if (one == nullptr) continue;
    const auto words = split_command(one);
    // emacs without a window would take the terminal.
    if (words && known(words->front()) != nullptr &&
        std::find(words->begin(), words->end(), "-nw") == words->end()) {
      return one;
    }
  }
  return {};
}

Result<std::vector<std::string>> editor_words(const std::string& command, const TextPlace& place) {
  auto words = split_command(command);
  if (!words) return words;
  const bool says_file = std::any_of(words->begin() + 1, words->end(), [](const std::string& word) {
    return word.find("%f") != std::string::npos;
  });
  if (!says_file) {
    const auto* editor = known(words->front());
    const auto more = split_command(editor != nullptr ? editor->second : "%f");
    words->insert(words->end(), more->begin(), more->end());
  }
  // The editor may run in another folder; and a name that begins with a dash is no option.
  std::error_code ignored;
  const std::string file = std::filesystem::absolute(place.file, ignored).string();
  for (auto word = words->begin() + 1; word != words->end(); ++word) {
    *word = filled_in(*word, file, place.line);
  }
  return words;
}

Result<void> start_program(const std::vector<std::string>& words) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t streams;
  ::posix_spawn_file_actions_init(&streams);
  ::posix_spawn_file_actions_addopen(&streams, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_adddup2(&streams, STDERR_FILENO, STDOUT_FILENO);
  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);
  pid_t child = 0;
  const int reason =
      ::posix_spawnp(&child, arguments[0], &streams, &attributes, arguments.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&streams);
  if (reason != 0) {
    return fail(ErrorCode::kUsage, "the editor {} cannot be started: {}", words.front(),
                std::generic_category().message(reason));
  }
  // Those that were started before and have ended are let go.
  static std::vector<pid_t> children;
  children.push_back(child);
  std::erase_if(children, [](pid_t one) { return ::waitpid(one, nullptr, WNOHANG) != 0; });
  return {};
}

}  // namespace strata::view
