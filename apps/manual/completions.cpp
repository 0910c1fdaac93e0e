#include <fmt/format.h>

#include <algorithm>

#include "apps/manual/program_text.h"

namespace strata::manual {
namespace {

/// What may stand behind an option.
struct Value {
  enum Kind { kNone, kText, kFile, kFolder, kWords } kind = kNone;
  bool attached = false;  ///< behind a `=`, or left out
  std::vector<std::string> words = {};
};

Value value_of(const apps::OptionText& option, const std::vector<NamedValues>& named) {
  std::string text = option.value;
  Value value;
  if (text.empty()) return value;
  if (text.starts_with("[=")) {
    value.attached = true;
    text = text.substr(2, text.size() - 3);
  }
  value.kind = Value::kText;
  if (text == "FILE") value.kind = Value::kFile;
  if (text == "FOLDER") value.kind = Value::kFolder;
  for (const NamedValues& one : named) {
    if (one.placeholder == text) value.words = one.values;
  }
  // Placeholders are capitals, choices are not.
  if (std::none_of(text.begin(), text.end(), [](char c) { return c >= 'A' && c <= 'Z'; })) {
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t end = std::min(text.find('|', begin), text.size());
      value.words.push_back(text.substr(begin, end - begin));
      begin = end + 1;
    }
  }
  if (!value.words.empty()) value.kind = Value::kWords;
  return value;
}

bool is_input(const apps::OptionText& option) { return !option.names.front().starts_with('-'); }

/// The word by which scripts know a program: csg of `strata csg`, verify of `strata-verify`.
std::string key_of(const ProgramText& program) {
  const std::size_t mark = program.name.find_first_of(" -");
  return mark == std::string::npos ? "strata" : program.name.substr(mark + 1);
}

std::vector<apps::OptionText> options_of(const ProgramText& program) {
  std::vector<apps::OptionText> options;
  for (const apps::OptionGroup& group : program.options) {
    for (const apps::OptionText& option : group.options) {
      if (!is_input(option)) options.push_back(option);
    }
  }
  return options;
}

/// The commands of strata among the programs.
std::vector<const ProgramText*> commands_of(const Completion& completion) {
  std::vector<const ProgramText*> commands;
  for (const ProgramText& program : completion.programs) {
    if (program.name.starts_with("strata ")) commands.push_back(&program);
  }
  return commands;
}

std::string bash_value_case(const std::string& key, const apps::OptionText& option,
                            const Value& value) {
  std::string patterns, action;
  for (const std::string& name : option.names) {
    patterns += fmt::format("{}{}:{}", patterns.empty() ? "" : " | ", key, name);
    if (value.attached) patterns += '=';
    if (!value.attached && name.starts_with("--")) patterns += fmt::format(" | {}:{}=", key, name);
  }
  switch (value.kind) {
    case Value::kNone:
      return {};
    case Value::kText:
      action = ":";
      break;
    case Value::kFile:
      action = "mapfile -t COMPREPLY < <(compgen -f -- \"$cur\")";
      break;
    case Value::kFolder:
      action = "mapfile -t COMPREPLY < <(compgen -d -- \"$cur\")";
      break;
    case Value::kWords:
      action = fmt::format("mapfile -t COMPREPLY < <(compgen -W '{}' -- \"$cur\")",
                           fmt::join(value.words, " "));
  }
  return fmt::format("    {}) {}; return ;;\n", patterns, action);
}

/// A text for zsh's _arguments, in single quotes.
std::string zsh_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
    out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return out;
}

std::string zsh_option(const apps::OptionText& option, const Value& value) {
  std::string action;
  if (value.kind == Value::kFile) action = "_files";
  if (value.kind == Value::kFolder) action = "_files -/";
  if (value.kind == Value::kWords) action = fmt::format("({})", fmt::join(value.words, " "));
  std::string text;
  for (const std::string& name : option.names) {
    std::string spec = name;
    if (option.what.ends_with("may be repeated")) spec = "*" + spec;
    // `-` behind the `=` says that the value stands there, a second colon that it may be missing.
    if (value.kind != Value::kNone && name.starts_with("--")) spec += value.attached ? "=-" : "=";
    spec += fmt::format("[{}]", zsh_text(option.what));
    if (value.kind != Value::kNone) {
      spec += fmt::format("{}{}:{}", value.attached ? "::" : ":", zsh_text(option.value), action);
    }
    text += fmt::format("    '{}'\n", spec);
  }
  return text;
}

std::string fish_quoted(std::string_view text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') out += '\\';
    out += c;
  }
  return out + "'";
}

