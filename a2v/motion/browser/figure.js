// Who plays: sticks between a skeleton's joints, or a character on bones of its own. Needs three.js as `THREE`.
"use strict";

// Joints at a moment between frames: cubic curves through the root and the bones' directions, bones as long as they are.
function poseAt(joints, parents, moment) {
  const row = 3 * parents.length, last = joints.length / row - 1, t = Math.min(Math.floor(moment), Math.max(last - 1, 0)), s = moment - t;
  const frames = [t - 1, t, t + 1, t + 2].map(frame => row * Math.min(Math.max(frame, 0), last));
  const weights = [-s + 2 * s * s - s ** 3, 2 - 5 * s * s + 3 * s ** 3, s + 4 * s * s - 3 * s ** 3, -s * s + s ** 3].map(weight => weight / 2);
  const pose = new Float32Array(row);
  parents.forEach((parent, joint) => {
    const bone = [0, 0, 0];
    let length = 0;
    frames.forEach((frame, k) => {
      const now = [0, 1, 2].map(axis => joints[frame + 3 * joint + axis] - (parent < 0 ? 0 : joints[frame + 3 * parent + axis]));
      now.forEach((value, axis) => { bone[axis] += weights[k] * value; });
      if (k === 1) length = Math.hypot(...now);
    });
    const scale = parent < 0 ? 1 : length / Math.max(Math.hypot(...bone), 1e-9);
    bone.forEach((value, axis) => { pose[3 * joint + axis] = scale * value + (parent < 0 ? 0 : pose[3 * parent + axis]); });
  });
  return pose;
}

// A figure has `pose(joints)`, `where` (the middle of the body) and `begin(clip)`, which gets the clip that will be played.
function makeSticks(scene, { parents, colors }) {
  const corners = [[0, 0, 0], [1, 0.2, 0], [0, 0.2, 1], [-1, 0.2, 0], [0, 0.2, -1], [0, 1, 0]];
  const faces = [1, 2, 3, 4].flatMap(k => [[0, k, k % 4 + 1], [5, k % 4 + 1, k]]);
  const shape = new THREE.BufferGeometry();
  shape.setAttribute("position", new THREE.Float32BufferAttribute(faces.flat().flatMap(corner => corners[corner]), 3));
  shape.computeVertexNormals();
  const up = new THREE.Vector3(0, 1, 0), where = new THREE.Vector3(), along = new THREE.Vector3();
  const sticks = parents.flatMap((parent, joint) => {
    if (parent < 0) return [];
    const mesh = new THREE.Mesh(shape, new THREE.MeshStandardMaterial({ color: colors[joint], roughness: 0.8 }));
    mesh.castShadow = true;
    mesh.frustumCulled = false;
    scene.add(mesh);
    return [{ parent, joint, mesh }];
  });
  // the sticks as a .glb: a node each, on the ground as they are posed now
  const file = () => {
    const own = shape.getAttribute("position"), normals = shape.getAttribute("normal"), data = new Float32Array([...own.array, ...normals.array]);
    const kinds = [...new Set(sticks.map(stick => colors[stick.joint]))];
    const json = {
      asset: { version: "2.0", generator: "a2v" }, scene: 0, scenes: [{ nodes: sticks.map((_, index) => index) }],
      buffers: [{ byteLength: data.byteLength }],
      bufferViews: [{ buffer: 0, byteOffset: 0, byteLength: data.byteLength / 2 }, { buffer: 0, byteOffset: data.byteLength / 2, byteLength: data.byteLength / 2 }],
      accessors: [0, 1].map(bufferView => ({ bufferView, componentType: 5126, type: "VEC3", count: own.count, ...(bufferView ? {} : { min: [-1, 0, -1], max: [1, 1, 1] }) })),
      materials: kinds.map(kind => ({ pbrMetallicRoughness: { baseColorFactor: [...new THREE.Color(kind).toArray(), 1], metallicFactor: 0, roughnessFactor: 0.8 } })),
      meshes: kinds.map((_, material) => ({ primitives: [{ attributes: { POSITION: 0, NORMAL: 1 }, material }] })),
      nodes: sticks.map(({ joint, mesh }) => ({ mesh: kinds.indexOf(colors[joint]), scale: mesh.scale.toArray() })),
    };
    return packGlb(json, new Uint8Array(data.buffer)).buffer;
  };
  return {
    where,
    file,
    tracks: () => sticks.flatMap(({ mesh }, index) => [[index, "translation", mesh.position], [index, "rotation", mesh.quaternion]]),
    begin() {},
    pose(joints) {
      for (const { parent, joint, mesh } of sticks) {
        mesh.position.fromArray(joints, 3 * parent);
        along.fromArray(joints, 3 * joint).sub(mesh.position);
        const length = Math.max(along.length(), 1e-6), thick = Math.min(Math.max(0.12 * length, 0.006), 0.03);
        mesh.scale.set(thick, length, thick);
        mesh.quaternion.setFromUnitVectors(up, along.divideScalar(length));
      }
      where.fromArray(joints);
    },
  };
}

