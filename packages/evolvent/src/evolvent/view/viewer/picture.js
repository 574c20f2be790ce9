// A picture of motions at a moment on a canvas. Faces and pieces of lines are drawn in the order of their distance, the
// farthest first.
import { Run, IDENTITY, apply, css, nice, quantity, times, tones } from "./motion.js";

const BODIES = [[188,198,209],[214,197,166],[178,203,176],[204,181,198],[170,194,219],[219,187,174]];
const RUNS = [[28,31,36],[0,114,178],[213,94,0],[0,158,115],[204,121,167]];
const RUNS_DARK = [[232,235,237],[77,166,224],[240,128,59],[46,196,150],[227,153,196]];
const SYMBOL = [[104,116,150],[245,150,50]];  // of symbols, of plumes
const MARKED = [226,96,84];  // of bodies that interfere
const TRAILS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a6d00", "#56b4e9", "#7a4fd0", "#a33b3b"];
const OPENING = 0.08;  // share of a run after which a picture that opens on what is stowed holds the whole motion
const MESH = 14;  // pixels of an element, about, from which lines are drawn around it
const APART = 80;  // bodies up to which planes between them are sought
const LIGHT = [-0.35, 0.6, -0.72];  // right, up, away from the eye

// Whether two convex polygons of the picture overlap by more than a tenth of a pixel.
const meet = (a, b) => {
  for (const one of [a, b]) for (let i = 0; i < one.length; i += 2) {
    const j = (i + 2) % one.length, x = one[i + 1] - one[j + 1], y = one[j] - one[i], size = Math.hypot(x, y);
    if (!size) continue;
    const ends = (p) => { let low = Infinity, high = -Infinity; for (let k = 0; k < p.length; k += 2) { const v = (x * p[k] + y * p[k + 1]) / size; low = Math.min(low, v); high = Math.max(high, v); } return [low, high]; };
    const [l, h] = ends(a), [m, k] = ends(b);
    if (h < m + 0.1 || k < l + 0.1) return false;
  }
  return true;
};

export class Picture {
  constructor(canvas, motions) {
    Object.assign(this, { canvas, dirty: true, inertial: true, follow: false, color: 0, arrows: true, symbols: true, grid: true, trails: [] });
    this.pen = canvas.getContext("2d");
    this.motions = motions.map((motion, k) => new Run(motion, k));
    this.alone = motions.length === 1;
    const [first] = this.motions, { header } = first;
    this.begin = Math.min(...this.motions.map((m) => m.time[0]));
    this.end = Math.max(...this.motions.map((m) => m.time[m.frames - 1]));
    this.now = this.begin;
    this.up = { x: [0, 1, 0, 0, 0, 1, 1, 0, 0], y: [1, 0, 0, 0, 0, -1, 0, 1, 0], z: IDENTITY }[header.up];
    // arrows of all runs on one scale: the smallest
    this.scales = new Map();
    for (const { header: { forces } } of this.motions) for (const { unit, scale } of forces) if (scale > 0) this.scales.set(unit, Math.min(scale, this.scales.get(unit) ?? scale));
    this.theme(false);
    // the camera goes with what travels far
    const [{ azimuth, elevation }] = header.views, drift = this.extent(azimuth, elevation, true, false), size = this.extent(azimuth, elevation, false, false);
    this.follow = !first.still && drift.radius > 3 * size.radius;
    this.view(header.views[0]);
  }
  redraw() { this.dirty = true; }
  theme(dark) {
    this.dark = dark;
    this.tones = tones(dark);
    this.paint = dark ? { ink: "#c3cad2", grid: "#2c3238", back: "#1d2126", dim: "#9aa4b0", force: "#ff7a66", none: [110, 118, 128] } : { ink: "#30363d", grid: "#e6e9ec", back: "#ffffff", dim: "#6a7480", force: "#c5281c", none: [165, 172, 180] };
    this.redraw();
  }
  trail(run, point) {  // show the trail of a point, or no longer
    const at = this.trails.findIndex((t) => t.point === point);
    if (at >= 0) this.trails.splice(at, 1); else this.trails.push({ run, point });
    this.redraw();
  }

  // -------------------------------------------------------------------------------------------- camera

