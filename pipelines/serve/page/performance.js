// What the person does: actions in a row, their lengths, tempo, mirror, take and path; every change plays at once and can be undone.
import { byId, make } from "./tools.js";

const SECONDS = 4, LEAST = 0.5, MOST = 20, TAKES = 4;
const TEMPI = { 0.5: "half", 0.75: "slower", 1: "normal", 1.5: "faster", 2: "double" };

export class Performance {
  /** `changed` hears that something else is to be played. */
  constructor(changed) {
    this.changed = changed;
    this.now = { parts: [], text: "", speed: 1, mirror: false, seed: 0, path: [], copied: null };
    this.past = [];
    this.open = -1;
    byId("speed").onchange = () => this.change({ speed: Number(byId("speed").value) });
    byId("mirror").onclick = () => this.change({ mirror: !this.now.mirror });
    byId("take").onclick = () => this.change(this.inTake(this.now.seed + 1));
    byId("stand").onclick = () => this.change({ parts: [], path: [], copied: null });
    byId("undo").onclick = () => this.undo();
    this.show();
  }

  get parts() { return this.now.parts; }
  get path() { return this.now.path; }

  /** The typed `text` holds until its parts are changed. */
  change(some) {
    this.past = [...this.past.slice(-99), this.now];
    this.now = { ...this.now, ...(some.parts ? { text: "" } : {}), ...some };
    this.show();
    this.changed();
  }

  undo() {
    if (!this.past.length) return;
    this.now = this.past.pop();
    this.show();
    this.changed();
  }

  add(entry, append) {
    const part = { action: entry.name, title: entry.title, seconds: SECONDS, near: [] };
    this.open = -1;
    this.change(append ? { parts: [...this.parts, part], copied: null } : { parts: [part], path: [], copied: null });
  }

  /** The parts of a sentence; where they are not changed, the sentence itself is played, with all its wishes. */
  set(parts, text) {
    const found = parts.map(part => ({ action: part.action, words: part.wishes.length ? part.words : "", title: part.title, seconds: Math.min(MOST, Math.max(LEAST, part.seconds || SECONDS)), near: part.near || [] }));
    this.open = -1;
    if (this.now.copied || text !== this.now.text) this.change({ parts: found, text, copied: null });
  }

  /** A recorded motion in place of actions: `title`, and `motion` and `seconds` of a file. */
  copy(copied) { this.change({ copied, path: [] }); }

  setPath(path) { this.change({ path }); }

  words() { return this.now.copied ? this.now.copied.title : this.parts.map(part => part.title).join(", then "); }

  /** What the server is asked for; null while the person waits. */
  wish(now = this.now) {
    const { speed, mirror, seed, path } = now;
    if (now.copied) {
      const { title, motion, seconds } = now.copied;
      return { action: title, seconds: seconds || 10, speed, mirror, ...(motion ? { motion } : { clip: true }) };
    }
    if (!now.parts.length) return null;
    const seconds = now.parts.reduce((sum, part) => sum + part.seconds, 0);
    const called = part => `${part.words || part.action}${part.seed === undefined ? "" : ` take ${part.seed + 1}`}${(part.speed || 1) === 1 ? "" : ` at ${part.speed} x speed`}${part.mirror ? " mirrored" : ""}`;
    const action = now.text || (now.parts.length > 1 ? now.parts.map(part => `${called(part)} for ${part.seconds} s`).join(", then ") : called(now.parts[0]));
    return { action, seconds: Math.min(60, seconds), speed, mirror, seed, path: path.map(point => point.map(value => value.toFixed(2)).join(",")).join(" ") };
  }

  /** What changes if all parts are played in a take, also those with one of their own. */
  inTake(seed) { return { seed, ...(this.parts.some(part => part.seed !== undefined) ? { parts: this.parts.map(({ seed: _, ...part }) => part) } : {}) }; }

  /** What the server is asked for to compare takes, the present one first. */
  takes() { return Array.from({ length: TAKES }, (_, more) => this.wish({ ...this.now, ...this.inTake(this.now.seed + more) })); }

  /** The same for one action that is only tried. */
  alone(entry) { return this.wish({ parts: [{ action: entry.name, seconds: SECONDS }], speed: 1, mirror: false, seed: 0, path: [], copied: null }); }

  // --- the chips

