// Lattice positions to clip space. The window is 2^k pixels a side and the lattice 1/256 of a
// pixel, so all of this is exact in floats: a vertex falls on the very place of the lattice where
// the CPU has it.
layout(location = 0) in ivec3 position;
uniform int axis_u, axis_v;
uniform int origin_u, origin_v;  // lattice position of the window's corner
uniform float scale;             // from the lattice to [0, 2]
invariant gl_Position;

void main() {
  ivec2 p = ivec2(position[axis_u] - origin_u, position[axis_v] - origin_v);
  // No vertex is clipped by depth: the list keeps what lies before the near and beyond the far
  // plane.
  gl_Position = vec4(vec2(p) * scale - 1.0, 0.0, 1.0);
}
