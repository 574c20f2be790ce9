// The viewer of motions: a picture with controls and keys. The HTML page of a run and the studio both use it.
import { css, quantity, tones } from "./motion.js";
import { Picture } from "./picture.js";

const SPEEDS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const KEYS = [["space", "play, pause"], ["← →", "one frame back, one on"], ["Home, End", "first frame, last frame"], ["b", "inertial axes or body axes"],
  ["t", "trails of the tips; click a point for its own"], ["a", "arrows of the forces"], ["m", "symbols of joints, motors and other parts"], ["c", "camera follows the body"], ["g", "floor grid"],
  ["1 … 9", "the views of the buttons"], ["r", "reset the view"], ["+ −", "faster, slower"], ["i o", "zoom in, out"], ["f", "full screen"], ["?", "this list"],
  ["drag", "turn; with shift or the right button: move"], ["wheel, two fingers", "zoom"]];
const STYLE = `
.ev3 { --ink: #1f242a; --dim: #5c6670; --line: #d5dae0; --back: #ffffff; position: relative; display: flex; flex-direction: column; color: var(--ink);
  background: var(--back); font: 13px/1.4 system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; outline: none; min-height: 0; }
.ev3.dark { --ink: #e4e7eb; --dim: #9aa4b0; --line: #353c44; --back: #1d2126; }
.ev3-view { position: relative; flex: 1; min-height: 0; overflow: hidden; }
.ev3 canvas { position: absolute; inset: 0; width: 100%; height: 100%; display: block; cursor: grab; touch-action: none; }
.ev3-numbers { position: absolute; left: 6px; top: 6px; padding: 2px 6px; border-collapse: separate; border-spacing: 0; border-radius: 4px; pointer-events: none; font-variant-numeric: tabular-nums;
  background: color-mix(in srgb, var(--back) 82%, transparent); }
.ev3-numbers td { padding: 0 10px 0 0; } .ev3-numbers td:last-child { padding: 0; } .ev3-numbers td:first-child { color: var(--dim); } .ev3-numbers i { display: inline-block; width: 16px; height: 3px; margin-right: 6px; vertical-align: middle; }
.ev3-bar { position: absolute; right: 12px; top: 8px; text-align: right; pointer-events: none; width: 170px; }
.ev3-scale { height: 9px; border-radius: 2px; margin: 2px 0; } .ev3-ends { display: flex; justify-content: space-between; white-space: nowrap; gap: 8px; color: var(--dim); font-variant-numeric: tabular-nums; }
.ev3-views { position: absolute; right: 10px; bottom: 8px; display: flex; gap: 4px; }
.ev3-foot { display: flex; flex-wrap: wrap; gap: 6px 10px; align-items: center; padding: 7px 12px; border-top: 1px solid var(--line); }
.ev3 button, .ev3 select { font: inherit; color: var(--ink); background: var(--back); border: 1px solid var(--line); border-radius: 4px; padding: 2px 8px; cursor: pointer; }
.ev3-views button { padding: 0 7px; color: var(--dim); font-size: 12px; }
.ev3-play { width: 5.2em; } .ev3-foot input[type=range] { flex: 1 1 150px; min-width: 110px; } .ev3-foot label { color: var(--dim); white-space: nowrap; }
.ev3-time { min-width: 6.5em; font-variant-numeric: tabular-nums; }
.ev3-panel { position: absolute; right: 10px; bottom: 40px; max-height: 75%; overflow: auto; background: var(--back); border: 1px solid var(--line); border-radius: 6px; padding: 8px 12px; box-shadow: 0 2px 10px #0003; }
.ev3-panel label { display: block; cursor: pointer; } .ev3-panel td { padding: 0 12px 0 0; } .ev3-panel td:first-child { color: var(--dim); white-space: nowrap; }
.ev3 [hidden] { display: none; }
@media (max-width: 560px) { .ev3-view { display: grid; grid-template-rows: auto minmax(0, 1fr); } .ev3-numbers { position: static; grid-row: 1; padding: 6px 12px 2px; } .ev3-numbers td:last-child { padding: 0 10px 0 0; } .ev3-numbers tbody { display: flex; flex-wrap: wrap; } .ev3 canvas, .ev3-bar, .ev3-views, .ev3-panel { grid-row: 2; }
  .ev3-bar { width: 132px; top: auto; bottom: 10px; } .ev3-numbers { font-size: 11.5px; } .ev3-views { top: 8px; bottom: auto; flex-direction: column; } }`;

