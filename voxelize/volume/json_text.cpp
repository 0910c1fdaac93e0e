#include "voxelize/volume/json_text.h"

#include <algorithm>
#include <charconv>
#include <utility>

namespace strata {
namespace {

class JsonParser {
 public:
  JsonParser(std::string_view text, const std::string& path) : text_(text), path_(path) {}

  Result<JsonValue> whole() {
    JsonValue value;
    if (!parse(value, 0) || (skip(), at_ != text_.size())) {
      const auto line =
          1 + std::count(text_.begin(),
                         text_.begin() + static_cast<std::ptrdiff_t>(std::min(at_, text_.size())),
                         '\n');
      return fail(ErrorCode::kInput, "{}:{}: no JSON here", path_, line);
    }
    return value;
  }

 private:
  static constexpr int kDeepest = 32;

  void skip() {
    while (at_ < text_.size() &&
           std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos) {
      ++at_;
    }
  }
  bool take(std::string_view word) {
    skip();
    if (!text_.substr(at_).starts_with(word)) return false;
    at_ += word.size();
    return true;
  }
  bool parse_text(std::string& to) {
    if (!take("\"")) return false;
    while (at_ < text_.size() && text_[at_] != '"') {
      if (text_[at_] == '\\' && at_ + 1 < text_.size()) ++at_;  // what is escaped stands for itself
      to += text_[at_++];
    }
    return at_++ < text_.size();
  }
  bool parse_list(JsonValue& value, int depth) {
    value.kind = JsonValue::kList;
    if (take("]")) return true;
    do {
      if (!parse(value.items.emplace_back(), depth + 1)) return false;
    } while (take(","));
    return take("]");
  }
  bool parse_object(JsonValue& value, int depth) {
    value.kind = JsonValue::kObject;
    if (take("}")) return true;
    do {
      std::string name;
      JsonValue member;
      if (!parse_text(name) || !take(":") || !parse(member, depth + 1)) return false;
      value.members.insert_or_assign(std::move(name), std::move(member));
    } while (take(","));
    return take("}");
  }
  bool parse(JsonValue& value, int depth) {
    if (depth > kDeepest) return false;
    if (take("{")) return parse_object(value, depth);
    if (take("[")) return parse_list(value, depth);
    if (take("null")) return true;
    if (take("true") || take("false")) {
      value.kind = JsonValue::kBool;
      value.truth = text_[at_ - 2] == 'u';  // tr-u-e
      return true;
    }
    if (at_ < text_.size() && text_[at_] == '"') {
      value.kind = JsonValue::kText;
      return parse_text(value.text);
    }
    value.kind = JsonValue::kNumber;
    const auto [rest, error] =
        std::from_chars(text_.data() + at_, text_.data() + text_.size(), value.number);
    at_ = static_cast<std::size_t>(rest - text_.data());
    return error == std::errc();
  }

  std::string_view text_;
  const std::string& path_;
  std::size_t at_ = 0;
};

}  // namespace

std::optional<std::vector<double>> JsonValue::numbers(std::string_view name,
                                                      std::size_t count) const {
  const JsonValue* list = find(name);
  if (list == nullptr || list->items.size() != count) return std::nullopt;
  std::vector<double> values;
  for (const JsonValue& item : list->items) {
    if (item.kind != kNumber) return std::nullopt;
    values.push_back(item.number);
  }
  return values;
}

Result<JsonValue> parse_json(std::string_view text, const std::string& path) {
  return JsonParser(text, path).whole();
}

}  // namespace strata
