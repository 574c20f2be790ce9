// A chart of ECharts in the page's colours, with a cursor at the time that is shown.
import { echarts } from "nicegui-echart";
import "nicegui-echart";

const LIGHT = ["#1b1f24", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#b07d00", "#3f9fd6"];
const DARK = ["#e8eaed", "#4da6e0", "#f0813a", "#2fc497", "#e39ac4", "#e6b34a", "#7cc7f2"];

const formatted = (x) => {
  if (typeof x !== "number") return x;
  const size = Math.abs(x);
  return size !== 0 && (size >= 1e5 || size < 1e-3) ? x.toExponential(1).replace("e+", "e") : +x.toPrecision(6) + "";
};

const PEN = document.createElement("canvas").getContext("2d");
const MARK = 26, GAP = 10, LINE = 21, MOST_LINES = 6;  // of a legend, in pixels
// How a legend stands in a box: beside the name of the y axis or above it, in how many lines, and whether it is scrolled.
const legendIn = (width, { show, wide, data }) => {
  if (!show) return { wide: false, lines: 0, scrolled: false };
  PEN.font = "11px sans-serif";
  const sizes = data.map(({ name }) => MARK + 5 + PEN.measureText(name).width + GAP);
  const packed = (room) => sizes.reduce(([lines, at], size) => at + size > room + GAP && at ? [lines + 1, size] : [lines, at + size], [1, 0])[0];
  const above = wide || packed(width - 132) > 1, lines = above ? packed(width - 20) : 1;
  return lines > MOST_LINES ? { wide: above, lines: 1, scrolled: true } : { wide: above, lines, scrolled: false };
};

export default {
  template: `<div class="ev-chart"><div class="ev-chart-box" ref="box"></div><div class="ev-cursor" ref="cursor"></div></div>`,
  props: { options: Object, timed: Boolean, equal: Boolean, clickable: Boolean },
  mounted() {
    this.chart = echarts.init(this.$refs.box);
    this.$el.chart = this.chart;
    this.draw();
    this.sizes = new ResizeObserver(() => { this.chart.resize(); if (this.laid !== JSON.stringify(this.legend())) this.draw(); this.fit(); this.move(); });
    this.sizes.observe(this.$refs.box);
    this.theme = new MutationObserver(() => this.draw());
    this.theme.observe(document.body, { attributes: true, attributeFilter: ["class"] });
    this.onTime = (e) => { this.time = e.detail; this.move(); };
    if (this.timed) {
      window.addEventListener("evolvent-time", this.onTime);
      if (window.evolventTime !== undefined) { this.time = window.evolventTime; this.move(); }
      this.chart.getZr().on("click", (e) => {
        const at = [e.offsetX, e.offsetY];
        if (!this.chart.containPixel("grid", at)) return;
        const t = this.chart.convertFromPixel({ xAxisIndex: 0 }, at[0]);
        window.dispatchEvent(new CustomEvent("evolvent-seek", { detail: t }));
      });
    }
    if (this.clickable) this.chart.on("click", (e) => this.$emit("point", { series: e.seriesIndex, index: e.dataIndex ?? 0 }));
  },
  beforeUnmount() {
    window.removeEventListener("evolvent-time", this.onTime);
    this.sizes.disconnect();
    this.theme.disconnect();
    this.chart.dispose();
  },
  watch: { options: { handler() { this.draw(); }, deep: false } },
  methods: {
    legend() {
      const { legend, series } = this.options;
      return legendIn(this.$refs.box.clientWidth, { data: series.filter(({ name }) => name), ...legend });
    },
    draw() {
      const dark = document.body.classList.contains("body--dark");
      const palette = dark ? DARK : LIGHT;
      const ink = dark ? "#c9ced6" : "#3c434c", faint = dark ? "#33383f" : "#e3e6ea";
      const named = (c) => typeof c === "string" && c[0] === "@"
        ? (c === "@gray" ? (dark ? "#8a929d" : "#8a929d") : palette[Number(c.slice(1)) % palette.length])
        : typeof c === "string" && c.includes("|") ? c.split("|")[dark ? 1 : 0] : c;
      const options = JSON.parse(JSON.stringify(this.options));
      for (const s of options.series) {
        if (s.type === "heatmap" && s.label?.show) {  // values in the cells, where these are wide enough
          s.label.show = options.xAxis.data.length * 44 < this.$refs.box.clientWidth - 160;
          s.label.formatter = (p) => (typeof p.value[2] === "number" ? String(+p.value[2].toPrecision(4)) : "");
        }
        for (const part of [s.lineStyle, s.itemStyle]) if (part && part.color) part.color = named(part.color);
        if (s.type === "line") Object.assign(s, { animation: false, emphasis: { disabled: false, lineStyle: { width: (s.lineStyle.width || 1) + 1 } } });
      }
      const axis = { axisLine: { show: true, onZero: false, lineStyle: { color: ink } }, axisTick: { show: true }, splitLine: { lineStyle: { color: faint } },
        axisLabel: { color: ink, fontSize: 11, hideOverlap: true, formatter: formatted }, nameTextStyle: { color: ink, fontSize: 11.5 } };
      const { names } = options.xAxis, { names: levels, wide: levelsWide = 0 } = options.yAxis;
      for (const key of ["names", "wide"]) { delete options.xAxis[key]; delete options.yAxis[key]; }
      options.xAxis = { ...axis, nameLocation: "middle", nameGap: 24, ...options.xAxis };
      options.yAxis = { ...axis, nameLocation: "end", nameGap: 13, ...options.yAxis };
      options.yAxis.nameTextStyle = { ...axis.nameTextStyle, align: "left", padding: [0, 0, 0, -40] };
      if (this.timed) options.xAxis.axisLabel = { ...axis.axisLabel, showMaxLabel: false };
      if (options.xAxis.type === "category") options.xAxis.axisLabel = { ...axis.axisLabel, formatter: undefined };
      if (options.yAxis.type === "category") options.yAxis.axisLabel = { ...axis.axisLabel, formatter: undefined };
      if (names) options.xAxis.axisLabel = { ...axis.axisLabel, formatter: (x) => names[x] ?? "" };
      if (levels) options.yAxis.axisLabel = { ...axis.axisLabel, width: levelsWide, overflow: "truncate", formatter: (y) => levels[y] ?? "" };
      const titled = options.title && options.title.text, { wide, lines, scrolled } = this.legend();
      this.laid = JSON.stringify({ wide, lines, scrolled });
      this.$el.style.setProperty("--ev-legend", `${LINE * Math.max(0, lines - 1)}px`);
      this.chart.resize();
      const rows = (titled ? 20 : 0) + (wide ? LINE * lines : 0);
      options.title = { show: !!titled, left: 4, top: 0, textStyle: { color: ink, fontSize: 12, fontWeight: "normal", width: this.$refs.box.clientWidth - 12, overflow: "truncate" }, ...(options.title || {}) };
      options.legend = { type: scrolled ? "scroll" : "plain", top: titled ? 20 : 0, right: 8, left: wide ? 8 : 120, itemHeight: 13, itemWidth: MARK, itemGap: GAP,
        textStyle: { color: ink, fontSize: 11 }, pageTextStyle: { color: ink }, pageIconColor: ink, pageIconSize: 9, ...(options.legend || {}) };
      options.grid = { left: Math.max(52, levelsWide + 16), right: options.visualMap ? 104 : 18, top: rows + 36, bottom: 42, ...(options.grid || {}) };
      options.tooltip = { trigger: options.visualMap || this.clickable || this.equal ? "item" : "axis", confine: true, backgroundColor: dark ? "#23272d" : "#fff", borderColor: faint,
        textStyle: { color: ink, fontSize: 11 }, valueFormatter: (v) => (v === null || v === undefined ? "-" : typeof v === "number" ? +v.toPrecision(6) + "" : v), ...(options.tooltip || {}) };
      const maps = options.series.some((s) => s.type === "heatmap");
      const { categories } = options;
      delete options.categories;
      if (maps) options.tooltip.formatter = (p) => [`${options.xAxis.name.split(" [")[0]} ${options.xAxis.data[p.value[0]]}`, `${options.yAxis.name.split(" [")[0]} ${options.yAxis.data[p.value[1]]}`, categories?.length ? categories[p.value[2]] ?? "no value" : p.value[2] ?? "no value"].map((text) => echarts.format.encodeHTML(String(text))).join("<br>");
      if (options.visualMap) options.visualMap = { ...options.visualMap, textStyle: { color: ink, fontSize: 11 } };
      if (!options.visualMap) options.dataZoom = [{ type: "inside", zoomOnMouseWheel: "ctrl", moveOnMouseMove: "shift" }];
      options.animation = false;
      this.chart.setOption(options, { notMerge: true });
      this.fit();
      this.$nextTick(() => this.move());
    },
    fit() {  // the same scale along both axes
      if (!this.equal || !this.options.series.length) return;
      let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity];
      for (const s of this.options.series) for (const [x, y] of s.data) {
        if (x === null || y === null) continue;
        x0 = Math.min(x0, x); x1 = Math.max(x1, x); y0 = Math.min(y0, y); y1 = Math.max(y1, y);
      }
      if (!(x1 > x0 || y1 > y0)) return;
      const grid = this.chart.getModel().getComponent("grid").coordinateSystem.getRect();
      const scale = 1.06 * Math.max((x1 - x0) / grid.width, (y1 - y0) / grid.height);
      const cx = (x0 + x1) / 2, cy = (y0 + y1) / 2, w = scale * grid.width / 2, h = scale * grid.height / 2;
      const plain = (v) => { const step = 10 ** Math.floor(Math.log10(Math.max(w, h))); return Math.abs(v) < 1e-9 * step ? 0 : v; };
      this.chart.setOption({ xAxis: { min: plain(cx - w), max: plain(cx + w), axisLabel: { showMinLabel: false, showMaxLabel: false } },
        yAxis: { min: plain(cy - h), max: plain(cy + h), axisLabel: { showMinLabel: false, showMaxLabel: false } } });
    },
    move() {
      const cursor = this.$refs.cursor;
      if (!this.timed || this.time === undefined || !cursor) return;
      const x = this.chart.convertToPixel({ xAxisIndex: 0 }, this.time);
      const grid = this.chart.getModel().getComponent("grid").coordinateSystem.getRect();
      const inside = x >= grid.x - 1 && x <= grid.x + grid.width + 1;
      cursor.style.display = inside ? "block" : "none";
      cursor.style.transform = `translateX(${x}px)`;
      cursor.style.top = grid.y + "px";
      cursor.style.height = grid.height + "px";
    },
  },
};
