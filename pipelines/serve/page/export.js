// What can be taken away: a clip of the stage, a traced film, a GIF, the person for other programs, the motion alone, sprites, a page to send on.
import { ask, byId, make, openDialog, say, size } from "./tools.js";

const TABS = { Clip: "clip", Film: "film", GIF: "gif", Person: "person", Motion: "motion", Sprites: "sprites", "Share page": "share" };
const ANIMATIONS = [["gif", "GIF, shown everywhere"], ["webp", "animated WebP, smaller and cleaner"]];
const DIRECTIONS = [["8", "8"], ["4", "4"], ["16", "16"], ["1", "1, the front"]];
const SPRITES = [["64", "64 pixels"], ["128", "128 pixels"], ["256", "256 pixels"]];
const FORMATS = [
  [".glb", "Blender, Unity, Godot, browsers (GLB)"], [".fbx", "Unreal, Maya, 3ds Max (FBX)"], [".usdz", "iPhone, iPad, Apple's tools (USDZ)"],
];
const MOTIONS = [[".bvh", "Blender, MotionBuilder, Maya (BVH)"], [".npz", "Python (NumPy)"]];
const RIGS = { anny: "as made here", mixamo: "Mixamo", unreal: "Unreal", unity: "Unity", vrm: "VRM", rigify: "Rigify (Blender)", talkinghead: "TalkingHead", godot: "Godot" };
const OWN = "anny";  // the bones as they are
const SIZES = [["256", "small"], ["384", "medium"], ["512", "large"], ["720", "fine"], ["1080", "finest"]];
const SHAPES = [["9:16", "upright, for phones"], ["1:1", "square"], ["4:5", "portrait"], ["16:9", "wide"]];
const LIGHTS = [["studio", "studio"], ["outdoor", "outdoors"], ["night", "night"]];
const BACKGROUNDS = [["stage", "stage"], ["photo", "also in the photo's own place"], ["transparent", "none (also single pictures)"], ["color", "a color"]];
const VIEWS = [["front", "Front"], ["back", "Back"], ["left", "Left"], ["right", "Right"], ["turntable", "Turning around"]];
const CLIP_TYPES = ["video/mp4;codecs=avc1.42E01E", "video/mp4", "video/webm;codecs=vp9", "video/webm"];
const WAIT = { action: "Idle", seconds: 4, speed: 1, mirror: false, seed: 0, path: "" };

