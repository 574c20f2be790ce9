// The motion of one run, or of several over one another: evolvent's viewer in the page of the studio. All frames come
// once, as one binary block (evolvent.view.animation.pack); nothing is asked of the server while it plays.
const load = async (url) => {
  const { unpack } = await import("/studio/viewer/motion.js"), answer = await fetch(url);
  if (!answer.ok) throw new Error(await answer.text());
  return unpack(await answer.arrayBuffer());
};

export default {
  template: `<div class="ev-motion"><div ref="host" v-show="!note"></div><div class="ev-note" v-if="note">{{ note }}</div></div>`,
  props: { urls: Array, labels: Array, playing: Boolean },
  data: () => ({ note: "loading the motion" }),
  mounted() {
    const dark = () => document.body.classList.contains("body--dark");
    this.theme = new MutationObserver(() => this.$el.viewer?.theme(dark()));
    this.theme.observe(document.body, { attributes: true, attributeFilter: ["class"] });
    this.onSeek = (e) => { this.$el.viewer?.play(false); this.$el.viewer?.go(e.detail); };
    window.addEventListener("evolvent-seek", this.onSeek);
    this.load();
  },
  watch: { urls(now, before) { if (String(now) !== String(before)) this.load(); } },
  methods: {
    async load() {
      if (!this.urls.length) return;
      const asked = this.asked = (this.asked || 0) + 1;
      try {
        const [{ Viewer }, ...motions] = await Promise.all([import("/studio/viewer/viewer.js"), ...this.urls.map(load)]);
        if (this.gone || asked !== this.asked) return;
        this.note = "";
        await this.$nextTick();
        const onTime = (now) => { window.evolventTime = now; window.dispatchEvent(new CustomEvent("evolvent-time", { detail: now })); };
        const before = this.$el.viewer, dark = document.body.classList.contains("body--dark");
        before?.free();
        const viewer = new Viewer(this.$refs.host, motions, { names: this.labels, playing: this.playing, dark, onTime });
        if (before) {  // seen from where the motion before was seen
          viewer.base = viewer.extent(before.base.azimuth, before.base.elevation, viewer.inertial, viewer.follow, before.base.what);
          viewer.camera = before.camera;
          viewer.redraw();
        }
        this.$el.viewer = viewer;
        const busy = document.activeElement?.closest("input, textarea, select, [contenteditable]");
        if (!busy && viewer.motions[0].frames > 1) this.$refs.host.focus({ preventScroll: true });  // keys play it at once
      } catch (error) { this.note = error.message || String(error); }
    },
  },
  beforeUnmount() {
    this.gone = true;
    window.removeEventListener("evolvent-seek", this.onSeek);
    this.theme.disconnect();
    this.$el.viewer?.free();
  },
};
