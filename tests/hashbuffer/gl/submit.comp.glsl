// Inserts the fragments [first, end) of a buffer: (pixel, depth, payload, unused).
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer fragments_block { uvec4 fragments[]; };
uniform uint first, end;

void main() {
#ifdef STORE_SERIAL
  // The store says that one invocation at a time may insert: one does all.
  if (gl_GlobalInvocationID != uvec3(0u)) return;
  for (uint i = first; i < end; ++i) strata_insert(fragments[i].x, fragments[i].y, fragments[i].z);
#else
  uint i = first + (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (i < end) strata_insert(fragments[i].x, fragments[i].y, fragments[i].z);
#endif
}
