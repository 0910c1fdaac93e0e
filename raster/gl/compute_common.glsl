// What the three shaders of the compute rasterizer share: the mesh, the target, and what the first
// of them sorts out.

layout(local_size_x = RASTER_GROUP) in;

layout(std430, binding = 0) readonly buffer RasterVertices { int raster_vertices[]; };
layout(std430, binding = 1) readonly buffer RasterTriangles { uint raster_triangles[]; };

layout(std430, binding = 6) readonly buffer RasterView {
  ivec4 raster_axes;  // which of x, y, z are u, v, w
  ivec4 raster_clip;  // u0, v0, u1, v1: the pixels that are asked for
  int raster_first_row;  // of the screen, in pixels of the target
  int raster_width;      // pixels of a row of the screen
  uint raster_depth_limit;
};
uniform uint raster_first_triangle;  // number of this part's first triangle

// The most pixels of a box that one thread walks; larger triangles are taken by whole groups.
const int kRasterSmallPixels = 64;
// Blocks of large triangles are this wide and high.
const int kRasterBlockSide = 32;

// A large triangle, ready for any of its blocks. Depth is quotient + remainder / area at the first
// pixel of the box; edges are those there. Pairs are 64-bit integers, low word first.
struct RasterLarge {
  ivec4 box;        // u0, v0, u1, v1
  uvec2 area, remainder, remainder_u, remainder_v;
  uint quotient, quotient_u, quotient_v, payload;
  ivec4 edge_along_u, edge_along_v;
  uvec2 edge0, edge1, edge2, edge_unused;
};

// One thread a triangle: number of this thread, whatever the shape of the dispatch.
uint raster_thread() {
  return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * uint(RASTER_GROUP) +
         gl_LocalInvocationID.x;
}

ivec3 raster_vertex(uint index) {
  uint at = index * 3u;
  return ivec3(raster_vertices[at + uint(raster_axes.x)], raster_vertices[at + uint(raster_axes.y)],
               raster_vertices[at + uint(raster_axes.z)]);
}
void raster_load(uint triangle, out ivec3 p0, out ivec3 p1, out ivec3 p2) {
  p0 = raster_vertex(raster_triangles[triangle * 3u]);
  p1 = raster_vertex(raster_triangles[triangle * 3u + 1u]);
  p2 = raster_vertex(raster_triangles[triangle * 3u + 2u]);
}

// The pixels whose centres lie in the box of a triangle, cut to the clip.
ivec4 raster_box(ivec3 p0, ivec3 p1, ivec3 p2) {
  ivec3 low = min(min(p0, p1), p2), high = max(max(p0, p1), p2);
  return ivec4(max(raster_clip.x, raster_first_pixel(low.x)),
               max(raster_clip.y, raster_first_pixel(low.y)),
               min(raster_clip.z, raster_end_pixel(high.x)),
               min(raster_clip.w, raster_end_pixel(high.y)));
}

uint raster_payload(RasterTriangle t, uint triangle) {
  return t.exit_flag << 31 | (raster_first_triangle + triangle);
}
uint raster_pixel(int u, int v) {
  return uint(v - raster_first_row) * uint(raster_width) + uint(u);
}
