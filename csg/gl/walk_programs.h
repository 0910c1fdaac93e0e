#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "csg/gl/tile_programs.h"
#include "gl/buffer.h"
#include "gl/context.h"
#include "gl/program.h"
#include "hashbuffer/gl/store.h"

// What the walks of lists share on this side. Private to csg/gl/.

namespace strata::csg {

/// Compiled walks: one for each kind of store and size of tiles that was asked for.
class WalkPrograms {
 public:
  /// @param main the shader behind walk_common.glsl @param rounds of loops that an invocation may
  /// spend on climbing nodes, where the driver has few (workaround loop-rounds)
  WalkPrograms(const gl::GlslPiece& main, const gl::Info& info, const char* rounds)
      : main_(main), most_rounds_(info.works_around("loop-rounds") ? rounds : "1000000u") {}

  /// @return kInternal where the driver refuses the shader
  [[nodiscard]] Result<const gl::Program*> get(const gl::Store& store,
                                               const TilePrograms& programs);

 private:
  struct Walk {
    std::uint32_t words, nodes;
    gl::StoreGlsl read;
    gl::Program program;
  };
  gl::GlslPiece main_;
  const char* most_rounds_;
  std::vector<Walk> walks_;
};

/// The tables of TilePrograms on the GPU, at the bindings 1 to 3.
class WalkTables {
 public:
  [[nodiscard]] Result<void> upload(const TilePrograms& programs);
  void bind() const;

 private:
  gl::Buffer tiles_, slots_, nodes_;
};

/// Makes room for `data` and uploads it.
template <class T>
[[nodiscard]] Result<void> upload_to(gl::Buffer& buffer, std::span<const T> data) {
  if (auto room = buffer.reserve(data.size_bytes()); !room) return room;
  buffer.upload(data);
  return {};
}

}  // namespace strata::csg
