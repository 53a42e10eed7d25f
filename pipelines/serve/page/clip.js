// A video whose motion the person takes over.
import { ask, byId, duration, say } from "./tools.js";

export class Clip {
  /** `photo` and `choices` give the chosen photo and the server's limits; `changed` hears that something is new, `use` that the motion is wanted. */
  constructor(photo, choices, changed, use) {
    this.use = use;
    const file = byId("clip-file");
    file.onchange = () => { const [sent] = file.files; if (sent) this.take(sent); file.value = ""; };
    this.take = async (sent, problem = byId("clip-problem")) => {
      const now = photo();
      if (!now) { say(problem, "Add a photo first: the person of the photo takes over the motion."); return; }
      const limit = choices().clip;
      if (sent.size > limit) { say(problem, `This is larger than ${limit >> 20} MB; send a shorter video.`); return; }
      say(problem, "");
      byId("clip").setAttribute("aria-busy", "true");
      try {
        await ask(`api/photos/${now.id}/clip?name=${encodeURIComponent(sent.name)}`, { method: "POST", body: sent });
        use({ title: sent.name.replace(/\.[^.]*$/, "") || "video" });
      } catch (error) { say(problem, error.message); }
      byId("clip").removeAttribute("aria-busy");
      changed();
    };
    byId("clip-remove").onclick = async () => {
      try { await ask(`api/photos/${photo().id}/clip`, { method: "DELETE" }); } catch (error) { say(byId("clip-problem"), error.message); return; }
      changed();
    };
  }

  show(photo) {
    const has = Boolean(photo && photo.clip);
    byId("clip-use").hidden = byId("clip-remove").hidden = !has;
    byId("clip-use").textContent = has ? `Do what happens in ${photo.clip_title} (${duration(photo.clip_seconds || 1)})` : "";
    byId("clip-use").onclick = () => this.use({ title: photo.clip_title });
  }
}
