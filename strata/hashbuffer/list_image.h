#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <stdexcept>
#include <utility>

#include "strata/core/depth_list.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/hashbuffer/record.h"

namespace strata {

/// The lists of a store as compressed sparse rows, rows in parallel: counts, running sum, items.
/// ErrorCode::kLimit if it cannot be allocated, kCancelled on request.
template <class Store>
[[nodiscard]] Result<LayeredDepthImage> make_list_image(const Store& store,
                                                        const Execution& execution) {
  const auto rows = static_cast<std::size_t>(store.height());
  const auto columns = static_cast<std::size_t>(store.width());
  try {
    LayeredDepthImage image;
    image.width = store.width();
    image.height = store.height();
    image.depth_limit = kRecordDepthMax + 1;
    image.offsets.resize(rows * columns + 1);
    parallel_for(execution, rows, [&](std::size_t row, int) {
      for (std::size_t column = 0; column < columns; ++column) {
        std::uint64_t count = 0;
        store.for_each(static_cast<int>(column), static_cast<int>(row),
                       [&](DepthItem) { ++count; });
        image.offsets[row * columns + column + 1] = count;
      }
    });
    for (std::size_t pixel = 0; pixel < rows * columns; ++pixel) {
      image.offsets[pixel + 1] += image.offsets[pixel];
    }
    if (!execution.stop.stop_requested()) {
      image.items.resize(image.offsets.back());
      parallel_for(execution, rows, [&](std::size_t row, int) {
        DepthItem* next = image.items.data() + image.offsets[row * columns];
        for (std::size_t column = 0; column < columns; ++column) {
          store.for_each(static_cast<int>(column), static_cast<int>(row),
                         [&](DepthItem item) { *next++ = item; });
        }
      });
    }
    if (execution.stop.stop_requested()) {
      return fail(ErrorCode::kCancelled, "depth lists: stopped on request");
    }
    return image;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "depth lists: no memory for the lists of {} x {} pixels",
                store.width(), store.height());
  } catch (const std::length_error&) {
    return fail(ErrorCode::kLimit, "depth lists: {} x {} pixels are more than memory can address",
                store.width(), store.height());
  }
}

}  // namespace strata
