// Motions from files: everybody on the stage can do them.
import { ask, byId, duration, make, say } from "./tools.js";

const LONGEST = 60;  // seconds that the stage and a film show

export class Motions {
  /** `choices` gives the server's limits, `changed` hears that something is new, `use` which motion is wanted. */
  constructor(choices, changed, use) {
    Object.assign(this, { choices, changed, use });
    this.known = "";
    const file = byId("motion-file");
    file.onchange = () => { const [sent] = file.files; if (sent) this.take(sent); file.value = ""; };
  }

  /** Whether a file is called like a motion. */
  holds(file) {
    const known = this.choices(), name = (file.name || "").toLowerCase();
    return Boolean(known) && !/^(image|video)\//.test(file.type) && known.motions.some(suffix => name.endsWith(suffix));
  }

  /** Send a file; `problem` is where a refusal is shown. */
  async take(file, problem = byId("motion-problem")) {
    const known = this.choices();
    if (known && file.size > known.upload) { say(problem, `This is larger than ${known.upload >> 20} MB; choose a shorter motion, or save it without the mesh.`); return; }
    say(problem, "");
    byId("motions").setAttribute("aria-busy", "true");
    const before = byId("doing").textContent;
    byId("doing").textContent = "Reading the motion…";
    try {
      const motion = await ask(`api/motions?name=${encodeURIComponent(file.name)}`, { method: "POST", body: file });
      this.play(motion);
    } catch (error) {
      byId("doing").textContent = before;
      say(problem, error.message);
    }
    byId("motions").removeAttribute("aria-busy");
    this.changed();
  }

  play(motion) { this.use({ title: motion.title, motion: motion.id, seconds: Math.min(LONGEST, Math.max(0.1, motion.seconds)) }); }

  show(motions) {
    const now = JSON.stringify(motions);
    if (now === this.known) return;
    this.known = now;
    byId("motions").replaceChildren(...[...motions].reverse().map(motion => {
      const item = make("li"), row = make("div", { className: "row" }), remove = make("button", { type: "button", className: "quiet" }, "Remove");
      remove.setAttribute("aria-label", `Remove ${motion.title}`);
      remove.onclick = async () => {
        try { await ask(`api/motions/${motion.id}`, { method: "DELETE" }); } catch (error) { say(byId("motion-problem"), error.message); }
        this.changed();
      };
      row.append(make("button", { type: "button", className: "grow", onclick: () => this.play(motion) }, `${motion.title} (${duration(motion.seconds)})`), remove);
      item.append(row, ...motion.notes.map(text => make("p", { className: "hint" }, text[0].toUpperCase() + text.slice(1))));
      return item;
    }));
  }
}
