#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "strata/core/execution.h"

namespace strata {

/// Writes the bytes of a row; called by any thread, and for some rows twice.
using MakeRow = std::function<void(std::size_t row, std::uint8_t* bytes)>;

/// The zlib stream (RFC 1950) of the rows of a picture. Looks for what pictures of faces are made
/// of: runs of one pixel, and what stands in the row above; and for four bytes that came before
/// where a copy began, or in its first 24 bytes. All threads compress, several rows at a time; a
/// stop request is not heard. Throws std::bad_alloc. Private to Strata.
/// @param count  of rows, at least one, of `row_bytes` bytes
/// @param pixel_bytes  how far apart the bytes of neighbours are: 1 to 4
[[nodiscard]] std::vector<std::uint8_t> deflate_rows(std::size_t count, std::size_t row_bytes,
                                                     std::size_t pixel_bytes,
                                                     const Execution& execution,
                                                     const MakeRow& make_row);

}  // namespace strata
