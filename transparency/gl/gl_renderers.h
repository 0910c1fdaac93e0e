#pragma once

#include "transparency/gl/gl_frame.h"

// Makers of the renderers of gl_techniques.cpp. Private to transparency/gl/.

namespace strata::transparency {

using GlMaker = Result<std::unique_ptr<GlRenderer>>;

// Whole lists: gl_list_techniques.cpp.
GlMaker make_gl_hash(const gl::Context& context, const Settings& settings);
GlMaker make_gl_hash_culled(const gl::Context& context, const Settings& settings);
GlMaker make_gl_scan(const gl::Context& context, const Settings& settings);
GlMaker make_gl_fixed(const gl::Context& context, const Settings& settings);
GlMaker make_gl_linked(const gl::Context& context, const Settings& settings);
GlMaker make_gl_paged(const gl::Context& context, const Settings& settings);
// Many passes: gl_peeling.cpp.
GlMaker make_gl_peeling(const gl::Context& context, const Settings& settings);
GlMaker make_gl_dual_peeling(const gl::Context& context, const Settings& settings);
// Sums: gl_sums.cpp.
GlMaker make_gl_weighted_sum(const gl::Context& context, const Settings& settings);
GlMaker make_gl_weighted_average(const gl::Context& context, const Settings& settings);
// Rows in the order of triangles: gl_ordered_rows.cpp.
GlMaker make_gl_mlab(const gl::Context& context, const Settings& settings);
GlMaker make_gl_hybrid(const gl::Context& context, const Settings& settings);
GlMaker make_gl_kbuffer(const gl::Context& context, const Settings& settings);
// Samples chosen by the stencil: gl_stencil_routing.cpp.
GlMaker make_gl_stencil_routed(const gl::Context& context, const Settings& settings);

}  // namespace strata::transparency
