// What @pixiv/three-vrm makes of a .vrm and a .vrma, in a browser: bundled by esbuild, the files beside it as base64 in `window.given`.
import * as THREE from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { VRMLoaderPlugin } from "@pixiv/three-vrm";
import { createVRMAnimationClip, VRMAnimationLoaderPlugin } from "@pixiv/three-vrm-animation";

const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;

async function look() {
  const loader = new GLTFLoader();
  loader.register((parser) => new VRMLoaderPlugin(parser));
  loader.register((parser) => new VRMAnimationLoaderPlugin(parser));
  const vrm = (await loader.parseAsync(bytes(window.given.vrm), "")).userData.vrm;
  const animation = (await loader.parseAsync(bytes(window.given.vrma), "")).userData.vrmAnimations[0];
  const clip = createVRMAnimationClip(animation, vrm);
  const mixer = new THREE.AnimationMixer(vrm.scene);
  mixer.clipAction(clip).play();
  let mesh = null;
  vrm.scene.traverse((item) => { if (item.isSkinnedMesh) mesh = item; });
  const shown = (time) => {
    mixer.setTime(time);
    vrm.update(0);
    vrm.scene.updateMatrixWorld(true);
    mesh.skeleton.update();
    return window.given.vertices.map((index) => mesh.localToWorld(mesh.getVertexPosition(index, new THREE.Vector3())).toArray());
  };
  const smiling = (name) => {
    vrm.expressionManager.resetValues();
    vrm.expressionManager.setValue(name, 1);
    vrm.expressionManager.update();
    return window.given.face.map((index) => mesh.localToWorld(mesh.getVertexPosition(index, new THREE.Vector3())).toArray());
  };
  const still = () => { mixer.stopAllAction(); vrm.humanoid.resetNormalizedPose(); vrm.update(0); vrm.scene.updateMatrixWorld(true); mesh.skeleton.update(); };
  const told = {
    meta: vrm.meta,
    bones: Object.keys(vrm.humanoid.humanBones),
    lookAt: vrm.lookAt !== undefined && vrm.lookAt !== null,
    firstPerson: vrm.firstPerson !== undefined && vrm.firstPerson !== null,
    duration: clip.duration,
    frames: window.given.times.map(shown),
    lids: window.given.times.map((time) => { mixer.setTime(time); return vrm.expressionManager.getValue("blinkLeft"); }),
  };
  still();
  told.expressions = Object.fromEntries(window.given.expressions.map((name) => [name, smiling(name)]));
  return told;
}

window.told = look();
