#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "mesh/text/input_bytes.h"
#include "strata/core/execution.h"
#include "strata/mesh/mesh_file.h"

namespace strata::detail {

/// The vertices of a file that its soup has not: those that are not finite.
class DroppedVertices {
 public:
  std::vector<std::uint32_t> all;  ///< increasing

  /// The index in the soup of a vertex that is there.
  [[nodiscard]] std::uint32_t index_of(std::uint32_t vertex) const {
    if (all.empty()) return vertex;
    const auto before = std::lower_bound(all.begin(), all.end(), vertex) - all.begin();
    return vertex - static_cast<std::uint32_t>(before);
  }
  /// Removes what belongs to them.
  template <class T>
  void remove_from(std::vector<T>& of_vertices) const {
    std::size_t kept = 0, next = 0;
    if (all.empty()) return;
    for (std::size_t v = 0; v < of_vertices.size(); ++v) {
      const bool dropped = next < all.size() && all[next] == v;
      next += dropped ? 1 : 0;
      if (!dropped) of_vertices[kept++] = of_vertices[v];
    }
    of_vertices.resize(kept);
  }
};

/// The arguments of a reader. The text ends in a readable zero byte.
struct ReaderInput {
  std::string_view text;
  const std::string& name;
  const MeshReadOptions& options;
  const Execution& execution;
  std::size_t skipped = 0;  ///< bytes before the text: a byte order mark
  std::string path{};       ///< of the file; empty where there is none
  DroppedVertices* dropped =
      nullptr;                       ///< finish_mesh() fills it; not null where attributes are read
  const InputBytes* file = nullptr;  ///< whose bytes the text is; null: they come from elsewhere

  /// A piece of the text has been read.
  void forget(const char* begin, const char* end) const {
    if (file != nullptr) file->forget(begin, end);
  }
};

/// Reports a reader's progress and checks for a stop request. Any thread may call it, but only the
/// thread that made it reports.
class ReadWatch {
 public:
  explicit ReadWatch(const ReaderInput& input)
      : input_(input), thread_(std::this_thread::get_id()) {}

  /// @param done  share of the file, in [0, 1] @return false after a stop request
  bool at(double done) {
    constexpr double kOfAll = 0.9;  // finish_mesh() takes the rest
    if (input_.execution.progress && std::this_thread::get_id() == thread_ && done >= told_) {
      told_ = done;
      input_.execution.progress(kOfAll * done);
    }
    return !input_.execution.stop.stop_requested();
  }
  /// The same for loops: acts on every 2^14th call. @param place  position in the text
  bool step(std::uint64_t index, const char* place) {
    constexpr std::uint64_t kRarely = (1 << 14) - 1;
    return (index & kRarely) != kRarely || at(static_cast<double>(place - input_.text.data()) /
                                              static_cast<double>(input_.text.size()));
  }

 private:
  const ReaderInput& input_;
  std::thread::id thread_;
  double told_ = 0;  // last share reported
};

/// Whether a soup of this size exceeds the memory limit of the execution.
[[nodiscard]] inline bool exceeds_limit(const Execution& execution, std::uint64_t vertices,
                                        std::uint64_t triangles) {
  return execution.memory_limit != 0 &&
         vertices * sizeof(glm::dvec3) + triangles * sizeof(glm::uvec3) > execution.memory_limit;
}

}  // namespace strata::detail
