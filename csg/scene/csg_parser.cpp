#include "csg/scene/csg_parser.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/printable.h"
#include "mesh/text/text_scanner.h"

namespace strata::csg {
namespace {

bool starts_identifier(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '$';
}
bool is_digit(char c) { return c >= '0' && c <= '9'; }

int hex_digit(char c) {
  if (is_digit(c)) return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

void append_utf8(std::string& out, std::uint32_t code) {
  const auto byte = [&](std::uint32_t bits) { out.push_back(static_cast<char>(bits)); };
  if (code < 0x80) return byte(code);
  if (code < 0x800) {
    byte(0xc0 | (code >> 6));
  } else {
    if (code < 0x10000) {
      byte(0xe0 | (code >> 12));
    } else {
      byte(0xf0 | (code >> 18));
      byte(0x80 | ((code >> 12) & 0x3f));
    }
    byte(0x80 | ((code >> 6) & 0x3f));
  }
  byte(0x80 | (code & 0x3f));
}

/// Describes the text at a place, for messages.
std::string shown(std::string_view rest) {
  if (rest.empty()) return "the end of the file";
  std::size_t length = 1;
  if (starts_identifier(rest[0]) || is_digit(rest[0])) {
    while (length < rest.size() && length < 40 &&
           (starts_identifier(rest[length]) || is_digit(rest[length]))) {
      ++length;
    }
  }
  const auto byte = static_cast<unsigned char>(rest[0]);
  if (byte < 0x20 || byte >= 0x7f) return fmt::format("byte 0x{:02x}", byte);
  return fmt::format("'{}'", rest.substr(0, length));
}

class Parser {
 public:
  Parser(std::string_view text, const std::string& name)
      : begin_(text.data()), at_(text.data()), end_(text.data() + text.size()) {
    ast_.text = text;
    ast_.name = name;
  }

  Result<Ast> run() {
    if (ast_.text.size() >= std::numeric_limits<std::uint32_t>::max()) {
      return fail(ErrorCode::kLimit, "{}: {} bytes of text; the limit is 4 GiB", ast_.name,
                  ast_.text.size());
    }
    if (strata::detail::is_wide_text(ast_.text)) {
      return fail(ErrorCode::kInput, "{}: {}", ast_.name, strata::detail::kWideText);
    }
    at_ += ast_.text.size() - strata::detail::without_byte_order_mark(ast_.text).size();
    if (!statements()) return tl::unexpected(error_);
    return std::move(ast_);
  }

 private:
  struct Open {
    std::uint32_t node;
    bool braces;  // false: it takes one child without braces, as in `multmatrix(...) cube();`
  };

  bool refuse(const char* where, std::string_view text) {
    constexpr std::size_t kMost = 600;  // a name in a message may be as long as the file
    const auto offset = static_cast<std::uint32_t>(where - begin_);
    error_ = {ErrorCode::kInput, fmt::format("{}: {}", ast_.place(offset), printable(text, kMost))};
    return false;
  }
  std::string here() const { return shown({at_, static_cast<std::size_t>(end_ - at_)}); }

  bool skip_space() {
    while (at_ < end_) {
      const char c = *at_;
      if (c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\v' || c == '\f') {
        ++at_;
      } else if (c == '/' && end_ - at_ > 1 && at_[1] == '/') {
        const void* line = std::memchr(at_, '\n', static_cast<std::size_t>(end_ - at_));
        at_ = line ? static_cast<const char*>(line) : end_;
      } else if (c == '/' && end_ - at_ > 1 && at_[1] == '*') {
        const std::string_view rest(at_, static_cast<std::size_t>(end_ - at_));
        const std::size_t close = rest.find("*/", 2);
        if (close == std::string_view::npos) return refuse(at_, "the comment is not closed");
        at_ += close + 2;
      } else {
        break;
      }
    }
    return true;
  }

  std::string_view identifier() {
    const char* start = at_;
    while (at_ < end_ && (starts_identifier(*at_) || is_digit(*at_))) ++at_;
    return {start, static_cast<std::size_t>(at_ - start)};
  }

  std::uint32_t offset() const { return static_cast<std::uint32_t>(at_ - begin_); }

  /// Completes the innermost node, and with it the nodes around it that take no braces.
  void finish(std::uint32_t node) {
    for (;;) {
      ast_.nodes[node].end = static_cast<std::uint32_t>(ast_.nodes.size());
      ast_.nodes[node].text_end = offset();
      if (open_.empty() || open_.back().braces) return;
      node = open_.back().node;
      open_.pop_back();
    }
  }

  bool statements() {
    std::uint8_t modifiers = 0;
    for (;;) {
      if (!skip_space()) return false;
      if (at_ == end_) break;
      const char c = *at_;
      if (c == '%' || c == '#' || c == '!' || c == '*') {
        modifiers |= c == '%'   ? AstNode::kBackground
                     : c == '#' ? AstNode::kHighlight
                     : c == '!' ? AstNode::kRoot
                                : AstNode::kDisabled;
        ++at_;
      } else if (starts_identifier(c)) {
        if (!node(modifiers)) return false;
        modifiers = 0;
      } else if (modifiers != 0) {
        return refuse(at_, fmt::format("expected a name after a modifier, not {}", here()));
      } else if (c == ';') {
        ++at_;
        if (!open_.empty() && !open_.back().braces) {  // `multmatrix(...) ;`
          const std::uint32_t waiting = open_.back().node;
          open_.pop_back();
          finish(waiting);
        }
      } else if (c == '{' && open_.empty()) {
        return refuse(at_, "'{' without a name before it");
      } else if (c == '}') {
        if (open_.empty()) return refuse(at_, "'}' without '{'");
        if (!open_.back().braces) return refuse(at_, "expected a child or ';', not '}'");
        ++at_;
        const std::uint32_t closed = open_.back().node;
        open_.pop_back();
        finish(closed);
      } else {
        return refuse(at_, fmt::format("expected a name, not {}", here()));
      }
    }
    if (modifiers != 0) return refuse(at_, "the file ends after a modifier");
    if (open_.empty()) return true;
    const AstNode& last = ast_.nodes[open_.back().node];
    return refuse(at_, fmt::format("the file ends inside '{}', which begins at {}", last.name,
                                   ast_.place(last.offset)));
  }

  bool node(std::uint8_t modifiers) {
    AstNode made;
    made.offset = offset();
    made.modifiers = modifiers;
    made.name = identifier();
    if (!skip_space()) return false;
    if (at_ == end_ || *at_ != '(') {
      const bool program = made.name == "module" || made.name == "function" || made.name == "use" ||
                           made.name == "include" || (at_ < end_ && *at_ == '=');
      return refuse(at_, fmt::format("expected '(' after '{}', not {}{}", made.name, here(),
                                     program ? "; a program (.scad) must be turned into .csg by "
                                               "`openscad -o scene.csg program.scad`"
                                             : ""));
    }
    ++at_;
    made.first_argument = static_cast<std::uint32_t>(ast_.arguments.size());
    if (!argument_list()) return false;
    made.argument_count = static_cast<std::uint32_t>(ast_.arguments.size()) - made.first_argument;
    const auto index = static_cast<std::uint32_t>(ast_.nodes.size());
    ast_.nodes.push_back(made);
    if (!skip_space()) return false;
    if (at_ < end_ && *at_ == ';') {
      ++at_;
      finish(index);
    } else if (at_ < end_ && *at_ == '{') {
      ++at_;
      open_.push_back({index, true});
    } else if (at_ < end_ && (starts_identifier(*at_) || *at_ == '%' || *at_ == '#' ||
                              *at_ == '!' || *at_ == '*')) {
      open_.push_back({index, false});
    } else {
      return refuse(at_,
                    fmt::format("expected ';' or '{{' after '{}(...)', not {}", made.name, here()));
    }
    return true;
  }

  bool argument_list() {
    for (;;) {
      if (!skip_space()) return false;
      if (at_ < end_ && *at_ == ')') break;
      AstArgument argument;
      if (at_ < end_ && starts_identifier(*at_)) {
        const char* start = at_;
        const std::string_view name = identifier();
        if (!skip_space()) return false;
        if (at_ < end_ && *at_ == '=') {
          ++at_;
          argument.name = name;
        } else {
          at_ = start;  // not a call but a value such as `true`
        }
      }
      argument.value = static_cast<std::uint32_t>(ast_.values.size());
      if (!value()) return false;
      ast_.arguments.push_back(argument);
      if (!skip_space()) return false;
      if (at_ < end_ && *at_ == ',') {
        ++at_;
      } else if (at_ == end_ || *at_ != ')') {
        return refuse(at_, fmt::format("expected ',' or ')', not {}", here()));
      }
    }
    ++at_;
    return true;
  }

  bool value() {
    const std::size_t depth = lists_.size();
    for (;;) {
      if (!skip_space()) return false;
      if (at_ < end_ && *at_ == '[') {
        ++at_;
        lists_.push_back(static_cast<std::uint32_t>(ast_.values.size()));
        ast_.values.push_back({0.0, 0, ValueKind::kList});
        if (!skip_space()) return false;
        if (at_ == end_ || *at_ != ']') continue;
      } else if (!scalar()) {
        return false;
      }
      // A value has ended. More values, or the ends of lists, follow.
      for (;;) {
        if (lists_.size() == depth) return true;
        if (!skip_space()) return false;
        bool more = false;
        if (at_ < end_ && *at_ == ',') {
          ++at_;
          if (!skip_space()) return false;
          more = at_ == end_ || *at_ != ']';
        } else if (at_ == end_ || *at_ != ']') {
          return refuse(at_, fmt::format("expected ',' or ']', not {}", here()));
        }
        if (more) break;
        ++at_;
        ast_.values[lists_.back()].end = static_cast<std::uint32_t>(ast_.values.size());
        lists_.pop_back();
      }
    }
  }

  bool scalar() {
    if (at_ == end_) return refuse(at_, "expected a value, not the end of the file");
    const char c = *at_;
    if (c == '"') return string();
    const char* start = at_;
    if (c == '-' || c == '+' || c == '.' || is_digit(c)) return number();
    if (!starts_identifier(c)) return refuse(at_, fmt::format("expected a value, not {}", here()));
    const std::string_view word = identifier();
    if (word == "true" || word == "false") {
      ast_.values.push_back({word == "true" ? 1.0 : 0.0, 0, ValueKind::kBool});
    } else if (word == "undef") {
      ast_.values.push_back({});
    } else {
      at_ = start;
      return number();
    }
    return true;
  }

  bool number() {
    const char* start = at_;
    const bool minus = *at_ == '-';
    if (minus || *at_ == '+') ++at_;
    double number = 0.0;
    if (at_ < end_ && starts_identifier(*at_)) {
      const std::string_view word = identifier();
      if (word == "inf") {
        number = std::numeric_limits<double>::infinity();
      } else if (word == "nan") {
        number = std::numeric_limits<double>::quiet_NaN();
      } else {
        at_ = start;
        return refuse(start, fmt::format("expected a value, not {}", here()));
      }
    } else {
      const bool begins = at_ < end_ && (is_digit(*at_) || *at_ == '.');
      const auto [stop, status] = std::from_chars(at_, begins ? end_ : at_, number);
      if (status == std::errc::result_out_of_range) {
        number = huge_or_tiny({at_, static_cast<std::size_t>(stop - at_)});
      } else if (status != std::errc()) {
        at_ = start;
        return refuse(start, fmt::format("expected a number, not {}", here()));
      }
      at_ = stop;
      if (at_ < end_ && (starts_identifier(*at_) || is_digit(*at_) || *at_ == '.')) {
        return refuse(at_, fmt::format("expected the end of a number, not {}", here()));
      }
    }
    ast_.values.push_back({minus ? -number : number, 0, ValueKind::kNumber});
    return true;
  }

  /// The value of a number beyond the range of double: infinity or 0, depending on its exponent.
  static double huge_or_tiny(std::string_view token) {
    const std::size_t e = token.find_first_of("eE");
    if (e != std::string_view::npos && e + 1 < token.size() && token[e + 1] == '-') return 0.0;
    // Without a negative exponent only many zeros after the point can make a number that small.
    const std::size_t digit = token.find_first_of("123456789");
    const std::size_t point = token.find('.');
    if (e == std::string_view::npos && point < digit) return 0.0;
    return std::numeric_limits<double>::infinity();
  }

  bool string() {
    const char* start = at_++;
    std::string text;
    for (;;) {
      const char* plain = at_;
      while (at_ < end_ && *at_ != '"' && *at_ != '\\') ++at_;
      text.append(plain, at_);
      if (at_ == end_) return refuse(start, "the string is not closed");
      if (*at_++ == '"') break;
      if (at_ == end_) return refuse(start, "the string is not closed");
      escape(text);
    }
    ast_.values.push_back(
        {0.0, static_cast<std::uint32_t>(ast_.strings.size()), ValueKind::kString});
    ast_.strings.push_back(std::move(text));
    return true;
  }

  /// Reads the character after a backslash. A character that is no escape stands for itself, as in
  /// OpenSCAD.
  void escape(std::string& text) {
    const char c = *at_++;
    switch (c) {
      case 'n':
        text.push_back('\n');
        return;
      case 't':
        text.push_back('\t');
        return;
      case 'r':
        text.push_back('\r');
        return;
      case '"':
      case '\\':
      case '\'':
        text.push_back(c);
        return;
      default:
        break;
    }
    const int digits = c == 'x' ? 2 : c == 'u' ? 4 : c == 'U' ? 6 : 0;
    std::uint32_t code = 0;
    int read = 0;
    while (read < digits && at_ + read < end_ && hex_digit(at_[read]) >= 0) {
      code = code * 16 + static_cast<std::uint32_t>(hex_digit(at_[read++]));
    }
    const bool surrogate = code >= 0xd800 && code < 0xe000;
    if (digits == 0 || read < digits || code == 0 || code > 0x10ffff || surrogate) {
      text.push_back('\\');
      text.push_back(c);
      return;
    }
    at_ += read;
    append_utf8(text, code);
  }

  Ast ast_;
  const char* begin_;
  const char* at_;
  const char* end_;
  std::vector<Open> open_;
  std::vector<std::uint32_t> lists_;
  Error error_;
};

}  // namespace

std::string Ast::place(std::uint32_t offset) const {
  // Errors of the parser come before line_starts exists, so the lines are counted here.
  std::size_t line = 0, start = 0;
  if (!line_starts.empty()) {
    const auto after = std::upper_bound(line_starts.begin(), line_starts.end(), offset);
    line = static_cast<std::size_t>(after - line_starts.begin());
    start = line_starts[line - 1];
  } else {
    const std::string_view before = text.substr(0, offset);
    line = 1 + static_cast<std::size_t>(std::count(before.begin(), before.end(), '\n'));
    const std::size_t newline = before.rfind('\n');
    start = newline == std::string_view::npos ? 0 : newline + 1;
  }
  return fmt::format("{}:{}:{}", name, line, offset - start + 1);
}

double ValueRef::number(double otherwise) const { return is_number() ? value().number : otherwise; }

bool ValueRef::truth(bool otherwise) const {
  if (!ast_ || (kind() != ValueKind::kBool && kind() != ValueKind::kNumber)) return otherwise;
  return value().number != 0.0;
}

std::string ValueRef::string(std::string_view otherwise) const {
  return std::string(is_string() ? std::string_view(ast_->strings[value().end]) : otherwise);
}

std::string ValueRef::shown() const {
  constexpr std::size_t kMost = 60;
  if (!ast_) return "undef";
  std::string text;
  std::vector<std::uint32_t> ends;  // the ends of the open lists
  const auto close = [&](std::uint32_t at) {
    for (; !ends.empty() && ends.back() == at; ends.pop_back()) text += ']';
  };
  const std::uint32_t last = is_list() ? value().end : index_ + 1;
  for (std::uint32_t at = index_; at < last; ++at) {
    if (text.size() > kMost) return text + " ...";
    if (at > index_ && text.back() != '[') text += ", ";
    const AstValue& one = ast_->values[at];
    switch (one.kind) {
      case ValueKind::kUndef:
        text += "undef";
        break;
      case ValueKind::kBool:
        text += one.number != 0.0 ? "true" : "false";
        break;
      case ValueKind::kNumber:
        text += std::isnan(one.number) ? "nan" : fmt::format("{:g}", one.number);
        break;
      case ValueKind::kString:
        text += fmt::format("\"{}\"", std::string_view(ast_->strings[one.end]).substr(0, kMost));
        break;
      case ValueKind::kList:
        text += '[';
        ends.push_back(one.end);
        break;
    }
    close(at + 1);
  }
  return text;
}

ValueRef::Iterator& ValueRef::Iterator::operator++() {
  const AstValue& value = ast_->values[index_];
  index_ = value.kind == ValueKind::kList ? value.end : index_ + 1;
  return *this;
}

std::size_t ValueRef::numbers(double* out, std::size_t count) const {
  std::size_t read = 0;
  for (const ValueRef element : *this) {
    if (read == count || !element.is_number()) break;
    out[read++] = element.value().number;
  }
  return read;
}

Result<Ast> parse_csg(std::string_view text, const std::string& name) {
  auto ast = Parser(text, name).run();
  if (!ast) return ast;
  ast->line_starts.push_back(0);
  const char* at = text.data();
  const char* const end = at + text.size();
  while (at < end) {
    const void* newline = std::memchr(at, '\n', static_cast<std::size_t>(end - at));
    if (!newline) break;
    at = static_cast<const char*>(newline) + 1;
    ast->line_starts.push_back(static_cast<std::uint32_t>(at - text.data()));
  }
  return ast;
}

}  // namespace strata::csg
