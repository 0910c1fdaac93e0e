// Sorts triangles out: those that cover no pixel centre are dropped, small ones are listed, large
// ones are set up and cut into blocks. One thread a triangle.

layout(std430, binding = 2) writeonly buffer RasterSmallList { uint raster_small[]; };
layout(std430, binding = 3) writeonly buffer RasterLargeList { RasterLarge raster_large[]; };
layout(std430, binding = 4) writeonly buffer RasterBlocks { uvec2 raster_blocks[]; };
layout(std430, binding = 5) buffer RasterCounters {
  uint raster_small_count;
  uint raster_large_count;
  uint raster_block_count;
};
uniform uint raster_triangle_count;
uniform uint raster_large_capacity;
uniform uint raster_block_capacity;

// Whether an edge is negative on all pixels of a block of the given width and height less one.
bool raster_misses(RasterEdge e, int u, int v, int width, int height) {
  int64_t best = e.at + int64_t(e.along_u) * int64_t(e.along_u > 0 ? u + width : u) +
                 int64_t(e.along_v) * int64_t(e.along_v > 0 ? v + height : v);
  return best < 0;
}

void main() {
  uint triangle = raster_thread();
  if (triangle >= raster_triangle_count) return;
  ivec3 p0, p1, p2;
  raster_load(triangle, p0, p1, p2);
  ivec4 box = raster_box(p0, p1, p2);
  int width = box.z - box.x, height = box.w - box.y;
  if (width <= 0 || height <= 0) return;
  RasterTriangle t;
  if (!raster_setup(p0, p1, p2, raster_axes.z, t)) return;
  RasterEdge e0 = raster_edge(t.p0, t.p1, box.x, box.y);
  RasterEdge e1 = raster_edge(t.p1, t.p2, box.x, box.y);
  RasterEdge e2 = raster_edge(t.p2, t.p0, box.x, box.y);
  if (raster_misses(e0, 0, 0, width - 1, height - 1) ||
      raster_misses(e1, 0, 0, width - 1, height - 1) ||
      raster_misses(e2, 0, 0, width - 1, height - 1)) {
    return;
  }
  // A long triangle that the clip makes small stays large: its numbers do not fit 32 bits.
  ivec3 extent = max(max(t.p0, t.p1), t.p2) - min(min(t.p0, t.p1), t.p2);
  if (width <= kRasterSmallPixels && height <= kRasterSmallPixels &&
      width * height <= kRasterSmallPixels && max(extent.x, extent.y) <= (1 << 15)) {
    raster_small[atomicAdd(raster_small_count, 1u)] = triangle;
    return;
  }
  uint slot = atomicAdd(raster_large_count, 1u);
  if (slot >= raster_large_capacity) return;
  RasterFraction base = raster_depth_at(t, box.x, box.y);
  RasterFraction by_u = raster_depth_along_u(t), by_v = raster_depth_along_v(t);
  RasterLarge large;
  large.box = box;
  large.area = unpackUint2x32(uint64_t(t.area));
  large.remainder = unpackUint2x32(base.remainder);
  large.remainder_u = unpackUint2x32(by_u.remainder);
  large.remainder_v = unpackUint2x32(by_v.remainder);
  large.quotient = uint(t.p0.z) + base.quotient;
  large.quotient_u = by_u.quotient;
  large.quotient_v = by_v.quotient;
  large.payload = raster_payload(t, triangle);
  large.edge_along_u = ivec4(e0.along_u, e1.along_u, e2.along_u, 0);
  large.edge_along_v = ivec4(e0.along_v, e1.along_v, e2.along_v, 0);
  large.edge0 = unpackUint2x32(uint64_t(e0.at));
  large.edge1 = unpackUint2x32(uint64_t(e1.at));
  large.edge2 = unpackUint2x32(uint64_t(e2.at));
  large.edge_unused = uvec2(0u);
  raster_large[slot] = large;
  for (int v = 0; v < height; v += kRasterBlockSide) {
    int last_v = min(kRasterBlockSide, height - v) - 1;
    for (int u = 0; u < width; u += kRasterBlockSide) {
      int last_u = min(kRasterBlockSide, width - u) - 1;
      if (raster_misses(e0, u, v, last_u, last_v) || raster_misses(e1, u, v, last_u, last_v) ||
          raster_misses(e2, u, v, last_u, last_v)) {
        continue;
      }
      uint at = atomicAdd(raster_block_count, 1u);
      if (at < raster_block_capacity) raster_blocks[at] = uvec2(slot, uint(v) << 16 | uint(u));
    }
  }
}
