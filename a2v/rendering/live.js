// Poses of the character from the page around this one. Needs three.js as `THREE`.
"use strict";
function makeLive(gltf) {
  const bones = [];
  for (const [object, from] of gltf.parser.associations) if (object.isBone && from.nodes !== undefined) bones[from.nodes] = object;
  const FOLLOW = 18;  // share per second of the way to the newest pose
  const goal = new THREE.Quaternion(), place = new THREE.Vector3();
  let pose = null;
  window.addEventListener("message", event => {
    const told = event.data;
    if (window.parent === window || event.source !== window.parent || !told || told.a2v !== "live") return;
    pose = told.bones && told.bones.length === 4 * bones.length && told.bones.every(Number.isFinite) ? told : null;
    document.body.dataset.poses = Number(document.body.dataset.poses || 0) + 1;
  });
  return {
    // move the bones towards the newest pose; false if there is none
    show(passed) {
      if (!pose) return false;
      const share = 1 - Math.exp(-FOLLOW * passed);
      bones.forEach((bone, index) => bone.quaternion.slerp(goal.fromArray(pose.bones, 4 * index), share));
      bones[0].position.lerp(place.fromArray(pose.place), share);
      bones[0].updateMatrixWorld(true);
      return true;
    },
  };
}
