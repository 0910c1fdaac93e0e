#include "transparency/media/particle_file.h"

#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

namespace strata::transparency {
namespace {

constexpr std::array<std::string_view, 10> kColumns{"x",
                                                    "y",
                                                    "z",
                                                    "radius",
                                                    "red extinction",
                                                    "green extinction",
                                                    "blue extinction",
                                                    "red albedo",
                                                    "green albedo",
                                                    "blue albedo"};

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

bool parse(std::string_view text, double& value) {
  text = trimmed(text);
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  return failure == std::errc{} && end == text.data() + text.size() && std::isfinite(value);
}

/// What is wrong with the value of a column; empty: nothing.
std::string_view fault_of(std::size_t column, double value) {
  if (column == 3 && !(value > 0.0)) return "must be above 0";
  if (column < 4 && !(std::abs(value) <= kFarthest)) return "must be at most 1e15";
  if (column >= 4 && column < 7 && !(value >= 0.0 && value <= kMostExtinction)) {
    return "must be 0 to 1e6";
  }
  if (column >= 7 && !(value >= 0.0 && value <= 1.0)) return "must be 0 to 1";
  return {};
}

struct Line {
  std::array<double, kColumns.size()> values{};
  std::size_t count = 0;
  bool numbers = false;  ///< the first column is a number
};

Result<Line> parse_line(const std::string& path, std::size_t number, std::string_view text) {
  Line line;
  for (bool more = true; more;) {
    const std::size_t comma = text.find(',');
    more = comma != std::string_view::npos;
    const std::string_view cell = text.substr(0, comma);
    if (more) text.remove_prefix(comma + 1);
    if (line.count == kColumns.size()) {
      return fail(ErrorCode::kInput, "{}:{}: a line must have 4 or {} columns, got more", path,
                  number, kColumns.size());
    }
    double& value = line.values[line.count];
    if (!parse(cell, value)) {
      if (number == 1 && !line.numbers) return line;
      // The file may be of another kind: its text is not shown.
      return fail(ErrorCode::kInput, "{}:{}: the {} must be a number", path, number,
                  kColumns[line.count]);
    }
    line.numbers = true;
    const std::string_view fault = fault_of(line.count, value);
    if (!fault.empty()) {
      return fail(ErrorCode::kInput, "{}:{}: the {} {}, got {}", path, number, kColumns[line.count],
                  fault, value);
    }
    ++line.count;
  }
  if (line.count == 4 || line.count == kColumns.size()) return line;
  return fail(ErrorCode::kInput, "{}:{}: a line must have 4 or {} columns, got {}", path, number,
              kColumns.size(), line.count);
}

}  // namespace

Result<void> read_particles(const std::string& path, const Particle& common,
                            std::vector<Particle>& particles) {
  std::error_code failure;
  if (std::filesystem::exists(path, failure) && !std::filesystem::is_regular_file(path, failure)) {
    return fail(ErrorCode::kInput, "{}: particles are read from regular files", path);
  }
  std::ifstream in(path, std::ios::binary);
  if (!in) return fail(ErrorCode::kInput, "{}: the file cannot be opened", path);
  std::string text;
  for (std::size_t number = 1; std::getline(in, text); ++number) {
    if (trimmed(text).empty()) continue;
    const auto line = parse_line(path, number, text);
    if (!line) return tl::unexpected(line.error());
    if (!line->numbers) continue;
    if (particles.size() >= kMostParticles) {
      return fail(ErrorCode::kInput, "{}:{}: there are more than {} particles", path, number,
                  kMostParticles);
    }
    const auto& v = line->values;
    Particle& particle = particles.emplace_back(common);
    particle.centre = {v[0], v[1], v[2]};
    particle.radius = v[3];
    if (line->count == 4) continue;
    particle.extinction = {v[4], v[5], v[6]};
    particle.albedo = {v[7], v[8], v[9]};
  }
  if (in.bad()) return fail(ErrorCode::kInput, "{}: reading failed", path);
  return {};
}

}  // namespace strata::transparency
