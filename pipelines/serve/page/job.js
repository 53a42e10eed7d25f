// One video: how far it is, and what came out.
import { sureness } from "./correct.js";
import { liveControls } from "./live.js";
import { ask, byId, duration, make, say, size } from "./tools.js";

const STATUS = { waiting: "waiting", running: "being made", done: "done", failed: "failed", cancelled: "cancelled" };
const ABOUT = {
  "video.mp4": "all views side by side", "photo.mp4": "in the photo's own place", "character.glb": "the character, textured, rigged and animated: for Blender, Unity, Unreal and browsers",
  "motion.bvh": "the motion of its rig, for other characters: Blender, MotionBuilder, Maya", "motion.npz": "the generated joints, for Python",
  "preview.html": "character and video on one page; opens with a double click", "report.json": "settings, seeds, times and versions, to make the video again",
};
const TABS = ["Video", "Character", "Files"], COMPARE = "Compare";
const WITH = { ".glb": "Blender, Unity, Godot, browsers", ".fbx": "Unreal, Maya", ".usdz": "Apple's tools", ".vrm": "VRM avatars", ".html": "a page to send on" };
const STAGES = ["outline", "body", "surface", "textured", "moving"];

export class JobCard {
  constructor(job, changed) {
    this.id = job.id;
    this.changed = changed;
    this.element = byId("job").content.firstElementChild.cloneNode(true);
    this.element.id = `job-${job.id}`;
    this.find = name => this.element.querySelector(name);
    this.known = "";
  }

  show(job, photo, alike, choices) {
    const now = JSON.stringify([job, photo && photo.title, alike.map(one => one.id), Boolean(choices)]);
    if (now === this.known) return;
    const files = this.job && JSON.stringify([this.job.files, Boolean(this.choices)]), others = this.alike && this.alike.length;
    this.known = now;
    this.job = job;
    this.alike = alike;
    this.choices = choices;
    const { wish } = job, badge = this.find(".badge");
    this.find("h3").textContent = wish.action;
    this.find(".meta").textContent = [
      photo ? photo.title : "", `${wish.seconds} s`, `${wish.size} px`, wish.views.join(", "), wish.seed ? `seed ${wish.seed}` : "",
      job.status === "done" ? `made in ${duration(job.seconds)}` : "",
    ].filter(Boolean).join(" · ");
    badge.textContent = job.status === "waiting" && job.place > 1 ? `waiting, number ${job.place}` : STATUS[job.status];
    badge.className = `badge ${job.status}`;
    say(this.find(".problem"), job.problem);
    this.find(".making").hidden = job.status !== "running";
    if (job.status === "running") this.showProgress(job.progress);
    else this.clearStages();
    if (job.status === "done" && this.find(".result").hidden) this.showResult();
    else if (job.status === "done" && Boolean(others) !== Boolean(alike.length)) this.showResult(this.tab === COMPARE ? "Video" : this.tab);
    else if (job.status === "done" && this.tab === "Files" && files !== JSON.stringify([job.files, Boolean(choices)])) this.choose("Files");
    this.find(".result").hidden = job.status !== "done";
    this.find(".notes").hidden = !job.notes.length;
    this.find(".notes ul").replaceChildren(...job.notes.map(text => make("li", {}, text)));
    this.find(".sure").hidden = job.status !== "done" || !job.files["report.json"];
    this.find(".sure").ontoggle = () => this.showSureness();
    this.showButtons();
  }

  async showSureness() {
    const list = this.find(".sure ul");
    if (list.childElementCount) return;
    const { nodes } = await ask(this.address("report.json")).catch(() => ({ nodes: {} }));
    const found = Object.assign({}, ...["photo_body", "joint_fit"].map(name => nodes[name] && nodes[name].measures));
    list.replaceChildren(...sureness(found.camera, found.limb_errors, found.second_photo));
    if (!list.childElementCount) list.append(make("li", {}, "The report of this video has no estimates."));
  }

  showProgress(progress) {
    const bar = this.find("progress"), text = this.find(".stage-text");
    bar.setAttribute("aria-label", `progress of ${this.job.wish.action}`);
    if (progress) bar.value = progress.share; else bar.removeAttribute("value");
    const left = progress ? `about ${duration(progress.left)} left` : "";
    this.showStages(["outline", ...(progress && progress.shown || [])]);
    text.replaceChildren(make("span", {}, progress ? progress.stage : "Starting"), make("span", { className: "left" }, left));
  }

