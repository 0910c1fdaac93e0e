// Empties a table of `words` words a cell, and counts the cells that were not empty: the load of the frame that goes.
layout(local_size_x = 256) in;
layout(std430, binding = 0) buffer table_block { uint table[]; };
layout(std430, binding = 1) buffer held_block { uint held; };
uniform uint cells;
shared uint group_held;

void main() {
  if (gl_LocalInvocationID.x == 0u) group_held = 0u;
  barrier();
  uint mine = 0u;
  uint first = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 2048u + gl_LocalInvocationID.x;
  for (uint i = 0u; i < 8u; ++i) {
    uint cell = first + 256u * i;
    if (cell < cells) {
#if WORDS == 2
      // The age lies in the high word, and is not 0 where the cell is taken.
      if (table[2u * cell + 1u] != 0u) ++mine;
      table[2u * cell] = 0u;
      table[2u * cell + 1u] = 0u;
#else
      if (table[cell] != 0u) ++mine;
      table[cell] = 0u;
#endif
    }
  }
  if (mine != 0u) atomicAdd(group_held, mine);
  barrier();
  if (gl_LocalInvocationID.x == 0u && group_held != 0u) atomicAdd(held, group_held);
}
