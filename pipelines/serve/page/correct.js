// Correcting what was seen in a photo: landmarks to drag, limbs to turn, a brush for the mask, who is meant. Positions are fractions of the photo.
import { ask, byId, make, openDialog, say } from "./tools.js";

const SPACE = "http://www.w3.org/2000/svg";
const NAMES = [
  "nose", "left_eye_inner", "left_eye", "left_eye_outer", "right_eye_inner", "right_eye", "right_eye_outer", "left_ear", "right_ear", "mouth_left", "mouth_right",
  "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_pinky", "right_pinky", "left_index", "right_index",
  "left_thumb", "right_thumb", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle", "left_heel", "right_heel",
  "left_foot_index", "right_foot_index",
];
const SHOWN = [0, 7, 8, 11, 12, 13, 14, 15, 16, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32];
const LINES = [[0, 7], [0, 8], [11, 12], [11, 23], [12, 24], [23, 24], [11, 13], [13, 15], [12, 14], [14, 16], [23, 25], [25, 27], [24, 26], [26, 28], [27, 29], [29, 31], [28, 30], [30, 32]];
const HINTS = {
  move: "Drag a landmark to where it belongs, or choose it with Tab and move it with the arrow keys (Shift: farther). The body's outline follows.",
  add: "Paint over parts of the person that are missing. By keyboard: arrow keys move the brush, Space paints.",
  remove: "Paint over what is not the person. By keyboard: arrow keys move the brush, Space paints.",
};
const WAYS = { front: "in front", back: "behind" };
const words = name => name.replaceAll("_", " ");
const round = value => Math.round(value * 1e4) / 1e4;
const draw = (name, values) => {
  const item = document.createElementNS(SPACE, name);
  for (const [key, value] of Object.entries(values)) item.setAttribute(key, value);
  return item;
};

export class Corrector {
  /** `changed` is called when something was saved. */
  constructor(changed) {
    this.changed = changed;
    this.dialog = byId("fixing");
    this.svg = byId("fix-svg");
    this.canvas = byId("fix-mask");
    this.stage = byId("fix-stage");
    byId("fix-undo").onclick = () => this.undo();
    byId("fix-reset").onclick = () => this.change(said => { for (const name of Object.keys(said)) if (name !== "units") delete said[name]; });
    byId("fix-save").onclick = () => this.save();
    byId("fix-close").onclick = () => this.close();
    this.dialog.oncancel = event => { event.preventDefault(); this.close(); };
    for (const button of byId("fix-tool").children) button.onclick = () => this.take(button.dataset.tool);
    this.stage.onpointerdown = event => this.press(event);
    this.stage.onkeydown = event => this.key(event);
  }

  async open(photo, limbs) {
    this.photo = photo;
    this.limbs = limbs;
    this.base = photo.landmarks.map(([u, v, sure]) => [u / photo.width, v / photo.height, sure]);
    this.outline = [];
    this.sides = {};
    this.past = [];
    this.brush = [0.5, 0.5];
    this.fitted = false;
    this.said = { units: "fractions" };
    say(byId("fix-problem"), "");
    byId("fix-told").textContent = "Fitting the body… You can start correcting now.";
    byId("fix-sure").replaceChildren();
    const address = `photos/${photo.id}`;
    byId("fix-photo").src = `${address}/photo.jpg`;
    this.canvas.width = photo.width;
    this.canvas.height = photo.height;
    this.shade = make("img", { src: `${address}/mask.png?${photo.looks}` });
    this.shade.onload = () => this.showMask();
    this.svg.setAttribute("viewBox", `0 0 ${photo.width} ${photo.height}`);
    this.stage.style.setProperty("--shape", photo.width / photo.height);
    byId("fix-file").hidden = !photo.corrected;
    byId("fix-file").href = `${address}/me.yaml`;
    this.take("move");
    openDialog(this.dialog);
    try { this.said = { ...(await ask(`api/photos/${photo.id}/corrections`)), units: "fractions" }; } catch (error) { say(byId("fix-problem"), error.message); }
    this.show();
    this.refit();
  }

  close() {
    if (this.past.length && !confirm("Close without saving the corrections?")) return;
    this.dialog.close();
  }

  take(tool) {
    this.tool = tool;
    for (const button of byId("fix-tool").children) button.setAttribute("aria-pressed", button.dataset.tool === tool);
    byId("fix-hint").textContent = HINTS[tool];
    byId("fix-size-label").hidden = tool === "move";
    this.stage.classList.toggle("brush", tool !== "move");
    this.stage.tabIndex = tool === "move" ? -1 : 0;
    if (this.photo) this.show();
  }

  // --- what is said

  change(how, fit = true) {
    this.past.push(JSON.stringify(this.said));
    how(this.said);
    this.show();
    if (fit) this.refit();
  }

  undo() {
    if (!this.past.length) return;
    this.said = JSON.parse(this.past.pop());
    this.show();
    this.refit();
  }

  place(index) { return (this.said.landmarks || {})[NAMES[index]] || this.base[index].slice(0, 2); }

