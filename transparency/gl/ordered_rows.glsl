// Rows of a pixel that are read and written in the order of submission: by framebuffer fetch, or between the marks of
// fragment shader interlock. A row is a premultiplied colour and a transmittance. After the rows come the depths of all
// but the last; the last of the four is a count. ROWS is 2 to 4. The depth of a free row is kFar.
const float kFar = 33554432.0;

#ifdef STRATA_INTERLOCK
layout(std430, binding = 8) coherent buffer rows_block { vec4 rows_of_all[]; };
#else
layout(location = 0) inout vec4 rows_0;
layout(location = 1) inout vec4 rows_1;
#if ROWS > 2
layout(location = 2) inout vec4 rows_2;
#endif
#if ROWS > 3
layout(location = 3) inout vec4 rows_3;
#endif
layout(location = ROWS) inout vec4 rows_depths;
#endif
layout(std430, binding = 9) readonly buffer rows_faces_block { vec4 rows_faces[]; };

vec4 row[ROWS];
vec4 row_depth;

void rows_load(uint pixel) {
#ifdef STRATA_INTERLOCK
  uint at = pixel * uint(ROWS + 1);
  for (uint i = 0u; i < uint(ROWS); ++i) row[i] = rows_of_all[at + i];
  row_depth = rows_of_all[at + uint(ROWS)];
#else
  row[0] = rows_0;
  row[1] = rows_1;
#if ROWS > 2
  row[2] = rows_2;
#endif
#if ROWS > 3
  row[3] = rows_3;
#endif
  row_depth = rows_depths;
#endif
}
void rows_store(uint pixel) {
#ifdef STRATA_INTERLOCK
  uint at = pixel * uint(ROWS + 1);
  for (uint i = 0u; i < uint(ROWS); ++i) rows_of_all[at + i] = row[i];
  rows_of_all[at + uint(ROWS)] = row_depth;
#else
  rows_0 = row[0];
  rows_1 = row[1];
#if ROWS > 2
  rows_2 = row[2];
#endif
#if ROWS > 3
  rows_3 = row[3];
#endif
  rows_depths = row_depth;
#endif
}

// Puts a fragment among the first `count` rows, by depth; it becomes the one that falls out.
void rows_sort_in(int count, inout vec4 fragment, inout float depth) {
  for (int i = 0; i < count; ++i) {
    if (depth < row_depth[i]) {
      vec4 swapped = row[i];
      row[i] = fragment;
      fragment = swapped;
      float other = row_depth[i];
      row_depth[i] = depth;
      depth = other;
    }
  }
}

void strata_insert(uint pixel, uint depth, uint payload) {
  vec4 face = rows_faces[(payload & 0x7fffffffu) << 1 | payload >> 31];
  precise vec4 f = vec4(face.rgb, 1.0 - face.a);
  float z = float(depth);
  rows_load(pixel);
#if defined(ROWS_MLAB)
  // M. Salvi, K. Vaidyanathan, "Multi-layer alpha blending" (2014): what falls out is merged with the last row.
  rows_sort_in(ROWS, f, z);
  precise vec4 last = row[ROWS - 1];
  last.rgb += f.rgb * last.a;
  last.a *= f.a;
  if (z < kFar) row[ROWS - 1] = last;
#elif defined(ROWS_HYBRID)
  // M. Maule, J. Comba, R. Torchelsen, R. Bastos, "Hybrid transparency" (2013): what falls out is averaged.
  rows_sort_in(ROWS - 1, f, z);
  if (z < kFar && f.a != 1.0) {
    row[ROWS - 1] += vec4(f.rgb, 1.0 - f.a);
    row_depth[3] += 1.0;
  }
#else
  // L. Bavoil et al., "Multi-fragment effects on the GPU using the k-buffer" (2007): where all entries are taken, the
  // nearest is blended behind those before it.
  rows_sort_in(ROWS - 1, f, z);
  if (z < kFar) {
    precise vec4 done = row[ROWS - 1];
    done.rgb += done.a * row[0].rgb;
    done.a *= row[0].a;
    row[ROWS - 1] = done;
    for (int i = 0; i + 2 < ROWS; ++i) {
      row[i] = row[i + 1];
      row_depth[i] = row_depth[i + 1];
    }
    row[ROWS - 2] = f;
    row_depth[ROWS - 2] = z;
  }
#endif
  rows_store(pixel);
}
