// Motions as evolvent.view.animation.described makes them: a header, and arrays by name with one row a frame. Positions are in
// the axes of the main frame.
const VIRIDIS = [[68,1,84],[72,40,120],[62,74,137],[49,104,142],[38,130,142],[31,158,137],[53,183,121],[110,206,88],[181,222,43],[253,231,37]];

// ------------------------------------------------------------------------------------------------ data

const TYPES = { i1: Int8Array, i2: Int16Array, f4: Float32Array, f8: Float64Array };
const floats = (values, scale) => {  // integers back to what they stand for
  const none = values instanceof Int8Array ? -128 : -32768, found = new Float32Array(values.length);
  for (let i = 0; i < values.length; i++) found[i] = values[i] === none ? NaN : values[i] * scale;
  return found;
};
// A motion from the header of a page, whose blocks are base64.
export const decode = (header) => {
  const blocks = {};
  for (const block of header.blocks) {
    const bytes = Uint8Array.from(atob(block.data), (c) => c.charCodeAt(0)), values = new TYPES[block.type](bytes.buffer);
    blocks[block.name] = block.type[0] === "i" ? floats(values, block.scale) : values;
  }
  return { header, blocks };
};
// A motion from the bytes of evolvent.view.animation.pack.
export const unpack = (buffer) => {
  const length = new DataView(buffer).getUint32(0, true), blocks = {};
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length;
  for (const block of header.blocks) {
    const size = block.shape.reduce((a, b) => a * b, 1) * Number(block.type[1]);
    blocks[block.name] = new TYPES[block.type](buffer.slice(at, at + size));
    at += size;
  }
  return { header, blocks };
};

// ------------------------------------------------------------------------------------------------ numbers

export const matrix = (w, x, y, z) => [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
  2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)];
export const times = (A, B) => { const C = new Array(9); for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) C[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j]; return C; };
export const apply = (A, x, y, z) => [A[0] * x + A[1] * y + A[2] * z, A[3] * x + A[4] * y + A[5] * z, A[6] * x + A[7] * y + A[8] * z];
export const IDENTITY = [1, 0, 0, 0, 1, 0, 0, 0, 1];
export const nice = (x) => { const power = 10 ** Math.floor(Math.log10(x)); return (x < 2 * power ? 1 : x < 5 * power ? 2 : 5) * power; };
export const quantity = (x, unit, digits = 3) => {  // as evolvent.results.motion.quantity
  let factor = 1, prefix = "";
  if (["m", "N", "N m", "J", "W", "Pa"].includes(unit) && x) [factor, prefix] = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]].find(([f]) => Math.abs(x) >= 0.9999 * f) || [1, ""];
  const value = x / factor, plain = Math.abs(value) >= 1e5 || (value && Math.abs(value) < 1e-4) ? value.toExponential(digits - 1) : String(+value.toPrecision(digits));
  return `${plain} ${prefix}${unit}`.trim();
};
const tint = (x) => {
  const p = Math.min(Math.max(x, 0), 1) * (VIRIDIS.length - 1), k = Math.min(Math.floor(p), VIRIDIS.length - 2), f = p - k;
  return VIRIDIS[k].map((a, c) => a + f * (VIRIDIS[k + 1][c] - a));
};
// A colour as text, in steps of 1/64 of its shade; texts are kept, since a frame needs thousands of them.
const TEXTS = new WeakMap();
export const css = (c, shade = 1) => {
  const step = Math.round(64 * shade);
  let texts = TEXTS.get(c);
  if (!texts) TEXTS.set(c, (texts = []));
  return (texts[step] ??= `rgb(${c.map((x) => Math.round(Math.min(255, x * step / 64))).join(",")})`);
};
// Colours of values: on a dark page without the lowest third, which it does not show.
const steps = (lowest, count) => Array.from({ length: count }, (_, i) => tint(lowest + (1 - lowest) * i / (count - 1)));
export const tones = (dark, count = 256) => steps(dark ? 0.35 : 0, count);

const corners = (vertices) => {  // of the box around a mesh
  const ends = [0, 1, 2].map((c) => { const x = vertices.filter((_, i) => i % 3 === c); return [Math.min(...x), Math.max(...x)]; });
  return [0, 1, 2, 3, 4, 5, 6, 7].map((i) => ends.map((e, c) => e[(i >> c) & 1]));
};

// ------------------------------------------------------------------------------------------------ one motion

