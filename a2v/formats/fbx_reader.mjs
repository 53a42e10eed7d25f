// Convert an FBX to a GLB: three.js reads it and writes its bones, skins and meshes. Pictures (PNG, JPEG) are copied without decoding them,
// from the file or from the folder that it is in. Prints a JSON list of the pictures that it leaves out.
// node fbx_reader.mjs in.fbx out.glb folder-of-pictures, beside a node_modules that holds three.
import { closeSync, constants, fstatSync, openSync, readFileSync, realpathSync, writeFileSync } from "node:fs";
import { basename, join, resolve, sep } from "node:path";
import { Texture, TextureLoader } from "three";
import { FBXLoader } from "three/examples/jsm/loaders/FBXLoader.js";
import { mergeVertices } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { GLTFExporter } from "three/examples/jsm/exporters/GLTFExporter.js";
import { glbOf, partsOf } from "./glb_parts.mjs";
import { scaleLengths } from "./fbx_scale.mjs";

const CENTIMETER = 0.01;
globalThis.self ??= globalThis; // the loader and the exporter look for browser interfaces there
globalThis.window ??= globalThis;
globalThis.FileReader ??= class {
  readAsArrayBuffer(blob) {
    blob.arrayBuffer().then((bytes) => {
      this.result = bytes;
      this.onloadend();
    });
  }
};
const SLOTS = { map: "baseColorTexture", normalMap: "normalTexture", emissiveMap: "emissiveTexture" }; // three.js' name: glTF's
const MAX_PICTURE = 64 << 20; // bytes
const embedded = new Map();
globalThis.URL.createObjectURL = (blob) => {
  embedded.set(`blob:${embedded.size}`, blob);
  return `blob:${embedded.size - 1}`;
};
TextureLoader.prototype.load = (source) => Object.assign(new Texture(), { userData: { source } });
console.warn = () => {}; // materials that three.js does not know

// The loader makes a bone anew for each mesh that it moves, one the child of the other. Here each is one bone again.
function single(scene) {
  const bones = [];
  const outermost = new Map();
  scene.traverse((object) => object.isBone && bones.push(object));
  for (const bone of bones) outermost.set(bone, bone.parent?.isBone && bone.parent.ID === bone.ID ? outermost.get(bone.parent) : bone);
  scene.traverse((object) => object.isSkinnedMesh && (object.skeleton.bones = object.skeleton.bones.map((bone) => outermost.get(bone))));
  for (const bone of bones) if (outermost.get(bone) !== bone) bone.removeFromParent();
}

// The loader numbers the blend shapes that a clip moves; the exporter wants their names.
function nameShapes(scene, animations) {
  for (const clip of animations)
    for (const track of clip.tracks) {
      const [, node, number] = track.name.match(/^(.*)\.morphTargetInfluences\[(\d+)\]$/) ?? [];
      const found = number && Object.entries(scene.getObjectByName(node)?.morphTargetDictionary ?? {}).find(([, index]) => index === Number(number));
      if (found) track.name = `${node}.morphTargetInfluences[${found[0]}]`;
    }
}

// The bytes of a regular file inside a folder, up to MAX_PICTURE; null for links that lead out of it, pipes, devices and what is not there.
function bytesInside(folder, path) {
  let handle;
  try {
    const real = realpathSync(path);
    if (!real.startsWith(realpathSync(folder) + sep)) return null;
    handle = openSync(real, constants.O_RDONLY | (constants.O_NONBLOCK ?? 0) | (constants.O_NOFOLLOW ?? 0));
    const facts = fstatSync(handle);
    return facts.isFile() && facts.size <= MAX_PICTURE ? readFileSync(handle) : null;
  } catch {
    return null;
  } finally {
    if (handle !== undefined) closeSync(handle);
  }
}

// The bytes of a picture: embedded, or a file in the folder of the FBX. Null if it is neither PNG nor JPEG.
async function pictureOf(name, folder) {
  let bytes = null;
  if (embedded.has(name)) bytes = Buffer.from(await embedded.get(name).arrayBuffer());
  else if (name.startsWith("data:")) bytes = Buffer.from(name.slice(name.indexOf(",") + 1), "base64");
  else {
    const relative = name.replaceAll("\\", "/");
    const inside = [relative, basename(relative)].map((path) => resolve(join(folder, path))).filter((path) => path.startsWith(resolve(folder) + sep));
    for (const path of inside) bytes ??= bytesInside(folder, path);
  }
  if (!bytes || bytes.length > MAX_PICTURE) return null;
  if (bytes.subarray(0, 4).equals(Buffer.from([0x89, 0x50, 0x4e, 0x47]))) return { bytes, mimeType: "image/png" };
  return bytes.subarray(0, 3).equals(Buffer.from([0xff, 0xd8, 0xff])) ? { bytes, mimeType: "image/jpeg" } : null;
}

