#include "apps/session/option_values.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "core/did_you_mean.h"

namespace strata::apps {
namespace {

template <class T>
bool read_all(std::string_view text, T& value) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

Result<std::int64_t> parse_integer(std::string_view option, std::string_view text) {
  std::int64_t value = 0;
  if (!read_all(text, value)) {
    return fail(ErrorCode::kUsage, "{} must be a whole number, got '{}'", option, text);
  }
  return value;
}

Result<std::vector<double>> parse_numbers(std::string_view option, std::string_view text,
                                          std::size_t least, std::size_t most) {
  std::vector<double> values;
  for (std::string_view rest = text;;) {
    const std::size_t comma = rest.find(',');
    double value = 0;
    if (!read_all(rest.substr(0, comma), value) || !std::isfinite(value)) {
      return fail(ErrorCode::kUsage, "{} must be {}, got '{}'", option,
                  most == 1 ? std::string("a number")
                  : least == most
                      ? fmt::format("{} numbers separated by commas", least)
                      : fmt::format("{} or {} numbers separated by commas", least, most),
                  text);
    }
    values.push_back(value);
    if (comma == std::string_view::npos) break;
    rest.remove_prefix(comma + 1);
  }
  if (values.size() != least && values.size() != most) {
    return fail(ErrorCode::kUsage, "{} must be {}{} number{}, got {}: '{}'", option,
                least == most ? "" : fmt::format("{} or ", least), most, most == 1 ? "" : "s",
                values.size(), text);
  }
  return values;
}

Result<double> parse_seconds(std::string_view option, std::string_view text) {
  const auto seconds = parse_numbers(option, text, 1, 1);
  if (!seconds) return tl::unexpected(seconds.error());
  if (seconds->front() > 0) return seconds->front();
  return fail(ErrorCode::kUsage, "{} must be seconds above 0, got {}", option, text);
}

Result<std::uint64_t> parse_bytes(std::string_view option, std::string_view text) {
  std::string_view digits = text;
  // 512M, 512MB and 512MiB are the same here.
  if (digits.ends_with('B') || digits.ends_with('b')) digits.remove_suffix(1);
  if (digits.ends_with('i')) digits.remove_suffix(1);
  double unit = 1;
  constexpr std::string_view kUnits = "KMGT";
  if (!digits.empty()) {
    const char last = digits.back();
    const auto place = kUnits.find(last >= 'a' ? static_cast<char>(last - 'a' + 'A') : last);
    if (place != std::string_view::npos) {
      unit = std::ldexp(1.0, 10 * (static_cast<int>(place) + 1));
      digits.remove_suffix(1);
    }
  }
  double value = 0;
  if (!read_all(digits, value) || !(value > 0) || !(value * unit >= 1) || value * unit > 1e18) {
    return fail(ErrorCode::kUsage,
                "{} must be a number of bytes above 0, such as 512M or 2G, got '{}'", option, text);
  }
  return static_cast<std::uint64_t>(value * unit);
}

Result<void> check_stream_format(std::span<const std::string> files, bool given,
                                 std::string_view formats) {
  if (given || std::find(files.begin(), files.end(), "-") == files.end()) return {};
  return fail(ErrorCode::kUsage, "standard input needs --input-format: {}", formats);
}

std::string empty_value(std::span<const std::string> arguments) {
  for (std::size_t i = 0; i < arguments.size() && arguments[i] != "--"; ++i) {
    const std::string& word = arguments[i];
    if (word.starts_with("--") && word.find('=') + 1 == word.size()) {
      return fmt::format("{} has an empty value", word.substr(0, word.size() - 1));
    }
    const bool takes_next = word.size() > 1 && word[0] == '-' && word.find('=') == word.npos;
    if (takes_next && i + 1 < arguments.size() && arguments[i + 1].empty()) {
      return fmt::format("{} has an empty value", word);
    }
  }
  return {};
}

namespace {

/// What other programs call a choice.
constexpr std::pair<std::string_view, std::string_view> kOtherWords[] = {
    {"gpu", "gl"}, {"opengl", "gl"}, {"cuda", "gl"}, {"vulkan", "gl"}};

std::string meant_choice(std::string_view text, std::span<const std::string_view> names) {
  for (const auto& [other, word] : kOtherWords) {
    if (text == other && std::find(names.begin(), names.end(), word) != names.end()) {
      return fmt::format("; did you mean {}?", word);
    }
  }
  return did_you_mean(text, names);
}

}  // namespace

tl::unexpected<Error> no_such_choice(std::string_view option, std::string_view text,
                                     std::span<const std::string_view> names) {
  std::string list;
  for (std::size_t i = 0; i < names.size(); ++i) {
    list += i == 0 ? "" : i + 1 == names.size() ? " or " : ", ";
    list += names[i];
  }
  return fail(ErrorCode::kUsage, "{} must be {}, got '{}'{}", option, list, text,
              meant_choice(text, names));
}

}  // namespace strata::apps
