// The skin of a person, bent and shaped here instead of in a shader: where the processor draws, a shader repeats this for every pass and every shape of the face. Needs three.js as `THREE`.
const SHOWN = 1e-5;  // meters from which a shape of the face moves a vertex
const LIGHT = [1.9, 4, 2.8];  // where the sun is from the person's chest, as on the stage
const HEIGHT = 0.003;  // meters of the shadow above the ground
const EFFECT = 1e-3;  // strength from which a shape counts

/** The vertices that a shape of the face moves, and how far. */
function sparse({ array }) {
  const at = [], by = [];
  for (let vertex = 0; vertex < array.length; vertex += 3) {
    if (Math.abs(array[vertex]) + Math.abs(array[vertex + 1]) + Math.abs(array[vertex + 2]) < SHOWN) continue;
    at.push(vertex);
    by.push(array[vertex], array[vertex + 1], array[vertex + 2]);
  }
  return { at: Uint32Array.from(at), by: Float32Array.from(by) };
}

export class Skin {
  /** Takes the place of a skinned mesh, which stays as what holds bones and strengths. */
  constructor(mesh) {
    const { position, normal, uv, color, skinIndex, skinWeight } = mesh.geometry.attributes;
    this.from = mesh;
    this.rest = position.array;
    this.points = position.array.slice();  // with the face
    this.normals = normal.array;
    this.shapes = (mesh.geometry.morphAttributes.position || []).map(sparse);
    this.joints = Uint16Array.from(skinIndex.array, index => 16 * index);
    this.weights = Float32Array.from({ length: skinWeight.count * 4 }, (_, at) => [skinWeight.getX, skinWeight.getY, skinWeight.getZ, skinWeight.getW][at % 4].call(skinWeight, at >> 2));
    this.shaped = false;
    const geometry = this.geometry = new THREE.BufferGeometry(), moving = count => new THREE.BufferAttribute(new Float32Array(count), 3).setUsage(THREE.DynamicDrawUsage);
    geometry.setAttribute("position", moving(this.rest.length));
    geometry.setAttribute("normal", moving(this.rest.length));
    if (uv) geometry.setAttribute("uv", uv);
    if (color) geometry.setAttribute("color", color);
    geometry.setIndex(mesh.geometry.index);
    this.mesh = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ map: mesh.material.map, vertexColors: Boolean(color) }));
    const [x, y, z] = LIGHT, shade = { color: 0, transparent: true, opacity: 0.22, depthWrite: false, fog: false };
    const once = { stencilWrite: true, stencilFunc: THREE.EqualStencilFunc, stencilRef: 0, stencilZPass: THREE.IncrementStencilOp };
    this.shadow = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ ...shade, ...once }));  // the skin laid on the ground
    this.shadow.matrixAutoUpdate = false;
    this.shadow.matrix.set(1, -x / y, 0, 0, 0, 0, 0, HEIGHT, 0, -z / y, 1, 0, 0, 0, 0, 1);
    this.mesh.frustumCulled = this.shadow.frustumCulled = mesh.visible = false;
  }

  /** Shape the face by the strengths of the mesh. */
  shape() {
    const strengths = this.from.morphTargetInfluences || [], shown = this.shapes.some((_, index) => strengths[index] > EFFECT);
    if (!shown && !this.shaped) return;
    this.points.set(this.rest);
    this.shaped = shown;
    this.shapes.forEach(({ at, by }, index) => {
      const strength = strengths[index];
      if (strength > EFFECT) for (let one = 0; one < at.length; one++) for (let axis = 0; axis < 3; axis++) this.points[at[one] + axis] += strength * by[3 * one + axis];
    });
  }

  /** Bring the skin to where the bones are. */
  bend() {
    this.shape();
    this.from.skeleton.update();
    const bones = this.from.skeleton.boneMatrices, { points, normals, joints, weights } = this, m = new Float32Array(12);
    const { position, normal } = this.geometry.attributes, out = position.array, outward = normal.array;
    for (let at = 0, four = 0; at < points.length; at += 3, four += 4) {
      m.fill(0);
      for (let one = four; one < four + 4; one++) {
        const weight = weights[one], bone = joints[one];
        if (!weight) continue;
        for (let column = 0; column < 4; column++) for (let row = 0; row < 3; row++) m[3 * column + row] += weight * bones[bone + 4 * column + row];
      }
      let x = points[at], y = points[at + 1], z = points[at + 2];
      for (let row = 0; row < 3; row++) out[at + row] = m[row] * x + m[3 + row] * y + m[6 + row] * z + m[9 + row];
      x = normals[at]; y = normals[at + 1]; z = normals[at + 2];
      for (let row = 0; row < 3; row++) outward[at + row] = m[row] * x + m[3 + row] * y + m[6 + row] * z;
    }
    position.needsUpdate = normal.needsUpdate = true;
  }
}
