// Weighted sum (H. Meshkin 2007): C = sum a c + (1 - sum a) background.
// Weighted average (L. Bavoil, K. Myers 2008): c = sum a c / sum a, b = sum a / n, C = c (1 - (1 - b)^n) + (1 - b)^n background.
layout(local_size_x = 64) in;
layout(std430, binding = 1) writeonly buffer image_block { vec4 image[]; };
layout(std430, binding = 8) readonly buffer sums_block { uint sums[]; };
uniform uint pixels;

void main() {
  uint pixel = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (pixel >= pixels) return;
  uint at = 5u * pixel;
  vec4 sum = vec4(sums[at], sums[at + 1u], sums[at + 2u], sums[at + 3u]) / 262144.0;
  uint count = sums[at + 4u];
#ifdef SUMS_AVERAGE
  if (count == 0u || sum.a <= 0.0) {
    image[pixel] = vec4(0.0, 0.0, 0.0, 1.0);
    return;
  }
  float seen = pow(max(1.0 - sum.a / float(count), 0.0), float(count));
  image[pixel] = vec4(sum.rgb / sum.a * (1.0 - seen), seen);
#else
  image[pixel] = vec4(sum.rgb, 1.0 - sum.a);
#endif
}
