// Inserts a fragment, with the exact depth of the triangle's plane above the pixel centre
// (raster/triangle_setup.h): of whole numbers in doubles, floor((n + 1/2) / area) is the floor of n
// / area while n < 2^51.
layout(early_fragment_tests) in;
layout(std430, binding = 0) readonly buffer vertices_block { int vertices[]; };
layout(std430, binding = 1) readonly buffer triangles_block { uint triangles[]; };
uniform int axis_u, axis_v, axis_w;
uniform uint pixel_u, pixel_v;  // of the window's corner, in the screen
uniform int row_of_screen;      // of the target, where the screen begins
uniform uint screen_width;
uniform uint depth_limit;

ivec3 vertex_of(uint corner) {
  uint at = 3u * triangles[3u * uint(gl_PrimitiveID) + corner];
  return ivec3(vertices[at + uint(axis_u)], vertices[at + uint(axis_v)],
               vertices[at + uint(axis_w)]);
}

void main() {
  if (gl_HelperInvocation) return;
  uvec2 pixel = uvec2(gl_FragCoord.xy) + uvec2(pixel_u, pixel_v);
  ivec3 p0 = vertex_of(0u);
  precise dvec3 e1 = dvec3(vertex_of(1u) - p0);
  precise dvec3 e2 = dvec3(vertex_of(2u) - p0);
  precise double area = e1.x * e2.y - e2.x * e1.y;
  if (area == 0.0) return;  // seen edge-on: covers nothing
  bool outward_up = area > 0.0;
  if (!outward_up) {
    dvec3 swapped = e1;
    e1 = e2;
    e2 = swapped;
    area = -area;
  }
  precise double slope_u = e1.z * e2.y - e2.z * e1.y;
  precise double slope_v = e1.x * e2.z - e2.x * e1.z;
  bool down = true;
  if (axis_w != 0) down = slope_u < 0.0 || (slope_u == 0.0 && (axis_w == 1 || slope_v <= 0.0));
  ivec2 centre = ivec2(int(pixel.x), int(pixel.y) + row_of_screen) * 256 + 128;
  dvec2 d = dvec2(centre - p0.xy);
  precise double numerator = slope_u * d.x + slope_v * d.y + (down ? -0.5 : 0.5);
  precise double depth = double(p0.z) + floor(numerator / area);
  uint key = uint(clamp(depth, 0.0, double(depth_limit - 1u)));
  bool exits = outward_up != (axis_w == 1);
  strata_insert(pixel.y * screen_width + pixel.x, key,
                uint(gl_PrimitiveID) | (exits ? 0x80000000u : 0u));
}
