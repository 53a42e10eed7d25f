// The actions as small figures; the one under the pointer or the focus moves. One stop for the Tab key, arrows go from one to the next.
import { make } from "./tools.js";

const SIDE = 72, PAUSE = 60, MOMENT = 0.8;  // pixels, milliseconds between two drawings, seconds of a figure at rest
const still = matchMedia("(prefers-reduced-motion: reduce)");
let book = null;

/** The figures that the server has; requested once, when the page is complete. */
export async function loadFigures() {
  try { book = await (await fetch("page/figures.json")).json(); } catch { return; }
  for (const [name, text] of Object.entries(book.actions)) book.actions[name] = Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
}

function draw(canvas, bytes, time) {
  const pen = canvas.getContext("2d"), count = book.joints, moment = (time * book.fps) % book.frames;
  const first = Math.floor(moment), next = Math.min(first + 1, book.frames - 1), part = moment - first;
  const at = joint => [0, 1].map(axis => {
    const [a, b] = [first, next].map(frame => bytes[2 * (frame * count + joint) + axis]);
    return (a + (b - a) * part) / 255 * canvas.width;
  });
  const style = getComputedStyle(canvas);
  pen.clearRect(0, 0, canvas.width, canvas.height);
  pen.strokeStyle = pen.fillStyle = style.color;
  pen.lineWidth = canvas.width / 24;
  pen.lineCap = "round";
  for (const far of [true, false]) {
    pen.globalAlpha = far ? 0.55 : 1;
    pen.beginPath();
    book.bones.forEach(([a, b], index) => {
      if ((index > 4 && (index < 7 || index > 9)) !== far) return;
      pen.moveTo(...at(a));
      pen.lineTo(...at(b));
    });
    pen.stroke();
  }
  pen.globalAlpha = 1;
  pen.beginPath();
  pen.arc(...at(0), canvas.width / 17, 0, 7);
  pen.fill();
}

export class Gallery {
  /** `pick` hears which action was chosen, `look` which one is under the pointer, null for none. */
  constructor(element, pick, look) {
    this.element = element;
    this.pick = pick;
    this.look = look;
    this.known = "";
    this.seen = new Set();
    this.drawn = new WeakSet();
    this.watcher = new IntersectionObserver(entries => {
      for (const { target, isIntersecting } of entries) isIntersecting ? this.seen.add(target) : this.seen.delete(target);
      this.tick();
    }, { root: element });
    element.onkeydown = event => this.move(event);
    element.onpointerover = element.onfocusin = () => this.tick();
    document.addEventListener("visibilitychange", () => this.tick());
  }

  /** Show the actions of a theme whose words match a text; all of them where none does. */
  show(entries, text, theme = "") {
    const wanted = text.trim().toLowerCase().split(/\s+/).filter(Boolean), own = entries.filter(entry => !theme || entry.theme === theme);
    const matching = own.filter(entry => wanted.every(word => `${entry.title} ${entry.theme}`.toLowerCase().includes(word)));
    const shown = matching.length ? matching : own, now = JSON.stringify(shown.map(entry => entry.name));
    if (now === this.known) return;
    this.known = now;
    this.watcher.disconnect();
    this.seen.clear();
    const sharp = Math.min(2, Math.max(1, devicePixelRatio || 1));
    this.element.replaceChildren(...shown.map((entry, index) => {
      const button = make("button", { type: "button", className: "figure", tabIndex: index ? -1 : 0, title: entry.note });
      const canvas = make("canvas", { width: SIDE * sharp, height: SIDE * sharp });
      canvas.setAttribute("aria-hidden", "true");
      canvas.dataset.action = entry.name;
      button.append(canvas, make("span", {}, entry.title));
      button.onclick = () => { this.chosen = true; this.pick(entry); };
      button.onpointerenter = event => { if (event.pointerType === "mouse") { this.chosen = false; this.look(entry); } };
      button.onpointerleave = event => { if (event.pointerType === "mouse" && !this.chosen) this.look(null); };
      this.watcher.observe(canvas);
      return button;
    }));
    this.tick();
  }

  /** Press the action at a place in the gallery. */
  press(index) { this.element.querySelectorAll("button")[index]?.click(); }

  move(event) {
    const buttons = [...this.element.querySelectorAll("button")], at = buttons.indexOf(document.activeElement);
    const columns = Math.max(1, Math.round(this.element.clientWidth / (buttons[0]?.offsetWidth || 1)));
    const step = { ArrowRight: 1, ArrowLeft: -1, ArrowDown: columns, ArrowUp: -columns, Home: -1e6, End: 1e6 }[event.key];
    if (at < 0 || !step) return;
    event.preventDefault();
    const to = buttons[Math.min(Math.max(at + step, 0), buttons.length - 1)];
    buttons[at].tabIndex = -1;
    to.tabIndex = 0;
    to.focus();
    this.tick();
  }

  /** Draw each figure once; the one under the pointer or the focus moves. */
  tick() {
    if (this.running) return;
    this.running = true;
    const step = now => {
      const own = book && book.actions;
      let moving = false;
      if (own) for (const canvas of this.seen) {
        const moves = !still.matches && canvas.parentElement.matches(":hover, :focus-visible");
        moving ||= moves;
        if (!own[canvas.dataset.action] || this.drawn.has(canvas) && !moves) continue;
        draw(canvas, own[canvas.dataset.action], moves ? now / 1000 : MOMENT);
        this.drawn.add(canvas);
      }
      this.running = false;
      if (!document.hidden && this.seen.size && !still.matches && (moving || !own || this.element.matches(":hover, :focus-within"))) setTimeout(() => this.tick(), PAUSE);
    };
    requestAnimationFrame(step);
  }
}
