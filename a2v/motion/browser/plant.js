// Feet that stand, as in a2v.motion.smoothing, a2v.motion.edit (settle) and a2v.kinematics.planting, for one clip.
// `about`: fps, parents, legs (hip, knee, ankle, toe of each), and by action: air (seconds without ground), rises, smoothed (seconds).
"use strict";
const makeFeet = about => {
  const { fps, parents, legs } = about, count = parents.length, row = 3 * count;
  const PLANT = { height: 0.06, speed: 0.5, share: 0.4, least: 1, most: 2.2, low: 0.06, shortest: 0.1, sway: 0.12, ease: 0.04, even: 0.033, clearance: 0.045, rise: 0.12, reach: 0.12 };
  const evenly = x => { const near = Math.round(x); return near - x === 0.5 && near % 2 ? near - 1 : near; };  // as Python rounds halves
  const clamp = (x, low, high) => Math.min(Math.max(x, low), high);
  const map = (length, make) => Float64Array.from({ length }, (_, t) => make(t));

  // filters over time; beyond the ends the first and the last value go on
  function gaussian(values, sigma) {
    const radius = Math.floor(4 * sigma + 0.5), last = values.length - 1;
    const weights = map(2 * radius + 1, k => Math.exp(-0.5 * ((k - radius) / sigma) ** 2)), total = weights.reduce((sum, weight) => sum + weight, 0);
    return map(values.length, t => weights.reduce((sum, weight, k) => sum + weight * values[clamp(t + k - radius, 0, last)], 0) / total);
  }
  const windowed = (values, size, join) => map(values.length, t => {
    let found = values[clamp(t - (size >> 1), 0, values.length - 1)];
    for (let k = 1; k < size; k++) found = join(found, values[clamp(t - (size >> 1) + k, 0, values.length - 1)]);
    return found;
  });
  const lowestOf = (values, size) => windowed(values, size, Math.min), highestOf = (values, size) => windowed(values, size, Math.max);
  function quantile(values, share) {
    const sorted = Float64Array.from(values).sort(), at = share * (sorted.length - 1), low = Math.floor(at);
    return sorted[low] + (at - low) * (sorted[Math.min(low + 1, sorted.length - 1)] - sorted[low]);
  }
  // least squares of distances and third differences: (1 + width^6 D'D) x = values, by a banded Cholesky factor
  function evened(values, width) {
    const n = values.length, size = width ** 6, third = [-1, 3, -3, 1];
    if (n < 4 || width <= 0) return values;
    const bands = [0, 1, 2, 3].map(() => new Float64Array(n));
    for (let i = 0; i < n - 3; i++) for (let a = 0; a < 4; a++) for (let b = a; b < 4; b++) bands[b - a][i + a] += size * third[a] * third[b];
    for (let i = 0; i < n; i++) bands[0][i] += 1;
    for (let i = 0; i < n; i++) {
      for (let k = Math.max(0, i - 3); k < i; k++) for (let j = i; j <= k + 3 && j < n; j++) bands[j - i][i] -= bands[i - k][k] * bands[j - k][k] * bands[0][k];
      for (let j = 1; j < 4 && i + j < n; j++) bands[j][i] /= bands[0][i];
    }
    const x = Float64Array.from(values);
    for (let i = 0; i < n; i++) for (let j = 1; j < 4 && i + j < n; j++) x[i + j] -= bands[j][i] * x[i];
    for (let i = n - 1; i >= 0; i--) { x[i] /= bands[0][i]; for (let j = 1; j < 4 && i + j < n; j++) x[i] -= bands[j][i] * x[i + j]; }
    return x;
  }
  function runs(flags) {
    const found = [];
    flags.forEach((flag, t) => { if (flag) { if (t && flags[t - 1]) found[found.length - 1][1] = t + 1; else found.push([t, t + 1]); } });
    return found;
  }
  // values where no flag is: smoothly from the last flagged one to the next, constant beyond the ends
  function bridged(values, flags) {
    const n = values.length, after = new Array(n), out = new Float64Array(n);
    for (let t = n - 1, next = n; t >= 0; t--) { if (flags[t]) next = t; after[t] = next; }
    for (let t = 0, last = -1; t < n; t++) {
      if (flags[t]) last = t;
      const [first, second] = last < 0 && after[t] >= n ? [0, 0] : [last < 0 ? after[t] : last, after[t] >= n ? last : after[t]];
      const s = second > first ? (t - first) / Math.max(second - first, 1) : 0, share = s * s * (3 - 2 * s);
      out[t] = (1 - share) * values[first] + share * values[second];
    }
    return out;
  }

  // a clip is a list of tracks: joint, then axis, then time
  const tracks = joints => parents.map((_, joint) => [0, 1, 2].map(axis => map(joints.length / row, t => joints[t * row + 3 * joint + axis])));
  const flat = clip => Float32Array.from({ length: row * clip[0][0].length }, (_, i) => clip[Math.floor(i / 3) % count][i % 3][Math.floor(i / row)]);

  // the actions that the model makes jerkily, smoothed; bones keep their lengths
  function smooth(clip, widths) {
    const most = Math.max(...widths), frames = widths.length;
    if (!most || frames < 4) return clip;
    const weight = windowed(widths.map(Number), 1, Math.min).map(width => (width > 0 ? 1 : 0)), size = Math.max(1, evenly(0.4 * fps));
    const share = widths.every(Boolean) ? weight.fill(1) : windowed(weight, size, (a, b) => a + b).map(sum => sum / size);
    const bones = clip.map((joint, j) => joint.map((track, axis) => (parents[j] < 0 ? track : track.map((value, t) => value - clip[parents[j]][axis][t]))));
    const soft = bones.map(bone => bone.map(track => evened(track, most * fps)));
    const made = [];
    const size3 = (bone, t) => Math.hypot(bone[0][t], bone[1][t], bone[2][t]);
    const along = (bone, from, t, axis) => bone[axis][t] / Math.max(size3(bone, t), 1e-9) * size3(from, t);
    bones.forEach((bone, j) => {
      const even = parents[j] < 0 ? soft[j] : [0, 1, 2].map(axis => map(frames, t => along(soft[j], bone, t, axis)));
      const mixed = bone.map((track, axis) => track.map((value, t) => (1 - share[t]) * value + share[t] * even[axis][t]));
      made[j] = parents[j] < 0 ? mixed : [0, 1, 2].map(axis => map(frames, t => made[parents[j]][axis][t] + along(mixed, bone, t, axis)));
    });
    return made;
  }

  // a height of the lowest joint above the ground that lasts for this number of seconds is removed
  function settle(clip, seconds) {
    const frames = clip[0][0].length, heights = clip.map(joint => joint[1]), off = heights.map(() => 0);
    if (legs.length === 2) for (const part of [2, 3]) {
      const own = legs.map(leg => quantile(heights[leg[part]], 0.05)), least = Math.min(...own);
      legs.forEach((leg, k) => { off[leg[part]] = Math.min(own[k] - least, 0.03); });
    }
    const low = map(frames, t => heights.reduce((found, track, j) => Math.min(found, track[t] - off[j]), Infinity));
    const width = Math.max(1, evenly(seconds * fps)), floor = gaussian(lowestOf(low, width), width / 4), least = Math.min(...low);
    return clip.map(([x, y, z]) => [x, y.map((value, t) => value - (Math.min(floor[t], low[t]) - least)), z]);
  }

  const speedOf = (x, z) => {
    const steps = map(x.length - 1, t => Math.hypot(x[t + 1] - x[t], z[t + 1] - z[t]) * fps), last = steps.length - 1;
    return map(x.length, t => Math.min(steps[Math.max(t - 1, 0)], steps[Math.min(t, last)]));
  };
  function withoutShort(flags, frames) {
    const out = [...flags];
    for (const value of [false, true])
      for (const [start, end] of runs(out.map(flag => flag === value)))
        if (end - start < Math.min(frames, out.length) && (value || (start > 0 && end < out.length))) out.fill(!value, start, end);
    return out;
  }

  // when feet stand, whether by the toe, and the floor of each foot's parts
  function contacts(feet, root, rises) {
    const width = Math.max(1, evenly(0.8 * fps));
    let floor = feet.map(foot => foot.map(part => (rises ? lowestOf(part[1], width) : part[1].map(() => 0).fill(quantile(part[1], 0.05)))));
    const over = feet.map((foot, k) => foot.map((part, p) => part[1].map((y, t) => Math.max(y - floor[k][p][t], 0))));
    const body = gaussian(speedOf(root[0], root[2]), 0.2 * fps);
    const cost = feet.map((foot, k) => foot.map((part, p) => speedOf(part[0], part[2]).map((speed, t) => over[k][p][t] / PLANT.height + speed / (PLANT.speed + PLANT.share * body[t]))));
    const toe = cost.map(([heel, ball]) => [...ball].map((value, t) => value <= heel[t] + 0.1));
    const best = cost.map(([heel, ball]) => heel.map((value, t) => Math.min(value, ball[t])));
    const stands = best.map((own, k) => withoutShort([...own].map((value, t) =>
      value < PLANT.least || (value <= best[1 - k][t] && Math.min(over[k][0][t], over[k][1][t]) < PLANT.low && value < PLANT.most)), PLANT.shortest * fps));
    if (rises) {
      const ground = [0, 1].map(part => Math.min(...feet.map(foot => quantile(foot[part][1], 0.02))));
      const levels = stepLevels(feet.map(foot => map(root[0].length, t => Math.min(foot[0][1][t] - ground[0], foot[1][1][t] - ground[1]))), stands);
      floor = levels.map(level => [0, 1].map(part => level.map(height => ground[part] + height)));
    }
    return { stands, toe, floor };
  }

  // how high what each foot stands on is over the ground: levels of contacts that are near one another are one step
  function stepLevels(lower, stands) {
    const found = stands.flatMap((flags, k) => runs(flags).map(([start, end]) => ({ k, start, end, rise: quantile(lower[k].subarray(start, end), 0.5) })));
    const order = [...found].sort((a, b) => a.rise - b.rise), groups = [];
    order.forEach((run, i) => { if (!i || run.rise - order[i - 1].rise > 0.045) groups.push([]); groups[groups.length - 1].push(run); });
    const held = lower.map(track => new Float64Array(track.length));
    for (const group of groups) {
      const total = group.reduce((sum, run) => sum + run.end - run.start, 0), mean = group.reduce((sum, run) => sum + run.rise * (run.end - run.start), 0) / total;
      for (const { k, start, end } of group) held[k].fill(mean < 0.07 ? 0 : mean, start, end);
    }
    return held.map((track, k) => bridged(track, stands[k]));
  }

  // standing feet stay where they are: the body is carried along with them, legs reach
  function plant(clip, rises) {
    const frames = clip[0][0].length;
    if (legs.length !== 2 || frames < 4) return clip;
    const feet = legs.map(leg => [clip[leg[2]], clip[leg[3]]]), { stands, toe, floor } = contacts(feet, clip[0], rises);
    const steps = feet.map((foot, k) => [0, 2].map(axis => map(frames, t => {
      const part = foot[t ? (toe[k][t] && toe[k][t - 1] ? 1 : 0) : 0][axis];
      return t ? part[t] - part[t - 1] : 0;
    })));
    const both = stands.map(flags => map(frames, t => (t && flags[t] && flags[t - 1] ? 1 : 0)));
    const total = gaussian(map(frames, t => Math.max(both[0][t] + both[1][t], 0.02)), PLANT.sway * fps);
    const body = [0, 1].map(axis => {
      const slid = gaussian(map(frames, t => both[0][t] * steps[0][axis][t] + both[1][t] * steps[1][axis][t]), PLANT.sway * fps);
      let sum = 0;
      const moved = slid.map((value, t) => (sum -= value / Math.max(total[t], 1e-6)));
      return moved.map(value => value - moved[0]);
    });
    const out = clip.map(([x, y, z]) => [x.map((value, t) => value + body[0][t]), Float64Array.from(y), z.map((value, t) => value + body[1][t])]);
    const move = legs.map((_, k) => {
      const over = feet[k].map((part, p) => part[1].map((y, t) => y - floor[k][p][t])), least = map(frames, t => Math.min(over[0][t], over[1][t]));
      const slid = [0, 1].map(axis => { let sum = 0; return map(frames, t => (sum -= steps[k][axis][t] + (t ? body[axis][t] - body[axis][t - 1] : 0))); });
      const held = [0, 1, 2].map(() => new Float64Array(frames));
      for (const [start, end] of runs(stands[k])) for (const axis of [0, 1]) {
        const mean = slid[axis].subarray(start, end).reduce((sum, value) => sum + value, 0) / (end - start);
        for (let t = start; t < end; t++) held[2 * axis][t] = slid[axis][t] - mean;
      }
      stands[k].forEach((flag, t) => { if (flag) held[1][t] = -least[t]; });
      const inner = lowestOf(stands[k].map(Number), 3);
      const moved = held.map(track => {
        const whole = bridged(track, stands[k]), soft = gaussian(whole, PLANT.ease * fps);
        return whole.map((value, t) => inner[t] * value + (1 - inner[t]) * soft[t]);
      });
      const clear = cleared(least.map((value, t) => value + moved[1][t]), feet[k], stands[k]);
      moved[1] = moved[1].map((value, t) => value + clear[t]);
      return moved;
    });
    reach(out, move);
    return out;
  }

  // how far a foot has to rise to stay out of its floor, and clear of it while it swings
  function cleared(over, foot, stands) {
    const [heel, ball] = foot.map(part => speedOf(part[0], part[2])), frames = Math.max(1, evenly(PLANT.rise * fps));
    const swings = heel.map((value, t) => (stands[t] ? 0 : clamp((Math.min(value, ball[t]) - 0.3) / 0.4, 0, 1)));
    const rising = gaussian(lowestOf(swings, frames), frames / 3);
    const needed = over.map((value, t) => Math.max(PLANT.clearance * Math.min(1.5 * rising[t], 1) - value, 0));
    return gaussian(highestOf(needed, 2 * Math.max(1, evenly(0.07 * fps)) + 1), 0.07 * fps);
  }

  function reach(clip, move) {
    const frames = clip[0][0].length, away = (a, b, t) => Math.hypot(...[0, 1, 2].map(axis => clip[b][axis][t] - clip[a][axis][t]));
    const targets = legs.map((leg, k) => [0, 1, 2].map(axis => evened(clip[leg[2]][axis].map((value, t) => value + move[k][axis][t]), PLANT.even * fps)));
    let drop = map(frames, t => Math.max(0, ...legs.map(([hip, knee, ankle], k) => {
      const longest = Math.max(0.999 * (away(hip, knee, t) + away(knee, ankle, t)), away(hip, ankle, t));
      const way = targets[k].map((track, axis) => track[t] - clip[hip][axis][t]);
      return clamp(-way[1] - Math.sqrt(Math.max(longest ** 2 - way[0] ** 2 - way[2] ** 2, (0.5 * longest) ** 2)), 0, PLANT.reach);
    })));
    const width = Math.max(1, evenly(0.1 * fps));
    drop = gaussian(highestOf(drop, 2 * width + 1), width / 1.5);
    for (const joint of clip) joint[1] = joint[1].map((y, t) => y - drop[t]);
    legs.forEach(([hip, knee, ankle, toe], k) => { for (let t = 0; t < frames; t++) bend(clip, hip, knee, ankle, toe, targets[k].map(track => track[t]), t); });
  }

  // two-bone inverse kinematics in the plane in which the leg is bent
  function bend(clip, hip, knee, ankle, toe, target, t) {
    const at = joint => clip[joint].map(track => track[t]), minus = (a, b) => a.map((value, axis) => value - b[axis]);
    const [h, k, a] = [hip, knee, ankle].map(at), foot = minus(at(toe), a), way = minus(target, h), distance = Math.hypot(...way);
    const upper = Math.hypot(...minus(k, h)), lower = Math.hypot(...minus(a, k)), longest = Math.max(0.999 * (upper + lower), Math.hypot(...minus(a, h)));
    const direction = way.map(value => value / Math.max(distance, 1e-9));
    const reached = Math.min(Math.max(distance, Math.abs(upper - lower) + 1e-6), Math.min(longest, upper + lower));
    const along = (upper ** 2 - lower ** 2 + reached ** 2) / (2 * reached), forward = minus(k, h), ahead = forward.reduce((sum, value, axis) => sum + value * direction[axis], 0);
    const side = forward.map((value, axis) => value - ahead * direction[axis]), size = Math.max(Math.hypot(...side), 1e-9), out = Math.sqrt(Math.max(upper ** 2 - along ** 2, 0));
    for (const axis of [0, 1, 2]) {
      clip[knee][axis][t] = h[axis] + along * direction[axis] + out * side[axis] / size;
      clip[ankle][axis][t] = h[axis] + reached * direction[axis];
      clip[toe][axis][t] = clip[ankle][axis][t] + foot[axis];
    }
  }

  // joints of a clip whose frames have the actions `labels`, smoothed where that is due, on the ground, with feet that stand
  return (joints, labels) => {
    const rises = labels.some(label => about.rises[label]);
    let clip = smooth(tracks(joints), Array.from(labels, label => about.smoothed[label]));
    if (!rises) clip = settle(clip, Math.max(...labels.map(label => about.air[label])));
    return flat(plant(clip, rises));
  };
};
