#include "apps/view/files/customizer.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/printable.h"

// The rules are those of OpenSCAD 2021.01 (its manual, "Customizer"). We differ: text behind the
// closing bracket of an annotation is ignored, and a comment without brackets begins no tab.

namespace strata::view {
namespace {

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '$';
}
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// A finite number at the beginning of `text`, which loses it.
std::optional<double> take_number(std::string_view& text) {
  std::string_view rest = text;
  double sign = 1;
  while (!rest.empty() && (rest.front() == '-' || rest.front() == '+' || is_blank(rest.front()))) {
    if (rest.front() == '-') sign = -sign;
    rest.remove_prefix(1);
  }
  if (rest.empty() || !(is_digit(rest.front()) || rest.front() == '.')) return {};
  double value = 0;
  const auto [end, status] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (status != std::errc() || !std::isfinite(value)) return {};
  text = rest.substr(static_cast<std::size_t>(end - rest.data()));
  return sign * value;
}

/// All of `text` as a number.
std::optional<double> number_in(std::string_view text) {
  text = trimmed(text);
  const auto value = take_number(text);
  return value && text.empty() ? value : std::nullopt;
}

/// `[1, 2, 3]`, at most four numbers.
std::optional<std::vector<double>> take_vector(std::string_view& text) {
  constexpr std::size_t kMostNumbers = 4;
  std::string_view rest = text;
  if (rest.empty() || rest.front() != '[') return {};
  rest.remove_prefix(1);
  std::vector<double> numbers;
  while (true) {
    const auto number = take_number(rest);
    if (!number || numbers.size() == kMostNumbers) return {};
    numbers.push_back(*number);
    rest = rest.substr(std::min(rest.find_first_not_of(" \t\r\n"), rest.size()));
    if (rest.empty() || (rest.front() != ',' && rest.front() != ']')) return {};
    const bool last = rest.front() == ']';
    rest.remove_prefix(1);
    if (last) break;
  }
  text = rest;
  return numbers;
}

/// A text in quotes.
std::optional<std::string> take_text(std::string_view& text) {
  if (text.empty() || text.front() != '"') return {};
  std::string value;
  for (std::size_t i = 1; i < text.size(); ++i) {
    if (text[i] == '"') {
      text.remove_prefix(i + 1);
      return value;
    }
    if (text[i] != '\\' || i + 1 == text.size()) {
      value += text[i];
      continue;
    }
    const char c = text[++i];
    if (c == 'n' || c == 't' || c == 'r') {
      value += c == 'n' ? '\n' : c == 't' ? '\t' : '\r';
    } else if (c == '"' || c == '\\') {
      value += c;
    } else {
      return {};  // \x and \u: a text that a person cannot well edit
    }
  }
  return {};
}

/// Splits at a mark outside of quotes.
std::vector<std::string_view> split(std::string_view text, char mark) {
  std::vector<std::string_view> parts;
  bool quoted = false;
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    if (i < text.size() && text[i] == '"') quoted = !quoted;
    if (i < text.size() && (quoted || text[i] != mark)) continue;
    parts.push_back(trimmed(text.substr(begin, i - begin)));
    begin = i + 1;
  }
  return parts;
}

/// A word of an annotation, with or without quotes.
std::string plain(std::string_view word) {
  std::string_view rest = word;
  auto quoted = take_text(rest);
  return quoted && rest.empty() ? *std::move(quoted) : std::string(word);
}

/// `[50]`, `[5:50]`, `[5:0.5:50]`.
bool read_range(const std::vector<std::string_view>& items, Parameter& parameter) {
  if (items.size() != 1) return false;
  std::vector<double> numbers;
  for (const std::string_view part : split(items[0], ':')) {
    const auto number = number_in(part);
    if (!number) return false;
    numbers.push_back(*number);
  }
  if (numbers.empty() || numbers.size() > 3) return false;
  const double least = numbers.size() == 1 ? 0 : numbers.front(), most = numbers.back();
  if (!(least < most)) return false;
  parameter.least = least;
  parameter.most = most;
  if (numbers.size() == 3 && numbers[1] > 0) parameter.step = numbers[1];
  return true;
}

/// `[a, b]`, `[1:small, 2:big]`.
void read_choices(const std::vector<std::string_view>& items, Parameter& parameter) {
  const bool numbers = std::holds_alternative<double>(parameter.value);
  std::vector<Parameter::Choice> choices;
  for (const std::string_view item : items) {
    const auto parts = split(item, ':');
    Parameter::Choice choice;
    if (numbers) {
      const auto number = number_in(parts[0]);
      if (!number) return;
      choice.value = *number;
    } else {
      choice.value = plain(parts[0]);
    }
    // A label may hold colons.
    choice.label = parts.size() == 1
                       ? text_of(choice.value)
                       : plain(trimmed(item.substr(item.find(':', parts[0].size()) + 1)));
    choices.push_back(std::move(choice));
  }
  parameter.choices = std::move(choices);
}

