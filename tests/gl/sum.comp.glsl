layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer input_block { uint values[]; };
layout(std430, binding = 1) buffer output_block { uint total; };
uniform uint count;

void main() {
  uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (i < count) atomicAdd(total, values[i] * SCALE);
}