// Limbs take the motion's directions, pelvis and chest turn with hips, back and shoulders; feet are not held to the ground beyond that.
// `bones`: node of each canonical joint; `source`: joint of each; `neutral`: how the skeleton stands, degrees.
async function makeCharacter(scene, glb, { bones, source, neutral }) {
  const kept = glb.slice(0);
  const gltf = await new Promise((done, failed) => new THREE.GLTFLoader().parse(glb, "", done, failed));
  gltf.scene.traverse(node => {
    if (node.isMesh) { node.castShadow = node.receiveShadow = true; node.frustumCulled = false; }
  });
  gltf.scene.updateMatrixWorld(true);
  const node = {}, rest = {};
  for (const [name, index] of Object.entries(bones)) {
    node[name] = await gltf.parser.getDependency("node", index);
    rest[name] = { at: node[name].getWorldPosition(new THREE.Vector3()), turn: node[name].getWorldQuaternion(new THREE.Quaternion()) };
  }
  scene.add(gltf.scene);
  const spine = Object.keys(bones).filter(name => name.startsWith("spine")).sort((a, b) => a.slice(5) - b.slice(5));
  const everyBone = [];
  gltf.scene.traverse(item => everyBone.push(item));
  const nameOf = new Map(Object.entries(node).map(([name, item]) => [item, name]));

  const minus = (a, b) => a.clone().sub(b);
  const between = (places, joint) => places(`left_${joint}`).clone().add(places(`right_${joint}`)).multiplyScalar(0.5);
  const across = (places, joint) => minus(places(`left_${joint}`), places(`right_${joint}`));
  const atRest = name => rest[name].at;
  const swing = (from, to) => new THREE.Quaternion().setFromUnitVectors(from.clone().normalize(), to.clone().normalize());
  const frame = (first, second) => {  // its x along the first, the second in the plane of x and y
    const x = first.clone().normalize(), z = x.clone().cross(second).normalize(), y = z.clone().cross(x);
    return new THREE.Quaternion().setFromRotationMatrix(new THREE.Matrix4().makeBasis(x, y, z));
  };
  const turned = (now, before) => now.multiply(before.invert());
  const leaning = degrees => new THREE.Vector3(0, Math.cos(degrees * Math.PI / 180), Math.sin(degrees * Math.PI / 180));
  const legs = places => ["left", "right"].reduce((sum, side) => sum + places(`${side}_hip`).distanceTo(places(`${side}_knee`))
    + places(`${side}_knee`).distanceTo(places(`${side}_ankle`)), 0);

  const restBack = neutral.lean === undefined ? minus(between(atRest, "shoulder"), between(atRest, "hip")) : leaning(neutral.lean);
  const restNeck = neutral.neck === undefined && rest.head && rest.neck ? minus(rest.head.at, rest.neck.at) : leaning(neutral.neck || 0);
  const footAtRest = side => {
    const toes = node[`${side}_ankle`].children.filter(item => item.isBone), foot = new THREE.Vector3();
    for (const toe of toes) foot.add(toe.getWorldPosition(new THREE.Vector3()).divideScalar(toes.length));  // their middle is the ball of the foot
    foot.sub(atRest(`${side}_ankle`));
    if (neutral.dip !== undefined) foot.y = Math.hypot(foot.x, foot.z) * Math.tan(neutral.dip * Math.PI / 180);
    return foot;
  };
  const restFoot = { left: footAtRest("left"), right: footAtRest("right") };

  // turns of the bones from their rest, in the world
  function orient(places) {
    const turn = {}, back = minus(between(places, "shoulder"), between(places, "hip"));
    turn.pelvis = turned(frame(across(places, "hip"), back), frame(across(atRest, "hip"), restBack));
    const chest = turned(frame(back, across(places, "shoulder")), frame(restBack, across(atRest, "shoulder")));
    spine.forEach((name, k) => { turn[name] = turn.pelvis.clone().slerp(chest, (k + 1) / spine.length); });
    const follow = (name, above, to, from) => {
      turn[name] = swing(from.clone().applyQuaternion(above), to).multiply(above);
      return turn[name];
    };
    if (source.head !== undefined && source.neck !== undefined && node.head && node.neck) {
      const whole = swing(restNeck, minus(places("head"), places("neck")).applyQuaternion(chest.clone().invert()));
      turn.neck = chest.clone().multiply(new THREE.Quaternion().slerp(whole, 0.5));
      turn.head = chest.clone().multiply(whole);
    }
    for (const side of ["left", "right"]) {
      for (const [first, second, third, above] of [["hip", "knee", "ankle", turn.pelvis], ["shoulder", "elbow", "wrist", chest]]) {
        const [a, b, c] = [first, second, third].map(joint => `${side}_${joint}`);
        const upper = follow(a, above, minus(places(b), places(a)), minus(atRest(b), atRest(a)));
        follow(b, upper, minus(places(c), places(b)), minus(atRest(c), atRest(b)));
      }
      const [ankle, foot] = [`${side}_ankle`, `${side}_foot`];
      if (source[foot] !== undefined && node[foot]) follow(ankle, turn[`${side}_knee`], minus(places(foot), places(ankle)), restFoot[side]);
    }
    return turn;
  }

  // knees as straight as the character's where the person straightens them: skeletons' joints lie elsewhere (a2v.animation.posture)
  const bendOf = (places, side) => minus(places(`${side}_knee`), places(`${side}_hip`)).angleTo(minus(places(`${side}_ankle`), places(`${side}_knee`)));
  const placesOf = joints => name => new THREE.Vector3().fromArray(joints, 3 * source[name]);
  function straightened(joints, excess) {
    const soft = 0.05, given = placesOf(joints), moved = {};
    for (const side of excess > 0 ? ["left", "right"] : []) {
      const [hip, knee, ankle] = ["hip", "knee", "ankle"].map(joint => given(`${side}_${joint}`)), bend = bendOf(given, side);
      const axis = minus(knee, hip).cross(minus(ankle, knee)).normalize(), less = bend - soft * Math.log1p(Math.exp((bend - excess) / soft));
      const shift = minus(minus(ankle, knee).applyAxisAngle(axis, -less).add(knee), ankle);
      for (const joint of ["ankle", "foot"]) moved[`${side}_${joint}`] = shift;
    }
    return name => moved[name] ? given(name).add(moved[name]) : given(name);
  }

  const where = new THREE.Vector3(), worlds = new Map();
  let floor = 0, excess = 0;
  function pose(joints) {
    const places = straightened(joints, excess);
    const turn = orient(places), scale = legs(atRest) / Math.max(legs(places), 1e-6);
    for (const item of everyBone) {
      const above = worlds.get(item.parent) || new THREE.Quaternion(), own = turn[nameOf.get(item)];
      if (own) item.quaternion.copy(above.clone().invert().multiply(own).multiply(rest[nameOf.get(item)].turn));
      worlds.set(item, above.clone().multiply(item.quaternion));
    }
    where.copy(between(places, "hip")).multiplyScalar(scale);
    where.y -= floor;
    const hips = minus(rest.pelvis.at, between(atRest, "hip")).applyQuaternion(turn.pelvis).add(where);
    node.pelvis.position.copy(node.pelvis.parent.worldToLocal(hips));
    gltf.scene.updateMatrixWorld(true);
  }
  const feet = ["left_ankle", "right_ankle", "left_foot", "right_foot"].filter(name => node[name]);
  const placeOf = name => node[name].getWorldPosition(new THREE.Vector3());
  return {
    where,
    pose,
    placeOf,
    file: () => kept,
    tracks: () => [[bones.pelvis, "translation", node.pelvis.position], ...Object.entries(bones).map(([name, index]) => [index, "rotation", node[name].quaternion])],
    // the ground is where the feet are when they are low
    begin({ joints, parents }) {
      const frames = joints.length / (3 * parents.length), heights = [], sides = ["left", "right"], seen = [];
      for (let t = 0; t < frames; t += Math.max(1, Math.ceil(frames / 40))) seen.push(poseAt(joints, parents, t));
      const bends = seen.flatMap(pose => sides.map(side => bendOf(placesOf(pose), side))).sort((a, b) => a - b);
      const straight = Math.min(neutral.knee * Math.PI / 180, bends[Math.floor(0.05 * (bends.length - 1))]);
      excess = straight - 0.3 * (bendOf(atRest, "left") + bendOf(atRest, "right"));
      floor = 0;
      for (const now of seen) {
        pose(now);
        heights.push(Math.min(...feet.map(name => placeOf(name).y - rest[name].at.y)));
      }
      floor = heights.sort((a, b) => a - b)[Math.floor(0.1 * (heights.length - 1))];
    },
  };
}
