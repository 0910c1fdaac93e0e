// One level of an exclusive prefix sum: SUM turns blocks of 1024 values into their prefix sums and writes the sum of
// each block; otherwise the prefix sums of the blocks are added to their values. Sums that leave 32 bits stay at the
// largest number, so that the total tells it.
layout(local_size_x = 256) in;
layout(std430, binding = 0) buffer values_block { uint values[]; };
layout(std430, binding = 1) buffer sums_block { uint sums[]; };
uniform uint count;

uint add(uint a, uint b) { return a > 0xffffffffu - b ? 0xffffffffu : a + b; }

#ifdef SUM
shared uint partial[2][256];
#endif

void main() {
  uint block = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  uint local = gl_LocalInvocationID.x;
  uint first = block * 1024u + local * 4u;
#ifdef SUM
  uint mine[4];
  uint sum = 0u;
  for (uint i = 0u; i < 4u; ++i) {
    mine[i] = first + i < count ? values[first + i] : 0u;
    sum = add(sum, mine[i]);
  }
  uint from = 0u;
  partial[0][local] = sum;
  barrier();
  for (uint reach = 1u; reach < 256u; reach *= 2u) {
    uint total = partial[from][local];
    if (local >= reach) total = add(total, partial[from][local - reach]);
    partial[1u - from][local] = total;
    from = 1u - from;
    barrier();
  }
  uint before = local == 0u ? 0u : partial[from][local - 1u];
  for (uint i = 0u; i < 4u; ++i) {
    if (first + i < count) values[first + i] = before;
    before = add(before, mine[i]);
  }
  if (local == 255u) sums[block] = partial[from][255];
#else
  uint before = sums[block];
  for (uint i = 0u; i < 4u; ++i) {
    if (first + i < count) values[first + i] = add(values[first + i], before);
  }
#endif
}