const element = (tag, properties = {}, ...children) => {
  const { testid, class: name, ...rest } = properties, made = Object.assign(document.createElement(tag), rest);
  if (testid) made.dataset.testid = testid;
  if (name) made.className = name;
  made.append(...children);
  return made;
};

export class Viewer extends Picture {
  constructor(host, motions, { names = [], playing = false, dark = false, onTime = null } = {}) {
    super(element("canvas"), motions);
    Object.assign(this, { host, names, onTime, playing, last: null, times: [] });
    this.build(this.motions[0].header);
    this.theme(dark);
    this.sizes = new ResizeObserver(() => this.redraw());
    this.sizes.observe(this.canvas);
    this.onKey = (e) => this.key(e);
    window.addEventListener("keydown", this.onKey);
    this.redraw();
  }
  free() { cancelAnimationFrame(this.request); window.removeEventListener("keydown", this.onKey); this.sizes.disconnect(); this.host.replaceChildren(); }
  theme(dark) {
    this.host?.classList.toggle("dark", dark);
    if (this.toneBox) this.toneBox.style.background = `linear-gradient(to right,${tones(dark, 10).map((c) => css(c)).join(",")})`;
    super.theme(dark);
  }

  // -------------------------------------------------------------------------------------------- controls

  build(header) {
    if (!document.getElementById("ev3-style")) document.head.append(element("style", { id: "ev3-style", textContent: STYLE }));
    const { host } = this, frame = header.main;
    host.classList.add("ev3");
    host.tabIndex = -1;
    this.numbers = element("table", { class: "ev3-numbers", testid: "numbers" });
    this.cells = [];  // of its rows, with what they show
    this.barName = element("div", { testid: "color-name" });
    [this.low, this.high] = [element("span", { testid: "color-low" }), element("span", { testid: "color-high" })];
    this.toneBox = element("div", { class: "ev3-scale" });
    this.bar = element("div", { class: "ev3-bar" }, this.barName, this.toneBox, element("div", { class: "ev3-ends" }, this.low, this.high));
    const button = (text, testid, title, act) => element("button", { type: "button", textContent: text, title, testid, onclick: (e) => { act(); e.currentTarget.blur(); } });
    const views = element("div", { class: "ev3-views" }, ...header.views.map((view) => button(view.name, `view-${view.name}`, view.about, () => this.view(view))));
    this.panel = element("div", { class: "ev3-panel", hidden: true, testid: "panel" });
    const view = element("div", { class: "ev3-view" }, this.canvas, this.numbers, this.bar, views, this.panel);
    this.playButton = button("", "play", "space", () => this.toggle());
    this.playButton.classList.add("ev3-play");
    this.scrub = element("input", { type: "range", min: 0, max: 1000, step: "any", value: 0, ariaLabel: "time", testid: "scrub",
      oninput: () => { this.play(false); this.go(this.begin + this.scrub.value / 1000 * (this.end - this.begin)); } });
    this.clock = element("span", { class: "ev3-time", testid: "time" });
    const select = (testid, options, chosen, act) => {
      const made = element("select", { testid, onchange: () => { act(made.value); made.blur(); } });
      for (const [value, text] of options) made.add(new Option(text, value, false, String(value) === String(chosen)));
      return made;
    };
    const rates = [...new Set([...SPEEDS, header.speed])].sort((a, b) => a - b);
    this.speed = header.speed;
    this.speedBox = select("speed", rates.map((s) => [s, `${s}×`]), header.speed, (s) => { this.speed = Number(s); });
    this.axesBox = select("axes", [["inertial", "inertial"], ["body", `of ${frame}`]], "inertial", (a) => this.axes(a === "inertial"));
    this.colorBox = select("color", header.colors.map((c, k) => [k, c.name]), 0, (k) => { this.color = Number(k); this.legend(); this.redraw(); });
    this.arrowBox = element("input", { type: "checkbox", checked: true, testid: "arrows", onchange: () => { this.arrows = this.arrowBox.checked; this.redraw(); } });
    this.symbolBox = element("input", { type: "checkbox", checked: true, testid: "symbols", onchange: () => { this.symbols = this.symbolBox.checked; this.redraw(); } });
    const symbols = new Set(this.motions.flatMap((m) => m.header.symbols.map((f) => f.name)));
    const forces = new Set(this.motions.flatMap((m) => m.header.forces.map((f) => f.name)));
    const shown = (test, ...parts) => { const label = element("label", {}, ...parts); label.hidden = !test; return label; };
    const full = button("full screen", "full", "f", () => this.full());
    full.hidden = !document.fullscreenEnabled;
    const foot = element("div", { class: "ev3-foot" }, this.playButton, this.scrub, this.clock, shown(true, "speed ", this.speedBox),
      shown(frame !== null, "axes ", this.axesBox), shown(this.alone && header.colors.length > 1, "colour ", this.colorBox),
      shown(forces.size, Object.assign(element("span", {}, this.arrowBox, " forces"), { title: [...forces].join(", ") })),
      shown(symbols.size, Object.assign(element("span", {}, this.symbolBox, " symbols"), { title: [...symbols].join(", ") })), button("trails", "trails", "t", () => this.open(this.chooseTrails())),
      full, button("?", "help", "keys", () => this.open(this.keys())));
    host.replaceChildren(view, foot);
    this.legend();
    this.play(this.playing);
    this.pointers(this.canvas);
  }
  legend() {
    const color = this.motions[0].header.colors[this.color];
    this.bar.hidden = !color || !this.alone;
    if (!color) return;
    this.barName.textContent = color.name;
    this.low.textContent = (color.below ? "\u2264 " : "") + quantity(color.low, color.unit);  // values beyond have its colour
    this.high.textContent = (color.above ? "\u2265 " : "") + quantity(color.high, color.unit);
  }
  open(content) {  // a panel over the picture; the same again closes it
    const same = !this.panel.hidden && this.panel.dataset.what === content.dataset.what;
    this.panel.hidden = same;
    this.panel.dataset.what = content.dataset.what;
    this.panel.replaceChildren(content);
  }
  keys() {
    const table = element("table", {}, ...KEYS.map(([key, what]) => element("tr", {}, element("td", { textContent: key }), element("td", { textContent: what }))));
    table.dataset.what = "keys";
    return table;
  }
  chooseTrails() {
    const list = element("div");
    list.dataset.what = "trails";
    for (const run of this.motions) for (const point of run.traceable) {
      const box = element("input", { type: "checkbox", checked: this.trails.some((t) => t.point === point), onchange: () => this.trail(run, point) });
      list.append(element("label", {}, box, ` ${this.alone ? "" : `${this.names[run.index] ?? run.index + 1}: `}${point.name}`));
    }
    return list;
  }
  allTrails() {
    this.trails = this.trails.length ? [] : this.motions.flatMap((run) => run.traceable.filter((p) => p.tip).slice(0, 8).map((point) => ({ run, point })));
    this.panel.hidden = true;
    this.redraw();
  }
  redraw() { super.redraw(); this.wake(); }
  wake() { this.request ||= requestAnimationFrame((clock) => this.tick(clock)); }  // a still picture asks for no frames
  play(on) { this.playing = on; this.wake(); this.playButton.textContent = on ? "Pause" : "Play"; }
  toggle() { if (!this.playing && this.now >= this.end) this.go(this.begin); this.play(!this.playing); }
  go(t) { this.now = Math.min(Math.max(t, this.begin), this.end); this.redraw(); }
  step(by) {
    const run = this.motions[0];
    this.play(false);
    run.at(this.now);
    const on = run.f > 1e-6 ? (by > 0 ? 1 : 0) : by;
    this.go(run.time[Math.min(Math.max(run.k + on, 0), run.frames - 1)]);
  }
  axes(inertial) {
    this.inertial = inertial || this.motions[0].header.main === null;
    this.axesBox.value = this.inertial ? "inertial" : "body";
    this.base = this.extent(this.base.azimuth, this.base.elevation, this.inertial, this.follow, this.base.what);
    this.redraw();
  }
  full() {
    const done = document.fullscreenElement ? document.exitFullscreen() : this.host.requestFullscreen?.();
    done?.catch(() => {});  // refused, in a frame of another page
  }
  key(e) {
    const box = e.target;
    const onTab = e.key === " " && box.closest?.('[role="tab"]');  // the space bar does nothing else there
    if (e.ctrlKey || e.metaKey || e.altKey || !(box === document.body || this.host.contains(box) || onTab)) return;
    if (box.tagName === "SELECT" || box.tagName === "TEXTAREA" || (box.tagName === "INPUT" && !["range", "checkbox"].includes(box.type))) return;
    const act = { " ": () => this.toggle(), ArrowLeft: () => this.step(-1), ArrowRight: () => this.step(1), Home: () => { this.play(false); this.go(this.begin); },
      End: () => { this.play(false); this.go(this.end); }, f: () => this.full(), b: () => this.axes(!this.inertial), t: () => this.allTrails(),
      a: () => this.arrowBox.click(), m: () => this.symbolBox.click(), c: () => { this.follow = !this.follow; this.axes(this.inertial); }, g: () => { this.grid = !this.grid; this.redraw(); },
      r: () => this.view(this.motions[0].header.views[0]), "+": () => this.faster(1), "=": () => this.faster(1), "-": () => this.faster(-1), i: () => this.zoom(1.25), o: () => this.zoom(0.8),
      "?": () => this.open(this.keys()), Escape: () => { this.panel.hidden = true; } }[e.key.length === 1 ? e.key.toLowerCase() : e.key];
    const view = /^[1-9]$/.test(e.key) ? this.host.querySelectorAll(".ev3-views button")[Number(e.key) - 1] : null;
    if (!act && !view) return;
    e.preventDefault();
    act ? act() : view.click();
  }
  faster(by) {  // the next speed of the list, or the one before
    const { options, selectedIndex: k } = this.speedBox, next = Math.min(Math.max(k + by, 0), options.length - 1);
    this.speedBox.selectedIndex = next;
    this.speed = Number(options[next].value);
  }
  pointers(canvas) {  // mouse and fingers
    const held = new Map();
    let moved = 0, spread = 0;
    const gap = () => { const [a, b] = [...held.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
    canvas.oncontextmenu = (e) => e.preventDefault();
    canvas.onpointerdown = (e) => {
      held.set(e.pointerId, [e.clientX, e.clientY]);
      canvas.setPointerCapture(e.pointerId);
      moved = 0;
      if (held.size === 2) spread = gap();
    };
    canvas.onpointermove = (e) => {
      const before = held.get(e.pointerId);
      if (!before) { this.point(e); return; }
      const dx = e.clientX - before[0], dy = e.clientY - before[1];
      held.set(e.pointerId, [e.clientX, e.clientY]);
      moved += Math.abs(dx) + Math.abs(dy);
      if (held.size === 2) { this.pan(dx / 2, dy / 2); const now = gap(); this.zoom(now / (spread || now)); spread = now; return; }
      if (e.shiftKey || e.buttons & 2) { this.pan(dx, dy); return; }
      this.camera.azimuth -= dx * 0.008;
      this.camera.elevation = Math.min(Math.max(this.camera.elevation + dy * 0.008, -Math.PI / 2), Math.PI / 2);
      this.redraw();
    };
    canvas.onpointerup = (e) => {
      held.delete(e.pointerId);
      if (moved < 4) { const box = canvas.getBoundingClientRect(); this.pick(e.clientX - box.left, e.clientY - box.top); }
    };
    canvas.onpointercancel = (e) => held.delete(e.pointerId);
    canvas.addEventListener("wheel", (e) => { e.preventDefault(); this.zoom(Math.exp(-e.deltaY * 0.0012)); }, { passive: false });
  }
  near(x, y, test = () => true) {  // the spot of the picture next to a place; null for none
    return (this.spots || []).filter(test).map((s) => [Math.hypot(s.x - x, s.y - y), s]).filter(([d]) => d < 14).sort((a, b) => a[0] - b[0])[0]?.[1] ?? null;
  }
  pick(x, y) {
    const spot = this.near(x, y, (s) => s.point);
    if (spot) this.trail(spot.run, spot.point);
  }
  point(e) {  // the names of what is under the pointer
    const box = this.canvas.getBoundingClientRect(), [x, y] = [e.clientX - box.left, e.clientY - box.top];
    const found = (this.spots || []).filter((s) => Math.hypot(s.x - x, s.y - y) < 14).map((s) => s.name ?? s.point.name);
    this.canvas.title = [...new Set(found)].slice(0, 6).join(", ");
  }

  // -------------------------------------------------------------------------------------------- time

  tick(clock) {
    const gap = this.last === null ? 0 : clock - this.last;
    this.last = this.playing ? clock : null;
    this.request = 0;
    if (this.playing) {
      this.now += Math.min(gap, 250) / 1000 * this.speed;
      if (this.now >= this.end && this.motions[0].header.repeats) this.now = this.begin + (this.now - this.begin) % (this.end - this.begin || 1);
      else if (this.now >= this.end) { this.now = this.end; this.play(false); }
      this.dirty = true;
      this.wake();
    }
    if (!this.dirty) return;
    this.dirty = false;
    const began = performance.now();
    this.draw();
    if (this.playing && gap) { this.times.push([gap, performance.now() - began]); if (this.times.length > 2000) this.times.shift(); }
    this.scrub.value = 1000 * (this.now - this.begin) / (this.end - this.begin || 1);
    this.clock.textContent = `${this.now.toFixed(this.end < 10 ? 3 : 2)} s`;
    this.tell();
    this.onTime?.(this.now);
  }
  tell() {  // numbers beside the picture, or the names of runs
    const rows = [];
    if (this.alone) {
      const [run] = this.motions;
      rows.push(["time", `${this.now.toFixed(this.end < 10 ? 3 : 2)} s`]);
      if (run.header.magnification !== 1) rows.push(["displacements", `enlarged ${run.header.magnification} times`]);
      run.header.numbers.forEach(([name, unit], i) => {
        const values = run.blocks[`number ${i}`], a = values[run.k], b = run.f ? values[run.m] : a;
        const x = b === b ? a + run.f * (b - a) : a;
        rows.push([name, x === x ? `${x && Math.abs(x) < 1e-3 ? x.toExponential(3) : x.toPrecision(4)} ${unit}` : "-"]);
      });
    } else this.motions.forEach(({ header: { magnification: m } }, k) => rows.push([this.names[k] ?? `run ${k + 1}`, m === 1 ? "" : `displacements enlarged ${m} times`, css(this.runColor(k))]));
    while (this.cells.length < rows.length) { const row = this.numbers.insertRow(); this.cells.push({ label: row.insertCell(), value: row.insertCell(), shown: [] }); }
    rows.forEach(([name, value, color], i) => {
      const { label, value: cell, shown } = this.cells[i];
      if (shown[0] !== name) label.replaceChildren(...(color ? [element("i")] : []), name);
      if (color && shown[2] !== color) label.firstChild.style.background = color;
      if (shown[1] !== value) cell.textContent = value;
      this.cells[i].shown = [name, value, color];
    });
  }
}
