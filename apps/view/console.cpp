#include "apps/view/console.h"

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <utility>

namespace strata::view {
namespace {

ConsoleLine line_of(ConsoleLine::Kind kind, std::string text) {
  ConsoleLine line{kind, std::move(text), {}};
  std::error_code ignored;
  line.place = place_in(line.text);
  if (line.place && !std::filesystem::is_regular_file(line.place->file, ignored)) {
    line.place.reset();
  }
  return line;
}

}  // namespace

void add_error(std::vector<ConsoleLine>& lines, const std::string& text) {
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    lines.push_back(line_of(ConsoleLine::Kind::kError, std::string(rest.substr(0, end))));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
}

void add_model(std::vector<ConsoleLine>& lines, const Model& model) {
  for (const std::string& warning : model.warnings) {
    lines.push_back(line_of(ConsoleLine::Kind::kWarning, warning));
  }
  for (const std::string& note : model.scene.notes) {
    const bool echo = note.starts_with("ECHO: ");
    lines.push_back(line_of(echo ? ConsoleLine::Kind::kEcho : ConsoleLine::Kind::kNote, note));
  }
}

std::string text_of(const std::vector<ConsoleLine>& lines) {
  std::string text;
  for (const ConsoleLine& line : lines) text += line.text + "\n";
  return text;
}

std::size_t count_of(const std::vector<ConsoleLine>& lines, ConsoleLine::Kind kind) {
  return static_cast<std::size_t>(std::count_if(
      lines.begin(), lines.end(), [kind](const auto& line) { return line.kind == kind; }));
}

}  // namespace strata::view
