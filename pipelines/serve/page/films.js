// Films that are made in the background: how far they are, and what came out.
import { ask, byId, duration, make, say, size } from "./tools.js";

const STATUS = { waiting: "waiting", running: "being made", done: "ready", failed: "failed", cancelled: "cancelled" };
const VIEWS = { video: "All views", photo: "In the photo", front: "Front", back: "Back", left: "Left", right: "Right", turntable: "Turning" };
const ABOUT = {
  "character.glb": "The person with this motion, for Blender, Unity, Unreal and browsers", "motion.bvh": "The motion alone, for Blender, MotionBuilder and Maya",
  "motion.npz": "The motion as numbers, for Python", "preview.html": "A page with the person and the film, to send on", "report.json": "How it was made, to make it again",
  "video.gif": "GIF", "video.webp": "Animated WebP", "sprites.png": "The sprites", "sprites.json": "The places of the sprites, for game engines",
};
const PICTURES = { "sprites.png": "sprites", "video.gif": "GIF", "video.webp": "animated WebP" };

export class Films {
  constructor(element, changed) {
    this.element = element;
    this.changed = changed;
    this.cards = new Map();
    this.title = "";
  }

  show(jobs, photoOf) {
    const ids = new Set(jobs.map(job => job.id));
    for (const [id, card] of this.cards) if (!ids.has(id)) { card.element.remove(); this.cards.delete(id); }
    for (const job of jobs) {
      if (!this.cards.has(job.id)) {
        const card = new Film(job.id, this.changed);
        this.cards.set(job.id, card);
        this.element.prepend(card.element);
      }
      this.cards.get(job.id).show(job, photoOf(job.photo));
    }
    const running = jobs.find(job => job.progress);
    this.title = running ? `${Math.floor(100 * (running.progress.share || 0))} % – a2v` : "";
  }
}

class Film {
  constructor(id, changed) {
    this.id = id;
    this.changed = changed;
    this.element = byId("job").content.firstElementChild.cloneNode(true);
    this.element.id = `job-${id}`;
    this.find = name => this.element.querySelector(name);
    this.known = "";
  }

  show(job, photo) {
    const now = JSON.stringify([job, photo && [photo.title, photo.known, photo.status]]);
    if (now === this.known) return;
    this.known = now;
    this.job = job;
    const badge = this.find(".badge"), running = job.status === "running", done = job.status === "done";
    this.find("h3").textContent = job.title;
    this.find(".meta").textContent = [photo ? photo.title : "", `${Number(job.wish.seconds.toFixed(1))} s`, job.wish.seed ? `take ${job.wish.seed + 1}` : "", done ? `made in ${duration(job.seconds)}` : ""].filter(Boolean).join(" · ");
    badge.textContent = job.status !== "waiting" ? STATUS[job.status] : job.place > 1 ? `waiting, number ${job.place}` : photo && !photo.known ? "waits for the person" : STATUS.waiting;
    badge.className = `badge ${job.status}`;
    say(this.find(".problem"), job.problem);
    this.find(".making").hidden = !running;
    if (running) {
      const bar = this.find("progress"), { progress } = job;
      bar.setAttribute("aria-label", `progress of ${job.title}`);
      if (progress) bar.value = progress.share; else bar.removeAttribute("value");
      this.find(".stage-text").replaceChildren(make("span", {}, progress ? progress.stage : "Starting"), make("span", { className: "left" }, progress ? `about ${duration(progress.left)} left` : ""));
    }
    const files = JSON.stringify([job.files, job.notes]);
    if (done && files !== this.files) { this.files = files; this.showResult(); }
    this.find(".result").hidden = this.find(".more").hidden = !done;
    this.showButtons();
  }

  address(name) { return `jobs/${this.id}/${name.split("/").map(encodeURIComponent).join("/")}`; }

  /** The file that was asked for. */
  get wanted() { return Object.keys(PICTURES).find(name => this.job.files[name]) || "video.mp4"; }

  /** The film with its views, or the picture that was asked for. */
  shown() {
    if (this.wanted in PICTURES) return [make("img", { className: "still", src: this.address(this.wanted), alt: `${PICTURES[this.wanted]} of ${this.job.title}` })];
    const film = make("video", { controls: true, loop: true, muted: true, autoplay: true, playsInline: true }), row = make("div", { className: "row views" });
    const names = ["video", "photo", ...this.job.wish.views].filter(name => this.job.files[`${name}.mp4`]);
    film.setAttribute("aria-label", `film of ${this.job.title}`);
    row.setAttribute("role", "group");
    row.setAttribute("aria-label", "view");
    const pick = name => {
      film.src = this.address(`${name}.mp4`);
      [...row.children].forEach((button, index) => button.setAttribute("aria-pressed", names[index] === name));
    };
    row.append(...names.map(name => make("button", { type: "button", onclick: () => pick(name) }, VIEWS[name])));
    row.hidden = names.length < 3;
    pick(names.length === 2 ? names[1] : "video");
    return [film, row];
  }

  showResult() {
    this.find(".result").replaceChildren(...this.shown());
    const list = make("ul", { className: "downloads" }), shown = Object.keys(this.job.files).filter(name => !/^(frame\/|dir\d)/.test(name));
    list.append(...shown.map(name => {
      const item = make("li"), view = VIEWS[name.replace(/\.mp4$/, "")];
      item.append(make("a", { href: `${this.address(name)}?download`, download: name }, ABOUT[name] || (view ? `Film: ${view.toLowerCase()}` : name)), ` ${size(this.job.files[name])}`);
      return item;
    }));
    const notes = make("ul", { className: "facts" });
    notes.append(...this.job.notes.map(text => make("li", {}, text)));
    this.find(".more > div").replaceChildren(list, make("a", { className: "button", href: this.address("all.zip"), download: "a2v.zip" }, "Download everything"), notes);
  }

  showButtons() {
    const { status } = this.job;
    if (this.buttons === status) return;
    this.buttons = status;
    const act = (label, address, method, sure) => {
      const button = make("button", { type: "button", className: sure ? "quiet" : "" }, label);
      button.onclick = async () => {
        if (sure && !confirm(sure)) return;
        button.disabled = true;
        try { await ask(address, { method }); } catch (error) { say(this.find(".problem"), error.message); }
        button.disabled = false;
        this.changed();
      };
      return button;
    };
    const own = `api/jobs/${this.id}`, over = status !== "waiting" && status !== "running", found = [];
    if (!over) found.push(act("Cancel", `${own}/cancel`, "POST"));
    if (over && status !== "done") found.push(act("Try again", `${own}/again`, "POST"));
    if (status === "done") found.push(make("a", { className: "button primary", href: `${this.address(this.wanted)}?download`, download: this.wanted.replace("video", "film") }, `Download the ${PICTURES[this.wanted] || "film"}`));
    if (over) found.push(act("Remove", own, "DELETE", "Remove this film and its files?"));
    this.find(".buttons").replaceChildren(...found);
  }
}
