#include "hashbuffer/gl/prefix_sum.h"

#include "strata/gl/context.h"

namespace strata::glsl {
extern const gl::GlslPiece hashbuffer_gl_prefix_sum_comp;
}

namespace strata::gl {
namespace {
constexpr std::uint32_t kValuesOfGroup = 1024;
}

Result<std::uint32_t> PrefixSum::run(const Buffer& values, std::uint64_t count) {
  if (!sum_) {
    const GlslPiece piece = glsl::hashbuffer_gl_prefix_sum_comp;
    auto summing = Program::compute({&piece, 1}, {.extensions = {}, .defines = {{"SUM", "1"}}});
    if (!summing) return tl::unexpected(summing.error());
    auto adding = Program::compute({&piece, 1});
    if (!adding) return tl::unexpected(adding.error());
    sum_ = std::move(*summing);
    add_ = std::move(*adding);
  }
  if (count == 0) return 0u;
  if (auto done = sum(values, count, 0); !done) return tl::unexpected(done.error());
  std::uint32_t total = 0;
  // The topmost level is one group, whose sum is the total.
  std::size_t top = 0;
  for (std::uint64_t n = count; n > kValuesOfGroup; ++top) {
    n = (n + kValuesOfGroup - 1) / kValuesOfGroup;
  }
  levels_[top].download(std::span(&total, 1));
  if (auto checked = check_errors("prefix sum"); !checked) return tl::unexpected(checked.error());
  return total;
}

Result<void> PrefixSum::sum(const Buffer& values, std::uint64_t count, std::size_t level) {
  const Groups groups = groups_for(count, kValuesOfGroup);
  const std::uint64_t sums = (count + kValuesOfGroup - 1) / kValuesOfGroup;
  // 1024^4 values at once: `values` may be one of them, which must stay where it is.
  if (levels_.size() <= level) levels_.resize(4);
  // Groups beyond the last value write their sums too.
  const std::uint64_t written = std::uint64_t{groups.x} * groups.y;
  if (auto room = levels_[level].reserve(written * 4); !room) return room;
  const auto run_level = [&](const Program& program) {
    values.bind(0);
    levels_[level].bind(1);
    program.set("count", static_cast<std::uint32_t>(count));
    storage_barrier();
    program.dispatch(groups.x, groups.y);
    storage_barrier();
  };
  run_level(sum_);
  if (sums == 1) return {};
  if (auto above = sum(levels_[level], sums, level + 1); !above) return above;
  run_level(add_);
  return {};
}

std::uint64_t PrefixSum::memory_bytes() const {
  std::uint64_t bytes = 0;
  for (const Buffer& buffer : levels_) bytes += buffer.bytes();
  return bytes;
}

}  // namespace strata::gl
