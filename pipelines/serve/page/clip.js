// A video whose motion the person takes over.
import { ask, byId, duration, say } from "./tools.js";

export class Clip {
  /** `photo` and `choices` give the chosen photo and the server's limits; `changed` hears that something is new. */
  constructor(photo, choices, changed) {
    const problem = byId("clip-problem"), file = byId("clip-file");
    file.onchange = async () => {
      const sent = file.files[0], now = photo();
      file.value = "";
      if (!sent) return;
      if (!now) { say(problem, "Choose a photo first."); return; }
      const limit = choices().clip;
      if (sent.size > limit) { say(problem, `This is larger than ${limit >> 20} MB; send a shorter video.`); return; }
      say(problem, "");
      byId("clip").setAttribute("aria-busy", "true");
      try {
        await ask(`api/photos/${now.id}/clip?name=${encodeURIComponent(sent.name)}`, { method: "POST", body: sent });
        byId("clip-use").checked = true;
      } catch (error) { say(problem, error.message); }
      byId("clip").removeAttribute("aria-busy");
      changed();
    };
    byId("clip-remove").onclick = async () => {
      try { await ask(`api/photos/${photo().id}/clip`, { method: "DELETE" }); } catch (error) { say(problem, error.message); return; }
      byId("clip-use").checked = false;
      changed();
    };
  }

  /** Whether the motion of the video is requested. */
  get used() { return byId("clip-use").checked && !byId("clip-use-label").hidden; }

  show(photo) {
    byId("clip-use-label").hidden = byId("clip-remove").hidden = !photo.clip;
    byId("clip-name").textContent = `use the motion of ${photo.clip_title}${photo.clip_seconds ? ` (${duration(photo.clip_seconds)})` : ""}`;
  }
}
