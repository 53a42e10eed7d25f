// Another unit for a whole scene: what fbx_reader.mjs and fbx_writer.mjs share. FBX counts in centimeters, glTF in meters.
import { Vector3 } from "three";

// Multiplies every length of a scene and its clips; no node gets a scale of its own.
export function scaleLengths(scene, animations, factor) {
  const done = new Set();
  scene.traverse((object) => {
    object.position.multiplyScalar(factor);
    for (const inverse of object.skeleton && !done.has(object.skeleton) ? object.skeleton.boneInverses : []) inverse.setPosition(new Vector3().setFromMatrixPosition(inverse).multiplyScalar(factor));
    done.add(object.skeleton);
    if (object.isSkinnedMesh) for (const matrix of [object.bindMatrix, object.bindMatrixInverse]) matrix.setPosition(new Vector3().setFromMatrixPosition(matrix).multiplyScalar(factor));
    if (!object.isMesh || done.has(object.geometry)) return;
    const { attributes, morphAttributes } = object.geometry;
    done.add(object.geometry);
    for (const attribute of [attributes.position, ...(morphAttributes.position ?? [])]) attribute.array.forEach((value, i, all) => (all[i] = value * factor));
  });
  for (const clip of animations)
    for (const track of clip.tracks) if (track.name.endsWith(".position")) track.values.forEach((value, i, all) => (all[i] = value * factor));
}
