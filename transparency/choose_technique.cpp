#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "core/did_you_mean.h"
#include "strata/transparency/techniques.h"

namespace strata::transparency {

Result<const Technique*> find_technique(std::string_view name) {
  std::string similar;
  std::vector<std::string_view> names;
  for (const Technique* technique : techniques()) {
    if (technique->name == name) return technique;
    names.push_back(technique->name);
    const bool alike = technique->name.find(name) != std::string_view::npos ||
                       name.find(technique->name) != std::string_view::npos;
    if (alike && !name.empty())
      similar += fmt::format("{}{}", similar.empty() ? "" : ", ", technique->name);
  }
  return fail(ErrorCode::kUsage, "there is no technique '{}'{}{}", name,
              similar.empty() ? did_you_mean(name, names) : "; similar names: ", similar);
}

Result<ChosenTechnique> parse_technique(std::string_view text, const Settings& settings) {
  ChosenTechnique chosen{nullptr, settings};
  std::string_view rest = text;
  const auto next = [&rest] {
    const std::size_t end = rest.find(':');
    const std::string_view word = rest.substr(0, end);
    rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
    return word;
  };
  const auto found = find_technique(next());
  if (!found) return tl::unexpected(found.error());
  chosen.technique = *found;
  while (!rest.empty()) {
    const std::string_view word = next();
    unsigned number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error == std::errc() && end == word.data() + word.size()) {
      if (chosen.technique->k_means.empty()) {
        return fail(ErrorCode::kUsage, "'{}': {} takes no number", text, chosen.technique->name);
      }
      if (number == 0) {
        return fail(ErrorCode::kUsage, "'{}': {} must be {} to {}, got 0", text,
                    chosen.technique->k_means, chosen.technique->least_k, chosen.technique->most_k);
      }
      chosen.settings.k = number;
    } else {
      chosen.settings.variant = word;
    }
  }
  auto checked = checked_settings(*chosen.technique, chosen.settings);
  if (!checked) return tl::unexpected(checked.error());
  chosen.settings = std::move(*checked);
  return chosen;
}

Difference difference(const Image& image, const Image& reference) {
  constexpr float kVisible = 0.5f / 255.0f;
  Difference result;
  double squares = 0.0;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const glm::vec4 by = glm::abs(image.pixels[i] - reference.pixels[i]);
    const float most = std::max({by.r, by.g, by.b, by.a});
    result.largest = std::max(result.largest, static_cast<double>(most));
    result.pixels += most > kVisible ? 1 : 0;
    for (int c = 0; c < 3; ++c) squares += static_cast<double>(by[c]) * static_cast<double>(by[c]);
  }
  const double mean =
      squares / (3.0 * static_cast<double>(std::max<std::size_t>(1, image.pixels.size())));
  result.psnr = mean > 0.0 ? -10.0 * std::log10(mean) : std::numeric_limits<double>::infinity();
  return result;
}

}  // namespace strata::transparency
