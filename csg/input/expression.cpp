#include "csg/input/expression.h"

#include <algorithm>
#include <filesystem>
#include <optional>

#include "core/did_you_mean.h"

namespace strata::csg {
namespace {

bool is_name_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '.' || static_cast<unsigned char>(c) >= 0x80;
}

class Parser {
 public:
  Parser(std::string_view text, const std::vector<std::string>& files)
      : text_(text), files_(files) {
    for (const std::string& file : files) {
      stems_.push_back(std::filesystem::path(file).stem().string());
    }
  }

  Result<Expression> run() {
    const auto whole = sum();
    if (!error_.empty()) return tl::unexpected(Error{ErrorCode::kUsage, error_});
    skip_blanks();
    if (whole && at_ < text_.size()) {
      complain(text_[at_] == ')' ? std::string("no parenthesis is open here")
                                 : "an operator is expected here: + | & * - ^" + by_position());
    }
    if (!error_.empty()) return tl::unexpected(Error{ErrorCode::kUsage, error_});
    return std::move(out_);
  }

 private:
  using Kind = Expression::Kind;
  using Operand = std::optional<std::size_t>;  ///< a node; none after an error

  /// What files whose names are no words here are called: "; a is my part.stl".
  [[nodiscard]] std::string by_position() const {
    std::string text;
    for (std::size_t i = 0; i < std::min<std::size_t>(stems_.size(), 26); ++i) {
      if (!stems_[i].empty() && std::all_of(stems_[i].begin(), stems_[i].end(), is_name_character))
        continue;
      text += fmt::format("{} {} is {}", text.empty() ? "; by position," : ",",
                          static_cast<char>('a' + i), files_[i]);
    }
    return text;
  }
  void complain(std::string_view what) {
    if (!error_.empty()) return;
    // The place in characters, not bytes.
    const auto column =
        std::count_if(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at_),
                      [](char c) { return (c & '\xc0') != '\x80'; });
    error_ = fmt::format("the expression: {}\n  {}\n  {:>{}}", what, text_, '^', column + 1);
  }
  void skip_blanks() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\n')) {
      ++at_;
    }
  }
  /// The next character that is no blank; 0 at the end.
  char peek() {
    skip_blanks();
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  std::size_t add(Expression::Node node) {
    out_.nodes.push_back(node);
    return out_.nodes.size() - 1;
  }

  Operand sum() {
    Operand left = product();
    while (left) {
      const char c = peek();
      if (c != '+' && c != '|' && c != '-' && c != '^') break;
      ++at_;
      const Operand right = product();
      if (!right) return right;
      const Kind kind = c == '-' ? Kind::kDifference : c == '^' ? Kind::kExclusive : Kind::kUnion;
      left = add({kind, 0, *left, *right});
    }
    return left;
  }
  Operand product() {
    Operand left = operand();
    while (left && (peek() == '*' || peek() == '&')) {
      ++at_;
      const Operand right = operand();
      if (!right) return right;
      left = add({Kind::kIntersection, 0, *left, *right});
    }
    return left;
  }
  Operand operand() {
    const char c = peek();
    if (c == '(') {
      if (++depth_ > kMaxExpressionDepth) {
        complain(fmt::format("more than {} parentheses are open here", kMaxExpressionDepth));
        return {};
      }
      ++at_;
      const Operand inner = sum();
      if (!inner) return inner;
      if (peek() != ')') {
        complain(at_ < text_.size() ? "an operator or a closing parenthesis is expected here"
                                    : "a closing parenthesis is missing here");
        return {};
      }
      ++at_, --depth_;
      return inner;
    }
    if (is_name_character(c)) return name();
    complain(std::string(c == '\0' ? "a name or an opening parenthesis is missing here"
                                   : "a name or an opening parenthesis is expected here") +
             by_position());
    return {};
  }
  Operand name() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && is_name_character(text_[at_])) ++at_;
    const std::string_view word = text_.substr(begin, at_ - begin);
    const auto found = std::find(stems_.begin(), stems_.end(), word);
    const auto many = std::count(stems_.begin(), stems_.end(), word);
    const bool letter = word.size() == 1 && word[0] >= 'a' && word[0] <= 'z';
    if (many == 1) {
      return add({Kind::kInput, static_cast<std::size_t>(found - stems_.begin()), 0, 0});
    }
    if (letter && static_cast<std::size_t>(word[0] - 'a') < stems_.size()) {
      return add({Kind::kInput, static_cast<std::size_t>(word[0] - 'a'), 0, 0});
    }
    at_ = begin;
    const std::vector<std::string_view> stems(stems_.begin(), stems_.end());
    if (many > 1) {
      complain(fmt::format("{} files are called {}: name one by its letter, a for the first", many,
                           word));
    } else if (letter) {
      complain(fmt::format("{} would be file {}, but there {} only {}", word, word[0] - 'a' + 1,
                           stems_.size() == 1 ? "is" : "are", stems_.size()));
    } else {
      complain(
          fmt::format("no file is called {}{}{}", word, did_you_mean(word, stems), by_position()));
    }
    return {};
  }

  std::string_view text_;
  const std::vector<std::string>& files_;
  std::vector<std::string> stems_;
  std::size_t at_ = 0;
  int depth_ = 0;
  std::string error_;
  Expression out_;
};

}  // namespace

Result<Expression> parse_expression(std::string_view text, const std::vector<std::string>& files) {
  return Parser(text, files).run();
}

}  // namespace strata::csg
