// Takes a photo with the camera after a countdown: a person who wants to be seen whole has to step back.
import { byId, openDialog, say } from "./tools.js";

export class Camera {
  constructor(button, take) {
    this.take = take;
    this.stream = null;
    this.dialog = byId("shutter");
    this.live = byId("live");
    button.hidden = !(navigator.mediaDevices && navigator.mediaDevices.getUserMedia);
    button.onclick = () => this.open();
    byId("shut").onclick = () => this.dialog.close();
    byId("snap").onclick = () => this.count(Number(byId("delay").value));
    this.dialog.onclose = () => this.stop();
  }

  async open() {
    say(byId("shutter-problem"), "");
    openDialog(this.dialog);
    byId("snap").disabled = true;
    try {
      const wanted = { video: { width: { ideal: 1920 }, height: { ideal: 1920 }, facingMode: "user" }, audio: false };
      const stream = await navigator.mediaDevices.getUserMedia(wanted);
      if (!this.dialog.open) { stream.getTracks().forEach(track => track.stop()); return; }
      this.stream = stream;
      this.live.srcObject = stream;
      await this.live.play();
      byId("snap").disabled = false;
    } catch (error) {
      say(byId("shutter-problem"), `The camera cannot be used: ${error.message || error.name}.`);
    }
  }

  count(seconds) {
    byId("snap").disabled = true;
    const tick = () => {
      if (!this.dialog.open) return;
      byId("countdown").textContent = seconds || "";
      if (seconds-- > 0) setTimeout(tick, 1000);
      else this.snap();
    };
    tick();
  }

  snap() {
    const canvas = document.createElement("canvas");
    canvas.width = this.live.videoWidth;
    canvas.height = this.live.videoHeight;
    canvas.getContext("2d").drawImage(this.live, 0, 0);
    canvas.toBlob(blob => { this.dialog.close(); this.take(blob); }, "image/jpeg", 0.93);
  }

  stop() {
    byId("countdown").textContent = "";
    if (this.stream) this.stream.getTracks().forEach(track => track.stop());
    this.stream = null;
    this.live.srcObject = null;
  }
}
