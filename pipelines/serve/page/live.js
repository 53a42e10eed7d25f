// The camera of this machine drives the character: frames go to the local server, poses come back.
import { ask, make, say } from "./tools.js";

const SIDE = 480, QUALITY = 0.75, AT_ONCE = 2;
const STATE = { nobody: "No person is visible. Step back until you are seen from head to feet.", warming: "Measuring you: stand upright for a second.", driven: "" };

/** Put the controls of the live mode into `box`, for the person `id` on `stage`; `able` tells whether the person is made. */
export function liveControls(box, id, stage, able, changed) {
  const live = new Live(id, stage, able, changed);
  box.replaceChildren(...(navigator.mediaDevices && navigator.mediaDevices.getUserMedia ? live.elements : []));
  return live;
}

class Live {
  constructor(id, stage, able, changed) {
    Object.assign(this, { id, stage, able, changed, session: "", stream: null, waiting: 0, recording: false });
    this.start = make("button", { type: "button" }, "Live camera");
    this.start.title = "The camera of this machine moves the person";
    this.record = make("button", { type: "button", hidden: true }, "Record");
    this.mirror = make("input", { type: "checkbox", checked: true });
    this.label = make("label", { hidden: true });
    this.label.append(this.mirror, " mirror");
    this.state = make("p", { className: "hint" });
    this.state.setAttribute("role", "status");
    this.note = make("p", { className: "hint", hidden: true });
    this.note.setAttribute("role", "status");
    this.problem = make("p", { className: "problem", hidden: true });
    this.problem.setAttribute("role", "alert");
    this.video = make("video", { muted: true, playsInline: true, hidden: true });
    this.canvas = document.createElement("canvas");
    const row = make("div", { className: "row live" });
    row.append(this.start, this.record, this.label);
    this.elements = [row, this.state, this.note, this.problem];
    this.start.onclick = () => (this.session || this.stream ? this.stop() : this.begin());
    this.record.onclick = () => this.toggle();
  }

  async begin() {
    say(this.problem, this.able() ? "" : "Add a photo first, and wait until the person is made.");
    if (!this.able()) return;
    this.start.disabled = true;
    this.state.textContent = "Preparing the camera…";
    try {
      this.stream = await navigator.mediaDevices.getUserMedia({ video: { width: { ideal: 640 }, height: { ideal: 480 }, frameRate: { ideal: 30 } }, audio: false });
      this.video.srcObject = this.stream;
      await this.video.play();
      const { session, vmc } = await ask(`api/people/${this.id}/live`, { method: "POST" });
      this.session = session;
      this.vmc = vmc ? ` Also sent to other programs of this machine, port ${vmc}.` : "";
    } catch (error) {
      await this.stop();
      say(this.problem, error.name === "NotAllowedError" || error.name === "NotFoundError" ? `The camera cannot be used: ${error.message}.` : error.message);
      return;
    } finally { this.start.disabled = false; }
    this.start.textContent = "Stop";
    this.record.hidden = this.label.hidden = false;
    this.begun = performance.now();
    this.answers = [];
    this.loop();
  }

  /** Send the newest picture as soon as fewer than `AT_ONCE` wait for their answers. */
  async loop() {
    while (this.session) {
      if (this.waiting < AT_ONCE && this.video.videoWidth) { this.waiting++; this.send(await this.picture(), performance.now() - this.begun).finally(() => { this.waiting--; }); }
      await new Promise(done => setTimeout(done, 15));
    }
  }

  picture() {
    const scale = Math.min(1, SIDE / Math.max(this.video.videoWidth, this.video.videoHeight));
    this.canvas.width = Math.round(this.video.videoWidth * scale);
    this.canvas.height = Math.round(this.video.videoHeight * scale);
    const pen = this.canvas.getContext("2d");
    if (this.mirror.checked) pen.setTransform(-1, 0, 0, 1, this.canvas.width, 0);
    pen.drawImage(this.video, 0, 0, this.canvas.width, this.canvas.height);
    return new Promise(done => this.canvas.toBlob(done, "image/jpeg", QUALITY));
  }

  async send(blob, at) {
    const session = this.session;
    try {
      const told = await ask(`api/live/${session}/frame?time=${(at / 1000).toFixed(4)}`, { method: "POST", body: blob });
      if (session !== this.session) return;
      if (told.state === "driven") this.stage.drive(told);
      this.tell(told);
    } catch (error) {
      if (session === this.session) { await this.stop(); say(this.problem, error.message); }
    }
  }

  tell(told) {
    if (told.state === "late") return;
    const now = performance.now();
    this.answers = [...this.answers.filter(at => now - at < 2000), now];
    const rate = this.answers.length > 3 ? (1000 * (this.answers.length - 1)) / (now - this.answers[0]) : 0;
    this.state.dataset.rate = rate.toFixed(1);
    this.state.dataset.state = told.state;
    this.state.dataset.recorded = told.recorded || 0;
    const text = told.state === "driven" ? `${Math.round(rate)} poses a second.${this.vmc}${this.recording ? " Recording." : ""}` : STATE[told.state];
    if (this.state.textContent !== text) this.state.textContent = text;
  }

  async toggle() {
    this.record.disabled = true;
    say(this.problem, "");
    try {
      const on = !this.recording;
      say(this.note, on ? "" : "Keeping the motion…");
      await ask(`api/live/${this.session}/record`, { method: "POST", body: JSON.stringify({ on }) });
      this.recording = on;
      if (!on) { say(this.note, "The motion is among the files of this person."); this.changed(); }
    } catch (error) { this.recording = false; say(this.note, ""); say(this.problem, error.message); }
    this.record.textContent = this.recording ? "Keep the recording" : "Record";
    this.record.disabled = false;
  }

  async stop() {
    const session = this.session;
    this.session = "";
    this.recording = false;
    if (this.stream) this.stream.getTracks().forEach(track => track.stop());
    this.stream = null;
    this.video.srcObject = null;
    this.start.textContent = "Live camera";
    if (session && this.stage) this.stage.live = null;
    this.record.textContent = "Record";
    this.record.hidden = this.label.hidden = true;
    this.state.textContent = "";
    if (session) await ask(`api/live/${session}`, { method: "DELETE" }).catch(() => {});
  }
}