// Take the textures off a material, for only a browser could decode them, and note which picture each slot has.
function withoutTextures(material, sources) {
  const slots = {};
  for (const [slot, value] of Object.entries(material)) {
    if (!value?.isTexture) continue;
    const source = value.userData.source;
    if (SLOTS[slot] && source) {
      if (!sources.some((one) => one.source === source)) sources.push({ source, name: value.name || basename(source) });
      slots[SLOTS[slot]] = sources.findIndex((one) => one.source === source);
    }
    material[slot] = null;
  }
  if (!material.userData.pictures) material.userData = { pictures: slots };
  return material;
}

// Put the pictures into the GLB that the exporter has written.
function withPictures(glb, pictures) {
  const { json, binary } = partsOf(glb);
  const chunks = [binary.subarray(0, json.buffers[0].byteLength)];
  let size = chunks[0].length;
  const add = (bytes) => {
    const gap = (4 - (size % 4)) % 4;
    chunks.push(Buffer.alloc(gap), bytes);
    json.bufferViews.push({ buffer: 0, byteOffset: size + gap, byteLength: bytes.length });
    size += gap + bytes.length;
    return json.bufferViews.length - 1;
  };
  const texture = pictures.map((picture) => {
    if (!picture) return null;
    json.images = [...(json.images ?? []), { name: picture.name, mimeType: picture.mimeType, bufferView: add(picture.bytes) }];
    json.textures = [...(json.textures ?? []), { source: json.images.length - 1 }];
    return json.textures.length - 1;
  });
  for (const material of json.materials ?? []) {
    const slots = material.extras?.pictures ?? {};
    delete material.extras;
    for (const [slot, number] of Object.entries(slots)) {
      if (texture[number] === null) continue;
      const holder = slot === "baseColorTexture" ? (material.pbrMetallicRoughness ??= {}) : material;
      holder[slot] = { index: texture[number] };
    }
  }
  json.buffers[0].byteLength = size;
  return glbOf(json, Buffer.concat(chunks));
}

const [source, target, folder] = process.argv.slice(2);
const data = readFileSync(source);
const bytes = data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength);
const scene = new FBXLoader().parse(bytes, "");
single(scene);
nameShapes(scene, scene.animations ?? []);
scene.updateMatrixWorld(true);
scaleLengths(scene, scene.animations ?? [], CENTIMETER * (scene.userData.unitScaleFactor ?? 1));
const sources = [];
scene.traverse((object) => {
  // three.js allows no colons in names: fbx_writer.mjs gives the bones their own names back
  object.userData = object.userData.originalName ? { name: object.userData.originalName } : {};
  if (!object.isMesh) return;
  object.geometry = mergeVertices(object.geometry); // the loader gives each corner of a triangle a vertex of its own
  for (const uv of [object.geometry.attributes.uv, object.geometry.attributes.uv1])
    for (let i = 0; i < (uv?.count ?? 0); i++) uv.setY(i, 1 - uv.getY(i)); // FBX counts from below
  const plain = [object.material].flat().map((material) => withoutTextures(material, sources));
  object.material = Array.isArray(object.material) ? plain : plain[0];
});
const unused = [];
scene.traverse((object) => (object.isLight || object.isCamera) && unused.push(object));
for (const object of unused) object.removeFromParent();
scene.updateMatrixWorld(true);
const made = await new GLTFExporter().parseAsync(scene, { binary: true, onlyVisible: false, animations: scene.animations ?? [] });
const pictures = await Promise.all(sources.map(async ({ source: from, name }) => ({ name, ...(await pictureOf(from, resolve(folder))) })));
writeFileSync(target, withPictures(Buffer.from(made), pictures.map((picture) => (picture.bytes ? picture : null))));
console.log(JSON.stringify(pictures.filter((picture) => !picture.bytes).map((picture) => picture.name)));
