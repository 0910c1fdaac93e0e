#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "mesh/no_vertex.h"
#include "mesh/text/reader_input.h"
#include "mesh/text/text_scanner.h"
#include "strata/core/result.h"

namespace strata::detail {

/// The reason why the reading of a text's pieces ended early, if it did.
struct ChunksEnd {
  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::size_t error_offset = kNone;  ///< position in the text
  std::string error{};
  bool over_limit = false;
  std::uint32_t most_vertices = kMaxVertices;  ///< the most that the reader can hold

  [[nodiscard]] bool early() const { return over_limit || error_offset != kNone; }
  /// @return kCancelled, kLimit, or kInput naming the line
  [[nodiscard]] Result<void> status(const ReaderInput& input) const {
    if (input.execution.stop.stop_requested()) {
      return fail(ErrorCode::kCancelled, "{}: reading was stopped", input.name);
    }
    if (over_limit) {
      return fail(ErrorCode::kLimit, "{}: the mesh needs more than the memory limit or {} vertices",
                  input.name, most_vertices);
    }
    if (error_offset != kNone) {
      return fail(ErrorCode::kInput, "{}:{}: {}", input.name,
                  line_of(input.text, input.text.data() + error_offset), error);
    }
    return {};
  }
};

/// Parses pieces of a text on all threads and appends the results in the order of the text.
/// @tparam Chunk  the result of one piece; clear() resets it for reuse
/// @param cuts  piece i is [cuts[i], cuts[i + 1])
/// @param parse  parse(begin, end, Chunk&), called by several threads at once
/// @param append  append(Chunk&), called by one thread at a time. When it sets `end`, the remaining
/// pieces are skipped
template <class Chunk, class Parse, class Append>
void read_chunks(const ReaderInput& input, std::span<const char* const> cuts, const ChunksEnd& end,
                 Parse&& parse, Append&& append) {
  std::mutex mutex;
  std::atomic<bool> over = false;
  std::vector<std::unique_ptr<Chunk>> spare, ready(cuts.size() - 1);
  std::size_t next = 0;
  ReadWatch watch(input);
  parallel_for(input.execution, ready.size(), [&](std::size_t index, int) {
    if (over.load(std::memory_order_relaxed)) return;
    std::unique_ptr<Chunk> chunk;
    {
      const std::lock_guard lock(mutex);
      if (!spare.empty()) {
        chunk = std::move(spare.back());
        spare.pop_back();
      }
    }
    if (!chunk) chunk = std::make_unique<Chunk>();
    parse(cuts[index], cuts[index + 1], *chunk);
    input.forget(cuts[index], cuts[index + 1]);
    const std::lock_guard lock(mutex);
    ready[index] = std::move(chunk);
    for (; next < ready.size() && ready[next] && !over; ++next) {
      append(*ready[next]);
      over = end.early();
      ready[next]->clear();
      spare.push_back(std::move(ready[next]));
    }
    (void)watch.at(static_cast<double>(next) / static_cast<double>(ready.size()));
  });
}

}  // namespace strata::detail
