// The motion of one run, or of several over one another, in three dimensions. Key frames come once, as one binary block
// (evolvent.animation.pack), and are interpolated here; nothing is asked of the server while it plays.
import { THREE, OrbitControls } from "nicegui-scene";

const VIRIDIS = [[68,1,84],[71,44,122],[59,82,139],[44,114,142],[33,145,140],[40,174,128],[94,201,98],[173,220,48],[253,231,37]].map((c) => c.map((x) => x / 255));
const RUNS_LIGHT = [[0.11, 0.12, 0.14], [0, 0.447, 0.698], [0.835, 0.369, 0], [0, 0.62, 0.451], [0.8, 0.475, 0.655]];
const RUNS_DARK = [[0.91, 0.92, 0.93], [0.3, 0.65, 0.88], [0.94, 0.5, 0.23], [0.18, 0.77, 0.59], [0.89, 0.6, 0.77]];
const SPEEDS = [0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500];

const DARK = 2;  // colours that are left out on dark pages, where they cannot be seen
const viridis = (x, out, k, first) => {
  const p = first + Math.min(Math.max(x, 0), 1) * (VIRIDIS.length - 1 - first), i = Math.min(Math.floor(p), VIRIDIS.length - 2), f = p - i;
  for (let c = 0; c < 3; c++) out[k + c] = VIRIDIS[i][c] + f * (VIRIDIS[i + 1][c] - VIRIDIS[i][c]);
};

// Lines of constant width on the screen: a quad for each piece, widened in the vertex shader.
const VERTEX = `
  attribute vec3 start, end, tint; uniform vec2 size; uniform float width; varying vec3 colour; varying float across;
  void main() {
    vec4 a = modelViewMatrix * vec4(start, 1.0), b = modelViewMatrix * vec4(end, 1.0);
    float near = -0.001;
    if (a.z > near && b.z < near) a = mix(a, b, (a.z - near) / (a.z - b.z));
    if (b.z > near && a.z < near) b = mix(b, a, (b.z - near) / (b.z - a.z));
    vec4 p = projectionMatrix * a, q = projectionMatrix * b;
    vec2 s = (q.xy / q.w - p.xy / p.w) * size;
    vec2 along = length(s) > 1e-4 ? normalize(s) : vec2(1.0, 0.0), side = vec2(-along.y, along.x);
    vec4 at = position.x < 0.5 ? p : q;
    float cap = position.x < 0.5 ? -0.35 : 0.35;
    at.xy += (side * position.y + along * cap) * (width + 1.0) / size * at.w;
    gl_Position = at; colour = tint; across = position.y * (width + 1.0);
  }`;
const FRAGMENT = `
  uniform float width, opacity; varying vec3 colour; varying float across;
  void main() { gl_FragColor = vec4(colour, opacity * clamp(0.5 * (width + 1.0) - abs(across) + 0.5, 0.0, 1.0)); }`;

class Strokes {
  constructor(count, width) {
    this.geometry = new THREE.InstancedBufferGeometry();
    this.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array([0, -0.5, 0, 1, -0.5, 0, 1, 0.5, 0, 0, 0.5, 0]), 3));
    this.geometry.setIndex([0, 1, 2, 0, 2, 3]);
    for (const name of ["start", "end", "tint"]) {
      const attribute = new THREE.InstancedBufferAttribute(new Float32Array(3 * count), 3);
      attribute.setUsage(THREE.DynamicDrawUsage);
      this.geometry.setAttribute(name, attribute);
      this[name] = attribute;
    }
    this.geometry.instanceCount = count;
    this.material = new THREE.ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, transparent: true,
      uniforms: { size: { value: new THREE.Vector2(1, 1) }, width: { value: width }, opacity: { value: 1 } } });
    this.mesh = new THREE.Mesh(this.geometry, this.material);
    this.mesh.frustumCulled = false;
  }
  touch() { for (const name of ["start", "end", "tint"]) this[name].needsUpdate = true; }
  fill(paths, colour) {
    let k = 0;
    for (const path of paths) for (let i = 0; i + 1 < path.length; i++, k += 3) {
      this.start.array.set(path[i], k); this.end.array.set(path[i + 1], k); this.tint.array.set(colour, k);
    }
    this.touch();
    return this;
  }
  free() { this.geometry.dispose(); this.material.dispose(); }
}
const pieces = (paths) => paths.reduce((n, path) => n + Math.max(path.length - 1, 0), 0);