  put(index, place) {
    this.said.landmarks = { ...this.said.landmarks, [NAMES[index]]: place.map(value => round(Math.min(1.2, Math.max(-0.2, value)))) };
  }

  /** The body's outline by what is said now; one question at a time, the last one counts. */
  async refit() {
    if (this.asking) { this.again = true; return; }
    const { id } = this.photo;
    this.asking = true;
    try {
      do {
        this.again = false;
        const begun = performance.now();
        const found = await ask(`api/photos/${id}/outline`, { method: "POST", body: JSON.stringify(this.said) });
        if (id !== this.photo.id) break;
        this.outline = found.outline;
        this.base = found.landmarks;
        this.sides = found.sides;
        this.svg.dataset.seconds = ((performance.now() - begun) / 1000).toFixed(2);
        this.tell(found);
        this.show();
        if (!this.fitted) { this.fitted = true; this.again = Object.keys(this.said).some(name => ["landmarks", "limbs"].includes(name)); }
      } while (this.again);
    } catch (error) { say(byId("fix-problem"), error.message); }
    this.asking = false;
    if (id !== this.photo.id) this.refit();
  }

  tell(found) {
    say(byId("fix-problem"), "");
    const { camera, limb_errors: errors, second_photo: side } = found;
    byId("fix-told").textContent = `Body fitted in ${this.svg.dataset.seconds} s.`;
    byId("fix-sure").replaceChildren(...sureness(camera, errors, side));
  }

  async save() {
    byId("fix-save").disabled = true;
    try {
      await ask(`api/photos/${this.photo.id}/corrections`, { method: "PUT", body: JSON.stringify(this.said) });
      this.past = [];
      this.dialog.close();
      this.changed();
    } catch (error) { say(byId("fix-problem"), error.message); }
    byId("fix-save").disabled = false;
  }

  // --- what is seen

  show() {
    this.showMask();
    this.showLimbs();
    this.showPeople();
    byId("fix-undo").disabled = !this.past.length;
    const { width, height } = this.photo, unit = Math.max(width, height) / 400, parts = [];
    const at = place => [place[0] * width, place[1] * height];
    const lines = this.outline.map(line => `M${line.map(place => at(place).map(value => value.toFixed(1)).join(" ")).join("L")}Z`).join("");
    if (lines) parts.push(draw("path", { d: lines, class: "halo", "stroke-width": 3 * unit }), draw("path", { d: lines, class: "outline", "stroke-width": 1.4 * unit }));
    const sure = index => this.base[index][2] > 0.1 || (this.said.landmarks || {})[NAMES[index]];
    for (const [a, b] of LINES) {
      if (!sure(a) || !sure(b)) continue;
      const [[x1, y1], [x2, y2]] = [at(this.place(a)), at(this.place(b))];
      parts.push(draw("line", { x1, y1, x2, y2, "stroke-width": 1.2 * unit }));
    }
    (this.photo.people || []).forEach(([a, b, c, d], number) => {
      parts.push(draw("rect", { x: a * width, y: b * height, width: (c - a) * width, height: (d - b) * height, "stroke-width": unit, class: number + 1 === (this.said.person || 1) ? "meant" : "other" }));
    });
    const focused = document.activeElement && document.activeElement.dataset.mark;
    if (this.tool === "move") for (const index of SHOWN) {
      const [cx, cy] = at(this.place(index)), set = Boolean((this.said.landmarks || {})[NAMES[index]]);
      const mark = draw("circle", { cx, cy, r: 4.2 * unit, "stroke-width": 1.2 * unit, tabindex: 0, role: "button", class: set ? "mark set" : "mark", "data-mark": index });
      mark.setAttribute("aria-label", `${words(NAMES[index])}${set ? ", corrected" : ""}: move with the arrow keys`);
      mark.append(draw("title", {}));
      mark.firstChild.textContent = words(NAMES[index]);
      parts.push(mark);
    } else {
      const [cx, cy] = at(this.brush);
      parts.push(draw("circle", { cx, cy, r: this.radius() * Math.max(width, height), "stroke-width": unit, class: "cursor" }));
    }
    this.svg.replaceChildren(...parts);
    if (focused !== undefined) this.svg.querySelector(`[data-mark="${focused}"]`)?.focus();
  }

  showMask() {
    const pen = this.canvas.getContext("2d"), { width, height } = this.canvas;
    pen.clearRect(0, 0, width, height);
    if (this.shade.complete && this.shade.naturalWidth) pen.drawImage(this.shade, 0, 0, width, height);
    pen.lineCap = pen.lineJoin = "round";
    for (const stroke of [...(this.said.mask || []), ...(this.stroke ? [this.stroke] : [])]) {
      const points = stroke.add || stroke.remove;
      pen.lineWidth = 2 * stroke.radius * Math.max(width, height);
      for (const mode of stroke.add ? ["destination-out"] : ["destination-out", "source-over"]) {
        pen.globalCompositeOperation = mode;
        pen.strokeStyle = mode === "source-over" ? "rgb(0 0 0 / 0.667)" : "#000";
        pen.beginPath();
        points.forEach(([u, v], index) => (index ? pen.lineTo(u * width, v * height) : pen.moveTo(u * width, v * height)));
        if (points.length === 1) pen.lineTo(points[0][0] * width + 0.01, points[0][1] * height);
        pen.stroke();
      }
      pen.globalCompositeOperation = "source-over";
    }
  }

