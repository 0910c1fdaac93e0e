// The second pass of a 64-bit table without 64-bit atomics. The keys are in their final places, so a fragment finds
// the cells that hold its own key: of k fragments of a pixel with equal depth, k cells at rising ages. There payloads
// propose in the same way as records do, by 32-bit maxima of their complements: the loser goes on to the next of these
// cells. So ties end in the order of payloads, as in the 64-bit table, whatever the schedule was. The complement 0
// needs no place: cells that nothing else takes hold it already.
layout(std430, binding = 8) readonly buffer store_table_block { uint store_table[]; };
layout(std430, binding = 9) readonly buffer store_offsets_block { uint store_offsets[]; };
layout(std430, binding = 10) buffer store_counts_block { uint store_counts[]; };
layout(std430, binding = 11) buffer store_payloads_block { uint store_payloads[]; };

void strata_insert(uint pixel, uint depth, uint payload) {
  if (!store_takes(pixel)) return;
  if (store_counts[4u * store_band] != 0u) return;  // keys are missing, the frame will be built again
  uint nearness = 0xffffffu - min(depth, 0xffffffu);
  uint value = ~payload;
  if (value == 0u) return;
  for (uint age = 1u; age <= store_age_limit; ++age) {
    uint cell = pixel + store_offsets[age];
    if (cell >= store_room) cell -= store_room;
    uint key = store_table[cell];
    uint found_age = key >> 24;
    if (found_age < age) break;
    if (found_age > age) continue;  // another pixel's
    uint found_nearness = key & 0xffffffu;
    if (found_nearness > nearness) continue;
    if (found_nearness < nearness) break;
    uint found = atomicMax(store_payloads[cell], value);
    if (found == 0u) return;
    if (found < value) value = found;
  }
  // Only geometry that differs from that of the first pass gets here.
  atomicAdd(store_counts[4u * store_band + 1u], 1u);
}