export class Exporter {
  constructor(page) {
    this.page = page;
    this.dialog = byId("exporting");
    this.problem = byId("export-problem");
    byId("export-close").onclick = () => this.dialog.close();
    const tabs = this.dialog.querySelector(".tabs"), names = Object.keys(TABS);
    tabs.append(...names.map(name => {
      const tab = make("button", { type: "button", onclick: () => this.choose(name) }, name);
      tab.setAttribute("role", "tab");
      tab.setAttribute("aria-controls", "export-panel");
      return tab;
    }));
    tabs.onkeydown = event => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const at = (names.indexOf(this.tab) + step + names.length) % names.length;
      this.choose(names[at]);
      tabs.children[at].focus();
    };
  }

  open(photo) {
    this.photo = photo;
    openDialog(this.dialog);
    this.choose(this.tab || "Clip");
  }

  choose(name) {
    this.tab = name;
    say(this.problem, "");
    [...this.dialog.querySelector(".tabs").children].forEach(tab => {
      tab.setAttribute("aria-selected", tab.textContent === name);
      tab.tabIndex = tab.textContent === name ? 0 : -1;
    });
    const panel = byId("export-panel");
    panel.setAttribute("aria-label", name);
    panel.replaceChildren(...this[TABS[name]]());
  }

  /** What the stage shows now, as the server is asked for it. */
  wish() { return this.page.performance.wish() || WAIT; }

  pick(text, options, chosen) {
    const label = make("label", { className: "grow" }, text), select = make("select");
    select.append(...options.map(([value, words]) => new Option(words, value, value === chosen, value === chosen)));
    label.append(select);
    return [label, select];
  }

  /** A button that works for a while, and says so. */
  act(words, busy, go) {
    const button = make("button", { type: "button", className: "primary" }, words);
    button.onclick = async () => {
      button.disabled = true;
      button.textContent = busy;
      say(this.problem, "");
      try { await go(); } catch (error) { say(this.problem, error.message); }
      button.disabled = false;
      button.textContent = words;
    };
    return button;
  }

  // --- a clip of the stage

  clip() {
    const out = make("div", { className: "out" });
    const go = this.act("Record the clip", "Recording…", async () => {
      const stage = this.page.stage(), type = CLIP_TYPES.find(one => window.MediaRecorder && MediaRecorder.isTypeSupported(one));
      if (!stage || !type) throw new Error("This browser cannot record the stage; make a film instead.");
      const motion = stage.acting, seconds = Math.min(20, Math.max(1, (motion.frames - 1) / motion.fps)), parts = [];
      stage.act(motion, motion === stage.waiting);
      stage.plays = true;
      const recorder = new MediaRecorder(stage.renderer.domElement.captureStream(30), { mimeType: type, videoBitsPerSecond: 8e6 });
      recorder.ondataavailable = event => parts.push(event.data);
      const over = new Promise(done => { recorder.onstop = done; });
      recorder.start();
      await new Promise(done => setTimeout(done, 1000 * seconds));
      recorder.stop();
      await over;
      const blob = new Blob(parts, { type: type.split(";")[0] }), name = `clip.${type.includes("mp4") ? "mp4" : "webm"}`;
      const film = make("video", { src: URL.createObjectURL(blob), controls: true, loop: true, muted: true, autoplay: true, playsInline: true });
      film.setAttribute("aria-label", "the recorded clip");
      out.replaceChildren(film, make("a", { className: "button primary", href: film.src, download: name }, `Save the clip (${size(blob.size)})`));
    });
    return [make("p", { className: "hint" }, "What the stage shows, as a video file at once: this light, this camera. It takes as long as the motion."), go, out];
  }

  // --- a traced film

  gif() { return this.film(true); }

  /** The form of a film; `small`: of a GIF or animated WebP beside it. */
  film(small = false) {
    const [kinds, kind] = this.pick("File", ANIMATIONS, "gif"), noun = small ? "GIF" : "film";
    const [looks, look] = this.pick("Light", LIGHTS, byId("light").value), [shapes, shape] = this.pick("Shape", SHAPES, small ? "1:1" : "9:16"), [sizes, side] = this.pick("Size", SIZES, small ? "256" : "384");
    const [backs, back] = this.pick("Background", BACKGROUNDS, "stage"), [rates, fps] = this.pick("Frames a second", [["12", "12, quick"], ["24", "24"], ["30", "30"], ["60", "60, smooth"]], small ? "12" : "24");
    const [cameras, camera] = this.pick("Camera", [["follow", "goes along"], ["still", "stands still"]], "follow"), [fines, fine] = this.pick("Grain", [["4", "some, quick"], ["8", "little"], ["32", "hardly any, slow"]], "8");
    const color = make("input", { type: "color", value: "#30506f" }), colors = make("label", { className: "grow", hidden: true }, "Color");
    colors.append(color);
    const box = make("fieldset"), boxes = VIEWS.map(([name, words]) => {
      const label = make("label", { className: "check" });
      label.append(make("input", { type: "checkbox", value: name, checked: name === "front" }), ` ${words}`);
      return label;
    });
    box.append(make("legend", {}, "Views"), ...boxes);
    const picture = make("img", { className: "still", alt: "", hidden: true }), told = make("p", { className: "hint" });
    told.setAttribute("role", "status");
    const wish = () => ({
      ...this.wish(), look: look.value, aspect: shape.value, size: Number(side.value), spp: Number(fine.value), fps: Number(fps.value), camera: camera.value,
      background: back.value === "color" ? color.value : back.value, animation: small ? kind.value : "", views: boxes.map(label => label.firstElementChild).filter(item => item.checked).map(item => item.value),
    });
    let turn = 0, timer;
    const draw = async () => {
      const own = ++turn, asked = wish();
      colors.hidden = back.value !== "color";
      if (!this.photo || !this.photo.known || !asked.views.length) return;
      told.textContent = `Drawing a still of the ${noun}…`;
      try {
        const begun = performance.now(), found = await ask(`api/people/${this.photo.id}/still`, { method: "POST", body: JSON.stringify({ wish: asked }) });
        if (own !== turn) return;
        const bytes = Uint8Array.from(atob(found.picture), letter => letter.charCodeAt(0));
        URL.revokeObjectURL(picture.src);
        Object.assign(picture, { src: URL.createObjectURL(new Blob([bytes], { type: "image/jpeg" })), alt: `a still: how the ${noun} will look`, hidden: false });
        told.textContent = `How the ${noun} will look.`;
        picture.dataset.took = Math.round(performance.now() - begun);
      } catch (error) { if (own === turn) { told.textContent = ""; say(this.problem, error.message); } }
    };
    const soon = () => { clearTimeout(timer); timer = setTimeout(draw, 250); };
    const go = this.act(`Make the ${noun}`, "Sending…", () => this.order(wish()));
    const form = make("div", { className: "choices" }), more = make("details"), rows = [[looks, shapes], [sizes, backs, colors]].map(items => { const row = make("div", { className: "row" }); row.append(...items); return row; });
    const rest = make("div", { className: "row" });
    rest.append(rates, cameras, fines);
    more.append(make("summary", {}, "More"), rest);
    form.append(...(small ? [kinds] : []), ...rows, box, more);
    form.onchange = soon;
    const both = make("div", { className: "pair" }), side_ = make("div");
    side_.append(picture, told);
    both.append(form, side_);
    soon();
    const hint = small ? "A short film that plays by itself, of at most 8 MB: sizes and frames are reduced to fit. It is made in the background." : "Every frame is traced with soft light and shadow. It is made in the background; the stage stays free.";
    return [make("p", { className: "hint" }, hint), both, go];
  }

  /** Ask for a film; it is made in the background. */
  async order(wish) {
    const photo = await this.page.owned();
    await ask("api/jobs", { method: "POST", body: JSON.stringify({ photo, wish }) });
    await this.page.poll();
    this.dialog.close();
    byId("films").scrollIntoView({ block: "nearest" });
  }

  sprites() {
    const [ways, way] = this.pick("Directions", DIRECTIONS, "8"), [sides, side] = this.pick("Size", SPRITES, "128"), [rates, fps] = this.pick("Frames a second", [["8", "8"], ["12", "12"], ["24", "24"]], "8");
    const [looks, look] = this.pick("Light", LIGHTS, byId("light").value), row = make("div", { className: "row" });
    row.append(ways, sides, rates, looks);
    const go = this.act("Make the sprites", "Sending…", () => this.order({ ...this.wish(), sprites: Number(way.value), size: Number(side.value), fps: Number(fps.value), look: look.value, aspect: "1:1" }));
    return [make("p", { className: "hint" }, "Every frame from all directions on one transparent picture, and a list of the places, for game engines. It is made in the background."), row, go];
  }

  // --- files for other programs

  /** Write a file and fetch it. */
  async write(format, rig = OWN) {
    const photo = await this.page.made(), { files } = await ask(`api/people/${photo}/export`, { method: "POST", body: JSON.stringify({ wish: this.wish(), rig, format }) });
    const names = Object.keys(files);
    for (const name of names) {
      const link = make("a", { href: `photos/${photo}/${name.split("/").map(encodeURIComponent).join("/")}`, download: name.split("/").at(-1) });
      document.body.append(link);
      link.click();
      link.remove();
    }
    this.page.poll();
    this.out.replaceChildren(make("p", { className: "hint" }, `Saved: ${names.map(name => `${name.split("/").at(-1)} (${size(files[name])})`).join(", ")}.`));
  }

  person() {
    const [formats, format] = this.pick("For", FORMATS, ".glb"), rigs = this.page.choices() ? this.page.choices().rigs : [OWN];
    const [bones, rig] = this.pick("Bones named as in", rigs.map(name => [name, RIGS[name] || name[0].toUpperCase() + name.slice(1)]), rigs[0]), row = make("div", { className: "row" });
    row.append(formats, bones);
    this.out = make("div", { className: "out" });
    return [make("p", { className: "hint" }, "The person with this motion, to go on with in another program."), row, this.act("Save the person", "Writing…", () => this.write(format.value, rig.value)), this.out];
  }

  motion() {
    const [formats, format] = this.pick("For", MOTIONS, ".bvh"), row = make("div", { className: "row" });
    row.append(formats);
    this.out = make("div", { className: "out" });
    return [make("p", { className: "hint" }, "Only how the person moves, for other characters."), row, this.act("Save the motion", "Writing…", () => this.write(format.value)), this.out];
  }

  share() {
    this.out = make("div", { className: "out" });
    return [make("p", { className: "hint" }, "One file that opens in every browser, without a network: the moving person, to be turned by hand. Whoever gets it can see the person."), this.act("Save the page", "Writing…", () => this.write(".html")), this.out];
  }
}
