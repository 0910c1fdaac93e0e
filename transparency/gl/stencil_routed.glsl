// A fragment's payload and depth go to the one sample that the stencil test lets through.
layout(location = 0) out uvec2 routed_fragment;

void strata_insert(uint pixel, uint depth, uint payload) { routed_fragment = uvec2(payload, min(depth, 0xffffffu)); }
