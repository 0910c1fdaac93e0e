#include "csg/gl/walk_programs.h"

#include <algorithm>
#include <bit>
#include <string>
#include <utility>

namespace strata::glsl {
extern const gl::GlslPiece csg_gl_walk_common;
}  // namespace strata::glsl

namespace strata::csg {

Result<const gl::Program*> WalkPrograms::get(const gl::Store& store, const TilePrograms& programs) {
  // Powers of two, and not small ones: a shader takes longer to compile than its arrays to clear.
  const std::uint32_t words = std::bit_ceil(std::max(4u, (programs.most_slots + 31) / 32));
  const std::uint32_t nodes = std::bit_ceil(std::max(8u, programs.most_nodes));
  const gl::StoreGlsl read = store.glsl_read();
  for (const Walk& walk : walks_) {
    if (walk.words == words && walk.nodes == nodes && walk.read == read) return &walk.program;
  }
  gl::GlslSettings settings = read.settings;
  settings.defines.emplace_back("WALK_WORDS", std::to_string(words));
  settings.defines.emplace_back("WALK_NODES", std::to_string(nodes));
  settings.defines.emplace_back("WALK_MOST_ROUNDS", most_rounds_);
  const gl::GlslPiece pieces[] = {read.piece(), glsl::csg_gl_walk_common, main_};
  auto program = gl::Program::compute(pieces, settings);
  if (!program) return tl::unexpected(program.error());
  walks_.push_back({words, nodes, read, *std::move(program)});
  return &walks_.back().program;
}

Result<void> WalkTables::upload(const TilePrograms& programs) {
  if (auto done = tiles_.assign(std::span<const WalkTile>(programs.tiles)); !done) return done;
  if (auto done = slots_.assign(std::span<const std::uint32_t>(programs.slots)); !done) {
    return done;
  }
  return nodes_.assign(std::span<const std::uint32_t>(programs.nodes));
}

void WalkTables::bind() const {
  tiles_.bind(1);
  slots_.bind(2);
  nodes_.bind(3);
}

}  // namespace strata::csg
