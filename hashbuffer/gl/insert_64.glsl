// The table law of strata/hashbuffer/table_law.h for 64-bit words [age:8 | nearness:24 | ~payload:32]; see insert_32.glsl.
layout(std430, binding = 8) STORE_COHERENT buffer store_table_block { uint64_t store_table[]; };
layout(std430, binding = 9) readonly buffer store_offsets_block { uint store_offsets[]; };
layout(std430, binding = 10) buffer store_counts_block { uint store_counts[]; };

#ifdef STORE_SERIAL
uint64_t store_max(inout uint64_t cell, uint64_t value) {
  uint64_t found = cell;
  cell = max(found, value);
  return found;
}
#else
#define store_max atomicMax
#endif

#ifdef STORE_CULL
// Early culling: a fragment is dropped once the fragments of its pixel that were met in front of it let less than
// STORE_CULL of the light through. A record counts only if it lies strictly behind the last one that counted and
// strictly in front of the one in flight (strata/hashbuffer/hash_buffer.h says why).
layout(std430, binding = 12) readonly buffer store_faces_block { vec4 store_faces[]; };
const uint64_t kStoreRank = 0x00fffffffffffffful;
float store_seen;
uint64_t store_last;

void store_count(uint64_t met, uint64_t in_flight) {
  uint64_t rank = met & kStoreRank;
  if (rank >= store_last || rank <= (in_flight & kStoreRank)) return;
  store_last = rank;
  uint payload = ~unpackUint2x32(met).x;
  store_seen *= 1.0 - store_faces[(payload & 0x7fffffffu) << 1 | payload >> 31].a;
}
void store_begin_count() {
  store_seen = 1.0;
  store_last = ~0ul;
}
#endif

uint store_steps = 0u;  // see insert_32.glsl
const uint kStoreMostSteps = STORE_MOST_STEPS;

void strata_insert(uint pixel, uint depth, uint payload) {
  if (!store_takes(pixel)) return;
  uint age = 1u;
  uint64_t record = packUint2x32(uvec2(~payload, 0x1ffffffu - min(depth, 0xffffffu)));
#ifdef STORE_CULL
  store_begin_count();
#endif
  for (; store_steps < kStoreMostSteps; ++store_steps) {
    uint cell = pixel + store_offsets[age];
    if (cell >= store_room) cell -= store_room;
#ifdef STORE_READ_FIRST
    uint64_t found = store_table[cell];
    if (found < record) found = store_max(store_table[cell], record);
#else
    uint64_t found = store_max(store_table[cell], record);
#endif
    if (found < record) {
      if (found == 0ul) return;
#ifdef STORE_CULL
      uint64_t stored = record;
#endif
      record = found;
      uint found_age = unpackUint2x32(found).y >> 24;
#ifdef STORE_CULL
      if (found_age != age) store_begin_count(); else store_count(stored, record);
#endif
      if (found_age != age) {
        age = found_age;
        uint back = store_offsets[age];
        pixel = cell >= back ? cell - back : cell + (store_room - back);
      }
    }
#ifdef STORE_CULL
    else if (unpackUint2x32(found).y >> 24 == age) store_count(found, record);
    if (store_seen < STORE_CULL) return;
#endif
    if (age >= store_age_limit) break;
    ++age;
    record += packUint2x32(uvec2(0u, 0x1000000u));
  }
  atomicAdd(store_counts[4u * store_band], 1u);
}
