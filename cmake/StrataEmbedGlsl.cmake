# Run by strata_embed_glsl: writes the shader text INPUT as the C++ source OUTPUT.
file(READ "${INPUT}" text)
if(text MATCHES "\\)glsl\"")
  message(FATAL_ERROR "${INPUT}: the text ends the C++ string it is put in")
endif()
file(CONFIGURE OUTPUT "${OUTPUT}" @ONLY CONTENT [==[
// Made from @PATH@ by cmake/StrataEmbedGlsl.cmake.
#include "strata/gl/shader_program.h"
namespace strata::glsl {
extern const gl::GlslPiece @SYMBOL@;
const gl::GlslPiece @SYMBOL@{"@PATH@", R"glsl(@text@)glsl"};
}  // namespace strata::glsl
]==])
