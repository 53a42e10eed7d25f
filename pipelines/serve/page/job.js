// One video: how far it is, and what came out.
import { ask, byId, duration, make, say, size } from "./tools.js";

const STATUS = { waiting: "waiting", running: "being made", done: "done", failed: "failed", cancelled: "cancelled" };
const ABOUT = {
  "video.mp4": "all views side by side", "photo.mp4": "in the photo's own place", "character.glb": "the character, textured, rigged and animated: for Blender, Unity, Unreal and browsers",
  "motion.bvh": "the motion of its rig, for other characters: Blender, MotionBuilder, Maya", "motion.npz": "the generated joints, for Python",
  "preview.html": "character and video on one page, to send on; opens with a double click", "report.json": "settings, seeds, times and versions: to make it again",
};
const TABS = ["Video", "Character", "Files"];
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

  show(job, photo) {
    const now = JSON.stringify([job, photo && photo.title]);
    if (now === this.known) return;
    this.known = now;
    this.job = job;
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
    this.find(".result").hidden = job.status !== "done";
    this.find(".notes").hidden = !job.notes.length;
    this.find(".notes ul").replaceChildren(...job.notes.map(text => make("li", {}, text)));
    this.showButtons();
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
    } else this.find(".now").replaceChildren(make("img", { src: this.address(`stage_${name}.jpg`), alt: `the ${name}, as far as it is made` }));
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
      found.push(act("Remove", own, { method: "DELETE" }, "Remove this video and its files?"));
    }
    this.find(".buttons").replaceChildren(...found);
  }

  // --- the result

  showResult() {
    const tabs = this.find(".tabs"), panel = this.find(".panel");
    panel.id = `panel-${this.id}`;
    tabs.replaceChildren(...TABS.map(name => {
      const tab = make("button", { type: "button" }, name);
      tab.setAttribute("role", "tab");
      tab.setAttribute("aria-controls", panel.id);
      tab.onclick = () => this.choose(name);
      return tab;
    }));
    tabs.onkeydown = event => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const at = (TABS.indexOf(this.tab) + step + TABS.length) % TABS.length;
      this.choose(TABS[at]);
      tabs.children[at].focus();
    };
    this.choose("Video");
  }

  choose(name) {
    this.tab = name;
    [...this.find(".tabs").children].forEach((tab, index) => {
      tab.setAttribute("aria-selected", TABS[index] === name);
      tab.tabIndex = TABS[index] === name ? 0 : -1;
    });
    const panel = this.find(".panel");
    panel.setAttribute("aria-label", name);
    panel.replaceChildren(...{ Video: () => this.video(), Character: () => this.character(), Files: () => this.files() }[name]());
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
    return [frame];
  }

  files() {
    const table = make("table", { className: "files" }), body = make("tbody");
    table.append(body);
    const names = Object.keys(this.job.files), frames = names.filter(name => name.startsWith("frame/"));
    for (const name of names.filter(one => !one.startsWith("frame/"))) {
      const row = make("tr"), where = make("td");
      where.append(make("a", { href: `${this.address(name)}?download`, download: name }, name));
      row.append(where, make("td", {}, ABOUT[name] || "one view alone"), make("td", {}, size(this.job.files[name])));
      body.append(row);
    }
    const all = make("a", { className: "button", href: this.address("all.zip"), download: "a2v.zip" }, "Download all as a zip");
    const more = frames.length ? [make("p", { className: "hint" }, `The zip also has ${frames.length} frames as PNG.`)] : [];
    return [table, ...more, all];
  }
}