  show() {
    const { parts, speed, mirror, seed, path, copied } = this.now;
    byId("speed").value = String(speed);
    byId("mirror").setAttribute("aria-pressed", mirror);
    byId("take").textContent = seed ? `Another take (${seed + 1})` : "Another take";
    byId("compare").disabled = !parts.length || Boolean(copied);
    byId("undo").disabled = !this.past.length;
    byId("draw").textContent = path.length ? "Draw another path" : "Draw a path";
    const items = copied ? [recorded(copied)] : parts.map((part, index) => this.chip(part, index));
    byId("chips").replaceChildren(...(items.length ? items : [make("li", { className: "none" }, "Standing. Press an action.")]));
    byId("performance").dataset.parts = parts.length;
    this.showEditor();
  }

  chip(part, index) {
    const item = make("li"), button = make("button", { type: "button", className: "chip", draggable: true });
    button.append(make("span", {}, part.title), make("small", {}, [`${part.seconds} s`, ...(part.speed && part.speed !== 1 ? [TEMPI[part.speed]] : []), ...(part.mirror ? ["mirrored"] : []), ...(part.seed ? [`take ${part.seed + 1}`] : [])].join(", ")));
    button.style.setProperty("--seconds", part.seconds);
    button.setAttribute("aria-expanded", this.open === index);
    button.onclick = () => { this.open = this.open === index ? -1 : index; this.show(); byId("chips").children[index].firstElementChild.focus(); };
    button.ondragstart = event => { event.dataTransfer.setData("text/plain", String(index)); event.dataTransfer.effectAllowed = "move"; };
    item.ondragover = event => { if (![...event.dataTransfer.types].includes("Files")) event.preventDefault(); };
    item.ondrop = event => { const from = Number(event.dataTransfer.getData("text/plain")); if (!event.dataTransfer.files.length && Number.isInteger(from)) { event.preventDefault(); this.move(from, index); } };
    item.append(button);
    return item;
  }

  move(from, to) {
    if (from === to || to < 0 || to >= this.parts.length || !this.parts[from]) return;
    const parts = [...this.parts];
    parts.splice(to, 0, ...parts.splice(from, 1));
    this.open = this.open === from ? to : this.open;
    this.change({ parts });
  }

  showEditor() {
    const at = this.open, part = this.parts[at], box = byId("editor");
    box.hidden = !part || Boolean(this.now.copied);
    if (box.hidden) { box.replaceChildren(); return; }
    const act = (text, go, off = false) => make("button", { type: "button", disabled: off, onclick: go }, text);
    const edit = some => this.change({ parts: this.parts.map((one, index) => index === at ? { ...one, ...some } : one) });
    const label = make("label", {}, `Seconds of ${part.title}`), length = make("input", { type: "number", min: LEAST, max: MOST, step: 0.5, value: part.seconds, inputMode: "decimal" });
    length.onchange = () => edit({ seconds: Math.min(MOST, Math.max(LEAST, Number(length.value) || SECONDS)) });
    label.append(length);
    const tempo = make("label", {}, "Its tempo"), speed = make("select");
    speed.append(...Object.keys(TEMPI).sort().map(key => new Option(TEMPI[key], key)));
    speed.value = String(part.speed || 1);
    speed.onchange = () => edit({ speed: Number(speed.value) });
    tempo.append(speed);
    const mirror = act("Mirror it", () => edit({ mirror: !part.mirror }));
    mirror.setAttribute("aria-pressed", Boolean(part.mirror));
    const again = act("Another take of it", () => edit({ seed: (part.seed ?? this.now.seed) + 1 }));
    box.replaceChildren(label, tempo, mirror, again, act("Earlier", () => this.move(at, at - 1), at === 0), act("Later", () => this.move(at, at + 1), at === this.parts.length - 1),
      act("Remove", () => { this.open = -1; this.change({ parts: this.parts.filter((_, index) => index !== at) }); }),
      ...part.near.map(other => act(`Instead: ${other.title}`, () => edit({ action: other.action, words: "", title: other.title, near: [] }))));
  }
}

/** The chip of a recorded motion. */
function recorded({ title, seconds }) {
  const item = make("li", { className: "chip" });
  item.append(make("strong", {}, title), make("small", {}, seconds ? `${Number(seconds.toFixed(1))} s` : "from the video"));
  return item;
}
