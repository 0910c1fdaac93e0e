// A linked list a pixel: J. C. Yang, J. Hensley, H. Gruen, N. Thibieroz, "Real-time concurrent linked list construction
// on the GPU" (2010). With STORE_PAGE > 1 a node is a page of so many fragments: C. Crassin, "Linked lists of fragment
// pages" (2010). The counter goes on counting where the nodes run out; then the frame is drawn once more.
layout(std430, binding = 8) coherent buffer store_heads_block { uint store_heads[]; };  // the last node + 1; 0: none
layout(std430, binding = 9) coherent buffer store_nodes_block { uint store_nodes[]; };
layout(std430, binding = 10) coherent buffer store_counter_block {
  uint store_counter;  // nodes that were asked for
  uint store_missed;   // fragments that found no way to a locked pixel: the frame is drawn once more
};
#if STORE_PAGE > 1
layout(std430, binding = 11) coherent buffer store_filled_block { uint store_filled[]; };  // [locked:1 | fragments:31]
#endif

// A node: the next one + 1, then pairs of payload and depth.
const uint kStoreNodeWords = 1u + 2u * uint(STORE_PAGE);

#ifndef STORE_READ
#if STORE_PAGE > 1
void strata_insert(uint pixel, uint depth, uint payload) {
  if (!store_takes(pixel)) return;
  // The holder of a lock gives it back in the same round, so that threads that run in step cannot wait for ever.
  bool done = false;
  for (uint round = 0u; !done && round < 4096u; ++round) {
    uint count = atomicOr(store_filled[pixel], 0x80000000u);
    if ((count & 0x80000000u) != 0u) continue;
    memoryBarrierBuffer();
    uint place = count % uint(STORE_PAGE);
    uint node = store_heads[pixel];
    if (place == 0u) {
      uint made = atomicAdd(store_counter, 1u) + 1u;
      if (made <= store_room) {
        store_nodes[(made - 1u) * kStoreNodeWords] = node;
        store_heads[pixel] = made;
        node = made;
      } else {
        node = 0u;
      }
    } else if (store_counter > store_room) {
      node = 0u;  // its page may be missing
    }
    if (node != 0u) {
      uint at = (node - 1u) * kStoreNodeWords + 1u + 2u * place;
      store_nodes[at] = payload;
      store_nodes[at + 1u] = min(depth, 0xffffffu);
    }
    memoryBarrierBuffer();
    atomicExchange(store_filled[pixel], count + 1u);
    done = true;
  }
  if (!done) atomicAdd(store_missed, 1u);
}
#else
void strata_insert(uint pixel, uint depth, uint payload) {
  if (!store_takes(pixel)) return;
  uint node = atomicAdd(store_counter, 1u) + 1u;
  if (node > store_room) return;
  uint at = (node - 1u) * kStoreNodeWords;
  store_nodes[at] = atomicExchange(store_heads[pixel], node);
  store_nodes[at + 1u] = payload;
  store_nodes[at + 2u] = min(depth, 0xffffffu);
}
#endif
#else
struct StrataPlace {
  uint node, left;  // fragments of the node that are still to be given
};
StrataPlace strata_begin(uint pixel) {
#if STORE_PAGE > 1
  uint count = store_filled[pixel];
  return StrataPlace(store_heads[pixel], count == 0u ? 0u : (count - 1u) % uint(STORE_PAGE) + 1u);
#else
  return StrataPlace(store_heads[pixel], 1u);
#endif
}
bool strata_step(inout StrataPlace place, out uint depth, out uint payload) {
  if (place.node == 0u) return false;
  uint at = (place.node - 1u) * kStoreNodeWords;
  --place.left;
  payload = store_nodes[at + 1u + 2u * place.left];
  depth = store_nodes[at + 2u + 2u * place.left];
  if (place.left == 0u) {
    place.node = store_nodes[at];
    place.left = uint(STORE_PAGE);
  }
  return true;
}
#endif