  showLimbs() {
    const said = this.said.limbs || {}, focused = document.activeElement && document.activeElement.dataset.limb;
    byId("fix-limbs").replaceChildren(...this.limbs.map(name => {
      const way = said[name] || this.sides[name], button = make("button", { type: "button" }, `${words(name)}: ${way ? WAYS[way] : "…"}`);
      button.dataset.limb = name;
      button.disabled = !way;
      button.setAttribute("aria-pressed", Boolean(said[name]));
      button.onclick = () => this.change(now => {
        const limbs = { ...now.limbs };
        if (limbs[name]) delete limbs[name]; else limbs[name] = way === "front" ? "back" : "front";
        now.limbs = limbs;
      });
      return button;
    }));
    if (focused) byId("fix-limbs").querySelector(`[data-limb="${focused}"]`)?.focus();
  }

  showPeople() {
    const people = this.photo.people || [], row = byId("fix-people");
    row.hidden = people.length < 2;
    row.replaceChildren(...people.map((box, index) => {
      const meant = (this.said.person || 1) === index + 1, button = make("button", { type: "button" }, `person ${index + 1}`);
      button.setAttribute("aria-pressed", meant);
      button.onclick = () => this.change(said => { said.person = index + 1; delete said.landmarks; delete said.limbs; delete said.mask; }, false);
      return button;
    }));
    if (people.length > 1) row.append(make("p", { className: "hint" }, "Save before you choose another person."));
  }

  // --- pointer and keys

  radius() { return Number(byId("fix-size").value) / 1000; }

  where(event) {
    const box = this.svg.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  }

  press(event) {
    const mark = event.target.dataset && event.target.dataset.mark, start = this.where(event);
    if (event.button || (this.tool === "move" && mark === undefined)) return;
    event.preventDefault();
    this.stage.setPointerCapture(event.pointerId);
    const before = JSON.stringify(this.said);
    if (this.tool !== "move") this.stroke = { [this.tool]: [start.map(round)], radius: this.radius() };
    else this.svg.querySelector(`[data-mark="${mark}"]`).focus();
    this.show();
    this.stage.onpointermove = moved => {
      const place = this.where(moved);
      if (this.tool === "move") this.put(Number(mark), place);
      else {
        const points = this.stroke[this.tool], last = points[points.length - 1];
        this.brush = place;
        if (Math.hypot(place[0] - last[0], place[1] - last[1]) > this.stroke.radius / 3) points.push(place.map(round));
      }
      this.show();
    };
    this.stage.onpointerup = this.stage.onpointercancel = () => {
      this.stage.onpointermove = this.stage.onpointerup = this.stage.onpointercancel = null;
      if (this.stroke) { this.brush = this.stroke[this.tool].at(-1); this.said.mask = [...(this.said.mask || []), this.stroke]; }
      this.stroke = null;
      if (JSON.stringify(this.said) === before) return;
      this.past.push(before);
      this.show();
      if (this.tool === "move") this.refit();
    };
  }

  key(event) {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key], far = event.shiftKey ? 0.02 : 0.004;
    const mark = event.target.dataset && event.target.dataset.mark;
    if (mark !== undefined && step) {
      const [u, v] = this.place(Number(mark));
      event.preventDefault();
      this.change(() => this.put(Number(mark), [u + far * step[0], v + far * step[1]]));
    } else if (this.tool !== "move" && (step || event.key === " ")) {
      event.preventDefault();
      if (step) { this.brush = [this.brush[0] + 2 * far * step[0], this.brush[1] + 2 * far * step[1]]; this.show(); }
      else this.change(said => { said.mask = [...(said.mask || []), { [this.tool]: [this.brush.map(round)], radius: this.radius() }]; }, false);
    }
  }
}

/** The camera, the limbs' expected errors and the best second photo, as items of a list. */
export function sureness(camera, errors, side) {
  const found = [];
  const angle = camera && camera.field_of_view ? `, its field of view ${Math.round(camera.field_of_view)} degrees` : "";
  if (camera) found.push(camera.distance > 0
    ? `The camera was probably ${camera.distance.toFixed(1)} m away${angle} (${camera.distance_from}).`
    : `The camera is assumed to be far away (${camera.distance_from}).`);
  const limbs = Object.entries(errors || {}).filter(([name]) => /arm|leg/.test(name));
  for (const [name, error] of limbs) found.push(`The depth of the ${words(name)} is known to about ${Math.max(1, Math.round(100 * error))} cm${error > 0.15 ? ": unsure" : ""}.`);
  if (side) found.push(`A second photo from ${{ front: "the front", back: "behind" }[side] || `the person's ${side}`} would add the most.`);
  return found.map(text => make("li", {}, text));
}