// A motion at a moment: the frames before and after it, and poses between them.
export class Run {
  constructor({ header, blocks }, index) {
    Object.assign(this, { header, blocks, index, time: blocks.time, frames: blocks.time.length });
    this.lines = header.lines.map((line, k) => ({ ...line, points: blocks[`line ${k}`], across: blocks[`across ${k}`],
      values: Object.fromEntries(Object.entries(line.values).map(([color, name]) => [color, blocks[name]])),
      place: new Float64Array(3 * line.count), edge: line.strip ? new Float64Array(3 * line.count) : null,
      at: new Float64Array(3 * line.count), sides: line.strip ? new Float64Array(4 * line.count) : null }));
    this.surfaces = header.surfaces.map((surface, k) => ({ ...surface, points: blocks[`surface ${k}`], normals: blocks[`normal ${k}`],
      values: Object.fromEntries(Object.entries(surface.values).map(([color, name]) => [color, blocks[name]])),
      sides: [0, 1].map(() => ({ place: new Float64Array(3 * surface.count), at: new Float64Array(2 * surface.count) })) }));
    this.nodes = Math.max(0, ...this.lines.map((line) => line.count));
    this.meshes = header.meshes.map((m) => ({ ...m, corners: corners(m.vertices), view: new Float64Array(m.vertices.length), screen: new Float64Array(m.vertices.length) }));
    this.still = !blocks.attitude;
    this.paths = new Map();
  }
  at(t) {
    const { time, frames } = this;
    let low = 0, high = frames - 1;
    while (high - low > 1) { const m = (low + high) >> 1; if (time[m] <= t) low = m; else high = m; }
    const gap = time[high] - time[low];
    Object.assign(this, { k: low, m: high, f: gap > 0 ? Math.min(Math.max((t - time[low]) / gap, 0), 1) : 0 });
    if (this.f === 1) { this.k = high; this.f = 0; }
  }
  mix(values, i, width) { const a = values[this.k * width + i]; return this.f ? a + this.f * (values[this.m * width + i] - a) : a; }
  // Rotation matrix of a pose between the frames: the attitude before it, turned on evenly.
  rotation(attitude, turn, k = this.k, f = this.f) {
    const [w, x, y, z] = attitude.subarray(4 * k, 4 * k + 4);
    const v = [turn[3 * k] * f, turn[3 * k + 1] * f, turn[3 * k + 2] * f], angle = Math.hypot(...v);
    const R = matrix(w, x, y, z);
    if (angle < 1e-12) return R;
    const s = Math.sin(angle / 2) / angle;
    return times(R, matrix(Math.cos(angle / 2), v[0] * s, v[1] * s, v[2] * s));
  }
  main(inertial, k = null) {  // rotation and place of the main frame
    if (!inertial || this.still) return [IDENTITY, [0, 0, 0]];
    const { attitude, turn, origin } = this.blocks;
    if (k !== null) return [this.rotation(attitude, turn, k, 0), [origin[3 * k], origin[3 * k + 1], origin[3 * k + 2]]];
    return [this.rotation(attitude, turn), [0, 1, 2].map((c) => this.mix(origin, c, 3))];
  }
  frame(k, what = "frame") {  // rotation and place of a frame or a symbol in the main one
    if (this.header[`${what}s`][k].still) return [IDENTITY, [0, 0, 0]];
    const origin = this.blocks[`${what} ${k} origin`];
    return [this.rotation(this.blocks[`${what} ${k} attitude`], this.blocks[`${what} ${k} turn`]), [0, 1, 2].map((c) => this.mix(origin, c, 3))];
  }
  // Points whose trails may be shown: [name, array of places, index, points a frame, whether it is shown first].
  get traceable() {
    if (this.named) return this.named;
    const found = [];
    this.lines.forEach((line, k) => {
      if (line.kind === "spring") return;
      for (const i of [line.count - 1, 0]) found.push({ name: `${line.name}, ${i ? "last" : "first"} point`, values: line.points, i, width: 3 * line.count, tip: line.tip === i });
    });
    for (const { name, points, count } of this.surfaces) for (const i of [count - 1, 0]) found.push({ name: `${name}, ${i ? "last" : "first"} point`, values: points, i, width: 3 * count, tip: i > 0 });
    this.header.marks.forEach((mark, k) => { for (let i = 0; i < mark.count; i++) found.push({ name: mark.count > 1 ? `${mark.name} ${i + 1}` : mark.name, values: this.blocks[`mark ${k}`], i, width: 3 * mark.count, mark: true }); });
    this.header.frames.forEach((frame, k) => found.push({ name: frame.name, values: frame.still ? null : this.blocks[`frame ${k} origin`], i: 0, width: 3, frame: true }));
    if (!found.some((x) => x.tip)) { const marks = found.some((x) => x.mark); for (const x of found) x.tip = marks ? x.mark : x.frame; }
    return (this.named = found);
  }
  // Places of a traceable point in the course of the run, and how many of them come up to each frame: more than one
  // between frames where the main frame turns far.
  path(point, inertial) {
    const key = `${point.name} ${inertial}`;
    if (!this.paths.has(key)) {
      const found = [], upTo = [], { turn } = this.blocks, before = [this.k, this.m, this.f];
      for (let k = 0; k < this.frames; k++) {
        const angle = inertial && !this.still ? Math.hypot(turn[3 * k], turn[3 * k + 1], turn[3 * k + 2]) : 0, count = Math.min(Math.max(1, Math.ceil(angle / 0.15)), 40);
        for (let i = 0; i < (k + 1 < this.frames ? count : 1); i++) { Object.assign(this, { k, m: Math.min(k + 1, this.frames - 1), f: i / count }); found.push(...this.place(point, inertial)); if (!i) upTo.push(found.length / 3); }
      }
      [this.k, this.m, this.f] = before;
      this.paths.set(key, { places: Float64Array.from(found), upTo });
    }
    return this.paths.get(key);
  }
  place(point, inertial) {
    const [R, o] = this.main(inertial), v = point.values, at = 3 * point.i;
    const p = v ? apply(R, this.mix(v, at, point.width), this.mix(v, at + 1, point.width), this.mix(v, at + 2, point.width)) : [0, 0, 0];
    return [p[0] + o[0], p[1] + o[1], p[2] + o[2]];
  }
}
