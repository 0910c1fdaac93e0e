// A fixed number of slots a pixel, store_age_limit of them, in the order of arrival.
layout(std430, binding = 8) buffer store_counts_block { uint store_counts[]; };
layout(std430, binding = 9) buffer store_slots_block { uvec2 store_slots[]; };
layout(std430, binding = 10) buffer store_most_block { uint store_most; };

#ifndef STORE_READ
void strata_insert(uint pixel, uint depth, uint payload) {
  if (!store_takes(pixel)) return;
  uint n = atomicAdd(store_counts[pixel], 1u);
  if (n < store_age_limit) {
    store_slots[pixel * store_age_limit + n] = uvec2(payload, min(depth, 0xffffffu));
  } else {
    atomicMax(store_most, n + 1u);
  }
}
#else
struct StrataPlace {
  uint at, end;
};
StrataPlace strata_begin(uint pixel) {
  uint first = pixel * store_age_limit;
  return StrataPlace(first, first + min(store_counts[pixel], store_age_limit));
}
bool strata_step(inout StrataPlace place, out uint depth, out uint payload) {
  if (place.at >= place.end) return false;
  uvec2 slot = store_slots[place.at++];
  depth = slot.y;
  payload = slot.x;
  return true;
}
#endif
