// Inserts a fragment, with the exact depth of the triangle's plane above the pixel centre
// (raster/triangle_setup.h): of whole numbers in doubles, floor((n + 1/2) / area) is the floor of n
// / area while n < 2^51.
#ifndef STRATA_EXACT_COVERAGE
layout(early_fragment_tests) in;
#endif
#ifdef STRATA_INTERLOCK
layout(pixel_interlock_ordered) in;
#endif
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

// The exact depth and the payload; false where the triangle is seen edge-on and covers nothing.
bool fragment_of(uvec2 pixel, out uint key, out uint payload) {
  ivec3 p0 = vertex_of(0u);
  precise dvec3 e1 = dvec3(vertex_of(1u) - p0);
  precise dvec3 e2 = dvec3(vertex_of(2u) - p0);
  precise double area = e1.x * e2.y - e2.x * e1.y;
  if (area == 0.0) return false;
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
  key = uint(clamp(depth, 0.0, double(depth_limit - 1u)));
  bool exits = outward_up != (axis_w == 1);
  payload = uint(gl_PrimitiveID) | (exits ? 0x80000000u : 0u);
  return true;
}

#ifdef STRATA_EXACT_COVERAGE
// Whether an edge leaves the pixel centre, `d` from p0, inside or on it by the rule of raster/triangle_setup.h.
bool within(dvec2 from, dvec2 to, dvec2 d) {
  dvec2 normal = dvec2(from.y - to.y, to.x - from.x);
  double at = dot(normal, d - from);
  return at > 0.0 || (at == 0.0 && (normal.x > 0.0 || (normal.x == 0.0 && normal.y > 0.0)));
}
bool is_covered(uvec2 pixel) {
  ivec3 p0 = vertex_of(0u);
  dvec2 a = dvec2(vertex_of(1u).xy - p0.xy), b = dvec2(vertex_of(2u).xy - p0.xy);
  if (a.x * b.y < b.x * a.y) {
    dvec2 swapped = a;
    a = b;
    b = swapped;
  }
  dvec2 d = dvec2(ivec2(int(pixel.x), int(pixel.y) + row_of_screen) * 256 + 128 - p0.xy);
  return within(dvec2(0.0), a, d) && within(a, b, d) && within(b, dvec2(0.0), d);
}
#endif

void main() {
  uvec2 pixel = uvec2(gl_FragCoord.xy) + uvec2(pixel_u, pixel_v);
#ifdef STRATA_EXACT_COVERAGE
  if (!is_covered(pixel)) discard;  // before the stencil is asked
#endif
  uint key = 0u, payload = 0u;
  bool covers = !gl_HelperInvocation && fragment_of(pixel, key, payload);
#ifdef STRATA_INTERLOCK
  beginInvocationInterlockARB();
#endif
  if (covers) strata_insert(pixel.y * screen_width + pixel.x, key, payload);
#ifdef STRATA_INTERLOCK
  endInvocationInterlockARB();
#endif
}
