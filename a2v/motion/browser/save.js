// Saves a clip as a file: BVH of its joints, or glTF of the figure that plays it. Needs three.js as `THREE`, and `poseAt`.
"use strict";

const SAVED_FPS = 30;

// The clip on its curves, frame by frame at SAVED_FPS.
function framesOf({ joints, parents, last }, fps) {
  const count = Math.max(1, Math.round(last / fps * SAVED_FPS) + 1);
  return Array.from({ length: count }, (_, t) => poseAt(joints, parents, Math.min(t / SAVED_FPS * fps, last)));
}

// BVH in centimeters as a2v.formats.bvh writes it: where a joint has several bones, each has a joint of zero offset of its own
// (`<child>_turn`), so that every joint is where the clip has it. Bones turn the shortest way from the one before.
function bvhOf(frames, { parents, names, rest }) {
  const children = parents.map((_, joint) => parents.flatMap((parent, child) => parent === joint ? [child] : []));
  const vector = (pose, joint) => new THREE.Vector3().fromArray(pose, 3 * joint);
  const bone = (pose, joint) => vector(pose, joint).sub(vector(pose, parents[joint]));
  const lengths = parents.map((parent, joint) => parent < 0 ? 0 : bone(frames[0], joint).length());
  const along = joint => new THREE.Vector3().fromArray(rest[joint]);
  const sides = ["left_hip", "right_hip"].map(name => names.indexOf(name));
  const upright = (first, second) => {
    const x = first.clone().normalize(), z = x.clone().cross(second).normalize();
    return new THREE.Quaternion().setFromRotationMatrix(new THREE.Matrix4().makeBasis(x, z.clone().cross(x), z));
  };
  const trunk = children[0].find(child => !sides.includes(child));
  const rootTurn = pose => {
    if (sides.includes(-1) || trunk === undefined) return new THREE.Quaternion();
    const now = upright(vector(pose, sides[0]).sub(vector(pose, sides[1])), bone(pose, trunk));
    const before = upright(along(sides[0]).multiplyScalar(lengths[sides[0]]).sub(along(sides[1]).multiplyScalar(lengths[sides[1]])), along(trunk));
    return now.multiply(before.invert());
  };
  const lines = ["HIERARCHY"], written = [];  // `written`: for each joint of the file whose turn it has, and under whose
  const numbers = values => values.map(value => value.toFixed(6)).join(" ");
  const offset = joint => numbers(parents[joint] < 0 ? [0, 0, 0] : along(joint).multiplyScalar(100 * lengths[joint]).toArray());
  const emit = (joint, depth, above) => {
    const pad = "\t".repeat(depth), below = children[joint], one = below.length === 1 && joint > 0;
    lines.push(`${pad}${depth ? "JOINT" : "ROOT"} ${names[joint]}`, `${pad}{`, `${pad}\tOFFSET ${offset(joint)}`);
    lines.push(`${pad}\tCHANNELS ${depth ? 3 : 6} ${depth ? "" : "Xposition Yposition Zposition "}Zrotation Xrotation Yrotation`);
    const own = one ? below[0] : joint;  // the bone that this joint turns; a fork keeps the turn of the bone before
    written.push([own, above]);
    for (const child of below) {
      if (one) emit(child, depth + 1, own);
      else {
        lines.push(`${pad}\tJOINT ${names[child]}_turn`, `${pad}\t{`, `${pad}\t\tOFFSET 0 0 0`, `${pad}\t\tCHANNELS 3 Zrotation Xrotation Yrotation`);
        written.push([child, own]);
        emit(child, depth + 2, child);
        lines.push(`${pad}\t}`);
      }
    }
    if (!below.length) lines.push(`${pad}\tEnd Site`, `${pad}\t{`, `${pad}\t\tOFFSET 0 0 0`, `${pad}\t}`);
    lines.push(`${pad}}`);
  };
  emit(0, 0, -1);
  lines.push("MOTION", `Frames: ${frames.length}`, `Frame Time: ${(1 / SAVED_FPS).toFixed(10)}`);
  const order = parents.map((_, joint) => joint);  // parents come first
  for (const pose of frames) {
    const turn = [rootTurn(pose)];
    for (const joint of order.slice(1)) {
      const above = turn[parents[joint]], now = bone(pose, joint).normalize();
      turn[joint] = new THREE.Quaternion().setFromUnitVectors(along(joint).normalize().applyQuaternion(above), now).multiply(above);
    }
    const row = vector(pose, 0).multiplyScalar(100).toArray();
    for (const [own, above] of written) {
      const local = above < 0 ? turn[own].clone() : turn[above].clone().invert().multiply(turn[own]);
      const angles = new THREE.Euler().setFromQuaternion(local, "ZXY");
      row.push(...["z", "x", "y"].map(axis => angles[axis] * 180 / Math.PI));
    }
    lines.push(numbers(row));
  }
  return lines.join("\n") + "\n";
}

