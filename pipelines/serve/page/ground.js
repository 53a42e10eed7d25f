// A path on the ground, drawn with mouse or finger, or written as points: seen from above, the cameras' front view below.
import { byId } from "./tools.js";

const HALF = 4, MOST = 20, CLOSE = 0.12;

/** Points of a line without those that lie within `CLOSE` meters of it (Douglas and Peucker 1973). */
function simpler(points) {
  if (points.length < 3) return points;
  const [a, b] = [points[0], points.at(-1)], long = Math.hypot(b[0] - a[0], b[1] - a[1]);
  const gap = ([x, z]) => long < 1e-6 ? Math.hypot(x - a[0], z - a[1]) : Math.abs((b[0] - a[0]) * (a[1] - z) - (a[0] - x) * (b[1] - a[1])) / long;
  let worst = 0, far = 0;
  points.forEach((point, index) => { if (index && index < points.length - 1 && gap(point) > far) { far = gap(point); worst = index; } });
  return far < CLOSE ? [a, b] : [...simpler(points.slice(0, worst + 1)), ...simpler(points.slice(worst)).slice(1)];
}

export class Ground {
  constructor() {
    this.svg = byId("ground");
    this.text = byId("path");
    this.line = byId("ground-line");
    this.begin = byId("ground-begin");
    this.svg.onpointerdown = event => this.press(event);
    this.text.oninput = () => this.show();
    byId("ground-clear").onclick = () => { this.text.value = ""; this.show(); };
  }

  get value() { return this.text.value.trim().replace(/\s+/g, " "); }

  points() { return this.value.split(" ").filter(Boolean).map(point => point.split(",").map(Number)).filter(point => point.length === 2 && point.every(Number.isFinite)); }

  show(points = this.points()) {
    this.line.setAttribute("points", points.map(point => point.join(",")).join(" "));
    this.begin.setAttribute("cx", points.length ? points[0][0] : 99);
    this.begin.setAttribute("cy", points.length ? points[0][1] : 99);
  }

  press(event) {
    const box = this.svg.getBoundingClientRect(), drawn = [];
    const take = now => {
      drawn.push([now.clientX - box.left, now.clientY - box.top].map((value, axis) => Math.min(HALF, Math.max(-HALF, (value / (axis ? box.height : box.width) * 2 - 1) * HALF))));
      this.show(drawn);
    };
    event.preventDefault();
    this.svg.setPointerCapture(event.pointerId);
    take(event);
    this.svg.onpointermove = take;
    this.svg.onpointerup = this.svg.onpointercancel = () => {
      this.svg.onpointermove = this.svg.onpointerup = this.svg.onpointercancel = null;
      let points = simpler(drawn);
      while (points.length > MOST) points = points.filter((point, index) => index % 2 === 0 || index === points.length - 1);
      if (points.length > 1) this.text.value = points.map(point => point.map(value => value.toFixed(1)).join(",")).join(" ");
      this.show();
    };
  }
}
