// Lines drawn on the ground.
const CLOSE = 0.12;

/** Points of a line without those that lie within `CLOSE` meters of it (Douglas and Peucker 1973). */
export function simpler(points) {
  if (points.length < 3) return points;
  const [a, b] = [points[0], points.at(-1)], long = Math.hypot(b[0] - a[0], b[1] - a[1]);
  const gap = ([x, z]) => long < 1e-6 ? Math.hypot(x - a[0], z - a[1]) : Math.abs((b[0] - a[0]) * (a[1] - z) - (a[0] - x) * (b[1] - a[1])) / long;
  let worst = 0, far = 0;
  points.forEach((point, index) => { if (index && index < points.length - 1 && gap(point) > far) { far = gap(point); worst = index; } });
  return far < CLOSE ? [a, b] : [...simpler(points.slice(0, worst + 1)), ...simpler(points.slice(worst)).slice(1)];
}