// The bytes of a .glb out of its JSON and its binary part.
function packGlb(json, binary) {
  const whole = size => Math.ceil(size / 4) * 4, text = new TextEncoder().encode(JSON.stringify(json));
  const made = new Uint8Array(28 + whole(text.length) + whole(binary.length)), view = new DataView(made.buffer);
  [0x46546c67, 2, made.length, whole(text.length), 0x4e4f534a].forEach((value, index) => view.setUint32(4 * index, value, true));
  made.fill(32, 20, 20 + whole(text.length));
  made.set(text, 20);
  const at = 20 + whole(text.length);
  view.setUint32(at, whole(binary.length), true);
  view.setUint32(at + 4, 0x004e4942, true);
  made.set(binary, at + 8);
  return made;
}

// A .glb, or an empty one, whose only animation moves nodes: `tracks` are [node, "rotation" or "translation", numbers].
function animatedGlb(glb, name, seconds, tracks) {
  const view = new DataView(glb), size = view.getUint32(12, true), json = JSON.parse(new TextDecoder().decode(new Uint8Array(glb, 20, size)));
  const parts = [new Uint8Array(glb, 28 + size, view.getUint32(20 + size, true))];
  let length = parts[0].length;
  const add = (data, type, more) => {
    const gap = (4 - length % 4) % 4, bytes = new Uint8Array(Float32Array.from(data).buffer);
    parts.push(new Uint8Array(gap), bytes);
    json.bufferViews.push({ buffer: 0, byteOffset: length + gap, byteLength: bytes.length });
    length += gap + bytes.length;
    json.accessors.push({ bufferView: json.bufferViews.length - 1, componentType: 5126, type, count: data.length / { SCALAR: 1, VEC3: 3, VEC4: 4 }[type], ...more });
    return json.accessors.length - 1;
  };
  const input = add(seconds, "SCALAR", { min: [seconds[0]], max: [seconds[seconds.length - 1]] });
  const samplers = tracks.map(([, path, values]) => ({ input, output: add(values, path === "rotation" ? "VEC4" : "VEC3", {}), interpolation: "LINEAR" }));
  const channels = tracks.map(([node, path], sampler) => ({ sampler, target: { node, path } }));
  json.animations = [{ name, samplers, channels }];
  json.buffers[0].byteLength = length;
  const binary = new Uint8Array(length);
  parts.reduce((at, part) => { binary.set(part, at); return at + part.length; }, 0);
  return packGlb(json, binary);
}

// Who plays the frames, as .glb: a character keeps its file, with this clip for its clips; sticks are made.
function glbOf(frames, name, who) {
  const tracks = new Map();
  for (const pose of frames) {
    who.pose(pose);
    for (const [node, path, value] of who.tracks()) {
      const key = `${node} ${path}`;
      if (!tracks.has(key)) tracks.set(key, [node, path, []]);
      tracks.get(key)[2].push(...value.toArray());
    }
  }
  return animatedGlb(who.file(), name, frames.map((_, t) => t / SAVED_FPS), [...tracks.values()]);
}

function download(data, name, kind) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(new Blob([data], { type: kind })), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