/// What the comment behind an assignment says.
void annotate(std::string_view comment, Parameter& parameter) {
  comment = trimmed(comment);
  if (std::holds_alternative<bool>(parameter.value)) return;
  const bool is_text = std::holds_alternative<std::string>(parameter.value);
  if (!comment.starts_with('[')) {
    const auto number = number_in(comment);
    if (!number || !(*number > 0)) return;
    if (is_text) {
      parameter.longest = static_cast<std::size_t>(std::min(*number, 1e6));
    } else {
      parameter.step = *number;
    }
    return;
  }
  const std::size_t end = comment.find(']');
  if (end == std::string_view::npos) return;
  const auto items = split(comment.substr(1, end - 1), ',');
  if (items.size() == 1 && items[0].empty()) return;
  if (!is_text && read_range(items, parameter)) return;
  if (!std::holds_alternative<std::vector<double>>(parameter.value)) read_choices(items, parameter);
}

/// Goes through a program once, and collects.
class Scan {
 public:
  explicit Scan(std::string_view program) : text_(program) {
    lines_.push_back(0);
    for (std::size_t i = 0; i < text_.size(); ++i) {
      if (text_[i] == '\n') lines_.push_back(i + 1);
    }
  }

  std::vector<Parameter> run() {
    const std::size_t end = first_brace();
    // All of the brace's line is out, too.
    const std::size_t last = end == std::string_view::npos ? lines_.size() : line_at(end);
    while (skip_blank() && line_at(at_) < last) statement();
    std::erase_if(found_,
                  [](const Found& one) { return !one.literal || one.parameter.tab == "Hidden"; });
    std::vector<Parameter> parameters;
    for (Found& one : found_) parameters.push_back(std::move(one.parameter));
    return parameters;
  }

 private:
  struct Found {
    Parameter parameter;
    bool literal = true;  ///< its last value is one
  };

  /// From 0.
  [[nodiscard]] std::size_t line_at(std::size_t at) const {
    return static_cast<std::size_t>(std::upper_bound(lines_.begin(), lines_.end(), at) -
                                    lines_.begin()) -
           1;
  }
  [[nodiscard]] std::string_view line_text(std::size_t line) const {
    const std::size_t begin = lines_[line];
    return text_.substr(begin, std::min(text_.find('\n', begin), text_.size()) - begin);
  }

  /// The end of a comment or text that begins at `i`; `i` where there is none.
  [[nodiscard]] std::size_t skip(std::size_t i) const {
    const std::string_view rest = text_.substr(i);
    if (rest.starts_with("//")) return std::min(text_.find('\n', i), text_.size());
    if (rest.starts_with("/*")) {
      const std::size_t end = text_.find("*/", i + 2);
      return end == std::string_view::npos ? text_.size() : end + 2;
    }
    if (!rest.starts_with('"')) return i;
    std::size_t end = i + 1;
    while (end < text_.size() && text_[end] != '"') end += text_[end] == '\\' ? 2 : 1;
    return std::min(end + 1, text_.size());
  }

  [[nodiscard]] std::size_t first_brace() const {
    for (std::size_t i = 0; i < text_.size();) {
      const std::size_t end = skip(i);
      if (end == i && text_[i] == '{') return i;
      i = std::max(end, i + 1);
    }
    return std::string_view::npos;
  }

  /// Goes on to the next statement; remembers tabs. @return false at the end
  bool skip_blank() {
    while (at_ < text_.size()) {
      if (is_blank(text_[at_]) || text_[at_] == ';') {
        ++at_;
        continue;
      }
      const std::size_t end = text_[at_] == '"' ? at_ : skip(at_);
      if (end == at_) return true;
      remember_tab(text_.substr(at_, end - at_));
      at_ = end;
    }
    return false;
  }

  void remember_tab(std::string_view comment) {
    if (!comment.starts_with("/*") || comment.find('\n') != std::string_view::npos) return;
    const std::size_t begin = comment.find('['), end = comment.find(']', begin + 1);
    if (begin == std::string_view::npos || end == std::string_view::npos) return;
    tab_ = printable(trimmed(comment.substr(begin + 1, end - begin - 1)), 100);
  }

  /// Reads to the semicolon. An assignment of a literal is a parameter.
  void statement() {
    const std::size_t begin = at_;
    std::size_t equals = std::string_view::npos;
    while (at_ < text_.size() && text_[at_] != ';') {
      const std::size_t end = skip(at_);
      if (end > at_ && text_[at_] == '/') {
        remember_tab(text_.substr(at_, end - at_));
      }
      if (end == at_ && text_[at_] == '=' && equals == std::string_view::npos) equals = at_;
      at_ = std::max(end, at_ + 1);
    }
    if (at_ >= text_.size() || equals == std::string_view::npos) return;
    const std::string_view name = trimmed(text_.substr(begin, equals - begin));
    if (name.empty() || !is_letter(name.front()) ||
        !std::all_of(name.begin(), name.end(),
                     [](char c) { return is_letter(c) || is_digit(c); })) {
      return;
    }
    take(std::string(name), parse_literal(text_.substr(equals + 1, at_ - equals - 1)),
         line_at(begin));
  }

