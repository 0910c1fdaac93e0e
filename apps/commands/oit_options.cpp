#include "apps/commands/oit_options.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "apps/session/file_conflicts.h"
#include "apps/session/option_values.h"

namespace strata::apps {
namespace {

constexpr std::string_view kAll = "all";
/// What is drawn without --technique.
constexpr std::string_view kUsual = "count-scan";

/// A number in [least, most].
Result<double> parse_share(std::string_view option, std::string_view text) {
  const auto number = parse_numbers(option, text, 1, 1);
  if (!number) return tl::unexpected(number.error());
  if (!(number->front() >= 0.0 && number->front() <= 1.0)) {
    return fail(ErrorCode::kUsage, "{} must be 0 to 1, got {}", option, text);
  }
  return number->front();
}

/// As parse_share(), but above 0.
Result<double> parse_part(std::string_view option, std::string_view text) {
  auto share = parse_share(option, text);
  if (!share || *share > 0.0) return share;
  return fail(ErrorCode::kUsage, "{} must be above 0 and at most 1, got {}", option, text);
}

/// `mlab:8` in names of files.
std::string file_word(std::string name) {
  std::replace(name.begin(), name.end(), ':', '-');
  return name;
}

Result<void> add_choice(std::string_view text, const transparency::Settings& settings,
                        OitCommand& command) {
  const auto chosen = transparency::parse_technique(text, settings);
  if (!chosen) {
    const std::string& what = chosen.error().message;
    return fail(ErrorCode::kUsage, "--technique: {}{}", what,
                what.ends_with('?') ? "" : "; strata oit --list lists all");
  }
  command.choices.push_back({std::string(text), *chosen});
  return {};
}

/// --technique a,b:8 or all; repeated.
Result<void> read_techniques(const OitWords& words, const transparency::Settings& settings,
                             OitCommand& command) {
  std::vector<std::string> texts = words.techniques;
  if (texts.empty()) texts.emplace_back(kUsual);
  for (const std::string& list : texts) {
    for (std::size_t begin = 0; begin <= list.size();) {
      const std::size_t end = std::min(list.find(',', begin), list.size());
      const std::string_view text = std::string_view(list).substr(begin, end - begin);
      begin = end + 1;
      if (text == kAll) {
        command.all = true;
        for (const transparency::Technique* technique : transparency::techniques()) {
          if (auto added = add_choice(technique->name, settings, command); !added) return added;
        }
        continue;
      }
      if (auto added = add_choice(text, settings, command); !added) return added;
    }
  }
  // What is asked for twice is drawn once.
  std::set<std::string> had;
  std::erase_if(command.choices, [&](const OitChoice& choice) {
    return !had.insert(file_word(choice.text)).second;
  });
  return {};
}

/// --media and --light.
Result<void> read_media_words(const OitWords& words, OitCommand& command) {
  command.media = words.media;
  if (!words.light.empty()) {
    const auto n = parse_numbers("--light", words.light, 3, 3);
    if (!n) return tl::unexpected(n.error());
    const glm::dvec3 light((*n)[0], (*n)[1], (*n)[2]);
    if (light == glm::dvec3(0.0)) {
      return fail(ErrorCode::kUsage, "--light must be a direction other than 0,0,0");
    }
    command.light = light;
  }
  if (command.media.empty()) {
    if (!command.light) return {};
    return fail(ErrorCode::kUsage, "--light needs --media");
  }
  if (!words.techniques.empty() || !words.report.empty()) {
    return fail(ErrorCode::kUsage,
                "--media draws by a way of its own and cannot be combined with {}",
                words.report.empty() ? "--technique" : "--report");
  }
  if (command.output.ends_with('/')) {
    return fail(ErrorCode::kUsage, "--media makes one picture; -o {} is a folder", command.output);
  }
  return {};
}

Result<void> check_outputs(const OitCommand& command) {
  const std::string& output = command.output;
  if (output.empty() && !command.json && command.report.empty()) {
    return fail(ErrorCode::kUsage,
                "nothing to do: give -o FILE.png, --report FOLDER, --json or --list");
  }
  if (output.empty() || writes_folder(command)) return {};
  if (is_stream(output)) {
    if (command.choices.size() == 1) return {};
    return fail(ErrorCode::kUsage, "{} techniques make as many pictures, but {} is a stream",
                command.choices.size(), output);
  }
  if (has_extension(output, ".png") || has_extension(output, ".exr")) return {};
  return fail(ErrorCode::kUsage, "{}: pictures are written as .png or .exr, or into a folder: {}/",
              output, output);
}

}  // namespace

bool writes_folder(const OitCommand& command) { return command.output.ends_with('/'); }

std::string picture_of(const OitCommand& command, const OitChoice& choice) {
  if (command.output.empty()) return {};
  const std::string word = file_word(choice.text);
  if (writes_folder(command)) return command.output + word + ".png";
  if (command.choices.size() == 1 && !command.all) return command.output;
  const std::filesystem::path name(command.output);
  return (name.parent_path() /
          fmt::format("{}-{}{}", name.stem().string(), word, name.extension().string()))
      .string();
}

Result<void> read_oit_options(const OitWords& words, OitCommand& command) {
  transparency::Settings settings;
  if (!words.opacity.empty()) {
    const auto opacity = parse_share("--opacity", words.opacity);
    if (!opacity) return tl::unexpected(opacity.error());
    command.opacity = static_cast<float>(*opacity);
  }
  if (!words.load.empty()) {
    const auto load = parse_part("--load", words.load);
    if (!load) return tl::unexpected(load.error());
    settings.load = *load;
  }
  if (!words.threshold.empty()) {
    const auto threshold = parse_part("--threshold", words.threshold);
    if (!threshold) return tl::unexpected(threshold.error());
    settings.opacity_threshold = *threshold;
  }
  if (!words.seed.empty()) {
    const auto seed = parse_integer("--seed", words.seed);
    if (!seed) return tl::unexpected(seed.error());
    if (*seed < 0) return fail(ErrorCode::kUsage, "--seed must be 0 or more, got {}", *seed);
    settings.seed = static_cast<std::uint64_t>(*seed);
  }
  command.fxaa = words.fxaa;
  command.report = words.report;
  if (auto read = read_media_words(words, command); !read) return read;
  if (auto read = read_techniques(words, settings, command); !read) return read;
  return check_outputs(command);
}

}  // namespace strata::apps
