#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "csg/gl/tile_programs.h"
#include "strata/gl/buffer.h"
#include "strata/gl/context.h"
#include "strata/gl/shader_program.h"
#include "strata/hashbuffer/gl/store.h"

// What the walks of lists share on this side. Private to csg/gl/.

namespace strata::csg {

/// Compiled walks: one for each kind of store and size of tiles that was asked for.
class WalkPrograms {
 public:
  /// @param main the shader behind walk_common.glsl @param rounds of loops, one for each node of a
  /// tile and each step of a climb, that an invocation may take where the driver has few
  /// (workaround loop-rounds)
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

}  // namespace strata::csg