const read = async (url) => {
  const answer = await fetch(url);
  if (!answer.ok) throw new Error(await answer.text());
  const buffer = await answer.arrayBuffer();
  const length = new DataView(buffer).getUint32(0, true);
  const data = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length;
  for (const block of data.blocks) {
    const count = block.shape.reduce((a, b) => a * b, 1);
    data[block.name] = new Float32Array(buffer, at, count);
    data[block.name].shape = block.shape;
    at += 4 * count;
  }
  return data;
};

// One run: its lines, body and arrows.
class Run {
  constructor(data, index, alone) {
    Object.assign(this, { data, index, alone });
    [this.frames, this.lines, this.nodes] = data.points.shape;
    this.group = new THREE.Group();
    this.now = new Float32Array(3 * this.lines * this.nodes);
    this.turns = 14;
    this.coil = 8 * this.turns + 2;
    const plain = (this.lines - data.coils) * (this.nodes - 1);
    this.strokes = new Strokes(plain + data.coils * this.coil, 3);
    this.group.add(this.strokes.mesh);
    if (data.body.length) {
      this.outline = new Strokes(pieces(data.body), 1.5);
      this.group.add(this.outline.mesh);
    }
    this.solids = data.solids.map((s) => {
      const round = s.kind === "cylinder";
      const shape = round ? new THREE.CylinderGeometry(s.size[0], s.size[1], s.size[2], 64) : new THREE.BoxGeometry(...s.size);
      const mesh = new THREE.Mesh(shape, new THREE.MeshLambertMaterial({ polygonOffset: true, polygonOffsetFactor: 4, polygonOffsetUnits: 4, transparent: !alone, opacity: alone ? 1 : 0.35 }));
      if (round) mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), new THREE.Vector3(...s.axis).normalize());
      mesh.position.set(...s.centre);
      this.group.add(mesh);
      return mesh;
    });
    // what turns bears marks, without which a round thing seems to stand still
    this.turning = data.solids.flatMap((s, k) => {
      const angle = data["turned " + k];
      if (!angle) return [];
      const [near, far, length] = [1.01 * s.size[1], 1.01 * s.size[0], 0.505 * s.size[2]];
      const marks = [[0, 1], [Math.PI, 0]].map(([turn, whole]) => {
        const [c, d] = [Math.cos(turn), Math.sin(turn)], ends = [[near * c, -length, near * d], [far * c, length, far * d]];
        return whole ? [[0, -length, 0], ...ends, [0, length, 0]] : ends;
      });
      const strokes = new Strokes(pieces(marks), 1.5);
      this.solids[k].add(strokes.mesh);
      return [{ mesh: this.solids[k], rest: this.solids[k].quaternion.clone(), axis: new THREE.Vector3(0, 1, 0), angle, marks, strokes }];
    });
    if (data.arrows) {
      this.many = data.at.shape[1];
      this.shafts = new Strokes(this.many, 2);
      this.heads = new THREE.InstancedMesh(new THREE.ConeGeometry(0.5, 1, 12).translate(0, -0.5, 0), new THREE.MeshBasicMaterial(), this.many);
      this.heads.frustumCulled = false;
      this.group.add(this.shafts.mesh, this.heads);
    }
  }
  paint(dark) {
    this.first = dark ? DARK : 0;
    const ink = dark ? [0.75, 0.78, 0.82] : [0.2, 0.22, 0.25];
    if (this.outline) this.outline.fill(this.data.body, ink);
    for (const { strokes, marks } of this.turning) strokes.fill(marks, ink);
    for (const mesh of this.solids) mesh.material.color.set(dark ? 0x5a636e : 0xc3cad2);
    this.ink = this.alone ? ink : (dark ? RUNS_DARK : RUNS_LIGHT)[this.index % 5];
    this.red = dark ? [1.0, 0.45, 0.35] : [0.78, 0.13, 0.1];
    if (this.heads) this.heads.material.color.setRGB(...this.red, THREE.SRGBColorSpace);
  }
  find(t) {
    const times = this.data.time;
    let low = 0, high = this.frames - 1;
    if (t >= times[high]) return [high, high, 0];
    while (high - low > 1) { const m = (low + high) >> 1; if (times[m] <= t) low = m; else high = m; }
    const gap = times[high] - times[low];
    return [low, high, gap > 0 ? Math.min(Math.max((t - times[low]) / gap, 0), 1) : 0];
  }
  show(t, options) {
    const { data, nodes, lines, now } = this;
    const [k, m, f] = this.find(t), size = now.length, p = data.points, a = k * size, b = m * size;
    for (let i = 0; i < size; i++) now[i] = p[a + i] + f * (p[b + i] - p[a + i]);
    if (options.inertial) {
      const angle = data.angle[k] + f * (data.angle[m] - data.angle[k]);
      const q = [0, 1, 2, 3].map((c) => data.tilt[4 * k + c] + f * (data.tilt[4 * m + c] - data.tilt[4 * k + c]));
      const tilt = new THREE.Quaternion(q[1], q[2], q[3], q[0]).normalize();
      this.group.quaternion.setFromAxisAngle(new THREE.Vector3(0, 0, 1), angle).multiply(tilt);
      this.group.position.set(...[0, 1, 2].map((c) => data.origin[3 * k + c] + f * (data.origin[3 * m + c] - data.origin[3 * k + c])));
    } else { this.group.quaternion.identity(); this.group.position.set(0, 0, 0); }
    for (const { mesh, rest, axis, angle } of this.turning) {
      mesh.quaternion.copy(rest).multiply(new THREE.Quaternion().setFromAxisAngle(axis, angle[k] + f * (angle[m] - angle[k])));
    }
    const scale = data.colors[options.colour] || data.colors[0], name = "color " + (data.colors[options.colour] ? options.colour : 0);
    const values = data[name], span = scale.high - scale.low || 1, each = nodes - 1;
    const { start, end, tint } = this.strokes, S = start.array, E = end.array, T = tint.array;
    let at = 0;
    for (let l = 0; l < lines; l++) {
      const first = 3 * l * nodes, value = (i) => { const x = values[(k * lines + l) * each + i], y = values[(m * lines + l) * each + i]; return isNaN(y) ? x : x + f * (y - x); };
      if (l < data.coils) { at = this.spring(first, value(0), scale, span, at); continue; }
      for (let i = 0; i < each; i++, at += 3) {
        const j = first + 3 * i, v = value(i);
        for (let c = 0; c < 3; c++) { S[at + c] = now[j + c]; E[at + c] = now[j + 3 + c]; }
        if (!this.alone || isNaN(v)) T.set(this.ink, at); else viridis((v - scale.low) / span, T, at, this.first);
      }
    }
    this.strokes.touch();
    if (this.shafts) this.push(k, m, f, options.arrows);
  }
  spring(first, v, scale, span, at) {  // a coil from end to end
    const { now } = this, S = this.strokes.start.array, E = this.strokes.end.array, T = this.strokes.tint.array;
    const p = new THREE.Vector3(now[first], now[first + 1], now[first + 2]), q = new THREE.Vector3(now[first + 3], now[first + 4], now[first + 5]);
    const axis = q.clone().sub(p), length = axis.length() || 1;
    axis.divideScalar(length);
    const x = Math.abs(axis.z) < 0.9 ? new THREE.Vector3(0, 0, 1).cross(axis).normalize() : new THREE.Vector3(1, 0, 0).cross(axis).normalize();
    const y = axis.clone().cross(x), radius = 0.09 * (this.rest = this.rest || length);
    const point = (i) => {
      if (i <= 0) return p; if (i >= this.coil) return q;
      const share = (i - 1) / (this.coil - 2), turn = 2 * Math.PI * this.turns * share;
      return p.clone().addScaledVector(axis, length * (0.1 + 0.8 * share)).addScaledVector(x, radius * Math.cos(turn)).addScaledVector(y, radius * Math.sin(turn));
    };
    let from = point(0);
    for (let i = 0; i < this.coil; i++, at += 3) {
      const to = point(i + 1);
      from.toArray(S, at); to.toArray(E, at);
      if (!this.alone || isNaN(v)) T.set(this.ink, at); else viridis((v - scale.low) / span, T, at, this.first);
      from = to;
    }
    return at;
  }
  push(k, m, f, shown) {
    const { data, many } = this, scale = data.arrows.longest / (data.arrows.largest || 1), S = this.shafts.start.array, E = this.shafts.end.array, T = this.shafts.tint.array;
    const matrix = new THREE.Matrix4(), up = new THREE.Vector3(0, 1, 0), turn = new THREE.Quaternion(), tip = new THREE.Vector3(), way = new THREE.Vector3();
    const head = 0.09 * data.arrows.longest;
    this.pushed = 0;
    for (let i = 0; i < many; i++) {
      const a = 3 * (k * many + i), b = 3 * (m * many + i), at = 3 * i;
      let n = 0;
      for (let c = 0; c < 3; c++) {
        const x = data.at[a + c] + f * (data.at[b + c] - data.at[a + c]);
        let F = data.force[a + c] + f * (data.force[b + c] - data.force[a + c]);
        if (!shown || isNaN(F)) F = 0;
        S[at + c] = x; E[at + c] = x + scale * F; n += (scale * F) ** 2;
      }
      T.set(this.red, at);
      n = Math.sqrt(n);
      if (n > 0.004 * data.arrows.longest) {
        this.pushed++;
        way.set(E[at] - S[at], E[at + 1] - S[at + 1], E[at + 2] - S[at + 2]).divideScalar(n);
        tip.fromArray(E, at);
        const size = Math.min(head, 0.6 * n);
        matrix.compose(tip, turn.setFromUnitVectors(up, way), new THREE.Vector3(size, 1.6 * size, size));
      } else { matrix.makeScale(0, 0, 0); E.set([S[at], S[at + 1], S[at + 2]], at); }
      this.heads.setMatrixAt(i, matrix);
    }
    this.heads.visible = this.shafts.mesh.visible = this.pushed > 0;
    this.heads.instanceMatrix.needsUpdate = true;
    this.shafts.touch();
  }
}

