#include "apps/view/files/parameter_sets.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include "core/atomic_file.h"
#include "core/printable.h"

#ifdef STRATA_HAVE_JSON
#include <nlohmann/json.hpp>
#endif

namespace strata::view {

std::string parameter_file_of(const std::string& program) {
  return std::filesystem::path(program).replace_extension(".json").string();
}

Result<ParameterValues> values_of_set(const ParameterSets& sets, const std::string& name,
                                      const std::vector<Parameter>& parameters) {
  const auto set = sets.find(name);
  if (set == sets.end()) {
    return fail(ErrorCode::kInput, "there is no parameter set '{}'", printable(name, 100));
  }
  ParameterValues values;
  for (const Parameter& parameter : parameters) {
    const auto text = set->second.find(parameter.name);
    if (text == set->second.end()) continue;
    auto value = parse_value(parameter, text->second);
    if (!value) {
      return fail(ErrorCode::kInput, "the parameter set '{}': {}", printable(name, 100),
                  value.error().message);
    }
    if (*value != parameter.value) values.emplace(parameter.name, *std::move(value));
  }
  return values;
}

#ifdef STRATA_HAVE_JSON

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSets = "parameterSets";
constexpr std::uintmax_t kMostBytes = std::uintmax_t{64} << 20;

Result<Json> read_json(const std::string& path) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(path, error);
  std::ifstream in(path, std::ios::binary);
  if (error || !in) return fail(ErrorCode::kInput, "{}: the file cannot be read", path);
  if (bytes > kMostBytes) {
    return fail(ErrorCode::kLimit, "{}: parameter sets may have 64 MiB, the file has {} bytes",
                path, bytes);
  }
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  // Deeper nesting than any set has would take the parser's stack.
  int depth = 0, deepest = 0;
  for (const char c : text) {
    if (c == '[' || c == '{') deepest = std::max(deepest, ++depth);
    if (c == ']' || c == '}') --depth;
  }
  Json json = deepest > 100 ? Json() : Json::parse(text, nullptr, false);
  const auto sets = json.is_object() ? json.find(kSets) : json.end();
  if (!json.is_object() || sets == json.end() || !sets->is_object()) {
    return fail(ErrorCode::kInput, "{}: the file holds no {}, as OpenSCAD's customizer writes them",
                path, kSets);
  }
  return json;
}

}  // namespace

Result<ParameterSets> read_parameter_sets(const std::string& path) {
  const auto json = read_json(path);
  if (!json) return tl::unexpected(json.error());
  ParameterSets sets;
  for (const auto& [name, members] : json->at(kSets).items()) {
    if (!members.is_object()) {
      return fail(ErrorCode::kInput, "{}: the parameter set '{}' is no object", path,
                  printable(name, 100));
    }
    auto& set = sets[name];
    for (const auto& [key, value] : members.items()) {
      set[key] = value.is_string() ? value.template get<std::string>()
                                   : value.dump(-1, ' ', false, Json::error_handler_t::replace);
    }
  }
  return sets;
}

Result<void> write_parameter_set(const std::string& path, const std::string& name,
                                 const std::vector<Parameter>& parameters,
                                 const ParameterValues& values) {
  Json json = {{kSets, Json::object()}, {"fileFormatVersion", "1"}};
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored)) {
    auto read = read_json(path);
    if (!read) return tl::unexpected(read.error());
    json = *std::move(read);
  }
  Json set = Json::object();
  for (const Parameter& parameter : parameters) {
    const auto changed = values.find(parameter.name);
    set[parameter.name] = text_of(changed == values.end() ? parameter.value : changed->second);
  }
  json[kSets][name] = std::move(set);
  const std::string text = json.dump(4, ' ', false, Json::error_handler_t::replace) + "\n";
  return write_file(path, text.data(), text.size());
}

#else

Result<ParameterSets> read_parameter_sets(const std::string& path) {
  return fail(ErrorCode::kUsage,
              "{}: this build reads no parameter sets: nlohmann-json3-dev is missing", path);
}

Result<void> write_parameter_set(const std::string& path, const std::string&,
                                 const std::vector<Parameter>&, const ParameterValues&) {
  return fail(ErrorCode::kUsage,
              "{}: this build writes no parameter sets: nlohmann-json3-dev is missing", path);
}

#endif

}  // namespace strata::view
