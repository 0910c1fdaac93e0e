// Lists that are stored in no order, front to back: the next fragment is found among all of the list.
// The text before it defines StrataPlace, strata_begin(pixel), strata_step(place, depth, payload).
struct StrataCursor {
  uint pixel, depth, payload;
  uint again;  // times that the last fragment is still to be given
  bool any;    // a fragment was given
};

StrataCursor strata_list(uint pixel) { return StrataCursor(pixel - store_first_pixel, 0u, 0u, 0u, false); }

bool strata_next(inout StrataCursor cursor, out uint depth, out uint payload) {
  if (cursor.again == 0u) {
    uint best_depth = 0xffffffffu, best_payload = 0xffffffffu, count = 0u, d, p;
    StrataPlace place = strata_begin(cursor.pixel);
    while (strata_step(place, d, p)) {
      if (cursor.any && (d < cursor.depth || (d == cursor.depth && p <= cursor.payload))) continue;
      if (d < best_depth || (d == best_depth && p < best_payload)) {
        best_depth = d;
        best_payload = p;
        count = 1u;
      } else if (d == best_depth && p == best_payload) {
        ++count;
      }
    }
    cursor.again = count;
    cursor.depth = best_depth;
    cursor.payload = best_payload;
    cursor.any = true;
  }
  depth = cursor.depth;
  payload = cursor.payload;
  if (cursor.again == 0u) return false;
  --cursor.again;
  return true;
}