export default {
  template: `
  <div class="ev-motion">
    <div class="ev-view" ref="view"><canvas ref="canvas"></canvas>
      <div class="ev-numbers" v-if="ready && runs === 1"><div v-for="[name, value] in numbers"><span>{{ name }}</span><b>{{ value }}</b></div></div>
      <div class="ev-numbers" v-if="ready && runs > 1"><div v-for="(name, k) in labels"><i :style="{ background: swatch(k) }"></i><span>{{ name }}</span></div></div>
      <div class="ev-bar" v-if="ready && runs === 1"><div>{{ scale.label }}</div><div class="ev-scale"></div><div class="ev-ends"><span>{{ short(scale.low) }}</span><span>{{ short(scale.high) }}</span></div></div>
      <div class="ev-key" v-if="ready && arrowLabel && arrows && runs === 1"><i></i>{{ arrowLabel }}, up to {{ short(arrowLargest) }}</div>
      <div class="ev-views" v-show="ready"><button @click="look('free')" title="all of it, from the side and above" data-testid="view-free">3-D</button><button @click="look('top')" title="along the z axis" data-testid="view-top">top</button><button @click="look('side')" title="along the y axis" data-testid="view-side">side</button><button @click="close()" title="near the body" data-testid="view-near">near</button></div>
      <div class="ev-note" v-if="note">{{ note }}</div>
    </div>
    <div class="ev-player" v-show="ready">
      <button class="ev-play" data-testid="play" @click="toggle()">{{ playing ? "Pause" : "Play" }}</button>
      <input type="range" min="0" max="1000" step="any" :value="share" @input="scrub" aria-label="time" data-testid="scrub">
      <span class="ev-time" data-testid="time">{{ clock }}</span>
      <label>speed <select v-model.number="speed" data-testid="speed"><option v-for="s in speeds" :value="s">{{ s }}×</option></select></label>
      <label>seen from <select v-model="frame" data-testid="frame"><option value="body">the body</option><option value="inertial">inertial space</option></select></label>
      <label v-if="colours.length > 1 && runs === 1">colour <select v-model.number="colour" data-testid="colour"><option v-for="(c, k) in colours" :value="k">{{ c.label }}</option></select></label>
      <label v-if="arrowLabel"><input type="checkbox" v-model="arrows" data-testid="arrows"> forces</label>
    </div>
  </div>`,
  props: { urls: Array, labels: Array, fullscreen: Boolean },
  data: () => ({ ready: false, note: "loading the motion", playing: false, clock: "", share: 0, speed: 1, speeds: SPEEDS, frame: "body", colour: 0,
    colours: [], arrows: true, arrowLabel: "", arrowLargest: 0, numbers: [], runs: 0 }),
  computed: { scale() { return this.colours[this.colour] || { label: "", low: 0, high: 1 }; } },
  async mounted() {
    const raw = this.raw = { motions: [], dirty: true, at: 0, last: null, times: [] };
    this.$el.ev = raw;
    let loaded;
    try {
      loaded = await Promise.all(this.urls.map(read));
    } catch (error) { this.note = error.message || String(error); return; }
    if (this.gone) return;
    try {
      raw.renderer = new THREE.WebGLRenderer({ canvas: this.$refs.canvas, antialias: true, alpha: true });
    } catch (error) { this.note = "this browser offers no WebGL, so the motion cannot be drawn; charts and numbers are below"; return; }
    raw.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    raw.scene = new THREE.Scene();
    raw.scene.add(new THREE.AmbientLight(0xffffff, 1.7));
    const sun = new THREE.DirectionalLight(0xffffff, 1.8); sun.position.set(1, -2, 3); raw.scene.add(sun);
    raw.motions = loaded.map((data, k) => new Run(data, k, loaded.length === 1));
    for (const motion of raw.motions) raw.scene.add(motion.group);
    const data = loaded[0];
    const extent = (s) => Math.hypot(...s.centre) + Math.hypot(s.size[0], 0.5 * s.size[2]);
    raw.reach = Math.max(...loaded.map((d) => Math.max(d.reach, ...d.solids.map(extent))));
    raw.begin = Math.min(...loaded.map((d) => d.time[0]));
    raw.end = Math.max(...loaded.map((d) => d.time[d.time.length - 1]));
    raw.now = raw.end;
    raw.camera = new THREE.PerspectiveCamera(35, 1, raw.reach * 0.001, raw.reach * 100);
    raw.camera.up.set(0, 0, 1);
    raw.controls = new OrbitControls(raw.camera, this.$refs.canvas);
    raw.controls.addEventListener("change", () => { raw.dirty = true; });
    const wanted = (raw.end - raw.begin) / 20;
    this.speed = SPEEDS.reduce((a, b) => (Math.abs(Math.log(b / wanted)) < Math.abs(Math.log(a / wanted)) ? b : a));
    this.colours = data.colors;
    if (data.arrows) { this.arrowLabel = data.arrows.label; this.arrowLargest = data.arrows.largest; }
    this.runs = loaded.length;
    this.paint();
    this.look("free");
    this.ready = true; this.note = "";
    this.sizes = new ResizeObserver(() => this.resize()); this.sizes.observe(this.$refs.view);
    this.theme = new MutationObserver(() => this.paint()); this.theme.observe(document.body, { attributes: true, attributeFilter: ["class"] });
    this.onSeek = (e) => { this.playing = false; this.go(e.detail); };
    window.addEventListener("evolvent-seek", this.onSeek);
    this.onKey = (e) => { if (e.key === " " && e.target === document.body) { e.preventDefault(); this.toggle(); } };
    window.addEventListener("keydown", this.onKey);
    this.$nextTick(() => { this.resize(); this.go(raw.end); raw.request = requestAnimationFrame(this.tick); });
  },
  beforeUnmount() {
    this.gone = true;
    const raw = this.raw;
    cancelAnimationFrame(raw.request);
    window.removeEventListener("evolvent-seek", this.onSeek); window.removeEventListener("keydown", this.onKey);
    this.sizes?.disconnect(); this.theme?.disconnect();
    raw.controls?.dispose(); raw.renderer?.dispose(); raw.renderer?.forceContextLoss();
  },
  watch: { frame() { this.raw.dirty = true; }, colour() { this.raw.dirty = true; }, arrows() { this.raw.dirty = true; } },
  methods: {
    short(x) { return Math.abs(x) >= 1e4 || (x !== 0 && Math.abs(x) < 1e-3) ? x.toExponential(2) : +x.toPrecision(3); },
    swatch(k) { const c = (document.body.classList.contains("body--dark") ? RUNS_DARK : RUNS_LIGHT)[k % 5]; return `rgb(${c.map((x) => Math.round(255 * x)).join(",")})`; },
    paint() {
      const raw = this.raw, dark = document.body.classList.contains("body--dark");
      if (raw.floor) { raw.scene.remove(raw.floor); raw.floor.traverse((o) => { o.geometry?.dispose(); o.material?.dispose(); }); }
      raw.floor = new THREE.Group();
      const rings = [], ring = raw.motions[0].data.ring;
      for (let r = ring; r <= raw.reach * 1.001; r += ring) rings.push(Array.from({ length: 97 }, (_, i) => [r * Math.cos(i * Math.PI / 48), r * Math.sin(i * Math.PI / 48), 0]));
      const grey = dark ? [0.25, 0.27, 0.3] : [0.86, 0.88, 0.9], axis = dark ? [0.5, 0.53, 0.57] : [0.55, 0.58, 0.62];
      if (rings.length) raw.floor.add(new Strokes(pieces(rings), 1).fill(rings, grey).mesh);
      const length = 0.25 * raw.reach, axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((a) => [[0, 0, 0], a.map((x) => x * length)]);
      raw.floor.add(new Strokes(3, 1.2).fill(axes, axis).mesh);
      const css = `rgb(${axis.map((x) => Math.round(255 * x)).join(",")})`;
      rings.forEach((path, i) => raw.floor.add(this.label(`${+((i + 1) * ring).toPrecision(3)} m`, path[94], css)));
      ["x", "y", "z"].forEach((name, i) => raw.floor.add(this.label(name, axes[i][1], css)));
      raw.scene.add(raw.floor);
      for (const motion of raw.motions) motion.paint(dark);
      this.resize();
    },
    label(text, at, colour) {
      const canvas = document.createElement("canvas"), pen = canvas.getContext("2d");
      canvas.width = 128; canvas.height = 40;
      pen.font = "26px system-ui, sans-serif"; pen.fillStyle = colour; pen.fillText(text, 8, 30);
      const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: new THREE.CanvasTexture(canvas), sizeAttenuation: false, depthTest: false, transparent: true }));
      sprite.scale.set(0.064, 0.02, 1); sprite.center.set(0, 0.2); sprite.position.set(...at);
      return sprite;
    },
    resize() {
      const raw = this.raw, view = this.$refs.view;
      if (!raw.renderer || !view.clientWidth) return;
      raw.renderer.setSize(view.clientWidth, view.clientHeight, false);
      raw.camera.aspect = view.clientWidth / view.clientHeight; raw.camera.updateProjectionMatrix();
      raw.scene.traverse((o) => { if (o.material?.uniforms) o.material.uniforms.size.value.set(view.clientWidth, view.clientHeight); });
      raw.dirty = true;
    },
    look(way, size) {
      const raw = this.raw, far = (size || raw.reach) * 2.6, aspect = Math.max(1, 1.35 / (raw.camera.aspect || 1.35));
      const to = { free: [0.45, -0.75, 0.55], top: [0, -0.0001, 1], side: [0, -1, 0.0001] }[way];
      const n = Math.hypot(...to);
      raw.camera.position.set(...to.map((x) => (x / n) * far * aspect)); raw.controls.target.set(0, 0, 0); raw.controls.update(); raw.dirty = true;
    },
    close() {
      const solids = this.raw.motions[0].data.solids, body = this.raw.motions[0].data.body.flat();
      const sizes = [...solids.map((s) => Math.hypot(...s.centre) + Math.max(s.size[0], 0.5 * s.size[2])), ...body.map((p) => Math.hypot(...p))];
      this.look("free", sizes.length ? Math.min(1.2 * Math.max(...sizes), this.raw.reach) : 0.5 * this.raw.reach);
    },
    toggle() {
      const raw = this.raw;
      if (!this.playing && raw.now >= raw.end) raw.now = raw.begin;
      this.playing = !this.playing;
    },
    scrub(e) { this.playing = false; this.go(this.raw.begin + e.target.value / 1000 * (this.raw.end - this.raw.begin)); },
    go(t) { const raw = this.raw; raw.now = Math.min(Math.max(t, raw.begin), raw.end); raw.dirty = true; },
    tick(clock) {
      const raw = this.raw;
      raw.request = requestAnimationFrame(this.tick);
      const gap = raw.last === null ? 0 : clock - raw.last;
      raw.last = clock;
      if (this.playing) {
        raw.now += Math.min(gap, 250) / 1000 * this.speed;
        if (raw.now >= raw.end) { raw.now = raw.end; this.playing = false; }
        raw.dirty = true;
      }
      if (!raw.dirty) return;
      raw.dirty = false;
      const began = performance.now(), options = { inertial: this.frame === "inertial", colour: this.colour, arrows: this.arrows };
      for (const motion of raw.motions) motion.show(raw.now, options);
      raw.renderer.render(raw.scene, raw.camera);
      if (this.playing && gap) { raw.times.push([gap, performance.now() - began]); if (raw.times.length > 2000) raw.times.shift(); }
      this.share = 1000 * (raw.now - raw.begin) / (raw.end - raw.begin || 1);
      this.clock = raw.now.toFixed(raw.end < 10 ? 3 : 2) + " s";
      if (this.runs === 1) {
        const { data } = raw.motions[0], [k, m, f] = raw.motions[0].find(raw.now);
        this.numbers = data.numbers.map((name, i) => { const v = data["number " + i], x = v[k], y = v[m]; return [name, isNaN(x) ? "-" : (isNaN(y) ? x : x + f * (y - x)).toPrecision(4)]; });
      }
      window.evolventTime = raw.now;
      window.dispatchEvent(new CustomEvent("evolvent-time", { detail: raw.now }));
    },
  },
};
