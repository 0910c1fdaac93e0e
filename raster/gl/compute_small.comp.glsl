// Small triangles, one thread each: box and extents are such that all but the set-up fits 32 bits.

layout(std430, binding = 2) readonly buffer RasterSmallList { uint raster_small[]; };
uniform uint raster_small_count;

void main() {
  uint index = raster_thread();
  if (index >= raster_small_count) return;
  uint triangle = raster_small[index];
  ivec3 p0, p1, p2;
  raster_load(triangle, p0, p1, p2);
  ivec4 box = raster_box(p0, p1, p2);
  RasterTriangle t;
  raster_setup(p0, p1, p2, raster_axes.z, t);
  RasterEdge edge0 = raster_edge(t.p0, t.p1, box.x, box.y);
  RasterEdge edge1 = raster_edge(t.p1, t.p2, box.x, box.y);
  RasterEdge edge2 = raster_edge(t.p2, t.p0, box.x, box.y);
  ivec3 row_edge = ivec3(int(edge0.at), int(edge1.at), int(edge2.at));
  ivec3 along_u = ivec3(edge0.along_u, edge1.along_u, edge2.along_u);
  ivec3 along_v = ivec3(edge0.along_v, edge1.along_v, edge2.along_v);
  RasterFraction base = raster_depth_at(t, box.x, box.y);
  uint area = uint(t.area), quotient_u = 0u, quotient_v = 0u, remainder_u = 0u, remainder_v = 0u;
  if (box.z - box.x > 1) {  // divisions are most of the work of the smallest
    RasterFraction by_u = raster_depth_along_u(t);
    quotient_u = by_u.quotient;
    remainder_u = uint(by_u.remainder);
  }
  if (box.w - box.y > 1) {
    RasterFraction by_v = raster_depth_along_v(t);
    quotient_v = by_v.quotient;
    remainder_v = uint(by_v.remainder);
  }
  uint row_quotient = base.quotient, row_remainder = uint(base.remainder);
  uint payload = raster_payload(t, triangle);
  for (int v = box.y; v < box.w; ++v) {
    ivec3 edge = row_edge;
    uint quotient = row_quotient, remainder = row_remainder;
    for (int u = box.x; u < box.z; ++u) {
      if ((edge.x | edge.y | edge.z) >= 0) {
        strata_insert(raster_pixel(u, v), raster_depth(t.p0.z, quotient, raster_depth_limit),
                      payload);
      }
      edge += along_u;
      quotient += quotient_u;
      remainder += remainder_u;
      if (remainder >= area) {
        remainder -= area;
        ++quotient;
      }
    }
    row_edge += along_v;
    row_quotient += quotient_v;
    row_remainder += remainder_v;
    if (row_remainder >= area) {
      row_remainder -= area;
      ++row_quotient;
    }
  }
}
