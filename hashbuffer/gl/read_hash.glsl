// Lists of a hash store, front to back. STORE_WORDS is 2 for 64-bit words, with STORE_PAYLOADS they lie in two tables.
#if STORE_WORDS == 2 && !defined(STORE_PAYLOADS)
layout(std430, binding = 8) readonly buffer store_table_block { uvec2 store_table[]; };
#else
layout(std430, binding = 8) readonly buffer store_table_block { uint store_table[]; };
#endif
layout(std430, binding = 9) readonly buffer store_offsets_block { uint store_offsets[]; };
#ifdef STORE_PAYLOADS
layout(std430, binding = 11) readonly buffer store_payloads_block { uint store_payloads[]; };
#endif

struct StrataCursor {
  uint pixel;  // of the band
  uint age;    // to be looked at next
};

StrataCursor strata_list(uint pixel) { return StrataCursor(pixel - store_first_pixel, 1u); }

bool strata_next(inout StrataCursor cursor, out uint depth, out uint payload) {
  for (; cursor.age <= store_age_limit; ++cursor.age) {
    uint cell = cursor.pixel + store_offsets[cursor.age];
    if (cell >= store_room) cell -= store_room;
#if STORE_WORDS == 2 && !defined(STORE_PAYLOADS)
    uvec2 word = store_table[cell];
    uint key = word.y;
#else
    uint key = store_table[cell];
#endif
    uint age = key >> 24;
    // A later record of this pixel would have been compared here and left something of this age.
    if (age < cursor.age) break;
    if (age > cursor.age) continue;
    depth = 0xffffffu - (key & 0xffffffu);
#if STORE_WORDS == 1
    payload = 0u;
#elif defined(STORE_PAYLOADS)
    payload = ~store_payloads[cell];
#else
    payload = ~word.x;
#endif
    ++cursor.age;
    return true;
  }
  cursor.age = store_age_limit + 1u;
  depth = 0u;
  payload = 0u;
  return false;
}
