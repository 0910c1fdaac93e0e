// Sorts each pixel's list by (depth, payload): short ones by insertion, in registers up to REGISTERS items, long ones
// by a heap. One invocation a pixel; every loop is bounded by the list's length. Lists of more than longest_here items
// are noted for sort_long.comp.glsl.
#define REGISTERS 8
layout(local_size_x = 64) in;
layout(std430, binding = 8) readonly buffer ends_block { uint ends[]; };
#ifdef STORE_PAYLOADS
layout(std430, binding = 9) buffer items_block { uvec2 items[]; };
#define Item uvec2
bool before(Item a, Item b) { return a.y < b.y || (a.y == b.y && a.x < b.x); }
#define LAST_ITEM uvec2(0xffffffffu)
#else
layout(std430, binding = 9) buffer items_block { uint items[]; };
#define Item uint
bool before(Item a, Item b) { return a < b; }
#define LAST_ITEM 0xffffffffu
#endif
layout(std430, binding = 0) buffer long_block {
  uint long_count;    // lists noted
  uint long_longest;  // items of the longest of them
  uint long_pixels[];
};
uniform uint pixels;
uniform uint longest_here;

void sort_in_registers(uint begin, uint count) {
  Item held[REGISTERS];
  for (uint i = 0u; i < uint(REGISTERS); ++i) held[i] = i < count ? items[begin + i] : LAST_ITEM;
  // Odd-even transposition: indices are known to the compiler, so the array stays in registers.
  for (uint round = 0u; round < uint(REGISTERS); ++round) {
    if (round >= count) break;
    for (uint i = 0u; i + 1u < uint(REGISTERS); i += 2u) {
      if (before(held[i + 1u], held[i])) { Item t = held[i]; held[i] = held[i + 1u]; held[i + 1u] = t; }
    }
    for (uint i = 1u; i + 1u < uint(REGISTERS); i += 2u) {
      if (before(held[i + 1u], held[i])) { Item t = held[i]; held[i] = held[i + 1u]; held[i + 1u] = t; }
    }
  }
  for (uint i = 0u; i < uint(REGISTERS); ++i) if (i < count) items[begin + i] = held[i];
}

void sort_by_insertion(uint begin, uint count) {
  for (uint next = 1u; next < count; ++next) {
    Item item = items[begin + next];
    uint place = next;
    for (; place > 0u; --place) {
      Item other = items[begin + place - 1u];
      if (!before(item, other)) break;
      items[begin + place] = other;
    }
    if (place != next) items[begin + place] = item;
  }
}

// Lets `item` sink from the place `at` of a heap of `count` items, the last one on top.
void sink(uint begin, uint count, uint at, Item item) {
  for (uint level = 0u; level < 32u; ++level) {
    uint child = 2u * at + 1u;
    if (child >= count) break;
    Item larger = items[begin + child];
    if (child + 1u < count) {
      Item right = items[begin + child + 1u];
      if (before(larger, right)) { larger = right; ++child; }
    }
    if (!before(item, larger)) break;
    items[begin + at] = larger;
    at = child;
  }
  items[begin + at] = item;
}

void sort_by_heap(uint begin, uint count) {
  for (uint i = count / 2u; i > 0u; --i) sink(begin, count, i - 1u, items[begin + i - 1u]);
  for (uint last = count - 1u; last > 0u; --last) {
    Item item = items[begin + last];
    items[begin + last] = items[begin];
    sink(begin, last, 0u, item);
  }
}

void main() {
  uint pixel = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (pixel >= pixels) return;
  uint begin = pixel == 0u ? 0u : ends[pixel - 1u];
  uint end = ends[pixel];
  uint count = end - begin;
  if (count <= 1u || end < begin) return;
  if (count == 2u) {
    Item first = items[begin], second = items[begin + 1u];
    if (before(second, first)) { items[begin] = second; items[begin + 1u] = first; }
  } else if (count <= uint(REGISTERS)) {
    sort_in_registers(begin, count);
  } else if (count <= 32u) {
    sort_by_insertion(begin, count);
  } else if (count <= longest_here) {
    sort_by_heap(begin, count);
  } else {
    long_pixels[atomicAdd(long_count, 1u)] = pixel;
    atomicMax(long_longest, count);
  }
}
