// Lists of the count/scan store, front to back.
layout(std430, binding = 8) readonly buffer store_ends_block { uint store_ends[]; };
#ifdef STORE_PAYLOADS
layout(std430, binding = 9) readonly buffer store_items_block { uvec2 store_items[]; };
#else
layout(std430, binding = 9) readonly buffer store_items_block { uint store_items[]; };
#endif

struct StrataCursor {
  uint item;  // next
  uint end;
};

StrataCursor strata_list(uint pixel) {
  pixel -= store_first_pixel;
  return StrataCursor(pixel == 0u ? 0u : store_ends[pixel - 1u], store_ends[pixel]);
}

bool strata_next(inout StrataCursor cursor, out uint depth, out uint payload) {
  if (cursor.item >= cursor.end) {
    depth = 0u;
    payload = 0u;
    return false;
  }
#ifdef STORE_PAYLOADS
  uvec2 item = store_items[cursor.item];
  depth = item.y;
  payload = item.x;
#else
  depth = store_items[cursor.item];
  payload = 0u;
#endif
  ++cursor.item;
  return true;
}