  void take(std::string name, std::optional<ParameterValue> value, std::size_t line) {
    const auto known = std::find_if(found_.begin(), found_.end(), [&name](const Found& one) {
      return one.parameter.name == name;
    });
    Found found;
    Parameter& parameter = found.parameter;
    parameter.name = std::move(name);
    found.literal = value.has_value();
    if (value) parameter.value = *std::move(value);
    if (known != found_.end()) {
      if (known->parameter.value.index() != parameter.value.index()) known->literal = false;
      known->literal = known->literal && found.literal;
      if (known->literal) known->parameter.value = std::move(parameter.value);
      return;
    }
    parameter.tab = tab_;
    parameter.line = static_cast<int>(line) + 1;
    if (line > 0) parameter.description = description(line_text(line - 1));
    annotate(comment_of(line_text(line)), parameter);
    found_.push_back(std::move(found));
  }

  static std::string description(std::string_view line) {
    if (!line.starts_with("//")) return {};
    return printable(trimmed(line.substr(2)), 400);
  }

  /// What follows `//`; nothing where a second statement stands before it.
  static std::string_view comment_of(std::string_view line) {
    bool quoted = false;
    int ends = 0;
    for (std::size_t i = 0; i + 1 < line.size(); ++i) {
      if (quoted && line[i] == '\\') {
        ++i;
      } else if (line[i] == '"') {
        quoted = !quoted;
      } else if (!quoted && line.substr(i, 2) == "//") {
        return line.substr(i + 2);
      } else if (!quoted && line[i] == ';' && ++ends > 1) {
        return {};
      }
    }
    return {};
  }

  std::string_view text_;
  std::vector<std::size_t> lines_;  ///< where each begins
  std::size_t at_ = 0;
  std::string tab_ = "Parameters";
  std::vector<Found> found_;
};

std::string number_text(double number) { return fmt::format("{}", number == 0 ? 0.0 : number); }

}  // namespace

std::vector<Parameter> parse_parameters(std::string_view program) { return Scan(program).run(); }

std::optional<ParameterValue> parse_literal(std::string_view text) {
  text = trimmed(text);
  if (text == "true" || text == "false") return ParameterValue(text == "true");
  std::optional<ParameterValue> value;
  if (const auto number = take_number(text)) {
    value = *number;
  } else if (auto word = take_text(text)) {
    value = *std::move(word);
  } else if (auto vector = take_vector(text)) {
    value = *std::move(vector);
  }
  return text.empty() ? value : std::nullopt;
}

Result<ParameterValue> parse_value(const Parameter& parameter, std::string_view text) {
  const auto refuse = [&](const char* wanted) {
    return fail(ErrorCode::kUsage, "the parameter {} must be {}, got '{}'", parameter.name, wanted,
                printable(text, 100));
  };
  if (std::holds_alternative<bool>(parameter.value)) {
    if (text != "true" && text != "false") return refuse("true or false");
    return ParameterValue(text == "true");
  }
  if (std::holds_alternative<double>(parameter.value)) {
    const auto number = number_in(text);
    if (!number) return refuse("a number");
    return ParameterValue(*number);
  }
  if (const auto* vector = std::get_if<std::vector<double>>(&parameter.value)) {
    std::string_view rest = trimmed(text);
    auto numbers = take_vector(rest);
    if (!numbers || !rest.empty() || numbers->size() != vector->size()) {
      return refuse(fmt::format("{} numbers such as {}", vector->size(), text_of(*vector)).c_str());
    }
    return ParameterValue(*std::move(numbers));
  }
  return ParameterValue(std::string(text));
}

std::string text_of(const ParameterValue& value) {
  if (const auto* on = std::get_if<bool>(&value)) return *on ? "true" : "false";
  if (const auto* number = std::get_if<double>(&value)) return number_text(*number);
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  std::string all;
  for (const double number : std::get<std::vector<double>>(value)) {
    all += (all.empty() ? "" : ", ") + number_text(number);
  }
  return "[" + all + "]";
}

std::string literal_of(const ParameterValue& value) {
  const auto* text = std::get_if<std::string>(&value);
  if (text == nullptr) return text_of(value);
  std::string literal = "\"";
  for (const char c : *text) {
    switch (c) {
      case '"':
        literal += "\\\"";
        break;
      case '\\':
        literal += "\\\\";
        break;
      case '\n':
        literal += "\\n";
        break;
      case '\t':
        literal += "\\t";
        break;
      case '\r':
        literal += "\\r";
        break;
      default:
        literal += c;
    }
  }
  return literal + "\"";
}

std::vector<std::string> definitions_of(const ParameterValues& values) {
  std::vector<std::string> words;
  for (const auto& [name, value] : values) {
    words.insert(words.end(), {"-D", fmt::format("{}={}", name, literal_of(value))});
  }
  return words;
}

}  // namespace strata::view
