#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cctype>

#include "apps/manual/program_text.h"

namespace strata::manual {
namespace {

// A page has a date, and one that is made twice has the same: it is that of the texts.
constexpr const char* kDate = "2026-11-28";

std::vector<std::string> blocks_of(std::string_view text) {
  std::vector<std::string> blocks;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find("\n\n"), text.size());
    std::string block(text.substr(0, end));
    while (block.ends_with('\n')) block.pop_back();
    while (block.starts_with('\n')) block.erase(0, 1);
    if (!block.empty()) blocks.push_back(std::move(block));
    text.remove_prefix(std::min(end + 2, text.size()));
  }
  return blocks;
}

/// Text for roff: its own signs escaped, at the beginning of lines as well.
std::string escaped(std::string_view text) {
  std::string out;
  bool at_start = true;
  for (const char c : text) {
    if (at_start && (c == '.' || c == '\'')) out += "\\&";
    at_start = c == '\n';
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else if (c == '\'') {
      out += "\\(aq";
    } else if (c == '`') {
      out += "\\(ga";
    } else if (c == '^') {
      out += "\\(ha";
    } else if (c == '~') {
      out += "\\(ti";
    } else {
      out += c;
    }
  }
  return out;
}

std::string upper_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

std::string page_name(std::string name) {
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

std::string option_entry(const apps::OptionText& option) {
  std::string line;
  for (const std::string& name : option.names) {
    line += fmt::format("{}\\fB{}\\fR", line.empty() ? "" : ", ", escaped(name));
  }
  if (!option.value.empty()) {
    line += fmt::format("{}\\fI{}\\fR", option.value.starts_with('[') ? "" : " ",
                        escaped(option.value));
  }
  return fmt::format(".TP\n{}\n{}.\n", line, escaped(option.what));
}

std::string as_printed(std::string_view text) {
  return fmt::format(".nf\n{}\n.fi\n", escaped(text));
}

}  // namespace

ProgramText program_text(const CLI::App& app) {
  ProgramText program;
  program.name = app.get_name();
  program.usage = apps::usage_line(app);
  program.options = apps::option_groups(app, true);
  for (std::string& block : blocks_of(app.get_description())) {
    if (block.starts_with("  ")) {
      program.examples += (program.examples.empty() ? "" : "\n\n") + block;
    } else if (program.what.empty()) {
      // The first sentence names the page; more of them are its first paragraph.
      const std::size_t end = std::min(block.find(". "), block.size() - block.ends_with('.'));
      program.what = block.substr(0, end);
      if (end + 1 < block.size()) program.paragraphs.push_back(block.substr(end + 2));
    } else {
      program.paragraphs.push_back(std::move(block));
    }
  }
  for (const std::string& block : blocks_of(app.get_footer())) {
    const std::size_t line = block.find(":\n");
    if (line != std::string::npos) {
      program.more.push_back({block.substr(0, line), block.substr(line + 2)});
    }
  }
  return program;
}

std::string man_page(const ProgramText& program, const std::vector<std::string>& see_also) {
  std::string what = program.what;
  what[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(what[0])));
  const std::string name = page_name(program.name);
  std::string page = fmt::format(".TH {} 1 {} \"Strata {}\" \"Strata manual\"\n", upper_case(name),
                                 kDate, STRATA_VERSION);
  page += fmt::format(".SH NAME\n{} \\- {}\n", escaped(name), escaped(what));
  page += fmt::format(".SH SYNOPSIS\n\\fB{}\\fR\n", escaped(program.usage));
  what[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(what[0])));
  page += fmt::format(".SH DESCRIPTION\n{}.\n", escaped(what));
  for (const std::string& paragraph : program.paragraphs)
    page += ".PP\n" + escaped(paragraph) + "\n";
  if (!program.examples.empty()) page += ".SH EXAMPLES\n" + as_printed(program.examples);
  page += ".SH OPTIONS\n";
  for (const apps::OptionGroup& group : program.options) {
    page += fmt::format(".SS {}\n", escaped(group.heading));
    for (const apps::OptionText& option : group.options) page += option_entry(option);
  }
  for (const Section& section : program.more) {
    page += fmt::format(".SH {}\n{}", upper_case(section.heading), as_printed(section.text));
  }
  page += ".SH EXIT STATUS\n";
  for (const auto& [code, meaning] : apps::kExitCodes) {
    page += fmt::format(".TP\n\\fB{}\\fR\n{}.\n", code, escaped(meaning));
  }
  page += ".SH SEE ALSO\n";
  std::string pages;
  for (const std::string& other : see_also) {
    if (page_name(other) == name) continue;
    pages += fmt::format("{}\\fB{}\\fR(1)", pages.empty() ? "" : ",\n", escaped(page_name(other)));
  }
  return page + pages + "\n";
}

}  // namespace strata::manual
