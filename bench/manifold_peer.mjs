// The Booleans of a tree by Manifold (npm package manifold-3d: WebAssembly, one thread).
//
// usage: node manifold_peer.mjs MANIFOLD.js SCENE ROUNDS BUDGET_MS
//
// SCENE is what bench_boundary writes: a line of JSON, then for each solid its positions (float64, padded to 16 bytes
// before them) and corners (uint32). A round begins with these arrays in memory and ends with the arrays of the result.
// Prints a line of JSON: medians of wall and CPU milliseconds, triangles, volume, rounds.
import {readFileSync} from 'node:fs';
import {resolve} from 'node:path';
import {pathToFileURL} from 'node:url';

const [modulePath, scenePath, rounds, budget] = process.argv.slice(2);
const Module = (await import(pathToFileURL(resolve(modulePath)))).default;
const wasm = await Module();
wasm.setup();
const {Manifold, Mesh} = wasm;

const bytes = readFileSync(scenePath);
const end = bytes.indexOf(10);
const scene = JSON.parse(bytes.subarray(0, end));
let at = Math.ceil((end + 1) / 16) * 16;
const solids = scene.solids.map(({vertices, triangles}) => {
  const take = (Type, count) => {
    const size = count * Type.BYTES_PER_ELEMENT;
    const copy = new Type(bytes.buffer.slice(bytes.byteOffset + at, bytes.byteOffset + at + size));
    at += Math.ceil(size / 16) * 16;
    return copy;
  };
  const vertProperties = Float32Array.from(take(Float64Array, 3 * vertices));
  return {numProp: 3, vertProperties, triVerts: take(Uint32Array, 3 * triangles)};
});

function evaluate(garbage) {
  const values = [];
  for (const [operation, operands] of scene.nodes) {
    let value;
    if (operation === 'solid') {
      const mesh = new Mesh(solids[operands]);
      value = new Manifold(mesh);
    } else {
      value = Manifold[operation](operands.map((i) => values[i]));
    }
    garbage.push(value);
    values.push(value);
  }
  return values[scene.root];
}

const walls = [], cpus = [];
let triangles = 0, volume = 0;
const begin = performance.now();
for (let round = 0; round < Number(rounds); ++round) {
  if (round > 0 && performance.now() - begin > Number(budget)) break;
  const garbage = [];
  const cpu = process.cpuUsage(), start = performance.now();
  const result = evaluate(garbage);
  const mesh = result.getMesh();
  walls.push(performance.now() - start);
  const used = process.cpuUsage(cpu);
  cpus.push((used.user + used.system) / 1e3);
  triangles = mesh.triVerts.length / 3;
  volume = result.volume();
  for (const value of garbage) value.delete();
}
const median = (values) => {
  const sorted = [...values].sort((a, b) => a - b), half = sorted.length >> 1;
  return sorted.length % 2 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2;
};
console.log(JSON.stringify({wall: median(walls), cpu: median(cpus), triangles, volume, rounds: walls.length}));
