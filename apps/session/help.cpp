#include "apps/session/help.h"

#include <CLI/App.hpp>
#include <algorithm>

#include <fmt/format.h>

#include "core/did_you_mean.h"

namespace strata::apps {
namespace {

constexpr std::size_t kColumn = 26, kWidth = 80;
constexpr const char* kHelpGroup = "Help";

OptionGroup& group_of(std::vector<OptionGroup>& groups, const std::string& heading) {
  const auto found = std::find_if(groups.begin(), groups.end(),
                                  [&](const auto& group) { return group.heading == heading; });
  return found != groups.end() ? *found : groups.emplace_back(OptionGroup{heading, {}});
}

/// The sentence about an option that a command has not. `--axes=x` is about `--axes`.
std::string unknown_option(const CLI::App& app, const std::string& given) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) {
      const bool other_case = given.size() == 2 && name.size() == 1 && (given[1] ^ name[0]) == 0x20;
      if (other_case) return fmt::format("unknown option {}; did you mean -{}?", given, name);
    }
  }
  const std::vector<std::string_view> known(names.begin(), names.end());
  const std::string word = given.substr(0, given.find('='));
  return "unknown option " + given + did_you_mean(word, known);
}

/// Appends an entry: its label, and its text in the column beside or below it.
void append_entry(std::string& text, const OptionText& option) {
  const std::string label = "  " + option_label(option);
  text += label;
  std::size_t column = label.size();
  if (column + 2 > kColumn) {
    text += '\n';
    column = 0;
  }
  text.append(kColumn - column, ' ');
  column = kColumn;
  for (std::size_t begin = 0; begin < option.what.size();) {
    const std::size_t end = std::min(option.what.find(' ', begin), option.what.size());
    if (column > kColumn && column + 1 + (end - begin) > kWidth) {
      text += '\n';
      text.append(kColumn, ' ');
      column = kColumn;
    } else if (column > kColumn) {
      text += ' ';
      ++column;
    }
    text.append(option.what, begin, end - begin);
    column += end - begin;
    begin = end + 1;
  }
  text += '\n';
}

}  // namespace

std::vector<OptionGroup> option_groups(const CLI::App& app, bool all) {
  std::vector<OptionGroup> groups;
  OptionGroup help{kHelpGroup, {}};
  std::vector<OptionText> aliases;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty() || (!all && option->get_group() == kDeveloperGroup)) continue;
    OptionText text{{}, option->get_type_name(), option->get_description()};
    if (option->get_positional()) text.names.push_back(option->get_name(true));
    for (const std::string& name : option->get_snames()) text.names.push_back("-" + name);
    const auto& long_names = option->get_lnames();
    for (const std::string& name : long_names) {
      if (name == long_names.front()) {
        text.names.push_back("--" + name);
      } else {
        aliases.push_back({{"--" + name}, text.value, "The same as --" + long_names.front()});
      }
    }
    const bool is_help = option == app.get_help_ptr() || option == app.get_help_all_ptr() ||
                         option == app.get_version_ptr();
    auto& options = is_help ? help.options : group_of(groups, option->get_group()).options;
    options.push_back(std::move(text));
  }
  for (OptionText& alias : aliases) {
    group_of(groups, kOpenscadGroup).options.push_back(std::move(alias));
  }
  // OpenSCAD's options, developers' and -h come last, whatever was defined first.
  for (const char* last : {kOpenscadGroup, kDeveloperGroup}) {
    std::stable_partition(groups.begin(), groups.end(),
                          [last](const auto& group) { return group.heading != last; });
  }
  groups.push_back(std::move(help));
  return groups;
}

std::string option_label(const OptionText& option) {
  std::string label;
  for (const std::string& name : option.names) label += (label.empty() ? "" : ", ") + name;
  if (option.value.empty() || option.value.starts_with('[')) return label + option.value;
  return label + " " + option.value;
}

std::string usage_line(const CLI::App& app) {
  std::string line = app.get_name() + " [OPTIONS]";
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_positional()) line += " " + option->get_name(true) + "...";
  }
  return line;
}

std::string help_text(const CLI::App& app, bool all) {
  std::string text = app.get_description();
  if (!text.ends_with('\n')) text += '\n';
  text += "\nUsage: " + usage_line(app) + "\n";
  for (const OptionGroup& group : option_groups(app, all)) {
    text += "\n" + group.heading + ":\n";
    for (const OptionText& option : group.options) append_entry(text, option);
  }
  return text + "\n" + app.get_footer() + "\n";
}

void define_help(CLI::App& app) {
  app.set_help_flag("-h,--help", "Print this help and exit");
  app.set_help_all_flag("--help-all", "Print this help with the options for developers, and exit");
}

std::string parse_mistake(const CLI::App& app, const CLI::ParseError& error) {
  const std::string text = error.what();
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) {
    const std::vector<std::string> unknown = app.remaining();
    if (!unknown.empty()) return unknown_option(app, unknown.front());
  }
  // CLI11's texts begin with the option: `--threads: 1 required N missing`.
  const std::string name = text.substr(0, text.find_first_of(": "));
  const CLI::Option* option = app.get_option_no_throw(name);
  if (option == nullptr) return text;
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
    if (option->count() > 1) return fmt::format("{} is given {} times", name, option->count());
    const std::string value = option->get_type_name();
    if (option->get_items_expected_min() > 0)
      return fmt::format("{} needs a value: {}", name, value);
    return name + " takes no value";
  }
  if (dynamic_cast<const CLI::ValidationError*>(&error) != nullptr) {
    return name + text.substr(std::min(name.size() + 1, text.size()));
  }
  return text;
}

}  // namespace strata::apps
