// The table law of strata/hashbuffer/table_law.h for 32-bit words [age:8 | nearness:24], after Lefebvre, Hornus, Lasram,
// "HA-Buffer", 2013. With STORE_PAYLOADS only the keys of a 64-bit table: its payloads follow in a second pass
// (insert_payload.glsl), which can find each key again since the table is unique.
layout(std430, binding = 8) STORE_COHERENT buffer store_table_block { uint store_table[]; };
layout(std430, binding = 9) readonly buffer store_offsets_block { uint store_offsets[]; };
layout(std430, binding = 10) buffer store_counts_block { uint store_counts[]; };

// Steps of this invocation so far, and the most of them (HashStore chooses). Chains of evictions may be that long in
// tables that are far too full, and so may the lists of all pixels of a thread together, where it inserts many: what is
// left over is counted as not stored, and the table grows as long as that can help.
uint store_steps = 0u;
const uint kStoreMostSteps = STORE_MOST_STEPS;

void strata_insert(uint pixel, uint depth, uint payload) {
  if (!store_takes(pixel)) return;
  uint age = 1u;
  uint record = 0x1ffffffu - min(depth, 0xffffffu);
  for (; store_steps < kStoreMostSteps; ++store_steps) {
    uint cell = pixel + store_offsets[age];
    if (cell >= store_room) cell -= store_room;
#ifdef STORE_READ_FIRST
    // Cells only grow: what is not larger than an old value is not larger than the new one.
    uint found = store_table[cell];
    if (found < record) found = atomicMax(store_table[cell], record);
#else
    uint found = atomicMax(store_table[cell], record);
#endif
    // Equality falls through to the next age: two equal records are two fragments.
    if (found < record) {
      if (found == 0u) return;
      record = found;
      uint found_age = found >> 24;
      if (found_age != age) {  // evicted from another pixel
        age = found_age;
        uint back = store_offsets[age];
        pixel = cell >= back ? cell - back : cell + (store_room - back);
      }
    }
    if (age >= store_age_limit) break;
    ++age;
    record += 0x1000000u;
  }
  atomicAdd(store_counts[4u * store_band], 1u);
}