std::string fish_option(const std::string& program, const std::string& condition,
                        const apps::OptionText& option, const Value& value) {
  std::string line = "complete -c " + program;
  if (!condition.empty()) line += " -n " + fish_quoted(condition);
  for (const std::string& name : option.names) {
    line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
  }
  if (value.kind == Value::kWords) {
    line += fmt::format(" {} -a '{}'", value.attached ? "-f" : "-x", fmt::join(value.words, " "));
  } else if (value.kind == Value::kFolder) {
    line += " -x -a '(__fish_complete_directories)'";
  } else if (value.kind == Value::kFile && !value.attached) {
    line += " -r -F";
  } else if (value.kind == Value::kText && !value.attached) {
    line += " -x";
  }
  return line + " -d " + fish_quoted(option.what) + "\n";
}

}  // namespace

std::string bash_completion(const Completion& completion) {
  std::string values, options, names, programs;
  for (const ProgramText& program : completion.programs) {
    std::string list;
    for (const apps::OptionText& option : options_of(program)) {
      for (const std::string& name : option.names) list += (list.empty() ? "" : " ") + name;
      values += bash_value_case(key_of(program), option, value_of(option, completion.values));
    }
    options += fmt::format("    {}) options='{}' ;;\n", key_of(program), list);
    if (program.name.find(' ') == std::string::npos) programs += " " + program.name;
  }
  for (const ProgramText* command : commands_of(completion)) names += " " + key_of(*command);
  return fmt::format(R"(# bash completion of strata; made from its tables of options.
_strata()
{{
  local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD - 1]}} command options=
  COMPREPLY=()
  # To bash, --option=value is three words.
  if [[ $cur == = ]]; then
    cur= prev=$prev=
  elif [[ $prev == = ]]; then
    prev=${{COMP_WORDS[COMP_CWORD - 2]}}=
  fi
  case ${{COMP_WORDS[0]##*/}} in
    strata-*) command=${{COMP_WORDS[0]##*/strata-}} command=${{command#strata-}} ;;
    *)
      command=${{COMP_WORDS[1]}}
      if ((COMP_CWORD == 1)); then
        command=strata
        [[ $cur == -* ]] || mapfile -t COMPREPLY < <(compgen -W '{0}' -- "$cur")
      elif [[ " {0} " != *" $command "* ]]; then
        command=csg # strata part.scad -o part.png
      fi
      ;;
  esac
  case $command:$prev in
{1}  esac
  case $command in
{2}  esac
  if [[ $cur == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$cur")
  else
    local files
    mapfile -t files < <(compgen -f -- "$cur")
    COMPREPLY+=("${{files[@]}}")
  fi
}}
complete -o filenames -F _strata{3}
)",
                     names.substr(1), values, options, programs);
}

std::string zsh_completion(const Completion& completion) {
  std::string programs, functions, names, choices, services;
  for (const ProgramText& program : completion.programs) {
    const std::string key = key_of(program);
    if (program.name.find(' ') == std::string::npos) programs += " " + program.name;
    if (key == "strata") continue;
    if (program.name.starts_with("strata-")) {
      services += fmt::format("    {}) _strata_{}; return ;;\n", program.name, key);
      const auto same = [&](const ProgramText* command) { return key_of(*command) == key; };
      const auto commands = commands_of(completion);
      if (std::any_of(commands.begin(), commands.end(), same)) continue;
    } else {
      names += fmt::format("    '{}:{}'\n", key, zsh_text(program.what));
      choices += (choices.empty() ? "" : "|") + key;
    }
    functions += fmt::format("_strata_{}() {{\n  local -a options=(\n", key);
    for (const apps::OptionText& option : options_of(program)) {
      functions += zsh_option(option, value_of(option, completion.values));
    }
    functions += "  )\n  _arguments -s -S $options '*:input:_files'\n}\n\n";
  }
  return fmt::format(R"(#compdef{0}
# zsh completion of strata; made from its tables of options.

{1}_strata() {{
  case $service in
{2}  esac
  local -a commands=(
{3}  )
  if ((CURRENT == 2)); then
    _alternative 'commands:command:(({{${{commands}}}}))' 'files:file:_files'
    return
  fi
  case $words[2] in
    {4})
      local command=$words[2]
      shift words
      ((CURRENT--))
      _strata_$command
      ;;
    *) _strata_csg ;; # strata part.scad -o part.png
  esac
}}

_strata "$@"
)",
                     programs, functions, services, names, choices);
}

std::string fish_completion(const Completion& completion) {
  std::string text = "# fish completion of strata; made from its tables of options.\n";
  for (const ProgramText& program : completion.programs) {
    const std::string key = key_of(program);
    const bool is_command = program.name.starts_with("strata ");
    std::string condition;
    if (key == "strata") condition = "__fish_use_subcommand";
    if (is_command) {
      condition = "__fish_seen_subcommand_from " + key;
      text += fmt::format("complete -c strata -n __fish_use_subcommand -a {} -d {}\n", key,
                          fish_quoted(program.what));
    }
    for (const apps::OptionText& option : options_of(program)) {
      text += fish_option(is_command ? "strata" : program.name, condition, option,
                          value_of(option, completion.values));
    }
  }
  return text;
}

}  // namespace strata::manual
