// Blocks of large triangles, one group each. The group's threads lie side by side in rows of 8, 16
// or 32 pixels, as the block is wide, and go down together.

layout(std430, binding = 3) readonly buffer RasterLargeList { RasterLarge raster_large[]; };
layout(std430, binding = 4) readonly buffer RasterBlocks { uvec2 raster_blocks[]; };
uniform uint raster_block_count;

// Narrows the steps [begin, end) to those where an edge that is `at` at step 0 may not be negative.
// In single precision, with a step more on each side: each step is asked exactly afterwards.
void raster_narrow(int64_t at, int64_t down, inout int begin, inout int end) {
  if (at < 0) {
    if (down <= 0) {
      end = 0;
    } else {
      begin = max(begin, int(min(-float(at) / float(down), 64.0)) - 1);
    }
  } else if (down < 0) {
    end = min(end, int(min(float(at) / -float(down), 64.0)) + 2);
  }
}

// An edge at pixel (u, v), from what it is at (0, 0).
int64_t raster_edge(uvec2 at, int along_u, int along_v, int u, int v) {
  return int64_t(packUint2x32(at)) + int64_t(along_u) * int64_t(u) + int64_t(along_v) * int64_t(v);
}

RasterFraction raster_fraction(uint quotient, uvec2 remainder) {
  RasterFraction result;
  result.quotient = quotient;
  result.remainder = packUint2x32(remainder);
  return result;
}

void main() {
  uint index = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  if (index >= raster_block_count) return;
  uvec2 block = raster_blocks[index];
  uint slot = block.x;
  ivec4 box = raster_large[slot].box;
  int first_u = int(block.y & 0xffffu), first_v = int(block.y >> 16);
  int width = min(kRasterBlockSide, box.z - box.x - first_u);
  int height = min(kRasterBlockSide, box.w - box.y - first_v);
  int shift = width <= 8 ? 3 : width <= 16 ? 4 : 5;
  int lane = int(gl_LocalInvocationID.x);
  int lane_u = lane & ((1 << shift) - 1), lane_v = lane >> shift, rows = RASTER_GROUP >> shift;
  if (lane_u >= width || lane_v >= height) return;
  int u = first_u + lane_u, v = first_v + lane_v;  // from the first pixel of the box

  ivec4 along_u = raster_large[slot].edge_along_u, along_v = raster_large[slot].edge_along_v;
  int64_t edge0 = raster_edge(raster_large[slot].edge0, along_u.x, along_v.x, u, v);
  int64_t edge1 = raster_edge(raster_large[slot].edge1, along_u.y, along_v.y, u, v);
  int64_t edge2 = raster_edge(raster_large[slot].edge2, along_u.z, along_v.z, u, v);
  int64_t down0 = int64_t(along_v.x) * int64_t(rows), down1 = int64_t(along_v.y) * int64_t(rows),
          down2 = int64_t(along_v.z) * int64_t(rows);

  // The rows of this thread, counted from its first, that may be covered.
  int begin = 0, end = (height - 1 - lane_v) / rows + 1;
  raster_narrow(edge0, down0, begin, end);
  raster_narrow(edge1, down1, begin, end);
  raster_narrow(edge2, down2, begin, end);
  if (begin >= end) return;
  edge0 += down0 * int64_t(begin);
  edge1 += down1 * int64_t(begin);
  edge2 += down2 * int64_t(begin);
  v += begin * rows;

  uint64_t area = packUint2x32(raster_large[slot].area);
  RasterFraction base =
      raster_fraction(raster_large[slot].quotient, raster_large[slot].remainder);
  RasterFraction by_u =
      raster_fraction(raster_large[slot].quotient_u, raster_large[slot].remainder_u);
  RasterFraction by_v =
      raster_fraction(raster_large[slot].quotient_v, raster_large[slot].remainder_v);
  RasterFraction none = raster_fraction(0u, uvec2(0u));
  RasterFraction at = raster_stride(base, by_u, u, by_v, v, area);
  RasterFraction down = raster_stride(none, by_u, 0, by_v, rows, area);
  uint payload = raster_large[slot].payload;
  uint pixel = raster_pixel(box.x + u, box.y + v);
  uint pixel_step = uint(rows) * uint(raster_width);
  for (int row = begin; row < end; ++row) {
    if ((edge0 | edge1 | edge2) >= 0) {
      strata_insert(pixel, raster_depth(0, at.quotient, raster_depth_limit), payload);
    }
    edge0 += down0;
    edge1 += down1;
    edge2 += down2;
    pixel += pixel_step;
    raster_step(at, down, area);
  }
}
