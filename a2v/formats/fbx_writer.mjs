// Convert a GLB to binary FBX in centimeters: three.js reads it, @comfyorg/fbx-exporter-three writes it.
// node fbx_writer.mjs in.glb out.fbx FPS, beside a node_modules that holds both packages.
import { readFileSync, writeFileSync } from "node:fs";
import { Matrix4, Quaternion, RepeatWrapping, Scene, Texture, Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { FBXExporter } from "@comfyorg/fbx-exporter-three";
import { glbOf, partsOf } from "./glb_parts.mjs";
import { scaleLengths } from "./fbx_scale.mjs";

const CENTIMETERS = 100;
const APART = 0.03; // centimeters
const SLOTS = { baseColorTexture: "map", normalTexture: "normalMap", emissiveTexture: "emissiveMap" }; // glTF's name: three.js'
globalThis.self ??= globalThis; // GLTFLoader looks for URL there

// The GLB without its pictures, which only a browser could decode; the pictures; and which of them each slot of each material has.
function withoutImages(data) {
  const { json, binary } = partsOf(data);
  const pictures = (json.images ?? []).map((image, number) => {
    const view = json.bufferViews[image.bufferView];
    const start = view.byteOffset ?? 0;
    const name = (image.name ?? "").replaceAll(/[^\w.-]+/g, "_").replace(/\.\w+$/, "") || (number ? `texture_${number}` : "texture");
    return { name, bytes: binary.subarray(start, start + view.byteLength), extension: image.mimeType === "image/png" ? "png" : "jpg" };
  });
  const slots = (json.materials ?? []).map((material) => {
    const own = {};
    for (const holder of [material, material.pbrMetallicRoughness ?? {}])
      for (const name of Object.keys(holder).filter((key) => key.endsWith("Texture"))) {
        if (SLOTS[name]) own[SLOTS[name]] = json.textures[holder[name].index].source;
        delete holder[name];
      }
    return own;
  });
  delete json.images;
  delete json.textures;
  const glb = glbOf(json, binary.subarray(0, json.buffers[0].byteLength));
  return { glb: glb.buffer.slice(glb.byteOffset, glb.byteOffset + glb.length), pictures, slots };
}

// Give each material its pictures, as textures of their names alone.
function nameTextures(gltf, pictures, slots) {
  const textures = pictures.map((picture) => Object.assign(new Texture(), { name: picture.name, wrapS: RepeatWrapping, wrapT: RepeatWrapping, userData: { picture } }));
  gltf.scene.traverse((object) => {
    for (const material of object.isMesh ? [object.material].flat() : [])
      for (const [slot, number] of Object.entries(slots[gltf.parser.associations.get(material)?.materials] ?? {})) material[slot] = textures[number];
  });
}

function inCentimetres(scene, animations) {
  scaleLengths(scene, animations, CENTIMETERS);
  const done = new Set();
  scene.traverse((object) => {
    const uv = object.isMesh && !done.has(object.geometry) ? object.geometry.attributes.uv : null;
    if (uv) for (let i = 0; i < uv.count; i++) uv.setY(i, 1 - uv.getY(i)); // FBX counts from below
    if (object.isMesh) done.add(object.geometry);
    if (object.isSkinnedMesh) object.bind(object.skeleton, new Matrix4());
  });
}

// The topmost bone moves off the line to its only child by less than a millimeter: Blender's importers connect a bone to a parent whose
// tail it stands on, and let no connected bone move, so that hips over a root would stay at one height.
function apart(scene, animations) {
  const bones = [];
  scene.traverse((object) => object.isBone && !object.parent?.isBone && bones.push(object));
  for (const root of bones) {
    const children = root.children.filter((child) => child.isBone);
    if (children.length !== 1) continue;
    const away = children[0].position.toArray().map(Math.abs);
    const shift = new Vector3().setComponent(away.indexOf(Math.min(...away)), APART);
    const key = (name) => animations.map((clip) => clip.tracks.find((track) => track.name === name));
    const turns = key(`${root.name}.quaternion`);
    key(`${root.name}.position`).forEach((track, clip) => moved(track, (t) => shift.clone().applyQuaternion(turn(turns[clip], t, root))));
    key(`${children[0].name}.position`).forEach((track) => moved(track, () => shift.clone().negate()));
    root.position.add(shift.clone().applyQuaternion(root.quaternion));
    children[0].position.sub(shift);
  }
  scene.updateMatrixWorld(true);
  scene.traverse((object) => object.isSkinnedMesh && object.skeleton.calculateInverses());
}

function moved(track, shift) {
  for (let t = 0; t < (track?.times.length ?? 0); t++) new Vector3().fromArray(track.values, 3 * t).add(shift(t)).toArray(track.values, 3 * t);
}

function turn(track, t, bone) {
  return track ? new Quaternion().fromArray(track.values, 4 * Math.min(t, track.times.length - 1)) : bone.quaternion;
}

// Of the two ways to say a rotation in three angles the one nearer to the frame before: no leaps between keys.
function steady(curves) {
  const values = curves.map((curve) => curve.values);
  const near = (angle, last) => angle + 360 * Math.round((last - angle) / 360);
  for (let t = 1; t < values[0].length; t++) {
    const last = values.map((axis) => axis[t - 1]);
    const [x, y, z] = values.map((axis) => axis[t]);
    const ways = [[x, y, z], [x + 180, 180 - y, z + 180]].map((way) => way.map((angle, k) => near(angle, last[k])));
    const far = ways.map((way) => way.reduce((sum, angle, k) => sum + Math.abs(angle - last[k]), 0));
    ways[far[1] < far[0] ? 1 : 0].forEach((angle, k) => (values[k][t] = angle));
  }
}

// A blend shape without the vertices that it leaves where they are.
function sparse(channel) {
  const moved = channel.indices.filter((_, i) => channel.deltas[3 * i] || channel.deltas[3 * i + 1] || channel.deltas[3 * i + 2]);
  const kept = moved.length ? moved : channel.indices.subarray(0, 1);
  const deltas = Float64Array.from({ length: 3 * kept.length }, (_, i) => channel.deltas[3 * kept[Math.floor(i / 3)] + (i % 3)]);
  Object.assign(channel, { indices: Int32Array.from(kept), deltas });
}

const [source, target, fps] = process.argv.slice(2);
const { glb, pictures, slots } = withoutImages(readFileSync(source));
const gltf = await new GLTFLoader().parseAsync(glb, "");
nameTextures(gltf, pictures, slots);
const scene = new Scene();
scene.add(...gltf.scene.children);
inCentimetres(scene, gltf.animations);
scene.updateMatrixWorld(true);
apart(scene, gltf.animations);
const exporter = new FBXExporter().register((plan) => {
  for (const [texture, entry] of plan.textures.textures) {
    const { name, bytes, extension } = texture.userData.picture;
    Object.assign(entry, { imageBytes: bytes, extension, fileName: `${name}.${extension}` });
  }
  for (const stack of plan.animStacks) {
    for (const node of stack.curveNodes) if (node.attrName === "R") steady(node.curves);
    stack.curveNodes = stack.curveNodes.filter((node) => node.fbxProp !== "DeformPercent" || node.curves[0].values.some((value) => value !== 0));
  }
  for (const mesh of plan.meshes) for (const channel of mesh.morph?.channels ?? []) sparse(channel);
  scene.traverse((object) => (object.name = object.userData.name ?? object.name)); // three.js allows no colons in names
});
console.warn = () => {}; // that parseSync leaves pictures to the plug-in above
writeFileSync(target, exporter.parseSync(scene, { axisUp: "Y", axisForward: "-Z", unitScale: 1, fps: Number(fps), animations: gltf.animations, creator: "a2v" }));
