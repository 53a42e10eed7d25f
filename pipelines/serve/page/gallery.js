// The actions as small moving figures. They are drawn while they can be seen; one stop for the Tab key, arrows go from one to the next.
import { make } from "./tools.js";

const SIDE = 72, SHOWN_AT_ONCE = 24, PAUSE = 80;  // pixels, figures, milliseconds between two drawings
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
  /** `pick` hears the name of the action that was chosen. */
  constructor(element, pick) {
    this.element = element;
    this.pick = pick;
    this.seen = new Set();
    this.drawn = new WeakSet();
    this.resting = false;  // while a video is made, only the figure under the pointer or the focus moves: drawing all of them takes a core without a GPU
    this.watcher = new IntersectionObserver(entries => {
      for (const { target, isIntersecting } of entries) isIntersecting ? this.seen.add(target) : this.seen.delete(target);
      this.tick();
    }, { root: element });
    element.onkeydown = event => this.move(event);
    document.addEventListener("visibilitychange", () => this.tick());
  }

  show(model, names) {
    this.watcher.disconnect();
    this.seen.clear();
    this.model = model;
    const sharp = Math.min(2, Math.max(1, devicePixelRatio || 1));
    this.element.replaceChildren(...names.map((name, index) => {
      const button = make("button", { type: "button", className: "figure", tabIndex: index ? -1 : 0 });
      const canvas = make("canvas", { width: SIDE * sharp, height: SIDE * sharp });
      canvas.setAttribute("aria-hidden", "true");
      canvas.dataset.action = name;
      button.append(canvas, make("span", {}, name));
      button.onclick = () => this.pick(name);
      this.watcher.observe(canvas);
      return button;
    }));
    if (!names.length) this.element.textContent = "No action matches.";
    this.tick();
  }

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
  }

  tick() {
    if (this.running) return;
    this.running = true;
    const step = now => {
      const own = book && book.actions;
      if (own) [...this.seen].slice(0, SHOWN_AT_ONCE).forEach(canvas => {
        const moving = !this.resting || !this.drawn.has(canvas) || canvas.parentElement.matches(":hover, :focus-visible");
        if (!moving || !own[canvas.dataset.action]) return;
        draw(canvas, own[canvas.dataset.action], still.matches ? 0.8 : now / 1000);
        this.drawn.add(canvas);
      });
      if (document.hidden || !this.seen.size || (own && still.matches)) { this.running = false; return; }
      setTimeout(() => requestAnimationFrame(step), PAUSE);
    };
    requestAnimationFrame(step);
  }
}
