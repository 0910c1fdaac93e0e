#pragma once

#include <span>
#include <string>
#include <string_view>

namespace strata {

/// The known word that somebody meant who wrote `word`: the one with the fewest letters left out,
/// put in, replaced or exchanged with their neighbours, about one in three at most; or the only one
/// that begins with `word`. Small and capital letters are the same. Empty: there is none.
[[nodiscard]] std::string_view nearest_word(std::string_view word,
                                            std::span<const std::string_view> known);

/// `; did you mean voxelize?` for the end of a message, or nothing.
[[nodiscard]] std::string did_you_mean(std::string_view word,
                                       std::span<const std::string_view> known);

}  // namespace strata