  // Rows: right, up, away; of inertial axes, one of which is up.
  eye(azimuth, elevation) {
    const [ca, sa, ce, se] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(elevation), Math.sin(elevation)];
    return times([ca, sa, 0, -sa * se, ca * se, ce, -sa * ce, ca * ce, -se], this.up);
  }
  // Middle and size of what is seen from a direction in the course of a run; what: "" for all, "bodies" for solids,
  // "start" for all at the first moment, "opening" for that and then for all.
  extent(azimuth, elevation, inertial, follow, what = "") {
    if (what === "opening") return { ...this.extent(azimuth, elevation, inertial, follow), what, start: this.extent(azimuth, elevation, inertial, follow, "start") };
    const C = this.eye(azimuth, elevation), low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    const add = (R, o, x, y, z) => {
      const p = apply(R, x, y, z), v = apply(C, p[0] + o[0], p[1] + o[1], p[2] + o[2]);
      for (let c = 0; c < 3; c++) if (v[c] === v[c]) { low[c] = Math.min(low[c], v[c]); high[c] = Math.max(high[c], v[c]); }
    };
    for (const run of this.motions) {
      const before = [run.k, run.m, run.f], steps = what === "start" ? 1 : Math.min(run.frames, 60);
      for (let s = 0; s < steps; s++) {
        run.k = run.m = Math.round(s * (run.frames - 1) / Math.max(steps - 1, 1)); run.f = 0;
        let [R, o] = run.main(inertial);
        if (follow) o = [0, 0, 0];
        run.header.frames.forEach((frame, j) => {
          const [Q, p] = run.frame(j), S = times(R, Q), at = apply(R, ...p).map((x, c) => x + o[c]);
          for (const solid of frame.solids) {
            const B = times(S, solid.basis), c = apply(S, ...solid.centre).map((x, n) => x + at[n]);
            for (const corner of run.meshes[solid.mesh].corners) add(B, c, ...corner);
          }
          for (const path of frame.outline) for (let i = 0; i < path.length; i += 3) add(S, at, path[i], path[i + 1], path[i + 2]);
        });
        if (what === "bodies" && low[0] <= high[0]) continue;
        const cloud = (values, count) => {
          const some = Math.min(count, 40);
          for (let i = 0; i < some; i++) { const a = 3 * (run.k * count + Math.round(i * (count - 1) / Math.max(some - 1, 1))); add(R, o, values[a], values[a + 1], values[a + 2]); }
        };
        for (const { points, count } of [...run.lines, ...run.surfaces]) cloud(points, count);
        run.header.marks.forEach((mark, j) => cloud(run.blocks[`mark ${j}`], mark.count));
      }
      [run.k, run.m, run.f] = before;
    }
    if (!(low[0] <= high[0])) { low.fill(-1); high.fill(1); }
    const middle = low.map((x, c) => 0.5 * (x + high[c])), half = low.map((x, c) => 0.5 * (high[c] - x));
    const target = [0, 1, 2].map((c) => C[c] * middle[0] + C[3 + c] * middle[1] + C[6 + c] * middle[2]);
    return { azimuth, elevation, what, target, wide: half[0], tall: half[1], radius: Math.hypot(...half) || 1 };
  }
  look(azimuth, elevation, what) {
    this.camera = { azimuth, elevation, zoom: 1, pan: [0, 0] };
    this.base = this.extent(azimuth, elevation, this.inertial, this.follow, what);
    this.redraw();
  }
  view({ azimuth, elevation, what }) { this.look(azimuth, elevation, what); }
  framed() {  // what fills the picture now
    const { base, base: { start }, begin, end, now } = this, p = (now - begin) / (OPENING * (end - begin) || 1);
    if (!start || p >= 1) return base;
    const radius = start.radius * (base.radius / start.radius) ** (p * p * (3 - 2 * p)), s = (radius - start.radius) / (base.radius - start.radius), between = (a, b) => a + s * (b - a);
    return { radius, wide: between(start.wide, base.wide), tall: between(start.tall, base.tall), target: start.target.map((x, c) => between(x, base.target[c])) };
  }
  zoom(by) { this.camera.zoom = Math.min(Math.max(this.camera.zoom * by, 0.1), 2000); this.redraw(); }
  pan(dx, dy) { this.camera.pan[0] += dx; this.camera.pan[1] += dy; this.redraw(); }

  // -------------------------------------------------------------------------------------------- picture

  runColor(k) { return (this.dark ? RUNS_DARK : RUNS)[k % RUNS.length]; }
  draw() {
    const { canvas, pen, camera } = this, base = this.framed(), ratio = window.devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
    if (!w || !h) return;
    if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) { canvas.width = Math.round(w * ratio); canvas.height = Math.round(h * ratio); }
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, w, h);
    pen.lineJoin = pen.lineCap = "round";
    for (const run of this.motions) run.at(this.now);
    const C = this.eye(camera.azimuth, camera.elevation), scale = Math.min(0.42 * w / (base.wide || 1e-9), 0.38 * h / (base.tall || 1e-9), 2 * Math.max(w, h) / base.radius) * camera.zoom;
    const main = this.motions[0].main(this.inertial)[1], T = base.target.map((x, c) => x + (this.follow && this.inertial ? main[c] : 0));
    Object.assign(this, { w, h, C, T, scale, distance: 6 * base.radius, middle: [w / 2 + camera.pan[0], h / 2 + camera.pan[1]] });
    this.parts = [];
    this.spots = [];
    this.solids = [];
    if (this.grid) this.floor();
    for (const { run, point } of this.trails) this.track(run, point);
    for (const run of this.motions) this.collect(run);
    this.separate();
    this.parts.sort((a, b) => b.depth - a.depth);
    this.paintParts();
    this.measures();
  }
  // Faces of bodies a small gap apart: the body on the eye's side of a plane between two of them is drawn over the other.
  separate() {
    const { solids } = this, eye = [0, 0, -this.distance];
    if (solids.length < 2 || solids.length > APART) return;
    for (const one of solids) {
      const { at: first } = one.faces[0] ?? { at: [NaN, NaN] }, box = [first[0], first[1], first[0], first[1]];
      for (const { at } of one.faces) for (let i = 0; i < at.length; i += 2) { box[0] = Math.min(box[0], at[i]); box[1] = Math.min(box[1], at[i + 1]); box[2] = Math.max(box[2], at[i]); box[3] = Math.max(box[3], at[i + 1]); }
      one.box = box;
    }
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    // 1 where b lies beyond a face of the box around a and the eye as well: b is in front; -1 where the eye does not
    const beyond = (a, b) => {
      for (let n = 0; n < 3; n++) {
        const axis = [a.M[n], a.M[3 + n], a.M[6 + n]], ends = (corners) => { const x = corners.map((p) => dot(axis, p)); return [Math.min(...x), Math.max(...x)]; };
        const [low, high] = ends(a.corners), [from, to] = ends(b.corners), e = dot(axis, eye), slack = 1e-6 * (high - low + to - from);
        if (from >= high - slack) return e > high ? 1 : -1;
        if (to <= low + slack) return e < low ? 1 : -1;
      }
      return 0;
    };
    const over = solids.map(() => []);  // of each body those that it is drawn over
    for (let i = 0; i < solids.length; i++) for (let j = 0; j < i; j++) {
      const [a, b] = [solids[i], solids[j]];
      if (!(a.box[0] < b.box[2] && b.box[0] < a.box[2] && a.box[1] < b.box[3] && b.box[1] < a.box[3])) continue;
      const side = beyond(a, b) || -beyond(b, a);
      if (side > 0) over[j].push(i); else if (side < 0) over[i].push(j);
    }
    const done = solids.map(() => 0);  // 1: under way, 2: its faces have their places
    const place = (i) => {
      if (done[i]) return;
      done[i] = 1;
      for (const j of over[i]) { place(j); for (const face of solids[i].faces) for (const { at, depth } of solids[j].faces) if (face.depth >= depth && meet(face.at, at)) face.depth = depth - 1e-9 * this.distance; }
      done[i] = 2;
    };
    for (let i = 0; i < solids.length; i++) place(i);
  }
  // All parts in order; plain lines of one colour and width that follow one another are one path.
  paintParts() {
    const { pen, parts } = this;
    let line = null, width = 0;  // of the path that is open
    const close = () => { if (line !== null) pen.stroke(); line = null; };
    for (const part of parts) {
      const { at } = part;
      if (part.fill || part.round || !part.line || (part.alpha ?? 1) !== 1) { close(); this.stroke(part); continue; }
      if (part.line !== line || part.width !== width) {
        close();
        pen.beginPath();
        pen.strokeStyle = line = part.line;
        pen.lineWidth = width = part.width;
      }
      pen.moveTo(at[0], at[1]);
      for (let i = 2; i < at.length; i += 2) pen.lineTo(at[i], at[i + 1]);
    }
    close();
  }
  stroke({ at, fill, line, width, round, alpha = 1 }) {
    const { pen } = this;
    if (alpha !== 1) pen.globalAlpha = alpha;
    pen.beginPath();
    if (round) pen.arc(at[0], at[1], round, 0, 2 * Math.PI);
    else { pen.moveTo(at[0], at[1]); for (let i = 2; i < at.length; i += 2) pen.lineTo(at[i], at[i + 1]); }
    if (fill) { if (!round) pen.closePath(); pen.fillStyle = fill; pen.fill(); }
    if (line) { pen.strokeStyle = line; pen.lineWidth = width; pen.stroke(); }
    if (alpha !== 1) pen.globalAlpha = 1;
  }
  // View coordinates (right, up, away) to the screen; null behind the eye.
  screen(v) {
    const g = this.distance + v[2];
    if (!(g > 0.02 * this.distance)) return null;
    const s = this.scale * this.distance / g;
    return [this.middle[0] + s * v[0], this.middle[1] - s * v[1], s];
  }
  see(p) { return apply(this.C, p[0] - this.T[0], p[1] - this.T[1], p[2] - this.T[2]); }
  floor() {
    const { base, T } = this, step = this.motions[0].header.grid, reach = Math.max(step, Math.min(3 * base.radius, 24 * step));
    const [i, j, k] = { x: [1, 2, 0], y: [2, 0, 1], z: [0, 1, 2] }[this.motions[0].header.up];
    const level = this.follow && this.inertial ? T[k] : 0, from = [i, j].map((c) => Math.round((T[c] - reach) / step)), to = [i, j].map((c) => Math.round((T[c] + reach) / step));
    const line = (a, b) => { const p = this.screen(this.see(a)), q = this.screen(this.see(b)); if (p && q) this.stroke({ at: [p[0], p[1], q[0], q[1]], line: this.paint.grid, width: 1 }); };
    const point = (u, v) => { const p = [0, 0, 0]; p[i] = u * step; p[j] = v * step; p[k] = level; return p; };
    for (let u = from[0]; u <= to[0]; u++) line(point(u, from[1]), point(u, to[1]));
    for (let v = from[1]; v <= to[1]; v++) line(point(from[0], v), point(to[0], v));
  }
  track(run, point) {  // faint but for the last tenth of the run
    const { places, upTo } = run.path(point, this.inertial), color = TRAILS[this.trails.findIndex((t) => t.point === point) % TRAILS.length];
    const passed = run.f ? upTo[run.k] + Math.floor(run.f * ((upTo[run.m] ?? upTo[run.k]) - upTo[run.k])) : upTo[run.k];
    const late = this.now - 0.1 * (this.end - this.begin), from = upTo[Math.max(0, run.time.findIndex((t) => t >= late))] - 1;
    let at = [];
    const cut = (alpha) => { this.pen.globalAlpha = alpha; if (at.length > 2) this.stroke({ at, line: color, width: 1.5 }); this.pen.globalAlpha = 1; at = at.slice(-2); };
    for (let i = 0; i < passed; i++) {
      const p = places[3 * i] === places[3 * i] ? this.screen(this.see(places.subarray(3 * i, 3 * i + 3))) : null;
      if (p) at.push(p[0], p[1]); else { cut(i < from ? 0.4 : 1); at = []; }
      if (i === from) cut(0.4);
    }
    const p = this.screen(this.see(run.place(point, this.inertial)));
    if (p && p[0] === p[0]) at.push(p[0], p[1]);
    cut(1);
  }
  collect(run) {
    const [R, o] = run.main(this.inertial), A = times(this.C, R), b = this.see(o);
    run.header.frames.forEach((frame, k) => this.body(run, frame, k, A, b));
    if (this.symbols) run.header.symbols.forEach((frame, k) => this.body(run, frame, k, A, b, "symbol"));
    run.lines.forEach((line) => this.line(run, line, A, b));
    run.surfaces.forEach((surface) => this.surface(run, surface, A, b));
    run.header.marks.forEach((mark, k) => this.mark(run, mark, k, A, b));
    if (this.arrows) run.header.forces.forEach((force, k) => this.force(run, force, k, A, b));
    for (const point of run.traceable) {
      const v = point.values ? [0, 1, 2].map((c) => run.mix(point.values, 3 * point.i + c, point.width)) : [0, 0, 0];
      const p = this.screen(apply(A, ...v).map((x, c) => x + b[c]));
      if (p && p[0] === p[0]) this.spots.push({ x: p[0], y: p[1], run, point });
    }
  }
  body(run, frame, k, A, b, what = "frame") {
    const shown = run.blocks[`${what} ${k} shown`];
    if (shown && shown[run.k] < 0.5) return;
    const [Q, p] = run.frame(k, what), first = this.parts.length, M = times(A, Q), c = apply(A, ...p).map((x, i) => x + b[i]);
    const main = run.header.main === frame.name, marked = run.blocks[`${what} ${k} marked`], color = marked && marked[run.k] > 0.5 ? MARKED : this.alone ? (what === "symbol" ? SYMBOL[0] : BODIES[main ? 0 : k % BODIES.length]) : this.runColor(run.index).map((x) => 0.45 * x + 130);
    frame.solids.forEach((solid, j) => {
      let B = solid.basis;
      const size = solid.scaled ? run.mix(run.blocks[`${what} ${k} scaled ${j}`], 0, 1) : 1;
      if (!(size > 1e-3)) return;
      if (size !== 1) B = B.map((x) => x * size);
      if (solid.turned) { const angle = run.mix(run.blocks[`${what} ${k} turned ${j}`], 0, 1), [x, y] = [Math.cos(angle), Math.sin(angle)]; B = times(B, [1, 0, 0, 0, x, -y, 0, y, x]); }
      this.solid(run.meshes[solid.mesh], times(M, B), apply(M, ...solid.centre).map((x, i) => x + c[i]), size * solid.size, solid.scaled && this.alone ? SYMBOL[1] : color, what === "frame");
    });
    for (const path of frame.outline) {
      let last = null;
      for (let i = 0; i < path.length; i += 3) {
        const v = apply(M, path[i], path[i + 1], path[i + 2]).map((x, n) => x + c[n]), at = this.screen(v);
        if (last && at) this.edge(last, { v, at }, this.alone ? this.paint.ink : css(color));
        last = at && { v, at };
      }
    }
    if (what === "frame") return;
    for (let i = first; i < this.parts.length; i++) this.parts[i].depth -= frame.lift + 1e-3 * this.base.radius;
    const at = this.screen(c);
    if (at && at[0] === at[0]) this.spots.push({ x: at[0], y: at[1], run, name: frame.name });
  }
  edge(p, q, line) {  // in short pieces, each at its distance
    const n = Math.min(24, Math.ceil(Math.hypot(q.at[0] - p.at[0], q.at[1] - p.at[1]) / 24)), point = (s) => [p.at[0] + s * (q.at[0] - p.at[0]), p.at[1] + s * (q.at[1] - p.at[1])];
    for (let i = 0; i < n; i++) this.parts.push({ depth: p.v[2] + (i + 0.5) / n * (q.v[2] - p.v[2]) - 4e-3 * this.base.radius, at: [...point(i / n), ...point((i + 1) / n)], line, width: 1.3 });
  }
  solid(mesh, M, c, size, color, apart) {
    const { vertices, faces, dark, view, screen } = mesh, middle = this.screen(c), first = this.parts.length;
    if (!middle || middle[0] !== middle[0]) return;
    if (size * middle[2] < 4) { this.parts.push({ depth: c[2], at: middle, round: Math.max(1.5, 0.7 * size * middle[2]), fill: css(color, 0.85) }); return; }
    for (let i = 0; i < vertices.length; i += 3) {
      const v = apply(M, vertices[i], vertices[i + 1], vertices[i + 2]), p = this.screen([v[0] + c[0], v[1] + c[1], v[2] + c[2]]);
      if (!p) return;
      view[i] = v[0]; view[i + 1] = v[1]; view[i + 2] = v[2] + c[2];
      screen[i] = p[0]; screen[i + 1] = p[1];
    }
    for (let f = 0; f < faces.length; f += 4) {
      const [i, j, k, l] = [3 * faces[f], 3 * faces[f + 1], 3 * faces[f + 2], 3 * faces[f + 3]];
      const [x, y, u, v] = [screen[k] - screen[i], screen[k + 1] - screen[i + 1], screen[l] - screen[j], screen[l + 1] - screen[j + 1]];
      if (x * v - y * u >= 0) continue;  // seen from behind
      const d = [0, 1, 2].map((n) => view[k + n] - view[i + n]), e = [0, 1, 2].map((n) => view[l + n] - view[j + n]);
      const n = [d[1] * e[2] - d[2] * e[1], d[2] * e[0] - d[0] * e[2], d[0] * e[1] - d[1] * e[0]], size = Math.hypot(...n) || 1;
      // away is the left-handed third axis, so the product points inwards
      const lit = Math.max(0, -(n[0] * LIGHT[0] + n[1] * LIGHT[1] + n[2] * LIGHT[2]) / size), fill = css(color, (dark[f / 4] ? 0.75 : 1) * ((this.dark ? 0.3 : 0.6) + (this.dark ? 0.45 : 0.48) * lit));
      const corners = [screen[i], screen[i + 1], screen[j], screen[j + 1], screen[k], screen[k + 1], screen[l], screen[l + 1]];
      this.parts.push({ depth: Math.max(view[i + 2], view[j + 2], view[k + 2], view[l + 2]), at: corners, fill, line: this.alone ? fill : null, width: 1, alpha: this.alone ? 1 : 0.5 });
    }
    if (apart) this.solids.push({ M, corners: mesh.corners.map((p) => apply(M, ...p).map((x, i) => x + c[i])), faces: this.parts.slice(first) });
  }
  tintOf(run, line) {  // colour of the piece after a point: the mean of both ends
    const values = line.values[this.color], { low, high } = run.header.colors[this.color] || { low: 0, high: 1 }, plain = this.alone ? this.paint.none : this.runColor(run.index);
    if (!this.alone || !values) return () => plain;
    return (i, j) => {
      const a = run.mix(values, i, line.count), b = run.mix(values, j, line.count), v = a !== a ? b : b !== b ? a : 0.5 * (a + b);
      return v !== v ? plain : this.tones[Math.round(255 * Math.min(Math.max((v - low) / (high - low), 0), 1))];
    };
  }
  line(run, line, A, b) {
    const { count, points, place, edge, at, sides } = line, n = 3 * count, k = n * run.k, m = n * run.m, { f } = run, pieceColor = this.tintOf(run, line);
    const far = this.distance, own = this.scale, [w, h] = this.middle;
    const project = (x, y, z, to, j) => { const g = far + z, s = g > 0.02 * far ? own * far / g : NaN; to[j] = w + s * x; to[j + 1] = h - s * y; return s; };
    const view = (values, i, to, c0, c1, c2) => {
      let x = values[k + i], y = values[k + i + 1], z = values[k + i + 2];
      if (f) { x += f * (values[m + i] - x); y += f * (values[m + i + 1] - y); z += f * (values[m + i + 2] - z); }
      to[i] = A[0] * x + A[1] * y + A[2] * z + c0; to[i + 1] = A[3] * x + A[4] * y + A[5] * z + c1; to[i + 2] = A[6] * x + A[7] * y + A[8] * z + c2;
    };
    for (let i = 0, j = 0; i < n; i += 3, j += 4) {
      view(points, i, place, b[0], b[1], b[2]);
      at[i + 2] = project(place[i], place[i + 1], place[i + 2], at, i);
      if (!edge) continue;
      view(line.across, i, edge, 0, 0, 0);
      const size = 0.5 * line.width / (Math.hypot(edge[i], edge[i + 1], edge[i + 2]) || 1);
      for (let c = 0; c < 3; c++) edge[i + c] *= size;
      project(place[i] + edge[i], place[i + 1] + edge[i + 1], place[i + 2] + edge[i + 2], sides, j);
      project(place[i] - edge[i], place[i + 1] - edge[i + 1], place[i + 2] - edge[i + 2], sides, j + 2);
    }
    if (line.kind === "spring") { this.spring(run, line, pieceColor(0, count - 1)); return; }
    for (let i = 0; i + 1 < count; i++) if (at[3 * i] === at[3 * i] && at[3 * i + 3] === at[3 * i + 3]) this.piece(line, i, pieceColor(i, i + 1));
  }
  piece({ kind, width, place, edge, at, sides }, point, color) {
    const i = 3 * point, depth = 0.5 * (place[i + 2] + place[i + 5]) - 2e-3 * this.base.radius, thin = this.alone ? 2.4 : 2, straight = [at[i], at[i + 1], at[i + 3], at[i + 4]];
    const size = width ? width * 0.5 * (at[i + 2] + at[i + 5]) : 0;
    if (!edge) {
      const wide = kind === "rod" ? Math.max(size, thin) : thin;
      this.parts.push({ depth, at: straight, line: css(color, wide > thin ? 0.85 : 1), width: wide });
      if (wide > 2 * thin) this.parts.push({ depth: depth - 1e-9, at: straight, line: css(color, 1.12), width: 0.4 * wide });
      return;
    }
    const x = place[i + 3] - place[i], y = place[i + 4] - place[i + 1], z = place[i + 5] - place[i + 2], [u, v, w] = [edge[i], edge[i + 1], edge[i + 2]];
    const across = x * v - y * u, lit = Math.abs(across) / (Math.hypot(y * w - z * v, z * u - x * w, across) || 1), fill = css(color, 0.72 + 0.32 * lit), seen = lit * size, j = 4 * point;
    // seen on edge, or from far away, a strip is a line
    if (seen > 0.8) this.parts.push({ depth, at: [sides[j], sides[j + 1], sides[j + 4], sides[j + 5], sides[j + 6], sides[j + 7], sides[j + 2], sides[j + 3]], fill, line: fill, width: 0.7 });
    if (seen < thin) this.parts.push({ depth: depth - 1e-9, at: straight, line: fill, width: thin - 0.6 * seen });
  }
  // Quadrilaterals on the side from which each is seen, and the edge all around.
  surface(run, surface, A, b) {
    const { count, faces, each, rim, sides, values } = surface, half = 0.5 * surface.thickness, n = 3 * count, pieces = faces.length / 4 / each, across = Math.round(Math.sqrt(each));
    const tints = values[this.color], { low, high } = run.header.colors[this.color] || { low: 0, high: 1 }, plain = this.alone ? this.paint.none : this.runColor(run.index);
    for (let i = 0, j = 0; i < n; i += 3, j += 2) {
      const x = [0, 1, 2].map((c) => run.mix(surface.points, i + c, n)), v = [0, 1, 2].map((c) => run.mix(surface.normals, i + c, n)), size = half / (Math.hypot(...v) || 1);
      sides.forEach(({ place, at }, k) => {
        const h = k ? -size : size, p = apply(A, x[0] + h * v[0], x[1] + h * v[1], x[2] + h * v[2]);
        for (let c = 0; c < 3; c++) place[i + c] = p[c] + b[c];
        [at[j], at[j + 1]] = this.screen(place.subarray(i, i + 3)) ?? [NaN, NaN];
      });
    }
    const [upper, lower] = sides, corners = ({ at }, points) => points.flatMap((i) => [at[2 * i], at[2 * i + 1]]), known = (at) => at.every((x) => x === x);
    for (let f = 0; f < faces.length; f += 4) {
      const own = faces.slice(f, f + 4), seen = corners(upper, own);
      // pixels count downwards
      const front = (seen[4] - seen[0]) * (seen[7] - seen[3]) - (seen[5] - seen[1]) * (seen[6] - seen[2]) < 0, { place } = front ? upper : lower, at = front ? seen : corners(lower, own);
      if (!known(at)) continue;
      const [i, j, k, l] = own.map((x) => 3 * x), d = [0, 1, 2].map((c) => place[k + c] - place[i + c]), e = [0, 1, 2].map((c) => place[l + c] - place[j + c]);
      const N = [d[1] * e[2] - d[2] * e[1], d[2] * e[0] - d[0] * e[2], d[0] * e[1] - d[1] * e[0]], lit = Math.max(0, (front ? -1 : 1) * (N[0] * LIGHT[0] + N[1] * LIGHT[1] + N[2] * LIGHT[2]) / (Math.hypot(...N) || 1));
      const v = this.alone && tints ? run.mix(tints, Math.floor(f / 4 / each), pieces) : NaN, color = v === v ? this.tones[Math.round(255 * Math.min(Math.max((v - low) / (high - low), 0), 1))] : plain;
      const shade = (0.76 + 0.28 * lit) * (front ? 1 : 0.88), fill = css(color, shade), depth = 0.25 * (place[i + 2] + place[j + 2] + place[k + 2] + place[l + 2]);
      this.parts.push({ depth, at, fill, line: fill, width: 0.9, alpha: this.alone ? 1 : 0.6 });
      const piece = f / 4 % each, row = Math.floor(piece / across), column = piece % across;
      if (Math.abs((at[4] - at[0]) * (at[7] - at[3]) - (at[5] - at[1]) * (at[6] - at[2])) * each < MESH * MESH) continue;
      // lines between elements, over what is drawn of this one
      [column === 0, row === across - 1, column === across - 1, row === 0].forEach((edge, c) => {
        if (edge) this.parts.push({ depth: depth - 1e-9, at: [...at.slice(2 * c, 2 * c + 2), ...at.slice(2 * ((c + 1) % 4), 2 * ((c + 1) % 4) + 2)], line: css(color, 0.82 * shade), width: 0.8 });
      });
    }
    const edge = css(this.alone ? this.paint.none : this.runColor(run.index), 0.55);
    for (let r = 0; r < rim.length; r += 2) {
      const ends = [rim[r], rim[r + 1]], at = [...corners(upper, ends), ...corners(lower, ends.reverse())];
      if (known(at)) this.parts.push({ depth: 0.25 * ends.reduce((sum, i) => sum + upper.place[3 * i + 2] + lower.place[3 * i + 2], 0) - Math.min(1e-3 * this.base.radius, surface.thickness), at, fill: edge, line: edge, width: 1 });
    }
  }
  spring(run, line, color) {
    const { place, count, points } = line, p = [...place.slice(0, 3)], q = [...place.slice(3 * count - 3)], n = 3 * count - 3;
    if (p[0] !== p[0] || q[0] !== q[0]) return;
    line.rest ??= Math.hypot(points[n] - points[0], points[n + 1] - points[1], points[n + 2] - points[2]) || 1;
    const axis = [0, 1, 2].map((c) => q[c] - p[c]), length = Math.hypot(...axis) || 1e-9, z = axis.map((x) => x / length), turns = 9, steps = 14, radius = line.width ? 0.5 * line.width : 0.07 * line.rest;
    const s = Math.abs(z[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], cross = (a, c) => [a[1] * c[2] - a[2] * c[1], a[2] * c[0] - a[0] * c[2], a[0] * c[1] - a[1] * c[0]];
    let x = cross(z, s); const size = Math.hypot(...x); x = x.map((v) => v / size);
    const y = cross(z, x), path = [p];
    for (let i = 0; i <= turns * steps; i++) {
      const share = i / (turns * steps), angle = 2 * Math.PI * i / steps, along = length * (0.12 + 0.76 * share), [c, d] = [radius * Math.cos(angle), radius * Math.sin(angle)];
      path.push([0, 1, 2].map((k) => p[k] + z[k] * along + x[k] * c + y[k] * d));
    }
    path.push(q);
    for (let i = 0; i + 1 < path.length; i += steps / 2) {
      const some = path.slice(i, i + steps / 2 + 1), at = some.flatMap((v) => this.screen(v)?.slice(0, 2) ?? []);
      if (at.length > 2) this.parts.push({ depth: some[some.length >> 1][2], at, line: css(color), width: 2 });
    }
  }
  mark(run, mark, k, A, b) {
    const values = run.blocks[`mark ${k}`], n = 3 * mark.count;
    for (let i = 0; i < n; i += 3) {
      const v = apply(A, run.mix(values, i, n), run.mix(values, i + 1, n), run.mix(values, i + 2, n)).map((x, c) => x + b[c]), at = v[0] === v[0] ? this.screen(v) : null;
      if (at) this.parts.push({ depth: v[2] - (mark.size || 0) - 4e-3 * this.base.radius, at, round: Math.max(3.2, 0.5 * (mark.size || 0) * at[2]), fill: this.alone ? this.paint.ink : css(this.runColor(run.index)), line: this.dark ? "#1d2126" : "#ffffff", width: 1 });
    }
  }
  force(run, force, k, A, b) {
    const from = run.blocks[`force ${k} at`], along = run.blocks[`force ${k}`], factor = this.scales.get(force.unit) / force.scale, n = 3 * force.count, limit = 3e-3 * this.base.radius;
    for (let i = 0; i < n; i += 3) {
      const v = apply(A, run.mix(from, i, n), run.mix(from, i + 1, n), run.mix(from, i + 2, n)).map((x, c) => x + b[c]), e = apply(A, run.mix(along, i, n), run.mix(along, i + 1, n), run.mix(along, i + 2, n)).map((x) => x * factor), length = Math.hypot(...e);
      if (!(length > limit) || v[0] !== v[0]) continue;
      const p = this.screen(v), q = this.screen(v.map((x, c) => x + e[c]));
      if (p && q) this.arrow(p, q, v[2] + 0.5 * e[2] - 5e-3 * this.base.radius, force.unit === "N m");
    }
  }
  arrow(p, q, depth, twice = false) {  // twice: a moment, with two heads
    const [x, y] = [q[0] - p[0], q[1] - p[1]], length = Math.hypot(x, y), head = Math.min(9, 0.6 * length), [u, v] = length > 0.5 ? [x / length, y / length] : [0, 0];
    const line = this.paint.force, base = [q[0] - head * u, q[1] - head * v];
    const point = (cx, cy) => this.parts.push({ depth, fill: line, at: [cx, cy, cx - head * u - 0.4 * head * v, cy - head * v + 0.4 * head * u, cx - head * u + 0.4 * head * v, cy - head * v - 0.4 * head * u] });
    this.parts.push({ depth, at: [p[0], p[1], ...base], line, width: 1.8 });
    if (length > 2) { point(q[0], q[1]); if (twice) point(...base); }
  }
  write(text, x, y) {  // with a rim, so that it can be read over what is drawn
    Object.assign(this.pen, { lineWidth: 4, strokeStyle: this.paint.back });
    this.pen.strokeText(text, x, y);
    this.pen.fillText(text, x, y);
  }
  // Scale bar, arrows' scale, directions of the axes.
  measures() {
    const { pen, h, scale, paint } = this, length = nice(150 / scale), y = h - 14;
    pen.font = "12px system-ui, sans-serif";
    pen.fillStyle = paint.dim;
    const line = (at, color, width) => this.stroke({ at, line: color, width });
    line([14, y - 4, 14, y, 14 + length * scale, y, 14 + length * scale, y - 4], paint.dim, 1.4);
    this.write(quantity(length, "m"), 14 + length * scale + 7, y + 2);
    this.scaleText = quantity(length, "m");
    let row = y - 20;
    this.forceText = [];
    for (const [unit, perUnit] of this.arrows ? this.scales : []) {
      const size = nice(110 / (scale * perUnit)), to = 14 + size * perUnit * scale;
      this.parts = [];
      this.arrow([14, row], [to, row], 0, unit === "N m");
      for (const part of this.parts) this.stroke(part);
      pen.fillStyle = paint.dim;
      this.write(quantity(size, unit), to + 7, row + 4);
      this.forceText.push(quantity(size, unit));
      row -= 20;
    }
    const [x0, y0] = [44, row - 34];
    const axes = [["x", "#c0392b"], ["y", "#2e8b57"], ["z", "#2a6fbb"]].map(([name, color], c) => ({ x: this.C[c], up: this.C[3 + c], away: this.C[6 + c], name, color })).sort((a, b) => b.away - a.away);
    this.axisLabels = this.labelPlaces(axes);
    axes.forEach(({ x, up, away, name, color }, k) => {
      line([x0, y0, x0 + 28 * x, y0 - 28 * up], color, 1.8);
      if (Math.hypot(x, up) < 0.3) {  // towards the eye: a dot in a circle, away from it: a circle
        this.stroke({ at: [x0, y0], round: 4.5, line: color, width: 1.4 });
        if (away < 0) this.stroke({ at: [x0, y0], round: 1.6, fill: color });
      }
      pen.fillStyle = color;
      const [u, v] = this.axisLabels[k];
      this.write(name, x0 + u - 3, y0 - v + 4);
    });
    pen.fillStyle = paint.dim;
    this.write(this.inertial ? "inertial axes" : `axes of ${this.motions[0].header.main}`, x0 + 54, y0 + 4);
  }
  // Where the names of the axes stand, right and up of their origin, px: beyond the tips, and apart from one another.
  labelPlaces(axes) {
    const sum = axes.reduce(([x, up], a) => [x + a.x, up + a.up], [0, 0]), size = Math.hypot(...sum) || 1, found = [];
    for (const { x, up } of axes) {
      let place = Math.hypot(x, up) < 0.3 ? [-14 * sum[0] / size, -14 * sum[1] / size] : [36 * x, 36 * up];
      for (const other of found) {
        const gap = Math.hypot(place[0] - other[0], place[1] - other[1]);
        if (gap >= 13) continue;
        const [a, b] = gap > 1e-6 ? [(place[0] - other[0]) / gap, (place[1] - other[1]) / gap] : [0, 1];
        place = [other[0] + 13 * a, other[1] + 13 * b];
      }
      found.push(place);
    }
    return found;
  }
}