  /** A picture a stage, the newest one large; the character itself as soon as it moves. */
  showStages(shown) {
    if (this.shown === shown.length) return;
    this.shown = shown.length;
    const last = STAGES.findLastIndex(name => shown.includes(name));
    this.find(".stages").replaceChildren(...STAGES.map((name, index) => {
      const item = make("li", { className: index <= last ? "made" : "" }, name);
      if (index === last + 1) item.setAttribute("aria-current", "step");
      return item;
    }));
    const name = STAGES[last];
    if (name === "moving") {
      const frame = make("iframe", { src: this.address("turn.html"), title: "the character: drag to turn, while its video is made" });
      frame.setAttribute("sandbox", "allow-scripts");
      this.find(".now").replaceChildren(frame, make("p", { className: "hint" }, "Drag to turn it. The video follows."));
    } else if (name === "outline") {
      const photo = `photos/${this.job.photo}`, layers = make("div", { className: "layers" });
      layers.append(make("img", { src: `${photo}/photo.jpg`, alt: "the outline that was found" }), make("img", { src: `${photo}/mask.png`, alt: "" }));
      this.find(".now").replaceChildren(layers);
    } else this.find(".now").replaceChildren(make("img", { src: this.address(`stage_${name}.jpg`), alt: `the ${name}, as far as it is finished` }));
  }

  clearStages() {
    if (this.shown === undefined) return;
    this.shown = undefined;
    this.find(".now").replaceChildren();
  }

  showButtons() {
    const { status } = this.job;
    if (this.buttons === status) return;
    this.buttons = status;
    const act = (label, address, how, sure) => {
      const button = make("button", { type: "button", className: sure ? "quiet" : "" }, label);
      button.onclick = async () => {
        if (sure && !confirm(sure)) return;
        button.disabled = true;
        try { await ask(address, how); } catch (error) { say(this.find(".problem"), error.message); }
        button.disabled = false;
        this.changed();
      };
      return button;
    };
    const post = { method: "POST" }, own = `api/jobs/${this.id}`, found = [];
    if (status === "waiting" || status === "running") found.push(act("Cancel", `${own}/cancel`, post));
    else {
      if (status !== "done") found.push(act("Try again", `${own}/again`, post));
      else found.push(act("Another seed", "api/jobs", { method: "POST", body: JSON.stringify({ photo: this.job.photo, wish: { ...this.job.wish, seed: this.nextSeed() } }) }));
      found.push(act("Remove", own, { method: "DELETE" }, "Remove this video and its files?"));
    }
    this.find(".buttons").replaceChildren(...found);
  }

  nextSeed() { return Math.max(this.job.wish.seed, ...this.alike.map(one => one.wish.seed)) + 1; }

  // --- the result

  names() { return this.alike.length ? [...TABS, COMPARE] : TABS; }

