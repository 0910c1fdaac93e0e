// A stage of a bitonic sort of long lists, all at once: a row of work groups a list, an invocation a pair of places.
// After: K. E. Batcher, Sorting Networks and Their Applications, 1968, in the form whose comparators all point one way,
// so that places beyond the end of a list, which would hold the largest item, need not be there.
layout(local_size_x = 64) in;
layout(std430, binding = 8) readonly buffer ends_block { uint ends[]; };
#ifdef STORE_PAYLOADS
layout(std430, binding = 9) buffer items_block { uvec2 items[]; };
#define Item uvec2
bool before(Item a, Item b) { return a.y < b.y || (a.y == b.y && a.x < b.x); }
#else
layout(std430, binding = 9) buffer items_block { uint items[]; };
#define Item uint
bool before(Item a, Item b) { return a < b; }
#endif
layout(std430, binding = 0) readonly buffer long_block {
  uint long_count;
  uint long_longest;
  uint long_pixels[];
};
uniform uint first_list;  // of this dispatch
uniform uint mask;        // what places of a pair differ in

void main() {
  uint pixel = long_pixels[first_list + gl_WorkGroupID.y];
  uint begin = pixel == 0u ? 0u : ends[pixel - 1u];
  uint count = ends[pixel] - begin;
  uint low = gl_WorkGroupID.x * 64u + gl_LocalInvocationID.x;
  uint high = low ^ mask;
  if (high <= low || high >= count) return;
  Item a = items[begin + low], b = items[begin + high];
  if (before(b, a)) {
    items[begin + low] = b;
    items[begin + high] = a;
  }
}
