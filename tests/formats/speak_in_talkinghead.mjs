// What npm's @met4citizen/talkinghead does with an avatar, in a browser: bundled by esbuild, the file as base64 in `window.given`.
// Time is stepped by hand, so that nothing depends on the machine's speed; the sound is silence.
import * as THREE from "three";
import { TalkingHead } from "@met4citizen/talkinghead";
import { LipsyncEn } from "@met4citizen/talkinghead/modules/lipsync-en.mjs";

const STEP = 20; // milliseconds
const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

// A vertex with its shapes, before the skin: the body moves too.
function shaped(mesh, index) {
  const { position } = mesh.geometry.morphAttributes;
  const place = new THREE.Vector3().fromBufferAttribute(mesh.geometry.attributes.position, index);
  mesh.morphTargetInfluences.forEach((strength, shape) => {
    if (Object.keys(mesh.morphTargetDictionary)[shape].startsWith("viseme_")) place.addScaledVector(new THREE.Vector3().fromBufferAttribute(position[shape], index), strength);
  });
  return place.toArray();
}

// Strengths of every shape that ever moves, and vertices, while the avatar says `speech`.
async function said(head, speech) {
  const silence = new AudioBuffer({ numberOfChannels: 1, length: Math.ceil(22.05 * speech.ms), sampleRate: 22050 });
  const spoken = () => head.animQueue.filter((item) => item.template.name === "viseme");
  const clock = head.animClock;
  head.speakAudio({ ...speech.audio, audio: silence }, { lipsyncLang: "en" });
  for (let waited = 0; !spoken().length && waited < 500; waited++) await new Promise((done) => setTimeout(done, 10));
  const asked = spoken().map((item) => ({ name: Object.keys(item.vs)[0], times: item.ts.map((t) => t - clock), strengths: Object.values(item.vs)[0] }));
  const tracks = {};
  const frames = [];
  for (let t = STEP; t <= speech.ms; t += STEP) {
    head.animate(STEP);
    for (const mesh of head.morphs)
      for (const [name, index] of Object.entries(mesh.morphTargetDictionary))
        if (name.startsWith("viseme_")) (tracks[name] ??= [])[t / STEP - 1] = mesh.morphTargetInfluences[index];
    if (speech.looks?.includes(t)) frames.push(window.given.chosen.map((index) => shaped(head.morphs.find((mesh) => mesh.name.endsWith(window.given.mesh)), index)));
  }
  head.stopSpeaking();
  return { asked, tracks, frames, sound: head.audioCtx.state };
}

async function look() {
  const url = URL.createObjectURL(new Blob([bytes(window.given.glb)]));
  const scene = new THREE.Scene();
  const node = document.createElement("div");
  const options = { avatarOnly: true, avatarOnlyScene: scene, avatarOnlyCamera: new THREE.PerspectiveCamera(), lipsyncModules: [], avatarMood: "neutral", modelFPS: 50 };
  const head = new TalkingHead(node, options);
  head.lipsync.en = new LipsyncEn();
  await head.showAvatar({ url, body: "F", lipsyncLang: "en" });
  const told = { height: head.avatarHeight, meshes: [], armature: head.armature.name, bones: [], lengths: {} };
  head.armature.traverse((item) => item.isBone && told.bones.push(item.name));
  head.morphs.forEach((mesh) => told.meshes.push({ name: mesh.name, shapes: Object.keys(mesh.morphTargetDictionary), count: mesh.geometry.attributes.position.count }));
  told.words = head.lipsyncWordsToVisemes("hello", "en").visemes;
  for (let t = 0; t < 4000; t += STEP) head.animate(STEP); // into its first pose
  head.armature.updateMatrixWorld(true);
  const place = (name) => head.armature.getObjectByName(name).getWorldPosition(new THREE.Vector3()).toArray();
  told.stands = Object.fromEntries(window.given.places.map((name) => [name, place(name)]));
  told.speeches = [];
  for (const speech of window.given.speeches) {
    for (let t = 0; t < 1500; t += STEP) head.animate(STEP);
    told.speeches.push(await said(head, speech));
  }
  return told;
}

window.told = look();
