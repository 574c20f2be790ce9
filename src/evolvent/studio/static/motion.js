// The motion of one run, or of several over one another: evolvent's viewer in the page of the studio. All frames come
// once, as one binary block (evolvent.animation.pack); nothing is asked of the server while it plays.
const load = async (url) => {
  const { unpack } = await import("/studio/viewer/motion.js"), answer = await fetch(url);
  if (!answer.ok) throw new Error(await answer.text());
  return unpack(await answer.arrayBuffer());
};

export default {
  template: `<div class="ev-motion"><div ref="host" v-show="!note"></div><div class="ev-note" v-if="note">{{ note }}</div></div>`,
  props: { urls: Array, labels: Array },
  data: () => ({ note: "loading the motion" }),
  async mounted() {
    let viewer;
    try {
      const [{ Viewer }, ...motions] = await Promise.all([import("/studio/viewer/viewer.js"), ...this.urls.map(load)]);
      if (this.gone) return;
      this.note = "";
      await this.$nextTick();
      const dark = () => document.body.classList.contains("body--dark");
      const onTime = (now) => { window.evolventTime = now; window.dispatchEvent(new CustomEvent("evolvent-time", { detail: now })); };
      viewer = new Viewer(this.$refs.host, motions, { names: this.labels, dark: dark(), onTime });
      this.$el.viewer = viewer;
      this.theme = new MutationObserver(() => viewer.theme(dark()));
      this.theme.observe(document.body, { attributes: true, attributeFilter: ["class"] });
      this.onSeek = (e) => { viewer.play(false); viewer.go(e.detail); };
      window.addEventListener("evolvent-seek", this.onSeek);
    } catch (error) { this.note = error.message || String(error); }
  },
  beforeUnmount() {
    this.gone = true;
    window.removeEventListener("evolvent-seek", this.onSeek);
    this.theme?.disconnect();
    this.$el.viewer?.free();
  },
};
