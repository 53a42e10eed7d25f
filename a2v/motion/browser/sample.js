// Motion out of an exported model, in the browser: export/sample.py for one clip, with onnxruntime-web (`ort`) for onnxruntime and
// arrays without a clip's leading dimension. `meta` is what the model says of itself.
"use strict";
const makeSampler = (session, meta) => {
  const count = meta.bone_lengths.length, row = 3 * count;
  const tensor = (kind, data, ...shape) => new ort.Tensor(kind, kind === "int64" ? BigInt64Array.from(data, BigInt) : Float32Array.from(data), shape);
  const run = async feed => {
    if (session.inputNames.includes("bone_lengths")) feed.bone_lengths = tensor("float32", meta.bone_lengths, 1, count);
    const made = await session.run(feed, ["joints"]);
    return made.joints.data;
  };
  const evenly = x => { const near = Math.round(x); return near - x === 0.5 && near % 2 ? near - 1 : near; };  // as Python rounds halves

  // whole windows; each continues the last frames of the previous one
  async function windows(labels, draw, guidance) {
    const given = meta.context_frames, joints = new Float32Array(labels.length * row);
    let done = 0;
    for (let end = 1; end <= labels.length; end++) {
      if (end < labels.length && labels[end] === labels[end - 1]) continue;
      const shares = meta.active[labels[end - 1]];
      while (done < end) {
        const follows = done > 0, context = new Float32Array(given * row), noise = draw(meta.latent_size);
        // the last number of the noise draws how much of the window moves; a window that continues a clip takes a share from the longer half
        const first = Math.floor(shares.length / (follows ? 2 : 20)), even = 1 / (1 + Math.exp(-1.702 * noise[noise.length - 1]));
        const share = Math.fround(shares[first + Math.floor(even * (shares.length - first))]);
        const usable = Math.max(evenly(Math.fround(share * meta.window_frames)), given + 4);
        for (let back = 0; follows && back < given; back++) {
          const from = Math.max(done - given + back, 0);
          context.set(joints.subarray(from * row, from * row + row), back * row);
        }
        const feed = {
          noise: tensor("float32", noise, 1, meta.latent_size), actions: tensor("int64", [labels[end - 1]], 1),
          active: tensor("float32", [share], 1), context: tensor("float32", context, 1, given, count, 3),
          has_context: tensor("float32", [follows ? 1 : 0], 1),
        };
        if (session.inputNames.includes("guidance")) feed.guidance = tensor("float32", [guidance], 1);
        const made = await run(feed), skip = follows ? given : 0, left = end - done;
        // a window that is gone on from does without its last two frames, in which clips come to rest
        const take = left <= usable - skip ? left : Math.max(usable - 2, given + 4) - skip;
        for (let i = 0; i < take * row; i++) joints[done * row + i] = made[skip * row + i] + context[i % 3];
        done += take;
      }
    }
    return joints;
  }

  // one frame after the other
  function steps(labels, draw) {
    const frames = labels.length, zeros = size => tensor("float32", new Float32Array(size), 1, size);
    return run({
      noise: tensor("float32", draw(frames * meta.latent_size), 1, frames, meta.latent_size), actions: tensor("int64", labels, 1, frames),
      time: tensor("float32", labels.map((_, t) => Math.fround(t + 1) / frames), 1, frames),
      previous: tensor("float32", new Float32Array(row), 1, count, 3),
      ...Object.fromEntries(["prior", "low", "high", "trajectory"].map(name => [name, zeros(meta.hidden_size)])),
    }).then(made => made.slice());
  }

  const lowest = joints => Array.from({ length: joints.length / row }, (_, t) => {
    let low = Infinity;
    for (let i = t * row + 1; i < (t + 1) * row; i += 3) low = Math.min(low, joints[i]);
    return low;
  });

  // what a small slope in every window adds up to is taken off: the lowest joint over half a window is the floor
  function levelFloor(joints) {
    const frames = joints.length / row, window = meta.frames, half = Math.floor(window / 2), quarter = Math.floor(half / 2);
    if (frames <= window || half < 1) return;
    const middles = [];
    for (let t = window + quarter; t < frames; t += half) middles.push(t);
    if (!middles.length || middles[middles.length - 1] + quarter < frames - 1) middles.push(Math.max(window, frames - 1 - quarter));
    const at = [window - 1, ...middles], low = lowest(joints), lift = low.map(() => 0), floor = Math.min(...low.slice(0, window));
    for (let round = 0; round < 3; round++) {
      const level = low.map((height, t) => height - lift[t]);
      const away = [0, ...middles.map(t => Math.min(...level.slice(Math.max(t - quarter, 0), t + quarter + 1)) - floor)];
      for (let t = window - 1; t < frames; t++) {
        const next = at.findIndex(middle => middle > t);
        if (next < 0) { lift[t] += away[away.length - 1]; continue; }
        lift[t] += away[next - 1] + (away[next] - away[next - 1]) * (t - at[next - 1]) / (at[next] - at[next - 1]);
      }
    }
    for (let i = 1; i < joints.length; i += 3) joints[i] -= Math.fround(lift[Math.floor(i / row)]);
  }

  // joints of a clip, frame by frame: meters, y up, above the origin at first, the lowest joint on the ground
  return async ({ labels, seed = 0, guidance = meta.guidance, draw = normalNoise(seed) }) => {
    const joints = await (meta.format === "a2v-flow/1" ? windows : steps)(labels, draw, guidance);
    levelFloor(joints);
    const offset = [joints[0], Math.min(...lowest(joints)), joints[2]];
    for (let i = 0; i < joints.length; i++) joints[i] -= offset[i % 3];
    return joints;
  };
};
