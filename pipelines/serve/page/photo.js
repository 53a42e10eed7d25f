// The photo and what was seen in it: outline, joints, people, corrections, further photos, and removal.
import { Corrector } from "./correct.js";
import { ask, byId, make, say, size } from "./tools.js";

const BONES = [
  [11, 12], [11, 23], [12, 24], [23, 24], [11, 13], [13, 15], [12, 14], [14, 16], [23, 25], [25, 27], [24, 26], [26, 28],
  [27, 29], [29, 31], [27, 31], [28, 30], [30, 32], [28, 32], [15, 17], [15, 19], [15, 21], [16, 18], [16, 20], [16, 22],
];
const CLEAR = 0.5;

/** What the photo is good for, before anything is made. */
export function gradeOf(photo) {
  const seen = index => { const [u, v, sure] = photo.landmarks[index] || [0, 0, 0]; return sure > CLEAR && u >= 0 && v >= 0 && u <= photo.width && v <= photo.height; };
  const any = (...some) => some.some(seen);
  if (!photo.landmarks.length) return "The person was found; the back is guessed.";
  if (!any(25, 26)) return "Seen from the hips up: the legs are guessed. A photo from head to feet gives the right legs.";
  if (!any(27, 28, 31, 32)) return "The feet are not in the photo: they are guessed.";
  if (!any(0, 2, 5)) return "The face is not clear: it is guessed.";
  return photo.more.length ? "Good: several sides are known." : "Good from the front; the back is guessed.";
}

/** Which of the people in a photo was taken: the one with most of the joints. */
export function takenOf(photo) {
  const inside = ([left, top, right, bottom]) => photo.landmarks.filter(([u, v]) => u / photo.width > left && u / photo.width < right && v / photo.height > top && v / photo.height < bottom).length;
  return photo.people.map(inside).reduce((best, count, index, all) => count > all[best] ? index : best, 0);
}

export class PhotoPanel {
  constructor(page) {
    this.page = page;
    this.photo = null;
    this.corrector = new Corrector(() => page.poll());
    byId("show-mask").onchange = byId("show-bones").onchange = () => this.show(this.photo);
    byId("correct").onclick = () => this.correct();
    byId("look-again").onclick = () => this.tell("again", "POST");
    byId("less").onclick = () => this.tell("more", "DELETE");
    byId("more-file").onchange = () => this.addView();
    byId("forget").onclick = () => this.forget();
  }

  correct() { if (this.photo && this.page.limits()) this.corrector.open(this.photo, this.page.limits().limbs); }

  async tell(what, method, body) {
    try { await ask(`api/photos/${this.photo.id}/${what}`, { method, body }); } catch (error) { this.page.refuse(error.message); }
    this.page.poll();
  }

  async addView() {
    const [added] = byId("more-file").files, limit = this.page.limits().upload;
    byId("more-file").value = "";
    if (!added) return;
    if (added.size > limit) this.page.refuse(`This is larger than ${limit >> 20} MB; choose a smaller photo.`);
    else await this.tell("more", "POST", added);
  }

  async forget() {
    const photo = this.photo, films = this.page.films(photo.id);
    const what = films ? `this photo, its ${films} film${films > 1 ? "s" : ""}` : "this photo";
    if (!confirm(`Delete ${what} and all kept results of this person? Downloaded files are not deleted.`)) return;
    byId("forget").disabled = true;
    try { this.page.forgotten(await ask(`api/photos/${photo.id}`, { method: "DELETE" }), films); } catch (error) { this.page.refuse(error.message); }
    byId("forget").disabled = false;
    this.page.poll();
  }

  show(photo) {
    this.photo = photo;
    byId("chosen").hidden = !photo;
    if (!photo) return;
    if (photo.status === "unusable" || photo.people.length > 1) byId("person").open = true;
    const seen = photo.status === "ready", shown = byId("shown"), mask = byId("mask"), bones = byId("bones");
    const address = photo.width ? `photos/${photo.id}/photo.jpg` : "";
    if (shown.getAttribute("src") !== address) address ? shown.setAttribute("src", address) : shown.removeAttribute("src");
    shown.alt = photo.title;
    const look = `photos/${photo.id}/mask.png?${photo.looks}`;
    if (seen && mask.getAttribute("src") !== look) mask.src = look;
    mask.hidden = !seen || !byId("show-mask").checked;
    bones.toggleAttribute("hidden", !seen || !byId("show-bones").checked);  // an SVG has no property of that name
    if (seen) this.drawBones(bones, photo);
    this.showPeople(photo);
    byId("correct").hidden = byId("more-label").hidden = byId("more-hint").hidden = byId("layers-row").hidden = !seen;
    byId("more-photos").replaceChildren(...photo.more.map((digest, index) => make("img", { src: `photos/${photo.id}/more-${index + 1}.jpg?${digest}`, alt: `further photo ${index + 1}` })));
    byId("less").hidden = !photo.more.length;
    byId("look-again").hidden = photo.status !== "unusable";
    byId("seen-text").textContent = photo.status === "looking" ? "Looking for the person…" : !seen ? "" :
      photo.people.length > 1 ? `${photo.people.length} people are in this photo. The one with the bright frame was taken; press another to take that one.` : `The person was found.${photo.corrected ? " Corrected by you." : ""}`;
    byId("files").replaceChildren(...Object.entries(photo.files).map(([name, bytes]) => {
      const item = make("li");
      item.append(make("a", { href: `photos/${photo.id}/${name.split("/").map(encodeURIComponent).join("/")}`, download: name.split("/").at(-1) }, `${name.startsWith("live/") ? "Recorded with the camera" : "Exported"}: ${name.split(".").at(-1).toUpperCase()}`), ` ${size(bytes)}`);
      return item;
    }));
  }

  showPeople(photo) {
    const several = photo.status === "ready" && photo.people.length > 1, taken = several ? takenOf(photo) : 0;
    byId("faces").replaceChildren(...(several ? photo.people : []).map(([left, top, right, bottom], index) => {
      const button = make("button", { type: "button" });
      button.setAttribute("aria-label", `person ${index + 1}`);
      button.setAttribute("aria-pressed", index === taken);
      Object.assign(button.style, { left: `${100 * left}%`, top: `${100 * top}%`, width: `${100 * (right - left)}%`, height: `${100 * (bottom - top)}%` });
      button.onclick = () => this.tell("corrections", "PUT", JSON.stringify({ units: "fractions", person: index + 1 }));
      return button;
    }));
  }

  drawBones(svg, photo) {
    const space = "http://www.w3.org/2000/svg", unit = Math.max(photo.width, photo.height) / 300;
    svg.setAttribute("viewBox", `0 0 ${photo.width} ${photo.height}`);
    svg.style.setProperty("--bone", 1.5 * unit);
    const parts = [], clear = index => photo.landmarks[index] && photo.landmarks[index][2] > 0.3;
    const add = (name, values) => {
      const item = document.createElementNS(space, name);
      for (const [key, value] of Object.entries(values)) item.setAttribute(key, value);
      parts.push(item);
    };
    for (const [a, b] of BONES) {
      if (!clear(a) || !clear(b)) continue;
      const [[x1, y1], [x2, y2]] = [photo.landmarks[a], photo.landmarks[b]];
      add("line", { x1, y1, x2, y2 });
    }
    photo.landmarks.forEach(([cx, cy], index) => { if (clear(index)) add("circle", { cx, cy, r: 1.7 * unit, "stroke-width": 0.8 * unit }); });
    svg.replaceChildren(...parts);
  }
}