  showResult(first = "Video") {
    const tabs = this.find(".tabs"), panel = this.find(".panel");
    panel.id = `panel-${this.id}`;
    tabs.replaceChildren(...this.names().map(name => {
      const tab = make("button", { type: "button" }, name);
      tab.setAttribute("role", "tab");
      tab.setAttribute("aria-controls", panel.id);
      tab.onclick = () => this.choose(name);
      return tab;
    }));
    tabs.onkeydown = event => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const names = this.names(), at = (names.indexOf(this.tab) + step + names.length) % names.length;
      this.choose(names[at]);
      tabs.children[at].focus();
    };
    this.choose(first);
  }

  choose(name) {
    this.tab = name;
    [...this.find(".tabs").children].forEach((tab, index) => {
      tab.setAttribute("aria-selected", this.names()[index] === name);
      tab.tabIndex = this.names()[index] === name ? 0 : -1;
    });
    const panel = this.find(".panel");
    panel.setAttribute("aria-label", name);
    panel.replaceChildren(...{ Video: () => this.video(), Character: () => this.character(), Files: () => this.files(), Compare: () => this.compare() }[name]());
  }

  address(name) { return `jobs/${this.id}/${name.split("/").map(encodeURIComponent).join("/")}`; }

  video() {
    const film = make("video", { controls: true, loop: true, muted: true, autoplay: true, playsInline: true });
    film.setAttribute("aria-label", `video of ${this.job.wish.action}`);
    const names = ["video", "photo", ...this.job.wish.views].filter(name => this.job.files[`${name}.mp4`]);
    const row = make("div", { className: "views-row" });
    row.setAttribute("role", "group");
    row.setAttribute("aria-label", "view");
    const pick = name => {
      film.src = this.address(`${name}.mp4`);
      [...row.children].forEach((button, index) => button.setAttribute("aria-pressed", names[index] === name));
    };
    row.append(...names.map(name => {
      const button = make("button", { type: "button" }, name === "video" ? "all views" : name);
      button.onclick = () => pick(name);
      return button;
    }));
    row.hidden = names.length < 3;
    pick("video");
    return [film, row];
  }

  character() {
    const frame = make("iframe", { src: this.address("turn.html"), title: "the character: drag to turn" });
    frame.setAttribute("sandbox", "allow-scripts");
    return [frame, ...liveControls(this.id, frame, this.changed)];
  }

  /** This performance beside another one of the same action. */
  compare() {
    const pair = make("div", { className: "pair" }), pick = make("select"), label = make("label", {}, "Beside seed");
    const film = (id, seed) => {
      const one = make("video", { controls: true, loop: true, muted: true, autoplay: true, playsInline: true, src: `jobs/${id}/video.mp4` });
      one.setAttribute("aria-label", `seed ${seed}`);
      const box = make("figure");
      box.append(one, make("figcaption", {}, `seed ${seed}`));
      return box;
    };
    const show = () => {
      const other = this.alike[pick.selectedIndex] || this.alike[0];
      pair.replaceChildren(film(this.id, this.job.wish.seed), film(other.id, other.wish.seed));
      const [first, second] = pair.querySelectorAll("video");
      first.onplay = () => { second.currentTime = first.currentTime; second.play().catch(() => {}); };
      first.onpause = () => second.pause();
      first.onseeked = () => { second.currentTime = first.currentTime; };
    };
    pick.append(...this.alike.map(one => new Option(`${one.wish.seed}`)));
    pick.onchange = show;
    label.append(pick);
    label.hidden = this.alike.length < 2;
    show();
    return [label, pair];
  }

  /** The character for another tool: its bones' names, and the kind of file. */
  exporter() {
    const rig = make("select"), format = make("select"), go = make("button", { type: "button" }, "Write it"), problem = make("p", { className: "problem", hidden: true });
    const box = make("details"), row = make("div", { className: "row" });
    const named = (text, item) => { const label = make("label", { className: "grow" }, text); label.append(item); return label; };
    rig.append(...this.choices.rigs.map(name => new Option(name)));
    format.append(...this.choices.formats.map(name => new Option(WITH[name] ? `${name}: ${WITH[name]}` : name, name)));
    go.onclick = async () => {
      go.disabled = true;
      go.textContent = "Writing…";
      say(problem, "");
      try { await ask(`api/jobs/${this.id}/export`, { method: "POST", body: JSON.stringify({ rig: rig.value, format: format.value }) }); } catch (error) { say(problem, error.message); }
      go.disabled = false;
      go.textContent = "Write it";
      this.changed();
    };
    problem.setAttribute("role", "alert");
    row.append(named("Rig", rig), named("Format", format), go);
    box.append(make("summary", {}, "For another tool: other bones and file formats"), row, problem);
    return box;
  }

  files() {
    const table = make("table", { className: "files" }), body = make("tbody");
    table.append(body);
    const names = Object.keys(this.job.files), frames = names.filter(name => name.startsWith("frame/"));
    for (const name of names.filter(one => !one.startsWith("frame/"))) {
      const row = make("tr"), where = make("td");
      where.append(make("a", { href: `${this.address(name)}?download`, download: name }, name));
      row.append(where, make("td", {}, ABOUT[name] || (name.startsWith("exports/") ? "the character for another tool, with this motion" : name.startsWith("live/") ? (name.endsWith(".bvh") ? "a motion recorded live" : "the character with a motion recorded live") : "a single view")), make("td", {}, size(this.job.files[name])));
      body.append(row);
    }
    const all = make("a", { className: "button", href: this.address("all.zip"), download: "a2v.zip" }, "Download all as a zip");
    const more = frames.length ? [make("p", { className: "hint" }, `The zip also has ${frames.length} frames as PNG.`)] : [];
    return [table, ...more, all, ...(this.choices ? [this.exporter()] : [])];
  }
}
