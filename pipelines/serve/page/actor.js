// One person on the stage: the bones of a character, and the acts that they follow, each beginning where the last one is. Needs three.js as `THREE`.
import { Skin } from "./skin.js";

const BLEND = 0.35;  // seconds from one motion to the next
const FOLLOW = 18;  // share per second of the way to the newest pose of the live camera
const UP = { x: 0, y: 1, z: 0 };

/** Where the numbers of a clip lead: bones' quaternions, the first bone's place, and the face. */
function sampled(clip, time, out) {
  const moment = Math.min(Math.max(time, 0) * clip.fps, clip.frames - 1), first = Math.floor(moment), next = Math.min(first + 1, clip.frames - 1), part = moment - first;
  const width = out.quats.length, { bones, place } = clip;
  for (let at = 0; at < width; at += 4) {
    const a = first * width + at, b = next * width + at;
    const sign = bones[a] * bones[b] + bones[a + 1] * bones[b + 1] + bones[a + 2] * bones[b + 2] + bones[a + 3] * bones[b + 3] < 0 ? -part : part;
    let length = 0;
    for (let axis = 0; axis < 4; axis++) { const value = bones[a + axis] * (1 - part) + bones[b + axis] * sign; out.quats[at + axis] = value; length += value * value; }
    length = Math.sqrt(length) || 1;
    for (let axis = 0; axis < 4; axis++) out.quats[at + axis] /= length;
  }
  for (let axis = 0; axis < 3; axis++) out.place[axis] = place[3 * first + axis] * (1 - part) + place[3 * next + axis] * part;
  out.face = {};
  for (const [name, row] of Object.entries(clip.face || {})) out.face[name] = row[first] * (1 - part) + row[next] * part;
}

/** A motion as the server sends it, with numbers that can be sampled. */
export function unpacked(told) {
  const text = atob(told.bones), bytes = new Uint8Array(text.length);
  for (let at = 0; at < bytes.length; at++) bytes[at] = text.charCodeAt(at);
  const whole = new Int16Array(bytes.buffer), bones = new Float32Array(whole.length);
  for (let at = 0; at < bones.length; at++) bones[at] = whole[at] / 32767;
  return { fps: told.fps, frames: told.frames, bones, place: Float32Array.from(told.place), face: told.face };
}

export class Actor {
  /** The person of a file; the cycle in it is how the person waits. */
  constructor(gltf) {
    this.model = gltf.scene;
    this.bones = [];
    for (const [object, from] of gltf.parser.associations) if (object.isBone && from.nodes !== undefined) this.bones[from.nodes] = object;
    this.meshes = [];
    this.model.traverse(node => {
      if (!node.isMesh) return;
      node.castShadow = node.receiveShadow = true;
      node.frustumCulled = false;
      if (node.morphTargetDictionary) this.meshes.push(node);
    });
    this.pose = { quats: new Float32Array(4 * this.bones.length), place: [0, 0.9, 0], face: {} };
    this.other = { quats: new Float32Array(4 * this.bones.length), place: [0, 0, 0], face: {} };
    this.waiting = cycleOf(gltf, this.model, this.bones);
    this.skull = this.bones.find(bone => bone && /head$/i.test(bone.name)) || null;
    this.acts = [];
    this.skins = [];
    this.live = null;
    this.start = [0, 0];
  }

  /** Bend the skin in this script instead of in a shader. */
  bendHere() {
    this.model.traverse(node => { if (node.isSkinnedMesh) this.skins.push(new Skin(node)); });
    this.model.add(...this.skins.flatMap(skin => [skin.mesh, skin.shadow]));
  }

  /** Bring what is drawn to the bones and the face. */
  bend() { for (const skin of this.skins) skin.bend(); }

  static async of(data) {
    return new Actor(await new Promise((done, fail) => new THREE.GLTFLoader().parse(data, "", done, fail)));
  }

  /** Do a clip again and again, from where the person stands, or from another person's place and heading. */
  act(clip, cycle = false, from = this, aside = [0, 0]) {
    const act = { clip, cycle, time: 0, x: aside[0], z: aside[1], heading: 0, since: this.acts.length ? 0 : BLEND, first: clip.bones.slice(0, 4), from: [clip.place[0], clip.place[2]] };
    if (from.acts.length) {
      act.x += from.pose.place[0];
      act.z += from.pose.place[2];
      act.heading = from.heading + from.turned(from.acts.at(-1));
    }
    this.start = [act.x, act.z];
    this.acts = [...this.acts.slice(-1), act];
    this.live = null;
  }

  /** Go over to the whole of a clip whose beginning is played. */
  lengthen(short, whole) { for (const act of this.acts) if (act.clip === short) act.whole = whole; }

  get acting() { return this.acts.length ? this.acts.at(-1).clip : null; }

  /** Where the newest act began to face, radians. */
  get heading() { return this.acts.length ? this.acts.at(-1).heading : 0; }

