// What @pixiv/three-vrm makes of avatars of both editions of VRM: expressions, and bones that swing when a leg is lifted.
import * as THREE from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { VRMLoaderPlugin, VRMUtils } from "@pixiv/three-vrm";

const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;

async function look(data, given) {
  const loader = new GLTFLoader();
  loader.register((parser) => new VRMLoaderPlugin(parser));
  const { vrm } = (await loader.parseAsync(bytes(data), "")).userData;
  VRMUtils.rotateVRM0(vrm); // avatars of 0.x face -z
  let mesh = null;
  vrm.scene.traverse((item) => { if (item.isSkinnedMesh && !mesh) mesh = item; });
  const settle = (frames) => {
    for (let frame = 0; frame < frames; frame++) vrm.update(1 / 60);
    vrm.scene.updateMatrixWorld(true);
  };
  const places = (chosen) => chosen.map((index) => mesh.localToWorld(mesh.getVertexPosition(index, new THREE.Vector3())).toArray());
  const bones = (name) => Object.fromEntries(mesh.skeleton.bones.filter((bone) => bone.name.startsWith(name)).map((bone) => [bone.name, bone.getWorldPosition(new THREE.Vector3()).toArray()]));
  vrm.scene.updateMatrixWorld(true);
  const told = { meta: vrm.meta, bones: Object.keys(vrm.humanoid.humanBones), names: vrm.expressionManager.expressions.map((item) => item.expressionName), swings: vrm.springBoneManager?.joints.size ?? 0 };
  told.rest = places(given.vertices);
  told.expressions = {};
  for (const name of given.expressions) {
    vrm.expressionManager.resetValues();
    vrm.expressionManager.setValue(name, 1);
    vrm.expressionManager.update();
    told.expressions[name] = places(given.face);
  }
  vrm.expressionManager.resetValues();
  vrm.springBoneManager?.setInitState();
  told.before = bones("skirt_");
  settle(120);
  told.still = bones("skirt_");
  const leg = vrm.humanoid.getNormalizedBoneNode("leftUpperLeg");
  for (let frame = 1; frame <= 60; frame++) { leg.rotation.x = -given.lift * frame / 60; vrm.update(1 / 60); }
  told.moving = bones("skirt_");
  settle(180);
  told.lifted = bones("skirt_");
  const place = (name) => vrm.humanoid.getRawBoneNode(name).getWorldPosition(new THREE.Vector3()).toArray();
  // the head turns from one side to the other within a tenth of a second; places of the hair in the head's axes
  const head = vrm.humanoid.getRawBoneNode("head");
  const onHead = () => Object.fromEntries(Object.entries(bones("hair_")).map(([name, at]) => [name, head.worldToLocal(new THREE.Vector3(...at)).toArray()]));
  told.hair = { still: onHead() };
  const neck = vrm.humanoid.getNormalizedBoneNode("head");
  for (let frame = 1; frame <= 6; frame++) { neck.rotation.y = given.turn * frame / 6; vrm.update(1 / 60); }
  vrm.scene.updateMatrixWorld(true);
  told.hair.moving = onHead();
  for (let frame = 1; frame <= 60; frame++) { neck.rotation.y = given.turn * (60 - frame) / 60; vrm.update(1 / 60); }
  settle(180);
  told.hair.after = onHead();
  told.thigh = [place("leftUpperLeg"), place("leftLowerLeg")];
  return told;
}

window.told = (async () => Promise.all(window.given.files.map((data) => look(data, window.given))))();
