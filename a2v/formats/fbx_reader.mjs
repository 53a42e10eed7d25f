// An FBX of others as a GLB: three.js reads it and writes its bones, skins and meshes again. Pictures are left out; only a browser could decode them.
// node fbx_reader.mjs in.fbx out.glb, beside a node_modules that holds three.
import { readFileSync, writeFileSync } from "node:fs";
import { Texture, TextureLoader } from "three";
import { FBXLoader } from "three/examples/jsm/loaders/FBXLoader.js";
import { mergeVertices } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { GLTFExporter } from "three/examples/jsm/exporters/GLTFExporter.js";
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
TextureLoader.prototype.load = () => new Texture();
console.warn = () => {}; // unknown materials and pictures that are left out

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

const [source, target] = process.argv.slice(2);
const data = readFileSync(source);
const bytes = data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength);
const scene = new FBXLoader().parse(bytes, "");
single(scene);
nameShapes(scene, scene.animations ?? []);
scene.updateMatrixWorld(true);
scaleLengths(scene, scene.animations ?? [], CENTIMETER * (scene.userData.unitScaleFactor ?? 1));
scene.traverse((object) => {
  // three.js allows no colons in names: fbx_writer.mjs gives the bones their own names back
  object.userData = object.userData.originalName ? { name: object.userData.originalName } : {};
  if (!object.isMesh) return;
  object.geometry = mergeVertices(object.geometry); // the loader gives each corner of a triangle a vertex of its own
  const plain = [object.material].flat().map((material) => {
    for (const [name, value] of Object.entries(material)) if (value?.isTexture) material[name] = null;
    return material;
  });
  object.material = Array.isArray(object.material) ? plain : plain[0];
});
const unused = [];
scene.traverse((object) => (object.isLight || object.isCamera) && unused.push(object));
for (const object of unused) object.removeFromParent();
scene.updateMatrixWorld(true);
const made = await new GLTFExporter().parseAsync(scene, { binary: true, onlyVisible: false, animations: scene.animations ?? [] });
writeFileSync(target, Buffer.from(made));