  /** How far an act has turned the person since its beginning, radians. */
  turned(act) {
    const { clip } = act, frame = Math.min(Math.floor(act.time * clip.fps), clip.frames - 1), stride = this.pose.quats.length;
    const now = new THREE.Quaternion().fromArray(clip.bones, frame * stride), then = new THREE.Quaternion().fromArray(act.first).invert();
    now.multiply(then);
    return 2 * Math.atan2(now.y, now.w);
  }

  /** The pose of an act in the world. */
  posed(act, out) {
    sampled(act.clip, act.time, out);
    const c = Math.cos(act.heading), s = Math.sin(act.heading), x = out.place[0] - act.from[0], z = out.place[2] - act.from[1];
    out.place[0] = act.x + c * x + s * z;
    out.place[2] = act.z - s * x + c * z;
    const turn = new THREE.Quaternion().setFromAxisAngle(UP, act.heading), root = new THREE.Quaternion().fromArray(out.quats);
    turn.multiply(root).toArray(out.quats);
  }

  step(passed) {
    if (!this.acts.length) return;
    const { pose, other } = this;
    for (const act of this.acts) { act.time += passed; act.since += passed; }
    let now = this.acts.at(-1);
    if (now.whole && now.since >= BLEND) {
      const clip = now.whole;
      this.acts = [now, { ...now, clip, whole: null, since: 0, first: clip.bones.slice(0, 4), from: [clip.place[0], clip.place[2]] }];
      now = this.acts[1];
    }
    const length = (now.clip.frames - 1) / now.clip.fps;
    if (now.time >= length) {
      if (now.clip.short) now.time = length;  // the whole is on its way
      else if (now.cycle) now.time %= Math.max(length, 1e-3);
      else { this.posed({ ...now, time: length }, pose); now.time = length; this.act(now.clip); now = this.acts.at(-1); }
    }
    this.posed(now, pose);
    const share = Math.min(1, now.since / BLEND), before = this.acts.length > 1 ? this.acts[0] : null;
    if (before && share < 1) {
      const end = (before.clip.frames - 1) / before.clip.fps;
      before.time = before.cycle ? before.time % Math.max(end, 1e-3) : Math.min(before.time, end);
      this.posed(before, other);
      const soft = share * share * (3 - 2 * share);
      for (let at = 0; at < pose.quats.length; at += 4) THREE.Quaternion.slerpFlat(pose.quats, at, other.quats, at, pose.quats, at, soft);
      for (let axis = 0; axis < 3; axis++) pose.place[axis] = other.place[axis] * (1 - soft) + pose.place[axis] * soft;
    } else if (before) this.acts = [now];
  }

  shift(x, z) {
    for (const act of this.acts) { act.x += x; act.z += z; }
    this.pose.place[0] += x;
    this.pose.place[2] += z;
    this.start = [this.start[0] + x, this.start[1] + z];
  }

  /** The newest pose of the live camera. */
  drive(told) {
    if (told.bones.length === this.pose.quats.length && told.bones.every(Number.isFinite)) this.live = told;
  }

  follow(passed) {
    const share = 1 - Math.exp(-FOLLOW * passed), { quats, place } = this.pose;
    for (let at = 0; at < quats.length; at += 4) THREE.Quaternion.slerpFlat(quats, at, quats, at, this.live.bones, at, share);
    for (let axis = 0; axis < 3; axis++) place[axis] += (this.live.place[axis] - place[axis]) * share;
  }

  /** Go on by `passed` seconds, and bring the bones and the face into the pose. */
  move(passed, running) {
    if (this.live) this.follow(passed);
    else if (running) this.step(passed);
    const { quats, place, face } = this.pose;
    this.bones.forEach((bone, index) => bone.quaternion.fromArray(quats, 4 * index));
    this.bones[0].position.fromArray(place);
    this.model.updateMatrixWorld(true);
    for (const mesh of this.meshes) for (const [name, index] of Object.entries(mesh.morphTargetDictionary)) mesh.morphTargetInfluences[index] = face[name] || 0;
  }
}

/** The first animation of a file, as a clip that can be sampled. */
function cycleOf(gltf, model, bones) {
  const [animation] = gltf.animations, fps = 30, frames = Math.max(2, Math.round((animation ? animation.duration : 0) * fps) + 1);
  const clip = { fps, frames, bones: new Float32Array(4 * bones.length * frames), place: new Float32Array(3 * frames), face: {} };
  const mixer = new THREE.AnimationMixer(model), meshes = [];
  model.traverse(node => { if (node.isMesh && node.morphTargetDictionary) meshes.push(node); });
  if (animation) mixer.clipAction(animation).play();
  for (let frame = 0; frame < frames; frame++) {
    mixer.setTime(Math.min(frame / fps, (animation ? animation.duration : 0) - 1e-4));
    bones.forEach((bone, index) => bone.quaternion.toArray(clip.bones, 4 * (frame * bones.length + index)));
    bones[0].position.toArray(clip.place, 3 * frame);
    for (const mesh of meshes) for (const [name, index] of Object.entries(mesh.morphTargetDictionary)) {
      const value = mesh.morphTargetInfluences[index];
      if (value) (clip.face[name] ||= new Array(frames).fill(0))[frame] = value;
    }
  }
  mixer.stopAllAction();
  return clip;
}
