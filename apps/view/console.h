#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/view/files/editor.h"
#include "apps/view/scene/document.h"

namespace strata::view {

/// One thing that was said while a scene was read or drawn.
struct ConsoleLine {
  enum class Kind : std::uint8_t { kError, kWarning, kEcho, kNote };
  Kind kind = Kind::kNote;
  std::string text;
  std::optional<TextPlace> place;  ///< that it is about, if there is such a file
};

/// Adds an error, a line for each that it has.
void add_error(std::vector<ConsoleLine>& lines, const std::string& text);

/// What a scene says: its warnings, and the lines that its program prints.
void add_model(std::vector<ConsoleLine>& lines, const Model& model);

/// All of it as text, a line each.
[[nodiscard]] std::string text_of(const std::vector<ConsoleLine>& lines);

/// How many there are of a kind.
[[nodiscard]] std::size_t count_of(const std::vector<ConsoleLine>& lines, ConsoleLine::Kind kind);

}  // namespace strata::view
