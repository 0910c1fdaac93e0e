#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/view/measure/probe.h"

// What a hand measures, one pick after the other, and what is drawn over the picture for it.

namespace strata::view {

enum class Tool : std::uint8_t { kNone, kDistance, kAngle, kRadius, kThickness, kSize };

/// One tool.
struct ToolFacts {
  Tool tool;
  std::string_view name;  ///< `distance`, as in scripts
  std::size_t picks;
  ProbeWish wish;
  std::string_view next[2];  ///< what to pick
};
/// @pre not Tool::kNone
[[nodiscard]] const ToolFacts& facts_of(Tool tool);

/// A measurement that is complete.
struct Measured {
  Tool tool = Tool::kNone;
  std::vector<Probe> at;
  std::string text;   ///< one line: what the script prints
  std::string label;  ///< what stands on the picture: the number alone
};

/// A number for people: six digits, and what is nothing beside `scale` is 0.
[[nodiscard]] std::string number(double value, double scale = 1.0);
/// A size that may be off by a millionth of `whole`: digits beyond that are no digits.
[[nodiscard]] double tidy(double value, double whole);
/// Three of them.
[[nodiscard]] std::string numbers(const glm::dvec3& value, double scale = 1.0);

/// @pre as many probes as the tool has picks, all of them hits
[[nodiscard]] Measured measured(Tool tool, std::vector<Probe> at);

/// All that is measured and shown.
class MeasureBoard {
 public:
  bool box = false, grid = false, scale_bar = false, ticks = false;

  [[nodiscard]] Tool tool() const { return tool_; }
  /// Begins anew with a tool, or with none.
  void take_up(Tool tool);
  /// Picks made for the measurement that is under way.
  [[nodiscard]] const std::vector<Probe>& pending() const { return pending_; }
  /// What to do next, in words; empty without a tool.
  [[nodiscard]] std::string advice() const;
  /// Takes the next pick. @return the measurement that it completes
  const Measured* take(Probe probe);
  /// The newest last.
  [[nodiscard]] const std::vector<Measured>& done() const { return done_; }
  /// Says something in place of the last measurement's text.
  void say(std::string text);
  void clear();
  /// The last pick met no face.
  [[nodiscard]] bool missed() const { return missed_; }
  /// The last pick was of a section's face, which has no size.
  [[nodiscard]] bool on_section() const { return on_section_; }
  /// How many measurements have been completed, cleared ones too.
  [[nodiscard]] std::uint64_t completed() const { return completed_; }
  /// Something is drawn that faces may hide, or the box.
  [[nodiscard]] bool shows() const {
    return box || grid || ticks || !done_.empty() || !pending_.empty();
  }

 private:
  static constexpr std::size_t kMost = 20;
  Tool tool_ = Tool::kNone;
  std::vector<Probe> pending_;
  std::vector<Measured> done_;
  bool missed_ = false, on_section_ = false;
  std::uint64_t completed_ = 0;
};

}  // namespace strata::view
